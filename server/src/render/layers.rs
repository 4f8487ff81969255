//! What is seen through, in layers of their own: each is drawn as if nothing else that is seen through were there, so that none hides another.
//!
//! Sorting triangles by depth, as renderers of pictures do, leaves nothing that could be sent once and drawn from elsewhere. A layer is a surface
//! like any other: its samples stay while the eye moves, and which of two layers is nearer is asked pixel by pixel, at the client. Within a
//! layer only the nearest shows. So what is seen behind each other shall be in different ones: the front faces and the back faces of what bends, as of a bottle
//! both are seen; and each object goes where the others are as far away and as small as can be. A flat sheet never shows both of its faces, which share a layer.

use std::collections::{BTreeMap, BTreeSet};

use camera::Bounds;
use glam::Vec3;
use protocol::Purpose;
use scene::{Mesh, Scene};

/// How what is seen through is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Blended {
    /// Like everything else, cut out where its alpha is below a half; panes not at all.
    #[default]
    CutOut,
    /// Not at all.
    LeftOut,
    /// A layer of it, which says how much it hides, and no other.
    Layer(Layer),
}

/// A part of what is seen through, by its number below [`Purpose::LAYERS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Layer(pub u8);

/// The layers of an object's front faces and of its back faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Faces {
    front: Layer,
    back: Option<Layer>,
}

/// Front faces, in [`Layers::faces_in`].
const FRONT: u32 = 1;
/// Back faces.
const BACK: u32 = 2;
/// A mesh whose triangles all lean less than this against their mean is flat: of 60 degrees.
const FLAT_COSINE: f32 = 0.5;

/// What of a scene is seen through.
#[derive(Debug, Clone, Default)]
pub(super) struct Layers {
    objects: BTreeMap<u16, Faces>,
    /// Those of panes: where there are no layers, they are not drawn at all.
    pub panes: BTreeSet<u16>,
    /// Those that hold anything.
    pub layers: Vec<Layer>,
}

impl Layers {
    pub fn of(scene: &Scene) -> Layers {
        let is_seen_through: Vec<bool> =
            (0..scene.materials.len()).map(|material| scene.is_seen_through(material)).collect();
        if !is_seen_through.contains(&true) {
            return Layers::default();
        }
        let snapshot = scene.at(0.0);
        let mut layers = Layers::default();
        let mut placed: [Vec<Bounds>; Purpose::LAYERS as usize] = Default::default();
        for (instance, object) in scene.instances.iter().zip(0..) {
            let mesh = &scene.meshes[instance.mesh as usize];
            let material = mesh.material as usize;
            if !is_seen_through[material] {
                continue;
            }
            let bounds = scene.bounds_of(&snapshot, object);
            let best = emptiest(&placed, bounds);
            let (front, other) = (Layer(best[0]), Layer(best[1]));
            let is_flat = !instance.deforms && is_flat(mesh);
            let back = scene.materials[material].double_sided.then_some(if is_flat { front } else { other });
            layers.objects.insert(object, Faces { front, back });
            for layer in [Some(front), back.filter(|back| *back != front)].into_iter().flatten() {
                placed[usize::from(layer.0)].extend(bounds);
            }
            if scene.materials[material].is_pane() {
                layers.panes.insert(object);
            }
        }
        let faces = layers.objects.values().flat_map(|faces| [Some(faces.front), faces.back]);
        layers.layers = faces.flatten().collect::<BTreeSet<Layer>>().into_iter().collect();
        layers
    }

    /// Which faces of an object are in a layer: [`FRONT`], [`BACK`], both or none.
    pub fn faces_in(&self, object: u16, layer: Layer) -> u32 {
        let Some(faces) = self.objects.get(&object) else { return 0 };
        let front = if faces.front == layer { FRONT } else { 0 };
        front | if faces.back == Some(layer) { BACK } else { 0 }
    }

    /// Whether an object is drawn where what is seen through is drawn so.
    pub fn is_drawn(&self, object: u16, shown: Blended) -> bool {
        match shown {
            Blended::CutOut => !self.panes.contains(&object),
            Blended::LeftOut => !self.objects.contains_key(&object),
            Blended::Layer(layer) => !self.objects.contains_key(&object) || self.faces_in(object, layer) != 0,
        }
    }
}

