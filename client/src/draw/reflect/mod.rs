//! Mirrors and glass: rays that leave them are intersected with impostors, in fragment shaders.
//!
//! Method: Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, sections 3.2 and 4;
//! Popescu, Hayward, Rosen, Wyman, *Non-pinhole impostors* (2009), sections 3 to 5. Every pixel of the picture that shows a
//! reflector sends a ray out. Every impostor is drawn over the picture: each pixel walks its ray in it, and the depth test keeps
//! the nearest of what all impostors show. Then the rays go on, in rounds, or bring light:
//!
//! - off a **mirror**, smooth or rough (one bounce or two; after the last one a mirror shows its base colour, lit as a rough surface),
//! - into **glass** and out through its far side, which an impostor of its back faces shows; where light is totally reflected, once
//!   more within,
//! - through a sample that counts in part (below) to what lies behind.
//!
//! `shown = sRGB(tone(throughput * c))`; `c` is the light of the surface that is met, as everywhere (`common/surface_light.wgsl`), the sky, or
//! where none shines the light that shows as the background. The throughput is the base colour of each mirror, once, and
//! that of glass once. In the plain look there is no Fresnel term; in the full one mirrors whiten where light grazes, and glass mirrors the sky by
//! Schlick's approximation, lets in the rest, and shows behind it the background that is seen beside it. What leaves an object does not meet it
//! again. What a pixel mirrors of the sky is as wide as rays of its neighbours are apart.
//!
//! **Rough mirrors** (ours; in the full look). Of metals with a roughness from 0.1 to 0.5, each pixel sends one of sixteen rays of the lobe, and shows a mean
//! of what those around it on the same object bring (Keller, Heidrich, *Interleaved sampling*, 2001): one ray a pixel, as of a mirror. A ray stands for a sixteenth of
//! the lobe, so what it meets is averaged over as much, by the papers' mip-mapping (section 6.1). That mean, times what the lobe mirrors of even light, is
//! added to what else lights the surface. What such a ray meets is lit as if it were rougher by the lobe, or a lamp's picture on what bends would be met by
//! one ray of thousands. Less of what is mirrored arrives where a microfacet hides another; that is in the share alone, not in the rays.
//!
//! **Soft limits** (section 7.1). Where the ray of a single-pole camera grazes the surface, samples end in a jagged edge; there
//! they fade, and the rest of the ray goes on behind. The papers blend "with greater transparency"; here a sample has its full
//! weight from a grazing angle of [`FULL_FACING_DEG`] degrees on, and less in proportion to the sine of it.
//!
//! **Behind edges** (ours). A ray that meets nothing in an image of the surroundings passed where its camera does not see; it shows what the
//! image has in its direction, behind all that is met.
//!
//! **Normals** of reflectors come in 12 + 12 bits, or mirrors would have facets.
//!
//! **Edges** (ours). Where a pixel shows another colour than its neighbours on the reflector, four more rays leave its area, by normals
//! as they change from pixel to pixel, and the pixel is the mean of all: adaptive supersampling by contrast (Mitchell, *Generating
//! antialiased images at low sampling densities*, 1987). Software renderers do without ([`EdgeRays`]). The outlines of reflectors themselves stay as the picture has them.
//!
//! **Minification** (ours). The rays of two neighbouring pixels tell how much of the impostor a pixel shows, whatever lies between;
//! colours are averages over as much.
//!
//! **Tiles** (ours). Few pixels of most pictures have a ray that is followed, above all after the first round, and walks are drawn over tiles of
//! 8 x 8 pixels that hold some.
//!
//! A rigid object's impostor moves with it: rays are taken to where the object was at capture. A ray is 32 bytes;
//! without impostors or reflectors none of this exists.

mod inputs;
mod pass;
mod uniforms;
mod walks;

use protocol::{Effect, Material};

use crate::draw::impostors::{ImpostorKind, Placed, PlacedCamera};
pub(crate) use inputs::ReflectInputs;
pub(crate) use pass::ReflectPass;

/// From this angle between camera ray and surface on, in degrees, a sample of a single-pole camera counts fully: there its
/// footprint is six times as long as wide, and the next sample is likely to be missing.
pub const FULL_FACING_DEG: f64 = 10.0;

/// How many mirrors a ray may leave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bounces {
    /// A mirror shows a mirror without what that reflects.
    One,
    /// A mirror shows what a mirror reflects.
    Two,
}

