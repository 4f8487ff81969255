use glam::DVec3;

use super::frustum::Frustum;
use super::id::FrustumId;
use crate::Bounds;

/// Finds the frusta whose boxes hold a point: a tree of boxes, its nodes in the order of a walk that goes deep first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Index {
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, PartialEq)]
struct Node {
    bounds: Bounds,
    /// Set at a leaf.
    frustum: Option<FrustumId>,
    /// The next node that is not below this one.
    skip: usize,
}

impl Index {
    /// Of every frustum, at its place.
    pub fn new(frusta: &[Frustum]) -> Index {
        let mut items: Vec<_> = FrustumId::all(frusta.len()).zip(frusta.iter().map(Frustum::bounds_world)).collect();
        let mut index = Index { nodes: Vec::with_capacity(2 * items.len()) };
        index.add(&mut items);
        index
    }

    /// The box around everything.
    pub fn bounds(&self) -> Bounds {
        self.nodes[0].bounds
    }

    fn add(&mut self, items: &mut [(FrustumId, Bounds)]) {
        let Some(bounds) = items.iter().map(|(_, bounds)| *bounds).reduce(Bounds::union) else { return };
        let at = self.nodes.len();
        self.nodes.push(Node { bounds, frustum: None, skip: 0 });
        if let [(frustum, _)] = items {
            self.nodes[at].frustum = Some(*frustum);
        } else {
            let axis = (bounds.max - bounds.min).max_position();
            let middle = items.len() / 2;
            items.select_nth_unstable_by(middle, |(_, a), (_, b)| a.middle()[axis].total_cmp(&b.middle()[axis]));
            let (low, high) = items.split_at_mut(middle);
            self.add(low);
            self.add(high);
        }
        self.nodes[at].skip = self.nodes.len();
    }

    /// The frusta whose boxes meet `bounds`, one of both grown by `slack_m` on every side.
    pub fn meeting(&self, bounds: Bounds, slack_m: f64) -> impl Iterator<Item = FrustumId> {
        let mut at = 0;
        std::iter::from_fn(move || {
            while let Some(node) = self.nodes.get(at) {
                let meets = node.bounds.meets(&bounds, slack_m);
                at = if meets { at + 1 } else { node.skip };
                if meets && node.frustum.is_some() {
                    return node.frustum;
                }
            }
            None
        })
    }

    /// As [`Index::meeting`], of a point.
    pub fn holding(&self, p_world: DVec3, slack_m: f64) -> impl Iterator<Item = FrustumId> {
        self.meeting(Bounds { min: p_world, max: p_world }, slack_m)
    }
}