/// All layers, those first in which what is there hides the least of a box: where the sum of both radii is the smallest as a share of their distance.
fn emptiest(
    placed: &[Vec<Bounds>; Purpose::LAYERS as usize],
    bounds: Option<Bounds>,
) -> [u8; Purpose::LAYERS as usize] {
    let radius_m = |bounds: &Bounds| (bounds.max - bounds.min).length() / 2.0;
    let centre = |bounds: &Bounds| (bounds.min + bounds.max) / 2.0;
    let near = |own: &Bounds, other: &Bounds| (radius_m(own) + radius_m(other)) / centre(own).distance(centre(other));
    let crowd = |layer: &u8| {
        let others = placed[usize::from(*layer)].iter();
        bounds.map_or(0.0, |own| others.map(|other| near(&own, other)).fold(0.0, f64::max))
    };
    let mut layers = std::array::from_fn(|layer| layer as u8);
    layers.sort_by(|a, b| crowd(a).total_cmp(&crowd(b)));
    layers
}

/// Whether no eye sees both a front and a back of a mesh, or hardly.
fn is_flat(mesh: &Mesh) -> bool {
    let place = |index: u32| Vec3::from(mesh.vertices[index as usize].position);
    let (triangles, _) = mesh.indices.as_chunks::<3>();
    let areas = triangles.iter().map(|&[a, b, c]| (place(b) - place(a)).cross(place(c) - place(a)));
    let mean = areas.clone().sum::<Vec3>().normalize_or_zero();
    areas.filter(|area| *area != Vec3::ZERO).all(|area| area.normalize_or_zero().dot(mean) > FLAT_COSINE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers(name: &str) -> Layers {
        Layers::of(&scene::builtin::load(name).expect("a built-in scene"))
    }

    fn object(scene: &Scene, name: &str) -> u16 {
        scene.instances.iter().position(|instance| instance.name == name).expect("there is one") as u16
    }

    #[test]
    fn sheets_that_overlap_and_both_walls_of_a_bottle_are_in_different_layers() {
        let scene = scene::builtin::load("window").expect("a built-in scene");
        let layers = Layers::of(&scene);
        let of = |name: &str| layers.objects[&object(&scene, name)];
        let sheets = ["pane", "stripe", "stained pane"].map(of);
        assert!(sheets.iter().all(|faces| faces.back == Some(faces.front)), "a sheet shows one face");
        let different: BTreeSet<Layer> = sheets.iter().map(|faces| faces.front).collect();
        assert_eq!(different.len(), 3);
        let bottle = of("bottle");
        assert!(bottle.back.is_some_and(|back| back != bottle.front), "{bottle:?}");
        assert_eq!(layers.panes, BTreeSet::from([object(&scene, "stained pane")]));
    }

    #[test]
    fn what_is_drawn_of_a_layer_is_what_is_in_it_and_all_that_is_opaque() {
        // Of the boards' six two are seen through: the opaque one has the same texture, and others are cut out.
        let boards = layers("alpha-boards");
        assert_eq!(boards.objects.len(), 2);
        let (&object, &Faces { front, .. }) = boards.objects.first_key_value().expect("one");
        assert!(boards.is_drawn(object, Blended::CutOut) && !boards.is_drawn(object, Blended::LeftOut));
        let of_layers = boards.layers.iter().filter(|&&layer| boards.is_drawn(object, Blended::Layer(layer)));
        assert_eq!(of_layers.collect::<Vec<_>>(), [&front]);
        assert!(boards.is_drawn(0, Blended::LeftOut) && boards.is_drawn(0, Blended::Layer(front)), "the wall");
        let window = scene::builtin::load("window").expect("a built-in scene");
        let stained = self::object(&window, "stained pane");
        assert!(!Layers::of(&window).is_drawn(stained, Blended::CutOut), "a pane is not cut out");
    }

    #[test]
    fn a_scene_in_which_all_hides_all_has_no_layers() {
        assert!(layers("urban").layers.is_empty());
    }

    #[test]
    fn of_what_has_one_side_there_is_a_front_alone() {
        let mut scene = scene::builtin::load("window").expect("a built-in scene");
        scene.materials.iter_mut().for_each(|material| material.double_sided = false);
        let layers = Layers::of(&scene);
        assert!(layers.objects.values().all(|faces| faces.back.is_none()));
    }
}
