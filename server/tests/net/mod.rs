//! A server on loopback with images that cost nothing, and clients of it.
#![allow(dead_code, reason = "each test file uses a part")]

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use camera::{Camera, Motion, Pinhole, Rigid};
use futures_util::{SinkExt, StreamExt};
use glam::{DAffine3, DVec3};
use protocol::message::{Clock, Role, ViewSize, Welcome};
use protocol::session::{ClientConfig, ClientEvent, ClientSession, SessionError};
use protocol::wire::{UpdateHead, decode_update};
use protocol::{Held, Lighting, Material, Purpose, limits::Limits};
use scene::model::Animation;
use scene::{Bounds, Instance, Scene, Snapshot};
use surface::{AddressTexel, AddressView, HeldSurfaces};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};
use vantage_server::access::Access;
use vantage_server::account::Account;
use vantage_server::discretize::{Capture, Discretization};
use vantage_server::imager::{Imager, ImagerError};
use vantage_server::{Config, Running};

pub const VIEW: ViewSize = ViewSize { width_px: 64, height_px: 36, fov_y_rad: 1.0 };

struct Still;

impl Animation for Still {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        let world_from_mesh = vec![DAffine3::IDENTITY; scene.instances.len()];
        Snapshot { time_s, world_from_mesh, deformed: Vec::new(), lights: Vec::new() }
    }
}

/// A room of 20 m without anything in it; `moves` makes it a scene that is sampled at every tick.
pub fn room(moves: bool) -> Scene {
    Scene {
        name: "room".into(),
        meshes: Vec::new(),
        materials: vec![scene::Material::default()],
        textures: Vec::new(),
        instances: vec![Instance { mesh: 0, name: "box".into(), moves, deforms: false, tint: [255; 3] }],
        cameras: Vec::new(),
        bounds: Bounds { min: DVec3::splat(-10.0), max: DVec3::splat(10.0) },
        walk: true,
        start: None,
        corridors: None,
        named_cameras: Vec::new(),
        offer: scene::load::Offer::default(),
        lights_move: false,
        warnings: Vec::new(),
        animation: Arc::new(Still),
    }
}

/// Pictures that depend on the eye alone and compress badly, so that updates have the size of real ones.
pub struct NoiseImager {
    pub delay: Duration,
}

impl Imager for NoiseImager {
    fn adapter(&self) -> String {
        "noise".into()
    }

    fn materials(&self) -> Vec<Material> {
        vec![Material::default()]
    }

    fn lighting(&self, _: &Snapshot) -> Lighting {
        Lighting { ambient: [1.0; 3], lights: Vec::new(), background: [0; 3], burley: false, ..Lighting::default() }
    }

    fn captures(&mut self, _: &Snapshot, views: &[Pinhole], _: Discretization) -> Result<Vec<Capture>, ImagerError> {
        std::thread::sleep(self.delay);
        Ok(views.iter().map(noise).collect())
    }

    fn new_surfaces(&self) -> Option<HeldSurfaces> {
        None
    }

    /// A copy shows a view's noise where a patch was taken from that very view, else nothing.
    fn copy_view(&mut self, account: &Account, _: Purpose, view: &Pinhole) -> Result<AddressView, ImagerError> {
        let size_px = (view.width_px, view.height_px);
        let held = account.held().patches.values().find(|held| held.patch.image.camera == Camera::Pinhole(*view));
        let Some(held) = held else { return Ok(AddressView::empty(size_px)) };
        let image = &held.patch.image;
        let texel = |((x, y), index): ((u32, u32), usize)| AddressTexel {
            patch: held.patch.id.0,
            pixel: x | y << 16,
            normal_object: u32::from(u16::from_le_bytes(image.normal[index])) | u32::from(image.object[index]) << 16,
            w_bits: image.depth_scale.w(image.depth[index]).to_bits(),
        };
        Ok(AddressView { size_px, texels: image.mask.occupied().zip(0..).map(texel).collect() })
    }
}

