//! How the metrics by pixels and by rays approach each other as images grow (Xie, Wang, Popescu 2016, Fig. 7).

use gpu::Gpu;
use server::discretize::{Discretization, Redundancy, RedundancyTest};

use super::metrics::{Bench, on_gpu};
use super::output;
use super::settings::{IMAGES, SEED};
use super::triangle::ViewTriangle;
use crate::report::Row;

/// Frames that say what is useful.
const FRAMES: usize = 6;

/// Both metrics at one size of images.
pub(super) fn rows(
    gpu: &Gpu,
    bench: &mut Bench<'_>,
    triangle: &ViewTriangle,
    near_m: f64,
    image_px: u32,
) -> anyhow::Result<Vec<Row>> {
    let size_px = (image_px, image_px);
    let corners = triangle.corners(size_px, near_m);
    let frames = triangle.between(FRAMES, SEED, size_px, near_m);
    let conventional = bench.captures(&corners, Discretization::Conventional)?;
    let mut rows = Vec::new();
    for (name, test) in [("by pixels", RedundancyTest::Pixel), ("by rays", RedundancyTest::VisibilityPlain)] {
        let method = match test {
            RedundancyTest::Pixel => Discretization::PIXEL,
            _ => Discretization::NonRedundant(Redundancy::by(RedundancyTest::Visibility)),
        };
        let usual = std::mem::replace(&mut bench.holds, on_gpu(gpu, bench.stage, test)?);
        let set = bench.captures(&corners, method)?;
        let references = (0..IMAGES).map(|index| vec![conventional[index].clone()]).collect();
        let worths =
            bench.worth(&[(&conventional, vec![conventional.clone(); IMAGES]), (&set, references)], &frames, |_| ());
        bench.holds = usual;
        let worths = worths?;
        let mut row = Row::new(&bench.stage.scene.name, &format!("metrics {name}"));
        row.parameters.set("image_px", image_px);
        output::set_each(&mut row, "redundant", &worths[0].redundant);
        output::set_each(&mut row, "disoccluded", &worths[1].disoccluded);
        output::set_each(&mut row, "useful", &worths[1].useful);
        rows.push(row);
    }
    Ok(rows)
}
