//! The Rust twins of the WGSL structs that both ends use. A test compares them with the WGSL, field by field.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::{DAffine3, DMat3, DVec3, Mat3};
use protocol::{Light, Lighting, Material, Sky, Tone};

/// `Pinhole` of `camera/pinhole.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct PinholeUniform {
    /// Columns, each padded to four.
    pub eye_from_world: [[f32; 4]; 3],
    /// The eye relative to the anchor, metres, world axes.
    pub eye_anchor: [f32; 3],
    /// Metres.
    pub near_m: f32,
    /// Pixels.
    pub centre_px: [f32; 2],
    /// Pixels.
    pub size_px: [f32; 2],
    /// Pixels.
    pub focal_px: f32,
    /// Unused.
    pub padding: [f32; 3],
}

impl PinholeUniform {
    /// The camera as seen from `anchor_world`; the difference is taken in f64.
    pub fn new(camera: &Pinhole, anchor_world: DVec3) -> PinholeUniform {
        let eye_from_world = Mat3::from_quat(camera.world_from_eye.rotation.conjugate().as_quat());
        PinholeUniform {
            eye_from_world: columns(eye_from_world),
            eye_anchor: (camera.world_from_eye.translation - anchor_world).as_vec3().to_array(),
            near_m: camera.near_m as f32,
            centre_px: camera.centre_px.as_vec2().to_array(),
            size_px: [camera.width_px as f32, camera.height_px as f32],
            focal_px: camera.focal_px as f32,
            padding: [0.0; 3],
        }
    }
}

/// The columns of a WGSL `mat3x3f`.
pub fn columns(matrix: Mat3) -> [[f32; 4]; 3] {
    [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|column| column.extend(0.0).to_array())
}

/// The rows of an affine map: what a point `(x, y, z, 1)` is multiplied by.
pub type Rows = [[f32; 4]; 3];

/// See [`Rows`].
pub fn rows(map: DAffine3) -> Rows {
    let linear = map.matrix3.transpose();
    let row = |axis: DVec3, offset: f64| axis.extend(offset).as_vec4().to_array();
    [
        row(linear.x_axis, map.translation.x),
        row(linear.y_axis, map.translation.y),
        row(linear.z_axis, map.translation.z),
    ]
}

/// What normals are multiplied by where places are by `linear`. The cofactor matrix turns normals even where the map flattens space; scaled so that f32 holds it. Its sign makes normals of
/// a mirrored mesh point outwards.
pub fn normal_matrix(linear: DMat3) -> DMat3 {
    let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let largest = cofactors.to_cols_array().into_iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let scale = if largest > 0.0 { linear.determinant().signum() / largest } else { 1.0 };
    cofactors * scale
}

/// `Light` of `common/shade.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct LightUniform {
    /// Relative to the output eye, world axes.
    pub position: [f32; 3],
    /// 0 directional, 1 point or spot.
    pub kind: u32,
    /// Irradiance or radiant intensity.
    pub colour: [f32; 3],
    /// 1/m; 0 where unlimited.
    pub inverse_range: f32,
    /// The way the light travels.
    pub direction: [f32; 3],
    /// Cosine of the inner half angle.
    pub spot_cos_inner: f32,
    /// Cosine of the outer half angle.
    pub spot_cos_outer: f32,
    /// 1 and the channel of the picture that says where the light arrives; 0 where it arrives everywhere.
    pub shadow: u32,
    /// Unused.
    pub padding: [f32; 2],
}

/// `Lighting` of `common/shade.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct LightingUniform {
    /// Linear RGB from everywhere.
    pub ambient: [f32; 3],
    /// How many of `lights` count.
    pub light_count: u32,
    /// sRGB-encoded, 0 to 1.
    pub background: [f32; 3],
    /// 1 for Burley's diffuse term.
    pub burley: u32,
    /// [`Sky::diffuse`], each padded to four.
    pub sky_diffuse: [[f32; 4]; Sky::HARMONICS],
    /// [`Lighting::sky`].
    pub sky: f32,
    /// [`Sky::first_level`].
    pub sky_first_level: u32,
    /// 0 exponential, 1 neutral, 2 ACES, 3 none.
    pub tone: u32,
    /// What all light is multiplied by before the tone.
    pub exposure: f32,
    /// How much of what hides ambient light counts, 0 to 1.
    pub occlusion_strength: f32,
    /// How much of what hides single lights counts, 0 to 1.
    pub shadow_strength: f32,
    /// Unused.
    pub padding: [f32; 2],
    /// At most [`Lighting::MAX_LIGHTS`].
    pub lights: [LightUniform; Lighting::MAX_LIGHTS],
}