/// A wall that fills every view, its inverse depths noise between 0.1 and 0.7.
fn noise(view: &Pinhole) -> Capture {
    let count = view.width_px as usize * view.height_px as usize;
    let seed = view.world_from_eye.translation.to_array().map(f64::to_bits).iter().fold(1, |a, b| a ^ b) | 1;
    let mut state = seed;
    let codes: Vec<u16> = (0..count)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state as u16
        })
        .collect();
    let normal = u32::from(u16::from_le_bytes([127, 127])) << 16;
    Capture {
        camera: *view,
        ids: (1..=count as u32).map(|triangle| [triangle, normal]).collect(),
        colour: codes.iter().map(|code| [*code as u8, (*code >> 8) as u8, 7, 0]).collect(),
        rests: vec![[0; 2]; count],
        hides: Vec::new(),
        depth: codes.iter().map(|&code| (0.1 + f32::from(code) * 1e-5) * view.near_m as f32).collect(),
        ends: Vec::new(),
        gpu_s: None,
    }
}

/// Only who knows the word may connect.
pub fn secret() -> Access {
    Access { token: Some("secret".to_owned()), ..Access::default() }
}

/// A server that looks twice, in images of 32x32.
pub fn config() -> Config {
    let web = Some("/nowhere".into());
    Config { port: 0, images: 2, image_size_px: 32, update_hz: 20.0, web, anticipation: false, ..Config::default() }
}

pub async fn start(config: Config, scene: Scene, delay: Duration) -> Running {
    vantage_server::serve(config, Arc::new(scene), Box::new(NoiseImager { delay })).await.expect("serve")
}

/// One request, without a client library: status line, headers and body as text.
pub async fn request(running: &Running, path: &str, headers: &str) -> String {
    request_at(running.addr, path, headers).await
}

/// The same of a server that may be loading.
pub async fn request_at(addr: SocketAddr, path: &str, headers: &str) -> String {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let mut stream = TcpStream::connect(addr).await.expect("connect");
    let head = format!("GET {path} HTTP/1.1\r\nHost: {addr}\r\nConnection: close, Upgrade\r\n{headers}\r\n");
    stream.write_all(head.as_bytes()).await.expect("write");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).await.expect("read");
    String::from_utf8_lossy(&answer).into_owned()
}

pub type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

pub async fn socket(running: &Running) -> Socket {
    connect_async(format!("ws://{}/ws", running.addr)).await.expect("websocket").0
}

/// A client that decodes and acknowledges, on either clock.
pub struct Client {
    pub socket: Socket,
    pub session: ClientSession,
    pub held: Held,
    pub welcome: Option<Welcome>,
    pub updates: Vec<UpdateHead>,
    /// Every byte received, in order.
    pub heard: Vec<u8>,
    pub advanced_to_s: f64,
    /// Where a follower was told that the presenter's eye is.
    pub presenter: Option<Rigid>,
    /// What objects are called, as it asked.
    pub names: Vec<(u16, String)>,
    /// What the server said last that it makes.
    pub inventory: protocol::Inventory,
    started: Instant,
}

impl Client {
    pub async fn connect(running: &Running, clock: Clock) -> Client {
        Client::with(running, ClientConfig::new(clock, VIEW)).await
    }

    /// Presents or follows, in real time.
    pub async fn of_audience(running: &Running, role: Role) -> Client {
        Client::with(running, ClientConfig { role, ..ClientConfig::new(Clock::Wall, VIEW) }).await
    }

    pub async fn with(running: &Running, config: ClientConfig) -> Client {
        Client::over(socket(running).await, config)
    }

