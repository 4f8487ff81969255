//! What people bring: over real sockets, by who may, and then shown to who knows its name.

// Whether what draws may go from thread to thread is asked through all that it consists of.
#![recursion_limit = "256"]

mod net;

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use net::{Client, NoiseImager, VIEW, config, request, room};
use protocol::message::Clock;
use protocol::session::{ClientConfig, SessionError};
use scene::Scene;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_tungstenite::connect_async;
use vantage_server::access::Access;
use vantage_server::limits::{SceneLimits, UploadLimits};
use vantage_server::prepare::{PrepareError, Prepared};
use vantage_server::serving::Stock;
use vantage_server::uploads::Uploads;
use vantage_server::{Config, Running};

/// For what takes a moment on an idle machine.
const PATIENCE: Duration = Duration::from_secs(60);
const TRIANGLE: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// The scene of a file, drawn by nobody.
fn load(path: &Path, config: &Config) -> Result<Prepared, PrepareError> {
    let scene: Scene = vantage_server::source::load(&path.to_string_lossy(), 1.0, &|_| {})?;
    let imager = Box::new(NoiseImager { delay: Duration::ZERO });
    Ok(Prepared { config: config.clone(), scene: Arc::new(scene), imager })
}

async fn served(token: Option<&str>, idle: Duration, limits: Option<UploadLimits>) -> Running {
    let mut config = Config { rest: false, ..config() };
    config.access = Access { token: token.map(str::to_owned), ..Access::default() };
    // Who vanished may come back for so long.
    config.limits.resume.time = idle;
    config.limits.scenes = SceneLimits { idle, ..SceneLimits::default() };
    let uploads = limits.map(|limits| Uploads::open(&std::env::temp_dir(), limits).expect("a folder"));
    let listening = vantage_server::app::listen(&config).await.expect("a port");
    let of_files = config.clone();
    let stock = Stock::new(None, uploads.map(Arc::new));
    listening.offer(stock, None, Arc::new(move |file, _| load(&file.path, &of_files)));
    let imager = Box::new(NoiseImager { delay: Duration::ZERO });
    listening.serve(config, Arc::new(room(false)), imager).expect("a server")
}

fn body(files: &[(&str, &[u8])]) -> Vec<u8> {
    let listed: Vec<_> =
        files.iter().map(|(path, bytes)| serde_json::json!({ "path": path, "bytes": bytes.len() })).collect();
    let mut body = serde_json::to_vec(&listed).expect("JSON");
    body.push(b'\n');
    files.iter().for_each(|(_, bytes)| body.extend_from_slice(bytes));
    body
}

/// The status and the body of the answer to an upload.
async fn posted(running: &Running, query: &str, headers: &str, body: &[u8]) -> (u16, String) {
    let mut stream = TcpStream::connect(running.addr).await.expect("connect");
    let length = body.len();
    let head = format!(
        "POST /uploads{query} HTTP/1.1\r\nHost: {}\r\nContent-Length: {length}\r\nConnection: close\r\n{headers}\r\n",
        running.addr
    );
    stream.write_all(head.as_bytes()).await.expect("write");
    // Who is refused may be hung up on before all is sent.
    drop(stream.write_all(body).await);
    let mut answer = Vec::new();
    drop(stream.read_to_end(&mut answer).await);
    let answer = String::from_utf8_lossy(&answer).into_owned();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or((&answer, ""));
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok());
    (status.unwrap_or_else(|| panic!("no answer: {answer:?}")), body.to_owned())
}

