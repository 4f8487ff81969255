//! Other systems on scenes and traces that we can replay: what is known of them, as data.
//!
//! Source: QUASAR, Lu and Rowe, SIGGRAPH 2025, measured with its public simulator, a snapshot of June 2025; QuadStream, MeshWarp
//! and asynchronous time warp (ATW) are the baselines of the same repository. Each system is scored against its own full-scene
//! render at the same poses. Mbit/s are every compressed byte of geometry that the client needs, at 30 updates a second;
//! colour is in none of them, and was neither lossy nor counted. ATW sends colour alone.

use crate::spread::Spread;

/// One run of one system: triples are mean, bad tail (95 %) and worst over its frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peer {
    /// Names the run in the per-frame figures.
    pub run: &'static str,
    /// Scene and trace.
    pub scene: &'static str,
    /// Who.
    pub system: &'static str,
    /// What differs from the system's defaults; empty for the defaults.
    pub setting: &'static str,
    /// The simulator's latency: 20 stands for 20 +- 10 ms, 50 for 50 +- 20 ms.
    pub latency_ms: u32,
    /// Over all pixels.
    pub flip: [f64; 3],
    /// Higher is better.
    pub ssim: [f64; 3],
    /// Higher is better.
    pub psnr_db: [f64; 3],
    /// Share of all pixels without geometry though the truth has some, before filling; for ATW, outside of the sent image.
    pub holes_share: [f64; 3],
    /// Without colour.
    pub geometry_mbit_s: f64,
    /// Mean and standard deviation.
    pub round_trip_ms: (f64, f64),
    /// Frames scored: 150, or every second one of them.
    pub frames: usize,
}

impl Peer {
    /// For people.
    pub fn name(&self) -> String {
        if self.setting.is_empty() { self.system.to_owned() } else { format!("{}, {}", self.system, self.setting) }
    }

    /// A triple with what is not known of it (the median) as not a number.
    pub fn spread(&self, [mean, p95, worst]: [f64; 3]) -> Spread {
        Spread { mean, median: f64::NAN, p95, worst, count: self.frames }
    }
}

