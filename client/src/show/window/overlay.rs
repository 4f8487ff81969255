//! The panel over the picture, by egui.

use egui::{Align2, Color32, ProgressBar, RichText};
use gpu::Gpu;
use surface::Tint;
use wgpu::TextureFormat;
use winit::event::WindowEvent;
use winit::window::Window;

use crate::draw::effects::Drawn;
use crate::draw::frame;
use crate::draw::shadow::SoftProgress;
use crate::draw::steady::Resolution;
use crate::receive::history::{Figure, History};
use crate::receive::stats::Stats;
use crate::receive::viewer::Progress;
use crate::show::controls::Mode;
use crate::show::panel::short_count;

/// Of a curve, in points.
const CURVE_SIZE: egui::Vec2 = egui::vec2(56.0, 13.0);

/// What the panel shows.
pub(super) struct Panel<'a> {
    pub stats: Stats,
    pub history: &'a History,
    pub status: Option<String>,
    pub progress: Option<Progress>,
    pub adapter: &'a str,
    pub mode: Option<Mode>,
    pub soft: Option<SoftProgress>,
    /// Of shadows and of ambient occlusion.
    pub resolution: Resolution,
    pub effects: [Drawn; 2],
}

/// What came of showing it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Asked {
    pub mode: Option<Mode>,
    pub repaint: bool,
}

/// egui's state.
pub(super) struct Overlay {
    context: egui::Context,
    state: egui_winit::State,
    renderer: egui_wgpu::Renderer,
    output: Option<egui::FullOutput>,
    visible: bool,
}

impl Overlay {
    pub fn new(window: &Window, gpu: &Gpu, format: TextureFormat) -> Overlay {
        let context = egui::Context::default();
        let state = egui_winit::State::new(context.clone(), egui::ViewportId::ROOT, window, None, None, None);
        let renderer = egui_wgpu::Renderer::new(&gpu.device, format, egui_wgpu::RendererOptions::default());
        Overlay { context, state, renderer, output: None, visible: true }
    }

    /// Whether the panel wants this event for itself.
    pub fn take_event(&mut self, window: &Window, event: &WindowEvent) -> bool {
        let response = self.state.on_window_event(window, event);
        if response.repaint && !matches!(event, WindowEvent::RedrawRequested) {
            window.request_redraw();
        }
        response.consumed
    }

    pub fn toggle(&mut self) {
        self.visible = !self.visible;
    }

    /// Lays the panel out; [`Overlay::draw`] draws it.
    pub fn run(&mut self, window: &Window, panel: Panel<'_>, options: &mut frame::Options) -> Asked {
        let input = self.state.take_egui_input(window);
        let mut asked = Asked::default();
        let visible = self.visible;
        let mut output = self.context.run_pass(input, |context| {
            if visible {
                asked.mode = figures(context, &panel, options);
            }
            trouble(context, &panel);
        });
        asked.repaint = output
            .viewport_output
            .get(&egui::ViewportId::ROOT)
            .is_some_and(|viewport| viewport.repaint_delay.is_zero());
        self.state.handle_platform_output(window, std::mem::take(&mut output.platform_output));
        if let Some(mut undrawn) = self.output.take() {
            // Textures of a frame that was never drawn must not be lost.
            undrawn.append(output);
            output = undrawn;
        }
        self.output = Some(output);
        asked
    }

    /// The window takes no picture now; what the panel needs later is kept.
    pub fn skip(&mut self, gpu: &Gpu) {
        if let Some(mut output) = self.output.take() {
            self.update_textures(gpu, &mut output);
        }
    }

    /// Over a picture of this size.
    pub fn draw(&mut self, gpu: &Gpu, size_px: (u32, u32), view: &wgpu::TextureView) {
        let Some(mut output) = self.output.take() else { return };
        let pixels_per_point = output.pixels_per_point;
        self.set_textures(gpu, &mut output);
        let shapes = std::mem::take(&mut output.shapes);
        let jobs = self.context.tessellate(shapes, pixels_per_point);
        let size: [u32; 2] = size_px.into();
        let descriptor = egui_wgpu::ScreenDescriptor { size_in_pixels: size, pixels_per_point };
        let (device, queue) = (&gpu.device, &gpu.queue);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut commands = self.renderer.update_buffers(device, queue, &mut encoder, &jobs, &descriptor);
        {
            let attachment = wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            };
            let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("panel"),
                color_attachments: &[Some(attachment)],
                ..Default::default()
            });
            self.renderer.render(&mut pass.forget_lifetime(), &jobs, &descriptor);
        }
        commands.push(encoder.finish());
        queue.submit(commands);
        self.free_textures(&mut output);
    }

    fn update_textures(&mut self, gpu: &Gpu, output: &mut egui::FullOutput) {
        self.set_textures(gpu, output);
        self.free_textures(output);
    }

    fn set_textures(&mut self, gpu: &Gpu, output: &mut egui::FullOutput) {
        for (id, deltas) in output.textures_delta.set.drain() {
            for delta in deltas {
                self.renderer.update_texture(&gpu.device, &gpu.queue, id, &delta);
            }
        }
    }

    fn free_textures(&mut self, output: &mut egui::FullOutput) {
        for id in output.textures_delta.free.drain() {
            self.renderer.free_texture(&id);
        }
    }
}

