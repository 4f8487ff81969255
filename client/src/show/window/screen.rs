//! The window's GPU side: device, surface, picture.

use std::sync::Arc;

use camera::{Pinhole, Rigid};
use gpu::{Gpu, GpuError};
use wgpu::{CurrentSurfaceTexture, PresentMode, TextureFormat};
use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

use super::options::{Options, Renderer, WindowError};
use super::overlay::Overlay;
use crate::draw::picture::Picture;
use crate::receive::viewer::Viewer;

/// Pictures are sRGB bytes already, so the surface must not encode again. Whichever the system has.
const FORMATS: [TextureFormat; 2] = [TextureFormat::Bgra8Unorm, TextureFormat::Rgba8Unorm];

/// Window, device and picture.
pub(super) struct Screen {
    pub window: Arc<Window>,
    pub gpu: Gpu,
    pub picture: Picture,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
}

impl Screen {
    pub fn open(event_loop: &ActiveEventLoop, options: &Options) -> Result<Screen, WindowError> {
        let attributes = Window::default_attributes()
            .with_title("Vantage")
            .with_inner_size(PhysicalSize::new(options.size_px.0, options.size_px.1));
        let window = event_loop.create_window(attributes).map_err(|error| WindowError::Window(error.to_string()))?;
        let window = Arc::new(window);
        let mut descriptor =
            wgpu::InstanceDescriptor::new_with_display_handle(Box::new(event_loop.owned_display_handle()));
        descriptor.backends = backends(options.renderer);
        let instance = wgpu::Instance::new(descriptor);
        let surface =
            instance.create_surface(Arc::clone(&window)).map_err(|error| WindowError::Surface(error.to_string()))?;
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            compatible_surface: Some(&surface),
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        }))
        .map_err(|error| {
            tracing::debug!("no adapter: {error}");
            GpuError::NoAdapter
        })?;
        let capabilities = surface.get_capabilities(&adapter);
        let format = FORMATS
            .into_iter()
            .find(|format| capabilities.formats.contains(format))
            .ok_or_else(|| WindowError::Surface("it has no format of plain 8-bit colours".to_owned()))?;
        let gpu = pollster::block_on(Gpu::from_adapter(instance, adapter))?;
        let picture = Picture::new(&gpu, format, options.picture)?;
        let size = window.inner_size();
        let config = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: wgpu::SurfaceColorSpace::default(),
            width: size.width.max(1),
            height: size.height.max(1),
            present_mode: PresentMode::AutoVsync,
            desired_maximum_frame_latency: 1,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
        };
        surface.configure(&gpu.device, &config);
        Ok(Screen { window, gpu, picture, surface, config })
    }

    pub fn format(&self) -> TextureFormat {
        self.config.format
    }

    pub fn size_px(&self) -> (u32, u32) {
        (self.config.width, self.config.height)
    }

    pub fn resize(&mut self, (width, height): (u32, u32)) {
        let largest = self.gpu.device.limits().max_texture_dimension_2d;
        self.config.width = width.clamp(1, largest);
        self.config.height = height.clamp(1, largest);
        self.surface.configure(&self.gpu.device, &self.config);
        self.window.request_redraw();
    }

    /// Draws a frame; returns whether the window took it.
    pub fn show(
        &mut self,
        viewer: &Viewer,
        pose: Option<Rigid>,
        fov_y_rad: f64,
        overlay: &mut Overlay,
    ) -> Result<bool, WindowError> {
        self.gpu.poll();
        let frame = match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(frame) | CurrentSurfaceTexture::Suboptimal(frame) => frame,
            CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => {
                overlay.skip(&self.gpu);
                return Ok(false);
            }
            CurrentSurfaceTexture::Outdated | CurrentSurfaceTexture::Lost => {
                overlay.skip(&self.gpu);
                self.resize(self.window.inner_size().into());
                return Ok(false);
            }
            CurrentSurfaceTexture::Validation => {
                return Err(WindowError::Surface("its next picture was refused".to_owned()));
            }
        };
        let view = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let near_m = viewer.welcome().map_or(0.1, |welcome| welcome.near_m);
        let pose = pose.unwrap_or(Rigid::IDENTITY);
        let camera = Pinhole::symmetric(pose, self.size_px(), fov_y_rad, near_m);
        self.picture.draw(viewer.held(), &camera, &view);
        overlay.draw(&self.gpu, self.size_px(), &view);
        self.window.pre_present_notify();
        self.gpu.queue.present(frame);
        Ok(true)
    }
}

fn backends(renderer: Renderer) -> wgpu::Backends {
    match renderer {
        Renderer::Auto => wgpu::Backends::PRIMARY | wgpu::Backends::GL,
        Renderer::Vulkan => wgpu::Backends::VULKAN,
        Renderer::Metal => wgpu::Backends::METAL,
        Renderer::Dx12 => wgpu::Backends::DX12,
        Renderer::Gl => wgpu::Backends::GL,
    }
}