/// Every run.
#[rustfmt::skip]
pub const PEERS: &[Peer] = &[
    Peer { run: "pillars_qr", scene: "pillars", system: "QUASAR", setting: "", latency_ms: 20,
        flip: [0.0472, 0.0518, 0.0649], ssim: [0.9429, 0.9268, 0.9123], psnr_db: [33.94, 32.23, 28.34],
        holes_share: [0.00155, 0.00259, 0.01079], geometry_mbit_s: 37.2, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "pillars_qs", scene: "pillars", system: "QuadStream", setting: "", latency_ms: 20,
        flip: [0.0497, 0.0616, 0.0739], ssim: [0.9416, 0.9198, 0.9035], psnr_db: [32.23, 26.04, 23.58],
        holes_share: [0.00340, 0.02003, 0.04127], geometry_mbit_s: 422.2, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "pillars_mw60", scene: "pillars", system: "MeshWarp, 60 degrees", setting: "", latency_ms: 20,
        flip: [0.0653, 0.0911, 0.1088], ssim: [0.9265, 0.8866, 0.8589], psnr_db: [25.86, 21.51, 19.95],
        holes_share: [0.02672, 0.06242, 0.08925], geometry_mbit_s: 6.4, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "pillars_mw120", scene: "pillars", system: "MeshWarp, 120 degrees", setting: "", latency_ms: 20,
        flip: [0.1117, 0.1161, 0.1171], ssim: [0.7043, 0.6906, 0.6855], psnr_db: [27.67, 27.33, 27.14],
        holes_share: [0.00000, 0.00000, 0.00000], geometry_mbit_s: 4.9, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "pillars_atw", scene: "pillars", system: "ATW", setting: "", latency_ms: 20,
        flip: [0.1241, 0.1904, 0.2064], ssim: [0.7076, 0.4954, 0.4282], psnr_db: [27.33, 22.34, 21.76],
        holes_share: [0.02158, 0.05099, 0.06819], geometry_mbit_s: 0.0, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "interior_qr", scene: "interior", system: "QUASAR", setting: "", latency_ms: 20,
        flip: [0.0473, 0.0515, 0.0526], ssim: [0.9286, 0.9153, 0.9093], psnr_db: [31.98, 30.74, 30.09],
        holes_share: [0.00136, 0.00209, 0.00225], geometry_mbit_s: 73.0, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "interior_qs", scene: "interior", system: "QuadStream", setting: "", latency_ms: 20,
        flip: [0.0496, 0.0558, 0.0589], ssim: [0.9239, 0.9099, 0.8977], psnr_db: [30.52, 28.31, 26.47],
        holes_share: [0.00105, 0.00680, 0.01481], geometry_mbit_s: 700.8, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "interior_mw60", scene: "interior", system: "MeshWarp, 60 degrees", setting: "", latency_ms: 20,
        flip: [0.0585, 0.0786, 0.0920], ssim: [0.9214, 0.8932, 0.8784], psnr_db: [26.74, 22.54, 20.86],
        holes_share: [0.01864, 0.04374, 0.05899], geometry_mbit_s: 7.3, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "interior_mw120", scene: "interior", system: "MeshWarp, 120 degrees", setting: "", latency_ms: 20,
        flip: [0.1069, 0.1113, 0.1122], ssim: [0.6576, 0.6441, 0.6376], psnr_db: [26.92, 26.47, 26.35],
        holes_share: [0.00008, 0.00030, 0.00046], geometry_mbit_s: 6.1, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "interior_atw", scene: "interior", system: "ATW", setting: "", latency_ms: 20,
        flip: [0.0858, 0.1368, 0.1532], ssim: [0.8151, 0.6114, 0.5452], psnr_db: [29.88, 25.18, 24.36],
        holes_share: [0.01792, 0.04433, 0.05466], geometry_mbit_s: 0.0, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "city_qr", scene: "city", system: "QUASAR", setting: "", latency_ms: 20,
        flip: [0.0312, 0.0382, 0.0505], ssim: [0.9253, 0.9047, 0.9005], psnr_db: [28.03, 26.88, 25.20],
        holes_share: [0.00212, 0.00309, 0.01043], geometry_mbit_s: 86.0, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "city_qs", scene: "city", system: "QuadStream", setting: "", latency_ms: 20,
        flip: [0.0407, 0.0506, 0.0593], ssim: [0.9011, 0.8766, 0.8653], psnr_db: [25.94, 24.50, 22.84],
        holes_share: [0.00192, 0.00838, 0.01630], geometry_mbit_s: 837.0, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "city_mw60", scene: "city", system: "MeshWarp, 60 degrees", setting: "", latency_ms: 20,
        flip: [0.0442, 0.0654, 0.0759], ssim: [0.9085, 0.8733, 0.8568], psnr_db: [25.56, 22.52, 20.86],
        holes_share: [0.01303, 0.03466, 0.04441], geometry_mbit_s: 6.6, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "city_mw120", scene: "city", system: "MeshWarp, 120 degrees", setting: "", latency_ms: 20,
        flip: [0.0709, 0.0822, 0.0841], ssim: [0.8218, 0.7945, 0.7874], psnr_db: [23.69, 22.91, 22.45],
        holes_share: [0.00011, 0.00041, 0.00089], geometry_mbit_s: 5.0, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "city_atw", scene: "city", system: "ATW", setting: "", latency_ms: 20,
        flip: [0.0502, 0.0816, 0.0923], ssim: [0.8984, 0.8229, 0.8011], psnr_db: [27.73, 23.60, 22.52],
        holes_share: [0.01661, 0.04561, 0.05609], geometry_mbit_s: 0.0, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "pillars_qr_50", scene: "pillars", system: "QUASAR", setting: "", latency_ms: 50,
        flip: [0.0512, 0.0609, 0.0889], ssim: [0.9292, 0.8998, 0.8636], psnr_db: [32.37, 27.71, 22.53],
        holes_share: [0.00580, 0.01433, 0.05305], geometry_mbit_s: 36.8, round_trip_ms: (163.2, 7.6), frames: 150 },
    Peer { run: "pillars_atw_50", scene: "pillars", system: "ATW", setting: "", latency_ms: 50,
        flip: [0.2653, 0.3015, 0.3093], ssim: [0.3352, 0.2481, 0.2295], psnr_db: [20.94, 19.00, 18.86],
        holes_share: [0.04976, 0.09573, 0.11696], geometry_mbit_s: 0.0, round_trip_ms: (163.2, 7.6), frames: 150 },
    Peer { run: "pillars_qr_v025", scene: "pillars", system: "QUASAR", setting: "view sphere 0.25 m", latency_ms: 20,
        flip: [0.0472, 0.0518, 0.0649], ssim: [0.9430, 0.9272, 0.9123], psnr_db: [33.95, 32.23, 28.34],
        holes_share: [0.00163, 0.00277, 0.01084], geometry_mbit_s: 32.9, round_trip_ms: (98.5, 3.8), frames: 150 },
    Peer { run: "pillars_qr_v100", scene: "pillars", system: "QUASAR", setting: "view sphere 1 m", latency_ms: 20,
        flip: [0.0471, 0.0520, 0.0649], ssim: [0.9428, 0.9272, 0.9123], psnr_db: [33.96, 32.21, 31.13],
        holes_share: [0.00140, 0.00230, 0.00372], geometry_mbit_s: 40.9, round_trip_ms: (98.5, 3.8), frames: 75 },
    Peer { run: "pillars_qr_coarse", scene: "pillars", system: "QUASAR", setting: "coarse thresholds", latency_ms: 20,
        flip: [0.0507, 0.0618, 0.0712], ssim: [0.9319, 0.9064, 0.8697], psnr_db: [33.09, 30.96, 29.03],
        holes_share: [0.00179, 0.00307, 0.00438], geometry_mbit_s: 32.7, round_trip_ms: (98.5, 3.8), frames: 75 },
    Peer { run: "pillars_qr_fine", scene: "pillars", system: "QUASAR", setting: "fine thresholds", latency_ms: 20,
        flip: [0.0470, 0.0519, 0.0649], ssim: [0.9432, 0.9277, 0.9121], psnr_db: [34.09, 32.26, 31.16],
        holes_share: [0.00139, 0.00234, 0.00364], geometry_mbit_s: 202.1, round_trip_ms: (98.5, 3.8), frames: 75 },
    Peer { run: "pillars_qr_nopred", scene: "pillars", system: "QUASAR", setting: "no prediction", latency_ms: 20,
        flip: [0.0502, 0.0578, 0.0703], ssim: [0.9288, 0.9011, 0.8866], psnr_db: [32.96, 29.30, 24.81],
        holes_share: [0.00359, 0.00919, 0.02855], geometry_mbit_s: 33.9, round_trip_ms: (66.0, 0.0), frames: 75 },
    Peer { run: "pillars_mw60_nopred", scene: "pillars", system: "MeshWarp, 60 degrees", setting: "no prediction", latency_ms: 20,
        flip: [0.1026, 0.1540, 0.1562], ssim: [0.8675, 0.7950, 0.7887], psnr_db: [21.79, 17.84, 17.59],
        holes_share: [0.07617, 0.14859, 0.15571], geometry_mbit_s: 5.8, round_trip_ms: (66.0, 0.0), frames: 75 },
    Peer { run: "pillars_atw_nopred", scene: "pillars", system: "ATW", setting: "no prediction", latency_ms: 20,
        flip: [0.2252, 0.2633, 0.2721], ssim: [0.4156, 0.3107, 0.3041], psnr_db: [22.21, 19.92, 19.70],
        holes_share: [0.06798, 0.11310, 0.12079], geometry_mbit_s: 0.0, round_trip_ms: (66.0, 0.0), frames: 75 },
    Peer { run: "pillars_qr_r960", scene: "pillars", system: "QUASAR", setting: "server at 960x540", latency_ms: 20,
        flip: [0.0428, 0.0458, 0.0478], ssim: [0.9517, 0.9419, 0.9350], psnr_db: [34.30, 33.04, 31.38],
        holes_share: [0.00051, 0.00129, 0.00269], geometry_mbit_s: 52.2, round_trip_ms: (98.5, 3.8), frames: 75 },
    Peer { run: "pillars_mw120_r1280", scene: "pillars", system: "MeshWarp, 120 degrees", setting: "server at 1280x720", latency_ms: 20,
        flip: [0.0552, 0.0580, 0.0595], ssim: [0.8979, 0.8897, 0.8871], psnr_db: [31.87, 31.14, 30.90],
        holes_share: [0.00000, 0.00000, 0.00000], geometry_mbit_s: 13.5, round_trip_ms: (98.5, 3.8), frames: 75 },
    Peer { run: "pillars_qr_lat0", scene: "pillars", system: "QUASAR", setting: "no delay", latency_ms: 0,
        flip: [0.0469, 0.0512, 0.0533], ssim: [0.9428, 0.9277, 0.9217], psnr_db: [34.49, 32.48, 30.76],
        holes_share: [0.00161, 0.00243, 0.00355], geometry_mbit_s: 34.2, round_trip_ms: (0.0, 0.0), frames: 75 },
];
