//! Tables, bars, plots and pictures of what was measured along a trace.

use super::arguments::Protocol;
use super::bench::Bench;
use super::curves::crossing;
use super::outcome::{Outcome, What, Who};
use super::setup::{CLIENT_HZ, Network, Replay, SERVER_HZ};
use super::truths::Pair;
use super::video::MARGIN_RAD;
use crate::compare::flip::error_picture;
use crate::compare::{Picture, flip_map};
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::table::Table;
use crate::report::{Bar, Report};
use crate::topic::Run;

/// What a reader must know.
pub fn describe(report: &mut Report, bench: &Bench<'_>) {
    let arguments = bench.arguments;
    report.settings.set("build", if cfg!(debug_assertions) { "development" } else { "release" });
    report.settings.set("clock", format!("{:?}", arguments.clock).to_lowercase());
    report.settings.set("client_hz", CLIENT_HZ);
    report.settings.set("server_hz", SERVER_HZ);
    report.settings.set("images", format!("{} of {1}x{1} pixels", arguments.images, arguments.image_size));
    match arguments.protocol {
        Some(Protocol::Quasar2025) => report.settings.set("protocol", "quasar-2025"),
        None => report.settings.set("look", format!("{:?}", arguments.look).to_lowercase()),
    }
    if !arguments.network.is_empty() {
        let links: Vec<_> = arguments.network.iter().map(ToString::to_string).collect();
        report.settings.set("network", links.join(" "));
    }
    report.settings.set("antialias", arguments.antialias);
    report.settings.set("video_margin_deg", MARGIN_RAD.to_degrees().round());
    report.notes = NOTES.iter().map(|&note| note.to_owned()).collect();
    if arguments.motion.is_empty() {
        report.notes.push("Rows of fewer frames are of two neighbours of every ten pictures.".to_owned());
    } else {
        super::moving_table::describe(report, arguments);
    }
    if arguments.protocol.is_some() {
        report.notes.extend(PROTOCOL_NOTES.iter().map(|&note| note.to_owned()));
    }
}

const NOTES: &[&str] = &[
    "Every picture is scored against the full scene at its pose, and at the scene's time when it is shown: what is late is error.",
    "Mbit/s: all bytes that crossed the socket, both ways, from the opening of the connection to the last picture, over the \
     length of the trace; the set that was there before the first picture is in them. Colour is in them too.",
    "Bytes of each kind a second: up is to the server, down from it. advance and advanced pace the virtual clock and exist on \
     it alone; framing is HTTP's and the websocket's own.",
    "server_update: from asking for a step to having the update that it brought (images, coding, loopback); decode, surface, \
     light and frame: the viewer's, a picture. Real time of this machine, also on the virtual clock.",
    "H.264: libx264, veryfast, zerolatency, 4:2:0, of the full scene as drawn where the server expects the viewer (same poses, \
     network and predictor), a field 6 degrees wider on every side at the same pixels a radian; shown by turning it to the \
     viewer's view, the rim held outside. Its Mbit/s are those of its stream alone, without poses.",
    "Round trip: from a pose's sending to the first picture that uses what it brought, mean; video has that of the run beside it.",
    "flip_band: over the pixels within two of where, in the truth, one object or surface ends before another. 16x: against the truth with \
     sixteen samples a pixel, averaged in linear light.",
    "In the truth what is blended is cut out where its alpha is below a half: `layers` has another.",
    "On the virtual clock, where coding takes no time, samples are coded by the dense profile.",
];

const PROTOCOL_NOTES: &[&str] = &[
    "Other systems: QUASAR (Lu and Rowe, SIGGRAPH 2025), measured with its public simulator, and the baselines of the same \
     repository; each against its own full scene at the same poses. Their Mbit/s are geometry alone, every byte that the client \
     needs; colour is in neither their bytes nor their errors (it was lossless). Ours are with colour.",
    "By our own estimate, H.264 of a view's colour costs 0.8 to 1.9 Mbit/s (CRF 23 and 18), and of all of QUASAR's layers on \
     pillars 5.1 to 8.5 Mbit/s; their rows are without it.",
    "ATW sends colour alone, which was not counted: it has no Mbit/s.",
    "Our nearest distance is 0.05 m, theirs 0.1 m; nothing in these traces is that near.",
];

