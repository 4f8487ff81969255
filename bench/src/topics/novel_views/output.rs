//! Rows, tables, bars, plots and pictures of what was measured.

use std::collections::BTreeMap;

use anyhow::Context;

use super::curves::crossing;
use super::live::{Lived, Operation};
use super::peers::{PEERS, Peer};
use super::setup::{self, CLIENT_HZ, Network, Replay};
use super::truths::{Pair, Truths, paired, scored};
use super::video::Watched;
use crate::compare::flip::error_picture;
use crate::compare::folder::{FrameRow, summarize};
use crate::compare::{MEASURES, Picture, flip_map};
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::table::{Table, number};
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::Run;

/// Whose figures they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Who {
    /// The system under test.
    Ours,
    /// The baseline.
    Video,
    /// Another system, by name.
    Peer(&'static str),
}

/// What a run is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// The settings asked for.
    Main,
    /// Error against bytes, over the main network.
    Size,
    /// Error against the round trip.
    RoundTrip,
}

/// One run's figures.
pub struct Outcome {
    /// For the report.
    pub row: Row,
    who: Who,
    what: What,
    network: Network,
    round_trip_ms: f64,
    /// Time in seconds and FLIP of each scored picture.
    by_frame: Vec<(f64, f64)>,
    /// Of ours, a usual picture and the worst; of video, the same frames.
    kept: Vec<Pair>,
}

impl Outcome {
    /// Everything that crossed, both ways; of video, the stream; of other systems, geometry without colour.
    pub fn mbit_s(&self) -> f64 {
        self.row.counts.get("mbit_s").copied().unwrap_or(f64::NAN)
    }

    fn mean(&self, measure: &str) -> Option<f64> {
        self.row.error.get(measure).map(|spread| spread.mean)
    }
}

/// A row with the scores of pictures.
fn row(replay: &Replay, network: &Network, method: &str, scores: &[FrameRow]) -> Row {
    let mut row = Row::new(&replay.label, method);
    row.parameters.set("network", network.name.clone());
    let summary: BTreeMap<&str, Spread> = summarize(scores);
    for (name, _) in MEASURES {
        if let Some(&spread) = summary.get(name) {
            row.error.set(name, spread);
        }
    }
    row.counts.set("frames", scores.len() as f64);
    row
}

fn by_frame(scores: &[FrameRow]) -> Vec<(f64, f64)> {
    scores.iter().map(|score| (f64::from(score.frame) / CLIENT_HZ, score.scores.flip)).collect()
}

/// The figures of a run of ours.
pub fn ours(
    replay: &Replay,
    network: &Network,
    operation: &Operation,
    lived: Lived,
    truths: &mut Truths,
    what: What,
) -> anyhow::Result<Outcome> {
    let Lived { shown, summary, socket_bytes } = lived;
    let header = &summary.header;
    let rows = &summary.frames;
    let pairs = paired(truths, shown)?;
    let scores = scored(&pairs)?;
    let method = format!("Vantage, {} images of {}", operation.images, operation.image_px);
    let mut row = row(replay, network, &method, &scores);
    let spread = |value: fn(&client::show::headless::FrameRow) -> f64| {
        Spread::of(&rows.iter().map(value).collect::<Vec<_>>(), Better::Lower)
    };
    let times = [
        ("server_update", Spread::of(&header.server_ms, Better::Lower)),
        ("decode", spread(|row| row.ms.decode)),
        ("surface", spread(|row| row.ms.surface)),
        ("light", spread(|row| row.ms.light)),
        ("frame", spread(|row| row.ms.frame)),
    ];
    for (name, spread) in times {
        spread.into_iter().for_each(|spread| row.time_ms.set(name, spread));
    }
    let seconds = replay.trace.poses.len() as f64 / CLIENT_HZ;
    for (way, counts) in [("up", &header.traffic.sent), ("down", &header.traffic.received)] {
        for (kind, count) in counts {
            row.bytes.set(format!("{way}_{kind}_per_s"), count.bytes as f64 / seconds);
        }
    }
    let messages = header.traffic.total_bytes();
    let framing = (socket_bytes.0 + socket_bytes.1).saturating_sub(messages.0 + messages.1);
    row.bytes.set("framing_per_s", framing as f64 / seconds);
    let mbit_s = |bytes: u64| bytes as f64 * 8.0 / 1e6 / seconds;
    row.counts.set("mbit_s", mbit_s(socket_bytes.0 + socket_bytes.1));
    row.counts.set("mbit_s_up", mbit_s(socket_bytes.0));
    row.counts.set("updates", header.updates as f64);
    row.counts.set("samples_held", rows.last().map_or(0.0, |row| row.samples as f64));
    header.first_picture_ms.into_iter().for_each(|ms| row.counts.set("first_picture_ms", ms));
    let mut trips: Vec<f64> = rows.iter().filter_map(|row| row.round_trip_ms).collect();
    trips.dedup();
    let round_trip_ms = mean(&trips);
    let deviation = mean(&trips.iter().map(|trip| (trip - round_trip_ms).powi(2)).collect::<Vec<_>>()).sqrt();
    row.counts.set("round_trip_ms", round_trip_ms);
    row.counts.set("round_trip_deviation_ms", deviation);
    Ok(Outcome {
        row,
        who: Who::Ours,
        what,
        network: network.clone(),
        round_trip_ms,
        by_frame: by_frame(&scores),
        kept: usual_and_worst(pairs, &scores),
    })
}

