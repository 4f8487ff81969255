//! A window that is open: what a turn and a frame of it do.

use camera::Pinhole;
use glam::DVec2;
use protocol::message::{Role, ViewSize};

use super::options::{Options, WindowError};
use super::overlay::{self, Overlay};
use super::screen::Screen;
use crate::receive::pump::Pump;
use crate::receive::viewer::Viewer;
use crate::show::controls::Controls;

/// Applying updates stops a frame for no longer than this, in seconds, or for one update.
const APPLY_BUDGET_S: f64 = 0.008;

/// What becomes of a place of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sought {
    /// The eye goes there.
    Visit,
    /// The part that is there is hidden.
    Hide,
}

/// Everything that lives as long as the window.
pub(super) struct Running<'a> {
    pub screen: Screen,
    pub overlay: Overlay,
    pub viewer: Viewer,
    pub pump: Pump<'a>,
    pub controls: Option<Controls>,
    pub cursor_px: DVec2,
    pub advanced_at_s: f64,
    pub last_counted: Option<f64>,
    pub drawn_pose: Option<camera::Rigid>,
    /// A place of the picture, in pixels, that something is to be done with as soon as it can be asked what is there.
    pub seeks: Option<(DVec2, Sought)>,
    /// What is to be done with what is being asked for.
    pub sought: Option<Sought>,
}

impl Running<'_> {
    /// The network's part of a turn; returns whether there is something new to draw.
    pub fn turn(&mut self) -> bool {
        self.pump.turn(&mut self.viewer);
        let changed = self.viewer.advance(&mut self.screen.picture, self.pump.now_s(), APPLY_BUDGET_S);
        self.pump.turn(&mut self.viewer);
        if self.controls.is_none() && self.viewer.welcome().is_some() {
            self.begin();
            self.follow();
        }
        changed | self.be_led()
    }

    /// Puts the eye where the scene begins.
    pub fn begin(&mut self) {
        let Some(welcome) = self.viewer.welcome() else { return };
        let (min, max) = (welcome.bounds_min_world.into(), welcome.bounds_max_world.into());
        let mut controls = Controls::new(welcome.start_world_from_eye, welcome.walk, min, max);
        controls.set_walls(self.controls.as_ref().is_none_or(Controls::has_walls));
        self.controls = Some(controls);
    }

    /// Asks what is at a place that something is to be done with, and does that once it is known; whether it waits for an answer.
    fn seek(&mut self, fov_y_rad: f64) -> bool {
        let near_m = self.viewer.welcome().map_or(0.1, |welcome| welcome.near_m);
        if let Some(found) = self.screen.picture.picked() {
            match (self.sought.take(), found, &mut self.controls) {
                (Some(Sought::Visit), Some(found), Some(controls)) => controls.visit(found.at_world),
                (Some(Sought::Hide), Some(found), _) => {
                    let parts = self.viewer.staging().excerpt.parts.without(found.object);
                    self.viewer.show_parts(parts, self.pump.now_s());
                }
                _ => {}
            }
        }
        if let (Some((at_px, sought)), Some(pose), None) = (self.seeks, self.drawn_pose, self.sought) {
            let camera = Pinhole::symmetric(pose, self.screen.size_px(), fov_y_rad, near_m);
            if self.screen.picture.pick(self.viewer.held(), &camera, at_px) {
                (self.seeks, self.sought) = (None, Some(sought));
            }
        }
        self.seeks.is_some() || self.sought.is_some()
    }

    /// Lets the scene's time go on, or stops it.
    pub fn play_or_pause(&mut self) {
        let rate = if self.viewer.playback().is_paused() { 1.0 } else { 0.0 };
        self.viewer.play(rate, self.pump.now_s());
    }

    /// Lets a follower's eye go with the presenter's, until he moves it.
    pub fn follow(&mut self) {
        if let (Role::Follower(_), Some(controls)) = (self.viewer.role(), &mut self.controls) {
            controls.be_led();
        }
    }

    /// Tells the controls where they are led; whether the eye is to go there.
    fn be_led(&mut self) -> bool {
        let (Some(controls), Some(there)) = (&mut self.controls, self.viewer.presenter()) else { return false };
        controls.lead_to(there);
        controls.is_led() && self.drawn_pose != Some(controls.pose())
    }

    pub fn tell_view(&mut self, fov_y_rad: f64) {
        let (width_px, height_px) = self.screen.size_px();
        self.viewer.set_view(ViewSize { width_px, height_px, fov_y_rad }, self.pump.now_s());
    }

    /// A frame: keys move the eye, the network has its turn, the picture and the panel are drawn.
    pub fn draw(&mut self, options: &Options) -> Result<(), WindowError> {
        let now_s = self.pump.now_s();
        let dt_s = now_s - std::mem::replace(&mut self.advanced_at_s, now_s);
        let size_px = self.screen.size_px();
        let mut moving = false;
        if let Some(controls) = &mut self.controls {
            controls.set_view(DVec2::new(f64::from(size_px.0), f64::from(size_px.1)), options.fov_y_rad);
            if let Some(wall) = self.screen.picture.felt() {
                controls.meet(wall);
            }
            moving = controls.advance(dt_s);
            if let Some((way, body_m)) = controls.feels() {
                let near_m = self.viewer.welcome().map_or(0.1, |welcome| welcome.near_m);
                self.screen.picture.feel(self.viewer.held(), way, (body_m, near_m));
            }
            self.viewer.set_steered_pose(controls.pose(), controls.motion(), now_s);
        }
        let mut changed = self.turn() | self.seek(options.fov_y_rad);
        changed |= self.screen.picture.show_moment(&self.viewer.moment_at(now_s));
        let pose = self.controls.as_ref().map(Controls::pose);
        moving |= pose != self.drawn_pose;
        self.drawn_pose = pose;
        if let Some(share) = self.screen.picture.uncovered_share()
            && self.last_counted != Some(share)
        {
            self.last_counted = Some(share);
            self.viewer.set_uncovered_share(share);
        }
        let stats = self.viewer.stats(now_s);
        let panel = overlay::Panel {
            stats,
            history: self.viewer.history(),
            status: self.viewer.status(now_s),
            progress: self.viewer.progress(),
            adapter: &self.screen.gpu.caps.name,
            soft: self.screen.picture.soft_progress(),
            resolution: self.screen.picture.resolution(),
            effects: self.screen.picture.effects(),
            mode: self.controls.as_ref().map(Controls::mode),
        };
        let asked = self.overlay.run(&self.screen.window, panel, self.screen.picture.options_mut());
        if let (Some(mode), Some(controls)) = (asked.mode, &mut self.controls) {
            controls.set_mode(mode);
        }
        if let Some(welcome) = self.viewer.welcome() {
            self.screen.picture.fit_to(welcome);
        }
        let shown = self.screen.show(&self.viewer, pose, options.fov_y_rad, &mut self.overlay)?;
        if shown {
            self.viewer.drawn(self.pump.now_s(), None, None);
        }
        self.viewer.set_draws(self.screen.picture.draws(), self.pump.now_s());
        if moving || changed || self.screen.picture.goes_on() || asked.repaint {
            self.screen.window.request_redraw();
        } else {
            self.viewer.rests();
        }
        Ok(())
    }
}
