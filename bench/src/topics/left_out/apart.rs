//! A scene in a process of its own: software Vulkan keeps what it compiled, about a gigabyte a scene, until a process ends.

use std::process::{Command, Stdio};

use anyhow::{Context, ensure};

use crate::report::Row;
use crate::topic::{Run, scene_label};

/// The rows of one scene, as another process of this program finds them. What it writes stays beside this one's files.
pub fn rows(topic: &str, run: &Run, scene: &str) -> anyhow::Result<Vec<Row>> {
    let out = run.out.join(scene_label(scene));
    let mut command = Command::new(std::env::current_exe()?);
    command.args([topic, "--scene", scene, "--out"]).arg(&out).stdout(Stdio::null());
    if run.quick {
        command.arg("--quick");
    }
    if let Some(trace) = &run.trace {
        command.arg("--trace").arg(trace);
    }
    if let Some((width_px, height_px)) = run.size_px {
        command.arg("--size").arg(format!("{width_px}x{height_px}"));
    }
    let path = out.join(format!("{topic}.json"));
    // Of an earlier run.
    let _ = std::fs::remove_file(&path);
    // A missed bar is an exit code, too: what counts is what was written.
    let status = command.status()?;
    let text = std::fs::read_to_string(&path).with_context(|| format!("it ended with {status}"))?;
    let mut report: serde_json::Value = serde_json::from_str(&text)?;
    let rows: Vec<Row> = serde_json::from_value(report["rows"].take())?;
    ensure!(!rows.is_empty(), "it found nothing");
    Ok(rows)
}
