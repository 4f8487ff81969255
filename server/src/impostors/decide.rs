use std::sync::{Arc, OnceLock};

use camera::{Bounds, Camera, CorridorMap, GraphCamera, Heading, Pinhole, Rigid, Spoc};
use glam::{DAffine3, DVec3};
use protocol::wire::GRAPH_MAX_FRUSTA;
use protocol::{Effect, Material, Purpose};
use scene::{Scene, Snapshot};

use super::group::{Ball, groups};
use super::planar::Plane;
use crate::render::Faces;

/// Reflectors that are smaller than this, seen from the viewer, show nothing that could be told: 0.01 rad is four pixels in a view of
/// 640 that is 90 degrees wide.
const LEAST_REFLECTOR_RAD: f64 = 0.01;
/// Groups of reflectors that are served, those with the largest one seen from the viewer.
const MAX_REFLECTORS: usize = 4;
/// Objects that seem smaller than this from a reflector are left to the image of its surroundings: a face of that has 128 pixels for
/// 90 degrees, so eight pixels for such an object.
const LEAST_OBJECT_RAD: f64 = 0.1;
/// Objects with images of their own, for one reflector.
const MAX_OBJECTS: usize = 4;
/// A box flatter than this, shortest over longest side, has next to nothing behind its silhouette.
const FLAT: f64 = 0.05;
/// The sides of images, in pixels.
const OBJECT_PX: u32 = 256;
const FACE_PX: u32 = 128;
const GRAPH_PX: (u32, u32) = (320, 240);
/// Graph cameras stand this many cells before their first face; see [`CorridorMap::describe`].
const SETBACK_CELLS: f64 = 8.0;
/// Corridors that would be fewer pixels wide are left out.
const LEAST_FACE_PX: f64 = 8.0;

/// Which objects an impostor shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Drawn {
    /// One.
    Only(u16),
    /// All others; ids ascend.
    AllBut(Vec<u16>),
}

impl Drawn {
    /// Whether an object is drawn.
    pub fn contains(&self, object: u16) -> bool {
        match self {
            Drawn::Only(only) => *only == object,
            Drawn::AllBut(others) => others.binary_search(&object).is_err(),
        }
    }
}

/// A picture of some objects.
#[derive(Debug, Clone, Copy)]
pub struct Shot<'a> {
    /// Takes it.
    pub camera: &'a Camera,
    /// What it shows.
    pub drawn: &'a Drawn,
    /// Of these, which sides.
    pub faces: Faces,
    /// Whether a single object has its tint.
    pub is_tinted: bool,
}

/// Names an impostor of a client; a newer image takes the place of the older one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key {
    /// The reflector that needs it.
    pub reflector: u16,
    /// The object that it shows; `None` for the surroundings.
    pub shown: Option<u16>,
    /// Number among the images of the same.
    pub part: u8,
}

/// What an impostor was taken from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Basis {
    /// The eye relative to the middle of the one object shown, in metres, along the object's axes: the same as long as they move
    /// together.
    Object(DVec3),
    /// The eye, and how far it may move before the image shows what is around from too far beside.
    Place {
        /// In world space.
        eye_world: DVec3,
        /// Metres.
        reach_m: f64,
    },
}

/// How far the middle of a reflector may move from where the image of its surroundings was taken, as a share of its radius: rays leave
/// it from all of its surface, so by far less than a radius nothing changes.
const PLACE_SHARE: f64 = 0.5;

/// An impostor that a client should hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Its name.
    pub key: Key,
    /// What it is for, for the client.
    pub purpose: Purpose,
    /// Takes it.
    pub camera: Camera,
    /// What it shows.
    pub drawn: Drawn,
    /// Of these, which sides.
    pub faces: Faces,
    /// What it was taken from, to tell when it has to be taken anew.
    pub basis: Basis,
    /// The scene time of what changes in it by itself; `None` where nothing does.
    pub changes_at_s: Option<f64>,
}

impl Wanted {
    /// The picture of it.
    pub fn shot(&self) -> Shot<'_> {
        Shot { camera: &self.camera, drawn: &self.drawn, faces: self.faces, is_tinted: true }
    }
}

/// What is to be held, and why.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Decision {
    /// The impostors.
    pub wanted: Vec<Wanted>,
    /// A sentence for each reflector, or one that there is none.
    pub reasons: Vec<String>,
}

