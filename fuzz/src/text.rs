//! What people write: traces, links, cameras.

use camera::written::NamedWritten;
use camera::{Bounds, ImagePoint, Rigid, Trace};
use glam::DVec3;
use network::{Link, LinkModel};

/// The first byte says what the rest is.
pub fn traces(bytes: &[u8]) -> bool {
    let Some((&kind, bytes)) = bytes.split_first() else { return false };
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    match kind % 3 {
        0 => trace(text),
        1 => link(text),
        _ => written(text),
    }
}

fn trace(text: &str) -> bool {
    let Ok(trace) = Trace::parse(text) else { return false };
    let end_s = trace.duration_s();
    assert!(!trace.poses.is_empty() && end_s.is_finite());
    assert!(trace.poses.is_sorted_by(|a, b| a.t_s <= b.t_s), "times run backwards");
    for t_s in [f64::NEG_INFINITY, -1.0, 0.0, end_s / 3.0, end_s, f64::INFINITY] {
        let pose = trace.at(t_s);
        assert!(pose.is_valid(), "{pose:?} at {t_s}");
    }
    true
}

fn link(text: &str) -> bool {
    let Ok(link) = text.parse::<Link>() else { return false };
    let printed = link.to_string();
    let again: Link = printed.parse().unwrap_or_else(|error| panic!("{printed}: {error}"));
    assert_eq!(again.to_string(), printed);
    let mut model = LinkModel::new(link, 7);
    let mut last_s = f64::NEG_INFINITY;
    for (at_s, bytes) in [(0.0, 1), (0.0, 40), (0.5, 65_536), (0.25, 9), (4e3, 1 << 20), (1e9, 3)] {
        let arrival_s = model.deliver(at_s, bytes);
        assert!(arrival_s.is_finite() && arrival_s >= at_s && arrival_s >= last_s, "{arrival_s} after {last_s}");
        last_s = arrival_s;
    }
    true
}

fn written(text: &str) -> bool {
    let Ok(written) = serde_json::from_str::<NamedWritten>(text) else { return false };
    let Ok(written) = written.camera() else { return false };
    let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE };
    let bounds_of = |name: &str| (name == "cube").then_some(bounds);
    let Ok(camera) = written.compile(&Rigid::IDENTITY, &bounds_of) else { return false };
    assert!(camera.is_valid(), "{camera:?}");
    let (width_px, height_px) = camera.size_px();
    for (u, v) in [(0.5, 0.5), (f64::from(width_px) / 2.0, f64::from(height_px) / 3.0)] {
        for w in [1e-3, 0.3, 4.0] {
            let seen = camera.image_from_world(camera.world_from_image(ImagePoint { u, v, w }));
            assert!(seen.is_none_or(|point| [point.u, point.v, point.w].iter().all(|number| !number.is_nan())));
        }
    }
    true
}
