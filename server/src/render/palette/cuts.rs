//! Places cut into parts, and which part a place lies in.

use protocol::Material;

use super::place::{Place, mean, place};

/// Parts whose members are, in the mean of squares, this near to their entry are not cut, in numbers of which 1 is all that there is. Chosen, not
/// derived: a part is a sixtieth wide then, about four steps of the picture's 8 bits. Six materials of a helmet fill the
/// table before they come so near, and those of a test of clear coats take 133 entries.
const FINE_ENOUGH: f32 = 0.005;

/// What a material is in its places by one set of texture coordinates, cut into parts.
pub(super) struct Cuts {
    members: Vec<(Material, Place)>,
    nodes: Vec<Node>,
}

enum Node {
    /// Members by their numbers, along what they differ most and from where on; and the sum of the squares of how far they are from their mean, over
    /// the number of all members.
    Part {
        members: Vec<u32>,
        axis: usize,
        middle: f32,
        error: f32,
        code: u8,
    },
    Cut {
        axis: usize,
        middle: f32,
        sides: [usize; 2],
    },
}

impl Cuts {
    pub(super) fn new(members: Vec<Material>) -> Cuts {
        let members: Vec<(Material, Place)> =
            members.into_iter().map(|material| (material, place(&material))).collect();
        let mut cuts = Cuts { members, nodes: Vec::new() };
        let all = cuts.part((0..cuts.members.len() as u32).collect());
        cuts.nodes.push(all);
        cuts
    }

    fn part(&self, members: Vec<u32>) -> Node {
        let count = members.len().max(1) as f32;
        let along = |axis: usize| {
            let values = || members.iter().map(|&member| self.members[member as usize].1[axis]);
            let mean = values().sum::<f32>() / count;
            (axis, mean, values().map(|value| (value - mean) * (value - mean)).sum::<f32>())
        };
        let spreads: [(usize, f32, f32); size_of::<Place>() / 4] = std::array::from_fn(along);
        let sum: f32 = spreads.iter().map(|spread| spread.2).sum();
        let (axis, middle, _) = spreads.into_iter().max_by(|a, b| a.2.total_cmp(&b.2)).unwrap_or_default();
        Node::Part { error: sum / self.members.len().max(1) as f32, members, axis, middle, code: 0 }
    }

    /// The part with the most error, and how much it is.
    fn worst_part(&self) -> Option<(usize, f32)> {
        let error = |(index, node): (usize, &Node)| match node {
            // Finely enough told, if not of many members.
            Node::Part { members, error, .. }
                if *error * self.members.len() as f32 > FINE_ENOUGH * FINE_ENOUGH * members.len() as f32 =>
            {
                Some((index, *error))
            }
            _ => None,
        };
        self.nodes.iter().enumerate().filter_map(error).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    pub(super) fn worst(&self) -> f32 {
        self.worst_part().map_or(0.0, |(_, error)| error)
    }

    /// Cuts that part in two.
    pub(super) fn cut(&mut self) {
        let Some((index, _)) = self.worst_part() else { return };
        let Node::Part { members, axis, middle, .. } = &self.nodes[index] else { return };
        let (axis, middle) = (*axis, *middle);
        let is_less = |member: &&u32| self.members[**member as usize].1[axis] < middle;
        let (less, more): (Vec<&u32>, Vec<&u32>) = members.iter().partition(is_less);
        let parts = [less, more].map(|side| self.part(side.into_iter().copied().collect()));
        let sides = [self.nodes.len(), self.nodes.len() + 1];
        self.nodes.extend(parts);
        self.nodes[index] = Node::Cut { axis, middle, sides };
    }

    /// How many parts there are.
    pub(super) fn count(&self) -> usize {
        self.nodes.len().div_ceil(2)
    }

    /// Numbers the parts from `first` on, so far apart, along the cuts; what each is on the whole.
    pub(super) fn number(&mut self, first: usize, apart: usize) -> Vec<Material> {
        let (mut stack, mut entries) = (vec![0], Vec::new());
        while let Some(index) = stack.pop() {
            match &mut self.nodes[index] {
                Node::Part { members, code, .. } => {
                    *code = (first + entries.len() * apart) as u8;
                    entries.push(mean(members.iter().map(|&member| &self.members[member as usize].0)));
                }
                Node::Cut { sides: [less, more], .. } => stack.extend([*more, *less]),
            }
        }
        entries
    }

    /// Of the part that a place lies in.
    pub(super) fn code(&self, place: &Place) -> u8 {
        let mut index = 0;
        loop {
            match &self.nodes[index] {
                Node::Part { code, .. } => return *code,
                Node::Cut { axis, middle, sides } => index = sides[usize::from(place[*axis] >= *middle)],
            }
        }
    }
}
