//! The viewer's life on the page: start, frames, a lost device, and what tests look at.

mod devices;
pub mod exports;
mod places;
mod worn;

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use camera::Rigid;
use client::draw::picture::PictureOptions;
use client::receive::viewer::{SocketCommand, Viewer};
use client::show::begin::Start;
use client::show::controls::{Controls, Input, Mode};
use client::show::quality::Quality;
use client::show::tape::Tape;
use glam::{DVec2, DVec3};
use protocol::message::{Clock, Role, ViewSize};
use protocol::session::AUDIENCE_BUDGET_BYTES;

use crate::gamepad;
use crate::input::{self, Action};
use crate::moments::{each_frame, each_interval, now_s};
use crate::page::{self, Dialog, Page};
use crate::record::{Recording, Replay};
use crate::screen::{Renderer, Screen};
use crate::server::{self, Address};
use crate::socket::Socket;
use crate::wishes::wishes;
use crate::worker;
use devices::Devices;
use places::{Eye, Places, Tool};
use worn::{Poses, Worn};

/// Uploading and applying updates takes no more than this share of the time between frames, or one piece or update: four milliseconds where frames come in time, and where
/// they are slow, what they wait for is there after as many.
const APPLY_SHARE: f64 = 0.25;
/// Seconds between two changes of the figures: readable, and cheap.
const PANEL_INTERVAL_S: f64 = 0.25;
/// Between questions what is sent, while that is shown.
const ASK_INTERVAL_S: f64 = 2.0;
/// What the held copy may take of the page's memory: phones give a page about 1 GB.
const BUDGET_BYTES: u64 = AUDIENCE_BUDGET_BYTES;
/// Vertical fields of view that a person may set, in degrees: a telescope's, and one at which the rim is drawn to twice its size.
const FOVS_DEG: [f64; 2] = [10.0, 120.0];
/// Milliseconds between two turns of the network while the page is hidden and draws nothing.
const HIDDEN_INTERVAL_MS: i32 = 1000;
/// After so many seconds without a frame a headset has none.
const FRAMELESS_S: f64 = 0.5;

thread_local! {
    static APP: RefCell<Option<Rc<RefCell<App>>>> = const { RefCell::new(None) };
}

struct App {
    page: Page,
    server: Address,
    socket: Option<Socket>,
    viewer: Viewer,
    scene: String,
    controls: Option<Controls>,
    actions: Rc<RefCell<VecDeque<Action>>>,
    /// `None` while a lost device is being replaced.
    screen: Option<Screen>,
    devices: Devices,
    /// As the address asks for it.
    picture: PictureOptions,
    quality: Quality,
    start: Option<Start>,
    mode: Option<Mode>,
    fov_y_rad: f64,
    loss_asked: bool,
    drawn: Drawn,
    /// The path that is written down.
    recording: Option<Recording>,
    /// The path that is gone.
    replay: Option<Replay>,
    places: Places,
    /// `None` where the page itself is looked at.
    worn: Option<Worn>,
    panel_at_s: f64,
    /// When the server was asked last what it sends.
    asked_at_s: f64,
    advanced_at_s: f64,
    /// The page's own trouble, beside the connection's.
    trouble: Option<String>,
}

/// The last picture.
#[derive(Default)]
struct Drawn {
    pose: Option<Rigid>,
    /// Something else than the pose changed.
    stale: bool,
    picture: bool,
    uncovered: Option<f64>,
}

/// Starts everything; fails with words for a person.
pub async fn start() -> Result<(), String> {
    let wishes = wishes()?;
    // It starts while the graphics do.
    let decoder = worker::decoder();
    let devices = Devices::new(wishes.renderer);
    let screen = devices.open(wishes.picture).await?;
    let (width_px, height_px) = screen.size_px();
    let view = ViewSize { width_px, height_px, fov_y_rad: wishes.fov_y_rad };
    let mut viewer = Viewer::new(&wishes.server.shown(), Clock::Wall, view, decoder, now_s())
        .with_budget(BUDGET_BYTES)
        .with_draws(wishes.picture.draws())
        .with_role(wishes.role)
        .with_staging(wishes.staging);
    if let Some(start) = wishes.start {
        viewer = viewer.with_eye(start.world_from_eye);
    }
    viewer.set_build(screen.picture.build());
    let app = App {
        page: Page::new()?,
        viewer,
        server: wishes.server,
        socket: None,
        scene: String::new(),
        controls: None,
        actions: Rc::default(),
        screen: Some(screen),
        devices,
        picture: wishes.picture,
        quality: Quality::default(),
        start: wishes.start,
        mode: wishes.mode,
        fov_y_rad: wishes.fov_y_rad,
        loss_asked: false,
        drawn: Drawn { stale: true, ..Drawn::default() },
        recording: None,
        replay: None,
        places: Places::default(),
        worn: None,
        panel_at_s: f64::NEG_INFINITY,
        asked_at_s: f64::NEG_INFINITY,
        advanced_at_s: now_s(),
        trouble: None,
    };
    let sink = app.sink();
    input::listen_to_page(&sink)?;
    server::reload_for_tokens();
    app.listen_to_canvas();
    let app = Rc::new(RefCell::new(app));
    APP.set(Some(Rc::clone(&app)));
    keep_turning(app)
}

