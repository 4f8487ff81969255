//! Pictures and statistics on disk. A thread encodes, so that writing never slows a run in real time.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use super::error::HeadlessError;
use super::report::Summary;

/// Pictures that wait for the encoder at most: a second's worth at 640x360, 60 MB.
const QUEUE_PICTURES: usize = 60;

struct Job {
    frame: usize,
    rgba: Vec<u8>,
}

/// A folder of pictures that is being written.
pub(super) struct Writer {
    folder: PathBuf,
    jobs: SyncSender<Job>,
    thread: JoinHandle<Result<(), HeadlessError>>,
}

impl Writer {
    /// Makes the folder.
    pub fn start(folder: &Path, size_px: (u32, u32)) -> Result<Writer, HeadlessError> {
        std::fs::create_dir_all(folder).map_err(|error| write_error(folder, &error))?;
        let (jobs, jobs_out) = sync_channel::<Job>(QUEUE_PICTURES);
        let to = folder.to_owned();
        let thread = std::thread::Builder::new()
            .name("png".to_owned())
            .spawn(move || jobs_out.into_iter().try_for_each(|job| write_frame(&to, size_px, &job)))
            .map_err(HeadlessError::Thread)?;
        Ok(Writer { folder: folder.to_owned(), jobs, thread })
    }

    /// Queues a picture.
    pub fn push(&self, frame: usize, rgba: Vec<u8>) {
        // The thread ends early only with an error, which `finish` returns.
        let _ = self.jobs.send(Job { frame, rgba });
    }

    /// Waits for the pictures and writes the statistics.
    pub fn finish(self, summary: &Summary) -> Result<(), HeadlessError> {
        drop(self.jobs);
        self.thread.join().expect("the encoder does not panic")?;
        let path = self.folder.join("stats.json");
        let text = serde_json::to_string_pretty(summary).map_err(|error| write_error(&path, &error))?;
        std::fs::write(&path, text).map_err(|error| write_error(&path, &error))
    }
}

/// `frame_00000.png`, opaque, and `covered_00000.png`: 255 where there is a sample.
fn write_frame(folder: &Path, size_px: (u32, u32), job: &Job) -> Result<(), HeadlessError> {
    let rgb: Vec<u8> = job.rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    let covered: Vec<u8> = job.rgba.iter().skip(3).step_by(4).copied().collect();
    write_png(&folder.join(format!("frame_{:05}.png", job.frame)), size_px, &rgb, ExtendedColorType::Rgb8)?;
    write_png(&folder.join(format!("covered_{:05}.png", job.frame)), size_px, &covered, ExtendedColorType::L8)
}

fn write_png(
    path: &Path,
    (width, height): (u32, u32),
    bytes: &[u8],
    colour: ExtendedColorType,
) -> Result<(), HeadlessError> {
    let file = std::fs::File::create(path).map_err(|error| write_error(path, &error))?;
    let file = std::io::BufWriter::new(file);
    PngEncoder::new_with_quality(file, CompressionType::Fast, FilterType::Adaptive)
        .write_image(bytes, width, height, colour)
        .map_err(|error| write_error(path, &error))
}

fn write_error(path: &Path, why: &dyn std::fmt::Display) -> HeadlessError {
    HeadlessError::Write { path: path.to_owned(), why: why.to_string() }
}