/// What of a scene decides about impostors: worked out once.
#[derive(Debug, Clone)]
pub struct Needs {
    reflectors: Vec<(u16, Effect)>,
    /// As the scene's maker knows them, or of the floor plan around the reflector that is served first, once there is one.
    corridors: OnceLock<Option<CorridorMap>>,
}

impl Needs {
    /// Of a scene: the objects whose materials are mirrors or glass, and its corridors where it knows them.
    pub fn new(scene: &Scene) -> Needs {
        let reflectors = scene.instances.iter().zip(0_u16..);
        let with_effect = |(instance, id): (&scene::Instance, u16)| Some((id, effect_of_mesh(scene, instance.mesh)?));
        let corridors = scene.corridors.clone().map_or_else(OnceLock::new, |map| OnceLock::from(Some(map)));
        Needs { reflectors: reflectors.filter_map(with_effect).collect(), corridors }
    }

    /// The same in a place without corridors, whose surroundings are six images: to compare with.
    pub fn without_corridors(self) -> Needs {
        Needs { corridors: OnceLock::from(None), ..self }
    }

    /// Whether the scene has no reflector at all.
    pub fn is_nothing(&self) -> bool {
        self.reflectors.is_empty()
    }

    /// Whether any object shows others in this way.
    pub fn has(&self, effect: Effect) -> bool {
        self.reflectors.iter().any(|(_, of)| *of == effect)
    }

    /// What a viewer at `eye_world` needs of the scene at a time.
    pub fn decide(&self, scene: &Scene, snapshot: &Snapshot, eye_world: DVec3) -> Decision {
        if self.is_nothing() {
            return Decision { wanted: Vec::new(), reasons: vec!["no mirror and no glass: no impostors".to_owned()] };
        }
        let bounds = scene.instances.iter().zip(0_u16..).map(|(_, id)| scene.bounds_of(snapshot, id));
        let bounds: Vec<Option<Bounds>> = bounds.collect();
        let size_rad = |ball: &Ball| ball.radius_m / (ball.centre - eye_world).length().max(ball.radius_m);
        let balls = self.reflectors.iter().filter_map(|&(id, effect)| {
            let ball = Ball::around(bounds[usize::from(id)].as_ref()?);
            (size_rad(&ball) >= LEAST_REFLECTOR_RAD).then_some((id, effect, ball))
        });
        let mut served = groups(balls.collect());
        served.sort_by(|a, b| size_rad(&b.ball).total_cmp(&size_rad(&a.ball)));
        let mut decision = Decision::default();
        let dropped = served.len().saturating_sub(MAX_REFLECTORS);
        served.truncate(MAX_REFLECTORS);
        let corridors = served.first().and_then(|group| {
            let plan = || scene::floor_plan(scene, snapshot, group.lead, (group.ball.centre, group.ball.radius_m));
            self.corridors.get_or_init(plan).as_ref()
        });
        for group in served {
            let (id, effect, ball, members) = (group.lead, group.effect, group.ball, group.members);
            Reflector { id, effect, ball, members, scene, snapshot, bounds: &bounds, corridors }
                .decide(eye_world, &mut decision);
        }
        if dropped > 0 {
            decision.reasons.push(format!("{dropped} smaller groups of reflectors get none"));
        }
        if decision.reasons.is_empty() {
            decision.reasons.push("no mirror or glass in reach: no impostors".to_owned());
        }
        decision
    }
}

/// What a mesh shows of others.
pub(super) fn effect_of_mesh(scene: &Scene, mesh: u32) -> Option<Effect> {
    let material = scene.materials.get(scene.meshes.get(mesh as usize)?.material as usize)?;
    let (metallic, roughness) = (material.metallic, material.roughness);
    Material { metallic, roughness, transmission: material.transmission, ..Material::default() }.effect()
}

/// A reflector at a time.
struct Reflector<'a> {
    id: u16,
    effect: Effect,
    ball: Ball,
    /// Those that share its images, itself included.
    members: Vec<u16>,
    scene: &'a Scene,
    snapshot: &'a Snapshot,
    bounds: &'a [Option<Bounds>],
    corridors: Option<&'a CorridorMap>,
}

