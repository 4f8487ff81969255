//! Motions of people instead of a trace: a row for each part of a motion, ours and video's, with contact sheets.

use network::Link;

use super::bench::Bench;
use super::film::Film;
use super::live::{self, Drawn, Lived};
use super::moving_table::{self, PartRow};
use super::outcome::{Who, row, times};
use super::setup::{self, CLIENT_HZ, Network, Replay};
use super::truths::{Pair, Truths, paired, scored};
use super::{expected, film, sheets, video};
use crate::compare::folder::FrameRow;
use crate::motion::{self, Motion, Part, RESTS_AFTER_S};
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::{Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::scene_label;

/// Measures every motion that was asked for in a scene; what fails becomes a row.
pub fn measure(bench: &Bench<'_>, scene: &str, report: &mut Report) {
    let label = scene_label(scene);
    match setup::moving(scene, bench.run.size_px, bench.arguments.held_at) {
        Ok(still) => {
            let asked = |motion: &&Motion| bench.arguments.motion.iter().any(|motions| motions.contains(motion));
            for &motion in Motion::ALL.iter().filter(asked) {
                match measured(bench, &still, motion, report) {
                    Ok(rows) => moving_table::show(report, &label, motion, rows),
                    Err(error) => report.rows.push(Row::failed(&label, motion.name(), &error)),
                }
                write_summary(bench, &label, report);
            }
        }
        Err(error) => report.rows.push(Row::failed(&label, "motions", &error)),
    }
    bench.progress.step();
}

/// A line a part of all motions so far, small enough to keep and to compare: a run that is stopped leaves what it had measured.
fn write_summary(bench: &Bench<'_>, label: &str, report: &mut Report) {
    let path = bench.run.out.join("motions.csv");
    if let Err(error) = std::fs::write(&path, moving_table::summary(&report.rows).csv()) {
        report.rows.push(Row::failed(label, "motions.csv", &error.into()));
    }
}

/// One motion over every network, ours and video of the same bytes, and ours without delay where a bar asks for it.
fn measured(bench: &Bench<'_>, scene: &Replay, motion: Motion, report: &mut Report) -> anyhow::Result<Vec<PartRow>> {
    let way = motion::way(motion, &scene.scene, bench.arguments.orbit_s, CLIENT_HZ);
    let mut replay = Replay {
        trace: way.trace,
        scene: scene.scene.clone(),
        label: scene.label.clone(),
        networks: scene.networks.clone(),
        ..*scene
    };
    bench.set_asked(&mut replay);
    let antialias = bench.arguments.antialias;
    let mut moved = Moved {
        bench,
        truths: Truths::new(bench.gpu, &replay, antialias)?,
        replay: &replay,
        motion,
        parts: &way.parts,
        film: None,
        rows: Vec::new(),
        curves: Vec::new(),
    };
    for network in &replay.networks {
        moved.film = bench.arguments.film.then(Film::default);
        let mbit_s = moved.ours(network, report)?;
        if bench.has_ffmpeg && !bench.arguments.no_video {
            moved.video(network, mbit_s, report)?;
        }
        moved.finish_film(network, report);
    }
    let rests_amid_motion = motion == Motion::Rest && replay.scene.is_animated();
    let without_delay = Network::of_link(Link::default());
    if (motion == Motion::Orbit || rests_amid_motion) && !replay.networks.contains(&without_delay) {
        moved.ours(&without_delay, report)?;
    }
    let Moved { rows, curves, .. } = moved;
    let path = bench.run.figure(
        report,
        format!("{}-{}.svg", replay.label, motion.name()),
        format!("{}, {}: error over covered pixels by picture.", replay.label, motion.name()),
    );
    let title = format!("{}: {}", replay.label, motion.name());
    let plot =
        Scatter { title, x_label: "s".to_owned(), y_label: "FLIP over covered pixels".to_owned(), series: curves };
    draw_curves(&plot, Axes { log_x: false, front: false }, &path)?;
    Ok(rows)
}

/// A motion through a scene while it is measured.
struct Moved<'a> {
    bench: &'a Bench<'a>,
    truths: Truths,
    replay: &'a Replay,
    motion: Motion,
    parts: &'a [Part],
    /// The one that is being taken.
    film: Option<Film>,
    rows: Vec<PartRow>,
    curves: Vec<Series>,
}

/// What a run gave, before it is cut into parts.
struct Seen<'a> {
    who: Who,
    method: String,
    network: &'a Network,
    pairs: Vec<Pair>,
    scores: Vec<FrameRow>,
}