/// Draws while the page is seen, and keeps the session alive while it is hidden.
fn keep_turning(app: Rc<RefCell<App>>) -> Result<(), String> {
    let hidden = Rc::clone(&app);
    each_interval(HIDDEN_INTERVAL_MS, move || {
        let (mut app, now_s) = (hidden.borrow_mut(), now_s());
        // A headset that nobody looks into, or that does not know where it is, has no frames.
        let is_still = app.worn.is_some() && now_s - app.advanced_at_s > FRAMELESS_S;
        if page::document().hidden() || is_still {
            app.turn(now_s, f64::INFINITY);
        }
    })?;
    each_frame(move || App::frame(&app))
}

impl App {
    fn sink(&self) -> Rc<dyn Fn(Action)> {
        let actions = Rc::clone(&self.actions);
        Rc::new(move |action| actions.borrow_mut().push_back(action))
    }

    fn listen_to_canvas(&self) {
        if let Some(screen) = &self.screen {
            input::listen_to_canvas(&screen.canvas, &self.sink());
        }
    }

    fn frame(app: &Rc<RefCell<App>>) {
        let mut this = app.borrow_mut();
        if this.worn.is_some() {
            return; // A headset says itself when.
        }
        let now_s = now_s();
        this.take_in(now_s);
        this.seek(now_s);
        this.move_eye(now_s);
        if let Err(why) = this.draw(now_s) {
            this.lose(app, &why);
        }
        this.show_tool(now_s);
        this.refresh_panel(now_s);
    }

    /// What the person did and what the network brought since the last frame.
    fn take_in(&mut self, now_s: f64) {
        self.act(now_s);
        self.turn(now_s, APPLY_SHARE * (now_s - self.advanced_at_s));
    }

    /// The graphics device is gone.
    fn lose(&mut self, app: &Rc<RefCell<App>>, why: &str) {
        self.screen = None;
        self.devices.losses += 1;
        self.trouble = Some(format!("the graphics device was lost ({why}); making a new one"));
        wasm_bindgen_futures::spawn_local(App::recover(Rc::clone(app)));
    }

    fn refresh_panel(&mut self, now_s: f64) {
        if now_s - self.panel_at_s >= PANEL_INTERVAL_S {
            self.panel_at_s = now_s;
            self.show_panel(now_s);
        }
    }

    /// What the person did since the last frame.
    fn act(&mut self, now_s: f64) {
        let actions = std::mem::take(&mut *self.actions.borrow_mut());
        for action in actions {
            match (action, &mut self.controls) {
                (Action::Move(input), Some(controls)) => {
                    // Where a pointer goes that is not down says nothing.
                    if !matches!(input, Input::PointerMove { .. } | Input::PointerUp { .. } | Input::FocusLost) {
                        self.replay = None;
                    }
                    controls.handle(input);
                }
                (Action::SwitchMode, Some(controls)) if self.worn.is_none() => {
                    controls.set_mode(if controls.mode() == Mode::Walk { Mode::Orbit } else { Mode::Walk });
                }
                (Action::Visit(at_px), _) if !self.places.has_tool() => self.places.visit(at_px),
                (Action::VisitMiddle, _) => self.places.visit(self.middle_px()),
                (Action::Use(at_px), _) => self.places.apply(at_px),
                (Action::UseMiddle, _) => self.places.apply(self.middle_px()),
                (Action::Point(at_px), _) => self.places.point(at_px, now_s),
                (Action::Leave, _) => self.places.leave(),
                (Action::Measure, _) => self.places.toggle(Tool::Tape(Tape::default())),
                (Action::ChooseParts, _) => self.places.toggle(Tool::Parts(None)),
                (Action::SwitchWalls, Some(controls)) => controls.set_walls(!controls.has_walls()),
                (Action::ChangeFov(degrees), _) => self.set_fov(self.fov_y_rad.to_degrees() + degrees),
                (Action::GoTo(side), Some(controls)) => controls.go_to(side),
                (Action::ChangeSpeed(factor), Some(controls)) => controls.change_speed(factor),
                (Action::Follow, _) => self.follow(),
                (Action::Restart, _) => self.begin_anew(),
                (Action::Shown, _) => {
                    self.drawn.stale = true;
                    self.viewer.rests();
                    self.viewer.retry_now(now_s);
                }
                _ => {}
            }
        }
    }

