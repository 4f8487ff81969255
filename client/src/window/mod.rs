//! The native window: winit for the window and its events, egui for the panel, the same [`Viewer`],
//! [`Controls`] and [`Picture`](crate::picture::Picture) as everywhere else.
//!
//! A picture is drawn when the eye moved, when something new is held, or when the panel wants to change, so a still viewer of
//! a still scene leaves the machine alone.

mod events;
mod overlay;
mod screen;

use std::sync::Arc;
use std::time::{Duration, Instant};

use gpu::GpuError;
use network::Link;
use protocol::Limits;
use protocol::message::{Clock, ViewSize};
use thiserror::Error;
use winit::application::ApplicationHandler;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::WindowId;

use crate::address::{self, AddressError};
use crate::controls::Controls;
use crate::picture::{PictureError, PictureOptions};
use crate::pump::Pump;
use crate::shadow::SoftProgress;
use crate::socket::Sockets;
use crate::viewer::{Decoder, Viewer};
use overlay::Overlay;
use screen::Screen;

/// How often the panel's figures change, and how soon deadlines are seen.
const PANEL_INTERVAL: Duration = Duration::from_millis(250);
/// Applying updates stops a frame for no longer than this, in seconds, or for one update.
const APPLY_BUDGET_S: f64 = 0.008;

/// What a window is told.
#[derive(Debug, Clone)]
pub struct Options {
    /// The server, as people type it.
    pub server: String,
    /// First size of the window's inside, in physical pixels.
    pub size_px: (u32, u32),
    /// Vertical field of view.
    pub fov_y_rad: f64,
    /// What the held copy may take of this machine's memory.
    pub budget_bytes: u64,
    /// Graphics interface.
    pub renderer: Renderer,
    /// How pictures are drawn.
    pub picture: PictureOptions,
    /// The emulated network.
    pub link: Option<Link>,
}

/// A graphics interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Renderer {
    /// The best there is.
    Auto,
    /// Vulkan.
    Vulkan,
    /// Metal.
    Metal,
    /// Direct3D 12.
    Dx12,
    /// OpenGL.
    Gl,
}

/// Why a window ended with an error.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WindowError {
    /// The address.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// No GPU, or it went away.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Drawing.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The window system.
    #[error("no window: {0} (without a display use --headless)")]
    Window(String),
    /// A surface that pictures can be shown on.
    #[error("the window cannot be drawn to: {0}")]
    Surface(String),
    /// The network thread or the emulated network.
    #[error("cannot start the network: {0}")]
    Network(std::io::Error),
}

/// Runs until the window is closed.
pub fn run(options: Options) -> Result<(), WindowError> {
    let url = address::websocket_url(&options.server)?;
    let sockets = Sockets::new().map_err(WindowError::Network)?;
    let proxy = options.link.map(|link| sockets.start_proxy(&url, link)).transpose().map_err(WindowError::Network)?;
    let url = match &proxy {
        Some(proxy) => address::with_authority(&url, &proxy.local_addr().to_string()),
        None => url,
    };
    let events =
        EventLoop::<Woken>::with_user_event().build().map_err(|error| WindowError::Window(error.to_string()))?;
    let mut app = App { proxy: events.create_proxy(), sockets: &sockets, url, options, running: None, failed: None };
    events.run_app(&mut app).map_err(|error| WindowError::Window(error.to_string()))?;
    app.failed.map_or(Ok(()), Err)
}

/// Something came from the network or from the decoder.
#[derive(Debug, Clone, Copy)]
struct Woken;

struct App<'a> {
    proxy: EventLoopProxy<Woken>,
    sockets: &'a Sockets,
    url: String,
    options: Options,
    running: Option<Running<'a>>,
    failed: Option<WindowError>,
}

/// Everything that lives as long as the window.
struct Running<'a> {
    screen: Screen,
    overlay: Overlay,
    viewer: Viewer,
    pump: Pump<'a>,
    controls: Option<Controls>,
    cursor_px: glam::DVec2,
    advanced_at_s: f64,
    last_counted: Option<f64>,
    drawn_pose: Option<camera::Rigid>,
}

impl ApplicationHandler<Woken> for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.running.is_none() {
            match self.start(event_loop) {
                Ok(running) => self.running = Some(running),
                Err(error) => self.fail(event_loop, error),
            }
        }
    }

    fn new_events(&mut self, event_loop: &ActiveEventLoop, cause: StartCause) {
        if matches!(cause, StartCause::ResumeTimeReached { .. }) {
            self.turn(event_loop);
            if let Some(running) = &self.running {
                running.screen.window.request_redraw();
            }
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, _: Woken) {
        self.turn(event_loop);
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(running) = &mut self.running else { return };
        let consumed = running.overlay.take_event(&running.screen.window, &event);
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                running.screen.resize((size.width, size.height));
                running.tell_view(self.options.fov_y_rad);
            }
            WindowEvent::RedrawRequested => match running.draw(&self.options) {
                Ok(()) => {
                    event_loop.set_control_flow(ControlFlow::WaitUntil(Instant::now() + PANEL_INTERVAL));
                }
                Err(error) => self.fail(event_loop, error),
            },
            other if !consumed => events::handle(running, &other),
            _ => {}
        }
    }
}

