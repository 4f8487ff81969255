//! What a run gave: a row of figures, and the pictures worth keeping.

use std::collections::BTreeMap;

use anyhow::Context;
use client::show::headless::RowMs;

use super::live::{Lived, Operation};
use super::peers::{PEERS, Peer};
use super::setup::{self, CLIENT_HZ, Network, Replay};
use super::truths::{Pair, Truths, paired, scored};
use super::video::Watched;
use crate::compare::MEASURES;
use crate::compare::folder::{FrameRow, summarize};
use crate::report::Row;
use crate::report::table::number;
use crate::spread::{Better, Spread};

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

impl Who {
    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Who::Ours => "Vantage",
            Who::Video => "H.264",
            Who::Peer(system) => system,
        }
    }
}

/// What a run is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// The settings asked for.
    Main,
    /// The same without anticipation, beside other systems, which send what is in view.
    InView,
    /// Error against bytes, over the main network.
    Size,
    /// Error against the round trip.
    RoundTrip,
}

/// One run's figures.
pub struct Outcome {
    /// For the report.
    pub row: Row,
    /// Whose it is.
    pub who: Who,
    /// What for.
    pub what: What,
    /// Over which network.
    pub network: Network,
    /// From a pose to the picture that uses it.
    pub round_trip_ms: f64,
    /// Time in seconds and FLIP of each scored picture.
    pub by_frame: Vec<(f64, f64)>,
    /// Of ours, a usual picture and the worst; of video, the same frames.
    pub kept: Vec<Pair>,
}

impl Outcome {
    /// Everything that crossed, both ways; of video, the stream; of other systems, geometry without colour.
    pub fn mbit_s(&self) -> f64 {
        self.row.counts.get("mbit_s").copied().unwrap_or(f64::NAN)
    }

    /// The mean of a measure, where it is known.
    pub fn mean(&self, measure: &str) -> Option<f64> {
        self.row.error.get(measure).map(|spread| spread.mean)
    }
}

/// A row with the scores of pictures.
pub fn row(replay: &Replay, network: &Network, method: &str, scores: &[FrameRow]) -> Row {
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
    let Lived { shown, summary, socket_bytes, .. } = lived;
    let header = &summary.header;
    let rows = &summary.frames;
    let pairs = paired(truths, shown)?;
    let scores = scored(&pairs, truths.antialias())?;
    let anticipated = if operation.anticipates { "" } else { ", nothing anticipated" };
    let method = format!("Vantage, {} images of {}{anticipated}", operation.images, operation.image_px);
    let mut row = row(replay, network, &method, &scores);
    times(&mut row, &header.server_ms, rows);
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

/// Real milliseconds of the server's updates and of the viewer's pictures.
pub fn times<'a>(
    row: &mut Row,
    server_ms: &[f64],
    pictures: impl IntoIterator<Item = &'a client::show::headless::FrameRow>,
) {
    let ms: Vec<RowMs> = pictures.into_iter().map(|picture| picture.ms).collect();
    let spread = |value: fn(&RowMs) -> f64| Spread::of(&ms.iter().map(value).collect::<Vec<_>>(), Better::Lower);
    let times = [
        ("server_update", Spread::of(server_ms, Better::Lower)),
        ("decode", spread(|ms| ms.decode)),
        ("surface", spread(|ms| ms.surface)),
        ("light", spread(|ms| ms.light)),
        ("frame", spread(|ms| ms.frame)),
    ];
    for (name, spread) in times {
        spread.into_iter().for_each(|spread| row.time_ms.set(name, spread));
    }
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
    (antialias, what): (bool, What),
) -> anyhow::Result<Outcome> {
    let Watched { pairs, mbit_s, encode_ms } = watched;
    let scores = scored(&pairs, antialias)?;
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
