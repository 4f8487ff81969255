//! The server's program goes on where the system gives it little: a disk that is full, a pipe that nobody reads, few open files.
#![cfg(unix)]

use std::fs::OpenOptions;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A debug server on a software adapter takes a while to be ready.
const PATIENCE: Duration = Duration::from_secs(120);

struct Server {
    process: Child,
    addr: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.process.kill());
        drop(self.process.wait());
    }
}

/// A server whose log goes somewhere.
fn started(stderr: Stdio) -> Server {
    started_by(Command::new(env!("CARGO_BIN_EXE_vantage-server")), stderr)
}

/// The same by a command that becomes the server.
fn started_by(mut command: Command, stderr: Stdio) -> Server {
    let mut process = command
        .args(["pillars", "--port", "0", "--image-size", "64", "--log-format", "json"])
        .env("RUST_LOG", "info,wgpu=off")
        .stdout(Stdio::piped())
        .stderr(stderr)
        .spawn()
        .expect("the server starts");
    let mut url = String::new();
    BufReader::new(process.stdout.take().expect("piped")).read_line(&mut url).expect("its address");
    let addr = url.trim().trim_start_matches("http://").to_owned();
    assert!(!addr.is_empty(), "it says where it listens");
    Server { process, addr }
}

fn asked(addr: &str, path: &str) -> Option<String> {
    let mut stream = TcpStream::connect(addr).ok()?;
    stream.set_read_timeout(Some(PATIENCE)).ok()?;
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {addr}\r\nConnection: close\r\n\r\n").ok()?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).ok()?;
    Some(answer)
}

/// Asks for a websocket as a page of another site, which is a line of the log.
fn is_refused(addr: &str) {
    let mut stream = TcpStream::connect(addr).expect("connect");
    stream.set_read_timeout(Some(PATIENCE)).expect("a time-out");
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    write!(stream, "GET /ws HTTP/1.1\r\nHost: {addr}\r\nOrigin: http://evil.example\r\n{upgrade}\r\n\r\n")
        .expect("write");
    let mut start = [0; 12];
    stream.read_exact(&mut start).expect("an answer");
    assert!(start.starts_with(b"HTTP/1.1 "), "{start:?}");
}

/// It becomes ready, and answers many requests, all of which it logs.
fn goes_on(server: &Server) -> String {
    let begun = Instant::now();
    while !asked(&server.addr, "/readyz").is_some_and(|answer| answer.starts_with("HTTP/1.1 200")) {
        assert!(begun.elapsed() < PATIENCE, "the server is not ready");
        std::thread::sleep(Duration::from_millis(100));
    }
    for _ in 0..300 {
        is_refused(&server.addr);
    }
    assert!(asked(&server.addr, "/healthz").is_some_and(|answer| answer.contains("\"ok\":true")));
    asked(&server.addr, "/metrics").expect("figures")
}

#[test]
fn a_full_disk_stops_nothing() {
    let full = OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    goes_on(&started(full.into()));
}

#[test]
fn a_pipe_that_nobody_reads_holds_up_nothing_and_lost_lines_are_counted() {
    let mut server = started(Stdio::piped());
    let nobody_reads = server.process.stderr.take().expect("piped");
    let mut figures = goes_on(&server);
    let lost = |figures: &str| -> f64 {
        let line = figures.lines().find_map(|line| line.strip_prefix("vantage_log_lines_lost_total "));
        line.expect("it is told").parse().expect("a number")
    };
    let begun = Instant::now();
    while lost(&figures) == 0.0 {
        assert!(begun.elapsed() < PATIENCE, "a pipe of 64 KiB takes only so many lines");
        figures = goes_on(&server);
    }
    drop(nobody_reads);
    goes_on(&server);
}

#[test]
fn few_open_files_are_enough_and_who_comes_when_none_is_left_is_told() {
    const FILES: usize = 120;
    let mut shell = Command::new("sh");
    let limited = format!("ulimit -n {FILES} && exec \"$0\" \"$@\"");
    shell.args(["-c", &limited, env!("CARGO_BIN_EXE_vantage-server")]);
    let server = started_by(shell, Stdio::null());
    goes_on(&server);
    let held: Vec<TcpStream> = (0..2 * FILES).map(|_| TcpStream::connect(&server.addr).expect("connect")).collect();
    let told = |mut stream: TcpStream| {
        stream.set_read_timeout(Some(PATIENCE)).expect("a time-out");
        drop(write!(stream, "GET /livez HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", server.addr));
        let mut answer = String::new();
        drop(stream.read_to_string(&mut answer));
        answer
    };
    let answers: Vec<String> = held.into_iter().rev().map(told).collect();
    let with = |start: &str| answers.iter().filter(|answer| answer.starts_with(start)).count();
    assert!(with("HTTP/1.1 200") >= 30, "{} of {} were let in", with("HTTP/1.1 200"), answers.len());
    assert!(with("HTTP/1.1 503") >= 60, "{} of {} were told that it is full", with("HTTP/1.1 503"), answers.len());
    goes_on(&server);
}