    /// The middle of the picture, in CSS pixels.
    fn middle_px(&self) -> DVec2 {
        let canvas = self.screen.as_ref().map(|screen| &screen.canvas);
        canvas.map_or(DVec2::ZERO, |canvas| {
            DVec2::new(f64::from(canvas.client_width()), f64::from(canvas.client_height())) / 2.0
        })
    }

    /// Where the last picture was taken from.
    fn eye(&self) -> Option<Eye> {
        let near_m = near_m(&self.viewer);
        self.drawn.pose.map(|pose| Eye { pose, fov_y_rad: self.fov_y_rad, near_m })
    }

    fn seek(&mut self, now_s: f64) {
        let eye = self.eye();
        if let (Some(screen), Some(eye)) = (&mut self.screen, eye) {
            self.places.seek((screen, &self.viewer), &mut self.controls, eye, now_s);
        }
    }

    fn show_tool(&mut self, now_s: f64) {
        let seen = self.screen.as_ref().zip(self.eye());
        self.places.show(&self.page, &mut self.viewer, seen, now_s);
    }

    fn set_fov(&mut self, degrees: f64) {
        let [least, most] = FOVS_DEG;
        self.fov_y_rad = degrees.clamp(least, most).to_radians();
        self.tell_view();
        self.drawn.stale = true;
    }

    /// Tells the server how large the picture on the page is now.
    fn tell_view(&mut self) {
        if let (Some(screen), None) = (&mut self.screen, &self.worn) {
            screen.fit();
            let (width_px, height_px) = screen.size_px();
            self.viewer.set_view(ViewSize { width_px, height_px, fov_y_rad: self.fov_y_rad }, now_s());
        }
    }

    /// The network's part: what came, what is decoded, what is to be sent. Taking in what is decoded gets so much time, in seconds.
    fn turn(&mut self, now_s: f64, apply_budget_s: f64) {
        while let Some(event) = self.socket.as_ref().and_then(Socket::try_event) {
            self.viewer.handle(event, now_s);
        }
        let changed = match &mut self.screen {
            Some(screen) => self.viewer.advance(&mut screen.picture, now_s, apply_budget_s),
            None => false,
        };
        self.drawn.stale |= changed;
        while let Some(command) = self.viewer.poll_socket(now_s) {
            match command {
                SocketCommand::Send(bytes) => {
                    if let Some(socket) = &self.socket {
                        socket.send(&bytes);
                    }
                }
                SocketCommand::Close => self.socket = None,
                SocketCommand::Open => self.open_socket(now_s),
            }
        }
        if let Some(welcome) = self.viewer.welcome()
            && (self.controls.is_none() || welcome.scene_name != self.scene)
        {
            // A restarted server with the same scene leaves the eye where it is.
            self.scene.clone_from(&welcome.scene_name);
            self.begin_anew();
            self.follow();
        }
        if let (Some(controls), Some(there)) = (&mut self.controls, self.viewer.presenter()) {
            controls.lead_to(there);
        }
    }

    /// Lets a follower's eye go with the presenter's, until he moves it.
    fn follow(&mut self) {
        if let (Role::Follower(_), Some(controls)) = (self.viewer.role(), &mut self.controls) {
            controls.be_led();
        }
    }

    fn open_socket(&mut self, now_s: f64) {
        match Socket::open(&self.server) {
            Ok(socket) => self.socket = Some(socket),
            Err(why) => self.viewer.handle(client::receive::viewer::SocketEvent::Closed(why), now_s),
        }
    }

    /// The eye is where one begins, and so is who wears a headset.
    fn begin_anew(&mut self) {
        self.controls = self.start_controls();
        self.worn.iter_mut().for_each(Worn::begin_anew);
    }

