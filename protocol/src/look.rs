//! How samples are shown: materials, lights, and the transfer from light to the screen.

use glam::DVec3;
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
    /// Whether that light passes straight on, as through a pane ([`crate::Purpose::Layer`]).
    pub thin: bool,
    /// Index of refraction, 1 and more.
    pub ior: f32,
    /// What a surface that is no metal mirrors of light that falls straight on, linear RGB, 0 to 1, and of light that grazes it.
    pub straight: [f32; 3],
    /// See [`Material::straight`].
    pub grazing: f32,
    /// The share of light from all around that its form lets arrive, 0 to 1.
    pub occlusion: f32,
    /// The share of its clear coat, 0 to 1, and the coat's own roughness.
    pub clearcoat: f32,
    /// 0 to 1.
    pub clearcoat_roughness: f32,
    /// What fibres on it scatter at grazing angles, linear RGB, 0 to 1.
    pub sheen: [f32; 3],
    /// 0 to 1.
    pub sheen_roughness: f32,
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
    /// From this [`Material::metallic`] on, and up to [`Material::MIRROR_ROUGHNESS`], a surface is a mirror.
    pub const MIRROR_METALLIC: f32 = 0.9;
    /// See [`Material::MIRROR_METALLIC`].
    pub const MIRROR_ROUGHNESS: f32 = 0.1;
    /// Up to this roughness a metal is a rough mirror. Half of the facets of a rougher one lean by more than 14 degrees, so that half of what it mirrors
    /// comes from more than 28 degrees beside the mirrored direction: little is told in that.
    pub const ROUGH_MIRROR_ROUGHNESS: f32 = 0.5;
    /// From this [`Material::transmission`] on a surface is glass; below it, most of its light is its own.
    pub const GLASS_TRANSMISSION: f32 = 0.5;

    /// What it shows of other surfaces; `None` of a plain one. Metal lets no light pass, so a mirror comes first.
    pub fn effect(&self) -> Option<Effect> {
        if self.metallic >= Material::MIRROR_METALLIC && self.roughness <= Material::MIRROR_ROUGHNESS {
            Some(Effect::Mirror)
        } else if self.transmission >= Material::GLASS_TRANSMISSION && !self.thin {
            Some(Effect::Glass)
        } else {
            None
        }
    }

    /// Whether it shows what is near as a blur: metals between mirrors and [`Material::ROUGH_MIRROR_ROUGHNESS`]. Only the full look has such; the
    /// plain one shows them as any other surface.
    pub fn is_rough_mirror(&self) -> bool {
        self.metallic >= Material::MIRROR_METALLIC
            && self.roughness > Material::MIRROR_ROUGHNESS
            && self.roughness <= Material::ROUGH_MIRROR_ROUGHNESS
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
            thin: false,
            ior: 1.5,
            straight: [0.04; 3],
            grazing: 1.0,
            occlusion: 1.0,
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            sheen: [0.0; 3],
            sheen_roughness: 0.0,
            unlit: false,
            double_sided: false,
        }
    }
}

/// A light. Colours are linear RGB times strength, already in exposed units (see [`Lighting`]).
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
        /// The surface that it shines from; `None` of a light without extent. A surface point is lit as by all of the light in
        /// its middle, `position_world`, times the share of the area that the point sees.
        area: Option<Area>,
    },
}

impl Light {
    /// What it brings to a place, as it were in its middle: luminance of its irradiance. Clients and servers rank lights by it.
    pub fn strength_at(&self, place_world: DVec3) -> f64 {
        let luminance = |[r, g, b]: [f32; 3]| f64::from(0.2126 * r + 0.7152 * g + 0.0722 * b);
        match self {
            Light::Directional { irradiance, .. } => luminance(*irradiance),
            Light::Point { position_world, intensity, .. } => {
                // As near as the look lets a surface be to a light: a centimetre, as in `common/shade.wgsl`.
                luminance(*intensity) / DVec3::from(*position_world).distance_squared(place_world).max(1e-4)
            }
        }
    }
}

/// The surface of a light, around its position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Area {
    /// From the middle to the middles of two sides of the rectangle, or along two radii of the disc that touches them; in world
    /// space, at right angles. Its front is where their cross product points.
    pub half_world: [[f64; 3]; 2],
    /// Rectangle or disc.
    pub shape: AreaShape,
}

/// What is lit up of the rectangle of an [`Area`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum AreaShape {
    /// All of it.
    Rectangle,
    /// The ellipse in it.
    Disc,
}

impl Area {
    /// The corners of the rectangle, from `middle_world`, in the order of their parameters `(-1, -1)`, `(1, -1)`, `(-1, 1)`, `(1, 1)`.
    /// They bound a disc too.
    pub fn corners_world(&self, middle_world: DVec3) -> [DVec3; 4] {
        [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(s, t)| self.at(middle_world, s, t))
    }

    /// The points that stand for it: `side * side` of equal shares, row by row. Those of a rectangle are the middles of a
    /// grid's cells; a disc's are the same, taken to the disc so that areas keep their proportions (Shirley, Chiu, *A low
    /// distortion map between disk and square*, 1997).
    pub fn points_world(&self, middle_world: DVec3, side: u32) -> impl Iterator<Item = DVec3> + use<> {
        let area = *self;
        let parameter = move |index: u32| (2.0 * f64::from(index) + 1.0) / f64::from(side) - 1.0;
        (0..side * side).map(move |index| {
            let (s, t) = (parameter(index % side), parameter(index / side));
            let (s, t) = if area.shape == AreaShape::Disc { disc_from_square(s, t) } else { (s, t) };
            area.at(middle_world, s, t)
        })
    }

