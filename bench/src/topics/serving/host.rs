//! A model of what a host with a GPU serves, from what the parts of a look take here.
//!
//! A looking thread has a look for the time of its own code and for as long as it waits for the GPU; the GPU has it for its own time; one thread
//! encodes. What comes first of these bounds the looks a second of many walkers, who always wait for a turn:
//!
//! `looks a second = min(threads / (own + wait), 1 / gpu, 1 / encode)`
//!
//! Its own code compares, keeps, and all else; views of the scene and of the copy are the GPU's, which is where there is one. The wait is the GPU's time and a
//! latency for each time that a look waits: once for the scene, and once for each view of the copy. On an adapter in software all of that is this machine's own
//! work, so the GPU's part cannot be measured there: the model says how much it may be. Its own code takes several cores for moments; here it had two.

use server::look_times::Part;

use crate::report::{Report, Row};

/// Side of the walker's images, in pixels.
pub(super) const IMAGE_PX: u32 = 512;
/// Between a submission and its answer when the GPU has nothing else to do: a few passes, a copy to host memory, a fence. Assumed.
const LATENCY_MS: f64 = 0.5;
/// Times that a look waits: for the scene's views, and for each of three images of the copy.
const WAITS: f64 = 4.0;
/// What a look may take of the GPU. Assumed.
const GPU_MS: [f64; 4] = [0.5, 1.0, 2.0, 5.0];
/// Looking threads: as many as a server starts at most, and more.
const THREADS: [f64; 3] = [4.0, 8.0, 16.0];

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
        let own = [Part::Compare, Part::Keep, Part::Other].into_iter().map(part).sum::<Option<f64>>()?;
        Some(Look { own_ms: own, encode_ms: part(Part::Encode)? }).filter(|look| look.own_ms > 0.0)
    }

    fn per_s(self, threads: f64, gpu_ms: f64) -> f64 {
        let looking = threads / (self.own_ms + gpu_ms + WAITS * LATENCY_MS);
        1000.0 * looking.min(1.0 / gpu_ms).min(1.0 / self.encode_ms)
    }
}

/// Adds the walker's row, and what the model makes of it.
pub(super) fn rows(walker: &Row, report: &mut Report) {
    report.rows.push(Row { method: format!("{} with images of {IMAGE_PX} px", walker.method), ..walker.clone() });
    let Some(look) = Look::of(walker) else { return };
    for gpu_ms in GPU_MS {
        let mut row = Row::new(&walker.scene, &format!("GPU host, {gpu_ms} ms of the GPU a look"));
        row.counts.set("gpu_ms", gpu_ms);
        for threads in THREADS {
            row.counts.set(format!("looks_per_s_by_{threads}_threads"), look.per_s(threads, gpu_ms));
        }
        report.rows.push(row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_narrowest_place_bounds_the_looks() {
        let look = Look { own_ms: 17.0, encode_ms: 2.0 };
        assert_eq!(look.per_s(4.0, 1.0), 200.0, "four threads, 20 ms each");
        assert_eq!(look.per_s(16.0, 1.0), 500.0, "the encoder");
        assert_eq!(look.per_s(16.0, 5.0), 200.0, "the GPU");
        let mut row = Row::new("a scene", "1 walkers");
        Part::ALL.into_iter().for_each(|part| row.counts.set(format!("look_{}_ms", part.name()), 2.0));
        let look = Look::of(&row).expect("all parts");
        assert_eq!((look.own_ms, look.encode_ms), (6.0, 2.0));
    }
}
