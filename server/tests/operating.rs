//! The program itself, as its operator sees it: settings, signals, figures, and what Agones is told.
#![cfg(unix)]

mod net;

use std::collections::HashSet;
use std::io::{BufRead, BufReader, Write};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, mpsc};
use std::time::{Duration, Instant};

use axum::Router;
use axum::http::{Method, StatusCode, Uri};
use net::{Client, VIEW, request_at};
use protocol::message::{Clock, Resume};
use protocol::session::{ClientConfig, SessionError};
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio_tungstenite::connect_async;

/// For what takes a moment on an idle machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// `vantage-server` with a scene file in a folder of its own, which is removed with it.
struct Program {
    child: Child,
    addr: SocketAddr,
    folder: PathBuf,
    log: mpsc::Receiver<String>,
}

impl Program {
    async fn start(name: &str) -> Program {
        Program::start_with(name, &[]).await
    }

    async fn start_with(name: &str, environment: &[(&str, String)]) -> Program {
        let folder = folder(name);
        write_scene(&folder, 1.0);
        let mut command = Command::new(env!("CARGO_BIN_EXE_vantage-server"));
        command
            .arg(folder.join("scene.obj"))
            .args(["--port", "0", "--image-size", "32", "--images", "1", "--rest", "off", "--anticipation", "off"])
            .envs(environment.iter().map(|(name, value)| (name, value)));
        let program = Program::run(command, folder);
        program.answers("/readyz", "ready").await;
        program
    }

    /// A relay of a broker that is not there, by a file of settings.
    fn relay(name: &str) -> Program {
        let folder = folder(name);
        let settings = folder.join("relay.toml");
        std::fs::write(&settings, "subscribe = \"nats://127.0.0.1:9\"\nmax-clients = 7\n").expect("a file");
        let mut command = Command::new(env!("CARGO_BIN_EXE_vantage-server"));
        command.arg("relay").arg("--config").arg(settings).env("VANTAGE_PORT", "0");
        Program::run(command, folder)
    }

    fn run(mut command: Command, folder: PathBuf) -> Program {
        let mut child =
            command.env("RUST_LOG", "info").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program");
        let mut url = String::new();
        BufReader::new(child.stdout.take().expect("piped")).read_line(&mut url).expect("where it listens");
        let addr = url.trim().trim_start_matches("http://").parse().expect("an address");
        let (lines, log) = mpsc::channel();
        let errors = BufReader::new(child.stderr.take().expect("piped"));
        std::thread::spawn(move || errors.lines().map_while(Result::ok).try_for_each(|line| lines.send(line)));
        Program { child, addr, folder, log }
    }

