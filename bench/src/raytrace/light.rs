//! The look, written anew from the words of [`protocol::Lighting`]: `shown = sRGB(tone(c))`; in the plain look with
//! `c = emissive + base * (ambient + sum of diffuse light)`, in the full one as [`super::full`] has it.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use protocol::{Light, Lighting, Tone};
use scene::environment::Environment;

use super::full::{Around, FullSky, Shaded};
use super::srgb::linear_from_srgb;
use super::tone;

/// The lights of a scene, in f64.
pub(super) struct Lights {
    ambient: DVec3,
    lights: Vec<Light>,
    burley: bool,
    tone: Tone,
    /// Of the full look.
    sky: Option<FullSky>,
    /// What arrives where a ray leaves the scene.
    pub background: DVec3,
}

fn rgb(colour: [f32; 3]) -> DVec3 {
    colour.map(f64::from).into()
}

impl Lights {
    /// Under an environment, if the look is full.
    pub fn new(lighting: &Lighting, environment: Option<&Environment>) -> Lights {
        let sky = environment.filter(|_| lighting.sky > 0.0);
        let background = lighting.background.map(|code| linear_from_srgb(f64::from(code) / 255.0));
        Lights {
            ambient: rgb(lighting.ambient),
            lights: lighting.lights.clone(),
            burley: lighting.burley,
            tone: lighting.tone,
            sky: sky.map(|environment| FullSky::new(environment, lighting.sky.into())),
            background: tone::light_shown_as(lighting.tone, background.into()),
        }
    }

    /// Linear colour on the screen, 0 to 1, of exposed light.
    pub fn shown(&self, light: DVec3) -> DVec3 {
        tone::shown(self.tone, light)
    }

    /// The light that is shown as a linear colour.
    pub fn shown_as(&self, linear: DVec3) -> DVec3 {
        tone::light_shown_as(self.tone, linear)
    }

    pub fn is_full(&self) -> bool {
        self.sky.is_some()
    }

    /// The light of a surface without lights: in the plain look what is shown as its base colour, in the full one that colour.
    pub fn of_unlit(&self, base: DVec3) -> DVec3 {
        if self.is_full() { base } else { self.shown_as(base) }
    }

    /// What a surface sends back in the full look along a ray that came along `direction` (unit length).
    pub fn full(
        &self,
        p_world: DVec3,
        surface: &Shaded,
        normal: DVec3,
        direction: DVec3,
        around: Around<'_>,
        arrives: impl Fn(DVec3, f64) -> bool,
    ) -> DVec3 {
        let Some(sky) = &self.sky else { return DVec3::ZERO };
        let of_lamps = self.arriving(p_world, normal, arrives);
        let of_lamps =
            of_lamps.map(|(to_light, irradiance)| irradiance * sky.of_lamp(surface, normal, -direction, to_light));
        surface.emissive + sky.leaving(surface, normal, -direction, around) + of_lamps.sum::<DVec3>()
    }

    /// What a surface sends back along a ray that came along `direction` (unit length), per unit of base colour. `arrives` tells
    /// whether a light arrives from along a unit vector and a distance.
    pub fn diffuse(
        &self,
        p_world: DVec3,
        normal: DVec3,
        direction: DVec3,
        arrives: impl Fn(DVec3, f64) -> bool,
    ) -> DVec3 {
        let from = |(to_light, irradiance): (DVec3, DVec3)| {
            let n_l = normal.dot(to_light);
            let factor = if self.burley { steep_burley(n_l, normal, to_light, -direction) } else { 1.0 };
            irradiance * (n_l * FRAC_1_PI * factor)
        };
        self.ambient + self.arriving(p_world, normal, arrives).map(from).sum::<DVec3>()
    }

    /// The unit vectors towards the lights that arrive at a surface, each with its irradiance on what faces it.
    fn arriving(
        &self,
        p_world: DVec3,
        normal: DVec3,
        arrives: impl Fn(DVec3, f64) -> bool,
    ) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.lights.iter().filter_map(move |light| {
            let (to_light, irradiance) = arriving(light, p_world);
            let distance_m = match light {
                Light::Directional { .. } => f64::INFINITY,
                Light::Point { position_world, .. } => DVec3::from(*position_world).distance(p_world),
            };
            (normal.dot(to_light) > 0.0 && arrives(to_light, distance_m)).then_some((to_light, irradiance))
        })
    }
}

/// The unit vector towards a light, and its irradiance on a facing surface.
fn arriving(light: &Light, p_world: DVec3) -> (DVec3, DVec3) {
    match *light {
        Light::Directional { direction_world, irradiance } => (-rgb(direction_world), rgb(irradiance)),
        Light::Point { position_world, intensity, direction_world, spot_cos, range_m, .. } => {
            let offset = DVec3::from(position_world) - p_world;
            // The look's own bound: a surface at the light is lit as from a centimetre.
            let squared = offset.length_squared().max(1e-4);
            let to_light = offset / squared.sqrt();
            let reach = squared / f64::from(range_m).powi(2);
            let window = (1.0 - reach * reach).clamp(0.0, 1.0);
            let [inner, outer] = spot_cos.map(f64::from);
            // The look's least width of a spot's rim.
            let spot = (((-to_light).dot(rgb(direction_world)) - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
            (to_light, rgb(intensity) * (spot * spot * window / squared))
        }
    }
}

/// Burley, Physically-Based Shading at Disney, 2012, section 5.3, at roughness 1, on steep faces only.
fn steep_burley(n_l: f64, normal: DVec3, to_light: DVec3, to_eye: DVec3) -> f64 {
    if n_l >= 0.5 {
        return 0.0;
    }
    let l_h = to_light.dot((to_light + to_eye).normalize_or_zero()).clamp(0.0, 1.0);
    let n_v = normal.dot(to_eye).clamp(0.0, 1.0);
    let fd90 = 0.5 + 2.0 * l_h * l_h;
    let lobe = |cosine: f64| 1.0 + (fd90 - 1.0) * (1.0 - cosine).powi(5);
    lobe(n_l) * lobe(n_v)
}

#[cfg(test)]
mod tests {
    use super::super::srgb::code_from_linear;
    use super::*;

    #[test]
    fn every_background_is_shown_as_itself() {
        for code in 0..=255u8 {
            let lighting = Lighting {
                ambient: [0.0; 3],
                lights: Vec::new(),
                background: [code; 3],
                burley: false,
                ..Lighting::default()
            };
            let lights = Lights::new(&lighting, None);
            assert_eq!(code_from_linear(lights.shown(lights.background)), [code; 3]);
        }
    }
}
