//! The canvas and its GPU side.

use camera::{Pinhole, Rigid};
use client::draw::picture::{Picture, PictureOptions};
use glam::DVec2;
use gpu::Gpu;
use protocol::Held;
use web_sys::HtmlCanvasElement;
use wgpu::{Backends, CurrentSurfaceTexture, TextureFormat};

/// Pictures are sRGB bytes already, so the canvas must not encode again. Which of them is there depends on the browser.
const FORMATS: [TextureFormat; 2] = [TextureFormat::Bgra8Unorm, TextureFormat::Rgba8Unorm];
/// Pixels per CSS pixel at most: finer ones cost time that nobody sees.
const MAX_PIXEL_RATIO: f64 = 2.0;
/// Pixels of a picture at most; larger canvases are drawn coarser and scaled up.
const MAX_PIXELS: f64 = 2560.0 * 1600.0;

/// A graphics interface of browsers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Renderer {
    /// Preferred.
    WebGpu,
    /// Where there is no WebGPU.
    WebGl2,
}

impl Renderer {
    /// As in the address and in the panel.
    pub fn name(self) -> &'static str {
        match self {
            Renderer::WebGpu => "webgpu",
            Renderer::WebGl2 => "webgl2",
        }
    }
}

/// Whether WebGPU would draw without a GPU; `None` where there is no WebGPU.
pub async fn webgpu_is_software() -> Option<bool> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = Backends::BROWSER_WEBGPU;
    let adapter =
        wgpu::Instance::new(descriptor).request_adapter(&wgpu::RequestAdapterOptions::default()).await.ok()?;
    Some(adapter.get_info().device_type == wgpu::DeviceType::Cpu)
}

/// Canvas, device and picture.
pub struct Screen {
    pub renderer: Renderer,
    pub gpu: Gpu,
    pub picture: Picture,
    pub canvas: HtmlCanvasElement,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
}

