//! Steadiness of ambient occlusion on scenes: `occlusion [--quick] [--size=PX] [--poses=N] [--reach=RADII] [--elevation=DEGREES] SCENE...`.

use gpu::Gpu;
use vantage_bench::stage::load_scene;
use vantage_bench::topics::impostors::occlusion::{StabilityPlan, stability};

fn main() -> anyhow::Result<()> {
    let (flags, scenes): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(|word| word.starts_with("--"));
    let plan = if flags.iter().any(|flag| flag == "--quick") { StabilityPlan::QUICK } else { StabilityPlan::FULL };
    let number = |name: &str| flags.iter().find_map(|flag| flag.strip_prefix(name)?.parse::<f64>().ok());
    let side_px = number("--size=").map_or(plan.size_px.0, |side| side as u32);
    let plan = StabilityPlan {
        size_px: (side_px, side_px),
        poses: number("--poses=").map_or(plan.poses, |poses| poses as usize),
        reach: number("--reach=").unwrap_or(plan.reach),
        elevation_rad: number("--elevation=").map_or(plan.elevation_rad, f64::to_radians),
        ..plan
    };
    let gpu = Gpu::block_on(Gpu::new_headless())?;
    for name in scenes {
        let table = stability(&gpu, load_scene(&name, 1.0)?, &plan)?;
        println!("{name}: {} points, ray-traced mean {:.3}", table.points, table.traced);
        for row in table.rows {
            println!(
                "  {:>6}: deviation {:.4}  error {:.4}  bias {:+.4}  {:.0} ms a frame",
                format!("{:?}", row.occlusion),
                row.deviation,
                row.error,
                row.bias,
                row.frame_ms
            );
        }
    }
    Ok(())
}
