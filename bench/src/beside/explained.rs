//! Models that look unlike three.js for a reason that we know.

/// The reason, where one is known.
pub(super) fn why(name: &str) -> Option<&'static str> {
    EXPLAINED.iter().find(|(model, _)| *model == name).map(|(_, why)| *why)
}

/// By the names of pairs. A reason is of the model, not of a time: what is to be mended does not belong here.
const EXPLAINED: &[(&str, &str)] = &[
    (
        "GlassVaseFlowers",
        "three.js mixes what is blended as encoded, not in linear light, which darkens the left vase, and bends what is seen through the right one",
    ),
    ("MetalRoughSpheresNoTextures", "smooth metals mirror their neighbours here, and only the environment in three.js"),
];
