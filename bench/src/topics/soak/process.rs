//! The server as a process of its own, and what it takes of the machine.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};

use crate::programs;

/// A server has so long to load its scene.
const STARTS_WITHIN: Duration = Duration::from_secs(300);
/// A server that is asked to stop has so long.
const STOPS_WITHIN: Duration = Duration::from_secs(10);

/// What a process takes at a moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Seconds of the run.
    pub at_s: f64,
    pub resident_bytes: u64,
    pub descriptors: u64,
    pub threads: u64,
}

/// See the module. It ends with its owner.
pub(super) struct Server {
    process: Child,
    /// `http://HOST:PORT`.
    url: String,
}

impl Server {
    /// Starts the one beside this program, whose log goes to a file, and waits until it serves.
    pub fn start(arguments: &[&str], log: &Path) -> anyhow::Result<Server> {
        let program = programs::server()?;
        let mut process = Command::new(&program)
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(File::create(log).with_context(|| log.display().to_string())?)
            .spawn()
            .with_context(|| program.display().to_string())?;
        let said = process.stdout.take().context("its output is piped")?;
        let mut url = String::new();
        BufReader::new(said).read_line(&mut url)?;
        let server = Server { process, url: url.trim().to_owned() };
        ensure!(server.url.starts_with("http://"), "the server did not start: see {}", log.display());
        let begun = Instant::now();
        while !server.is_ready() {
            ensure!(begun.elapsed() < STARTS_WITHIN, "the server is not ready: see {}", log.display());
            std::thread::sleep(Duration::from_millis(100));
        }
        Ok(server)
    }

    fn is_ready(&self) -> bool {
        let authority = self.url.trim_start_matches("http://");
        let ask = || -> std::io::Result<String> {
            let mut stream = TcpStream::connect(authority)?;
            write!(stream, "GET /readyz HTTP/1.0\r\nHost: {authority}\r\n\r\n")?;
            let mut answer = String::new();
            stream.read_to_string(&mut answer)?;
            Ok(answer)
        };
        ask().is_ok_and(|answer| answer.split(' ').nth(1) == Some("200"))
    }

    pub fn websocket(&self) -> String {
        self.url.replacen("http", "ws", 1)
    }

    /// What it takes now.
    pub fn sample(&self, at_s: f64) -> anyhow::Result<Sample> {
        let folder = format!("/proc/{}", self.process.id());
        let status = std::fs::read_to_string(format!("{folder}/status")).context("the server is gone")?;
        let figure = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            line.split_whitespace().next()?.parse::<u64>().ok()
        };
        Ok(Sample {
            at_s,
            resident_bytes: figure("VmRSS:").context("no memory is told")? * 1024,
            descriptors: std::fs::read_dir(format!("{folder}/fd"))?.count() as u64,
            threads: figure("Threads:").context("no threads are told")?,
        })
    }

    /// Asks it to stop, and waits until it has.
    pub fn stop(&mut self) -> anyhow::Result<()> {
        #[cfg(unix)]
        {
            use rustix::process::{Pid, Signal, kill_process};
            let id = Pid::from_raw(self.process.id() as i32).context("a process has a number")?;
            kill_process(id, Signal::TERM)?;
        }
        for _ in 0..STOPS_WITHIN.as_millis() / 50 {
            if let Some(status) = self.process.try_wait()? {
                ensure!(status.success(), "the server ended with {status}");
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        bail!("the server did not stop within {} s", STOPS_WITHIN.as_secs())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Where it has stopped there is nothing to end.
        drop(self.process.kill());
        drop(self.process.wait());
    }
}
