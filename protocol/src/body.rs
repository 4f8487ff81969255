//! [`Body`]: triangles of an object as they are, where they are less than samples of it, and the bones that bend them.
//!
//! A sample shows what one image saw. A figure that runs is seen otherwise by each, and so would be sent again at every update; its triangles, what
//! its bones do and its colours are sent once, and then it is drawn at any moment as it is then. Colours lie in the patch that the body goes with
//! ([`crate::Purpose::Body`]): an image by texture coordinates.

use glam::{Mat3, Vec3};

/// See the module. Space: the body's own, metres, which instances place in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Of each vertex, in steps from [`Body::least`].
    pub positions: Vec<[u16; 3]>,
    /// The least corner of the box of all vertices before they are bent.
    pub least: [f32; 3],
    /// One step along each axis, in metres.
    pub step: [f32; 3],
    /// Of each vertex, octahedral, of [`Body::NORMAL_STEPS`] steps along each axis; none where each triangle is shaded as the plane that it is.
    pub normals: Vec<[u16; 2]>,
    /// Texture coordinates of each vertex, in steps from [`Body::least_uv`]; none where the image is one texel.
    pub uvs: Vec<[u16; 2]>,
    /// The least texture coordinates.
    pub least_uv: [f32; 2],
    /// One step along each.
    pub step_uv: [f32; 2],
    /// What each vertex's colour is multiplied by, linear RGB; none where that is white everywhere.
    pub colours: Vec<[u8; 3]>,
    /// Three a triangle, counter-clockwise as seen from its front.
    pub indices: Vec<u32>,
    /// Whether triangles are seen from behind, too.
    pub double_sided: bool,
    /// Whether nothing shows where the image has no sample; else nothing shows the image there.
    pub cut_out: bool,
    /// How the image goes on past its edges, along u and v.
    pub wrap: [Wrap; 2],
    /// Whether the image is shown without blending texels where it is magnified.
    pub nearest: bool,
    /// Smallest and largest corner of what it fills at any time.
    pub bounds: [[f32; 3]; 2],
    /// `None` of what is rigid.
    pub skin: Option<Skin>,
}

/// How an image goes on past its edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrap {
    /// It repeats.
    Repeat,
    /// It repeats mirrored.
    Mirror,
    /// The edge goes on.
    Clamp,
}

/// Which bones move a vertex, by four shares (glTF 2.0, 3.7.3), and what the bones do.
#[derive(Debug, Clone, PartialEq)]
pub struct Skin {
    /// Of each vertex.
    pub bones: Vec<[u8; 4]>,
    /// The share of each, of 65,535 in all: 255 would be off by a five hundredth of how far two bones part.
    pub shares: Vec<[u16; 4]>,
    /// What the bones do.
    pub clip: Clip,
}

/// Affine maps of bones, evenly over a time that repeats; between two moments each number changes evenly.
#[derive(Debug, Clone, PartialEq)]
pub struct Clip {
    /// How long it takes until it begins again, in seconds of scene time, from its time 0; positive.
    pub period_s: f64,
    /// How many bones there are.
    pub bones: u16,
    /// A step of what is multiplied.
    pub linear_step: f32,
    /// A step of what is added, in metres.
    pub offset_step: f32,
    /// The rows of `body_now_from_body_at_rest`, [`Clip::NUMBERS`] a bone, of each bone in order, of each moment from the first to the last, which are a
    /// period apart.
    pub codes: Vec<i32>,
}

/// A map of a bone: rows of a linear map with what is added as their last number.
pub type BoneRows = [[f32; 4]; 3];

impl Body {
    /// Steps of a normal's numbers from -1 to 1.
    pub const NORMAL_STEPS: u16 = 1022;
    /// Pixels of the images of all bodies that a client shows at most: 90 MB of textures.
    pub const MOST_PIXELS: u64 = 1 << 24;
    /// Bones of a body at most: their maps fit the least uniform buffer of WebGL2.
    pub const MOST_BONES: usize = 256;

    /// Where a vertex is before it is bent.
    pub fn position(&self, vertex: usize) -> Vec3 {
        let code = self.positions[vertex].map(f32::from);
        Vec3::from(self.least) + Vec3::from(code) * Vec3::from(self.step)
    }

