//! A view of the scene laid beside the same view of a copy on the GPU, where both were drawn: the twin of [`crate::account::compare`]
//! and of what is [superseded](Account::superseded).
//!
//! Compute passes judge every pixel by the rules of that file, settle what becomes of held samples, tell from a finer image where what is
//! sent ends, and write lists: the samples that are to be sent, and the addresses of held samples that are trimmed, replaced or given up. Only these lists
//! are read back, never a view; all of it is one submission and one wait. Where there is only a software GPU the processor's way is several times
//! faster, as both views are drawn or needed there.
//!
//! | on the processor | here |
//! |---|---|
//! | `f64` where centres of samples are projected | `f32`, by maps that are composed in `f64` |
//! | of several patches that hold a sample from this very camera at a pixel, the last counts | any of them |
//! | a sample that no record knows is not replaced by its centre | the same, and it counts as infinitely dense |

mod asked;
mod finer;
mod lists;
mod uniforms;

use camera::Pinhole;
use gpu::Gpu;
use protocol::Purpose;
use surface::{AddressPass, SurfaceError};
use wgpu::util::DeviceExt;

use crate::account::Account;
use crate::account::facts::Facts;
use crate::discretize::{self, EndsPass};
use crate::look_times::{Part, timed};
use crate::render::{RenderError, SceneRenderer, buffer_entry};
pub use asked::{Asked, Found, KeptView};
use finer::PartInputs;
use lists::Lists;
use uniforms::{BesideUniform, rows};

/// What a step goes by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum By {
    Pixel,
    Slot,
    /// Pixels of a part that is drawn finely: before that, and after.
    PartBefore,
    PartAfter,
}

/// A step of a comparison: an entry point of a module of `server/beside`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Begin,
    Sent,
    Judge,
    Settle,
    Resolve,
    Send,
    Nearest,
    Ends,
    Emit,
    Supersede,
}

impl Step {
    /// In order; parts are drawn between [`Step::Nearest`] and [`Step::Ends`].
    const ALL: [(Step, &str, &str, By); 10] = [
        (Step::Begin, "judge", "begin", By::Pixel),
        (Step::Sent, "judge", "sent", By::Slot),
        (Step::Judge, "judge", "judge", By::Pixel),
        (Step::Settle, "judge", "settle", By::Pixel),
        (Step::Resolve, "judge", "resolve", By::Pixel),
        (Step::Send, "judge", "send", By::Pixel),
        (Step::Nearest, "ends", "nearest", By::PartBefore),
        (Step::Ends, "ends", "ends", By::PartAfter),
        (Step::Emit, "judge", "emit", By::Pixel),
        (Step::Supersede, "supersede", "supersede", By::Slot),
    ];
}

/// Pixels of a workgroup along each side, and slots of one.
const GROUP_PX: u32 = 8;
const GROUP_SLOTS: u32 = 64;
/// Groups along x where there are more than fit into one dimension.
const GROUPS_ACROSS: u32 = 1024;

/// See the module.
pub struct BesidePass {
    gpu: Gpu,
    addresses: AddressPass,
    layout: wgpu::BindGroupLayout,
    part_layouts: [wgpu::BindGroupLayout; 2],
    /// In the order of [`Step::ALL`].
    steps: Vec<wgpu::ComputePipeline>,
    lists: Option<Lists>,
}

/// What one comparison goes by.
struct Comparing<'a> {
    encoder: &'a mut wgpu::CommandEncoder,
    group: &'a wgpu::BindGroup,
    size_px: (u32, u32),
    slots: u32,
}

impl BesidePass {
    /// Storage buffers that a device must offer a stage.
    pub const STORAGE_BUFFERS: u32 = 9;

    /// Whether a device can.
    pub fn is_possible(gpu: &Gpu) -> bool {
        gpu.caps.compute && gpu.device.limits().max_storage_buffers_per_shader_stage >= BesidePass::STORAGE_BUFFERS
    }

    /// Whether views can be compared with a copy here: whether what is known of it, and what is written of each view, fits into what the device binds.
    pub fn takes(&self, account: &Account, views: &[Pinhole]) -> bool {
        let fits = |view: &Pinhole| Lists::fit(&self.gpu, (view.width_px, view.height_px));
        account.facts().is_some_and(Facts::is_whole) && views.iter().all(fits)
    }

