//! From a scene's lights to the lighting that both ends shade with.
//!
//! - [`Look::Full`]: see below.
//! - [`Look::Plain`]: the scene's own lights, exposed; a rig of two lights where the scene has none.
//! - [`Look::Flat`]: base colour under constant light, as other systems' frames show it.
//! - [`Look::FlatLit`]: the same with a directional light along (-0.5, -1, -0.35) through Burley's diffuse term, which reaches
//!   only faces with `0 < n.l < 0.5`, walls rather than floors.
//!
//! **Exposure.** Files give lux and candela, from a candle to the sun. All lights of a scene share one factor, fixed at time 0:
//! it takes the median irradiance over the middles of the scene's instances (each light at its distance, unshadowed) to
//! [`TYPICAL_IRRADIANCE`]. A white wall that faces it then has `c = 0.45 + 5 / pi = 2`, and `1 - exp(-c)` shows 0.87 of full
//! scale; in shadow it shows 0.36.
//!
//! **The full look** ([`Look::Full`]) is lit from all around by an environment, and by the scene's own lights where it has any; a scene to walk
//! in that has none keeps the key light of the rig, for its shadows, unless somebody chose its environment. Beside lights the studio is dimmed to `SKY_BESIDE_LIGHTS`, and
//! the lights' typical irradiance is `FULL_IRRADIANCE`: a white wall that faces them then shows its colour, by a tone that keeps colours.
//!
//! **Background.** A pale sky over scenes to walk in that have a sun (any directional light), else a dark grey; the flat
//! look's is black.

use std::sync::Arc;

use glam::DVec3;
use protocol::{Area, AreaShape, Light, Lighting, Look, Sky, Tone};
use scene::environment::Environment;
use scene::{LightArea, Scene, SceneLight, Snapshot};

use crate::sky::sky;

/// Where exposure takes a facing surface; see the module.
pub const TYPICAL_IRRADIANCE: f32 = 5.0;

/// See the module.
const FULL_IRRADIANCE: f32 = 2.2;
/// See the module.
const SKY_BESIDE_LIGHTS: f32 = 0.35;

/// Light from everywhere beside the scene's own lights: shadowed sides keep their shapes.
const AMBIENT: f32 = 0.45;

/// The flat look's constant light; the peers' frames were made with it.
const FLAT_AMBIENT: f32 = 0.35;

/// sRGB-encoded.
const SKY: [u8; 3] = [150, 176, 204];
const DARK: [u8; 3] = [28, 32, 40];

/// At most this many instances are asked for the irradiance at their middles.
const MAX_PROBES: usize = 512;

/// How a scene is lit over its life.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneLook {
    look: Look,
    /// From the file's units to exposed ones.
    exposure: f32,
    /// sRGB-encoded.
    background: [u8; 3],
    /// Of the full look.
    full: Option<Full>,
    walk: bool,
}

/// What only the full look has.
#[derive(Debug, Clone, PartialEq)]
struct Full {
    sky: Arc<Sky>,
    tone: Tone,
    /// What all light is multiplied by.
    exposure: f32,
    /// Whether somebody chose the environment: then it is all the light beside the scene's own.
    chosen: bool,
}

impl SceneLook {
    /// Exposes the scene's lights as they are at time 0; a full look is lit by the studio.
    pub fn new(scene: &Scene, look: Look) -> SceneLook {
        SceneLook::under(None, (Tone::Neutral, 1.0), scene, look)
    }

    /// The same, where a full look is lit by an environment (the studio without one) and shown by a tone, all light multiplied by an exposure. Any
    /// other look takes no notice of them.
    pub fn under(
        environment: Option<&Environment>,
        (tone, exposure): (Tone, f32),
        scene: &Scene,
        look: Look,
    ) -> SceneLook {
        let snapshot = scene.at(0.0);
        let probes = probes(scene, &snapshot);
        let sun = snapshot.lights.iter().any(|light| matches!(light, SceneLight::Directional { .. }));
        let full = (look == Look::Full).then(|| {
            let smoothest = scene.materials.iter().map(|material| material.smoothest(&scene.textures));
            let smoothest = smoothest.fold(1.0, f32::min);
            let filtered = match environment {
                Some(environment) => sky(environment, smoothest),
                None => sky(&Environment::studio(), smoothest),
            };
            Full { sky: Arc::new(filtered), tone, exposure, chosen: environment.is_some() }
        });
        SceneLook {
            look,
            exposure: self::exposure(&snapshot.lights, &probes, scene.bounds.radius_m()),
            background: if scene.walk && sun { SKY } else { DARK },
            full,
            walk: scene.walk,
        }
    }

    /// Light from all around, of the full look.
    pub fn sky(&self) -> Option<&Arc<Sky>> {
        self.full.as_ref().map(|full| &full.sky)
    }