    fn start_controls(&self) -> Option<Controls> {
        let welcome = self.viewer.welcome()?;
        let (min, max) = (welcome.bounds_min_world.into(), welcome.bounds_max_world.into());
        let pose = self.start.map_or(welcome.start_world_from_eye, |start| start.world_from_eye);
        let mut controls = Controls::new(pose, welcome.walk, min, max);
        self.start.iter().for_each(|start| controls.turn_about(start.distance_m));
        self.mode.iter().for_each(|&mode| controls.set_mode(mode));
        controls.set_glides(!page::wants_less_motion());
        controls.set_walls(self.controls.as_ref().is_none_or(Controls::has_walls));
        Some(controls)
    }

    fn move_eye(&mut self, now_s: f64) {
        self.meet_walls();
        let dt_s = now_s - std::mem::replace(&mut self.advanced_at_s, now_s);
        let Some(screen) = &mut self.screen else { return };
        if screen.fit() {
            self.tell_view();
            self.drawn.stale = true;
        }
        let (Some(screen), Some(controls)) = (&mut self.screen, &mut self.controls) else { return };
        let size = (screen.canvas.client_width(), screen.canvas.client_height());
        controls.set_view(DVec2::new(f64::from(size.0), f64::from(size.1)), self.fov_y_rad);
        // Of several views on a page it moves the one that has the keys; one that is gone lets go.
        let (go, look) = gamepad::sticks().filter(|_| page::has_keys()).unwrap_or_default();
        if go != DVec3::ZERO || look != DVec2::ZERO {
            self.replay = None;
        }
        controls.handle(Input::Sticks { go, look });
        controls.advance(dt_s);
        if let Some(replay) = &self.replay {
            let (pose, is_over) = replay.at(now_s);
            controls.put(pose);
            self.replay = self.replay.take().filter(|_| !is_over);
        }
        if let Some(recording) = &mut self.recording {
            recording.see(controls.pose(), now_s);
        }
        self.viewer.set_steered_pose(controls.pose(), controls.motion(), now_s);
    }

    /// Brings what is drawn to this moment.
    fn prepare(&mut self, now_s: f64) -> Result<(), String> {
        let Some(screen) = &mut self.screen else { return Ok(()) };
        screen.gpu.check().map_err(|error| error.to_string())?;
        if std::mem::take(&mut self.loss_asked) {
            screen.gpu.device.destroy();
            return Err("on purpose".to_owned());
        }
        if let Some(share) = screen.picture.uncovered_share() {
            self.drawn.uncovered = Some(share);
            self.viewer.set_uncovered_share(share);
        }
        self.drawn.stale |= screen.picture.show_moment(&self.viewer.moment_at(now_s));
        if let Some(welcome) = self.viewer.welcome() {
            screen.picture.fit_to(welcome);
        }
        Ok(())
    }

    /// What would stop who walks.
    fn meet_walls(&mut self) {
        let (Some(screen), Some(controls)) = (&mut self.screen, &mut self.controls) else { return };
        if let Some(wall) = screen.picture.felt() {
            controls.meet(wall);
        }
        if let Some((way, body_m)) = controls.feels() {
            screen.picture.feel(self.viewer.held(), way, (body_m, near_m(&self.viewer)));
        }
    }

    /// A headset is put on, or taken off: the picture is drawn as that is to be.
    fn wear(&mut self, app: &Rc<RefCell<App>>, worn: Option<Worn>) {
        let before = std::mem::replace(&mut self.worn, worn);
        if let (Some(before), Some(controls)) = (before, &mut self.controls) {
            before.take_off(controls);
        }
        self.places.leave();
        self.replay = None;
        self.drawn.stale = true;
        let options = self.picture();
        // One that is being made is made so, too.
        let redrawn = self.screen.as_mut().map(|screen| screen.redraw(self.viewer.held(), options));
        match (redrawn, &self.screen) {
            (Some(Err(why)), _) => self.lose(app, &why),
            (_, Some(screen)) => self.viewer.set_build(screen.picture.build()),
            _ => {}
        }
        self.tell_view();
    }

    /// A frame of the headset, without what its eyes see.
    fn look(&mut self, app: &Rc<RefCell<App>>, poses: Poses, sticks: &[f64]) {
        let now_s = now_s();
        self.take_in(now_s);
        self.meet_walls();
        let dt_s = now_s - std::mem::replace(&mut self.advanced_at_s, now_s);
        if let (Some(worn), Some(controls)) = (&mut self.worn, &mut self.controls) {
            let head = worn.advance(poses, sticks, (controls, &mut self.viewer), (dt_s, now_s));
            self.recording.iter_mut().for_each(|recording| recording.see(head, now_s));
            self.drawn.pose = Some(head);
        }
        if let Err(why) = self.prepare(now_s) {
            self.lose(app, &why);
        }
        if let Some(screen) = &self.screen {
            self.viewer.set_draws(screen.picture.draws(), now_s);
            self.viewer.drawn(now_s, None, None);
        }
        self.refresh_panel(now_s);
    }

