//! A NATS broker for one report.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use server::broker::Broker;

use crate::spent;

/// What it takes to begin to listen at most.
const STARTS_WITHIN: Duration = Duration::from_secs(20);

/// A broker that runs until it is dropped.
pub(super) struct RunningBroker {
    process: Child,
    folder: PathBuf,
}

impl RunningBroker {
    /// On a free port of loopback; gives what servers and relays are told of it.
    pub fn start() -> anyhow::Result<(RunningBroker, Broker)> {
        let folder = std::env::temp_dir().join(format!("vantage-report-broker-{}", std::process::id()));
        std::fs::create_dir_all(&folder)?;
        let process = Command::new("nats-server")
            .args(["-a", "127.0.0.1", "-p", "-1", "--ports_file_dir"])
            .arg(&folder)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .context("no nats-server on the PATH (Debian's package nats-server)")?;
        let broker = RunningBroker { process, folder };
        let file = broker.folder.join(format!("nats-server_{}.ports", broker.process.id()));
        let begun = Instant::now();
        loop {
            let ports = std::fs::read_to_string(&file).ok().and_then(|text| serde_json::from_str(&text).ok());
            let address = ports.as_ref().and_then(|ports: &serde_json::Value| ports["nats"][0].as_str());
            if let Some(address) = address {
                let named = Broker { address: address.parse()?, channel: "report".to_owned() };
                return Ok((broker, named));
            }
            if begun.elapsed() > STARTS_WITHIN {
                bail!("the broker does not listen");
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Its processor time so far, in seconds.
    pub fn spent_s(&self) -> Option<f64> {
        spent::of_process(self.process.id())
    }
}

impl Drop for RunningBroker {
    fn drop(&mut self) {
        // It may have ended by itself.
        drop(self.process.kill());
        drop(self.process.wait());
        drop(std::fs::remove_dir_all(&self.folder));
    }
}
