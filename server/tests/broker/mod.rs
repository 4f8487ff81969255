//! A real NATS broker on loopback, where this machine has one.
#![allow(dead_code, reason = "each test file uses a part")]

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use vantage_server::broker::Broker;

/// A broker that runs until it is dropped.
pub struct RunningBroker {
    process: Child,
    folder: PathBuf,
    /// Where it listens.
    pub port: u16,
}

impl RunningBroker {
    /// On a free port; `None`, with a word about it, where there is no `nats-server`.
    pub fn start() -> Option<RunningBroker> {
        let broker = RunningBroker::on("-1");
        if broker.is_none() {
            println!("skipped: there is no nats-server on the PATH");
        }
        broker
    }

    fn on(port: &str) -> Option<RunningBroker> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("vantage-broker-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let process = Command::new("nats-server")
            .args(["-a", "127.0.0.1", "-p", port, "--ports_file_dir"])
            .arg(&folder)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let file = folder.join(format!("nats-server_{}.ports", process.id()));
        let mut broker = RunningBroker { process, folder, port: 0 };
        let begun = Instant::now();
        while broker.port == 0 {
            assert!(begun.elapsed() < Duration::from_secs(20), "the broker does not listen");
            std::thread::sleep(Duration::from_millis(10));
            broker.port = listens_on(&file).unwrap_or(0);
        }
        Some(broker)
    }

    /// As servers and relays are told of it.
    pub fn named(&self) -> Broker {
        let address = format!("nats://127.0.0.1:{}", self.port).parse().expect("an address");
        Broker { address, channel: "a test, in short".to_owned() }
    }

    /// Ends it at once; gives what starts one in its place.
    pub fn kill(mut self) -> impl FnOnce() -> RunningBroker {
        let port = self.port.to_string();
        self.end();
        move || RunningBroker::on(&port).expect("it was there before")
    }

    fn end(&mut self) {
        // It may have ended by itself.
        drop(self.process.kill());
        drop(self.process.wait());
    }
}

impl Drop for RunningBroker {
    fn drop(&mut self) {
        self.end();
        drop(std::fs::remove_dir_all(&self.folder));
    }
}

/// The port that the broker wrote down, once it has.
fn listens_on(file: &Path) -> Option<u16> {
    let text = std::fs::read_to_string(file).ok()?;
    let ports: serde_json::Value = serde_json::from_str(&text).ok()?;
    ports["nats"][0].as_str()?.rsplit(':').next()?.parse().ok()
}
