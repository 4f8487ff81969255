//! Where hidden points are counted.

use wgpu::{TextureFormat, TextureView};

/// Where the hidden points of a light are counted, in targets of [`Count::FORMAT`] and the view's size that began as zero.
#[derive(Debug, Clone, Copy)]
pub enum Count<'a> {
    /// Their share, added to a channel.
    Share {
        /// The target.
        hidden: &'a TextureView,
        /// 0 to 3.
        channel: usize,
    },
    /// Each by itself, for measuring: point `p` of a light is bit `p % 8` of channel `p / 8 % 4` of target `p / 32`.
    Each(&'a [TextureView]),
}

impl<'a> Count<'a> {
    /// Of the targets.
    pub const FORMAT: TextureFormat = TextureFormat::Rgba16Float;

    /// Points that a target of [`Count::Each`] holds.
    pub const POINTS_A_TARGET: usize = 32;

    /// Where a point counts, and what.
    pub(super) fn of(self, point: usize, points: usize) -> (&'a TextureView, [f32; 4]) {
        let only = |channel: usize, value: f32| std::array::from_fn(|index| if index == channel { value } else { 0.0 });
        match self {
            Count::Share { hidden, channel } => (hidden, only(channel, 1.0 / points as f32)),
            Count::Each(targets) => {
                let bit = point % Count::POINTS_A_TARGET;
                (&targets[point / Count::POINTS_A_TARGET], only(bit / 8, f32::from(1u8 << (bit % 8))))
            }
        }
    }

    /// The lamp's channel; the first where each point has a bit.
    pub(super) fn channel(self) -> usize {
        match self {
            Count::Share { channel, .. } => channel,
            Count::Each(_) => 0,
        }
    }

    /// The number of the target that a point counts in.
    pub(super) fn target_of(self, point: usize) -> usize {
        match self {
            Count::Share { .. } => 0,
            Count::Each(_) => point / Count::POINTS_A_TARGET,
        }
    }
}