impl LightingUniform {
    /// The lighting as seen from an eye. Lights past [`Lighting::MAX_LIGHTS`] are left out; a sky that is not there does not shine.
    pub fn new(lighting: &Lighting, sky: Option<&Sky>, eye_world: DVec3) -> LightingUniform {
        let mut lights = [LightUniform::zeroed(); Lighting::MAX_LIGHTS];
        for (uniform, light) in lights.iter_mut().zip(&lighting.lights) {
            *uniform = LightUniform::new(light, eye_world);
        }
        LightingUniform {
            ambient: lighting.ambient,
            light_count: lighting.lights.len().min(Lighting::MAX_LIGHTS) as u32,
            background: lighting.background.map(|value| f32::from(value) / 255.0),
            burley: u32::from(lighting.burley),
            sky_diffuse: sky.map_or([[0.0; 4]; Sky::HARMONICS], |sky| sky.diffuse.map(|[r, g, b]| [r, g, b, 0.0])),
            sky: if sky.is_some() { lighting.sky } else { 0.0 },
            sky_first_level: sky.map_or(0, |sky| sky.first_level.into()),
            tone: match lighting.tone {
                Tone::Exponential => 0,
                Tone::Neutral => 1,
                Tone::Aces => 2,
                Tone::Cut => 3,
            },
            exposure: 1.0,
            occlusion_strength: 1.0,
            shadow_strength: 1.0,
            padding: [0.0; 2],
            lights,
        }
    }
}

impl LightUniform {
    fn new(light: &Light, eye_world: DVec3) -> LightUniform {
        match *light {
            Light::Directional { direction_world, irradiance } => {
                LightUniform { kind: 0, colour: irradiance, direction: direction_world, ..LightUniform::zeroed() }
            }
            Light::Point { position_world, intensity, direction_world, spot_cos, range_m, .. } => LightUniform {
                position: (DVec3::from(position_world) - eye_world).as_vec3().to_array(),
                kind: 1,
                colour: intensity,
                inverse_range: if range_m.is_finite() && range_m > 0.0 { 1.0 / range_m } else { 0.0 },
                direction: direction_world,
                spot_cos_inner: spot_cos[0],
                spot_cos_outer: spot_cos[1],
                shadow: 0,
                padding: [0.0; 2],
            },
        }
    }
}

/// `Material` of `common/shade.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct MaterialUniform {
    /// Linear RGB.
    pub emissive: [f32; 3],
    /// 0 to 1.
    pub metallic: f32,
    /// 0 to 1.
    pub roughness: f32,
    /// 0 to 1.
    pub transmission: f32,
    /// 1 and more.
    pub ior: f32,
    /// [`MaterialUniform::UNLIT`], [`MaterialUniform::DOUBLE_SIDED`], [`MaterialUniform::THIN`], [`MaterialUniform::ROUGH_MIRROR`]; from [`MaterialUniform::STRAIGHT_SHIFT`] on eight bits a channel, the roots
    /// of what is mirrored of light that falls straight on.
    pub flags: u32,
    /// 0 to 1.
    pub occlusion: f32,
    /// 0 to 1.
    pub grazing: f32,
    /// 0 to 1.
    pub clearcoat: f32,
    /// 0 to 1.
    pub clearcoat_roughness: f32,
    /// Linear RGB.
    pub sheen: [f32; 3],
    /// 0 to 1.
    pub sheen_roughness: f32,
}