    /// Waits until it answers with a text.
    async fn answers(&self, path: &str, text: &str) {
        let begun = Instant::now();
        loop {
            let answer = request_at(self.addr, path, "").await;
            if answer.starts_with("HTTP/1.1 200") && answer.contains(text) {
                return;
            }
            assert!(begun.elapsed() < PATIENCE, "{path} never said {text:?}, but {answer}");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    fn signal(&self, name: &str) {
        let sent = Command::new("kill").args([&format!("-{name}"), &self.child.id().to_string()]).status();
        assert!(sent.expect("kill").success());
    }

    /// Waits until the log says a text.
    fn says(&self, text: &str) {
        while !self.log.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("the log never said {text:?}")).contains(text)
        {
        }
    }

    async fn client(&self, resume: Option<Resume>) -> Client {
        let socket = connect_async(format!("ws://{}/ws", self.addr)).await.expect("websocket").0;
        let mut client = Client::over(socket, ClientConfig { resume, ..ClientConfig::new(Clock::Wall, VIEW) });
        client.run(PATIENCE.as_secs_f64(), |client| !client.updates.is_empty()).await.expect("a session");
        client
    }

    /// Waits until it ends by itself, and says whether that was well.
    fn ends(&mut self) -> bool {
        let begun = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status.success();
            }
            assert!(begun.elapsed() < PATIENCE, "it does not end");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("vantage-signals-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// A triangle of so many metres.
fn write_scene(folder: &Path, size_m: f64) {
    let obj = format!("v 0 0 0\nv {size_m} 0 0\nv 0 {size_m} 0\nf 1 2 3\n");
    std::fs::write(folder.join("scene.obj"), obj).expect("a scene");
}

/// How the server ended a session, and whether to come again.
async fn goodbye(client: &mut Client) -> (String, bool) {
    match client.run(PATIENCE.as_secs_f64(), |_| false).await {
        Err(SessionError::Goodbye { reason, again }) => (reason, again),
        other => panic!("no goodbye: {other:?}"),
    }
}

fn width_m(client: &Client) -> f64 {
    let welcome = client.welcome.as_ref().expect("welcomed");
    welcome.bounds_max_world[0] - welcome.bounds_min_world[0]
}

#[tokio::test(flavor = "multi_thread")]
async fn a_signal_has_the_scene_loaded_anew() {
    let program = Program::start("reload").await;
    let mut client = program.client(None).await;
    assert!((width_m(&client) - 1.0).abs() < 1e-6);

    write_scene(&program.folder, 3.0);
    program.signal("HUP");
    let (reason, again) = goodbye(&mut client).await;
    assert!(reason.contains("loaded anew") && again, "{reason}");
    let secret = client.welcome.as_ref().expect("welcomed").secret;
    let resume = Resume { secret, number: client.held.number, digest: client.held.digest() };
    let mut back = program.client(Some(resume)).await;
    assert!((width_m(&back) - 3.0).abs() < 1e-6 && !back.welcome.as_ref().expect("welcomed").resumed);
    program.answers("/metrics", "\nvantage_scene_reloads_total 1\n").await;
    program.answers("/metrics", "\nvantage_scene_reload_failed 0\n").await;

    std::fs::remove_file(program.folder.join("scene.obj")).expect("removed");
    program.signal("HUP");
    program.answers("/metrics", "\nvantage_scene_reload_failed 1\n").await;
    program.says("the scene stays as it was");
    back.run(1.0, |_| false).await.expect("the session goes on");
    program.answers("/readyz", "ready").await;

    write_scene(&program.folder, 2.0);
    program.signal("HUP");
    program.answers("/metrics", "\nvantage_scene_reload_failed 0\n").await;
    assert!((width_m(&program.client(None).await) - 2.0).abs() < 1e-6);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_signal_ends_all_sessions_and_the_program() {
    let mut program = Program::start("stop").await;
    let mut client = program.client(None).await;
    program.signal("TERM");
    let (reason, again) = goodbye(&mut client).await;
    assert!(reason.contains("the server stops") && again, "{reason}");
    assert!(program.ends());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_signal_ends_it_at_once() {
    let mut program = Program::start("twice").await;
    // Half of a request, which is waited for.
    let mut stream = TcpStream::connect(program.addr).await.expect("connect");
    stream.write_all(b"GET /healthz HTTP/1.1\r\nHost:").await.expect("write");
    program.signal("TERM");
    program.says("no one is let in any more");
    program.signal("TERM");
    program.says("asked once more");
    assert!(program.ends());
}

#[tokio::test(flavor = "multi_thread")]
async fn figures_are_as_prometheus_wants_them() {
    for program in [Program::start("figures").await, Program::relay("relayed-figures")] {
        let Ok(mut promtool) =
            Command::new("promtool").args(["check", "metrics"]).stdin(Stdio::piped()).stderr(Stdio::piped()).spawn()
        else {
            println!("skipped: promtool is not there");
            return;
        };
        let answer = request_at(program.addr, "/metrics", "").await;
        let (_, figures) = answer.split_once("\r\n\r\n").expect("a body");
        for figure in ["vantage_sessions 0", "vantage_refused_total{what=\"server\"} 0", "vantage_faults_total 0"] {
            assert!(figures.lines().any(|line| line == figure), "{figure} in {figures}");
        }
        promtool.stdin.take().expect("piped").write_all(figures.as_bytes()).expect("written");
        let checked = promtool.wait_with_output().expect("promtool");
        let said = String::from_utf8_lossy(&checked.stderr);
        assert!(checked.status.success() && said.is_empty(), "{said}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_relay_is_run_as_a_server_is() {
    let mut relay = Program::relay("relay");
    relay.answers("/metrics", "\nvantage_sessions_most 7\n").await;
    let answer = request_at(relay.addr, "/", "").await;
    assert!(answer.contains("content-security-policy"), "{answer}");
    let answer = request_at(relay.addr, "/readyz", "").await;
    assert!(answer.starts_with("HTTP/1.1 503") && answer.contains("nats://127.0.0.1:9"), "{answer}");
    relay.signal("HUP");
    relay.says("not loaded anew");
    relay.answers("/livez", "alive").await;
    relay.signal("TERM");
    relay.says("no one is let in any more");
    assert!(relay.ends());
}

#[test]
fn the_example_settings_are_sound() {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../packaging/vantage-server.toml");
    let shown = Command::new(env!("CARGO_BIN_EXE_vantage-server"))
        .args(["--config", example, "--print-config"])
        .env("VANTAGE_TOKEN", "secret")
        .env("VANTAGE_MAX_CLIENTS", "7")
        .output()
        .expect("the program");
    let (shown, said) = (String::from_utf8_lossy(&shown.stdout), String::from_utf8_lossy(&shown.stderr));
    for line in [
        "max-clients = 7 # VANTAGE_MAX_CLIENTS",
        "# token is set and secret: VANTAGE_TOKEN",
        "update-hz = 10 # default",
    ] {
        assert!(shown.lines().any(|shown| shown == line), "{line} in {shown}{said}");
    }
    let of_file = format!("scene = \"pillars\" # {example}:");
    assert!(shown.lines().any(|line| line.starts_with(&of_file)), "{shown}");
    assert!(!shown.contains("\"secret\""), "{shown}");
}

#[test]
fn wrong_settings_are_named_and_nothing_is_served() {
    let file = std::env::temp_dir().join(format!("vantage-wrong-{}.toml", std::process::id()));
    std::fs::write(&file, "\nprot = 8080\n").expect("a file");
    let refused = Command::new(env!("CARGO_BIN_EXE_vantage-server")).env("VANTAGE_CONFIG", &file).output();
    let refused = refused.expect("the program");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{said}");
    assert!(said.contains(&format!("{}:2: there is no setting \"prot\"", file.display())), "{said}");
    std::fs::remove_file(file).expect("removed");
}

/// In place of what Agones runs beside a server: notes what it is told, and does not take anything the first time.
async fn agones(told: mpsc::Sender<String>) -> u16 {
    let seen = Arc::new(Mutex::new((told, HashSet::new())));
    let answer = move |method: Method, uri: Uri, body: String| async move {
        assert_eq!(body, if method == Method::POST { "{}" } else { "" });
        let call = format!("{method} {}", uri.path());
        let (told, seen) = &mut *seen.lock().expect("one at a time");
        if seen.insert(call.clone()) {
            return (StatusCode::SERVICE_UNAVAILABLE, String::new());
        }
        // Who asks no more has seen enough.
        drop(told.send(call));
        (StatusCode::OK, "{\"status\":{\"state\":\"Ready\"}}".to_owned())
    };
    let listener = tokio::net::TcpListener::bind("localhost:0").await.expect("a port");
    let port = listener.local_addr().expect("bound").port();
    let router = Router::new().fallback(answer);
    tokio::spawn(async move { axum::serve(listener, router).await });
    port
}

#[tokio::test(flavor = "multi_thread")]
async fn agones_is_told_when_somebody_comes_and_when_nobody_is_there_any_more() {
    let (tells, told) = mpsc::channel();
    let port = agones(tells).await;
    let environment = [("AGONES_SDK_HTTP_PORT", port.to_string()), ("VANTAGE_AGONES_IDLE_S", "1".to_owned())];
    let program = Program::start_with("agones", &environment).await;
    let until = |path: &str| {
        let mut before = Vec::new();
        loop {
            let next = told.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("never told {path}, but {before:?}"));
            if next == path {
                return before;
            }
            before.push(next);
        }
    };
    let before = tokio::task::block_in_place(|| until("POST /ready"));
    assert!(before.iter().all(|call| call == "POST /health"), "{before:?}");
    let before = tokio::task::block_in_place(|| until("GET /gameserver"));
    assert!(!before.contains(&"POST /allocate".to_owned()), "{before:?}");
    let client = program.client(None).await;
    let before = tokio::task::block_in_place(|| until("POST /allocate"));
    assert!(!before.contains(&"POST /shutdown".to_owned()), "{before:?}");
    drop(client);
    tokio::task::block_in_place(|| until("POST /shutdown"));
}
