//! Scores of a run: a folder of frames against a folder of truths.
//!
//! Frames are named `frame_00000.png` and so on, as the viewer writes them. A truth may have `covered_00000.png` beside it
//! (255 where there is a surface) or an alpha channel; without either every pixel counts as covered. `smooth_00000.png`, the
//! truth with 16 samples a pixel, gives a second FLIP. A frame may say where it had no sample by an alpha channel of 0, and a
//! `stats.json` beside the frames gives each frame's `uncovered_share`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use rayon::prelude::*;
use serde::Serialize;

use super::{FlipMeans, MEASURES, Picture, PictureError, Scores, flicker, flip_means, score};
use crate::report::progress::Progress;
use crate::report::table::{Table, number};
use crate::spread::Spread;

/// A frame's figures.
#[derive(Debug, Clone, Serialize)]
pub struct FrameRow {
    /// The number in its name.
    pub frame: u32,
    /// Its scores.
    #[serde(flatten)]
    pub scores: Scores,
    /// Against the frame before; `None` for the first and after a gap.
    pub flicker: Option<f64>,
    /// FLIP against the truth with 16 samples a pixel, where there is one.
    pub flip_16x: Option<FlipMeans>,
    /// What the viewer itself counted as uncovered, as a share of all pixels.
    pub uncovered_share: Option<f64>,
}

impl FrameRow {
    /// The value of one of [`MEASURES`].
    pub fn measure(&self, name: &str) -> Option<f64> {
        match name {
            "flip" => Some(self.scores.flip),
            "flip_covered" => self.scores.flip_covered,
            "ssim" => Some(self.scores.ssim),
            "psnr_db" => Some(self.scores.psnr_db),
            "flicker" => self.flicker,
            "holes_share" => self.scores.holes_share,
            "flip_band" => self.scores.flip_band,
            "flip_16x" => self.flip_16x.map(|means| means.all),
            "flip_16x_covered" => self.flip_16x.and_then(|means| means.covered),
            "flip_16x_band" => self.flip_16x.and_then(|means| means.band),
            "false_cover_share" => self.scores.false_cover_share,
            "uncovered_share" => self.uncovered_share,
            "covered_share" => Some(self.scores.covered_share),
            _ => None,
        }
    }
}

/// The scores of a run.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Where the frames lie.
    pub frames: PathBuf,
    /// Where the truth lies.
    pub truth: PathBuf,
    /// Measures that have values, with their spread over the frames.
    pub summary: BTreeMap<&'static str, Spread>,
    /// A row a frame.
    pub rows: Vec<FrameRow>,
}

/// Scores every frame of a folder. A frame without its truth is an error; a truth without a frame is not.
pub fn compare_folders(frames: &Path, truth: &Path) -> anyhow::Result<Comparison> {
    let (frame_files, truth_files) = (numbered(frames, "frame_")?, numbered(truth, "frame_")?);
    let (truth_masks, smooth) = (numbered(truth, "covered_")?, numbered(truth, "smooth_")?);
    let frame_masks = numbered(frames, "covered_")?;
    let uncovered = uncovered_shares(&frames.join("stats.json"))?;
    if frame_files.is_empty() {
        bail!("{}: holds no frame_00000.png", frames.display());
    }
    if let Some(missing) = frame_files.keys().find(|number| !truth_files.contains_key(number)) {
        bail!("{}: holds no truth for frame {missing}", truth.display());
    }
    let load = |number: u32| -> anyhow::Result<(Picture, Picture)> {
        let read = |files: &BTreeMap<u32, PathBuf>, masks: &BTreeMap<u32, PathBuf>| {
            let mut picture = Picture::read(&files[&number])?;
            if let Some(mask) = masks.get(&number) {
                picture.read_covered(mask)?;
            }
            anyhow::Ok(picture)
        };
        Ok((read(&frame_files, &frame_masks)?, read(&truth_files, &truth_masks)?))
    };
    let progress = Progress::new("comparing", frame_files.len() as u64);
    let rows = frame_files
        .par_iter()
        .map(|(&number, path)| {
            let (frame, truth) = load(number)?;
            let scores = score(&frame, &truth, None).with_context(|| path.display().to_string())?;
            let before = number.checked_sub(1).filter(|before| frame_files.contains_key(before));
            let flicker = before
                .map(|before| {
                    let (frame_before, truth_before) = load(before)?;
                    anyhow::Ok(flicker((&frame_before, &frame), (&truth_before, &truth))?)
                })
                .transpose()?;
            let flip_16x = smooth.get(&number).map(|path| smooth_flip(&frame, &truth, path)).transpose()?;
            progress.step();
            Ok(FrameRow { flip_16x, frame: number, scores, flicker, uncovered_share: uncovered.get(&number).copied() })
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    Ok(Comparison { frames: frames.to_owned(), truth: truth.to_owned(), summary: summarize(&rows), rows })
}

fn smooth_flip(frame: &Picture, truth: &Picture, smooth: &Path) -> Result<FlipMeans, PictureError> {
    flip_means(frame, &Picture::read(smooth)?, truth.covered.as_deref(), None)
}

/// The spread of every measure that has values.
pub fn summarize(rows: &[FrameRow]) -> BTreeMap<&'static str, Spread> {
    let spread = |name, better| {
        let values: Vec<f64> = rows.iter().filter_map(|row| row.measure(name)).collect();
        Spread::of(&values, better)
    };
    MEASURES.iter().filter_map(|&(name, better)| Some((name, spread(name, better)?))).collect()
}

/// The files `PREFIXnumber.png` of a folder by number.
fn numbered(folder: &Path, prefix: &str) -> anyhow::Result<BTreeMap<u32, PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("{}", folder.display()))?;
    let mut files = BTreeMap::new();
    for entry in entries {
        let path = entry?.path();
        let number = path
            .file_name()
            .and_then(|name| name.to_str())
            .and_then(|name| name.strip_prefix(prefix)?.strip_suffix(".png")?.parse().ok());
        if let Some(number) = number {
            files.insert(number, path);
        }
    }
    Ok(files)
}