    /// A point of the rectangle, by shares of its half sides.
    pub fn at(&self, middle_world: DVec3, s: f64, t: f64) -> DVec3 {
        let [u, v] = self.half_world.map(DVec3::from);
        middle_world + u * s + v * t
    }

    /// Whether its sides are finite.
    pub fn is_finite(&self) -> bool {
        self.half_world.iter().flatten().all(|number| number.is_finite())
    }
}

/// From `[-1, 1]²` to the unit disc: rings to rings.
fn disc_from_square(s: f64, t: f64) -> (f64, f64) {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    if s == 0.0 && t == 0.0 {
        return (0.0, 0.0);
    }
    let (radius, angle) =
        if s.abs() > t.abs() { (s, FRAC_PI_4 * (t / s)) } else { (t, FRAC_PI_2 - FRAC_PI_4 * (s / t)) };
    (radius * angle.cos(), radius * angle.sin())
}

/// Which transfer the picture uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Look {
    /// Base colours under the scene's lights, or the default rig where it has none.
    #[default]
    Plain,
    /// Metallic and rough materials under light from all around ([`crate::Sky`]) and the scene's lights, if it has any.
    Full,
    /// Base colour under constant light, so that frames compare with other systems'.
    Flat,
    /// As [`Look::Flat`], with a directional light that reaches only steep faces: some of those systems' scenes have it.
    FlatLit,
}

/// From light to the linear colours of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Tone {
    /// `1 - exp(-c)`: no light is white.
    #[default]
    Exponential,
    /// The Khronos PBR neutral tone mapper (2024): base colours up to 0.8 stay what they are.
    Neutral,
    /// The curve of films that ACES describes, as fitted by Narkowicz, *ACES filmic tone mapping curve*, 2015.
    Aces,
    /// None: light above 1 is cut.
    Cut,
}

/// Everything that lights a scene at a time: `shown = sRGB(tone(c))`.
///
/// - The *plain look*, where no sky shines: `c = emissive + base * (ambient + sum of diffuse light)`; unlit materials show their base colour as it is.
/// - The *full look*, under a sky ([`crate::Sky`]): materials of glTF 2.0 (appendix B), metallic and rough, that mirror the lights and the sky.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Lighting {
    /// Linear RGB from everywhere.
    pub ambient: [f32; 3],
    /// What the light of the sky is multiplied by; 0: none shines, and the look is plain.
    pub sky: f32,
    /// From light to the picture.
    pub tone: Tone,
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
    /// The most lights that cast shadows: those that bring the most to the viewer.
    pub const MAX_CASTING: usize = 4;

    /// Whether light comes from all around, which what stands near may keep off.
    pub fn is_around(&self) -> bool {
        self.sky > 0.0 || self.ambient.iter().any(|&ambient| ambient > 0.0)
    }

    /// The lights that bring anything to a place, the strongest first, by their numbers.
    pub fn strongest_at(&self, place_world: DVec3) -> Vec<usize> {
        let strengths = self.lights.iter().take(Lighting::MAX_LIGHTS).map(|light| light.strength_at(place_world));
        let mut lights: Vec<(usize, f64)> = strengths.enumerate().filter(|(_, strength)| *strength > 0.0).collect();
        lights.sort_by(|a, b| b.1.total_cmp(&a.1));
        lights.into_iter().map(|(light, _)| light).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: [[f64; 3]; 2] = [[2.0, 0.0, 0.0], [0.0, 0.0, 0.5]];

    #[test]
    fn points_of_a_rectangle_are_the_middles_of_its_cells() {
        let area = Area { half_world: HALF, shape: AreaShape::Rectangle };
        let middle = DVec3::new(1.0, 5.0, -1.0);
        let points: Vec<DVec3> = area.points_world(middle, 4).collect();
        assert_eq!(points.len(), 16);
        assert_eq!(points[0], middle + DVec3::new(-1.5, 0.0, -0.375));
        assert_eq!(points[1] - points[0], DVec3::X);
        assert_eq!(points[4] - points[0], DVec3::Z * 0.25);
        assert_eq!(area.points_world(middle, 1).collect::<Vec<_>>(), [middle]);
        assert_eq!(area.corners_world(middle)[3], middle + DVec3::new(2.0, 0.0, 0.5));
    }

    #[test]
    fn points_of_a_disc_share_its_area_evenly() {
        let area = Area { half_world: HALF, shape: AreaShape::Disc };
        let points: Vec<DVec3> = area.points_world(DVec3::ZERO, 32).map(|p| p / DVec3::new(2.0, 1.0, 0.5)).collect();
        assert!(points.iter().all(|p| p.length() < 1.0));
        // A disc's share within a radius is its square.
        for radius in [0.25, 0.5, 0.75] {
            let share = points.iter().filter(|p| p.length() < radius).count() as f64 / 1024.0;
            assert!((share - radius * radius).abs() < 0.03, "{share} within {radius}");
        }
        let right = points.iter().filter(|p| p.x > p.z.abs()).count();
        assert!((240..=272).contains(&right), "{right} of 1,024 in a quarter");
    }
}