impl Screen {
    /// Opens a canvas that no other graphics interface has used yet.
    pub async fn open(
        canvas: HtmlCanvasElement,
        renderer: Renderer,
        options: PictureOptions,
    ) -> Result<Screen, String> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = match renderer {
            Renderer::WebGpu => Backends::BROWSER_WEBGPU,
            Renderer::WebGl2 => Backends::GL,
        };
        let instance = wgpu::Instance::new(descriptor);
        let (width, height) = wanted_size_px(&canvas);
        canvas.set_width(width);
        canvas.set_height(height);
        let surface =
            instance.create_surface(wgpu::SurfaceTarget::Canvas(canvas.clone())).map_err(|error| error.to_string())?;
        let adapter = instance
            .request_adapter(&wgpu::RequestAdapterOptions {
                compatible_surface: Some(&surface),
                power_preference: wgpu::PowerPreference::HighPerformance,
                ..Default::default()
            })
            .await
            .map_err(|error| error.to_string())?;
        let formats = surface.get_capabilities(&adapter).formats;
        let format = FORMATS
            .into_iter()
            .find(|format| formats.contains(format))
            .ok_or_else(|| "the canvas has no format of plain 8-bit colours".to_owned())?;
        let gpu = Gpu::from_adapter(instance, adapter).await.map_err(|error| error.to_string())?;
        let picture = Picture::new(&gpu, format, options).map_err(|error| error.to_string())?;
        let config = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: wgpu::SurfaceColorSpace::default(),
            width,
            height,
            present_mode: wgpu::PresentMode::AutoVsync,
            desired_maximum_frame_latency: 1,
            alpha_mode: wgpu::CompositeAlphaMode::Opaque,
            view_formats: Vec::new(),
        };
        let mut screen = Screen { renderer, gpu, picture, canvas, surface, config };
        screen.config.alpha_mode = wgpu::CompositeAlphaMode::Auto;
        screen.configure(width, height);
        Ok(screen)
    }

    /// Follows the canvas's size on the page; returns whether it changed.
    pub fn fit(&mut self) -> bool {
        let (width, height) = wanted_size_px(&self.canvas);
        let changed = (width, height) != self.size_px();
        if changed {
            self.canvas.set_width(width);
            self.canvas.set_height(height);
            self.configure(width, height);
        }
        changed
    }

    fn configure(&mut self, width: u32, height: u32) {
        let largest = self.gpu.device.limits().max_texture_dimension_2d;
        self.config.width = width.min(largest);
        self.config.height = height.min(largest);
        self.surface.configure(&self.gpu.device, &self.config);
    }

    /// Of the picture.
    pub fn size_px(&self) -> (u32, u32) {
        (self.config.width, self.config.height)
    }

    /// Has the canvas as large as a camera's picture, whatever its size on the page.
    fn fit_to(&mut self, camera: &Pinhole) {
        let size_px = (camera.width_px, camera.height_px);
        if size_px != self.size_px() {
            self.canvas.set_width(size_px.0);
            self.canvas.set_height(size_px.1);
            self.configure(size_px.0, size_px.1);
        }
    }

    /// Draws anew as `options` say, on the same device.
    pub fn redraw(&mut self, held: &Held, options: PictureOptions) -> Result<(), String> {
        let picture = Picture::new(&self.gpu, self.config.format, options);
        self.picture = picture.map_err(|error| error.to_string())?;
        self.picture.rebuild(held);
        Ok(())
    }

    /// Draws a frame; `false` where the canvas takes none now.
    pub fn show(&mut self, held: &Held, pose: Rigid, fov_y_rad: f64, near_m: f64) -> Result<bool, String> {
        let camera = self.camera(pose, fov_y_rad, near_m);
        self.show_camera(held, &camera)
    }

    /// The same by any camera, to whose size the canvas is brought.
    pub fn show_camera(&mut self, held: &Held, camera: &Pinhole) -> Result<bool, String> {
        self.fit_to(camera);
        self.gpu.poll();
        let frame = match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(frame) | CurrentSurfaceTexture::Suboptimal(frame) => frame,
            CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => return Ok(false),
            CurrentSurfaceTexture::Outdated | CurrentSurfaceTexture::Lost => {
                let (width, height) = self.size_px();
                self.configure(width, height);
                return Ok(false);
            }
            CurrentSurfaceTexture::Validation => return Err("the canvas refused the next picture".to_owned()),
        };
        let view = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let camera = self.begun_far(held, camera);
        self.picture.draw(held, &camera, &view);
        self.gpu.queue.present(frame);
        Ok(true)
    }

    /// Asks what lies at a place of the canvas, in CSS pixels; whether it can be asked now. The other arguments as of [`Screen::show`].
    pub fn pick(&mut self, held: &Held, pose: Rigid, fov_y_rad: f64, near_m: f64, at_px: DVec2) -> bool {
        let camera = self.begun_far(held, &self.camera(pose, fov_y_rad, near_m));
        let shown_px = DVec2::new(f64::from(self.canvas.client_width()), f64::from(self.canvas.client_height()));
        let size_px = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
        self.picture.pick(held, &camera, at_px * size_px / shown_px.max(DVec2::ONE))
    }

    fn camera(&self, pose: Rigid, fov_y_rad: f64, near_m: f64) -> Pinhole {
        Pinhole::symmetric(pose, self.size_px(), fov_y_rad, near_m)
    }

    fn begun_far(&self, held: &Held, camera: &Pinhole) -> Pinhole {
        if self.renderer == Renderer::WebGl2 { self.picture.begun_far(held, camera) } else { *camera }
    }

    /// Whether the view of an eye at rest is here as a whole; the same arguments as of [`Screen::show`].
    pub fn is_at_rest(&self, pose: Rigid, fov_y_rad: f64, near_m: f64) -> bool {
        self.picture.is_at_rest(&self.camera(pose, fov_y_rad, near_m))
    }
}

/// The canvas's size on the page in device pixels, within the caps.
fn wanted_size_px(canvas: &HtmlCanvasElement) -> (u32, u32) {
    let ratio = web_sys::window().map_or(1.0, |window| window.device_pixel_ratio()).clamp(0.5, MAX_PIXEL_RATIO);
    let (width, height) = (f64::from(canvas.client_width().max(1)), f64::from(canvas.client_height().max(1)));
    let ratio = ratio.min((MAX_PIXELS / (width * height)).sqrt());
    (((width * ratio).round() as u32).max(1), ((height * ratio).round() as u32).max(1))
}
