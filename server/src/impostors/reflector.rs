//! A reflector at a time, and the images that may serve it.

use std::sync::Arc;

use camera::{Bounds, Camera, CorridorMap, GraphCamera, Heading, Pinhole, Rigid, Spoc};
use glam::{DAffine3, DVec3};
use protocol::wire::GRAPH_MAX_FRUSTA;
use protocol::{Effect, Material, Purpose};
use scene::{Scene, Snapshot};

use super::choice::{Choice, OwnImage, Rule};
use super::group::{Ball, Shows};
use super::planar::Plane;
use super::wanted::{Basis, Drawn, Key, Wanted};
use crate::render::{Faces, on_the_whole};

/// Objects that seem smaller than this from a reflector are left to the image of its surroundings: a face of that has 128 pixels for
/// 90 degrees, so eight pixels for such an object.
const LEAST_OBJECT_RAD: f64 = 0.1;
/// Objects with images of their own, for one reflector.
const MAX_OBJECTS: usize = 4;
/// A box flatter than this, shortest over longest side, has next to nothing behind its silhouette.
const FLAT: f64 = 0.05;
/// The sides of images, in pixels.
pub(super) const OBJECT_PX: u32 = 256;
const FACE_PX: u32 = 128;
/// How far the middle of a reflector may move from where the image of its surroundings was taken, as a share of its radius: rays leave
/// it from all of its surface, so by far less than a radius nothing changes.
const PLACE_SHARE: f64 = 0.5;

/// A reflector at a time.
pub(super) struct Reflector<'a> {
    pub id: u16,
    pub shows: Shows,
    pub ball: Ball,
    /// Those that share its images, itself included.
    pub members: Vec<u16>,
    /// By material.
    pub all_show: &'a [Option<Shows>],
    pub scene: &'a Scene,
    pub snapshot: &'a Snapshot,
    /// Of all objects.
    pub bounds: &'a [Option<Bounds>],
}

