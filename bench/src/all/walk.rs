//! Runs pieces one after another, and says how far it is.

use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, ensure};

use super::folder::{Folder, Record, Status};
use super::page::{self, span_of_time};
use super::pieces::Piece;

/// Runs the chosen pieces that are not finished. `start` gives the process of a piece, which writes into the folder that it is
/// given; or none, where files are missing that the piece reads.
///
/// A piece that fails does not stop the others. At the end it is an error that names all that failed.
pub fn walk(
    folder: &Folder,
    pieces: &[Piece],
    chosen: &[&Piece],
    start: impl Fn(&Piece, &Path) -> anyhow::Result<Option<Command>>,
) -> anyhow::Result<()> {
    std::fs::create_dir_all(&folder.path).with_context(|| folder.path.display().to_string())?;
    let began = Instant::now();
    let is_finished = |piece: &Piece| matches!(folder.status(piece), Status::Finished(..));
    let mut failed = Vec::new();
    page::write(folder, pieces)?;
    for (k, piece) in chosen.iter().enumerate() {
        let head = format!("piece {} of {}, {}", k + 1, chosen.len(), piece.name);
        if is_finished(piece) {
            println!("{head}: finished before");
            continue;
        }
        let Some(command) = start(piece, &folder.of(piece))? else {
            println!("{head}: left out, it reads files of the folder that VANTAGE_ASSETS names");
            continue;
        };
        println!("{head} ({}): cargo xtask report {}", how_far(folder, pieces, &chosen[k..], began), piece.command);
        let record = make(folder, piece, command)?;
        match &record.failed {
            None => println!("  finished in {}", span_of_time(record.wall_s)),
            Some(why) => {
                println!("  FAILED after {}: {why}", span_of_time(record.wall_s));
                failed.push(piece.name.as_str());
            }
        }
        page::write(folder, pieces)?;
    }
    println!("{}", folder.path.join("index.html").display());
    ensure!(failed.is_empty(), "{} of {} pieces failed: {}", failed.len(), chosen.len(), failed.join(", "));
    Ok(())
}

/// Runs a piece to its end and keeps how it went. What it prints goes into `log.txt`.
fn make(folder: &Folder, piece: &Piece, mut command: Command) -> anyhow::Result<Record> {
    folder.clear(piece)?;
    let path = folder.of(piece).join("log.txt");
    let log = File::create(&path).with_context(|| path.display().to_string())?;
    command.stdin(Stdio::null()).stdout(log.try_clone()?).stderr(log);
    let began = Instant::now();
    let status = command.status();
    let wall_s = began.elapsed().as_secs_f64();
    let failed = match status {
        Ok(status) if status.success() => folder.found(piece).err().map(|error| format!("{error:#}")),
        Ok(status) => Some(format!("{status}: {}", last_line(&path))),
        Err(error) => Some(format!("it could not be started: {error}")),
    };
    let record = Record { command: piece.command.clone(), source: folder.source.clone(), wall_s, failed };
    folder.keep(piece, &record)?;
    Ok(record)
}

fn last_line(log: &Path) -> String {
    let bytes = std::fs::read(log).unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it printed nothing").to_owned()
}

/// The time that went by, and about how much is to come.
fn how_far(folder: &Folder, pieces: &[Piece], left: &[&Piece], began: Instant) -> String {
    let took = |piece: &Piece| match folder.status(piece) {
        Status::Finished(record, _) => Some(record.wall_s),
        _ => None,
    };
    let taken: Vec<(&str, f64)> = pieces.iter().filter_map(|piece| Some((piece.topic(), took(piece)?))).collect();
    let left: Vec<&str> = left.iter().filter(|piece| took(piece).is_none()).map(|piece| piece.topic()).collect();
    let gone = span_of_time(began.elapsed().as_secs_f64());
    match rest_s(&taken, &left) {
        Some(rest_s) => format!("{gone} so far, about {} to go", span_of_time(rest_s)),
        None => format!("{gone} so far"),
    }
}

/// What the pieces that are left will take, by their topics: each as long as those of its topic that are finished, on average,
/// or as all that are. `None` where none is.
fn rest_s(taken: &[(&str, f64)], left: &[&str]) -> Option<f64> {
    let mean_s = |topic: Option<&str>| {
        let of_topic = taken.iter().filter(|(taken, _)| topic.is_none_or(|topic| *taken == topic));
        let times_s: Vec<f64> = of_topic.map(|(_, wall_s)| *wall_s).collect();
        (!times_s.is_empty()).then(|| times_s.iter().sum::<f64>() / times_s.len() as f64)
    };
    left.iter().map(|topic| mean_s(Some(topic)).or(mean_s(None))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_told_by_what_is_finished_of_its_topic() {
        assert_eq!(rest_s(&[], &["codec"]), None);
        let taken = [("codec", 2.0), ("codec", 4.0), ("shadows", 30.0)];
        assert_eq!(rest_s(&taken, &["codec", "shadows"]), Some(33.0));
        assert_eq!(rest_s(&taken, &["timing"]), Some(12.0), "the mean of all");
        assert_eq!(rest_s(&taken, &[]), Some(0.0));
    }
}
