//! Circles of a directed graph.

use std::collections::{BTreeMap, BTreeSet};

/// The strongly connected components of more than one node, each in order.
pub fn rings<'a>(edges: impl Iterator<Item = (&'a str, &'a str)>) -> Vec<Vec<&'a str>> {
    let (mut to, mut from) = (Graph::new(), Graph::new());
    for (a, b) in edges {
        to.entry(a).or_default().insert(b);
        from.entry(b).or_default().insert(a);
    }
    let mut done: BTreeSet<&str> = BTreeSet::new();
    let mut rings = Vec::new();
    for &node in to.keys() {
        if !done.contains(node) {
            // Who is reached from a node and reaches it lies in a circle with it.
            let behind = reached(&from, node);
            let ring: Vec<&str> = reached(&to, node).intersection(&behind).copied().collect();
            done.extend(&ring);
            if ring.len() > 1 {
                rings.push(ring);
            }
        }
    }
    rings
}

type Graph<'a> = BTreeMap<&'a str, BTreeSet<&'a str>>;

/// A node, and all that follow it.
fn reached<'a>(graph: &Graph<'a>, node: &'a str) -> BTreeSet<&'a str> {
    let mut seen = BTreeSet::from([node]);
    let mut next = vec![node];
    while let Some(node) = next.pop() {
        next.extend(graph.get(node).into_iter().flatten().filter(|node| seen.insert(node)));
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_are_found_and_ways_are_not() {
        let edges = "ab bc ca cd de ef fe gd gg ha".split(' ').map(|edge| edge.split_at(1));
        assert_eq!(rings(edges), [vec!["a", "b", "c"], vec!["e", "f"]]);
    }
}