    /// Draws what an eye of it sees.
    fn show_eye(&mut self, index: usize) -> Result<bool, String> {
        let (Some(screen), Some(worn)) = (&mut self.screen, &self.worn) else { return Ok(false) };
        let is_shown = worn.show_eye(index, screen, &self.viewer, near_m(&self.viewer))?;
        self.drawn.picture |= is_shown && self.viewer.has_picture();
        Ok(is_shown)
    }

    /// Draws where something changed.
    fn draw(&mut self, now_s: f64) -> Result<(), String> {
        self.prepare(now_s)?;
        let Some(screen) = &mut self.screen else { return Ok(()) };
        let pose = self.controls.as_ref().map(Controls::pose);
        let goes_on = self.drawn.picture && screen.picture.goes_on();
        if !self.drawn.stale && !goes_on && pose == self.drawn.pose {
            // Counting the last picture's pixels ends only when the device is asked.
            screen.gpu.poll();
            self.viewer.rests();
            return Ok(());
        }
        let near_m = near_m(&self.viewer);
        if screen.show(self.viewer.held(), pose.unwrap_or(Rigid::IDENTITY), self.fov_y_rad, near_m)? {
            self.viewer.drawn(now_s, None, None);
            self.drawn.picture |= self.viewer.has_picture();
            if self.drawn.pose != pose {
                self.places.leave();
            }
            self.drawn.pose = pose;
            self.drawn.stale = false;
        }
        self.viewer.set_draws(screen.picture.draws(), now_s);
        Ok(())
    }

    /// Makes a new device after one was lost.
    async fn recover(app: Rc<RefCell<App>>) {
        let (devices, picture) = {
            let this = app.borrow();
            (this.devices, this.picture())
        };
        let opened = devices.open(picture).await;
        let mut this = app.borrow_mut();
        match opened {
            Ok(mut screen) => {
                // What was asked for meanwhile counts.
                let options = this.picture();
                if options == picture {
                    screen.picture.rebuild(this.viewer.held());
                } else if let Err(why) = screen.redraw(this.viewer.held(), options) {
                    this.trouble = Some(why);
                    return;
                }
                this.viewer.set_build(screen.picture.build());
                this.screen = Some(screen);
                this.places.forget_asked();
                this.listen_to_canvas();
                this.drawn.stale = true;
                this.trouble = None;
                this.tell_view();
            }
            Err(why) => this.trouble = Some(format!("the graphics device was lost, and {why}; reload the page")),
        }
    }

    /// How pictures are drawn.
    fn picture(&self) -> PictureOptions {
        if self.worn.is_some() {
            self.quality.headset_options(self.picture)
        } else {
            self.quality.options(self.picture)
        }
    }

    fn status(&self, now_s: f64) -> String {
        self.trouble.clone().or_else(|| self.viewer.status(now_s)).unwrap_or_default()
    }

    fn show_panel(&mut self, now_s: f64) {
        if Dialog::Inventory.is_open() && now_s - self.asked_at_s >= ASK_INTERVAL_S {
            self.asked_at_s = now_s;
            self.viewer.ask_inventory(now_s);
        }
        if Dialog::Inventory.is_open()
            && let Err(why) = page::show_inventory(self.viewer.inventory())
        {
            self.trouble = Some(why);
        }
        let stats = self.viewer.stats(now_s);
        let renderer = self.screen.as_ref().map_or("none", |screen| match screen.renderer {
            Renderer::WebGpu => "WebGPU",
            Renderer::WebGl2 => "WebGL2",
        });
        let soft = self.screen.as_ref().and_then(|screen| screen.picture.soft_progress());
        self.page.show_stats(&stats, renderer);
        self.page.show_history(self.viewer.history());
        self.page.show_soft(soft);
        self.page.show_effects(self.screen.as_ref().map(|screen| screen.picture.effects()));
        self.page.show_resolution(self.screen.as_ref().map(|screen| screen.picture.resolution()));
        self.page.show_mode(self.controls.as_ref().map(Controls::mode));
        self.page.show_role(self.viewer.role(), self.controls.as_ref().is_some_and(Controls::is_led));
        self.page.show_status(&self.status(now_s));
        self.page.show_progress(self.viewer.progress(), self.viewer.is_open());
    }
}

fn near_m(viewer: &Viewer) -> f64 {
    viewer.welcome().map_or(0.1, |welcome| welcome.near_m)
}