impl Reflector<'_> {
    /// What serves it by a rule; a blur needs no more than plain images. `corridors` is only called where views may bend.
    pub fn by_rule(
        &self,
        rule: Rule,
        eye_world: DVec3,
        corridors: impl FnOnce() -> Option<Arc<CorridorMap>>,
    ) -> Choice {
        let rule = if self.is_rough() { Rule::Plain } else { rule };
        let image = |object: u16| match rule {
            Rule::Around | Rule::Bent => None,
            Rule::Plain => Some((object, OwnImage::Plain)),
            Rule::Finest => Some((object, self.finest(object))),
        };
        let bends = matches!(rule, Rule::Bent | Rule::Finest);
        let corridors = if bends { corridors() } else { None };
        let from_mirrored_eye = bends && self.plane().is_some();
        // What a flat mirror shows is all seen from one place.
        let near = if from_mirrored_eye { Vec::new() } else { self.near_objects(eye_world) };
        let own = near.into_iter().filter_map(image).collect();
        Choice { own, from_mirrored_eye, corridors, found: String::new() }
    }

    /// Whether it shows others as a blur.
    pub fn is_rough(&self) -> bool {
        self.shows == Shows::RoughMirror
    }

    /// From where objects near it are taken. Rays leave a reflector from all of its surface: its middle stands for them. What lies on a flat rough
    /// mirror is seen in it as from the eye's mirror image.
    fn object_eye_world(&self, viewer_world: DVec3) -> DVec3 {
        let plane = self.plane().filter(|_| self.is_rough());
        plane.map_or(self.ball.centre, |plane| plane.mirrored(viewer_world).0)
    }

    /// The sides of images of objects and of what is around, in pixels: of what is shown as a blur, a quarter of the pixels.
    fn sides_px(&self) -> (u32, u32) {
        if self.is_rough() { (OBJECT_PX / 2, FACE_PX / 2) } else { (OBJECT_PX, FACE_PX) }
    }

    /// The image that holds the most of an object.
    pub fn finest(&self, object: u16) -> OwnImage {
        if self.is_flat(object) { OwnImage::Plain } else { OwnImage::PastSilhouette }
    }

    /// The images of a choice, and what they are for people.
    pub fn images(&self, choice: &Choice, eye_world: DVec3) -> (Vec<Wanted>, Vec<String>) {
        let (mut wanted, mut parts, mut shown) = (Vec::new(), Vec::new(), Vec::new());
        for &(object, image) in &choice.own {
            let Some(camera) = self.object_camera(object, image, eye_world) else { continue };
            let kind = match image {
                OwnImage::PastSilhouette => "an image past the silhouette",
                OwnImage::Plain if self.is_flat(object) => "a billboard",
                OwnImage::Plain => "a plain image",
            };
            parts.push(format!("{kind} of {:?}", self.scene.instances[usize::from(object)].name));
            wanted.push(self.wanted_of_object(object, camera, Faces::Front, Purpose::Impostor(object)));
            shown.push(object);
        }
        let plane = self.plane().filter(|_| choice.from_mirrored_eye);
        let around = self.around(choice.corridors.as_deref(), plane, &shown, eye_world);
        if !around.is_empty() {
            let is_bent = |wanted: &Wanted| matches!(wanted.camera, Camera::Graph(_));
            let bent = around.iter().filter(|wanted| is_bent(wanted)).count();
            let bent = if bent > 0 { format!(", {bent} bent round corners") } else { String::new() };
            let from = if plane.is_some() { ", from the eye's mirror image" } else { "" };
            parts.push(format!("{} images of what is around{bent}{from}", around.len()));
            wanted.extend(around);
        }
        if self.shows == Shows::Glass
            && let Some(inside) = self.inside(eye_world)
        {
            parts.push("its inside".to_owned());
            wanted.push(inside);
        }
        (wanted, parts)
    }

    /// The images of all objects but this, those that share its images and those `shown` by themselves; none where there is no other.
    fn around(
        &self,
        corridors: Option<&CorridorMap>,
        plane: Option<Plane>,
        shown: &[u16],
        eye_world: DVec3,
    ) -> Vec<Wanted> {
        let mut others = [self.members.as_slice(), shown].concat();
        others.sort_unstable();
        if (0..self.bounds.len()).all(|id| others.binary_search(&(id as u16)).is_ok()) {
            return Vec::new();
        }
        let changes_at_s = self.changes(&others).then_some(self.snapshot.time_s);
        let (cameras, basis) = match plane {
            Some(plane) => {
                // The nearest that the mirrored eye sees is as far as the mirror.
                let (mirrored_world, distance_m) = plane.mirrored(eye_world);
                let basis = Basis::Place { eye_world: mirrored_world, reach_m: PLACE_SHARE * distance_m };
                (plane.cameras(eye_world), basis)
            }
            None => {
                let camera = |(heading, view): (Option<Heading>, Pinhole)| {
                    let bent = corridors.and_then(|map| self.bent(map, heading?, &view));
                    bent.unwrap_or(Camera::Pinhole(view))
                };
                let (eye_world, reach_m) = (self.ball.centre, PLACE_SHARE * self.ball.radius_m);
                (self.views_around().map(camera).to_vec(), Basis::Place { eye_world, reach_m })
            }
        };
        let wanted = cameras.into_iter().zip(0..).map(|(camera, part)| Wanted {
            key: Key { reflector: self.id, shown: None, part },
            purpose: Purpose::Environment,
            basis,
            drawn: Drawn::AllBut(others.clone()),
            faces: Faces::Front,
            changes_at_s,
            camera,
        });
        wanted.collect()
    }

    /// Of a mirror that is flat: thin, and wide along both other axes.
    pub fn plane(&self) -> Option<Plane> {
        let world_from_mesh = &self.snapshot.world_from_mesh[usize::from(self.id)];
        let mesh = &self.scene.meshes[self.scene.instances[usize::from(self.id)].mesh as usize];
        let [low, high] = mesh.bounds.map(|corner| glam::Vec3::from(corner).as_dvec3());
        let sides = high - low;
        let middle = sides.element_sum() - sides.min_element() - sides.max_element();
        let is_flat = self.shows != Shows::Glass && sides.min_element() < FLAT * middle;
        let axis = DVec3::AXES[sides.min_position()];
        let normal_world = (world_from_mesh.matrix3.inverse().transpose() * axis).try_normalize()?;
        is_flat.then_some(Plane { point_world: self.ball.centre, normal_world })
    }

    /// A view along a corridor whose rays bend into others as far as the reflector sees round their corners; `None` where none does.
    fn bent(&self, map: &CorridorMap, heading: Heading, view: &Pinhole) -> Option<Camera> {
        let cell = map.cell_of(self.ball.centre)?;
        if !map.is_free_beside(cell, heading) {
            return None;
        }
        let description = map.describe_around(view, heading, self.ball.radius_m).ok()??;
        let camera = GraphCamera::from_description(&description).ok()?;
        // A client takes no more.
        let is_sendable = camera.description().frusta.len() < GRAPH_MAX_FRUSTA;
        is_sendable.then(|| Camera::Graph(Arc::new(camera)))
    }

    /// Six views around the reflector's middle, those along floors with where they look.
    fn views_around(&self) -> [(Option<Heading>, Pinhole); 6] {
        let near_m = self.ball.radius_m / 16.0;
        let level = [Heading::PlusX, Heading::MinusX, Heading::PlusZ, Heading::MinusZ];
        let level = level.map(|heading| (Some(heading), heading.forward_world()));
        let [x, back, z, forth] = level;
        [x, back, (None, DVec3::Y), (None, DVec3::NEG_Y), z, forth].map(|(heading, forward)| {
            let world_from_eye = Rigid::look_along(self.ball.centre, forward);
            // A pixel more than a right angle on each side, so that faces overlap instead of leaving a seam.
            let side_px = self.sides_px().1;
            let half = f64::from(side_px) / 2.0;
            let fov_rad = 2.0 * (half / (half - 1.0)).atan();
            (heading, Pinhole::symmetric(world_from_eye, (side_px, side_px), fov_rad, near_m))
        })
    }

    /// What seems large from where images of objects are taken, largest first, seen from outside of it; before a flat rough mirror, what reaches to the
    /// viewer's side of it.
    pub fn near_objects(&self, viewer_world: DVec3) -> Vec<u16> {
        let eye_world = self.object_eye_world(viewer_world);
        let plane = self.plane().filter(|_| self.is_rough());
        let is_before = |bounds: &Bounds| plane.is_none_or(|plane| plane.is_before(bounds, viewer_world));
        let mut near: Vec<(f64, u16)> = Vec::new();
        for (bounds, object) in self.bounds.iter().zip(0_u16..) {
            let Some(bounds) = bounds.filter(|bounds| object != self.id && is_before(bounds)) else { continue };
            let ball = Ball::around(&bounds);
            let distance_m = ball.centre.distance(eye_world);
            let size_rad = ball.radius_m / distance_m;
            if distance_m > ball.radius_m && size_rad >= LEAST_OBJECT_RAD {
                near.push((size_rad, object));
            }
        }
        near.sort_by(|a, b| b.0.total_cmp(&a.0));
        near.into_iter().take(MAX_OBJECTS).map(|(_, object)| object).collect()
    }

    fn object_camera(&self, object: u16, image: OwnImage, viewer_world: DVec3) -> Option<Camera> {
        let bounds = self.bounds[usize::from(object)]?;
        let ring_m = match image {
            OwnImage::Plain => 0.0,
            OwnImage::PastSilhouette => Ball::around(&bounds).radius_m,
        };
        let (side_px, eye_world) = (self.sides_px().0, self.object_eye_world(viewer_world));
        let spoc = Spoc::around(&bounds, eye_world, (side_px, side_px), ring_m)?;
        Some(if image == OwnImage::Plain { Camera::Pinhole(spoc.pinhole) } else { Camera::Spoc(spoc) })
    }

    /// Whether an object is a mirror itself.
    pub fn is_mirror(&self, object: u16) -> bool {
        let mesh = self.scene.instances[usize::from(object)].mesh;
        shown_by_mesh(self.scene, self.all_show, mesh) == Some(Shows::Mirror)
    }

    fn is_flat(&self, object: u16) -> bool {
        let mesh = &self.scene.meshes[self.scene.instances[usize::from(object)].mesh as usize];
        let [low, high] = mesh.bounds.map(glam::Vec3::from);
        let sides = high - low;
        f64::from(sides.min_element()) < FLAT * f64::from(sides.max_element())
    }

    /// Sees the back faces of this object from where the viewer is.
    pub fn inside(&self, eye_world: DVec3) -> Option<Wanted> {
        let bounds = self.bounds[usize::from(self.id)]?;
        let spoc = Spoc::around(&bounds, eye_world, (OBJECT_PX, OBJECT_PX), 0.0)?;
        Some(self.wanted_of_object(self.id, Camera::Pinhole(spoc.pinhole), Faces::Back, Purpose::Inside(self.id)))
    }

    fn wanted_of_object(&self, object: u16, camera: Camera, faces: Faces, purpose: Purpose) -> Wanted {
        let instance = &self.scene.instances[usize::from(object)];
        let world_from_object = &self.snapshot.world_from_mesh[usize::from(object)];
        let middle = self.bounds[usize::from(object)].map_or(DVec3::ZERO, |bounds| bounds.middle());
        Wanted {
            key: Key { reflector: self.id, shown: Some(object), part: 0 },
            purpose,
            basis: Basis::Object(turned_back(world_from_object, camera.eye_world() - middle)),
            camera,
            drawn: Drawn::Only(object),
            faces,
            changes_at_s: instance.deforms.then_some(self.snapshot.time_s),
        }
    }

    /// Whether what is around changes by itself.
    fn changes(&self, others: &[u16]) -> bool {
        let around = self.scene.instances.iter().zip(0_u16..).filter(|(_, id)| others.binary_search(id).is_err());
        around.into_iter().any(|(instance, _)| instance.moves || instance.deforms)
    }
}

