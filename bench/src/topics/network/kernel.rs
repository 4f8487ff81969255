//! A path that the kernel makes: a server in a network namespace of its own, behind a pair of virtual interfaces that let through so much and queue the rest (`tc`, token bucket).
//! Nothing of it is our own code, TCP and its congestion control neither. It takes Linux, root, `ip` and `tc`.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};

use crate::programs;

/// The two ends; of a range for private networks.
const HERE: &str = "10.213.77.1";
const THERE: &str = "10.213.77.2";
const PORT: u16 = 8080;
/// Anything but loopback takes one.
const TOKEN: &str = "report";
/// What goes through at once after a pause: a packet and a half, so that the queue is what delays. More would be a second buffer before it.
const BURST_BYTES: u32 = 2500;
const LOADS_WITHIN: Duration = Duration::from_secs(120);

/// A server behind such a path. Dropping it ends both.
pub(super) struct KernelPath {
    namespace: String,
    server: Option<Child>,
}

impl KernelPath {
    /// Starts a server for a scene behind a path of so many kilobits a second with a queue of so many milliseconds.
    pub fn start(scene: &str, image_px: u32, (kbit, queue_ms): (u32, u32)) -> anyhow::Result<KernelPath> {
        let taken = output("ip -br addr")?;
        ensure!(
            !taken.contains(HERE),
            "{HERE} is taken, as by a run that was killed: end its server, and `ip link del` its interface"
        );
        let namespace = format!("vantage-{}", std::process::id());
        let mut path = KernelPath { namespace: namespace.clone(), server: None };
        let (here, there) =
            (format!("vtg{}a", std::process::id() % 100_000), format!("vtg{}b", std::process::id() % 100_000));
        run(&format!("ip netns add {namespace}"))?;
        run(&format!("ip link add {here} type veth peer name {there} netns {namespace}"))?;
        run(&format!("ip addr add {HERE}/30 dev {here}"))?;
        run(&format!("ip link set {here} up"))?;
        let within = format!("ip netns exec {namespace}");
        run(&format!("{within} ip addr add {THERE}/30 dev {there}"))?;
        run(&format!("{within} ip link set {there} up"))?;
        run(&format!("{within} ip link set lo up"))?;
        for (prefix, device) in [(String::new(), &here), (format!("{within} "), &there)] {
            run(&format!(
                "{prefix}tc qdisc add dev {device} root tbf rate {kbit}kbit burst {BURST_BYTES} latency {queue_ms}ms"
            ))?;
        }
        path.server = Some(path.spawn(&programs::server()?, scene, image_px)?);
        path.wait_until_ready()?;
        Ok(path)
    }

    /// Where the server is.
    pub fn url(&self) -> String {
        format!("ws://{THERE}:{PORT}/ws?token={TOKEN}")
    }

    fn spawn(&self, server: &Path, scene: &str, image_px: u32) -> anyhow::Result<Child> {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.namespace]).arg(server).arg(scene);
        command.args(["--bind", THERE, "--port", &PORT.to_string(), "--token", TOKEN, "--anticipation", "off"]);
        command.args(["--bodies", "off", "--image-size", &image_px.to_string()]);
        let quiet = command.env("RUST_LOG", "warn").stdin(Stdio::null()).stdout(Stdio::null());
        quiet.spawn().with_context(|| format!("cannot start {}", server.display()))
    }

    fn wait_until_ready(&mut self) -> anyhow::Result<()> {
        let begun = Instant::now();
        while begun.elapsed() < LOADS_WITHIN {
            if is_ready().unwrap_or(false) {
                return Ok(());
            }
            if let Some(server) = &mut self.server
                && let Some(status) = server.try_wait()?
            {
                bail!("the server ended: {status}");
            }
            std::thread::sleep(Duration::from_millis(200));
        }
        bail!("the server was not ready within {} s", LOADS_WITHIN.as_secs())
    }
}

impl Drop for KernelPath {
    fn drop(&mut self) {
        if let Some(server) = &mut self.server {
            // It may have ended by itself.
            drop(server.kill());
            drop(server.wait());
        }
        // The interfaces go with their namespace.
        if let Err(error) = run(&format!("ip netns del {}", self.namespace)) {
            tracing::warn!("a network namespace is left: {error:#}");
        }
    }
}

fn is_ready() -> std::io::Result<bool> {
    let mut stream =
        TcpStream::connect_timeout(&format!("{THERE}:{PORT}").parse().expect("an address"), Duration::from_secs(1))?;
    stream.set_read_timeout(Some(Duration::from_secs(2)))?;
    stream.write_all(format!("GET /readyz HTTP/1.1\r\nHost: {THERE}\r\nConnection: close\r\n\r\n").as_bytes())?;
    let mut answer = [0; 12];
    stream.read_exact(&mut answer)?;
    Ok(answer.ends_with(b"200"))
}

/// Runs a command of words without spaces.
fn run(command: &str) -> anyhow::Result<()> {
    output(command).map(drop)
}

/// The same, for what it prints.
fn output(command: &str) -> anyhow::Result<String> {
    let mut words = command.split(' ');
    let program = words.next().context("no command")?;
    let output = Command::new(program).args(words).output().with_context(|| format!("cannot run {program}"))?;
    ensure!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr).trim());
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