    /// The lighting at a snapshot.
    pub fn lighting(&self, snapshot: &Snapshot) -> Lighting {
        match self.look {
            Look::Flat => flat(Vec::new()),
            Look::FlatLit => flat(vec![steep_light()]),
            Look::Full => self.full_lighting(snapshot),
            Look::Plain if snapshot.lights.is_empty() => default_rig(),
            Look::Plain => Lighting { background: self.background, ..exposed(&snapshot.lights, self.exposure) },
        }
    }
}

impl SceneLook {
    fn full_lighting(&self, snapshot: &Snapshot) -> Lighting {
        let Some(Full { tone, exposure, chosen, .. }) = self.full else { return default_rig() };
        let to_full = FULL_IRRADIANCE / TYPICAL_IRRADIANCE * exposure;
        let lighting = match snapshot.lights.is_empty() {
            false => exposed(&snapshot.lights, self.exposure * to_full),
            true if self.walk && !chosen => scaled(default_rig(), to_full),
            true => Lighting::default(),
        };
        let sky = if lighting.lights.is_empty() || chosen { 1.0 } else { SKY_BESIDE_LIGHTS };
        Lighting { ambient: [0.0; 3], sky: sky * exposure, tone, background: self.background, ..lighting }
    }
}

/// Lights from afar, brighter or darker.
fn scaled(lighting: Lighting, factor: f32) -> Lighting {
    let light = |light| match light {
        Light::Directional { direction_world, irradiance } => {
            Light::Directional { direction_world, irradiance: irradiance.map(|channel| channel * factor) }
        }
        light => light,
    };
    Lighting { lights: lighting.lights.into_iter().map(light).collect(), ..lighting }
}

fn unit(v: DVec3) -> [f32; 3] {
    v.normalize_or(DVec3::NEG_Y).as_vec3().to_array()
}

fn flat(lights: Vec<Light>) -> Lighting {
    Lighting { ambient: [FLAT_AMBIENT; 3], lights, background: [0; 3], burley: true, ..Lighting::default() }
}

fn steep_light() -> Light {
    Light::Directional { direction_world: unit(DVec3::new(-0.5, -1.0, -0.35)), irradiance: [2.0; 3] }
}

/// A warm key from above, a cool fill from the other side, and light from everywhere: shapes read from all sides.
fn default_rig() -> Lighting {
    let key = Light::Directional { direction_world: unit(DVec3::new(-0.45, -1.0, -0.6)), irradiance: [4.6, 4.4, 4.1] };
    let fill = Light::Directional { direction_world: unit(DVec3::new(0.8, -0.35, 0.5)), irradiance: [1.0, 1.1, 1.4] };
    Lighting {
        ambient: [0.42, 0.44, 0.48],
        lights: vec![key, fill],
        background: DARK,
        burley: false,
        ..Lighting::default()
    }
}

fn exposed(lights: &[SceneLight], exposure: f32) -> Lighting {
    let mut lights: Vec<Light> = lights.iter().map(|light| exposed_light(light, exposure)).collect();
    if lights.len() > Lighting::MAX_LIGHTS {
        tracing::warn!("the scene has {} lights; the {} strongest are kept", lights.len(), Lighting::MAX_LIGHTS);
        // A directional light, which lights all of the scene, comes before every lamp.
        let is_lamp = |light: &Light| matches!(light, Light::Point { .. });
        lights.sort_by(|a, b| is_lamp(a).cmp(&is_lamp(b)).then(strength(b).total_cmp(&strength(a))));
        lights.truncate(Lighting::MAX_LIGHTS);
    }
    Lighting { ambient: [AMBIENT; 3], lights, background: DARK, burley: false, ..Lighting::default() }
}

fn exposed_light(light: &SceneLight, exposure: f32) -> Light {
    match *light {
        SceneLight::Directional { direction_world, colour } => {
            Light::Directional { direction_world: unit(direction_world), irradiance: colour.map(|c| c * exposure) }
        }
        SceneLight::Point { position_world, colour, direction_world, spot_angles_rad, range_m, area } => Light::Point {
            position_world: position_world.to_array(),
            intensity: colour.map(|c| c * exposure),
            direction_world: unit(direction_world),
            spot_cos: spot_angles_rad.map_or([-1.0, -2.0], |angles| angles.map(f32::cos)),
            range_m,
            area: area.map(|LightArea { half_world, is_disc }| Area {
                half_world: half_world.map(|half| half.to_array()),
                shape: if is_disc { AreaShape::Disc } else { AreaShape::Rectangle },
            }),
        },
    }
}

/// Orders lights of one kind.
fn strength(light: &Light) -> f32 {
    match light {
        Light::Directional { irradiance, .. } => luminance(*irradiance),
        Light::Point { intensity, .. } => luminance(*intensity),
    }
}

fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Middles of instances, evenly picked.
fn probes(scene: &Scene, snapshot: &Snapshot) -> Vec<DVec3> {
    let step = scene.instances.len().div_ceil(MAX_PROBES).max(1);
    let middle = |(instance, world_from_mesh): (&scene::Instance, &glam::DAffine3)| {
        let [low, high] = scene.meshes[instance.mesh as usize].bounds.map(|corner| DVec3::from(corner.map(f64::from)));
        world_from_mesh.transform_point3((low + high) / 2.0)
    };
    scene.instances.iter().zip(&snapshot.world_from_mesh).step_by(step).map(middle).collect()
}

/// See the module. `radius_m` bounds how near a light counts: a hundredth of the scene.
fn exposure(lights: &[SceneLight], probes: &[DVec3], radius_m: f64) -> f32 {
    // Not 0 in a scene without extent. This square of a micrometre is the greater of the two in scenes with a radius of less than 1e-4 m.
    let nearest_squared = (radius_m / 100.0).powi(2).max(1e-12);
    let irradiance = |probe: &DVec3| -> f64 {
        let from = |light: &SceneLight| match *light {
            SceneLight::Directional { colour, .. } => f64::from(luminance(colour)),
            SceneLight::Point { position_world, colour, range_m, .. } => {
                let squared = position_world.distance_squared(*probe);
                let reach = squared.sqrt() / f64::from(range_m);
                let window = (1.0 - reach.powi(4)).clamp(0.0, 1.0);
                f64::from(luminance(colour)) * window / squared.max(nearest_squared)
            }
        };
        lights.iter().map(from).sum()
    };
    let mut values: Vec<f64> = probes.iter().map(irradiance).filter(|value| *value > 0.0).collect();
    values.sort_by(f64::total_cmp);
    let median = values.get(values.len() / 2).copied().unwrap_or(0.0);
    if median > 0.0 && median.is_finite() { (f64::from(TYPICAL_IRRADIANCE) / median) as f32 } else { 1.0 }
}

/// The mean of sRGB-encoded colours in linear light; alpha is averaged as it is.
pub fn average_srgb(colours: impl ExactSizeIterator<Item = [u8; 4]>) -> [u8; 4] {
    let count = colours.len().max(1) as f32;
    let linear = |code: u8| {
        let c = f32::from(code) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    let mut sum = [0.0_f32; 4];
    for [r, g, b, a] in colours {
        for (sum, value) in sum.iter_mut().zip([linear(r), linear(g), linear(b), f32::from(a) / 255.0]) {
            *sum += value;
        }
    }
    let [r, g, b, a] = sum.map(|sum| sum / count);
    let encoded = |c: f32| if c <= 0.0031308 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    [encoded(r), encoded(g), encoded(b), a].map(|c| (c * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bulb(position_world: DVec3, candela: f32) -> SceneLight {
        SceneLight::Point {
            position_world,
            colour: [candela; 3],
            direction_world: DVec3::NEG_Y,
            spot_angles_rad: None,
            range_m: f32::INFINITY,
            area: None,
        }
    }

    #[test]
    fn a_sun_and_a_bulb_are_exposed_alike() {
        let sun = SceneLight::Directional { direction_world: DVec3::NEG_Y, colour: [100_000.0; 3] };
        let probes = [DVec3::ZERO];
        assert!((exposure(&[sun], &probes, 10.0) * 100_000.0 - TYPICAL_IRRADIANCE).abs() < 1e-3);
        let exposure = exposure(&[bulb(DVec3::new(0.0, 2.0, 0.0), 100.0)], &probes, 10.0);
        assert!((exposure * 25.0 - TYPICAL_IRRADIANCE).abs() < 1e-3);
    }

    #[test]
    fn the_strongest_lights_are_kept() {
        let lights: Vec<SceneLight> = (0..40).map(|index| bulb(DVec3::ZERO, index as f32)).collect();
        let lighting = exposed(&lights, 1.0);
        assert_eq!(lighting.lights.len(), Lighting::MAX_LIGHTS);
        assert!(lighting.lights.iter().all(|light| strength(light) >= 24.0));
        let bright = |index: u32| bulb(DVec3::ZERO, 1e9 + index as f32);
        let sun = SceneLight::Directional { direction_world: DVec3::NEG_Y, colour: [1.0; 3] };
        let lights: Vec<SceneLight> = (0..40).map(bright).chain([sun]).collect();
        assert!(matches!(exposed(&lights, 1.0).lights[0], Light::Directional { .. }), "a sun lights all of the scene");
    }

    #[test]
    fn black_and_white_average_in_linear_light() {
        assert_eq!(average_srgb([[255; 4], [0, 0, 0, 255]].into_iter()), [188, 188, 188, 255]);
    }
}
