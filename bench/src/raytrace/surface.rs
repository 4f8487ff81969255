//! What a ray finds where it hits: colour, normals, material.

use glam::{DVec2, DVec3, DVec4, Vec4};
use scene::model::{Bumps, Quantity, UvMap};
use scene::{Material, Scene, Snapshot};

use super::effects::Effects;
use super::full::{Around, Shaded};
use super::geometry::{Among, Corners, Facet, Geometry, Hit, Query, Ray};
use super::light::Lights;
use super::texture::LinearTexture;

/// The look's own: fibres that are smoother count as this rough, as their rims would be narrower than a pixel.
const LEAST_SHEEN_ROUGHNESS: f64 = 0.07;

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
    /// Texture coordinates, of both sets.
    uvs: [DVec2; 2],
}

impl Surface {
    /// The interpolated normal on the side of the triangle that the ray came from.
    pub fn facing(&self) -> DVec3 {
        if self.shading.dot(self.geometric) < 0.0 { -self.shading } else { self.shading }
    }
}

/// All textures as materials read them.
fn textures(scene: &Scene) -> Vec<Read> {
    let mut all: Vec<Read> = scene.textures.iter().map(|_| Read::default()).collect();
    let mut read = |texture: u32, is_colour: bool| {
        let slot = &mut all[texture as usize];
        let slot = if is_colour { &mut slot.colours } else { &mut slot.numbers };
        slot.get_or_insert_with(|| LinearTexture::new(&scene.textures[texture as usize], is_colour));
    };
    for material in &scene.materials {
        material.texture.iter().for_each(|&texture| read(texture, true));
        material.bumps.iter().for_each(|bumps| read(bumps.texture, false));
        material.maps.iter().for_each(|map| read(map.texture, map.quantity.is_colour()));
    }
    all
}

/// Texture coordinates through an affine map.
fn through(map: &UvMap, uv: DVec2) -> DVec2 {
    let row = |[x, y, offset]: [f32; 3]| f64::from(x) * uv.x + f64::from(y) * uv.y + f64::from(offset);
    DVec2::new(row(map[0]), row(map[1]))
}

/// Triangles with their materials.
pub(super) struct Surfaces {
    pub geometry: Geometry,
    materials: Vec<Material>,
    textures: Vec<Read>,
}

/// A texture as it is read: as numbers, as colours, or both.
#[derive(Default)]
struct Read {
    numbers: Option<LinearTexture>,
    colours: Option<LinearTexture>,
}

impl Surfaces {
    pub fn new(scene: &Scene, snapshot: &Snapshot) -> Surfaces {
        Surfaces {
            geometry: Geometry::new(scene, snapshot),
            materials: scene.materials.clone(),
            textures: textures(scene),
        }
    }

