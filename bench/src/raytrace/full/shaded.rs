//! What a material is at a place.

use glam::DVec3;

use super::lobes::{Albedo, Pair};

/// The numbers of a material, with those of its textures.
#[derive(Debug, Clone, Copy)]
pub(in crate::raytrace) struct Shaded {
    /// Linear RGB.
    pub base: DVec3,
    pub metallic: f64,
    pub roughness: f64,
    pub occlusion: f64,
    /// Linear RGB.
    pub emissive: DVec3,
    /// Mirrored of light that falls straight on, linear RGB, and of light that grazes: where it is no metal.
    pub straight: DVec3,
    pub grazing: f64,
    pub coat: f64,
    pub coat_roughness: f64,
    /// Linear RGB.
    pub sheen: DVec3,
    pub sheen_roughness: f64,
    /// Of a pane, the share of light that goes on behind it.
    pub passing: f64,
}

fn schlick(straight: DVec3, grazing: f64, cosine: f64) -> DVec3 {
    straight + (DVec3::splat(grazing) - straight) * (1.0 - cosine).powi(5)
}

/// Of a coat, whose index of refraction is 1.5.
pub(super) fn coat_fresnel(cosine: f64) -> f64 {
    schlick(DVec3::splat(0.04), 1.0, cosine).x
}

impl Shaded {
    /// What it mirrors, of facets that are lit at this cosine.
    pub fn fresnel(&self, l_h: f64) -> DVec3 {
        schlick(self.straight, self.grazing, l_h).lerp(schlick(self.base, 1.0, l_h), self.metallic)
    }

    /// What it scatters, times pi: of a dielectric, what the surface lets in.
    pub(super) fn diffuse(&self, pair: &Pair) -> DVec3 {
        let mirrored = schlick(self.straight, self.grazing, pair.l_h).max_element();
        self.base * ((1.0 - self.passing) * (1.0 - self.metallic) * (1.0 - mirrored))
    }

    /// What passes of the light behind it, of a pane that is seen at this cosine: what it does not mirror, tinted.
    pub fn passing(&self, n_v: f64) -> DVec3 {
        let mirrored = schlick(self.straight, self.grazing, n_v.clamp(0.0, 1.0)).max_element();
        self.base * (self.passing * (1.0 - self.metallic) * (1.0 - mirrored))
    }

    /// What comes back after several facets, times pi.
    pub(super) fn lost(&self, pair: &Pair, albedo: &Albedo) -> DVec3 {
        let mean = albedo.facets_mean(self.roughness);
        let [of_eye, of_light] = [pair.n_v, pair.n_l].map(|cosine| 1.0 - albedo.facets(self.roughness, cosine));
        let form = of_eye * of_light / (1.0 - mean).max(1e-9);
        // The mean of Schlick's Fresnel over all directions, by their cosine.
        let of = |straight: DVec3, grazing: f64| {
            let fresnel = straight + (DVec3::splat(grazing) - straight) / 21.0;
            fresnel * fresnel * mean / (DVec3::ONE - fresnel * (1.0 - mean))
        };
        of(self.straight, self.grazing).lerp(of(self.base, 1.0), self.metallic) * form
    }
}
