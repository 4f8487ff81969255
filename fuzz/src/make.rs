//! Values from any bytes: what a structured target feeds to the code under test. Bytes that ran out read as 0.

use std::sync::Arc;

use arbitrary::Unstructured;
use camera::{Camera, Motion, Path, Pinhole, Rigid, Spoc};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec3};
use protocol::body::{Clip, Skin, Wrap};
use protocol::ends::{MOST, with_level};
use protocol::inventory::Part;
use protocol::message::{Clock, Draws, Hello, Resume, Role, Shadows, VERSION, ViewSize, Welcome};
use protocol::staging::{Excerpt, Parts, Playback, SceneMotion, Section};
use protocol::{
    Body, ClientMessage, DepthImage, DepthScale, Edit, Instance, Inventory, Lighting, Look, Mask, Material, ObjectPose,
    ObjectShift, Patch, PatchId, Purpose, ServerMessage, Staging, Steps,
};

/// Numbers that code forgets.
const CORNERS: [f64; 12] =
    [0.0, -0.0, 1.0, -1.0, 0.5, 1e-300, 1e9, -1e9, f64::MAX, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];

/// Where values come from.
pub struct Source<'a>(Unstructured<'a>);

impl<'a> Source<'a> {
    pub fn new(bytes: &'a [u8]) -> Source<'a> {
        Source(Unstructured::new(bytes))
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        self.0.arbitrary().unwrap_or_default()
    }

    pub fn short(&mut self) -> u16 {
        self.0.arbitrary().unwrap_or_default()
    }

    pub fn word(&mut self) -> u64 {
        self.0.arbitrary().unwrap_or_default()
    }

    pub fn flag(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    /// From 0 to `end` less one, by one byte.
    pub fn below(&mut self, end: u8) -> u8 {
        self.byte() % end
    }

    /// A few bytes as they are.
    pub fn bytes(&mut self, most: u8) -> Vec<u8> {
        let length = usize::from(self.below(most)).min(self.0.len());
        self.0.bytes(length).unwrap_or_default().to_vec()
    }

    /// Any number; often a harmless one.
    pub fn number(&mut self) -> f64 {
        match self.byte() {
            byte @ 0..=11 => CORNERS[usize::from(byte)],
            12..=15 => self.0.arbitrary().unwrap_or_default(),
            byte => (f64::from(byte) - 128.0) / 16.0,
        }
    }

    /// A finite number of ordinary size.
    pub fn finite(&mut self) -> f64 {
        f64::from(self.short() as i16) / 256.0
    }

    /// From above 0 to 64.
    pub fn positive(&mut self) -> f64 {
        (f64::from(self.short()) + 1.0) / 1024.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    fn text(&mut self) -> String {
        String::from_utf8_lossy(&self.bytes(80)).into_owned()
    }

    /// Valid more often than not.
    pub fn pose(&mut self) -> Rigid {
        if self.below(8) == 7 {
            let rotation = DQuat::from_xyzw(self.number(), self.number(), self.number(), self.number());
            return Rigid { rotation, translation: self.vector() };
        }
        let eye = DVec3::new(self.finite(), self.finite(), self.finite());
        Rigid::look_along(eye, DVec3::new(self.finite(), self.finite(), 1.0))
    }

    fn affine(&mut self) -> DAffine3 {
        if self.below(8) == 7 {
            let matrix3 = DMat3::from_cols(self.vector(), self.vector(), self.vector());
            return DAffine3 { matrix3, translation: self.vector() };
        }
        let [scale, x, y, z] = [self.positive(), self.finite(), self.finite(), self.finite()];
        DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::from_rotation_y(x), DVec3::new(x, y, z))
    }

    /// A camera of an image of this size.
    fn camera(&mut self, size_px: (u32, u32)) -> Camera {
        let fov_y_rad = 0.05 + 3.0 * f64::from(self.byte()) / 256.0;
        let near_m = if self.below(16) == 15 { self.number() } else { self.positive() };
        let pinhole = Pinhole::symmetric(self.pose(), size_px, fov_y_rad, near_m);
        if self.below(4) != 3 {
            return Camera::Pinhole(pinhole);
        }
        let push_from_m = self.positive();
        let push_to_m = push_from_m + self.finite().abs();
        let [push_max_px, ramp_px] = [self.positive(), self.positive()];
        let pole_px = DVec2::new(self.finite(), self.finite());
        Camera::Spoc(Spoc { pinhole, pole_px, push_from_m, push_to_m, push_max_px, ramp_px })
    }

    /// A whole image of at most 24 x 12 pixels: dense or thin, smooth or noise.
    pub fn image(&mut self) -> DepthImage {
        let (width_px, height_px) = (1 + u32::from(self.below(24)), 1 + u32::from(self.below(12)));
        let camera = self.camera((width_px, height_px));
        let depth_scale = DepthScale { w_min: self.number() as f32, w_step: self.positive() as f32 };
        let mut mask = Mask::empty(width_px, height_px);
        let (thin, seed) = (self.byte(), self.word());
        // Bits of the noise that count: of none to all planes.
        let bits = self.byte();
        let mut noise = Noise(seed);
        for (y, x) in (0..height_px).flat_map(|y| (0..width_px).map(move |x| (y, x))) {
            let keeps = thin == 0 || noise.next() as u8 >= thin;
            mask.set(x, y, keeps);
        }
        let count = mask.count();
        let plane = |bit: u32| bits >> bit & 1 == 1;
        let mut noise = Noise(seed ^ 0x55);
        // Runs of alike samples, of a length that the seed decides.
        let run = 1 + (seed >> 56) as usize % 40;
        let mut values: Vec<u64> = Vec::with_capacity(count);
        (0..count).for_each(|at| values.push(if at % run == 0 { noise.next() } else { values[at - 1].rotate_left(1) }));
        let of = |value: &u64, shift: u32| (value >> shift) as u8;
        let material: Vec<u8> = values.iter().map(|value| if plane(0) { of(value, 0) } else { 0 }).collect();
        let ends = values
            .iter()
            .map(|value| (0..4).fold(0, |all, side| with_level(all, side, of(value, 3 * side as u32) as u16 & MOST)));
        let rests =
            values.iter().zip(&material).map(|(value, material)| if material & 3 == 1 { of(value, 9) } else { 0 });
        DepthImage {
            camera,
            depth_scale,
            depth: values.iter().map(|value| if plane(1) { *value as u16 } else { (*value >> 60) as u16 }).collect(),
            normal: values
                .iter()
                .map(|value| if plane(2) { [of(value, 8), of(value, 16)] } else { [127; 2] })
                .collect(),
            normal_rest: if plane(3) { rests.collect() } else { Vec::new() },
            ends: if plane(4) { ends.collect() } else { Vec::new() },
            colour: values.iter().map(|value| [of(value, 24), of(value, 32), of(value, 40)]).collect(),
            colour_rest: if plane(5) { values.iter().map(|value| of(value, 5) & 63).collect() } else { Vec::new() },
            object: values
                .iter()
                .map(|value| if plane(6) { (*value >> 48) as u16 } else { (*value >> 62) as u16 })
                .collect(),
            share: if plane(7) {
                values.iter().map(|value| 1 + of(value, 2) % DepthImage::WHOLE).collect()
            } else {
                Vec::new()
            },
            material,
            mask,
        }
    }

    pub fn purpose(&mut self) -> Purpose {
        let index = u16::from(self.below(6));
        match self.below(11) {
            0 => Purpose::Eye,
            1 => Purpose::Light(index),
            2 => Purpose::Impostor(index),
            3 => Purpose::Environment,
            4 => Purpose::Relief(index),
            5 => Purpose::Inside(index),
            6 => Purpose::Rest,
            7 => Purpose::Camera,
            8 => Purpose::Occluders,
            9 => Purpose::Layer(index as u8 % Purpose::LAYERS),
            _ => Purpose::Body,
        }
    }

    pub fn patch(&mut self, id: u32) -> Patch {
        let (purpose, capture_time_s) = (self.purpose(), self.finite());
        Patch { id: PatchId(id), purpose, capture_time_s, objects: self.object_poses(), image: self.image() }
    }

    /// Ids ascend, but for some.
    fn object_poses(&mut self) -> Vec<ObjectPose> {
        let mut object = 0;
        let count = self.below(5);
        let next = |source: &mut Source| {
            object += u16::from(source.below(4));
            ObjectPose { object, world_from_object: source.affine() }
        };
        self.many(count, next)
    }

    /// Ids ascend, but for some.
    fn shifts(&mut self) -> Vec<ObjectShift> {
        let mut object = 0;
        let count = self.below(5);
        let next = |source: &mut Source| {
            object += u16::from(source.below(4));
            let exponent = i16::from(source.byte()) - 128;
            let mut number = || source.word() as i32 >> source.below(32);
            let (matrix, translation) = ([0; 9].map(|_: i32| number()), [0; 3].map(|_: i32| number()));
            let steps = (Steps { exponent, counts: matrix }, Steps { exponent, counts: translation });
            ObjectShift { object, matrix: steps.0, translation: steps.1 }
        };
        self.many(count, next)
    }

    fn many<T>(&mut self, count: u8, make: impl FnMut(&mut Source<'a>) -> T) -> Vec<T> {
        let mut make = make;
        (0..count).map(|_| make(self)).collect()
    }

    /// Whole but for some.
    pub fn body(&mut self) -> Body {
        let vertices = 3 + self.below(40);
        let of = |is: bool| if is { vertices } else { 0 };
        let (has, bits) = (self.byte(), self.byte());
        let [least, step] = [0, 1].map(|_| [self.finite() as f32, self.positive() as f32, self.number() as f32]);
        let skin = (bits & 1 == 1).then(|| {
            let (bones, moments) = (1 + self.below(6), 1 + self.below(3));
            let numbers = u16::from(moments) * u16::from(bones) * Clip::NUMBERS as u16;
            let clip = Clip {
                period_s: self.positive(),
                bones: bones.into(),
                linear_step: self.positive() as f32,
                offset_step: self.number() as f32,
                codes: (0..numbers).map(|_| i32::from(self.short() as i16) << (bits >> 4)).collect(),
            };
            let bone = |source: &mut Source| [0; 4].map(|_: u8| source.below(bones));
            Skin {
                bones: self.many(vertices, bone),
                shares: self.many(vertices, |source| [0; 4].map(|_: u8| source.short())),
                clip,
            }
        });
        Body {
            positions: self.many(vertices, |source| [0; 3].map(|_: u8| source.short())),
            least,
            step,
            normals: self.many(of(has & 1 == 1), |source| [0; 2].map(|_: u8| source.short() % 1023)),
            uvs: self.many(of(has & 2 == 2), |source| [source.short(), source.short()]),
            least_uv: [self.finite() as f32; 2],
            step_uv: [self.positive() as f32; 2],
            colours: self.many(of(has & 4 == 4), |source| [0; 3].map(|_: u8| source.byte())),
            indices: (0..3 * self.below(30)).map(|_| u32::from(self.below(vertices))).collect(),
            double_sided: bits & 2 == 2,
            cut_out: bits & 4 == 4,
            wrap: [Wrap::Repeat, if has & 8 == 8 { Wrap::Mirror } else { Wrap::Clamp }],
            nearest: bits & 8 == 8,
            bounds: [[self.finite() as f32; 3], [self.positive() as f32; 3]],
            skin,
        }
    }

    /// An edit of a copy whose newest patch is `newest`, which a new one goes past.
    pub fn edit(&mut self, newest: &mut u32) -> Edit {
        let id = PatchId(u32::from(self.below(8)).min(*newest));
        match self.below(16) {
            0..=4 => {
                *newest += u32::from(self.below(16) > 0);
                Edit::Add(Box::new(self.patch(*newest)))
            }
            5 => Edit::Remove(id),
            6 => Edit::Delete(id, self.addresses()),
            7 => {
                let addresses = self.addresses();
                Edit::Trim(id, addresses.into_iter().map(|(x, y)| (x, y, self.below(6))).collect())
            }
            8 if self.flag() => Edit::Shift(self.shifts()),
            8 => Edit::Move(self.object_poses()),
            9 | 10 => Edit::Body(id, Arc::new(self.body())),
            11 => {
                let poses = self.object_poses();
                let instance = |pose| Instance { pose, tint: [0; 3].map(|_: u8| self.byte()) };
                Edit::Place(id, poses.into_iter().map(instance).collect())
            }
            12 => Edit::Withdraw(self.bytes(4).into_iter().map(u16::from).collect()),
            13 => {
                let material = Material { roughness: self.number() as f32, thin: self.flag(), ..Material::default() };
                Edit::Materials(vec![material; self.byte().into()])
            }
            14 => Edit::Light(Box::new(Lighting { sky: self.number() as f32, ..Lighting::default() })),
            _ if self.below(4) == 0 => Edit::Clear,
            _ => Edit::Join(self.word()),
        }
    }

    /// Ascending row by row, but for some.
    fn addresses(&mut self) -> Vec<(u16, u16)> {
        let (count, width) = (self.below(20), 1 + u16::from(self.below(40)));
        let mut place = 0;
        self.many(count, |source| {
            place += u16::from(source.below(60));
            (place % width, place / width)
        })
    }

    fn motion(&mut self) -> Motion {
        let vector = |source: &mut Source| Vec3::new(source.finite() as f32, source.number() as f32, 0.0);
        let path = if self.flag() { Path::Arc } else { Path::Line };
        let (velocity_world, turn_world) = (vector(self), vector(self));
        Motion { velocity_world, turn_world, path, fades_in_s: self.flag().then(|| self.number() as f32) }
    }

    fn view(&mut self) -> ViewSize {
        let [width_px, height_px] = [self.short(), self.short()].map(u32::from);
        ViewSize { width_px, height_px, fov_y_rad: self.number() }
    }

    pub fn draws(&mut self) -> Draws {
        let shadows = [Shadows::None, Shadows::Hard, Shadows::Soft][usize::from(self.below(3))];
        Draws { shadows, antialiased: self.flag(), occlusion_reach_m: self.number() }
    }

    fn role(&mut self) -> Role {
        match self.below(8) {
            0 => Role::Camera(self.text()),
            1 => Role::Camera("corner".to_owned()),
            2 => Role::Presenter(self.text()),
            3 => Role::Follower(self.text()),
            _ => Role::Viewer,
        }
    }

    /// A greeting that is refused now and then.
    pub fn hello(&mut self, clock: Clock) -> ClientMessage {
        let odd = self.below(16) == 15;
        ClientMessage::Hello(Box::new(Hello {
            version: if odd { self.short() } else { VERSION },
            clock,
            view: if odd { self.view() } else { ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.0 } },
            budget_bytes: self.word(),
            draws: self.draws(),
            role: self.role(),
            world_from_eye: self.flag().then(|| self.pose()),
            staging: self.flag().then(|| Box::new(self.staging())),
            resume: self.flag().then(|| Resume {
                secret: self.byte().into(),
                number: self.byte().into(),
                digest: self.word(),
            }),
        }))
    }

    fn playback(&mut self) -> Playback {
        let odd = self.below(8) == 7;
        let mut number = |usual: f64| if odd { self.number() } else { usual };
        Playback { from_s: number(1.0), scene_time_s: number(2.0), rate: number(0.5) }
    }

    /// How a scene is put before a client, and now and then how none is.
    pub fn staging(&mut self) -> Staging {
        let objects = |source: &mut Self| (0..source.below(4)).map(|_| source.short()).collect();
        let parts = match self.below(3) {
            0 => Parts::All,
            1 => Parts::But(objects(self)),
            _ => Parts::Only(objects(self)),
        };
        let section = self.flag().then(|| Section { normal_world: DVec3::Y, offset_m: self.number() });
        Staging { playback: self.playback(), excerpt: Excerpt { parts, section } }
    }

    pub fn client_message(&mut self, clock: Clock) -> ClientMessage {
        match self.below(13) {
            0 => self.hello(clock),
            1 => ClientMessage::View(self.view()),
            2..=4 => {
                let (seq, sampled_at_s) = (self.short().into(), self.number());
                ClientMessage::Pose { seq, sampled_at_s, world_from_eye: self.pose(), motion: self.motion() }
            }
            5 => {
                let [number, bytes_received] = [self.byte(), self.byte()].map(u64::from);
                ClientMessage::Ack { number, digest: self.word(), bytes_received }
            }
            6 => ClientMessage::Restart,
            7 => ClientMessage::Ping(self.byte().into()),
            8 => ClientMessage::Advance { to_s: self.number() },
            10 => ClientMessage::Inventory,
            11 => ClientMessage::Stages(Box::new(self.staging())),
            12 => ClientMessage::AskName { object: self.short() },
            _ => ClientMessage::Draws(self.draws()),
        }
    }

    pub fn welcome(&mut self) -> Welcome {
        let odd = self.below(16) == 15;
        let mut number = |usual: f64| if odd { self.number() } else { usual };
        Welcome {
            version: VERSION,
            bounds_min_world: [number(-1.0); 3],
            bounds_max_world: [number(1.0); 3],
            near_m: number(0.05),
            update_interval_s: number(0.1),
            scene_time_s: number(0.0),
            motion: SceneMotion::Loop { period_s: number(2.0) },
            scene_name: self.text(),
            start_world_from_eye: self.pose(),
            walk: self.flag(),
            secret: self.byte().into(),
            resumed: self.flag(),
            look: Look::Flat,
        }
    }

    /// Anything but an update.
    pub fn server_message(&mut self) -> ServerMessage {
        match self.below(14) {
            0 => ServerMessage::Welcome(self.welcome()),
            1..=5 => ServerMessage::Pong(self.below(6).into()),
            6 => ServerMessage::Advanced { to_s: self.number() },
            7 => ServerMessage::Goodbye { reason: self.text(), again: self.flag() },
            12 => ServerMessage::Inventory(self.inventory()),
            13 => ServerMessage::Name { object: self.short(), name: self.text() },
            _ => ServerMessage::Presenter { world_from_eye: self.pose(), playback: self.playback() },
        }
    }

    fn inventory(&mut self) -> Inventory {
        let mut inventory = Inventory::default();
        for _ in 0..self.below(4) {
            let made = self.flag().then(|| self.text());
            inventory.parts.push(Part { name: self.text(), made, why: self.text() });
        }
        inventory
    }
}

/// Numbers that look like chance, from one (splitmix64: Steele, Lea, Flood, 2014): samples are too many to take each from the bytes.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }
}