impl MaterialUniform {
    /// Shown as its base colour.
    pub const UNLIT: u32 = 1;
    /// Its normals face both ways.
    pub const DOUBLE_SIDED: u32 = 2;
    /// Light passes it straight on.
    pub const THIN: u32 = 4;
    /// Rays bring what it mirrors.
    pub const ROUGH_MIRROR: u32 = 8;
    /// See [`MaterialUniform::flags`].
    pub const STRAIGHT_SHIFT: u32 = 8;
    /// Entries of the table in a uniform buffer: one a material code of a sample. 16 KiB, as much as any device binds at once.
    pub const TABLE_LEN: usize = 256;

    /// The table that shaders index by a sample's material code; entries past `materials` are the default.
    pub fn table(materials: &[Material]) -> Vec<MaterialUniform> {
        let default = MaterialUniform::from(&Material::default());
        let used = materials.iter().map(MaterialUniform::from);
        used.chain(std::iter::repeat(default)).take(MaterialUniform::TABLE_LEN).collect()
    }

    /// The same where rays bring what rough mirrors show.
    pub fn table_with_rays(materials: &[Material]) -> Vec<MaterialUniform> {
        let mut table = MaterialUniform::table(materials);
        for (uniform, material) in table.iter_mut().zip(materials) {
            uniform.flags |= if material.is_rough_mirror() { MaterialUniform::ROUGH_MIRROR } else { 0 };
        }
        table
    }
}

impl From<&Material> for MaterialUniform {
    fn from(material: &Material) -> MaterialUniform {
        let unlit = if material.unlit { MaterialUniform::UNLIT } else { 0 };
        let double_sided = if material.double_sided { MaterialUniform::DOUBLE_SIDED } else { 0 };
        let thin = if material.thin { MaterialUniform::THIN } else { 0 };
        // By their roots, 0.04 and most others are exact.
        let root = |share: f32| (255.0 * share.clamp(0.0, 1.0).sqrt()).round() as u32;
        let [red, green, blue] = material.straight.map(root);
        let straight = red | green << 8 | blue << 16;
        MaterialUniform {
            emissive: material.emissive,
            metallic: material.metallic,
            roughness: material.roughness,
            transmission: material.transmission,
            ior: material.ior,
            flags: unlit | double_sided | thin | straight << MaterialUniform::STRAIGHT_SHIFT,
            occlusion: material.occlusion,
            grazing: material.grazing,
            clearcoat: material.clearcoat,
            clearcoat_roughness: material.clearcoat_roughness,
            sheen: material.sheen,
            sheen_roughness: material.sheen_roughness,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shaders::assert_layout;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        let pinhole = "camera/pinhole.wgsl";
        assert_layout!(
            PinholeUniform,
            pinhole,
            "Pinhole",
            eye_from_world,
            eye_anchor,
            near_m,
            centre_px,
            size_px,
            focal_px
        );
        let shade = "common/shade.wgsl";
        assert_layout!(
            LightUniform,
            shade,
            "Light",
            position,
            kind,
            colour,
            inverse_range,
            direction,
            spot_cos_inner,
            spot_cos_outer,
            shadow
        );
        assert_layout!(
            LightingUniform,
            shade,
            "Lighting",
            ambient,
            light_count,
            background,
            burley,
            sky_diffuse,
            sky,
            sky_first_level,
            tone,
            exposure,
            occlusion_strength,
            shadow_strength,
            lights
        );
        assert_layout!(
            MaterialUniform,
            shade,
            "Material",
            emissive,
            metallic,
            roughness,
            transmission,
            ior,
            flags,
            occlusion,
            grazing,
            clearcoat,
            clearcoat_roughness,
            sheen,
            sheen_roughness
        );
    }

    #[test]
    fn normals_of_a_mirrored_and_stretched_mesh_stay_normal() {
        let linear = DMat3::from_cols(DVec3::new(-2.0, 0.0, 0.0), DVec3::new(0.5, 1.0, 0.0), DVec3::new(0.0, 0.0, 3.0));
        let (a, b) = (DVec3::new(0.3, 1.0, -2.0), DVec3::new(1.0, 0.2, 0.7));
        let normal = a.cross(b);
        let mapped = normal_matrix(linear) * normal;
        assert!(mapped.dot(linear * a).abs() < 1e-12 && mapped.dot(linear * b).abs() < 1e-12);
        // On the side that the mapped normal vector itself is on.
        assert!(mapped.dot(linear * normal) > 0.0);
    }
}
