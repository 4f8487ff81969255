//! A scene that rows are measured of, with what they share.

use std::rc::Rc;

use camera::Pinhole;
use client::draw::soft::Lamp;
use gpu::Gpu;
use protocol::Look;
use scene::Scene;
use server::discretize::{Capture, DepthPrecision, Discretization, Discretizer};

use super::cell::Cell;
use super::hidden::{Errors, Hidden};
use super::sets::{self, Casters, Client, Images};
use super::settings::Settings;
use super::truths::{self, Truths};
use super::{full, lamp};
use crate::report::Row;
use crate::sets::ImageSet;
use crate::spread::Spread;
use crate::stage::Stage;

/// See [`Made::tiny`].
const TINY_PX: u32 = 16;

/// See the module.
pub(super) struct Subject {
    stage: Stage,
    discretizer: Discretizer,
    client: Client,
    shown: Capture,
    view: Pinhole,
    settings: Settings,
    /// Of the lamp of this size, by maps of this size.
    truths: Option<((f64, u32), Truths)>,
    /// The last set, of which several methods may draw.
    made: Option<(Named, Rc<Made>)>,
}

/// Method, lamp and size of a set.
type Named = (Images, f64, u32);

struct Made {
    set: ImageSet,
    /// The same so small that drawing it warms up pipelines alone.
    tiny: ImageSet,
    images_ms: Spread,
    /// Of the set, on the wire.
    bytes: usize,
}

impl Subject {
    pub fn new(gpu: &Gpu, scene: Scene, settings: &Settings) -> anyhow::Result<Subject> {
        let mut stage = Stage::new(gpu, scene, Look::Plain)?;
        stage.show(0.0, stage.scene.bounds.centre())?;
        let view = lamp::output(&stage.scene, settings.size_px);
        let mut discretizer = Discretizer::new(&stage.renderer)?;
        let shown = discretizer.run(&stage.renderer, &[view], Discretization::Conventional)?.wait()?.remove(0);
        let client = Client::new(gpu, &stage, &shown.depth_image(DepthPrecision::Finest), &view)?;
        let settings = settings.clone();
        Ok(Subject { stage, discretizer, client, shown, view, settings, truths: None, made: None })
    }

    /// Triangles of the full geometry.
    pub fn triangle_count(&self) -> usize {
        self.stage.scene.triangle_count() as usize
    }

    /// Both truths of a cell, made where they are not yet.
    pub fn truths(&mut self, cell: &Cell) -> anyhow::Result<Truths> {
        let kept = self.truths.take();
        let (lamp, points) = (lamp::over(&self.stage.scene, cell.lamp), self.settings.points);
        let truths = match kept {
            Some((of, truths)) if of == (cell.lamp, cell.image_px) => truths,
            other => {
                let rays = other.filter(|((size, _), _)| *size == cell.lamp).map(|(_, truths)| truths.rays);
                let rays = rays.unwrap_or_else(|| Rc::new(truths::by_rays(&self.stage, (&lamp, points), &self.view)));
                let of = (&lamp, points, cell.image_px);
                let maps = truths::by_maps(&self.stage, &mut self.discretizer, of, &self.shown)?;
                Truths { maps: Rc::new(maps), rays }
            }
        };
        self.truths = Some(((cell.lamp, cell.image_px), truths.clone()));
        Ok(truths)
    }

    fn made(&mut self, lamp: &Lamp, named: Named) -> anyhow::Result<Rc<Made>> {
        if let Some((_, made)) = self.made.as_ref().filter(|(of, _)| *of == named) {
            return Ok(made.clone());
        }
        let (images, _, image_px) = named;
        let of = (lamp, image_px);
        let (set, images_ms) = sets::make(&self.stage, &mut self.discretizer, images, of, self.settings.runs)?;
        let (tiny, _) = sets::make(&self.stage, &mut self.discretizer, images, (lamp, TINY_PX), 1)?;
        let made = Rc::new(Made { bytes: sets::bytes(&set.images), set, tiny, images_ms });
        self.made = Some((named, made.clone()));
        Ok(made)
    }

