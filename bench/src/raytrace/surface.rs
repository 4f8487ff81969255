//! What a ray finds where it hits: colour, normals, material.

use glam::{DVec2, DVec3, DVec4, Vec4};
use scene::{Material, Scene, Snapshot};

use super::geometry::{Among, Corners, Geometry, Hit, Query, Ray};
use super::light::Lights;
use super::light::light_shown_as;
use super::texture::LinearTexture;

/// What a surface does with a ray; see [`crate::raytrace`] for the definitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Plain,
    Mirror,
    Glass { ior: f64 },
}

/// The kind of a material.
pub(super) fn kind(material: &Material) -> Kind {
    if material.metallic >= 0.9 && material.roughness <= 0.1 {
        Kind::Mirror
    } else if material.transmission >= 0.5 && !material.thin {
        Kind::Glass { ior: material.ior.into() }
    } else {
        Kind::Plain
    }
}

/// A surface where a ray hit it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    /// Relative to the anchor.
    pub p: DVec3,
    /// The interpolated unit normal, against the ray where the material has two sides.
    pub shading: DVec3,
    /// The triangle's unit normal, against the ray.
    pub geometric: DVec3,
    /// Linear RGB.
    pub base: DVec3,
    /// Of what is blended, how much it hides; else 1.
    pub hides: f64,
    /// Of a pane, the share of light that passes it straight on, tinted by its base; else 0.
    pub passing: f64,
    pub object: u16,
    pub material: u32,
    pub facet: u32,
}

impl Surface {
    /// The interpolated normal on the side of the triangle that the ray came from.
    pub fn facing(&self) -> DVec3 {
        if self.shading.dot(self.geometric) < 0.0 { -self.shading } else { self.shading }
    }
}

/// Triangles with their materials.
pub(super) struct Surfaces {
    pub geometry: Geometry,
    materials: Vec<Material>,
    textures: Vec<LinearTexture>,
}

impl Surfaces {
    pub fn new(scene: &Scene, snapshot: &Snapshot) -> Surfaces {
        Surfaces {
            geometry: Geometry::new(scene, snapshot),
            materials: scene.materials.clone(),
            textures: scene.textures.iter().map(LinearTexture::new).collect(),
        }
    }

    /// The nearest surface along a ray; what is blended is cut out, and panes are not there.
    pub fn first(&self, ray: &Ray, query: &Query) -> Option<Surface> {
        self.first_of(ray, query, false)
    }

    /// The nearest surface along a ray; with `blending` also where what is blended hides little.
    pub fn first_of(&self, ray: &Ray, query: &Query, blending: bool) -> Option<Surface> {
        let is_cut = |hit: &Hit| {
            let (_, corners) = self.geometry.facet(hit);
            let material = &self.materials[corners.material as usize];
            if material.is_pane() && !blending {
                return true;
            }
            let cutoff = material.alpha_cutoff.filter(|_| !(blending && material.see_through));
            cutoff.is_some_and(|cutoff| self.base(corners, hit.weights).w < f64::from(cutoff))
        };
        let hit = self.geometry.first_hit(ray, query, is_cut)?;
        Some(self.surface(ray, &hit))
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let (facet, corners) = self.geometry.facet(hit);
        let outward = facet.outward().normalize_or_zero();
        let from_behind = outward.dot(ray.direction) > 0.0;
        let turned = |normal: DVec3, turn: bool| if turn { -normal } else { normal };
        let material = &self.materials[corners.material as usize];
        let base = self.base(corners, hit.weights);
        let shading = Corners::mix(&corners.normals_world, hit.weights).normalize_or(outward);
        Surface {
            p: ray.at(hit.t),
            shading: turned(shading, facet.double_sided && from_behind),
            geometric: turned(outward, from_behind),
            base: base.truncate(),
            passing: if material.is_pane() { material.transmission.into() } else { 0.0 },
            hides: if material.see_through { base.w.clamp(0.0, 1.0) } else { 1.0 },
            object: facet.object,
            material: corners.material,
            facet: hit.facet,
        }
    }

    /// Linear RGBA: texture times material times vertex colour.
    fn base(&self, corners: &Corners, weights: DVec2) -> DVec4 {
        let material = &self.materials[corners.material as usize];
        let uv = Corners::mix(&corners.uvs, weights);
        let texel = material.texture.map_or(DVec4::ONE, |texture| self.textures[texture as usize].at(uv));
        let colour = Corners::mix(&corners.colours.map(DVec4::from), weights);
        texel * colour * Vec4::from(material.base_colour).as_dvec4()
    }

    pub fn kind(&self, surface: &Surface) -> Kind {
        kind(&self.materials[surface.material as usize])
    }

    /// The light that a surface sends back along a ray, as if it were no reflector. With `shadows` only from lights that nothing
    /// hides.
    pub fn lit(&self, surface: &Surface, direction: DVec3, lights: &Lights, shadows: bool) -> DVec3 {
        let material = &self.materials[surface.material as usize];
        if material.unlit {
            return light_shown_as(surface.base);
        }
        let p_world = self.geometry.anchor_world + surface.p;
        let emissive: DVec3 = material.emissive.map(f64::from).into();
        let arrives = |to_light: DVec3, distance_m: f64| {
            let ray = Ray { origin: surface.p, direction: to_light };
            let t_range = [self.geometry.skip_m, distance_m];
            let query = Query { among: Among::Solid, without: None, leaves: Some(surface.facet), t_range };
            !shadows || self.first(&ray, &query).is_none()
        };
        let direction = direction.normalize_or_zero();
        emissive + surface.base * lights.diffuse(p_world, surface.shading, direction, arrives)
    }

    /// Whether nothing lies between a surface and the end of `way`, which begins on it.
    pub fn reaches(&self, surface: &Surface, way: DVec3) -> bool {
        let length_m = way.length();
        let skip = self.geometry.skip_m / length_m;
        let query =
            Query { among: Among::Solid, without: None, leaves: Some(surface.facet), t_range: [skip, 1.0 - skip] };
        self.first(&Ray { origin: surface.p, direction: way }, &query).is_none()
    }

    /// Whether nothing, seen from either side, lies on the ray up to `reach` lengths of its direction.
    pub fn is_free(&self, ray: &Ray, reach: f64) -> bool {
        self.first(ray, &Query { among: Among::Solid, without: None, leaves: None, t_range: [0.0, reach] }).is_none()
    }

    /// The distance of the first surface, seen from either side, along a ray of unit direction; `reach_m` where none is nearer.
    pub fn free_m(&self, ray: &Ray, reach_m: f64) -> f64 {
        let query = Query { among: Among::Solid, without: None, leaves: None, t_range: [0.0, reach_m] };
        self.first(ray, &query).map_or(reach_m, |hit| hit.p.distance(ray.origin))
    }
}
