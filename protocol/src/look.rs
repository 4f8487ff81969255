//! How samples are shown: materials, lights, and the transfer from light to the screen.

use serde::{Deserialize, Serialize};

/// What shading needs beside a sample's own colour and normal. Scene materials that agree in it share one entry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Linear RGB emitted, in the lights' units.
    pub emissive: [f32; 3],
    /// 0 to 1.
    pub metallic: f32,
    /// 0 to 1.
    pub roughness: f32,
    /// Share of light that passes, 0 to 1 (glass above 0).
    pub transmission: f32,
    /// Index of refraction, 1 and more.
    pub ior: f32,
    /// Shown as its base colour, without lights.
    pub unlit: bool,
    /// Whether its normals face both ways.
    pub double_sided: bool,
}

/// What a surface shows of others, where it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Effect {
    /// Light along the mirrored direction, tinted by the base colour.
    Mirror,
    /// Light that passes both of its interfaces, tinted by the base colour.
    Glass,
}

impl Material {
    /// From this [`Material::metallic`] on, and up to [`Material::MIRROR_ROUGHNESS`], a surface is a mirror: a rougher one shows
    /// what is around as a blur, which is not drawn.
    pub const MIRROR_METALLIC: f32 = 0.9;
    /// See [`Material::MIRROR_METALLIC`].
    pub const MIRROR_ROUGHNESS: f32 = 0.1;
    /// From this [`Material::transmission`] on a surface is glass; below it, most of its light is its own.
    pub const GLASS_TRANSMISSION: f32 = 0.5;

    /// What it shows of other surfaces; `None` of a plain one. Metal lets no light pass, so a mirror comes first.
    pub fn effect(&self) -> Option<Effect> {
        if self.metallic >= Material::MIRROR_METALLIC && self.roughness <= Material::MIRROR_ROUGHNESS {
            Some(Effect::Mirror)
        } else if self.transmission >= Material::GLASS_TRANSMISSION {
            Some(Effect::Glass)
        } else {
            None
        }
    }
}

impl Default for Material {
    /// Plain, rough and opaque.
    fn default() -> Self {
        Material {
            emissive: [0.0; 3],
            metallic: 0.0,
            roughness: 1.0,
            transmission: 0.0,
            ior: 1.5,
            unlit: false,
            double_sided: false,
        }
    }
}

/// A light without extent. Colours are linear RGB times strength, already in exposed units (see [`Lighting`]).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Light {
    /// Light from infinitely far along `direction_world` (the way it travels, unit length).
    Directional {
        /// Unit vector.
        direction_world: [f32; 3],
        /// Irradiance on a facing surface.
        irradiance: [f32; 3],
    },
    /// A point or, with angles, a spot. Irradiance falls with the square of the distance in metres.
    Point {
        /// In world space.
        position_world: [f64; 3],
        /// Radiant intensity.
        intensity: [f32; 3],
        /// Unit vector, the way a spot points.
        direction_world: [f32; 3],
        /// Cosines of a spot's inner and outer half angle; `[-1, -2]`, which no direction misses, for a point light.
        spot_cos: [f32; 2],
        /// Metres after which it has no effect; infinite where unlimited.
        range_m: f32,
    },
}

/// Which transfer the picture uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Look {
    /// The scene's lights, or the default rig where it has none.
    #[default]
    Default,
    /// Base colour under constant light, so that frames compare with other systems'.
    Flat,
    /// As [`Look::Flat`], with a directional light that reaches only steep faces: some of those systems' scenes have it.
    FlatLit,
}

/// Everything that lights a scene at a time: `shown = sRGB(1 - exp(-c))` with
/// `c = emissive + base * (ambient + sum of diffuse light)`; unlit materials show their base colour as it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lighting {
    /// Linear RGB from everywhere.
    pub ambient: [f32; 3],
    /// At most [`Lighting::MAX_LIGHTS`].
    pub lights: Vec<Light>,
    /// sRGB-encoded colour where there is no surface.
    pub background: [u8; 3],
    /// 0: Lambert. 1: the retro-reflecting diffuse term of Burley 2012 at roughness 1, as [`Look::FlatLit`] needs it.
    pub burley: bool,
}

impl Lighting {
    /// What a client draws at most; a server keeps the strongest and says so.
    pub const MAX_LIGHTS: usize = 16;
}