    /// What a cell takes.
    pub fn timed(&mut self, cell: &Cell) -> anyhow::Result<Row> {
        let lamp = lamp::over(&self.stage.scene, cell.lamp);
        let made = self.made(&lamp, (cell.images, cell.lamp, cell.image_px))?;
        let drawing = (cell.way.settings)(self.settings.points, cell.image_px);
        let images = (&*made.set.images, &*made.tiny.images);
        let [surfaces_ms, shadows_ms] = self.client.cold(&lamp, images, drawing, self.settings.runs)?;
        let mut row = cell.row(&self.settings);
        let samples = made.set.images.iter().map(|image| image.sample_count()).sum::<usize>();
        row.counts.set("samples", samples as f64);
        row.counts.set("images", made.set.images.len() as f64);
        row.counts.set("bytes", made.bytes as f64);
        row.counts.set("triangles", self.triangle_count() as f64);
        let steps = [("images", made.images_ms), ("surfaces", surfaces_ms), ("shadows", shadows_ms)];
        for (name, ms) in steps {
            row.time_ms.set(name, ms);
        }
        row.time_ms.set("all", Spread::single(steps.iter().map(|(_, ms)| ms.median).sum()));
        Ok(row)
    }

    /// What a cell takes, how wrong it is, and what it draws.
    pub fn judged(&mut self, cell: &Cell) -> anyhow::Result<(Row, Hidden)> {
        let mut row = self.timed(cell)?;
        let lamp = lamp::over(&self.stage.scene, cell.lamp);
        let made = self.made(&lamp, (cell.images, cell.lamp, cell.image_px))?;
        let drawing = (cell.way.settings)(self.settings.points, cell.image_px);
        let casters = self.client.casters(&made.set.images)?;
        let hidden = self.client.hidden(&lamp, &casters, drawing)?;
        let truths = self.truths(cell)?;
        for (name, truth) in [("", &truths.maps), ("_rays", &truths.rays)] {
            let Some(errors) = hidden.errors(truth) else { continue };
            let Errors { visibility, too_dark, intensity, worst_intensity, pixels } = errors;
            row.error.set(format!("intensity{name}"), Spread { worst: worst_intensity, ..Spread::single(intensity) });
            row.error.set(format!("visibility{name}"), Spread::single(visibility));
            row.error.set(format!("too_dark{name}"), Spread::single(too_dark));
            row.counts.set(format!("pixels{name}"), pixels as f64);
        }
        Ok((row, hidden))
    }

    /// The full geometry as what casts.
    fn full(&self, lamp: &Lamp, image_px: u32) -> anyhow::Result<Casters> {
        let view = lamp::middle_view(lamp, &self.stage.scene, image_px)?;
        let mesh = full::mesh(&self.stage.scene, self.stage.snapshot(), &view);
        self.client.casters_with(&[full::image(view)], |_, _, _| mesh.clone())
    }

    /// What drawing the maps of all points straight from the full geometry takes, with their lookups.
    pub fn full_geometry(&mut self, cell: &Cell) -> anyhow::Result<Row> {
        let lamp = lamp::over(&self.stage.scene, cell.lamp);
        let casters = self.full(&lamp, cell.image_px)?;
        let made = self.made(&lamp, (cell.images, cell.lamp, TINY_PX))?;
        let tiny = self.client.casters(&made.tiny.images)?;
        let drawing = (cell.way.settings)(self.settings.points, cell.image_px);
        let shadows = || Ok([self.client.shadows(&lamp, (&casters, &tiny), drawing)?]);
        let [shadows_ms] = sets::repeated(self.settings.runs, shadows)?;
        let mut row = cell.row(&self.settings);
        row.counts.set("triangles", self.triangle_count() as f64);
        row.time_ms.set("shadows", shadows_ms);
        row.time_ms.set("all", shadows_ms);
        Ok(row)
    }

    /// How wrong the maps of the full geometry are, as a client draws them.
    #[cfg(test)]
    pub fn full_geometry_errors(&mut self, cell: &Cell) -> anyhow::Result<Option<Errors>> {
        let lamp = lamp::over(&self.stage.scene, cell.lamp);
        let casters = self.full(&lamp, cell.image_px)?;
        let hidden = self.client.hidden(&lamp, &casters, (cell.way.settings)(self.settings.points, cell.image_px))?;
        Ok(hidden.errors(&self.truths(cell)?.maps))
    }

    /// The views of the lamp's points as a truth draws maps of them, and as a client does from images.
    #[cfg(test)]
    pub fn point_views(&mut self, cell: &Cell) -> anyhow::Result<[Vec<Pinhole>; 2]> {
        let lamp = lamp::over(&self.stage.scene, cell.lamp);
        let made = self.made(&lamp, (cell.images, cell.lamp, cell.image_px))?;
        let casters = self.client.casters(&made.set.images)?;
        let points = self.settings.points;
        let drawn = lamp.views(casters.get().bounds_world, points, cell.image_px);
        Ok([lamp::point_views(&lamp, &self.stage.scene, points, cell.image_px)?, drawn.concat()])
    }
}
