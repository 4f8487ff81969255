//! The four metrics of Xie, Wang, Popescu 2016, §6.1.2. A sample is *held* by images when it is redundant with one of them.

use camera::Pinhole;
use gpu::Gpu;
use server::discretize::{Capture, Discretization, Discretizer, Meter, Redundancy, RedundancyTest};

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
    /// Of each image, sample by sample: what it is worth.
    pub of_samples: Vec<Vec<SampleWorth>>,
}

/// What one sample is worth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SampleWorth {
    /// Conventional images do not hold it.
    pub disoccluded: bool,
    /// It is disoccluded, and some output frame holds it.
    pub needed: bool,
}

/// Which samples of each of some images others hold, sample by sample.
pub type Holds<'a> = Box<dyn Fn(&[&Capture], &[Capture]) -> anyhow::Result<Vec<Vec<bool>>> + 'a>;

/// By a test, on the GPU.
pub fn on_gpu<'a>(gpu: &Gpu, stage: &'a Stage, test: RedundancyTest) -> anyhow::Result<Holds<'a>> {
    let meter = Meter::new(gpu, Redundancy::by(test))?;
    let of_samples = |capture: &Capture, pixels: Vec<bool>| {
        pixels.into_iter().zip(&capture.ids).filter(|(_, ids)| ids[0] != 0).map(|(held, _)| held).collect()
    };
    Ok(Box::new(move |captures, images| {
        let images = meter.images(images);
        let held = |capture: &&Capture| Ok(of_samples(capture, meter.redundant(&stage.renderer, capture, &images)?));
        captures.iter().map(held).collect()
    }))
}

/// A scene, and what measures it.
pub struct Bench<'a> {
    /// The scene.
    pub stage: &'a Stage,
    /// Makes images.
    pub discretizer: Discretizer,
    /// The test that the metrics are taken by.
    pub holds: Holds<'a>,
    /// By surface.
    pub holds_surface: Holds<'a>,
}

/// A set, and for each of its images the conventional images that its disoccluded samples are not held by.
pub type Judged<'s> = (&'s [Capture], Vec<Vec<Capture>>);

/// Frames in one batch: a set's images at most.
const BATCH: usize = 15;

impl Bench<'_> {
    /// Images of `cameras` by a method.
    pub fn captures(&mut self, cameras: &[Pinhole], method: Discretization) -> anyhow::Result<Vec<Capture>> {
        Ok(self.discretizer.run(&self.stage.renderer, cameras, method)?.wait()?)
    }

    /// Metric 1, image by image.
    pub fn redundant(&self, set: &[Capture]) -> anyhow::Result<Vec<f64>> {
        let share = |index: usize| Ok(share(&held(&self.holds, &set[index], &set[..index])?));
        (0..set.len()).map(share).collect()
    }

    /// All metrics of sets, against the same frames. `say` is told of every batch of frames.
    pub fn worth(
        &mut self,
        sets: &[Judged<'_>],
        frames: &[Pinhole],
        mut say: impl FnMut(usize),
    ) -> anyhow::Result<Vec<Worth>> {
        let mut worths = sets.iter().map(|set| self.worth_by_itself(set)).collect::<anyhow::Result<Vec<_>>>()?;
        let waiting = |(worth, (set, _)): (&Worth, &Judged<'_>)| {
            set.iter().zip(&worth.of_samples).map(|(image, samples)| Waiting::new(image, samples)).collect()
        };
        let mut waiting: Vec<Vec<Waiting>> = worths.iter().zip(sets).map(waiting).collect();
        for cameras in frames.chunks(BATCH) {
            let shown = self.captures(cameras, Discretization::Conventional)?;
            for ((worth, (set, _)), waiting) in worths.iter_mut().zip(sets).zip(&mut waiting) {
                for (waiting, samples) in waiting.iter_mut().zip(&mut worth.of_samples) {
                    waiting.ask(&self.holds, &shown, samples)?;
                }
                let shown: Vec<&Capture> = shown.iter().collect();
                let missing = |held: Vec<bool>| 1.0 - share(&held);
                worth.missing.extend((self.holds)(&shown, set)?.into_iter().map(missing));
                worth.missing_by_surface.extend((self.holds_surface)(&shown, set)?.into_iter().map(missing));
            }
            say(cameras.len());
        }
        for worth in &mut worths {
            worth.useful = worth.of_samples.iter().map(|samples| useful(samples)).collect();
        }
        Ok(worths)
    }

    /// What needs no frames.
    fn worth_by_itself(&self, (set, conventional): &Judged<'_>) -> anyhow::Result<Worth> {
        let of_image = |(image, others): (&Capture, &Vec<Capture>)| {
            let held = held(&self.holds, image, others)?.into_iter();
            Ok(held.map(|held| SampleWorth { disoccluded: !held, needed: false }).collect())
        };
        let of_samples =
            set.iter().zip(conventional).map(of_image).collect::<anyhow::Result<Vec<Vec<SampleWorth>>>>()?;
        let disoccluded = |samples: &Vec<SampleWorth>| {
            samples.iter().filter(|sample| sample.disoccluded).count() as f64 / samples.len().max(1) as f64
        };
        Ok(Worth {
            samples: set.iter().map(samples).collect(),
            redundant: self.redundant(set)?,
            disoccluded: of_samples.iter().map(disoccluded).collect(),
            of_samples,
            ..Worth::default()
        })
    }
}

/// The disoccluded samples of an image that no frame was found to need yet.
struct Waiting {
    /// The image without the others.
    capture: Capture,
    /// Pixel and number of each.
    samples: Vec<(usize, usize)>,
}