/// Adds a scene's outcomes to the report.
pub fn show(run: &Run, report: &mut Report, replay: &Replay, outcomes: Vec<Outcome>) -> anyhow::Result<()> {
    report.tables.push((format!("{}: error and bytes", replay.label), table(&outcomes)));
    report.bars.extend(bars(replay, &outcomes));
    plots(run, report, replay, &outcomes)?;
    report.rows.extend(outcomes.into_iter().map(|outcome| outcome.row));
    Ok(())
}

/// Everybody in one table, by network and then by FLIP.
fn table(outcomes: &[Outcome]) -> Table {
    let mut table = Table::new([
        "network",
        "system",
        "FLIP",
        "p95",
        "worst",
        "FLIP covered",
        "SSIM",
        "PSNR dB",
        "holes %",
        "flicker",
        "Mbit/s",
        "round trip ms",
        "frames",
    ]);
    let mut order: Vec<&Outcome> = outcomes.iter().collect();
    order.sort_by(|a, b| {
        let key = |o: &Outcome| (o.what == What::RoundTrip, o.network.name.clone());
        let flip = |o: &Outcome| o.mean("flip").unwrap_or(f64::INFINITY);
        key(a).cmp(&key(b)).then(flip(a).total_cmp(&flip(b)))
    });
    for outcome in order {
        let row = &outcome.row;
        let mean = |name: &str, decimals: usize, factor: f64| {
            outcome.mean(name).map_or(String::new(), |mean| format!("{:.decimals$}", mean * factor))
        };
        let figure = |path: &str| row.figure(path).map_or(String::new(), |value| format!("{value:.4}"));
        let count = |name: &str, decimals: usize| {
            row.counts.get(name).map_or(String::new(), |value| format!("{value:.decimals$}"))
        };
        let state = row.parameters.get("state").and_then(|state| state.as_str());
        table.row([
            outcome.network.name.clone(),
            state.map_or_else(|| row.method.clone(), |state| format!("{} {state}", row.method)),
            mean("flip", 4, 1.0),
            figure("error.flip.p95"),
            figure("error.flip.worst"),
            mean("flip_covered", 4, 1.0),
            mean("ssim", 4, 1.0),
            mean("psnr_db", 2, 1.0),
            mean("holes_share", 3, 100.0),
            mean("flicker", 2, 1.0),
            count("mbit_s", 2),
            count("round_trip_ms", 0),
            count("frames", 0),
        ]);
    }
    table
}

/// Ours against the systems that stand beside it at the settings asked for, wins and losses alike.
fn bars(replay: &Replay, outcomes: &[Outcome]) -> Vec<Bar> {
    let mut bars = Vec::new();
    let mains = || outcomes.iter().filter(|outcome| matches!(outcome.what, What::Main | What::InView));
    for ours in mains().filter(|outcome| outcome.who == Who::Ours) {
        for other in mains().filter(|other| other.who != Who::Ours && other.network.name == ours.network.name) {
            let what = |measure: &str| {
                let (label, network) = (&replay.label, &ours.network.name);
                format!("{label}, {network}: {measure} of {} against {}", ours.row.method, other.row.method)
            };
            if let Some(flip) = other.mean("flip") {
                bars.push(Bar::at_most(what("mean FLIP"), flip, ours.mean("flip"), ""));
            }
            if let (Who::Peer(_), Some(&mbit_s)) = (other.who, other.row.counts.get("mbit_s")) {
                bars.push(Bar::at_most(what("Mbit/s"), mbit_s, Some(ours.mbit_s()), "Mbit/s"));
            }
        }
    }
    bars
}

