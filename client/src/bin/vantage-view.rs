//! `vantage-view`: the native viewer, with a window or, with `--headless`, along a camera trace.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, ValueEnum};
use client::draw::antialiasing::Antialias;
use client::draw::effects::InTime;
use client::draw::frame;
use client::draw::occlusion::{self, Occlusion};
use client::draw::picture::PictureOptions;
use client::draw::shadow::{self, Shadows};
use client::draw::soft;
use client::draw::steady::FrameRate;
use client::receive::address;
use client::show::begin;
use client::show::headless::{self, HeadlessError, Way};
use client::show::window::{self, Renderer, WindowError};
use gpu::GpuError;
use network::Link;
use protocol::message::{Clock, Role};
use protocol::session::DEFAULT_BUDGET_BYTES;
use surface::Corners;
use vantage_client as client;

/// No adapter: `EX_UNAVAILABLE` of sysexits.h.
const EXIT_NO_ADAPTER: u8 = 69;
const EXAMPLES: &str = "Examples:\n  \
    vantage-view --server wss://HOST:8080 --token SECRET    a window\n  \
    vantage-view --headless --trace walk.txt --out frames   pictures along a path\n\n\
    Exit codes: 0 ended as asked, 1 failed, 2 wrong usage, 69 no graphics adapter.\n\n\
    Keys: W A S D or arrows move, Q E down and up, Shift is faster, R back to the start, M walks or turns, Home 1 2 3 show all of it, + - change the speed, P hides the panel, F follows the \
    presenter again, K or Space plays or pauses what moves, X hides the part at the pointer, U shows all, Enter goes there, C lets one through walls.\n";