impl<'a> App<'a> {
    fn start(&self, event_loop: &ActiveEventLoop) -> Result<Running<'a>, WindowError> {
        let options = &self.options;
        let screen = Screen::open(event_loop, options)?;
        let overlay = Overlay::new(&screen);
        let wake = self.proxy.clone();
        // The event loop is gone only when the program ends.
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(move || {
            let _ = wake.send_event(Woken);
        });
        let decoder = Decoder::on_thread(Limits::default(), Arc::clone(&wake)).map_err(WindowError::Network)?;
        let view = ViewSize { width_px: options.size_px.0, height_px: options.size_px.1, fov_y_rad: options.fov_y_rad };
        screen.window.request_redraw();
        Ok(Running {
            screen,
            overlay,
            viewer: Viewer::new(&options.server, Clock::Wall, view, decoder, 0.0)
                .with_budget(options.budget_bytes)
                .with_draws(options.picture.draws()),
            pump: Pump::new(self.sockets, &self.url, wake),
            controls: None,
            cursor_px: glam::DVec2::ZERO,
            advanced_at_s: 0.0,
            last_counted: None,
            drawn_pose: None,
        })
    }

    fn turn(&mut self, event_loop: &ActiveEventLoop) {
        let Some(running) = &mut self.running else { return };
        if let Err(error) = running.screen.gpu.check() {
            let error = error.into();
            return self.fail(event_loop, error);
        }
        if running.turn() {
            running.screen.window.request_redraw();
        }
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: WindowError) {
        self.failed = Some(error);
        event_loop.exit();
    }
}

impl Running<'_> {
    /// The network's part of a turn; returns whether there is something new to draw.
    fn turn(&mut self) -> bool {
        self.pump.turn(&mut self.viewer);
        let changed = self.viewer.advance(&mut self.screen.picture, self.pump.now_s(), APPLY_BUDGET_S);
        self.pump.turn(&mut self.viewer);
        if self.controls.is_none()
            && let Some(welcome) = self.viewer.welcome()
        {
            let (min, max) = (welcome.bounds_min_world.into(), welcome.bounds_max_world.into());
            self.controls = Some(Controls::new(welcome.start_world_from_eye, welcome.walk, min, max));
        }
        changed
    }

    fn tell_view(&mut self, fov_y_rad: f64) {
        let (width_px, height_px) = self.screen.size_px();
        self.viewer.set_view(ViewSize { width_px, height_px, fov_y_rad }, self.pump.now_s());
    }

    /// A frame: keys move the eye, the network has its turn, the picture and the panel are drawn.
    fn draw(&mut self, options: &Options) -> Result<(), WindowError> {
        let now_s = self.pump.now_s();
        let dt_s = now_s - std::mem::replace(&mut self.advanced_at_s, now_s);
        let size_px = self.screen.size_px();
        let mut moving = false;
        if let Some(controls) = &mut self.controls {
            controls.set_view(glam::DVec2::new(f64::from(size_px.0), f64::from(size_px.1)), options.fov_y_rad);
            moving = controls.advance(dt_s);
            self.viewer.set_pose(controls.pose(), now_s);
        }
        let changed = self.turn();
        let pose = self.controls.as_ref().map(Controls::pose);
        moving |= pose != self.drawn_pose;
        self.drawn_pose = pose;
        if let Some(share) = self.screen.picture.uncovered_share()
            && self.last_counted != Some(share)
        {
            self.last_counted = Some(share);
            self.viewer.set_uncovered_share(share);
        }
        let panel = overlay::Panel {
            stats: self.viewer.stats(now_s),
            status: self.viewer.status(now_s),
            progress: self.viewer.progress(),
            adapter: &self.screen.gpu.caps.name,
            soft: self.screen.picture.soft_progress(),
            mode: self.controls.as_ref().map(Controls::mode),
        };
        let asked = self.overlay.run(&self.screen.window, panel, self.screen.picture.options_mut());
        if let (Some(mode), Some(controls)) = (asked.mode, &mut self.controls) {
            controls.set_mode(mode);
        }
        let shown = self.screen.show(&self.viewer, pose, options.fov_y_rad, &mut self.overlay)?;
        if shown {
            self.viewer.drawn(self.pump.now_s(), None, None);
        }
        let goes_on = self.screen.picture.soft_progress().is_some_and(SoftProgress::goes_on);
        if moving || changed || goes_on || asked.repaint {
            self.screen.window.request_redraw();
        }
        Ok(())
    }
}
