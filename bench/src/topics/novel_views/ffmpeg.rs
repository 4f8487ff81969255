//! H.264 by ffmpeg and libx264, as a process of its own.

use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, ensure};

use crate::compare::Picture;

/// A coded stream.
pub struct Coded {
    /// H.264 in Annex B, without a container.
    pub bytes: Vec<u8>,
    /// Real milliseconds that coding took, with the start of the process.
    pub ms: f64,
}

/// Whether the tool is there.
pub fn is_installed(tool: &Path) -> bool {
    Command::new(tool).arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok()
}

/// Codes pictures of one size for a live viewer: no look-ahead, no frames out of order (`zerolatency`), 4:2:0, one key frame
/// at the beginning, a rate control whose buffer holds [`BUFFER_PICTURES`].
pub fn encode(tool: &Path, pictures: &[Picture], hz: f64, mbit: f64) -> anyhow::Result<Coded> {
    let first = pictures.first().context("no picture")?;
    let (size, rate) = (format!("{}x{}", first.width_px, first.height_px), format!("{hz}"));
    let (bits, buffer) = (format!("{:.0}", mbit * 1e6), format!("{:.0}", mbit * 1e6 / hz * BUFFER_PICTURES));
    let mut command = Command::new(tool);
    command.args("-v error -f rawvideo -pix_fmt rgb24".split(' ')).args(["-s", &size, "-r", &rate, "-i", "pipe:0"]);
    command.args(["-vf", SCALE]).args("-c:v libx264 -preset veryfast -tune zerolatency -pix_fmt yuv420p".split(' '));
    command.args(["-g", "100000", "-b:v", &bits, "-maxrate", &bits, "-bufsize", &buffer, "-f", "h264", "pipe:1"]);
    let started = Instant::now();
    let bytes = through(command, pictures.iter().map(|picture| picture.rgb.as_slice()))?;
    Ok(Coded { bytes, ms: started.elapsed().as_secs_f64() * 1e3 })
}

/// Exact conversions between RGB and YUV: ffmpeg's quick ones, its defaults, cost 0.03 of FLIP on a lossless stream.
const SCALE: &str = "scale=flags=lanczos+accurate_rnd+full_chroma_int+full_chroma_inp";

/// How much of the stream may wait, in pictures' worth of bits: a sixth of a second, which keeps the delay of a live stream small.
const BUFFER_PICTURES: f64 = 5.0;

/// Decodes a stream into pictures of the size of `like`.
pub fn decode(tool: &Path, stream: &[u8], like: &Picture) -> anyhow::Result<Vec<Picture>> {
    let mut command = Command::new(tool);
    command.args("-v error -f h264 -i pipe:0 -fps_mode passthrough".split(' '));
    command.args(["-vf", SCALE]).args("-f rawvideo -pix_fmt rgb24 pipe:1".split(' '));
    let rgb = through(command, std::iter::once(stream))?;
    ensure!(rgb.len() % like.rgb.len() == 0, "ffmpeg gave {} bytes, no whole pictures", rgb.len());
    let picture = |rgb: &[u8]| Picture { rgb: rgb.to_vec(), covered: None, ..*like };
    Ok(rgb.chunks_exact(like.rgb.len()).map(picture).collect())
}

/// Writes pictures of one size as an animated WebP without an end.
pub fn animate(
    tool: &Path,
    pictures: impl Iterator<Item = Picture> + Send,
    hz: f64,
    path: &Path,
) -> anyhow::Result<()> {
    let mut pictures = pictures.peekable();
    let first = pictures.peek().context("no picture")?;
    let (size, rate) = (format!("{}x{}", first.width_px, first.height_px), format!("{hz}"));
    let mut command = Command::new(tool);
    command.args("-v error -y -f rawvideo -pix_fmt rgb24".split(' '));
    command.args(["-s", &size, "-r", &rate, "-i", "pipe:0"]);
    command.args("-c:v libwebp_anim -quality 70 -compression_level 6 -loop 0".split(' ')).arg(path);
    through(command, pictures.map(|picture| picture.rgb)).map(drop)
}

/// Feeds a process and gives what it says; an error holds its own words.
fn through(mut command: Command, input: impl Iterator<Item: AsRef<[u8]>> + Send) -> anyhow::Result<Vec<u8>> {
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let mut stdin = child.stdin.take().context("stdin is piped")?;
    let output = std::thread::scope(|scope| {
        scope.spawn(move || {
            for bytes in input {
                match stdin.write_all(bytes.as_ref()) {
                    // It ended early and says why on its own.
                    Err(error) if error.kind() == ErrorKind::BrokenPipe => return,
                    result => result.expect("a pipe takes bytes or is broken"),
                }
            }
        });
        child.wait_with_output()
    })?;
    ensure!(output.status.success(), "ffmpeg: {}", String::from_utf8_lossy(&output.stderr).trim());
    Ok(output.stdout)
}
