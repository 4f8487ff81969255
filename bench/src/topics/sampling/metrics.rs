//! The four metrics of Xie, Wang, Popescu 2016, §6.1.2. A sample is *held* by images when it is redundant with one of them.

use camera::Pinhole;
use server::discretize::{Capture, Discretization, Discretizer, Meter};

use crate::stage::Stage;

/// What a set was found to be worth.
#[derive(Debug, Clone, Default)]
pub struct Worth {
    /// Samples of each image.
    pub samples: Vec<usize>,
    /// Share of each image's samples that earlier images of the set hold (metric 1).
    pub redundant: Vec<f64>,
    /// Share of each image's samples that conventional images do not hold (metric 2).
    pub disoccluded: Vec<f64>,
    /// Share of those that some output frame needs (metric 3).
    pub useful: Vec<f64>,
    /// Of each output frame, the share of samples that no image holds: 1 less metric 4.
    pub missing: Vec<f64>,
    /// The same by surface, for sets that leave out other triangles of one surface.
    pub missing_by_surface: Vec<f64>,
}

/// A scene, and what measures it.
pub struct Bench<'a> {
    /// The scene.
    pub stage: &'a Stage,
    /// Makes images.
    pub discretizer: Discretizer,
    /// The test that the metrics are taken by.
    pub meter: Meter,
    /// By surface.
    pub surface_meter: Meter,
}

/// Frames in one batch: a set's images at most.
const BATCH: usize = 15;

impl Bench<'_> {
    /// Images of `cameras` by a method.
    pub fn captures(&mut self, cameras: &[Pinhole], method: Discretization) -> anyhow::Result<Vec<Capture>> {
        Ok(self.discretizer.run(&self.stage.renderer, cameras, method)?.wait()?)
    }

    /// Which samples of an image others hold, sample by sample.
    fn held(&self, meter: &Meter, capture: &Capture, images: &[Capture]) -> anyhow::Result<Vec<bool>> {
        if images.is_empty() {
            return Ok(vec![false; samples(capture)]);
        }
        let pixels = meter.redundant(&self.stage.renderer, capture, images)?;
        Ok(pixels.into_iter().zip(&capture.ids).filter(|(_, ids)| ids[0] != 0).map(|(held, _)| held).collect())
    }

    /// Metric 1, image by image.
    pub fn redundant(&self, set: &[Capture]) -> anyhow::Result<Vec<f64>> {
        let share = |index: usize| Ok(share(&self.held(&self.meter, &set[index], &set[..index])?));
        (0..set.len()).map(share).collect()
    }

    /// All metrics of sets, against the same frames. `conventional`: for each image of each set, the conventional images that its
    /// disoccluded samples are not held by. `say` is told of every batch of frames.
    pub fn worth(
        &mut self,
        sets: &[(&[Capture], Vec<Vec<Capture>>)],
        frames: &[Pinhole],
        mut say: impl FnMut(usize),
    ) -> anyhow::Result<Vec<Worth>> {
        let mut worths = Vec::new();
        // Of each image of each set, the samples that are disoccluded and those of them that a frame needed so far.
        let mut disoccluded: Vec<Vec<Vec<bool>>> = Vec::new();
        for (set, conventional) in sets {
            let not_held = |(image, others): (&Capture, &Vec<Capture>)| {
                let held = self.held(&self.meter, image, others)?;
                anyhow::Ok(held.into_iter().map(|held| !held).collect::<Vec<bool>>())
            };
            let flags = set.iter().zip(conventional).map(not_held).collect::<anyhow::Result<Vec<_>>>()?;
            worths.push(Worth {
                samples: set.iter().map(samples).collect(),
                redundant: self.redundant(set)?,
                disoccluded: flags.iter().map(|flags| share(flags)).collect(),
                ..Worth::default()
            });
            disoccluded.push(flags);
        }
        let mut needed: Vec<Vec<Vec<bool>>> =
            disoccluded.iter().map(|set| set.iter().map(|flags| vec![false; flags.len()]).collect()).collect();
        for cameras in frames.chunks(BATCH) {
            let shown = self.captures(cameras, Discretization::Conventional)?;
            for (index, (set, _)) in sets.iter().enumerate() {
                for (image, needed) in set.iter().zip(&mut needed[index]) {
                    let held = self.held(&self.meter, image, &shown)?;
                    needed.iter_mut().zip(held).for_each(|(needed, held)| *needed |= held);
                }
                for frame in &shown {
                    worths[index].missing.push(1.0 - share(&self.held(&self.meter, frame, set)?));
                    worths[index].missing_by_surface.push(1.0 - share(&self.held(&self.surface_meter, frame, set)?));
                }
            }
            say(cameras.len());
        }
        for (worth, (disoccluded, needed)) in worths.iter_mut().zip(disoccluded.iter().zip(&needed)) {
            worth.useful =
                disoccluded.iter().zip(needed).map(|(disoccluded, needed)| useful(disoccluded, needed)).collect();
        }
        Ok(worths)
    }
}

/// Samples of an image.
pub fn samples(capture: &Capture) -> usize {
    capture.ids.iter().filter(|ids| ids[0] != 0).count()
}

fn share(flags: &[bool]) -> f64 {
    flags.iter().filter(|flag| **flag).count() as f64 / flags.len().max(1) as f64
}

/// Of what is disoccluded, the share that is needed.
fn useful(disoccluded: &[bool], needed: &[bool]) -> f64 {
    let both = disoccluded.iter().zip(needed).filter(|(disoccluded, needed)| **disoccluded && **needed).count();
    both as f64 / disoccluded.iter().filter(|flag| **flag).count().max(1) as f64
}
