//! The command line of `vantage-server`.

use std::path::PathBuf;

use clap::Parser;
use protocol::codec::{ColourSteps, Profile};
use protocol::message::Clock;
use protocol::{Look, Tone};
use scene::load::Up;

use crate::coding::CodingRule;
use crate::config::{ComparesOn, Config};
use crate::discretize::Discretization;
use crate::discretize::placement::Placement;
use crate::limits::ServerLimits;
use crate::port_options::PortOptions;
use crate::publish::options::PublishOptions;
use crate::relay::options::RelayOptions;
use crate::serving::options::FolderOptions;
use crate::serving::within::{SceneFile, Within};
use crate::source;
use crate::uploads::options::UploadOptions;

/// Renders a scene as depth images and streams their samples to viewers.
#[derive(Debug, Clone, Parser)]
#[command(name = "vantage-server", version, after_help = format!("{EXAMPLES}{}", manual::HELP), args_conflicts_with_subcommands = true)]
pub struct Options {
    /// A scene file (glTF, GLB, OBJ, PLY, STL) or the name of a built-in scene; without it, a built-in moving one. NAME+FILE: the model of a
    /// file as what reflects in a built-in scene, as in mirror-teapots+bunny.obj
    pub scene: Option<String>,
    /// Scenes beside it.
    #[command(flatten)]
    pub folder: FolderOptions,
    /// Scenes that people bring.
    #[command(flatten)]
    pub uploads: UploadOptions,
    /// Which scene of a glTF file is shown, by its name or its number from 0; without it, the one that the file says
    #[arg(long, value_name = "NAME")]
    pub file_scene: Option<String>,
    /// Which variant of a glTF file's materials is shown (KHR_materials_variants), by its name or its number from 0
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Which camera of a glTF file viewers begin at, by its name, its node's, or its number from 0; without it, the first
    #[arg(long, value_name = "NAME")]
    pub file_camera: Option<String>,
    /// Which axis is up in OBJ, PLY and STL files, which do not say
    #[arg(long, value_enum, default_value_t)]
    pub up: UpName,
    /// A file of cameras that viewers may ask for by their names: bent, split and merged, or past a silhouette; may be given several times
    #[arg(long, value_name = "FILE")]
    pub graph_camera: Vec<PathBuf>,
    /// Name the built-in scenes and exit
    #[arg(long)]
    pub list: bool,
    /// Which GPU draws, by its number or a part of its name; without it, the best one
    #[arg(long, value_name = "NAME")]
    pub gpu: Option<String>,
    /// Name the GPUs that there are, with their numbers, and exit
    #[arg(long)]
    pub list_gpus: bool,
    /// Its port, and who may connect.
    #[command(flatten)]
    pub port: PortOptions,
    /// What goes beyond this host.
    #[command(flatten)]
    pub publish: PublishOptions,
    /// How the images of a set are made: conventional, depth-peeling, non-redundant, neighbourhood, surface, covered, footprint, visibility,
    /// visibility-plain
    #[arg(long, default_value_t)]
    pub discretization: Discretization,
    /// Where the images of a set are taken from; probes: as many as are of use, at most --images
    #[arg(long, value_enum, default_value_t)]
    pub placement: Placement,
    /// Whether objects that many share the shape of are shown by one image for all
    #[arg(long, value_enum, default_value_t)]
    pub relief: ReliefName,
    /// Whether what is less as its triangles than as samples is sent so, once
    #[arg(long, value_enum, default_value_t)]
    pub bodies: BodiesName,
    /// Whether a viewer who stands still, in a scene that stands still or that he paused, is sent his own view, pixel by pixel
    #[arg(long, value_enum, default_value_t)]
    pub rest: RestName,
    /// Whether what a viewer will need next is sent while nobody needs anything: the other sides of what he turns, the places that he may
    /// walk to
    #[arg(long, value_enum, default_value_t)]
    pub anticipation: AnticipationName,
    /// Where views of the scene and of what clients hold are compared: faster is the GPU, unless it is only software
    #[arg(long, value_enum, default_value_t)]
    pub compare_on: ComparesOn,
    /// Images a set
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(1..=Config::MAX_IMAGES as u64))]
    pub images: u64,
    /// An image has as many pixels as a square of this side, in the shape of the view
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(
        i64::from(*Config::IMAGE_SIZES_PX.start())..=i64::from(*Config::IMAGE_SIZES_PX.end())))]
    pub image_size: u32,
    /// Makes the scene larger or smaller about the world's origin
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    pub scale: f64,
    /// Shows the scene as it is so many seconds into its animation, standing still
    #[arg(long, value_name = "SECONDS", value_parser = moment)]
    pub hold: Option<f64>,
    /// How samples are coded: by the path that is measured, for speed, or for size
    #[arg(long, value_enum, default_value_t)]
    pub profile: ProfileName,
    /// How exactly base colours are sent
    #[arg(long, value_enum, default_value_t)]
    pub colour: ColourName,
    /// How colour is shown: by materials and light from all around, plainly, or as base colour under constant light
    #[arg(long, value_enum, default_value_t)]
    pub look: LookName,
    /// The light from all around, a Radiance (.hdr) or OpenEXR (.exr) file; without it, a neutral studio. Of the full look
    #[arg(long, value_name = "FILE")]
    pub environment: Option<PathBuf>,
    /// From light to the picture. Of the full look
    #[arg(long, value_enum, default_value_t)]
    pub tone: ToneName,
    /// Brighter by so many stops, or darker. Of the full look
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_hyphen_values = true, value_parser = stops)]
    pub exposure: f32,
    /// Real time, or time that advances only with the clients' stamps
    #[arg(long, value_enum, default_value_t)]
    pub clock: ClockName,
    /// Ticks a second of each session at most
    #[arg(long, default_value_t = 10.0, value_parser = update_rate)]
    pub update_hz: f64,
    /// Tell Agones, which keeps servers on Kubernetes, how this one is; by itself where AGONES_SDK_HTTP_PORT says where
    #[arg(long)]
    pub agones: bool,
    /// Let Agones end this server once nobody has been here for so long
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = positive)]
    pub agones_idle_s: f64,
    /// What to be in place of a server.
    #[command(subcommand)]
    pub command: Option<Command>,
}

