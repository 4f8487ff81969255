//! The log of `vantage-server`: lines to stderr, which nobody who serves waits for.
//!
//! A thread of its own writes them. Where the other end of a pipe takes nothing, or a disk is full, lines are lost, and counted, and nothing else is: the queue before that
//! thread is bounded.

use std::io::{IsTerminal, Write};
use std::sync::OnceLock;

use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::EnvFilter;

use crate::port_options::LogFormat;

/// Lines that wait at most: some seconds of a busy server's.
const LINES: usize = 1024;
/// What is logged unless `RUST_LOG` says otherwise.
const USUAL: &str = "info,wgpu=error,wgpu_core=error,wgpu_hal=off,naga=error,async_nats=error";

static LOST: OnceLock<ErrorCounter> = OnceLock::new();

/// Starts the log of this process. Lines that wait when the guard is dropped are written then, as far as somebody takes them.
pub fn start(format: LogFormat) -> WorkerGuard {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(USUAL));
    let (writer, guard) = NonBlockingBuilder::default()
        .lossy(true)
        .buffered_lines_limit(LINES)
        .thread_name("log")
        .finish(std::io::stderr());
    let _ = LOST.set(writer.error_counter());
    let log = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(writer);
    match format {
        LogFormat::Text => log.with_target(false).init(),
        LogFormat::Json => log.json().flatten_event(true).init(),
    }
    // What panics is met where it happens; its place is said here, and not to a stderr that may hold it up.
    std::panic::set_hook(Box::new(|panic| tracing::error!("{panic}")));
    guard
}

/// Lines that nobody took.
pub fn lost_lines() -> usize {
    LOST.get().map_or(0, ErrorCounter::dropped_lines)
}

/// Says something on stdout or stderr beside the log, where there is anybody to hear it.
pub fn say(mut to: impl Write, line: impl std::fmt::Display) {
    let _ = writeln!(to, "{line}").and_then(|()| to.flush());
}
