//! What is held, drawn into a G-buffer that is read back.

use camera::Pinhole;
use gpu::{Gpu, Readback};
use protocol::Held;
use surface::HeldSurfaces;
use vantage_client::draw::frame::{FrameRenderer, Options};
use vantage_client::draw::impostors::Impostors;
use vantage_client::draw::shown::Shown;

/// One that offers no more than WebGL2.
fn least_gpu() -> Gpu {
    let Gpu { instance, adapter, .. } = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    Gpu::block_on(Gpu::from_adapter(instance, adapter)).expect("a device")
}

/// The G-buffer of a picture, pixel by pixel.
#[derive(Debug, PartialEq)]
pub struct Drawn {
    pub colour: Vec<[u8; 4]>,
    pub normal_ids: Vec<[u32; 2]>,
    pub w: Vec<f32>,
    pub depth: Vec<f32>,
    pub draws_reliefs: bool,
}

/// Draws what is held, by impostors of one's own.
pub struct Client {
    pub gpu: Gpu,
    pub impostors: Impostors,
    pub frame: FrameRenderer,
}

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

impl Client {
    pub fn new() -> Client {
        let gpu = least_gpu();
        let (impostors, frame) = (Impostors::new(&gpu), FrameRenderer::new(&gpu, FORMAT).expect("the shaders compile"));
        Client { gpu, impostors, frame }
    }

    pub fn of(held: &Held) -> Client {
        let mut client = Client::new();
        client.impostors.rebuild(held);
        client
    }

    pub fn encode(&mut self, surfaces: &HeldSurfaces, held: &Held, view: &Pinhole) -> wgpu::CommandEncoder {
        let output = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: view.width_px, height: view.height_px, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let shown = Shown {
            surfaces,
            held,
            impostors: Some(&self.impostors),
            bodies: None,
            lights: None,
            occluders: None,
            layers: None,
            rest: None,
        };
        self.frame.draw(&mut encoder, shown, view, &output.create_view(&Default::default()), Options::default());
        encoder
    }

    pub fn draw(&mut self, held: &Held, view: &Pinhole) -> Drawn {
        let mut surfaces = HeldSurfaces::new(&self.gpu);
        surfaces.rebuild(held);
        let mut encoder = self.encode(&surfaces, held, view);
        let gbuffer = self.frame.gbuffer().expect("a frame was drawn");
        let mut readback = Readback::default();
        let textures = [&gbuffer.colour, &gbuffer.normal_ids, &gbuffer.w, &gbuffer.depth];
        let slots = textures.map(|texture| readback.texture(texture, 0, (view.width_px, view.height_px)));
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        self.frame.submitted(true);
        let mapped = encoded.map().wait(&self.gpu).expect("a readback");
        Drawn {
            colour: mapped.values(slots[0]),
            normal_ids: mapped.values(slots[1]),
            w: mapped.values(slots[2]),
            depth: mapped.values(slots[3]),
            draws_reliefs: self.frame.draws_reliefs(),
        }
    }
}

impl Drawn {
    /// The object that a pixel shows.
    pub fn object(&self, pixel: usize) -> Option<u16> {
        (self.w[pixel] > 0.0).then_some(self.normal_ids[pixel][1] as u16)
    }
}
