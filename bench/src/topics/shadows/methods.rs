//! Ways of drawing shadows, each with its settings.

use client::draw::soft::{Bias, Choice, Method, Pace, Settings};

/// A way of drawing by its name.
#[derive(Clone, Copy)]
pub(super) struct Way {
    /// Up to the first comma it is that of the method, which other settings of it share.
    pub name: &'static str,
    /// From the lamp's points a side and the images' side in pixels.
    pub settings: fn(u32, u32) -> Settings,
}

/// The paper's.
pub(super) const PAPERS: &str = "maps";

/// Draws the same maps.
pub(super) const SAME_MAPS: &str = "warp";

/// All of them, the paper's first.
pub(super) const METHODS: &[Way] = &[
    Way { name: PAPERS, settings: |points, image_px| plain(Method::Maps, points, image_px) },
    Way { name: SAME_MAPS, settings: |points, image_px| plain(Method::Warp, points, image_px) },
    Way {
        name: "warp, three quarters of the points",
        settings: |points, px| some(points * points * 3 / 4, points, px),
    },
    Way { name: "warp, half of the points", settings: |points, px| some(points * points / 2, points, px) },
    Way { name: "warp, a quarter of the points", settings: |points, px| some(points * points / 4, points, px) },
    Way { name: "warp, a sixteenth of the points", settings: |points, px| some(points * points / 16, points, px) },
    Way { name: "warp, maps of half the side", settings: |points, image_px| plain(Method::Warp, points, image_px / 2) },
    Way { name: "warp, no bias", settings: |points, image_px| biased(0, points, image_px) },
    Way { name: "warp, eight times the bias", settings: |points, image_px| biased(8, points, image_px) },
    Way { name: "march", settings: |points, image_px| plain(Method::March, points, image_px) },
];

fn plain(method: Method, points: u32, map_px: u32) -> Settings {
    Settings { choice: Choice::Always(method), points, map_px, ..Settings::default() }
}

/// With so many times the bias that is derived.
fn biased(times: u32, points: u32, map_px: u32) -> Settings {
    Settings { bias: Bias { times }, ..plain(Method::Warp, points, map_px) }
}

/// What the first frame shows where a frame draws `some` of the points.
fn some(some: u32, points: u32, map_px: u32) -> Settings {
    Settings { pace: Pace::Points(some.max(1)), ..plain(Method::Warp, points, map_px) }
}

impl Way {
    /// The name without what is set.
    pub fn method(&self) -> &'static str {
        method_of(self.name)
    }

    /// Whether the paper draws so.
    pub fn is_papers(&self) -> bool {
        self.name == PAPERS
    }
}

/// See [`Way::method`].
pub(super) fn method_of(name: &str) -> &str {
    name.split(", ").next().unwrap_or(name)
}

/// The ways of these names; all where none is named.
pub(super) fn named(names: &[String]) -> Result<Vec<Way>, String> {
    if let Some(name) = names.iter().find(|name| !METHODS.iter().any(|way| way.name == *name)) {
        let known: Vec<&str> = METHODS.iter().map(|way| way.name).collect();
        return Err(format!("{name:?} is no way of drawing shadows; there are: {}", known.join("; ")));
    }
    let is_asked_for = |way: &&Way| names.is_empty() || names.iter().any(|name| name == way.name);
    Ok(METHODS.iter().filter(is_asked_for).copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_of_ways_and_each_is_there_once() {
        assert_eq!(METHODS[0].name, PAPERS);
        let of = |name: &str| named(&[name.to_owned()]).map(|ways| ways.len());
        assert_eq!((of("maps"), of("warp, maps of half the side")), (Ok(1), Ok(1)));
        assert!(of("warp") == Ok(1) && of("wrap").is_err());
        let mut names: Vec<&str> = METHODS.iter().map(|way| way.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), METHODS.len());
    }
}
