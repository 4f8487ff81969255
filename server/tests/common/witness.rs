//! Sees the scene, and what a client's copy shows of it, from anywhere: by a rule of its own, not by the server's.

use std::sync::Arc;

use camera::{Pinhole, Rigid};
use gpu::Gpu;
use protocol::Held;
use scene::Scene;
use surface::{AddressPass, AddressView};
use vantage_server::Config;
use vantage_server::discretize::{Capture, Discretization};
use vantage_server::imager::{GpuImager, Imager};

use super::session::VIEW;

/// Inverse depths that differ by more than this share are of two surfaces: at 4 m, 12 cm.
const SAME_DEPTH: f32 = 0.03;

/// See the module.
pub struct Witness {
    scene: Arc<Scene>,
    gpu: Gpu,
    imager: GpuImager,
    addresses: AddressPass,
    near_m: f64,
}

impl Witness {
    pub fn new(gpu: &Gpu, scene: &Arc<Scene>, near_m: f64) -> Witness {
        Witness {
            scene: scene.clone(),
            gpu: gpu.clone(),
            imager: GpuImager::new(gpu, scene, &Config::default()).expect("the scene uploads"),
            addresses: AddressPass::new(gpu).expect("pipelines"),
            near_m,
        }
    }

    /// What a camera sees of the scene.
    pub fn truth(&mut self, camera: &Pinhole, time_s: f64) -> Capture {
        let snapshot = self.scene.at(time_s);
        let captures = self.imager.captures(&snapshot, &[*camera], Discretization::Conventional);
        captures.expect("a picture").remove(0)
    }

    /// The share of a viewer's pixels that a copy shows wrongly: neither there nor one pixel beside is the scene's object
    /// at its depth, or the scene's nothing.
    pub fn wrong_share(&mut self, held: &Held, world_from_eye: Rigid) -> f64 {
        let size_px = (VIEW.width_px, VIEW.height_px);
        let camera = Pinhole::symmetric(world_from_eye, size_px, VIEW.fov_y_rad, self.near_m);
        let truth = self.truth(&camera, held.scene_time_s);
        let mut surfaces = self.addresses.new_surfaces();
        surfaces.rebuild(held);
        let copy = self.addresses.view(&surfaces, &camera).expect("a view");
        let wrong = (0..truth.ids.len()).filter(|&index| !is_shown(&truth, &copy, index)).count();
        wrong as f64 / truth.ids.len() as f64
    }

    /// The share of the pixels that show a surface in truth for which a copy holds nothing at all.
    pub fn holes_share(&mut self, held: &Held, world_from_eye: Rigid) -> f64 {
        let size_px = (VIEW.width_px, VIEW.height_px);
        let camera = Pinhole::symmetric(world_from_eye, size_px, VIEW.fov_y_rad, self.near_m);
        let truth = self.truth(&camera, held.scene_time_s);
        let mut surfaces = self.addresses.new_surfaces();
        surfaces.rebuild(held);
        let copy = self.addresses.view(&surfaces, &camera).expect("a view");
        let covered = (0..truth.ids.len()).filter(|&index| truth.ids[index][0] != 0);
        let (count, holes) = covered.fold((0, 0), |(count, holes), index| {
            (count + 1, holes + usize::from(copy.texels[index].address().is_none()))
        });
        f64::from(holes as u32) / f64::from(count.max(1))
    }
}

fn is_shown(truth: &Capture, copy: &AddressView, index: usize) -> bool {
    let (width, height) = (copy.size_px.0 as i32, copy.size_px.1 as i32);
    let (x, y) = (index as i32 % width, index as i32 / width);
    let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
    around.filter(|&(x, y)| x >= 0 && y >= 0 && x < width && y < height).any(|(x, y)| {
        let texel = copy.texels[(y * width + x) as usize];
        let is_nothing = truth.ids[index][0] == 0;
        match texel.address() {
            None => is_nothing,
            Some(_) => {
                let (shown, wanted) = (texel.w(), truth.w(index));
                !is_nothing && texel.object() == truth.object(index) && (shown - wanted).abs() <= SAME_DEPTH * wanted
            }
        }
    })
}