    /// Compiles the steps.
    pub fn new(gpu: &Gpu) -> Result<BesidePass, RenderError> {
        let (layout, part_layouts) = (layout(gpu), finer::layouts(gpu));
        let step = |&(_, module, entry_point, by): &(Step, &str, &str, By)| -> Result<_, RenderError> {
            let of_part = match by {
                By::PartBefore => Some(&part_layouts[0]),
                By::PartAfter => Some(&part_layouts[1]),
                By::Pixel | By::Slot => None,
            };
            let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("beside"),
                bind_group_layouts: &[Some(&layout), of_part][..1 + usize::from(of_part.is_some())],
                immediate_size: 0,
            });
            let module = gpu.shader(&format!("server/beside/{module}.wgsl"))?;
            Ok(gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry_point),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            }))
        };
        let steps = Step::ALL.iter().map(step).collect::<Result<Vec<_>, _>>()?;
        Ok(BesidePass { gpu: gpu.clone(), addresses: addresses(gpu)?, layout, part_layouts, steps, lists: None })
    }

    /// Another one that shares its pipelines.
    pub fn twin(&self) -> Result<BesidePass, RenderError> {
        let (gpu, layout, steps) = (self.gpu.clone(), self.layout.clone(), self.steps.clone());
        let (addresses, part_layouts) = (addresses(&gpu)?, self.part_layouts.clone());
        Ok(BesidePass { addresses, gpu, layout, part_layouts, steps, lists: None })
    }

    /// Lays what the eye sees of the scene, which is as it was when the view was kept, beside what an account shows of it from the same view.
    /// The account is up to date and its views [can be taken](BesidePass::takes); `None` of one that draws nothing on the GPU.
    pub fn compare(
        &mut self,
        (scene, ends): (&SceneRenderer, &mut EndsPass),
        account: &Account,
        view: &KeptView,
        asked: &Asked<'_>,
    ) -> Result<Option<Found>, RenderError> {
        let encoded = timed(Part::Compare, || self.encode((scene, ends), account, view, asked))?;
        let Some((encoder, mut lists)) = encoded else { return Ok(None) };
        let read = timed(Part::Gpu, || lists.read(&self.gpu, encoder))?;
        self.lists = Some(lists);
        Ok(Some(timed(Part::Compare, || read.found(&view.camera, asked.least_px))))
    }

    /// The commands of a comparison, and where what it finds will be.
    fn encode(
        &mut self,
        (scene, ends): (&SceneRenderer, &mut EndsPass),
        account: &Account,
        view: &KeptView,
        asked: &Asked<'_>,
    ) -> Result<Option<(wgpu::CommandEncoder, Lists)>, RenderError> {
        let camera = view.camera;
        let (Some(facts), Some(surfaces)) = (account.facts(), account.surfaces(Purpose::Eye)) else { return Ok(None) };
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let Some(addresses) = self.addresses.draw(&mut encoder, surfaces, &camera) else { return Ok(None) };
        let (patches, movers) = rows(account, facts, &camera, asked.peers);
        let is_cut = patches.iter().any(uniforms::PatchRow::is_cut);
        let size_px = (camera.width_px, camera.height_px);
        let lists = Lists::taken(self.lists.take(), &self.gpu, size_px, facts.slots());
        lists.clear(&mut encoder);
        let uniform =
            BesideUniform::new(&camera, asked, account.looks() as u32, &lists.room, (patches.len(), facts.slots()));
        let uniform = self.buffer("beside", bytemuck::bytes_of(&uniform), wgpu::BufferUsages::UNIFORM);
        let patches = self.buffer("patches", bytemuck::cast_slice(&patches), wgpu::BufferUsages::STORAGE);
        let movers = self.buffer("movers", bytemuck::cast_slice(&movers), wgpu::BufferUsages::STORAGE);
        let [words, samples, seen] = facts.buffers();
        let storage =
            [&patches, &movers, words, samples, seen, &lists.marks, &lists.pixels, &lists.samples, &lists.told];
        let group = self.group(&uniform, &view.planes, &addresses, storage);
        let is_left_out = |step: Step| {
            step == Step::Sent && !is_cut
                || step == Step::Supersede && !asked.supersedes
                || matches!(step, Step::Sent | Step::Supersede) && facts.slots() == 0
        };
        let mut comparing = Comparing { encoder: &mut encoder, group: &group, size_px, slots: facts.slots() };
        for (pipeline, (step, _, _, by)) in self.steps.iter().zip(Step::ALL) {
            match by {
                _ if is_left_out(step) => {}
                By::Pixel => comparing.by_pixel(pipeline, size_px, None),
                By::Slot => comparing.by_slot(pipeline),
                By::PartBefore => self.tell_ends(&mut comparing, (scene, &mut *ends), &camera)?,
                // Each part is read as soon as it is drawn.
                By::PartAfter => {}
            }
        }
        Ok(Some((encoder, lists)))
    }

    fn buffer(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
    }

    /// Draws a view finely, part by part, and tells where what is sent ends.
    fn tell_ends(
        &self,
        comparing: &mut Comparing<'_>,
        (scene, ends): (&SceneRenderer, &mut EndsPass),
        camera: &Pinhole,
    ) -> Result<(), RenderError> {
        let [nearest_layout, ends_layout] = &self.part_layouts;
        for part in discretize::Part::all(comparing.size_px) {
            let inputs = PartInputs::new(&self.gpu, part);
            let group = inputs.nearest_group(&self.gpu, nearest_layout);
            comparing.by_pixel(&self.steps[Step::Nearest as usize], part.size_with_margin(), Some(&group));
            let finer = ends.encode(comparing.encoder, scene, camera, (part, &inputs.nearest))?;
            let group = inputs.ends_group(&self.gpu, ends_layout, &finer);
            comparing.by_pixel(&self.steps[Step::Ends as usize], part.size_px, Some(&group));
        }
        Ok(())
    }

    fn group(
        &self,
        uniform: &wgpu::Buffer,
        planes: &[wgpu::TextureView; 4],
        addresses: &wgpu::TextureView,
        storage: [&wgpu::Buffer; 9],
    ) -> wgpu::BindGroup {
        let textures = planes.iter().chain([addresses]).map(wgpu::BindingResource::TextureView);
        let buffers = storage.iter().map(|buffer| buffer.as_entire_binding());
        let resources = std::iter::once(uniform.as_entire_binding()).chain(textures).chain(buffers);
        let entries: Vec<_> =
            resources.zip(0..).map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource }).collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("beside"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

impl Comparing<'_> {
    fn by_pixel(&mut self, step: &wgpu::ComputePipeline, (width, height): (u32, u32), part: Option<&wgpu::BindGroup>) {
        self.dispatch(step, (width.div_ceil(GROUP_PX), height.div_ceil(GROUP_PX)), part);
    }

    fn by_slot(&mut self, step: &wgpu::ComputePipeline) {
        let groups = self.slots.div_ceil(GROUP_SLOTS);
        self.dispatch(step, (groups.min(GROUPS_ACROSS), groups.div_ceil(GROUPS_ACROSS)), None);
    }

    fn dispatch(&mut self, step: &wgpu::ComputePipeline, groups: (u32, u32), part: Option<&wgpu::BindGroup>) {
        let mut pass = self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(step);
        pass.set_bind_group(0, self.group, &[]);
        if part.is_some() {
            pass.set_bind_group(1, part, &[]);
        }
        pass.dispatch_workgroups(groups.0, groups.1, 1);
    }
}

fn addresses(gpu: &Gpu) -> Result<AddressPass, RenderError> {
    AddressPass::on_gpu(gpu).map_err(|error| match error {
        SurfaceError::Gpu(error) => error.into(),
        SurfaceError::Shader(error) => error.into(),
    })
}

fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let visibility = wgpu::ShaderStages::COMPUTE;
    let (uint, depth) = (wgpu::TextureSampleType::Uint, wgpu::TextureSampleType::Depth);
    let float = wgpu::TextureSampleType::Float { filterable: false };
    let texture = |(sample_type, binding)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    };
    // Patches, movers, words and samples are only read.
    let storage =
        |binding| buffer_entry(binding, visibility, wgpu::BufferBindingType::Storage { read_only: binding < 10 });
    let mut entries = vec![buffer_entry(0, visibility, wgpu::BufferBindingType::Uniform)];
    entries.extend([uint, float, uint, depth, uint].into_iter().zip(1..).map(texture));
    entries.extend((6..15).map(storage));
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("beside"), entries: &entries })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_found_by_their_numbers() {
        assert!(Step::ALL.iter().enumerate().all(|(number, (step, ..))| *step as usize == number));
    }
}
