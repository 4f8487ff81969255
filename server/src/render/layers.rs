//! What is blended, in layers of their own: each is drawn as if nothing else of what is blended were there, so that none hides another.
//!
//! Sorting triangles by depth, as renderers of pictures do, leaves nothing that could be sent once and drawn from elsewhere. A layer is a surface
//! like any other: its samples stay while the eye moves, and which of two layers is nearer is asked pixel by pixel, at the client. Within a
//! layer only the nearest shows. So that panes behind each other are in different ones, front faces and back faces are two layers, as of a bottle both
//! are seen, and objects take turns between two groups.

use std::collections::BTreeSet;

use scene::Scene;

use super::materials;

/// How what is blended is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Blended {
    /// Like everything else, cut out where its alpha is below a half.
    #[default]
    CutOut,
    /// Not at all.
    LeftOut,
    /// A layer of it, which says how much it hides, and no other.
    Layer(Layer),
}

/// A part of what is blended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layer {
    /// Which of [`protocol::Purpose::LAYERS`].
    pub number: u8,
    /// Which of the objects that are blended: every second one.
    group: u8,
    /// Which of their faces.
    pub(super) faces: LayerFaces,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LayerFaces {
    Front,
    Back,
}

impl LayerFaces {
    /// As materials have it.
    pub fn see_through(self) -> u32 {
        match self {
            LayerFaces::Front => materials::SEE_THROUGH_FRONT,
            LayerFaces::Back => materials::SEE_THROUGH_BACK,
        }
    }
}

/// What of a scene is blended.
#[derive(Debug, Clone, Default)]
pub(super) struct Layers {
    /// By material: whether it is.
    pub materials: Vec<bool>,
    /// The objects of each group.
    groups: [BTreeSet<u16>; Layers::GROUPS],
    /// Those that hold anything.
    pub layers: Vec<Layer>,
}

impl Layers {
    const GROUPS: usize = 2;

    pub fn of(scene: &Scene) -> Layers {
        let materials: Vec<bool> = (0..scene.materials.len()).map(|material| scene.is_blended(material)).collect();
        let mut groups = [BTreeSet::new(), BTreeSet::new()];
        let mut has_back = [false; Layers::GROUPS];
        let material = |instance: &scene::Instance| scene.meshes[instance.mesh as usize].material as usize;
        let objects = scene.instances.iter().map(material).zip(0_u16..).filter(|(material, _)| materials[*material]);
        for (index, (material, object)) in objects.enumerate() {
            let group = index % Layers::GROUPS;
            groups[group].insert(object);
            has_back[group] |= scene.materials[material].double_sided;
        }
        let layer = |group: usize, faces: LayerFaces| Layer {
            number: 2 * group as u8 + u8::from(faces == LayerFaces::Back),
            group: group as u8,
            faces,
        };
        let mut layers = Vec::new();
        for group in (0..Layers::GROUPS).filter(|&group| !groups[group].is_empty()) {
            layers.push(layer(group, LayerFaces::Front));
            layers.extend(has_back[group].then(|| layer(group, LayerFaces::Back)));
        }
        Layers { materials, groups, layers }
    }

    /// Whether an object is in a layer.
    pub fn is_in(&self, object: u16, layer: Layer) -> bool {
        self.groups[usize::from(layer.group)].contains(&object)
    }

    /// Whether an object is drawn where what is blended is drawn so.
    pub fn is_drawn(&self, object: u16, shown: Blended) -> bool {
        let is_in = |group: &BTreeSet<u16>| group.contains(&object);
        match shown {
            Blended::CutOut => true,
            Blended::LeftOut => !self.groups.iter().any(is_in),
            Blended::Layer(layer) => {
                !self.groups.iter().zip(0..).any(|(group, number)| number != layer.group && is_in(group))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers(name: &str) -> Layers {
        Layers::of(&scene::builtin::load(name).expect("a built-in scene"))
    }

    #[test]
    fn what_is_seen_through_takes_turns_and_has_two_sides() {
        // Of the boards' six two are blended: the opaque one has the same texture, and others are cut out.
        let boards = layers("alpha-boards");
        let [first, second] = &boards.groups;
        assert_eq!((first.len(), second.len()), (1, 1));
        let numbers: Vec<u8> = boards.layers.iter().map(|layer| layer.number).collect();
        assert_eq!(numbers, [0, 1, 2, 3]);
        let object = *first.first().expect("one");
        let drawn = |shown| boards.is_drawn(object, shown);
        assert!(drawn(Blended::CutOut) && !drawn(Blended::LeftOut));
        let of_layers: Vec<bool> = boards.layers.iter().map(|&layer| drawn(Blended::Layer(layer))).collect();
        assert_eq!(of_layers, [true, true, false, false]);
        assert!(
            boards.is_drawn(0, Blended::LeftOut) && boards.is_drawn(0, Blended::Layer(boards.layers[0])),
            "the wall"
        );
    }

    #[test]
    fn a_scene_in_which_all_hides_all_has_no_layers() {
        assert!(layers("urban").layers.is_empty());
    }

    #[test]
    fn of_what_has_one_side_there_is_a_front_alone() {
        let mut scene = scene::builtin::load("alpha-boards").expect("a built-in scene");
        scene.materials.iter_mut().for_each(|material| material.double_sided = false);
        let numbers: Vec<u8> = Layers::of(&scene).layers.iter().map(|layer| layer.number).collect();
        assert_eq!(numbers, [0, 2]);
    }
}