/// Not a number where there is none.
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The pictures with the middle and with the largest FLIP.
fn usual_and_worst(pairs: Vec<Pair>, scores: &[FrameRow]) -> Vec<Pair> {
    let mut order: Vec<usize> = (0..scores.len()).collect();
    order.sort_by(|&a, &b| scores[a].scores.flip.total_cmp(&scores[b].scores.flip));
    let wanted = [order.get(order.len() / 2).copied(), order.last().copied()];
    let mut kept: Vec<Option<Pair>> = pairs.into_iter().map(Some).collect();
    wanted.into_iter().flatten().filter_map(|index| kept[index].take()).collect()
}

/// The figures of video.
pub fn video(
    replay: &Replay,
    network: &Network,
    ours: &Outcome,
    watched: Watched,
    what: What,
) -> anyhow::Result<Outcome> {
    let Watched { pairs, mbit_s, encode_ms } = watched;
    let scores = scored(&pairs)?;
    let method = format!("H.264, {} Mbit/s", number(mbit_s));
    let mut row = row(replay, network, &method, &scores);
    row.time_ms.set("server_encode", Spread::single(encode_ms));
    row.counts.set("mbit_s", mbit_s);
    let same = |pair: &Pair| ours.kept.iter().any(|kept| kept.frame == pair.frame);
    Ok(Outcome {
        row,
        who: Who::Video,
        what,
        network: network.clone(),
        round_trip_ms: ours.round_trip_ms,
        by_frame: by_frame(&scores),
        kept: pairs.into_iter().filter(same).collect(),
    })
}

/// The row of a video that could not be made.
pub fn without_ffmpeg(replay: &Replay, network: &Network) -> Outcome {
    let mut row = Row::new(&replay.label, "H.264");
    row.parameters.set("network", network.name.clone());
    row.parameters.set("state", "not measured: ffmpeg is not installed");
    Outcome {
        row,
        who: Who::Video,
        what: What::Main,
        network: network.clone(),
        round_trip_ms: f64::NAN,
        by_frame: Vec::new(),
        kept: Vec::new(),
    }
}

/// What is known of other systems on this scene.
pub fn peers_of(replay: &Replay) -> anyhow::Result<Vec<Outcome>> {
    let path = setup::assets()?.join("peers").join("per_frame.json");
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let per_frame: serde_json::Value = serde_json::from_str(&text)?;
    let rows = PEERS.iter().filter(|peer| peer.scene == replay.label);
    Ok(rows.map(|peer| peer_outcome(replay, peer, &per_frame)).collect())
}

fn peer_outcome(replay: &Replay, peer: &Peer, per_frame: &serde_json::Value) -> Outcome {
    let name = setup::latency_name(peer.latency_ms);
    let mut row = Row::new(&replay.label, &peer.name());
    row.parameters.set("network", name.clone());
    for (measure, triple) in
        [("flip", peer.flip), ("ssim", peer.ssim), ("psnr_db", peer.psnr_db), ("holes_share", peer.holes_share)]
    {
        row.error.set(measure, peer.spread(triple));
    }
    row.counts.set("frames", peer.frames as f64);
    if peer.geometry_mbit_s > 0.0 {
        row.counts.set("mbit_s", peer.geometry_mbit_s);
    }
    row.counts.set("round_trip_ms", peer.round_trip_ms.0);
    row.counts.set("round_trip_deviation_ms", peer.round_trip_ms.1);
    let flips = per_frame[peer.run]["flip"].as_array().map_or(&[][..], Vec::as_slice);
    let step = if peer.frames > 75 { 1.0 } else { 2.0 };
    let by_frame = flips.iter().enumerate();
    let by_frame =
        by_frame.filter_map(|(index, flip)| Some((index as f64 * step / CLIENT_HZ, flip.as_f64()?))).collect();
    Outcome {
        row,
        who: Who::Peer(peer.system),
        what: if peer.setting.is_empty() { What::Main } else { What::Size },
        network: Network { name, link: network::Link::default() },
        round_trip_ms: peer.round_trip_ms.0,
        by_frame,
        kept: Vec::new(),
    }
}

/// What a reader must know.
pub const NOTES: &[&str] = &[
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
    "Rows of fewer frames are of two neighbours of every ten pictures.",
    "On the virtual clock, where coding takes no time, samples are coded by the dense profile.",
];

/// And of a protocol.
pub const PROTOCOL_NOTES: &[&str] = &[
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
    let mains = || outcomes.iter().filter(|outcome| outcome.what == What::Main);
    for ours in mains().filter(|outcome| outcome.who == Who::Ours) {
        for other in mains().filter(|other| other.who != Who::Ours && other.network.name == ours.network.name) {
            let what = |measure: &str| {
                format!("{}, {}: {measure} against {}", replay.label, ours.network.name, other.row.method)
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
    let of_main = |outcome: &&Outcome| outcome.what != What::RoundTrip && outcome.network.name == *main;
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
        let name = match outcome.who {
            Who::Ours => "Vantage",
            Who::Video => "H.264",
            Who::Peer(system) => system,
        };
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
            let errors = flip_map(&pair.picture, &pair.truth)?;
            anyhow::Ok(error_picture(&errors, pair.picture.width_px, pair.picture.height_px))
        };
        let mut columns: Vec<Picture> = vec![pair.picture.clone(), (*pair.truth).clone(), error(pair)?];
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