impl Reflector<'_> {
    fn decide(&self, eye_world: DVec3, decision: &mut Decision) {
        let plane = self.plane();
        // What a flat mirror shows is all seen from one place.
        let near = if plane.is_some() { Vec::new() } else { self.near_objects() };
        let mut shown = Vec::new();
        let mut parts = Vec::new();
        for (object, bounds) in near {
            let Some((camera, kind)) = self.object_camera(object, &bounds) else { continue };
            parts.push(format!("{kind} of {:?}", self.scene.instances[usize::from(object)].name));
            decision.wanted.push(self.wanted_of_object(object, camera, Faces::Front, Purpose::Impostor(object)));
            shown.push(object);
        }
        let mut others = [self.members.clone(), shown].concat();
        others.sort_unstable();
        others.dedup();
        let (cameras, kind, basis) = self.surroundings(plane, eye_world);
        if (0..self.bounds.len()).any(|id| others.binary_search(&(id as u16)).is_err()) {
            parts.push(format!("{} {kind} of what is around", cameras.len()));
            let changes_at_s = self.changes(&others).then_some(self.snapshot.time_s);
            decision.wanted.extend(cameras.into_iter().zip(0..).map(|(camera, part)| Wanted {
                key: Key { reflector: self.id, shown: None, part },
                purpose: Purpose::Environment,
                basis,
                drawn: Drawn::AllBut(others.clone()),
                faces: Faces::Front,
                changes_at_s,
                camera,
            }));
        }
        let effect = match self.effect {
            Effect::Mirror => "a mirror",
            Effect::Glass => "glass",
        };
        if self.effect == Effect::Glass
            && let Some(camera) = self.inside_camera(eye_world)
        {
            parts.push("its inside".to_owned());
            decision.wanted.push(self.wanted_of_object(self.id, camera, Faces::Back, Purpose::Inside(self.id)));
        }
        let name = &self.scene.instances[usize::from(self.id)].name;
        let with = match self.members.len() {
            1 => String::new(),
            count => format!(" with {} near it", count - 1),
        };
        decision.reasons.push(format!("{name:?}{with} is {effect}: {}", parts.join(", ")));
    }

    /// Of a mirror that is flat.
    fn plane(&self) -> Option<Plane> {
        let world_from_mesh = &self.snapshot.world_from_mesh[usize::from(self.id)];
        let mesh = &self.scene.meshes[self.scene.instances[usize::from(self.id)].mesh as usize];
        let [low, high] = mesh.bounds.map(|corner| glam::Vec3::from(corner).as_dvec3());
        let sides = high - low;
        let is_flat = self.effect == Effect::Mirror && sides.min_element() < FLAT * sides.max_element();
        // Thin, and wide along both other axes.
        let middle = sides.element_sum() - sides.min_element() - sides.max_element();
        let axis = DVec3::AXES[sides.min_position()];
        let normal_world = (world_from_mesh.matrix3.inverse().transpose() * axis).try_normalize()?;
        (is_flat && sides.min_element() < FLAT * middle)
            .then_some(Plane { point_world: self.ball.centre, normal_world })
    }

    /// Images of all else, what they are, and where they were taken.
    fn surroundings(&self, plane: Option<Plane>, eye_world: DVec3) -> (Vec<Camera>, &'static str, Basis) {
        if let Some(plane) = plane {
            // The nearest that the mirrored eye sees is as far as the mirror.
            let (mirrored, distance_m) = plane.mirrored(eye_world);
            let basis = Basis::Place { eye_world: mirrored, reach_m: PLACE_SHARE * distance_m };
            return (plane.cameras(eye_world), "images from the eye's mirror image", basis);
        }
        let (cameras, kind) = self.surroundings_cameras();
        (cameras, kind, Basis::Place { eye_world: self.ball.centre, reach_m: PLACE_SHARE * self.ball.radius_m })
    }

    /// What seems large from here, largest first, seen from outside of it.
    fn near_objects(&self) -> Vec<(u16, Bounds)> {
        let mut near: Vec<(f64, u16, Bounds)> = Vec::new();
        for (bounds, object) in self.bounds.iter().zip(0_u16..) {
            let Some(bounds) = bounds.filter(|_| object != self.id) else { continue };
            let ball = Ball::around(&bounds);
            let distance_m = ball.centre.distance(self.ball.centre);
            let size_rad = ball.radius_m / distance_m;
            if distance_m > ball.radius_m && size_rad >= LEAST_OBJECT_RAD {
                near.push((size_rad, object, bounds));
            }
        }
        near.sort_by(|a, b| b.0.total_cmp(&a.0));
        near.into_iter().take(MAX_OBJECTS).map(|(_, object, bounds)| (object, bounds)).collect()
    }

    /// Rays leave a reflector from all of its surface: its middle stands for them.
    fn object_camera(&self, object: u16, bounds: &Bounds) -> Option<(Camera, &'static str)> {
        let mesh = &self.scene.meshes[self.scene.instances[usize::from(object)].mesh as usize];
        let [low, high] = mesh.bounds.map(glam::Vec3::from);
        let sides = high - low;
        let size_px = (OBJECT_PX, OBJECT_PX);
        if f64::from(sides.min_element()) < FLAT * f64::from(sides.max_element()) {
            let spoc = Spoc::around(bounds, self.ball.centre, size_px, 0.0)?;
            return Some((Camera::Pinhole(spoc.pinhole), "a billboard"));
        }
        let ring_m = Ball::around(bounds).radius_m;
        Some((Camera::Spoc(Spoc::around(bounds, self.ball.centre, size_px, ring_m)?), "an image past the silhouette"))
    }

    /// Sees the back faces of this object from where the viewer is.
    fn inside_camera(&self, eye_world: DVec3) -> Option<Camera> {
        let bounds = self.bounds[usize::from(self.id)]?;
        let spoc = Spoc::around(&bounds, eye_world, (OBJECT_PX, OBJECT_PX), 0.0)?;
        Some(Camera::Pinhole(spoc.pinhole))
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

    fn surroundings_cameras(&self) -> (Vec<Camera>, &'static str) {
        let graphs = self.corridors.map(|map| self.graph_cameras(map)).unwrap_or_default();
        match (graphs.is_empty(), &self.scene.corridors) {
            (true, _) => (self.cube(), "images"),
            (false, Some(_)) => (graphs, "graph images"),
            (false, None) => (graphs, "graph images along the floor plan"),
        }
    }

    /// Two cameras, one along the corridor that the reflector stands in and one against it.
    fn graph_cameras(&self, map: &CorridorMap) -> Vec<Camera> {
        // A floor plan is that of one storey.
        let is_within = (0.0..map.height_m).contains(&(self.ball.centre.y - map.origin_world.y));
        let Some(cell) = map.cell_of(self.ball.centre).filter(|_| is_within) else { return Vec::new() };
        let along_x = [Heading::PlusX, Heading::MinusX];
        let is_along_x = along_x.iter().any(|&heading| map.is_free_beside(cell, heading));
        let headings = if is_along_x { along_x } else { [Heading::PlusZ, Heading::MinusZ] };
        let setback_m = SETBACK_CELLS * map.cell_m;
        let cameras = headings.into_iter().filter_map(|heading| {
            let description = map.describe(cell, heading, setback_m, GRAPH_PX, LEAST_FACE_PX).ok()?;
            let camera = GraphCamera::from_description(&description).ok()?;
            // A client takes no more.
            let is_sendable = camera.description().frusta.len() < GRAPH_MAX_FRUSTA;
            is_sendable.then(|| Camera::Graph(Arc::new(camera)))
        });
        cameras.collect()
    }

    fn cube(&self) -> Vec<Camera> {
        let near_m = self.ball.radius_m / 16.0;
        let sides = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        let face = |forward| {
            let world_from_eye = Rigid::look_along(self.ball.centre, forward);
            // A pixel more than a right angle on each side, so that faces overlap instead of leaving a seam.
            let half = f64::from(FACE_PX) / 2.0;
            let fov_rad = 2.0 * (half / (half - 1.0)).atan();
            Camera::Pinhole(Pinhole::symmetric(world_from_eye, (FACE_PX, FACE_PX), fov_rad, near_m))
        };
        sides.into_iter().map(face).collect()
    }
}

/// A direction of the world along the axes of an object, as long as before.
fn turned_back(world_from_object: &DAffine3, offset_world: DVec3) -> DVec3 {
    let turned = world_from_object.matrix3.inverse() * offset_world;
    turned.normalize_or_zero() * offset_world.length()
}