fn figures(context: &egui::Context, panel: &Panel<'_>, options: &mut frame::Options) -> Option<Mode> {
    let stats = &panel.stats;
    let milliseconds = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.0} ms"));
    let title = if stats.scene.is_empty() { "Vantage" } else { &stats.scene };
    let mut asked = None;
    egui::Window::new(title)
        .id(egui::Id::unique("figures"))
        .anchor(Align2::LEFT_TOP, [12.0, 12.0])
        .resizable(false)
        .show(context, |ui| {
            egui::Grid::new("rows").num_columns(2).spacing([18.0, 3.0]).show(ui, |ui| {
                let history = panel.history;
                let mut with_curve = |name: &str, value: String, figure: Figure| {
                    ui.label(RichText::new(name).weak());
                    ui.horizontal(|ui| {
                        ui.label(value);
                        curve(ui, &history.curve(figure));
                    });
                    ui.end_row();
                };
                with_curve("Pictures", format!("{:.0} /s", stats.fps), Figure::Pictures);
                with_curve("Longest", milliseconds(history.now(Figure::LongestFrame)), Figure::LongestFrame);
                with_curve("Received", format!("{:.2} Mbit/s", stats.mbit_per_s), Figure::Received);
                with_curve("Round trip", milliseconds(stats.round_trip_ms.or(stats.ping_ms)), Figure::RoundTrip);
                with_curve("Age", milliseconds(stats.age_ms), Figure::Age);
                let mut row = |name: &str, value: String| {
                    ui.label(RichText::new(name).weak());
                    ui.label(value);
                    ui.end_row();
                };
                row("Updates", history.updates_in_words());
                row("Samples", short_count(stats.samples));
                row(
                    "Uncovered",
                    stats.uncovered_share.map_or("-".to_owned(), |share| format!("{:.1} %", share * 100.0)),
                );
                row("Decoding", format!("{:.1} ms", stats.ms.decode));
                row("Resolution", panel.resolution.to_string());
                let [shadows, occlusion] = panel.effects;
                row("Shadows", shadows.to_string());
                if let Some(soft) = panel.soft {
                    row("Soft shadows", soft.to_string());
                }
                row("Occlusion", occlusion.to_string());
                row("Adapter", panel.adapter.to_owned());
            });
            ui.separator();
            ui.horizontal(|ui| {
                ui.checkbox(&mut options.fill, "Fill");
                ui.checkbox(&mut options.mark_uncovered, "Mark uncovered");
            });
            ui.horizontal(|ui| {
                ui.label("Colours");
                for (tint, name) in [(Tint::Own, "picture"), (Tint::Age, "age"), (Tint::Density, "density")] {
                    ui.selectable_value(&mut options.tint, tint, name);
                }
            });
            if let Some(mut mode) = panel.mode {
                ui.horizontal(|ui| {
                    ui.selectable_value(&mut mode, Mode::Walk, "Walk");
                    ui.selectable_value(&mut mode, Mode::Orbit, "Turn");
                });
                asked = Some(mode);
            }
        });
    asked
}

/// A curve in the unit square, drawn small.
fn curve(ui: &mut egui::Ui, points: &[[f64; 2]]) {
    let (place, painter) = ui.allocate_painter(CURVE_SIZE, egui::Sense::hover());
    let at = |&[x, y]: &[f64; 2]| {
        let rect = place.rect;
        egui::pos2(rect.left() + rect.width() * x as f32, rect.bottom() - rect.height() * y as f32)
    };
    let stroke = egui::Stroke::new(1.2, Color32::from_rgb(124, 196, 255));
    painter.add(egui::Shape::line(points.iter().map(at).collect(), stroke));
}

fn trouble(context: &egui::Context, panel: &Panel<'_>) {
    if let Some(status) = &panel.status {
        egui::Area::new(egui::Id::unique("status")).anchor(Align2::CENTER_BOTTOM, [0.0, -24.0]).show(context, |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.label(RichText::new(status).color(Color32::from_rgb(255, 196, 107)));
            });
        });
    } else if let Some(progress) = panel.progress {
        egui::Area::new(egui::Id::unique("progress")).anchor(Align2::CENTER_CENTER, [0.0, 0.0]).show(context, |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.label("Waiting for the first picture");
                let share = progress.bytes as f32 / progress.of_bytes.max(1) as f32;
                ui.add(ProgressBar::new(share).desired_width(220.0));
            });
        });
    }
}
