//! The figures that the 2016 paper prints.

/// What Xie, Wang and Popescu 2016 print for a scene, in per cent.
pub(super) struct Paper {
    pub scene: &'static str,
    /// Table 1: redundant samples of conventional images 1 and 2.
    pub redundant: [u32; 2],
    /// Table 1: disoccluded, and useful ones of those, of non-redundant images 1 and 2.
    pub non_redundant: [[u32; 2]; 2],
    /// Table 1: the same of layers 0, 1 and 2.
    pub peeled: [[u32; 2]; 3],
    /// Table 2: average and least of conventional, non-redundant and peeled sets.
    pub available: [[u32; 2]; 3],
}

pub(super) const PAPER: [Paper; 4] = [
    Paper {
        scene: "birdnest",
        redundant: [70, 80],
        non_redundant: [[62, 89], [76, 86]],
        peeled: [[10, 99], [46, 2], [52, 71]],
        available: [[90, 89], [93, 92], [92, 89]],
    },
    Paper {
        scene: "grass",
        redundant: [54, 69],
        non_redundant: [[56, 85], [75, 80]],
        peeled: [[15, 99], [51, 4], [71, 79]],
        available: [[86, 81], [96, 91], [93, 88]],
    },
    Paper {
        scene: "urban",
        redundant: [82, 84],
        non_redundant: [[73, 40], [80, 23]],
        peeled: [[1, 100], [78, 7], [88, 8]],
        available: [[97, 96], [98, 97], [96, 91]],
    },
    Paper {
        scene: "tree",
        redundant: [23, 35],
        non_redundant: [[84, 99], [88, 98]],
        peeled: [[44, 99], [63, 98], [72, 97]],
        available: [[55, 53], [59, 57], [55, 48]],
    },
];

/// Its three methods, in its order.
pub(super) const THREE: [&str; 3] = ["conventional", "non-redundant", "depth-peeling"];