const EXAMPLES: &str = "Examples:\n  \
    vantage-server pillars                              a built-in scene, at http://127.0.0.1:8080 where its page is built in\n  \
    vantage-server engine.glb --web target/web/serve    a file, with the page of a folder\n  \
    vantage-server --scenes models --allow-uploads      every scene of a folder, and those that people bring\n  \
    vantage-server --config /etc/vantage/vantage-server.toml --print-config\n\n\
    Exit codes: 0 ended as asked, 1 failed, 2 wrong usage, 69 no graphics adapter.\n\
    Logging: RUST_LOG=debug also shows why each set of images is made.\n";

/// What a server can be in place of one.
#[derive(Debug, Clone, clap::Subcommand)]
pub enum Command {
    /// Pass on what a server publishes
    #[command(about)]
    Relay(RelayOptions),
}

/// `--up`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum UpName {
    /// Models.
    #[default]
    Y,
    /// Maps, scans, machine parts.
    Z,
}

impl From<UpName> for Up {
    fn from(name: UpName) -> Up {
        match name {
            UpName::Y => Up::Y,
            UpName::Z => Up::Z,
        }
    }
}

/// `--bodies`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum BodiesName {
    /// Where triangles are less than samples.
    #[default]
    Auto,
    /// Everything is sampled.
    Off,
}

/// `--relief`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ReliefName {
    /// Where one or two images hold nearly all of a shape, its triangles would not be less, and viewers are far enough.
    #[default]
    Auto,
    /// Every object is sampled by itself.
    Off,
}

/// `--rest`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum RestName {
    /// Within half a second: what is seen then is the scene.
    #[default]
    Exact,
    /// What was sampled for other views has to do.
    Off,
}

/// `--anticipation`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum AnticipationName {
    /// Until all that is in reach is held, or most of the client's budget is full.
    #[default]
    On,
    /// Who stands still is sent nothing.
    Off,
}

