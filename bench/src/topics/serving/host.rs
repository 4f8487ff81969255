//! A model of what a host with a GPU serves, from what the parts of a look take here.
//!
//! There views are drawn and compared on the GPU ([`server::beside`]), and the processor edits the copy, builds its surfaces and encodes. A looking thread
//! has a look for the time of its own code and for as long as it waits for the GPU; the GPU has it for its own time; others encode. What
//! comes first of these bounds the looks a second of many walkers, who always wait for a turn:
//!
//! `looks a second = min(looking / (own + wait), 1 / gpu, encoding / encode, cores / (own + encode))`
//!
//! Its own code is measured here, by a server that is told to compare on the GPU, whatever it is: all but the wait. That is the GPU's time and a latency for
//! each view. On an adapter in software what the GPU takes cannot be measured: the model says how much it may be. Drawing the scene's views is left out as the
//! GPU's too, with what it takes to say so.

use server::look_times::Part;

use crate::report::{Report, Row};

/// Side of the walker's images, in pixels.
pub(super) const IMAGE_PX: u32 = 512;
/// Between a submission and its answer when the GPU has nothing else to do: a few passes, a copy to host memory, a fence. Assumed.
const LATENCY_MS: f64 = 0.5;
/// Times that a look waits: for each of three images.
const WAITS: f64 = 3.0;
/// What a look may take of the GPU. Assumed.
const GPU_MS: [f64; 4] = [0.5, 1.0, 2.0, 5.0];
/// Cores of the host: there is a looking thread for each, 16 at most, and one that encodes for every four of them.
const CORES: [f64; 3] = [8.0, 16.0, 32.0];
const MOST_LOOKING: f64 = 16.0;
const LOOKING_AN_ENCODER: f64 = 4.0;

/// What a look takes on the host, in milliseconds.
#[derive(Debug, Clone, Copy)]
struct Look {
    own_ms: f64,
    encode_ms: f64,
}

impl Look {
    /// Of a row of one walker; `None` where it has no looks.
    fn of(row: &Row) -> Option<Look> {
        let part = |part: Part| row.figure(&format!("counts.look_{}_ms", part.name()));
        let own = [Part::Copy, Part::Compare, Part::Keep, Part::Other].into_iter().map(part).sum::<Option<f64>>()?;
        Some(Look { own_ms: own, encode_ms: part(Part::Encode)? }).filter(|look| look.own_ms > 0.0)
    }

    fn per_s(self, cores: f64, gpu_ms: f64) -> f64 {
        let looking = cores.min(MOST_LOOKING);
        let looks = looking / (self.own_ms + gpu_ms + WAITS * LATENCY_MS);
        let encoded = (looking / LOOKING_AN_ENCODER).ceil() / self.encode_ms;
        let worked = cores / (self.own_ms + self.encode_ms);
        1000.0 * looks.min(encoded).min(worked).min(1.0 / gpu_ms)
    }
}

/// Adds the walker's row, and what the model makes of it.
pub(super) fn rows(walker: &Row, report: &mut Report) {
    report.rows.push(Row { method: format!("{} with images of {IMAGE_PX} px", walker.method), ..walker.clone() });
    let Some(look) = Look::of(walker) else { return };
    for gpu_ms in GPU_MS {
        let mut row = Row::new(&walker.scene, &format!("GPU host, {gpu_ms} ms of the GPU a look"));
        row.counts.set("gpu_ms", gpu_ms);
        for cores in CORES {
            row.counts.set(format!("looks_per_s_by_{cores}_cores"), look.per_s(cores, gpu_ms));
        }
        report.rows.push(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_narrowest_place_bounds_the_looks() {
        let look = Look { own_ms: 17.5, encode_ms: 2.5 };
        assert_eq!(look.per_s(8.0, 1.0), 400.0, "eight threads, 20 ms each, and as much work as eight cores do");
        assert_eq!(look.per_s(8.0, 5.0), 200.0, "the GPU");
        assert_eq!(look.per_s(32.0, 1.0), 800.0, "sixteen threads at most");
        assert_eq!(Look { own_ms: 1.0, encode_ms: 20.0 }.per_s(16.0, 1.0), 200.0, "four that encode");
        let mut row = Row::new("a scene", "1 walkers");
        Part::ALL.into_iter().for_each(|part| row.counts.set(format!("look_{}_ms", part.name()), 2.0));
        let look = Look::of(&row).expect("all parts");
        assert_eq!((look.own_ms, look.encode_ms), (8.0, 2.0));
    }
}
