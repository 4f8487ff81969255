//! What the figures look like: Fig. 6 of the paper, and what output frames miss.

use server::discretize::{Capture, Discretization};

use super::made::Made;
use super::metrics::{Bench, SampleWorth, Worth};
use crate::compare::Picture;
use crate::report::Report;
use crate::topic::Run;

/// Conventional images do not hold it.
const DISOCCLUDED: [u8; 3] = [60, 170, 60];
/// The same, and some output frame needs it.
const USEFUL: [u8; 3] = [250, 210, 0];
/// No image holds its surface.
const MISSING: [u8; 3] = [220, 0, 0];
/// An image holds its surface, but another triangle of it.
const OTHER_TRIANGLE: [u8; 3] = [250, 170, 0];
/// Sets that are shown, where they were made.
const SHOWN: [&str; 3] = ["conventional", "non-redundant", "covered-triangle"];

/// A capture with a colour for some of its samples (`None`: its own, as grey); white where it has none.
fn painted(capture: &Capture, mut paint: impl FnMut(usize) -> Option<[u8; 3]>) -> Picture {
    let mut sample = 0;
    let mut rgb = Vec::with_capacity(capture.ids.len() * 3);
    for (ids, [r, g, b, _]) in capture.ids.iter().zip(&capture.colour) {
        if ids[0] == 0 {
            rgb.extend([255; 3]);
            continue;
        }
        let grey = (u16::from(*r) + u16::from(*g) + u16::from(*b)) / 6 + 90;
        rgb.extend(paint(sample).unwrap_or([grey as u8; 3]));
        sample += 1;
    }
    Picture { width_px: capture.camera.width_px, height_px: capture.camera.height_px, rgb, covered: None }
}

/// Fig. 6: the last image of the non-redundant and of the peeled set.
pub(super) fn worth(label: &str, sets: &[(&Made, &Worth)], run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let colour = |sample: &SampleWorth| match (sample.disoccluded, sample.needed) {
        (false, _) => None,
        (true, false) => Some(DISOCCLUDED),
        (true, true) => Some(USEFUL),
    };
    for name in ["non-redundant", "depth-peeling"] {
        let Some((made, worth)) = sets.iter().find(|(made, _)| made.name == name) else { continue };
        let (Some(capture), Some(samples)) = (made.captures.last(), worth.of_samples.last()) else { continue };
        let caption = format!(
            "{label}, {name}: the last image. Yellow: conventional images do not hold it, and an output frame needs it; green: they \
             do not, and none does; grey: they do (Fig. 6)."
        );
        let path = run.figure(report, format!("{label}-{name}-samples.png"), caption);
        painted(capture, |sample| colour(&samples[sample])).write(&path)?;
    }
    Ok(())
}

/// The output frame that misses the most by non-redundant images, and what other sets miss of it.
pub(super) fn missing(
    label: &str,
    bench: &mut Bench<'_>,
    sets: &[(&Made, &Worth)],
    frames: &[camera::Pinhole],
    (run, report): (&Run, &mut Report),
) -> anyhow::Result<()> {
    let Some((_, worth)) = sets.iter().find(|(made, _)| made.name == "non-redundant") else { return Ok(()) };
    let worst = worth.missing.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(frame, _)| frame);
    let frame = bench.captures(&frames[worst..=worst], Discretization::Conventional)?.remove(0);
    let mut pictures = Vec::new();
    for name in SHOWN {
        let Some((made, _)) = sets.iter().find(|(made, _)| made.name == name) else { continue };
        let held = (bench.holds)(&[&frame], &made.captures)?.remove(0);
        let surface = (bench.holds_surface)(&[&frame], &made.captures)?.remove(0);
        pictures.push(painted(&frame, |sample| match (held[sample], surface[sample]) {
            (true, _) => None,
            (false, true) => Some(OTHER_TRIANGLE),
            (false, false) => Some(MISSING),
        }));
    }
    let caption = format!(
        "{label}, output frame {worst}: what {} images miss. Red: no image holds the surface there; orange: one does, but its pixel there \
         holds another triangle.",
        SHOWN.join(", ")
    );
    let path = run.figure(report, format!("{label}-missing.png"), caption);
    Ok(Picture::beside(&pictures.iter().collect::<Vec<_>>(), 4).write(&path)?)
}
