//! The log of a test's process, as lines of JSON.
#![allow(dead_code, reason = "each test file uses a part")]

use std::io::Write;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use serde_json::Value;

/// What was written.
#[derive(Clone, Default)]
pub struct Log(Arc<Mutex<Vec<u8>>>);

/// The one of this process, which begins when it is first asked for.
pub static LOG: LazyLock<Log> = LazyLock::new(|| {
    let log = Log::default();
    let to = log.clone();
    let filter = tracing_subscriber::EnvFilter::new(
        "debug,tungstenite=off,tokio_tungstenite=off,vantage_server=trace,audit=trace",
    );
    tracing_subscriber::fmt().with_env_filter(filter).json().flatten_event(true).with_writer(move || to.clone()).init();
    log
});

impl Log {
    /// Everything so far.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.0.lock().unwrap_or_else(PoisonError::into_inner)).into_owned()
    }

    /// Lines of a target.
    pub fn of(&self, target: &str) -> Vec<Value> {
        let lines =
            self.text().lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect::<Vec<Value>>();
        lines.into_iter().filter(|line| line["target"] == target).collect()
    }
}

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