/// `uncovered_share` of each frame of a viewer's statistics; empty where there is no such file.
fn uncovered_shares(path: &Path) -> anyhow::Result<BTreeMap<u32, f64>> {
    if !path.exists() {
        return Ok(BTreeMap::new());
    }
    let stats = crate::poses::read_stats(path)?;
    Ok(stats.iter().filter_map(|row| Some((row.frame, row.uncovered_share?))).collect())
}

impl Comparison {
    /// A row a frame, then mean, p95 and worst. Measures without a value are left out.
    pub fn table(&self) -> Table {
        let shown: Vec<&'static str> =
            MEASURES.iter().map(|&(name, _)| name).filter(|name| self.summary.contains_key(name)).collect();
        let mut table = Table::new(std::iter::once("frame").chain(shown.iter().copied()));
        for row in &self.rows {
            let values = shown.iter().map(|name| row.measure(name).map_or(String::new(), number));
            table.row(std::iter::once(row.frame.to_string()).chain(values));
        }
        for (label, pick) in [("mean", (|s| s.mean) as fn(&Spread) -> f64), ("p95", |s| s.p95), ("worst", |s| s.worst)]
        {
            let values = shown.iter().map(|name| number(pick(&self.summary[name])));
            table.row(std::iter::once(label.to_owned()).chain(values));
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_scored_frame_by_frame() {
        let folder = crate::report::scratch_folder("compare");
        let (frames, truth) = (folder.join("frames"), folder.join("truth"));
        for sub in [&frames, &truth] {
            std::fs::create_dir_all(sub).unwrap();
        }
        for (number, value) in [(0, 10), (1, 20), (3, 30)] {
            let mut picture = Picture::filled(16, 16, [value; 3]);
            picture.write(&frames.join(format!("frame_{number:05}.png"))).unwrap();
            picture.covered = Some((0..256).map(|index| index < 128).collect());
            picture.write(&truth.join(format!("frame_{number:05}.png"))).unwrap();
            picture.write_covered(&truth.join(format!("covered_{number:05}.png"))).unwrap();
        }
        Picture::filled(16, 16, [24; 3]).write(&frames.join("frame_00001.png")).unwrap();
        std::fs::write(frames.join("stats.json"), STATS).unwrap();

        let comparison = compare_folders(&frames, &truth).unwrap();
        let flickers: Vec<_> = comparison.rows.iter().map(|row| row.flicker).collect();
        assert_eq!(flickers, [None, Some(4.0), None]);
        assert_eq!(comparison.rows[0].scores.covered_share, 0.5);
        assert_eq!(comparison.rows[0].scores.psnr_db, 100.0);
        assert_eq!(comparison.rows[0].uncovered_share, Some(0.25));
        assert_eq!(comparison.summary["flicker"].count, 1);
        assert!(comparison.table().text().contains("worst"));

        std::fs::remove_file(truth.join("frame_00003.png")).unwrap();
        assert!(compare_folders(&frames, &truth).unwrap_err().to_string().contains("frame 3"));
        std::fs::remove_dir_all(folder).unwrap();
    }

    const STATS: &str = r#"[{"frame": 0, "t_s": 0.0, "scene_time_s": 0.5, "uncovered_share": 0.25,
        "world_from_eye": {"rotation": [0.0, 0.0, 0.0, 1.0], "translation": [1.0, 2.0, 3.0]}}]"#;
}
