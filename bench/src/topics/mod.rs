//! The topics, one file or folder each.

pub mod codec;
pub mod frame_rate;
pub mod impostors;
pub mod layers;
pub mod left_out;
pub mod light_images;
pub mod materials;
pub mod network;
pub mod novel_views;
pub mod occlusion;
pub mod others;
pub mod reconstruction;
pub mod relay;
pub mod sampling;
pub mod sent_once;
pub mod serving;
pub mod shadows;
pub mod soak;
pub mod stability;
pub mod timing;

use crate::topic::Topic;

/// Every topic, in the order in which the command lists them.
pub const ALL: &[&dyn Topic] = &[
    &sampling::Sampling,
    &reconstruction::Reconstruction,
    &sent_once::SentOnce,
    &serving::Serving,
    &relay::Relay,
    &network::Network,
    &others::Others,
    &soak::Soak,
    &timing::Timing,
    &frame_rate::FrameRateTopic,
    &codec::Codec,
    &materials::Materials,
    &layers::Layers,
    &impostors::Impostors,
    &shadows::Shadows,
    &stability::Stability,
    &left_out::LeftOut,
    &light_images::LightImages,
    &occlusion::Occlusion,
    &novel_views::NovelViews,
];