    /// Whether the parts fit each other, and every number is finite.
    pub fn is_whole(&self) -> bool {
        let vertices = self.positions.len();
        let is_some = |length: usize| length == 0 || length == vertices;
        let lengths = is_some(self.normals.len()) && is_some(self.uvs.len()) && is_some(self.colours.len());
        let finite = [&self.least, &self.step, &self.bounds[0], &self.bounds[1]];
        let uv = self.least_uv.iter().chain(&self.step_uv);
        let numbers = finite.into_iter().flatten().chain(uv).all(|number| number.is_finite());
        let indices =
            self.indices.len().is_multiple_of(3) && self.indices.iter().all(|&index| (index as usize) < vertices);
        let normals = self.normals.iter().flatten().all(|&code| code <= Body::NORMAL_STEPS);
        lengths && numbers && indices && normals && self.skin.as_ref().is_none_or(|skin| skin.is_whole(vertices))
    }
}

impl Skin {
    fn is_whole(&self, vertices: usize) -> bool {
        let in_range = |bones: &[u8; 4]| bones.iter().all(|&bone| u16::from(bone) < self.clip.bones);
        let lengths = self.bones.len() == vertices && self.shares.len() == vertices;
        lengths && self.bones.iter().all(in_range) && self.clip.is_whole()
    }
}

impl Clip {
    /// Numbers of a bone's map.
    pub const NUMBERS: usize = 12;

    /// How many moments there are.
    pub fn moments(&self) -> usize {
        self.codes.len() / (Clip::NUMBERS * usize::from(self.bones)).max(1)
    }

    fn is_whole(&self) -> bool {
        let bones = usize::from(self.bones);
        let is_fit = (1..=Body::MOST_BONES).contains(&bones) && self.codes.len().is_multiple_of(Clip::NUMBERS * bones);
        // The largest numbers are finite, too, and their sum.
        let finite = [self.linear_step, self.offset_step].iter().all(|step| (step * 2.0 * i32::MAX as f32).is_finite());
        is_fit && self.moments() > 0 && finite && self.period_s > 0.0 && self.period_s.is_finite()
    }

    /// The maps of all bones at a moment of scene time.
    pub fn at(&self, scene_time_s: f64) -> Vec<BoneRows> {
        let numbers = Clip::NUMBERS * usize::from(self.bones);
        let last = self.moments().saturating_sub(1);
        let steps = scene_time_s.rem_euclid(self.period_s) / self.period_s * last as f64;
        let steps = if steps.is_finite() { steps } else { 0.0 };
        let before = (steps as usize).min(last);
        let after = (before + 1).min(last);
        let share = (steps - before as f64) as f32;
        let codes = |moment: usize| &self.codes[moment * numbers..(moment + 1) * numbers];
        let (bones_before, bones_after) =
            (codes(before).as_chunks::<{ Clip::NUMBERS }>().0, codes(after).as_chunks::<{ Clip::NUMBERS }>().0);
        let map = |(a, b): (&[i32; Clip::NUMBERS], &[i32; Clip::NUMBERS])| {
            let number = |at: usize| {
                let (a, b) = (a[at] as f32, b[at] as f32);
                let step = if at % 4 == 3 { self.offset_step } else { self.linear_step };
                (a + (b - a) * share) * step
            };
            std::array::from_fn(|row| std::array::from_fn(|column| number(4 * row + column)))
        };
        bones_before.iter().zip(bones_after).map(map).collect()
    }
}

/// How vertices are bent by maps of bones, as clients' shaders do: for tests, and for who checks what is sent.
pub fn bent(body: &Body, bones: &[BoneRows], vertex: usize) -> Vec3 {
    let p = body.position(vertex);
    let Some(skin) = &body.skin else { return p };
    let moved = |bone: u8| {
        let rows = bones[usize::from(bone)];
        let linear = Mat3::from_cols_array_2d(&rows.map(|[x, y, z, _]| [x, y, z])).transpose();
        linear * p + Vec3::from(rows.map(|row| row[3]))
    };
    let by = skin.bones[vertex].iter().zip(skin.shares[vertex]).filter(|(_, share)| *share > 0);
    by.map(|(&bone, share)| moved(bone) * (f32::from(share) / 65535.0)).sum()
}