async fn visited(running: &Running, scene: &str) -> Result<Client, String> {
    let begun = Instant::now();
    loop {
        let (socket, _) = connect_async(format!("ws://{}/ws?scene={scene}", running.addr)).await.expect("a socket");
        let mut client = Client::over(socket, ClientConfig::new(Clock::Wall, VIEW));
        match client.run(PATIENCE.as_secs_f64(), |client| !client.updates.is_empty()).await {
            Ok(()) => return Ok(client),
            Err(SessionError::Goodbye { again: true, .. }) if begun.elapsed() < PATIENCE => {}
            Err(SessionError::Goodbye { reason, .. }) => return Err(reason),
            Err(other) => panic!("{other}"),
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

fn only_scene(answer: &str) -> String {
    let answer: serde_json::Value = serde_json::from_str(answer).expect("JSON");
    let [scene] = answer["scenes"].as_array().expect("a list").as_slice() else { panic!("{answer}") };
    scene.as_str().expect("a name").to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_is_shown_to_who_knows_its_name_until_nobody_looks() {
    let idle = Duration::from_millis(1500);
    let running = served(None, idle, Some(UploadLimits::default())).await;
    let files: [(&str, &[u8]); 2] = [("a wedge.obj", TRIANGLE), ("a wedge.mtl", b"newmtl x\n")];
    let (status, answer) = posted(&running, "", "", &body(&files)).await;
    assert_eq!(status, 200, "{answer}");
    let name = only_scene(&answer);
    let client = visited(&running, &name.replace(' ', "%20")).await.expect("a session");
    assert_eq!(client.welcome.as_ref().expect("welcomed").scene_name, "a wedge");
    let list = request(&running, "/scenes", "").await;
    assert!(!list.contains("wedge") && list.contains("\"uploads\":{\"bytes\":268435456}"), "{list}");
    // What is wrong with one is said without where it lies.
    let (_, answer) = posted(&running, "", "", &body(&[("broken.glb", b"glTF and no more")])).await;
    let why = visited(&running, &only_scene(&answer)).await.err().expect("it is broken");
    assert!(why.contains("broken") && !why.contains("uploads-"), "{why}");
    // It stays as long as somebody is there, and no longer.
    tokio::time::sleep(2 * idle).await;
    assert!(visited(&running, &name.replace(' ', "%20")).await.is_ok(), "the first is still there");
    drop(client);
    let begun = Instant::now();
    while running.stats.scenes.put_away.load(std::sync::atomic::Ordering::Relaxed) == 0 {
        assert!(begun.elapsed() < PATIENCE, "it is never put away");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    tokio::time::sleep(2 * idle).await;
    let why = visited(&running, &name.replace(' ', "%20")).await.err().expect("it was removed");
    assert!(why.contains("is here no more"), "{why}");
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn only_who_may_connect_may_bring_something_and_only_where_it_is_allowed() {
    let idle = Duration::from_secs(60);
    let file = body(&[("a.obj", TRIANGLE)]);
    let open = served(None, idle, Some(UploadLimits::default())).await;
    for origin in ["http://evil.example", "null", "https://127.0.0.1.evil.example"] {
        let (status, answer) = posted(&open, "", &format!("Origin: {origin}\r\n"), &file).await;
        assert_eq!(status, 403, "{origin}: {answer}");
    }
    let own = format!("Origin: http://{}\r\n", open.addr);
    assert_eq!(posted(&open, "", &own, &file).await.0, 200);
    let closed = served(Some("secret"), idle, Some(UploadLimits::default())).await;
    for (query, headers, status) in [
        ("", "", 403),
        ("?token=wrong", "", 403),
        ("?token=secret", "", 200),
        ("", "Authorization: Bearer secret\r\n", 200),
        ("", "Authorization: Vantage-Hex 736563726574\r\n", 200),
        ("", "Authorization: Vantage-Hex 7365637265\r\n", 403),
        ("", "Authorization: Bearer secret\r\nOrigin: http://evil.example\r\n", 403),
    ] {
        assert_eq!(posted(&closed, query, headers, &file).await.0, status, "{query} {headers}");
    }
    let without = served(None, idle, None).await;
    let (status, answer) = posted(&without, "", "", &file).await;
    assert!(status == 403 && answer.contains("--allow-uploads"), "{status} {answer}");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_taken_is_said_and_disturbs_nobody() {
    let limits = UploadLimits { bytes: 1 << 20, pause: Duration::from_millis(300), ..UploadLimits::default() };
    let running = served(None, Duration::from_secs(60), Some(limits)).await;
    let (_, answer) = posted(&running, "", "", &body(&[("a.obj", TRIANGLE)])).await;
    let mut client = visited(&running, &only_scene(&answer)).await.expect("a session");
    let large = vec![b' '; (1 << 20) + 1];
    let missing = [body(&[("a.obj", TRIANGLE)]), b"more".to_vec()].concat();
    for (body, status, words) in [
        (body(&[("a.obj", &large)]), 413, "it has 2 MiB, and one upload may have 1"),
        (body(&[("../a.obj", TRIANGLE)]), 400, "no path"),
        (body(&[("a.txt", TRIANGLE)]), 422, "no scene file"),
        (body(&[("a.zip", b"PK")]), 422, "cannot be unpacked"),
        (missing, 400, "not those that it lists"),
        (b"GET / HTTP/1.1\r\n\r\n".to_vec(), 400, "a line of JSON"),
    ] {
        let (found, answer) = posted(&running, "", "", &body).await;
        assert!(found == status && answer.contains(words), "{found} {answer}");
    }
    // Who stops in the middle is hung up on, and who leaves leaves nothing.
    let mut stream = TcpStream::connect(running.addr).await.expect("connect");
    let head = format!("POST /uploads HTTP/1.1\r\nHost: {}\r\nContent-Length: 1000\r\n\r\n[", running.addr);
    stream.write_all(head.as_bytes()).await.expect("write");
    let mut answer = [0; 12];
    tokio::time::timeout(PATIENCE, stream.read_exact(&mut answer)).await.expect("an answer").expect("an answer");
    assert_eq!(&answer, b"HTTP/1.1 408");
    client.run(0.5, |_| false).await.expect("the session goes on");
    assert_eq!(running.stats.faults.load(std::sync::atomic::Ordering::Relaxed), 0);
    running.stop().await;
}
