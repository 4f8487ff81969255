//! The native window: winit for the window and its events, egui for the panel, the same [`Viewer`],
//! [`Controls`](crate::show::controls::Controls) and [`Picture`](crate::draw::picture::Picture) as everywhere else.
//!
//! A picture is drawn when the eye moved, when something new is held, or when the panel wants to change, so a still viewer of
//! a still scene leaves the machine alone.

mod events;
mod options;
mod overlay;
mod running;
mod screen;

use std::sync::Arc;
use std::time::{Duration, Instant};

use protocol::Limits;
use protocol::message::{Clock, ViewSize};
use winit::application::ApplicationHandler;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::WindowId;

use crate::receive::address;
use crate::receive::pump::Pump;
use crate::receive::socket::Sockets;
use crate::receive::viewer::{Decoder, Viewer};
pub use options::{Options, Renderer, WindowError};
use overlay::Overlay;
use running::Running;
use screen::Screen;

/// How often the panel's figures change, and how soon deadlines are seen.
const PANEL_INTERVAL: Duration = Duration::from_millis(250);

/// Runs until the window is closed.
pub fn run(options: Options) -> Result<(), WindowError> {
    let url = address::websocket_url(&options.server)?;
    let sockets = Sockets::new().map_err(WindowError::Network)?.ready_for(&url, options.tls_ca.as_deref())?;
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
        let overlay = Overlay::new(&screen.window, &screen.gpu, screen.format());
        let wake = self.proxy.clone();
        // The event loop is gone only when the program ends.
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(move || {
            let _ = wake.send_event(Woken);
        });
        let decoder = Decoder::on_thread(Limits::default(), Arc::clone(&wake)).map_err(WindowError::Network)?;
        let view = ViewSize { width_px: options.size_px.0, height_px: options.size_px.1, fov_y_rad: options.fov_y_rad };
        screen.window.request_redraw();
        let mut viewer = Viewer::new(address::shown(&options.server), Clock::Wall, view, decoder, 0.0)
            .with_budget(options.budget_bytes)
            .with_draws(options.picture.draws())
            .with_role(options.role.clone());
        viewer.set_build(screen.picture.build());
        Ok(Running {
            screen,
            overlay,
            viewer,
            pump: Pump::new(self.sockets, &self.url, wake),
            controls: None,
            cursor_px: glam::DVec2::ZERO,
            advanced_at_s: 0.0,
            last_counted: None,
            drawn_pose: None,
            seeks: None,
            sought: None,
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
        if running.viewer.is_uploading() {
            // The event loop is gone only when the program ends.
            let _ = self.proxy.send_event(Woken);
        }
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: WindowError) {
        self.failed = Some(error);
        event_loop.exit();
    }
}