impl Waiting {
    fn new(image: &Capture, worth: &[SampleWorth]) -> Waiting {
        let occupied = (0..image.ids.len()).filter(|&pixel| image.ids[pixel][0] != 0).zip(0..);
        let samples: Vec<_> = occupied.filter(|&(_, sample)| worth[sample].disoccluded).collect();
        let mut capture = Capture { ids: vec![[0; 2]; image.ids.len()], ..image.clone() };
        samples.iter().for_each(|&(pixel, _)| capture.ids[pixel] = image.ids[pixel]);
        Waiting { capture, samples }
    }

    /// Marks those that one of `frames` holds, and waits for them no more.
    fn ask(&mut self, holds: &Holds<'_>, frames: &[Capture], worth: &mut [SampleWorth]) -> anyhow::Result<()> {
        if self.samples.is_empty() {
            return Ok(());
        }
        let mut held = held(holds, &self.capture, frames)?.into_iter();
        self.samples.retain(|&(pixel, sample)| {
            let held = held.next().unwrap_or(false);
            if held {
                worth[sample].needed = true;
                self.capture.ids[pixel] = [0; 2];
            }
            !held
        });
        Ok(())
    }
}

fn held(holds: &Holds<'_>, capture: &Capture, images: &[Capture]) -> anyhow::Result<Vec<bool>> {
    if images.is_empty() { Ok(vec![false; samples(capture)]) } else { Ok(holds(&[capture], images)?.remove(0)) }
}

/// Samples of an image.
pub fn samples(capture: &Capture) -> usize {
    capture.ids.iter().filter(|ids| ids[0] != 0).count()
}

fn share(flags: &[bool]) -> f64 {
    flags.iter().filter(|flag| **flag).count() as f64 / flags.len().max(1) as f64
}

/// Of what is disoccluded, the share that is needed.
fn useful(samples: &[SampleWorth]) -> f64 {
    let disoccluded = samples.iter().filter(|sample| sample.disoccluded);
    let needed = disoccluded.clone().filter(|sample| sample.needed).count();
    needed as f64 / disoccluded.count().max(1) as f64
}

#[cfg(test)]
mod tests {
    use protocol::Look;
    use server::discretize::redundancy::redundant_samples;

    use super::super::triangle::ViewTriangle;
    use super::*;

    /// The metrics by the twin on the CPU.
    fn on_cpu(stage: &Stage, test: RedundancyTest) -> Holds<'_> {
        Box::new(move |captures, images| {
            let anchor_world = stage.renderer.anchor_world();
            let held =
                |capture: &&Capture| redundant_samples(capture, images, Redundancy::by(test), anchor_world, None);
            Ok(captures.iter().map(held).collect())
        })
    }

    #[test]
    fn the_twin_finds_the_same_figures() {
        const SIZE_PX: (u32, u32) = (96, 96);
        let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
        let scene = scene::builtin::load("pillars").expect("built in");
        let triangle = ViewTriangle::of(&scene, None, None);
        let near_m = server::start::near_m(&scene);
        let mut stage = Stage::new(&gpu, scene, Look::Plain).expect("a scene");
        stage.show(0.0, triangle.middle(SIZE_PX, near_m).world_from_eye.translation).expect("shown");
        let by_gpu = |test| on_gpu(&gpu, &stage, test).expect("a meter");
        let mut bench = Bench {
            stage: &stage,
            discretizer: Discretizer::new(&stage.renderer).expect("shaders"),
            holds: by_gpu(RedundancyTest::Pixel),
            holds_surface: by_gpu(RedundancyTest::Surface),
        };
        let corners = triangle.corners(SIZE_PX, near_m);
        let conventional = bench.captures(&corners, Discretization::Conventional).expect("images");
        let set = bench.captures(&corners, Discretization::PIXEL).expect("images");
        let references = || (0..3).map(|index| vec![conventional[index].clone()]).collect();
        let sets: [Judged<'_>; 2] = [(&conventional, references()), (&set, references())];
        let frames = triangle.between(5, 1, SIZE_PX, near_m);
        let by_gpu = bench.worth(&sets, &frames, |_| ()).expect("metrics");
        bench.holds = on_cpu(&stage, RedundancyTest::Pixel);
        bench.holds_surface = on_cpu(&stage, RedundancyTest::Surface);
        let by_cpu = bench.worth(&sets, &frames, |_| ()).expect("metrics");
        // One sample in a thousand may lie on the border between two pixels.
        let agree = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-3);
        for (gpu, cpu) in by_gpu.iter().zip(&by_cpu) {
            assert_eq!(gpu.samples, cpu.samples);
            assert!(agree(&gpu.redundant, &cpu.redundant), "{:?} {:?}", gpu.redundant, cpu.redundant);
            assert!(agree(&gpu.disoccluded, &cpu.disoccluded), "{:?} {:?}", gpu.disoccluded, cpu.disoccluded);
            assert!(agree(&gpu.missing, &cpu.missing), "{:?} {:?}", gpu.missing, cpu.missing);
            assert!(agree(&gpu.missing_by_surface, &cpu.missing_by_surface));
            let pairs = gpu.of_samples.iter().flatten().zip(cpu.of_samples.iter().flatten());
            let differ = pairs.clone().filter(|(gpu, cpu)| gpu != cpu).count();
            assert!(differ * 1000 <= pairs.count(), "{differ} samples differ");
        }
        assert!(by_gpu[1].redundant.iter().all(|&share| share == 0.0), "{:?}", by_gpu[1].redundant);
        assert!(by_gpu[1].disoccluded[2] > 0.02 && by_gpu[1].useful[2] > 0.1, "the third image sees behind pillars");
    }
}