/// `--profile`.
#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
pub enum ProfileName {
    /// Whichever brings an update to its viewer sooner: dense on paths of less than 0.8 Mbit/s.
    #[default]
    Auto,
    /// Coded and decoded quickly.
    Fast,
    /// A sixth fewer bytes, four to eighteen times slower.
    Dense,
}

/// `--colour`.
#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
pub enum ColourName {
    /// As they are.
    #[default]
    Lossless,
    /// Off by 1 in luma and 2 in chroma at most: 48 dB.
    Fine,
    /// Off by 2 in luma and 4 in chroma at most: 42 dB.
    Coarse,
}

impl From<ProfileName> for Option<Profile> {
    fn from(name: ProfileName) -> Option<Profile> {
        match name {
            ProfileName::Auto => None,
            ProfileName::Fast => Some(Profile::Fast),
            ProfileName::Dense => Some(Profile::Dense),
        }
    }
}

impl From<ColourName> for ColourSteps {
    fn from(name: ColourName) -> ColourSteps {
        match name {
            ColourName::Lossless => ColourSteps::Lossless,
            ColourName::Fine => ColourSteps::Fine,
            ColourName::Coarse => ColourSteps::Coarse,
        }
    }
}

/// `--look`.
#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
pub enum LookName {
    /// Full of scene files, plain of built-in scenes.
    #[default]
    Auto,
    /// Metallic and rough materials under an environment, and the scene's lights.
    Full,
    /// Base colours under the scene's lights, or a default rig.
    Plain,
    /// Base colour under constant light.
    Flat,
    /// The same, with a directional light on steep faces.
    FlatLit,
}

/// `--tone`.
#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
pub enum ToneName {
    /// The Khronos PBR neutral tone mapper: base colours stay what they are.
    #[default]
    Neutral,
    /// The curve of films.
    Aces,
    /// None: what is brighter than white is white.
    None,
}

impl From<ToneName> for Tone {
    fn from(name: ToneName) -> Tone {
        match name {
            ToneName::Neutral => Tone::Neutral,
            ToneName::Aces => Tone::Aces,
            ToneName::None => Tone::Cut,
        }
    }
}

/// `--clock`.
#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
pub enum ClockName {
    /// Real time.
    #[default]
    Wall,
    /// Time advances with the clients' stamps.
    Virtual,
}

impl LookName {
    /// Of a scene, by what it was asked for as.
    fn of(self, scene: Option<&str>) -> Look {
        match self {
            LookName::Auto if scene.is_some_and(source::is_file) => Look::Full,
            LookName::Auto | LookName::Plain => Look::Plain,
            LookName::Full => Look::Full,
            LookName::Flat => Look::Flat,
            LookName::FlatLit => Look::FlatLit,
        }
    }
}

impl From<ClockName> for Clock {
    fn from(name: ClockName) -> Clock {
        match name {
            ClockName::Wall => Clock::Wall,
            ClockName::Virtual => Clock::Virtual,
        }
    }
}

impl Options {
    /// As plain values; `Err` names options that do not go together.
    pub fn config(&self) -> Result<Config, String> {
        let port = self.port.config()?;
        Ok(Config {
            discretization: self.discretization,
            placement: self.placement,
            relief: self.relief == ReliefName::Auto,
            bodies: self.bodies == BodiesName::Auto,
            rest: self.rest == RestName::Exact,
            anticipation: self.anticipation == AnticipationName::On,
            images: self.images as usize,
            image_size_px: self.image_size,
            compares_on: self.compare_on,
            coding: CodingRule { profile: self.profile.into(), colour: self.colour.into() },
            look: self.look(),
            environment: None,
            tone: self.tone.into(),
            exposure: 2f32.powf(self.exposure),
            clock: self.clock.into(),
            update_hz: self.update_hz,
            publish: self.publish.broker(),
            thumbnails: self.folder.scenes.is_some() || self.uploads.allow_uploads,
            limits: ServerLimits { scenes: self.folder.limits(), uploads: self.uploads.limits(), ..port.limits },
            ..port
        })
    }

    /// Of the scene.
    pub fn look(&self) -> Look {
        self.look.of(self.scene.as_deref())
    }

