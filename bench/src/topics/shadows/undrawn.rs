//! What is said of a lamp's points that a frame does not draw, where each point is asked for: they are as most of their neighbours.
//!
//! Visibility changes along curves through the lamp, the outlines of what hides it, and is the same on each side of them: a point between four
//! that were drawn is guessed wrongly only where a curve passes, by half of the times at most.

use super::hidden::ones;

/// Of each of a lamp's `side * side` points, those that were drawn nearest to it: of one that was drawn itself alone.
pub(super) struct Neighbours {
    of: Vec<Vec<usize>>,
    drawn: u32,
}

impl Neighbours {
    pub fn new(drawn: &[usize], side: usize) -> Neighbours {
        let nearest = |point: usize| {
            let apart = |a: usize, b: usize| a.abs_diff(b).pow(2);
            let distance = |other: &usize| apart(other % side, point % side) + apart(other / side, point / side);
            let least = drawn.iter().map(distance).min();
            drawn.iter().copied().filter(|other| Some(distance(other)) == least).collect()
        };
        Neighbours { of: (0..side * side).map(nearest).collect(), drawn: drawn.len() as u32 }
    }

    /// Every point, from the bits of those that were drawn; where as many neighbours are seen as hidden, as most of all points that were drawn.
    pub fn vote(&self, words: &[u64]) -> Vec<u64> {
        let are_most_hidden = 2 * ones(words) > self.drawn;
        let is_hidden = |point: usize| words[point / 64] >> (point % 64) & 1 == 1;
        let mut all = vec![0; words.len()];
        for (point, neighbours) in self.of.iter().enumerate() {
            let twice = 2 * neighbours.iter().filter(|neighbour| is_hidden(**neighbour)).count();
            let guess = twice > neighbours.len() || twice == neighbours.len() && are_most_hidden;
            all[point / 64] |= u64::from(guess) << (point % 64);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_points_stay_as_they_are_and_others_follow_most_of_their_neighbours() {
        let drawn = [0, 2, 5, 7, 8, 10, 13, 15];
        let neighbours = Neighbours::new(&drawn, 4);
        assert!(drawn.iter().all(|point| neighbours.of[*point] == [*point]));
        assert_eq!((&*neighbours.of[6], &*neighbours.of[3]), (&[2, 5, 7, 10][..], &[2, 7][..]));
        // The lamp's upper half is hidden, and with it as many of its points.
        let upper = 0b0000_0000_1010_0101;
        assert_eq!(neighbours.vote(&[upper]), [0b0000_0000_1111_1111]);
        // Point 6 has two of both, and so have all; with one more most are hidden.
        assert_eq!(neighbours.vote(&[1 << 2 | 1 << 5])[0] >> 6 & 1, 0);
        assert_eq!(neighbours.vote(&[1 << 2 | 1 << 5 | 1 << 0 | 1 << 8 | 1 << 13])[0] >> 6 & 1, 1);
    }

    #[test]
    fn all_points_are_as_the_nearest_where_one_is_drawn() {
        assert_eq!(Neighbours::new(&[5], 4).vote(&[1 << 5]), [0xffff]);
        assert_eq!(Neighbours::new(&[5], 4).vote(&[0]), [0]);
    }
}