    /// Over a socket that is open.
    pub fn over(socket: Socket, config: ClientConfig) -> Client {
        Client {
            socket,
            session: ClientSession::new(config, 0.0),
            held: Held::default(),
            welcome: None,
            updates: Vec::new(),
            heard: Vec::new(),
            advanced_to_s: f64::NEG_INFINITY,
            presenter: None,
            names: Vec::new(),
            inventory: protocol::Inventory::default(),
            started: Instant::now(),
        }
    }

    pub fn now_s(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    pub fn start_eye(&self) -> Rigid {
        self.welcome.as_ref().expect("welcomed").start_world_from_eye
    }

    fn take_events(&mut self, now_s: f64) {
        while let Some(event) = self.session.poll_event() {
            match event {
                ClientEvent::Welcome(welcome) => self.welcome = Some(*welcome),
                ClientEvent::Presenter(world_from_eye, _) => self.presenter = Some(world_from_eye),
                ClientEvent::Name { object, name } => self.names.push((object, name)),
                ClientEvent::Inventory(inventory) => self.inventory = inventory,
                ClientEvent::Advanced { to_s } => self.advanced_to_s = to_s,
                ClientEvent::Update(received) => {
                    let update = decode_update(&received.bytes, &Limits::default()).expect("a sound update");
                    self.held.apply(&update).expect("an update that fits");
                    self.updates.push(received.head);
                    self.session.applied(update.number, self.held.digest(), now_s);
                }
            }
        }
    }

    async fn flush(&mut self) {
        while let Some(bytes) = self.session.poll_transmit() {
            if self.socket.send(Message::Binary(bytes.into())).await.is_err() {
                return;
            }
        }
    }

    /// Wall clock: runs until `done` or for `for_s` seconds; an error is how the session ended.
    pub async fn run(&mut self, for_s: f64, done: impl Fn(&Client) -> bool) -> Result<(), SessionError> {
        let end_s = self.now_s() + for_s;
        while !done(self) && self.now_s() < end_s {
            let now_s = self.now_s();
            self.session.handle_timeout(now_s)?;
            self.flush().await;
            let message = tokio::time::timeout(Duration::from_millis(20), self.socket.next()).await;
            let now_s = self.now_s();
            match message {
                Err(_) => {}
                Ok(Some(Ok(Message::Binary(bytes)))) => {
                    self.heard.extend(&bytes);
                    self.session.handle(&bytes, now_s)?;
                }
                Ok(Some(Ok(_))) => {}
                Ok(None | Some(Err(_))) => return Err(SessionError::Closed),
            }
            self.take_events(now_s);
            self.flush().await;
        }
        Ok(())
    }

    /// Wall clock: walks along x at 2 m/s for some seconds.
    pub async fn walk(&mut self, for_s: f64) -> Result<(), SessionError> {
        let (start, begun_s) = (self.start_eye(), self.now_s());
        while self.now_s() < begun_s + for_s {
            let mut pose = start;
            pose.translation.x += 2.0 * (self.now_s() - begun_s);
            let now_s = self.now_s();
            self.session.set_pose(pose, Motion::along(DVec3::X * 2.0), now_s);
            self.run(0.03, |_| false).await?;
        }
        Ok(())
    }

    /// Virtual clock without network delay: one step of time.
    pub async fn advance(&mut self, to_s: f64) -> Result<(), SessionError> {
        self.session.advance(to_s);
        self.flush().await;
        while self.advanced_to_s < to_s {
            let message = tokio::time::timeout(Duration::from_secs(20), self.socket.next()).await.expect("in time");
            match message {
                Some(Ok(Message::Binary(bytes))) => {
                    self.heard.extend(&bytes);
                    self.session.receive_virtual(bytes.to_vec(), |sent_at_s, _| sent_at_s)?;
                }
                Some(Ok(_)) => {}
                None | Some(Err(_)) => return Err(SessionError::Closed),
            }
            self.take_events(to_s);
        }
        self.session.run_until(to_s)?;
        self.take_events(to_s);
        self.flush().await;
        Ok(())
    }
}
