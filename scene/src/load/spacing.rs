//! How far apart points are: the mean distance of each to its nearest neighbours, by a k-d tree.
//!
//! J. L. Bentley, *Multidimensional binary search trees used for associative searching*, CACM 1975. The tree lies in one
//! array: the middle element of a range splits it, along the axis in which the range is longest.

use glam::DVec3;
use rayon::prelude::*;

/// A point of a square grid has so many neighbours that are equally near.
const NEIGHBOURS: usize = 4;
/// Shorter ranges are searched through: splitting them costs more than it saves.
const LEAF_POINTS: usize = 8;

/// Mean distance of each point to its [`NEIGHBOURS`] nearest others, or to all where there are fewer; 0 of a point that
/// is alone or has as many at its own place.
pub(super) fn spacings(points: &[DVec3]) -> Vec<f64> {
    let mut nodes: Vec<(DVec3, u32)> = points.iter().enumerate().map(|(index, &p)| (p, index as u32)).collect();
    let mut axes = vec![0_u8; points.len()];
    split(&mut nodes, &mut axes);
    let tree = Tree { points: nodes.iter().map(|node| node.0).collect(), axes };
    let by_node: Vec<f64> = (0..nodes.len()).into_par_iter().map(|node| tree.spacing(node)).collect();
    let mut by_point = vec![0.0; points.len()];
    nodes.iter().zip(by_node).for_each(|((_, index), spacing)| by_point[*index as usize] = spacing);
    by_point
}

/// Orders a range: the lower half, its middle, the upper half. As deep as the logarithm of its length.
fn split(nodes: &mut [(DVec3, u32)], axes: &mut [u8]) {
    if nodes.len() <= LEAF_POINTS {
        return;
    }
    let (min, max) =
        nodes.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), (p, _)| (min.min(*p), max.max(*p)));
    let axis = (max - min).max_position();
    let middle = nodes.len() / 2;
    nodes.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]));
    axes[middle] = axis as u8;
    let (lower, upper) = nodes.split_at_mut(middle);
    let (lower_axes, upper_axes) = axes.split_at_mut(middle);
    rayon::join(|| split(lower, lower_axes), || split(&mut upper[1..], &mut upper_axes[1..]));
}

struct Tree {
    points: Vec<DVec3>,
    /// Of each point that splits a range.
    axes: Vec<u8>,
}

impl Tree {
    fn spacing(&self, node: usize) -> f64 {
        let mut nearest = Nearest { of: self.points[node], node, squares: [f64::INFINITY; NEIGHBOURS] };
        self.search(0, self.points.len(), &mut nearest);
        let found = nearest.squares.iter().take_while(|square| square.is_finite()).count();
        nearest.squares[..found].iter().map(|square| square.sqrt()).sum::<f64>() / found.max(1) as f64
    }

    fn search(&self, from: usize, to: usize, nearest: &mut Nearest) {
        if to - from <= LEAF_POINTS {
            (from..to).for_each(|node| nearest.meet(node, self.points[node]));
            return;
        }
        let middle = from + (to - from) / 2;
        let split = self.points[middle];
        let axis = usize::from(self.axes[middle]);
        let past = nearest.of[axis] - split[axis];
        let (near, far) =
            if past < 0.0 { ((from, middle), (middle + 1, to)) } else { ((middle + 1, to), (from, middle)) };
        self.search(near.0, near.1, nearest);
        nearest.meet(middle, split);
        if past * past < nearest.squares[NEIGHBOURS - 1] {
            self.search(far.0, far.1, nearest);
        }
    }
}

/// The nearest points of one that were met so far.
struct Nearest {
    of: DVec3,
    node: usize,
    /// Squared distances, the smallest first.
    squares: [f64; NEIGHBOURS],
}

impl Nearest {
    fn meet(&mut self, node: usize, point: DVec3) {
        let square = point.distance_squared(self.of);
        if node == self.node || square >= self.squares[NEIGHBOURS - 1] {
            return;
        }
        let place = self.squares.partition_point(|known| *known <= square);
        self.squares.copy_within(place..NEIGHBOURS - 1, place + 1);
        self.squares[place] = square;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against all distances, sorted. Coordinates are whole numbers so that many points coincide.
        #[test]
        fn spacings_are_those_of_an_exhaustive_search(raw in prop::collection::vec([0_u8..12, 0..12, 0..3], 0..150)) {
            let points: Vec<DVec3> = raw.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
            for (index, found) in spacings(&points).into_iter().enumerate() {
                let others = points.iter().enumerate().filter(|(other, _)| *other != index);
                let mut distances: Vec<f64> = others.map(|(_, p)| p.distance(points[index])).collect();
                distances.sort_by(f64::total_cmp);
                distances.truncate(NEIGHBOURS);
                let expected = distances.iter().sum::<f64>() / distances.len().max(1) as f64;
                prop_assert!((found - expected).abs() < 1e-12, "{found} is not {expected}");
            }
        }
    }
}