impl Moved<'_> {
    /// Our own run; gives its Mbit/s.
    fn ours(&mut self, network: &Network, report: &mut Report) -> anyhow::Result<f64> {
        let (bench, replay) = (self.bench, self.replay);
        bench.progress.say(format!("{}: {}, {}", replay.label, self.motion.name(), network.name));
        let scored_frames = scored_frames(self.motion, bench.run.quick, self.film.is_some());
        let drawn = if bench.arguments.antialias { refining(self.motion, scored_frames) } else { scored_frames };
        let operation = bench.operation(network, drawn, scored_frames);
        let Lived { shown, summary, socket_bytes, .. } = live::run(bench.gpu, replay, &operation)?;
        let pairs = paired(&mut self.truths, shown)?;
        let scores = scored(&pairs, bench.arguments.antialias)?;
        let method = format!("Vantage, {} images of {}", operation.images, operation.image_px);
        let mbit_s = (socket_bytes.0 + socket_bytes.1) as f64 * 8.0 / 1e6 / self.seconds();
        let after_rest = self.bytes_at_rest(&summary.frames);
        let missed = expected::missed(replay, network.link);
        self.cut(Seen { who: Who::Ours, method, network, pairs, scores }, report, |part, row| {
            let frames = part.frames(CLIENT_HZ);
            let during = || summary.frames.iter().filter(|frame| frames.contains(&frame.frame));
            times(row, &summary.header.server_ms, during());
            let ages_ms: Vec<_> = during().filter_map(|frame| frame.age_ms).collect();
            Spread::of(&ages_ms, Better::Lower).into_iter().for_each(|spread| row.error.set("age_ms", spread));
            let missed = missed.iter().filter(|missed| part.time_s.contains(&missed.shown_s));
            let (far_m, turned_deg): (Vec<_>, Vec<_>) = missed.map(|m| (m.distance_m, m.turn_deg)).unzip();
            for (name, values) in [("predicted_off_m", far_m), ("predicted_off_deg", turned_deg)] {
                Spread::of(&values, Better::Lower).into_iter().for_each(|spread| row.error.set(name, spread));
            }
            row.counts.set("mbit_s", mbit_s);
            row.counts.set("updates", summary.header.updates as f64);
            during().next_back().into_iter().for_each(|frame| row.counts.set("samples_held", frame.samples as f64));
            after_rest.into_iter().for_each(|bytes| row.counts.set("bytes_after_1_s_of_rest", bytes as f64));
        })?;
        Ok(mbit_s)
    }

    /// Video that spends the same bytes.
    fn video(&mut self, network: &Network, mbit_s: f64, report: &mut Report) -> anyhow::Result<()> {
        let (bench, replay) = (self.bench, self.replay);
        bench.progress.say(format!("{}: {}, video, {}", replay.label, self.motion.name(), network.name));
        let film = video::film(&mut self.truths, replay, network.link)?;
        let how = (bench.arguments.ffmpeg.as_path(), scored_frames(self.motion, bench.run.quick, self.film.is_some()));
        let watched = video::watch(&mut self.truths, replay, network.link, &film, mbit_s, how)?;
        let scores = scored(&watched.pairs, bench.arguments.antialias)?;
        let method = "H.264 of the same bytes".to_owned();
        self.cut(Seen { who: Who::Video, method, network, pairs: watched.pairs, scores }, report, |_, row| {
            row.counts.set("mbit_s", watched.mbit_s);
        })
    }

    /// A row and contact sheets for each part.
    fn cut(&mut self, seen: Seen<'_>, report: &mut Report, complete: impl Fn(&Part, &mut Row)) -> anyhow::Result<()> {
        let Seen { who, method, network, pairs, scores } = seen;
        let antialias = self.bench.arguments.antialias;
        for part in self.parts {
            let frames = part.frames(CLIENT_HZ);
            let places: Vec<usize> = (0..scores.len()).filter(|&at| frames.contains(&pairs[at].frame)).collect();
            let of_part: Vec<FrameRow> = places.iter().map(|&at| scores[at].clone()).collect();
            let kept = sheets::median_and_worst(&of_part, antialias);
            if kept.is_empty() {
                continue;
            }
            let mut row = row(self.replay, network, &method, &of_part);
            row.parameters.set("motion", part.name.clone());
            if antialias {
                row.parameters.set("antialias", true);
            }
            complete(part, &mut row);
            for (at, which) in kept {
                let pair = &pairs[places[at]];
                let caption = format!(
                    "{}, {}, {method}, {}, {which} frame ({}): {}.",
                    self.replay.label,
                    part.name,
                    network.name,
                    pair.frame,
                    sheets::LAYOUT
                );
                let name = format!("{}-{}-{method}-{}-{which}", self.replay.label, part.name, network.name);
                let path = self.bench.run.figure(report, format!("{}.png", file_name(&name)), caption);
                sheets::sheet(pair, antialias)?.write(&path)?;
            }
            self.rows.push(PartRow { who, part: part.name.clone(), network: network.clone(), row });
        }
        let point =
            |(pair, score): (&Pair, &FrameRow)| Some((pair.frame as f64 / CLIENT_HZ, score.scores.flip_covered?));
        let points = pairs.iter().zip(&scores).filter_map(point).collect();
        self.film.iter_mut().for_each(|film| film.add(&pairs, antialias));
        self.curves.push(Series { name: format!("{}, {}", who.name(), network.name), points });
        Ok(())
    }

    /// A film that cannot be written becomes a row; the figures stay.
    fn finish_film(&mut self, network: &Network, report: &mut Report) {
        let Some(film) = self.film.take() else { return };
        let (label, motion) = (&self.replay.label, self.motion.name());
        let file = format!("{}.webp", file_name(&format!("{label}-{motion}-{}", network.name)));
        match film.write(&self.bench.arguments.ffmpeg, &self.bench.run.out.join(&file)) {
            Ok(()) => {
                let shown = "what was shown, video of the same bytes, and the truth";
                self.bench.run.figure(report, file, format!("{label}, {motion}, {}: {shown}.", network.name));
            }
            Err(error) => report.rows.push(Row::failed(label, &file, &error)),
        }
    }

    fn seconds(&self) -> f64 {
        self.replay.trace.poses.len() as f64 / CLIENT_HZ
    }

    /// What the server sent from a second after stopping on.
    fn bytes_at_rest(&self, frames: &[client::show::headless::FrameRow]) -> Option<u64> {
        let stopped_s = self.parts.first()?.time_s.end;
        let from_s = stopped_s + RESTS_AFTER_S[1];
        let first = frames.iter().find(|frame| self.motion == Motion::Rest && frame.t_s >= from_s - 0.5 / CLIENT_HZ)?;
        Some(frames.last()?.update_bytes_sent - first.update_bytes_sent)
    }
}