/// FLIP against bytes, round trip and time.
fn plots(run: &Run, report: &mut Report, replay: &Replay, outcomes: &[Outcome]) -> anyhow::Result<()> {
    let main = &replay.networks[0].name;
    let is_of_main = |what| !matches!(what, What::RoundTrip | What::InView);
    let of_main = |outcome: &&Outcome| is_of_main(outcome.what) && outcome.network.name == *main;
    let bytes = series(outcomes.iter().filter(of_main), |outcome| (outcome.mbit_s(), outcome.mean("flip")));
    let (flip, label) = ("FLIP, mean over all pixels".to_owned(), &replay.label);
    if !bytes.is_empty() {
        say_crossing(report, label, "Mbit/s", &bytes);
        let path = run.figure(
            report,
            format!("bytes-{label}.svg"),
            format!("{label}, {main}: error against bytes. Other systems' bytes are geometry alone, without colour."),
        );
        let title = format!("{label}: FLIP against bytes");
        let plot = Scatter { title, x_label: "Mbit/s".to_owned(), y_label: flip.clone(), series: bytes };
        draw_curves(&plot, Axes { log_x: true, front: true }, &path)?;
    }
    let usual = |outcome: &&Outcome| match outcome.who {
        Who::Peer(_) => outcome.what == What::Main,
        Who::Ours | Who::Video => outcome.what == What::RoundTrip,
    };
    let trips = series(outcomes.iter().filter(usual), |outcome| (outcome.round_trip_ms, outcome.mean("flip")));
    if outcomes.iter().any(|outcome| outcome.what == What::RoundTrip) {
        say_crossing(report, label, "ms of round trip", &trips);
        let path = run.figure(report, format!("round-trip-{label}.svg"), format!(
            "{label}: error against the round trip from a pose to the picture that uses it; video spends the same bytes."));
        let title = format!("{label}: FLIP against the round trip");
        let plot = Scatter { title, x_label: "round trip, ms".to_owned(), y_label: flip.clone(), series: trips };
        draw_curves(&plot, Axes { log_x: false, front: false }, &path)?;
    }
    let mains =
        outcomes.iter().filter(of_main).filter(|outcome| outcome.what == What::Main && !outcome.by_frame.is_empty());
    let series: Vec<Series> =
        mains.map(|outcome| Series { name: outcome.row.method.clone(), points: outcome.by_frame.clone() }).collect();
    let path = run.figure(report, format!("frames-{label}.svg"), format!("{label}, {main}: error by picture."));
    let title = format!("{label}: FLIP by picture");
    let plot = Scatter { title, x_label: "s".to_owned(), y_label: "FLIP of a picture".to_owned(), series };
    draw_curves(&plot, Axes { log_x: false, front: false }, &path)
}

/// A series for each system, its points by growing x.
fn series<'a>(
    outcomes: impl Iterator<Item = &'a Outcome>,
    point: impl Fn(&Outcome) -> (f64, Option<f64>),
) -> Vec<Series> {
    let mut all: Vec<Series> = Vec::new();
    for outcome in outcomes {
        let (x, Some(y)) = point(outcome) else { continue };
        if !x.is_finite() {
            continue;
        }
        let name = outcome.who.name();
        match all.iter_mut().find(|series| series.name == name) {
            Some(series) => series.points.push((x, y)),
            None => all.push(Series { name: name.to_owned(), points: vec![(x, y)] }),
        }
    }
    for series in &mut all {
        series.points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    all
}

/// Where ours and video change places.
fn say_crossing(report: &mut Report, label: &str, unit: &str, series: &[Series]) {
    let points = |name: &str| series.iter().find(|series| series.name == name).map(|series| series.points.as_slice());
    if let (Some(ours), Some(video)) = (points("Vantage"), points("H.264")) {
        report.notes.push(format!("{label}: {}.", crossing(ours, video).say("Vantage", "H.264", unit)));
    }
}

/// Writes our usual and our worst picture beside video, truth and errors.
pub fn pictures(
    run: &Run,
    report: &mut Report,
    replay: &Replay,
    network: &Network,
    ours: &Outcome,
    video: Option<&Outcome>,
) -> anyhow::Result<()> {
    for (pair, which) in ours.kept.iter().zip(["usual", "worst"]) {
        let error = |pair: &Pair| {
            let errors = flip_map(&pair.picture, &pair.truth.plain)?;
            anyhow::Ok(error_picture(&errors, pair.picture.width_px, pair.picture.height_px))
        };
        let mut columns: Vec<Picture> = vec![pair.picture.clone(), pair.truth.plain.clone(), error(pair)?];
        let mut shown = "ours, the truth, our error".to_owned();
        if let Some(video) = video.and_then(|video| video.kept.iter().find(|other| other.frame == pair.frame)) {
            columns.extend([error(video)?, video.picture.clone()]);
            shown += ", video's error, video of the same bytes";
        }
        let name = network.name.replace(|c: char| !c.is_ascii_alphanumeric(), "");
        let path = run.figure(
            report,
            format!("{}-{name}-{which}.png", replay.label),
            format!("{}, {}, our {which} picture (frame {}): {shown}.", replay.label, network.name, pair.frame),
        );
        Picture::beside(&columns.iter().collect::<Vec<_>>(), 4).write(&path)?;
    }
    Ok(())
}
