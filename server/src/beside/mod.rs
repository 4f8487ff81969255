//! A view of the scene laid beside the same view of a copy on the GPU, where both were drawn: the twin of [`crate::account::compare`]
//! and of what is [superseded](Account::superseded).
//!
//! Compute passes judge every pixel by the rules of that file, settle what becomes of held samples, and write lists: the samples that
//! are to be sent, with what lies within two pixels of them, which tells where they end, and the addresses of held samples that are trimmed, replaced or
//! given up. Only these lists are read back, never a view. Where there is only a software GPU the processor's way is several times
//! faster, as both views are drawn or needed there.
//!
//! | on the processor | here |
//! |---|---|
//! | `f64` where centres of samples are projected | `f32`, by maps that are composed in `f64` |
//! | of several patches that hold a sample from this very camera at a pixel, the last counts | any of them |
//! | a sample that no record knows is not replaced by its centre | the same, and it counts as infinitely dense |

mod lists;
mod uniforms;

use std::collections::BTreeSet;

use camera::Pinhole;
use gpu::Gpu;
use protocol::{PatchId, Purpose};
use surface::{AddressPass, SurfaceError};
use wgpu::util::DeviceExt;

use crate::account::findings::Lacking;
use crate::account::samples::Address;
use crate::account::{Account, AccountRules};
use crate::discretize::Capture;
use crate::render::{RenderError, buffer_entry};
use lists::Lists;
use uniforms::{BesideUniform, rows};

/// What is asked of a view.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// What decides.
    pub rules: AccountRules,
    /// Patches that views of the same plan captured: they are not replaced.
    pub peers: &'a BTreeSet<PatchId>,
    /// Whether what covers falsely is looked for.
    pub trims: bool,
    /// Whether what finer samples have taken the place of is.
    pub supersedes: bool,
    /// Whether the viewer sees the view: what it shows counts as seen.
    pub is_seen: bool,
    /// A view that lacks no more pixels than this is sent nothing.
    pub least_px: f64,
}

/// What came of it.
#[derive(Debug)]
pub struct Found {
    /// The part of the view around what is to be sent; empty of all else.
    pub capture: Capture,
    /// Of that part.
    pub lacking: Lacking,
    /// Held samples that cover falsely; ascending.
    pub false_cover: Vec<Address>,
    /// Held samples whose place finer ones have taken; ascending.
    pub superseded: Vec<Address>,
    /// Pixels of the whole view that show anything.
    pub hits: usize,
}

/// A view of the scene on the GPU: ids, colour, rests and depth.
#[derive(Debug)]
pub struct KeptView {
    /// What captured it.
    pub camera: Pinhole,
    pub(crate) planes: [wgpu::TextureView; 4],
}

/// Steps of a comparison, in order; of each its module, its entry point, and whether it goes by slot instead of by pixel.
const STEPS: [(&str, &str, bool); 8] = [
    ("server/beside/judge.wgsl", "begin", false),
    ("server/beside/judge.wgsl", "sent", true),
    ("server/beside/judge.wgsl", "judge", false),
    ("server/beside/judge.wgsl", "settle", false),
    ("server/beside/judge.wgsl", "resolve", false),
    ("server/beside/judge.wgsl", "send", false),
    ("server/beside/judge.wgsl", "emit", false),
    ("server/beside/supersede.wgsl", "supersede", true),
];
const SENT: usize = 1;
const SUPERSEDE: usize = 7;
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
    steps: Vec<wgpu::ComputePipeline>,
    lists: Option<Lists>,
}

impl BesidePass {
    /// Storage buffers that a device must offer a stage.
    pub const STORAGE_BUFFERS: u32 = 9;

    /// Whether a device can.
    pub fn is_possible(gpu: &Gpu) -> bool {
        gpu.caps.compute && gpu.device.limits().max_storage_buffers_per_shader_stage >= BesidePass::STORAGE_BUFFERS
    }

    /// Compiles the steps.
    pub fn new(gpu: &Gpu) -> Result<BesidePass, RenderError> {
        let layout = layout(gpu);
        let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("beside"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let step = |&(path, entry_point, _): &(&str, &str, bool)| -> Result<_, RenderError> {
            let module = gpu.shader(path)?;
            Ok(gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry_point),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            }))
        };
        let steps = STEPS.iter().map(step).collect::<Result<Vec<_>, _>>()?;
        Ok(BesidePass { gpu: gpu.clone(), addresses: addresses(gpu)?, layout, steps, lists: None })
    }

    /// Another one that shares its pipelines.
    pub fn twin(&self) -> Result<BesidePass, RenderError> {
        let (gpu, layout, steps) = (self.gpu.clone(), self.layout.clone(), self.steps.clone());
        Ok(BesidePass { addresses: addresses(&gpu)?, gpu, layout, steps, lists: None })
    }

    /// Lays what the eye sees of the scene beside what an account that is up to date shows of it from the same view. `None` where it [keeps no
    /// facts](Account::know_on), or its surfaces are not on the GPU.
    pub fn compare(
        &mut self,
        account: &Account,
        view: &KeptView,
        asked: &Asked<'_>,
    ) -> Result<Option<Found>, RenderError> {
        let camera = view.camera;
        let (Some(facts), Some(surfaces)) = (account.facts(), account.surfaces(Purpose::Eye)) else { return Ok(None) };
        let (patches, movers) = rows(account, facts, &camera, asked.peers);
        let is_cut = patches.iter().any(uniforms::PatchRow::is_cut);
        let mut lists = Lists::taken(self.lists.take(), &self.gpu, (camera.width_px, camera.height_px), facts.slots());
        let uniform =
            BesideUniform::new(&camera, asked, account.looks() as u32, &lists.room, (patches.len(), facts.slots()));
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let Some(addresses) = self.addresses.draw(&mut encoder, surfaces, &camera) else { return Ok(None) };
        lists.clear(&mut encoder);
        let buffer = |label, contents: &[u8], usage| {
            self.gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage,
            })
        };
        let uniform = buffer("beside", bytemuck::bytes_of(&uniform), wgpu::BufferUsages::UNIFORM);
        let patches = buffer("patches", bytemuck::cast_slice(&patches), wgpu::BufferUsages::STORAGE);
        let movers = buffer("movers", bytemuck::cast_slice(&movers), wgpu::BufferUsages::STORAGE);
        let [words, samples, seen] = facts.buffers();
        let storage =
            [&patches, &movers, words, samples, seen, &lists.marks, &lists.pixels, &lists.samples, &lists.told];
        let group = self.group(&uniform, &view.planes, &addresses, storage);
        let is_left_out = |step: usize| step == SENT && !is_cut || step == SUPERSEDE && !asked.supersedes;
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_bind_group(0, &group, &[]);
        for (step, (pipeline, (_, _, by_slot))) in self.steps.iter().zip(STEPS).enumerate() {
            if is_left_out(step) || by_slot && facts.slots() == 0 {
                continue;
            }
            pass.set_pipeline(pipeline);
            if by_slot {
                let groups = facts.slots().div_ceil(GROUP_SLOTS);
                pass.dispatch_workgroups(groups.min(GROUPS_ACROSS), groups.div_ceil(GROUPS_ACROSS), 1);
            } else {
                pass.dispatch_workgroups(camera.width_px.div_ceil(GROUP_PX), camera.height_px.div_ceil(GROUP_PX), 1);
            }
        }
        drop(pass);
        let read = lists.read(&self.gpu, encoder)?;
        self.lists = Some(lists);
        Ok(Some(read.found(&camera, asked.least_px)))
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