/// Letters, digits and what joins them.
fn file_name(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric() && c != '.').filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_lowercase()
}

/// Which pictures of a motion are scored: neighbours, so that flicker is known, more of them where it is short; and all of a film.
fn scored_frames(motion: Motion, quick: bool, films: bool) -> Drawn {
    match (motion, quick, films) {
        (Motion::Rest, _, false) => of_rest,
        (Motion::Rest, _, true) => |frame| of_rest(frame) || film::holds(frame),
        (Motion::Flick, _, false) => of_flick,
        (Motion::Flick, _, true) => |frame| of_flick(frame) || film::holds(frame),
        (_, false, false) => live::two_of_ten,
        (_, false, true) => |frame| live::two_of_ten(frame) || film::holds(frame),
        (_, true, false) => |frame| frame % 40 < 2,
        (_, true, true) => |frame| frame % 40 < 2 || film::holds(frame),
    }
}

fn of_rest(frame: usize) -> bool {
    matches!(frame, 126 | 127 | 156 | 157 | 185 | 186) || (frame < 96 && frame % 16 < 2)
}

fn of_flick(frame: usize) -> bool {
    match frame {
        // The flick is in frames 390 to 426; what comes into view by it is late until after that.
        390..450 => frame % 4 < 2,
        _ => frame % 30 < 2,
    }
}

/// The same and, for viewers whose pictures get better over frames, every one at rest.
fn refining(motion: Motion, scored: Drawn) -> Drawn {
    match motion {
        Motion::Rest => |frame| frame >= 96 || of_rest(frame) || film::holds(frame),
        _ => scored,
    }
}

#[cfg(test)]
mod tests {
    use super::super::arguments;
    use super::*;
    use crate::motion::ORBIT_S;

    /// Every part has neighbours that are scored, and what is scored at rest is what its name says.
    #[test]
    fn every_part_of_every_motion_is_scored() {
        for scene in ["tree", "pillars"] {
            let scene = scene::builtin::load(scene).expect("built in");
            for motion in Motion::ALL {
                let way = motion::way(motion, &scene, ORBIT_S, CLIENT_HZ);
                for (part, quick) in way.parts.iter().flat_map(|part| [(part, false), (part, true)]) {
                    let drawn = scored_frames(motion, quick, false);
                    let frames: Vec<usize> = part
                        .frames(CLIENT_HZ)
                        .take_while(|&frame| frame < way.trace.poses.len())
                        .filter(|&frame| drawn(frame))
                        .collect();
                    assert!(frames.windows(2).any(|pair| pair[0] + 1 == pair[1]), "{}: {frames:?}", part.name);
                    if part.name == "rest, after 1 s" {
                        assert_eq!(frames, [156, 157], "1.6 s and one more");
                        let filmed = scored_frames(motion, quick, true);
                        assert!(frames.iter().all(|&frame| filmed(frame)) && filmed(160));
                    }
                }
            }
        }
    }

    #[test]
    fn motions_are_read() {
        assert_eq!(arguments::motions("rest"), Ok(&[Motion::Rest][..]));
        assert_eq!(arguments::motions("all").map(<[Motion]>::len), Ok(5));
        assert!(arguments::motions("fly").is_err());
    }
}