/// A direction of the world along the axes of an object, as long as before.
fn turned_back(world_from_object: &DAffine3, offset_world: DVec3) -> DVec3 {
    let turned = world_from_object.matrix3.inverse() * offset_world;
    turned.normalize_or_zero() * offset_world.length()
}

/// What each material of a scene shows of others; under a sky, rough metals do too.
pub(super) fn shows(scene: &Scene, under_sky: bool) -> Vec<Option<Shows>> {
    let shown = |material: &scene::Material| {
        let (metallic, roughness) = (material.metallic, material.roughness);
        let (transmission, thin) = (material.transmission, material.thin);
        match (Material { metallic, roughness, transmission, thin, ..Material::default() }).effect() {
            Some(Effect::Mirror) => Some(Shows::Mirror),
            Some(Effect::Glass) => Some(Shows::Glass),
            None if under_sky && on_the_whole(material, &scene.textures).is_rough_mirror() => Some(Shows::RoughMirror),
            None => None,
        }
    };
    scene.materials.iter().map(shown).collect()
}

/// What a mesh shows of others, by what each material does.
pub(super) fn shown_by_mesh(scene: &Scene, shows: &[Option<Shows>], mesh: u32) -> Option<Shows> {
    *shows.get(scene.meshes.get(mesh as usize)?.material as usize)?
}