    fn texel(&self, texture: u32, is_colour: bool, uv: DVec2) -> DVec4 {
        let read = &self.textures[texture as usize];
        let texture = if is_colour { &read.colours } else { &read.numbers };
        texture.as_ref().map_or(DVec4::ONE, |texture| texture.at(uv))
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
        let smooth = Corners::mix(&corners.normals_world, hit.weights).normalize_or(outward);
        let uvs = corners.uvs.map(|uvs| Corners::mix(&uvs, hit.weights));
        let shading = material.bumps.map_or(smooth, |bumps| self.bumped(&bumps, facet, corners, uvs, smooth));
        Surface {
            p: ray.at(hit.t),
            uvs,
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
        let uv = Corners::mix(&corners.uvs[0], weights);
        let texel = material.texture.map_or(DVec4::ONE, |texture| self.texel(texture, true, uv));
        let colour = Corners::mix(&corners.colours.map(DVec4::from), weights);
        texel * colour * Vec4::from(material.base_colour).as_dvec4()
    }

    /// A normal as a normal map tilts it (glTF 2.0, 3.9.3): red along the coordinate u on the surface, green against v.
    fn bumped(&self, bumps: &Bumps, facet: &Facet, corners: &Corners, uvs: [DVec2; 2], normal: DVec3) -> DVec3 {
        let set = bumps.uv_set as usize;
        let Some([along_u, along_v]) = facet.along(corners.uvs[set].map(|uv| through(&bumps.from_uv, uv))) else {
            return normal;
        };
        let texel = self.texel(bumps.texture, false, through(&bumps.from_uv, uvs[set])).truncate() * 2.0 - DVec3::ONE;
        let tangent = along_u.reject_from_normalized(normal).normalize_or_zero();
        let across = normal.cross(tangent);
        let upwards = if across.dot(along_v) > 0.0 { -across } else { across };
        let tilted = (tangent * texel.x + upwards * texel.y) * f64::from(bumps.scale) + normal * texel.z.max(0.0);
        tilted.normalize_or(normal)
    }

    /// What the material of a surface is there.
    fn shaded(&self, surface: &Surface) -> Shaded {
        let material = &self.materials[surface.material as usize];
        let rgb = |colour: [f32; 3]| DVec3::from(colour.map(f64::from));
        let mut shaded = Shaded {
            base: surface.base,
            metallic: material.metallic.into(),
            roughness: material.roughness.into(),
            occlusion: 1.0,
            emissive: rgb(material.emissive),
            straight: rgb(material.specular_colour),
            grazing: material.specular.into(),
            coat: material.clearcoat.into(),
            coat_roughness: material.clearcoat_roughness.into(),
            sheen: rgb(material.sheen),
            sheen_roughness: material.sheen_roughness.into(),
            passing: surface.passing,
        };
        for map in &material.maps {
            let uv = through(&map.from_uv, surface.uvs[map.uv_set as usize]);
            let texel = self.texel(map.texture, map.quantity.is_colour(), uv);
            match map.quantity {
                Quantity::MetallicRoughness => {
                    (shaded.roughness, shaded.metallic) = (shaded.roughness * texel.y, shaded.metallic * texel.z);
                }
                Quantity::Occlusion => shaded.occlusion = 1.0 + f64::from(map.strength) * (texel.x - 1.0),
                Quantity::Emissive => shaded.emissive *= texel.truncate(),
                Quantity::Transmission => shaded.passing *= texel.x,
                Quantity::Specular => shaded.grazing *= texel.w,
                Quantity::SpecularColour => shaded.straight *= texel.truncate(),
                Quantity::Clearcoat => shaded.coat *= texel.x,
                Quantity::ClearcoatRoughness => shaded.coat_roughness *= texel.y,
                Quantity::Sheen => shaded.sheen *= texel.truncate(),
                Quantity::SheenRoughness => shaded.sheen_roughness *= texel.w,
            }
        }
        let ior = f64::from(material.ior);
        shaded.straight = (shaded.straight * ((ior - 1.0) / (ior + 1.0)).powi(2)).min(DVec3::ONE) * shaded.grazing;
        shaded.sheen_roughness = shaded.sheen_roughness.max(LEAST_SHEEN_ROUGHNESS);
        shaded
    }

    pub fn kind(&self, surface: &Surface) -> Kind {
        kind(&self.materials[surface.material as usize])
    }

    /// The light that a surface sends back along a ray, as if it were no reflector. With `shadows` only from lights that nothing
    /// hides.
    pub fn lit(&self, surface: &Surface, direction: DVec3, lights: &Lights, shadows: bool) -> DVec3 {
        self.lit_around(surface, direction, lights, shadows, Around::Sky)
    }

    /// Whether a surface is a rough mirror: metal as smooth as shows what is near.
    pub fn is_rough_mirror(&self, surface: &Surface) -> bool {
        let shaded = self.shaded(surface);
        shaded.metallic >= 0.9 && shaded.roughness > 0.1 && shaded.roughness <= 0.5
    }

    /// The same of a rough mirror in the full look, which shows what is near.
    pub fn lit_rough(&self, surface: &Surface, direction: DVec3, lights: &Lights, effects: &Effects) -> DVec3 {
        let near = |way: DVec3| {
            let query = Query {
                among: Among::Shown,
                without: (!effects.self_reflection).then_some(surface.object),
                leaves: Some(surface.facet),
                t_range: [self.geometry.skip_m, f64::INFINITY],
            };
            let met = self.first(&Ray { origin: surface.p, direction: way }, &query)?;
            Some(self.lit_around(&met, way, lights, effects.shadows, Around::FewOfSky))
        };
        self.lit_around(surface, direction, lights, effects.shadows, Around::Near(&near))
    }

    fn lit_around(
        &self,
        surface: &Surface,
        direction: DVec3,
        lights: &Lights,
        shadows: bool,
        around: Around<'_>,
    ) -> DVec3 {
        let material = &self.materials[surface.material as usize];
        if material.unlit {
            return lights.of_unlit(surface.base);
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
        if lights.is_full() {
            return lights.full(p_world, &self.shaded(surface), surface.shading, direction, around, arrives);
        }
        emissive + surface.base * (1.0 - surface.passing) * lights.diffuse(p_world, surface.shading, direction, arrives)
    }

    /// The share of the light behind a surface that passes it along a ray: nothing but of a pane.
    pub fn passing(&self, surface: &Surface, direction: DVec3, lights: &Lights) -> DVec3 {
        if surface.passing == 0.0 || !lights.is_full() {
            return surface.base * surface.passing;
        }
        self.shaded(surface).passing(surface.shading.dot(-direction.normalize_or_zero()))
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