/// How rays find what they meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Search {
    /// Walks with fine steps of a pixel at most.
    Whole,
    /// Of half a pixel.
    Half,
    /// Of a quarter of a pixel.
    Quarter,
    /// The papers' baseline: looked up by direction, as if every ray began at the impostor's camera. Impostors of graph cameras
    /// and the insides of glass are walked all the same.
    EnvironmentMap,
}

impl Search {
    fn fine_px(self) -> f32 {
        match self {
            Search::Whole | Search::EnvironmentMap => 1.0,
            Search::Half => 0.5,
            Search::Quarter => 0.25,
        }
    }
}

/// How rays walk in an impostor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Walk {
    /// In fine steps all the way: [`impostor::Method::Fine`].
    Fine,
    /// [`impostor::Method::Coarse`], by stretches of whole pixels.
    Coarse {
        /// The papers take 3 to 12 pixels, and measure with 6.
        coarse_px: u32,
    },
    /// [`impostor::Method::Hierarchy`].
    Hierarchy,
    /// First a sixteenth of the rays. Where those around a square of pixels meet one impostor, the others walk in it alone, between the
    /// depths that these met. What is thinner than the four pixels between, and stands before it, is missed.
    TwoPass,
}

/// Who sends four more rays from pixels that differ from their neighbours on a reflector: five times the passes, which a GPU leaves
/// early in most pixels, and a software renderer does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EdgeRays {
    /// Nobody.
    Never,
    /// All but software renderers.
    OnGpu,
    /// Everybody.
    Always,
}

/// How reflections are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// How many mirrors a ray may leave.
    pub bounces: Bounces,
    /// How rays find what they meet.
    pub search: Search,
    /// How they walk; all ways but the last find the same.
    pub walk: Walk,
    /// Fade samples of single-pole cameras that were seen at a grazing angle.
    pub fade: bool,
    /// Average colours over what a pixel shows.
    pub filter: bool,
    /// Whether pixels that differ from their neighbours on a reflector get more rays.
    pub edges: EdgeRays,
    /// Count steps, for a report: everything is walked twice.
    pub count_steps: bool,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            bounces: Bounces::Two,
            search: Search::Whole,
            walk: Walk::Hierarchy,
            fade: true,
            filter: true,
            edges: EdgeRays::OnGpu,
            count_steps: false,
        }
    }
}

/// Whether some of an impostor's samples may count in part.
fn fades(placed: &Placed, settings: Settings) -> bool {
    let is_object = matches!(placed.kind, ImpostorKind::Object(_));
    settings.fade && is_object && matches!(placed.camera, PlacedCamera::Spoc(_))
}

/// What the rays of a picture cost.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepSum {
    /// Stretches and steps, or look-ups.
    pub steps: f64,
    /// Walks: of a ray in an impostor, once for every round that it is followed.
    pub walks: f64,
}

/// Of what a picture may show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reflectors {
    pub mirrors: bool,
    pub glass: bool,
    /// Metals that show what is near as a blur.
    pub rough: bool,
}

impl Reflectors {
    /// `None` where no material is one; rough ones are under a sky alone.
    pub(crate) fn among(materials: &[Material], under_sky: bool) -> Option<Reflectors> {
        let any = |effect| materials.iter().any(|material| material.effect() == Some(effect));
        let (mirrors, glass) = (any(Effect::Mirror), any(Effect::Glass));
        let rough = under_sky && materials.iter().any(Material::is_rough_mirror);
        (mirrors || glass || rough).then_some(Reflectors { mirrors, glass, rough })
    }
}

#[cfg(test)]
mod tests {
    use protocol::Material;

    #[test]
    fn reflectors_are_the_same_in_wgsl() {
        let text = shaders::source("client/reflect/reflector.wgsl").expect("it is there");
        let number = |name: &str, value: f32| format!("{name} = {value:?};");
        for line in [
            number("MIRROR_METALLIC_MIN", Material::MIRROR_METALLIC),
            number("MIRROR_ROUGHNESS_MAX", Material::MIRROR_ROUGHNESS),
            number("GLASS_TRANSMISSION_MIN", Material::GLASS_TRANSMISSION),
            "material.metallic >= MIRROR_METALLIC_MIN && material.roughness <= MIRROR_ROUGHNESS_MAX".to_owned(),
            "material.transmission >= GLASS_TRANSMISSION_MIN".to_owned(),
        ] {
            assert!(text.contains(&line), "{line}");
        }
    }
}
