//! Whether triangles close a solid, so that their backs are never seen.

use std::collections::HashMap;

use glam::DVec3;

/// Whether every edge is shared by two triangles that run along it in opposite directions. Positions are compared by
/// value: formats without a flag for double-sided surfaces often repeat them.
///
/// Where it holds, backs need not be drawn; where not (a sheet, a pot without a lid), they are visible.
pub(super) fn is_closed(positions: &[DVec3], triangles: &[[u32; 3]]) -> bool {
    let mut ids = HashMap::with_capacity(positions.len());
    let welded: Vec<u32> = positions
        .iter()
        .map(|p| {
            let next = ids.len() as u32;
            // -0.0 is the same place as 0.0.
            *ids.entry((*p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(next)
        })
        .collect();
    // Of each undirected edge, how many triangles run up it minus how many run down, and how many there are.
    let mut edges: HashMap<(u32, u32), (i32, u32)> = HashMap::with_capacity(triangles.len() * 3 / 2);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|index| welded[index as usize]);
        if a == b || b == c || c == a {
            continue;
        }
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (balance, count) = edges.entry((from.min(to), from.max(to))).or_default();
            *balance += if from < to { 1 } else { -1 };
            *count += 1;
        }
    }
    !edges.is_empty() && edges.values().all(|&(balance, count)| balance == 0 && count == 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    #[test]
    fn a_tetrahedron_is_closed_until_a_face_is_missing_or_turned() {
        assert!(is_closed(&CORNERS, &TETRAHEDRON));
        assert!(!is_closed(&CORNERS, &TETRAHEDRON[..3]));
        let mut turned = TETRAHEDRON;
        turned[3].swap(0, 1);
        assert!(!is_closed(&CORNERS, &turned));
    }

    #[test]
    fn repeated_positions_close_too() {
        let positions: Vec<DVec3> = TETRAHEDRON.iter().flatten().map(|&i| CORNERS[i as usize]).collect();
        let triangles: Vec<[u32; 3]> = (0..4).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        assert!(is_closed(&positions, &triangles));
    }
}