/// Looks around in the scene of a Vantage server.
#[derive(Debug, Parser)]
#[command(name = "vantage-view", version, after_help = format!("{EXAMPLES}{}", manual::HELP))]
#[command(group(clap::ArgGroup::new("shown").args(["trace", "camera"]).multiple(true)))]
struct Arguments {
    /// The server: ws://HOST:PORT, HOST:PORT, over TLS wss://HOST:PORT, or with a path ws://HOST:PORT/ws
    #[arg(long, default_value = "ws://127.0.0.1:8080")]
    server: String,
    /// What the server must be told
    #[arg(long, env = "VANTAGE_TOKEN", hide_env_values = true)]
    token: Option<String>,
    /// Over TLS: trust the certificates in this PEM file too, of a server without an authority or of an authority
    #[arg(long, value_name = "FILE")]
    tls_ca: Option<PathBuf>,
    /// Which of the server's scenes, where it has several
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
    /// Width and height of the picture [default: 1280x720; headless: 640x360]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// Vertical field of view in degrees
    #[arg(long, default_value_t = 60.0, value_parser = field_of_view)]
    fov_y_deg: f64,
    /// Show the image of one of the server's cameras, by its name, instead of looking around
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Let others follow, by this name
    #[arg(long, value_name = "NAME", conflicts_with = "camera")]
    present: Option<String>,
    /// See what who presents by this name sees; whoever moves looks around in that, F follows again
    #[arg(long, value_name = "NAME", conflicts_with_all = ["camera", "present"])]
    follow: Option<String>,
    /// Memory for what is held, in MiB; what was least recently visible goes first
    #[arg(long, default_value_t = DEFAULT_BUDGET_BYTES >> 20, value_name = "MIB")]
    budget_mib: u64,
    /// Which graphics interface the window uses
    #[arg(long, value_enum, default_value_t)]
    renderer: RendererName,
    /// Where the corners of a sample's quad come from
    #[arg(long, value_enum, default_value_t)]
    corners: CornersName,
    /// In a window: hold the frame rate where drawing all that is held takes too long, or draw it all for each frame
    #[arg(long, value_enum, default_value_t)]
    frame_rate: FrameRateName,
    /// Leave what no sample covers empty instead of filling it
    #[arg(long)]
    no_fill: bool,
    /// Show what no sample covers in magenta
    #[arg(long)]
    mark_uncovered: bool,
    /// Several samples a pixel, so that outlines are smooth: always, as long as frames come in time, or never [default: measured, on without a
    /// window]
    #[arg(long, value_enum)]
    antialias: Option<AntialiasName>,
    /// Darken what little ambient light reaches [default: graph, as long as frames come in time; none without a window]
    #[arg(long, value_enum)]
    occlusion: Option<OcclusionName>,
    /// With --occlusion: how far away what takes ambient light may be, in metres
    #[arg(long, value_name = "M", default_value_t = occlusion::Settings::default().reach_m)]
    occlusion_reach: f64,
    /// Keep light from what something held stands before [default: soft, as long as frames come in time; none without a window]
    #[arg(long, value_enum)]
    shadows: Option<ShadowsName>,
    /// Stops of exposure beside the server's: each doubles all light
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = begin::stops)]
    exposure: f32,
    /// For soft shadows a light is N x N points
    #[arg(long, value_name = "N", default_value_t = soft::Settings::default().points,
          value_parser = clap::value_parser!(u32).range(1..=i64::from(soft::Settings::MAX_POINTS)))]
    soft_points: u32,
    /// How it is found out which of them are seen: warp, maps, march, or measured (what frames come faster with) [default: measured, warp without a window]
    #[arg(long, value_name = "METHOD")]
    soft_method: Option<soft::Choice>,
    /// How many of them a frame draws: measured (as many as frames come in time with), all, or a number [default: measured, all without a window]
    #[arg(long, value_name = "PACE")]
    soft_pace: Option<soft::Pace>,
    /// Emulate a network: rtt=MS,jitter=MS,mbit=MBIT_PER_S,stall=MS@PERIOD_MS,loss=PERCENT,queue=MS,blackout=MS@BEGIN_MS,fading=SPREAD@MS, each as needed
    #[arg(long, value_name = "LINK")]
    network: Option<Link>,
    /// Without a window: follow --trace, or show --camera, and write pictures and stats.json to --out
    #[arg(long, requires = "shown", requires = "out")]
    headless: bool,
    /// A camera trace (lines of: px py pz rx ry rz t_ms), or auto for an orbit that frames the scene
    #[arg(long, value_name = "FILE", requires = "headless")]
    trace: Option<PathBuf>,
    /// Folder for frame_00000.png and so on, and stats.json
    #[arg(long, value_name = "DIR", requires = "headless")]
    out: Option<PathBuf>,
    /// Real time, or time that advances in lock-step with the server, which must run with --clock virtual too
    #[arg(long, value_enum, default_value_t, requires = "headless")]
    clock: ClockName,
    /// Pictures a second of the trace's time
    #[arg(long, default_value_t = 60.0, value_parser = rate, requires = "headless")]
    fps: f64,
    /// How many pictures [default: the whole trace]
    #[arg(long, requires = "headless")]
    frames: Option<usize>,
    /// Hold the first picture until the first update has arrived; with "false" the first pictures may be empty
    #[arg(long, default_value_t = true, action = clap::ArgAction::Set, requires = "headless")]
    warm_up: bool,
    /// Seed of the emulated network's jitter on the virtual clock
    #[arg(long, default_value_t = 1, requires = "headless")]
    seed: u64,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum RendererName {
    /// The best there is.
    #[default]
    Auto,
    Vulkan,
    Metal,
    Dx12,
    Gl,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum CornersName {
    /// Neighbours' planes, averaged within a surface.
    #[default]
    Averaged,
    /// A second image, offset by half a pixel (only where the server sends one).
    Offset,
    /// Each sample's own plane.
    OwnPlane,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum FrameRateName {
    /// Frames show the last picture as the eye sees it by now, while the next one is drawn.
    #[default]
    Held,
    /// Each frame is drawn as a whole.
    Free,
}

#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum ClockName {
    /// Real time.
    #[default]
    Wall,
    /// Lock-step with the server.
    Virtual,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum AntialiasName {
    /// Four while the view changes, all that a pixel shows at rest.
    On,
    /// The same, but one while the view changes where frames do not come in time.
    Measured,
    /// One.
    Off,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum OcclusionName {
    /// Not at all.
    None,
    /// By what the view itself shows.
    Plain,
    /// By what cameras around see as well: steadier while the eye moves.
    Graph,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ShadowsName {
    /// Every light arrives everywhere.
    None,
    /// By maps of what each light sees, for the strongest four.
    Maps,
    /// The same, but soft ones of lights with an area.
    Soft,
}

impl Arguments {
    fn antialias(&self) -> Antialias {
        match self.antialias {
            Some(AntialiasName::On) => Antialias::On,
            Some(AntialiasName::Measured) => Antialias::Measured,
            Some(AntialiasName::Off) => Antialias::Off,
            None if self.headless => Antialias::On,
            None => Antialias::Measured,
        }
    }

    fn picture(&self) -> PictureOptions {
        let corners = match self.corners {
            CornersName::Averaged => Corners::Averaged,
            CornersName::Offset => Corners::OffsetImage,
            CornersName::OwnPlane => Corners::OwnPlane,
        };
        let frame = frame::Options {
            fill: !self.no_fill,
            antialias: self.antialias(),
            mark_uncovered: self.mark_uncovered,
            exposure: self.exposure.exp2(),
            ..frame::Options::default()
        };
        let in_time = InTime {
            shadows: self.shadows.is_none() && !self.headless,
            occlusion: self.occlusion.is_none() && !self.headless,
        };
        let occlusion = match self.occlusion {
            None if in_time.occlusion => Occlusion::Graph,
            None | Some(OcclusionName::None) => Occlusion::None,
            Some(OcclusionName::Plain) => Occlusion::Plain,
            Some(OcclusionName::Graph) => Occlusion::Graph,
        };
        let reach_m = self.occlusion_reach.max(0.0);
        let taps =
            if in_time.occlusion { occlusion::Settings::IN_TIME_TAPS } else { occlusion::Settings::default().taps };
        let occlusion = occlusion::Settings { occlusion, reach_m, taps };
        let shadows = match self.shadows {
            None if in_time.shadows => Shadows::Soft,
            None | Some(ShadowsName::None) => Shadows::None,
            Some(ShadowsName::Maps) => Shadows::Maps,
            Some(ShadowsName::Soft) => Shadows::Soft,
        };
        let choice = if self.headless { soft::Choice::default() } else { soft::Choice::Measured };
        let choice = self.soft_method.unwrap_or(choice);
        let pace = self.soft_pace.unwrap_or(if self.headless { soft::Pace::All } else { soft::Pace::Measured });
        let soft = soft::Settings { choice, pace, points: self.soft_points, ..soft::Settings::default() };
        let shadow = shadow::Settings { shadows, soft, ..Default::default() };
        let frame_rate = match self.frame_rate {
            FrameRateName::Held => FrameRate::Held,
            FrameRateName::Free => FrameRate::Free,
        };
        PictureOptions { corners, frame, occlusion, shadow, in_time, frame_rate }
    }

    fn budget_bytes(&self) -> u64 {
        self.budget_mib.saturating_mul(1 << 20)
    }

    fn role(&self) -> anyhow::Result<Role> {
        begin::role(self.camera.clone(), self.present.clone(), self.follow.clone()).map_err(anyhow::Error::msg)
    }

    fn server(&self) -> String {
        let server =
            self.scene.as_ref().map_or_else(|| self.server.clone(), |scene| address::with_scene(&self.server, scene));
        self.token.as_ref().map_or_else(|| server.clone(), |token| address::with_token(&server, token))
    }

    fn window(&self, role: Role) -> window::Options {
        window::Options {
            server: self.server(),
            tls_ca: self.tls_ca.clone(),
            size_px: self.size.unwrap_or((1280, 720)),
            fov_y_rad: self.fov_y_deg.to_radians(),
            budget_bytes: self.budget_bytes(),
            role,
            renderer: match self.renderer {
                RendererName::Auto => Renderer::Auto,
                RendererName::Vulkan => Renderer::Vulkan,
                RendererName::Metal => Renderer::Metal,
                RendererName::Dx12 => Renderer::Dx12,
                RendererName::Gl => Renderer::Gl,
            },
            picture: self.picture(),
            link: self.network,
        }
    }

    fn headless(&self, way: Way, role: Role) -> headless::Options {
        let mut options = headless::Options::new(self.server(), way);
        options.tls_ca.clone_from(&self.tls_ca);
        options.out.clone_from(&self.out);
        options.size_px = self.size.unwrap_or(options.size_px);
        options.fov_y_rad = self.fov_y_deg.to_radians();
        options.budget_bytes = self.budget_bytes();
        options.role = role;
        options.clock = match self.clock {
            ClockName::Wall => Clock::Wall,
            ClockName::Virtual => Clock::Virtual,
        };
        options.fps = self.fps;
        // Without a trace there is one picture to see.
        options.frames = self.frames.or(self.trace.is_none().then_some(1));
        options.link = self.network;
        options.seed = self.seed;
        options.warm_up = self.warm_up;
        options.picture = self.picture();
        options
    }
}

fn main() -> ExitCode {
    if let Some(ends) = manual::answered(Arguments::command()) {
        return ends;
    }
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| "warn,wgpu_hal=error,wgpu_core=error".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    let arguments = Arguments::parse();
    let result = if arguments.headless { run_headless(&arguments) } else { run_window(&arguments) };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("vantage-view: {error:#}");
            ExitCode::from(if is_without_adapter(&error) { EXIT_NO_ADAPTER } else { 1 })
        }
    }
}

fn is_without_adapter(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(HeadlessError::Gpu(GpuError::NoAdapter)))
        || matches!(error.downcast_ref(), Some(WindowError::Gpu(GpuError::NoAdapter)))
}

fn run_window(arguments: &Arguments) -> anyhow::Result<()> {
    Ok(window::run(arguments.window(arguments.role()?))?)
}

fn run_headless(arguments: &Arguments) -> anyhow::Result<()> {
    let trace = arguments.trace.as_deref().filter(|trace| trace.as_os_str() != "auto");
    let way = if let Some(trace) = trace {
        let text = std::fs::read_to_string(trace).map_err(|error| anyhow::anyhow!("{}: {error}", trace.display()))?;
        let trace = camera::Trace::parse(&text).map_err(|error| anyhow::anyhow!("{}: {error}", trace.display()))?;
        Way::Trace(trace)
    } else {
        Way::Auto
    };
    let options = arguments.headless(way, arguments.role()?);
    let gpu = gpu::Gpu::block_on(gpu::Gpu::new_headless()).map_err(HeadlessError::from)?;
    let bar = indicatif::ProgressBar::no_length();
    bar.set_style(indicatif::ProgressStyle::with_template("{bar:40} {pos}/{len} pictures, {msg}")?);
    bar.set_message("connecting");
    bar.tick();
    let summary = headless::run_on(&gpu, &options, &mut |drawn| {
        bar.set_length(drawn.of as u64);
        bar.set_position(drawn.row.frame as u64 + 1);
        bar.set_message(format!("{:.1} % uncovered", drawn.row.uncovered_share * 100.0));
    })?;
    bar.finish_and_clear();
    print_summary(&summary, options.out.as_deref());
    Ok(())
}

/// A few lines for a person; `stats.json` has the rest.
fn print_summary(summary: &headless::Summary, out: Option<&std::path::Path>) {
    let median = |value: fn(&headless::FrameRow) -> Option<f64>| {
        let mut values: Vec<f64> = summary.frames.iter().filter_map(value).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).map_or("-".to_owned(), |value| format!("{value:.1}"))
    };
    let header = &summary.header;
    println!(
        "{} pictures of {} at {}x{} on {}, {} updates, {} bytes",
        summary.frames.len(),
        header.scene,
        header.width_px,
        header.height_px,
        header.adapter,
        header.updates,
        summary.frames.last().map_or(0, |row| row.bytes_received),
    );
    println!(
        "medians: frame {} ms, surface {} ms, light {} ms, age {} ms, round trip {} ms",
        median(|row| Some(row.ms.frame)),
        median(|row| Some(row.ms.surface)),
        median(|row| Some(row.ms.light)),
        median(|row| row.age_ms),
        median(|row| row.round_trip_ms),
    );
    if let Some(out) = out {
        println!("written to {}", out.display());
    }
}