    /// The same for another scene file.
    pub fn of_file(&self, file: &SceneFile) -> Options {
        let scene = Some(file.path.to_string_lossy().into_owned());
        let Within { scene: file_scene, variant } = file.within.clone();
        Options { scene, file_scene, variant, file_camera: None, graph_camera: Vec::new(), ..self.clone() }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("a positive number is needed".to_owned()),
    }
}

/// More than thirty stops show nothing but black or white.
fn stops(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value.abs() <= 30.0 => Ok(value),
        _ => Err("a number from -30 to 30 is needed".to_owned()),
    }
}

fn moment(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|time_s: &f64| time_s.is_finite())
        .ok_or_else(|| "a number of seconds is needed".to_owned())
}

/// Ticks of more than 240 Hz or less than one in ten seconds are typing errors.
fn update_rate(text: &str) -> Result<f64, String> {
    match positive(text) {
        Ok(value) if (0.1..=240.0).contains(&value) => Ok(value),
        _ => Err("a number from 0.1 to 240 is needed".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::broker::Broker;

    #[test]
    fn the_command_line_is_sound() {
        use clap::CommandFactory;
        Options::command().debug_assert();
    }

    #[test]
    fn other_machines_need_a_token() {
        let open = Options::parse_from(["vantage-server", "--bind", "0.0.0.0"]);
        assert!(open.config().is_err());
        let closed = Options::parse_from(["vantage-server", "--bind", "0.0.0.0", "--token", "secret"]);
        assert!(closed.config().is_ok());
    }

    #[test]
    fn a_relay_has_a_port_and_a_broker() {
        let parse = |line: &str| Options::try_parse_from(line.split_whitespace());
        let Some(Command::Relay(relay)) =
            parse("vantage-server relay --subscribe nats://host --port 9").expect("sound").command
        else {
            panic!("no relay")
        };
        assert_eq!((relay.port.port, relay.broker().channel.as_str()), (9, Broker::CHANNEL));
        assert!(relay.port.config().is_ok());
        for wrong in
            ["relay", "relay --subscribe http://host", "pillars relay --subscribe nats://host", "--publish host"]
        {
            assert!(parse(&format!("vantage-server {wrong}")).is_err(), "{wrong}");
        }
        let server = parse("vantage-server pillars --publish nats://host --channel lab").expect("sound").config();
        let published = server.expect("sound").publish.expect("published");
        assert_eq!((published.address.to_string().as_str(), published.channel.as_str()), ("nats://host:4222", "lab"));
        assert!(parse("vantage-server").expect("sound").config().expect("sound").publish.is_none());
    }

    #[test]
    fn a_folder_of_scenes_has_limits_and_is_not_published() {
        let parse = |line: &str| Options::try_parse_from(line.split_whitespace());
        let options = parse("vantage-server pillars --scenes . --max-scenes 3 --scene-memory 5 --scene-idle-s 0.5");
        let limits = options.expect("sound").config().expect("sound").limits.scenes;
        assert_eq!((limits.open, limits.bytes, limits.idle.as_millis()), (3, 5 << 20, 500));
        assert!(parse("vantage-server --scenes . --publish nats://host").is_err());
    }

    #[test]
    fn a_certificate_comes_with_its_key_or_is_made() {
        let parse = |line: &str| Options::try_parse_from(line.split_whitespace());
        assert!(parse("vantage-server --tls-cert a.pem --tls-key b.pem").is_ok());
        assert!(parse("vantage-server --tls-self-signed").is_ok());
        for wrong in ["--tls-cert a.pem", "--tls-key b.pem", "--tls-cert a.pem --tls-key b.pem --tls-self-signed"] {
            let error = parse(&format!("vantage-server {wrong}")).expect_err(wrong).to_string();
            assert!(error.contains("--tls-cert") && error.contains("--tls-"), "{error}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for wrong in [
            ["--images", "0"],
            ["--image-size", "9999"],
            ["--scale", "-1"],
            ["--scale", "NaN"],
            ["--update-hz", "0"],
            ["--hold", "inf"],
            ["--allow-origin", "*"],
            ["--allow-origin", "https://host/path"],
        ] {
            assert!(Options::try_parse_from(["vantage-server"].iter().chain(&wrong)).is_err(), "{wrong:?}");
        }
    }
}