/// `WxH`, each 1 to 8192.
fn size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text.split_once('x').and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    parsed
        .filter(|(width, height)| (1..=8192).contains(width) && (1..=8192).contains(height))
        .ok_or_else(|| "write it as 1280x720, at most 8192 each".to_owned())
}

fn field_of_view(text: &str) -> Result<f64, String> {
    in_range(text, 1.0, 170.0)
}

fn rate(text: &str) -> Result<f64, String> {
    in_range(text, 0.1, 1000.0)
}

fn in_range(text: &str, least: f64, most: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("a number from {least} to {most}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }

    #[test]
    fn a_headless_run_needs_a_trace_and_a_folder() {
        let parse = |line: &str| Arguments::try_parse_from(line.split_whitespace());
        assert!(parse("vantage-view --headless --trace auto --out here").is_ok());
        assert!(parse("vantage-view --headless --trace auto").is_err());
        assert!(parse("vantage-view --headless --camera corner --out here").is_ok());
        assert!(parse("vantage-view --headless --out here").is_err());
        assert!(parse("vantage-view --trace auto").is_err());
        let run =
            parse("vantage-view --headless --trace auto --out here --clock virtual --warm-up false --network rtt=500");
        let options = run.expect("sound").headless(Way::Auto, Role::Viewer);
        assert_eq!((options.clock, options.warm_up), (Clock::Virtual, false));
        assert_eq!(options.link.map(|link| link.rtt_s), Some(0.5));
    }

    #[test]
    fn nonsense_is_refused() {
        for wrong in ["--size 640", "--size 0x10", "--fov-y-deg 180", "--network rtt=x", "--server"] {
            let line = format!("vantage-view {wrong}");
            assert!(Arguments::try_parse_from(line.split_whitespace()).is_err(), "{wrong}");
        }
    }
}
