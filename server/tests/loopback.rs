//! The server over real loopback sockets: what a well-behaved client gets.

mod net;

use std::sync::Arc;
use std::time::Duration;

use camera::Motion;
use glam::DVec3;
use net::{Client, NoiseImager, VIEW, config, request, request_at, room, secret, start};
use protocol::message::{Clock, Resume};
use protocol::session::{ClientConfig, SessionError};
use scene::Scene;
use vantage_server::Config;
use vantage_server::plan::Reason;

#[tokio::test]
async fn health_page_and_headers() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let health = request(&running, "/healthz", "").await;
    assert!(health.starts_with("HTTP/1.1 200"), "{health}");
    assert!(health.contains("\"scene\":\"room\"") && health.contains("\"adapter\":\"noise\""), "{health}");
    assert!(health.contains("\"clients\":0"), "{health}");
    let page = request(&running, "/", "").await;
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("cargo xtask serve"), "{page}");
    for header in ["cross-origin-opener-policy: same-origin", "x-content-type-options: nosniff"] {
        assert!(page.contains(header), "{header} in {page}");
    }
    let policy = page.lines().find_map(|line| line.strip_prefix("content-security-policy: ")).expect("a policy");
    for directive in ["default-src 'none'", "script-src 'self' 'wasm-unsafe-eval'", "style-src 'self'"] {
        assert!(policy.split("; ").any(|part| part.trim() == directive), "{directive} in {policy}");
    }
    let framed = policy.split("; ").find_map(|part| part.trim().strip_prefix("frame-ancestors ")).expect("said");
    assert!(
        framed
            .split_whitespace()
            .all(|by| by == "'self'" || by.ends_with("://localhost:*") || by.ends_with("://127.0.0.1:*")),
        "{framed}"
    );
    assert!(!policy.contains("unsafe-inline") && !policy.contains("'unsafe-eval'"), "{policy}");
    assert!(page.contains("permissions-policy: ") && !page.contains("strict-transport-security"), "{page}");
    assert!(request(&running, "/nothing", "").await.starts_with("HTTP/1.1 404"));
    assert!(request(&running, "/../Cargo.toml", "").await.starts_with("HTTP/1.1 404"));
    running.stop().await;
}

#[tokio::test]
async fn who_comes_while_the_scene_is_loaded_is_told_so() {
    let config = Config { access: secret(), ..config() };
    let listening = vantage_server::app::listen(&config).await.expect("a port");
    let addr = listening.addr;
    assert!(request_at(addr, "/livez", "").await.starts_with("HTTP/1.1 200"));
    assert!(request_at(addr, "/healthz", "").await.starts_with("HTTP/1.1 503"));
    listening.progress()("reading files, 40 %".to_owned());
    let ready = request_at(addr, "/readyz", "").await;
    assert!(ready.starts_with("HTTP/1.1 503") && ready.contains("being loaded: reading files, 40 %"), "{ready}");
    let (socket, _) = tokio_tungstenite::connect_async(format!("ws://{addr}/ws?token=secret")).await.expect("a socket");
    let mut client = Client::over(socket, ClientConfig::new(Clock::Wall, VIEW));
    let told = client.run(10.0, |_| false).await.expect_err("no session yet");
    let SessionError::Goodbye { reason, again } = told else { panic!("{told}") };
    assert!(reason.contains("reading files, 40 %") && again, "{reason}");

    let imager = Box::new(NoiseImager { delay: Duration::ZERO });
    let running = listening.serve(config, Arc::new(room(false)), imager).expect("a server");
    assert!(request(&running, "/readyz", "").await.starts_with("HTTP/1.1 200"));
    assert!(request(&running, "/metrics", "").await.starts_with("HTTP/1.1 403"));
    let metrics = request(&running, "/metrics", "Authorization: Bearer secret\r\n").await;
    assert!(metrics.contains("\nvantage_sessions 0\n") && metrics.contains("scene=\"room\""), "{metrics}");
    running.stop().await;
}

#[tokio::test]
async fn who_comes_while_it_drains_is_told_so() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut client = Client::connect(&running, Clock::Wall).await;
    client.run(10.0, |client| client.welcome.is_some()).await.expect("a session");
    running.drain();
    let ready = request(&running, "/readyz", "").await;
    assert!(ready.starts_with("HTTP/1.1 503") && ready.contains("draining"), "{ready}");
    assert!(request(&running, "/livez", "").await.starts_with("HTTP/1.1 200"));
    for mut told in [client, Client::connect(&running, Clock::Wall).await] {
        let error = told.run(10.0, |_| false).await.expect_err("no session any more");
        let SessionError::Goodbye { reason, again } = error else { panic!("{error}") };
        assert!(reason.contains("the server stops") && again, "{reason}");
    }
    running.stop().await;
}

#[tokio::test]
async fn who_looks_at_a_scene_that_is_replaced_begins_anew() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut client = Client::connect(&running, Clock::Wall).await;
    client.run(10.0, |client| !client.updates.is_empty()).await.expect("a session");
    let next = Scene { name: "another".to_owned(), ..room(false) };
    let imager = Box::new(NoiseImager { delay: Duration::ZERO });
    running.show(config(), Arc::new(next), imager).expect("another scene");
    let error = client.run(10.0, |_| false).await.expect_err("the scene is no more");
    let SessionError::Goodbye { reason, again } = error else { panic!("{error}") };
    assert!(reason.contains("loaded anew") && again, "{reason}");
    let welcome = client.welcome.expect("welcomed");
    let (number, digest) = (client.held.number, client.held.digest());
    let resume = Some(Resume { secret: welcome.secret, number, digest });
    let mut back = Client::with(&running, ClientConfig { resume, ..ClientConfig::new(Clock::Wall, VIEW) }).await;
    back.run(10.0, |back| !back.updates.is_empty()).await.expect("a session");
    let welcome = back.welcome.expect("welcomed");
    assert_eq!((welcome.scene_name.as_str(), welcome.resumed), ("another", false));
    running.stop().await;
}

#[tokio::test]
async fn files_of_the_web_client_are_served_with_their_types() {
    let web = std::env::temp_dir().join(format!("vantage-web-{}", std::process::id()));
    std::fs::create_dir_all(&web).expect("folder");
    std::fs::write(web.join("index.html"), "<h1>hello</h1>").expect("file");
    std::fs::write(web.join("client.wasm"), vec![7; 4096]).expect("file");
    let running = start(Config { web: Some(web.clone()), ..config() }, room(false), Duration::ZERO).await;
    assert!(request(&running, "/", "").await.contains("<h1>hello</h1>"));
    let wasm = request(&running, "/client.wasm", "Accept-Encoding: gzip\r\n").await;
    assert!(wasm.contains("content-type: application/wasm") && wasm.contains("content-encoding: gzip"), "{wasm}");
    running.stop().await;
    std::fs::remove_dir_all(web).expect("remove");
}

#[tokio::test]
async fn a_client_is_welcomed_and_gets_its_first_set() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut client = Client::connect(&running, Clock::Wall).await;
    client.run(10.0, |client| !client.updates.is_empty()).await.expect("a session");
    let welcome = client.welcome.as_ref().expect("welcome");
    assert_eq!((welcome.scene_name.as_str(), welcome.walk), ("room", true));
    let coarse = client.held.sample_count() as f64;
    assert!((coarse / (16.0 * 16.0) - 1.0).abs() < 0.1, "one image of about 16x16 pixels, {coarse} samples");
    client.run(10.0, |client| client.updates.len() > 1).await.expect("a session");
    assert_eq!(client.held.patches.len(), 2);
    let samples = client.held.sample_count() as f64;
    assert!((samples / (2.0 * 32.0 * 32.0) - 1.0).abs() < 0.1, "two images of about 32x32 pixels, {samples} samples");
    assert!(client.held.lighting.is_some() && !client.held.materials.is_empty());
    assert_eq!(running.stats.looks(Reason::First), 2);
    running.stop().await;
}

#[tokio::test]
async fn what_is_made_and_left_out_is_told_to_who_asks() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut client = Client::connect(&running, Clock::Wall).await;
    client.run(10.0, |client| client.updates.len() > 1).await.expect("a session");
    let asked_at_s = client.now_s();
    (0..9).for_each(|_| client.session.ask(asked_at_s));
    client.run(10.0, |client| !client.inventory.parts.is_empty()).await.expect("a session");
    let part = |name: &str| client.inventory.parts.iter().find(|part| part.name == name).expect("a part").clone();
    assert_eq!((part("layers").made, part("layers").why.as_str()), (None, "nothing is blended"));
    assert!(part("images").made.is_some_and(|made| made.starts_with("up to 2 of 32 x 32")));
    let plan = request(&running, "/plan", "").await;
    assert!(plan.starts_with("HTTP/1.1 200") && plan.contains("\"session\":1"), "{plan}");
    assert!(plan.contains(&format!("\"why\":\"{}\"", part("impostors").why)), "{plan}");
    running.stop().await;
}

#[tokio::test]
async fn only_who_may_connect_reads_what_is_made() {
    let running = start(Config { access: secret(), ..config() }, room(false), Duration::ZERO).await;
    assert!(request(&running, "/plan", "").await.starts_with("HTTP/1.1 403"));
    assert!(request(&running, "/plan?token=secret", "").await.starts_with("HTTP/1.1 200"));
    assert!(
        request(&running, "/plan?token=secret", "Origin: http://evil.example\r\n").await.starts_with("HTTP/1.1 403")
    );
    running.stop().await;
}

#[tokio::test]
async fn a_walker_gets_what_comes_into_view_and_keeps_the_rest() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut client = Client::connect(&running, Clock::Wall).await;
    client.run(10.0, |client| client.updates.len() > 1).await.expect("a session");
    client.walk(3.0).await.expect("a walk");
    assert!(client.updates.len() >= 4, "{} updates in 3 s", client.updates.len());
    assert!(client.held.patches.len() > 4, "{} patches are held", client.held.patches.len());
    let newest = client.updates.last().expect("updates");
    assert!(newest.pose_seq > 0, "updates name the pose that they answer");
    assert!(running.stats.looks(Reason::Moved) >= 3);
    running.stop().await;
}

#[tokio::test]
async fn clients_are_served_in_turn() {
    let running = start(config(), room(false), Duration::from_millis(20)).await;
    let mut clients = Vec::new();
    for _ in 0..4 {
        let mut client = Client::connect(&running, Clock::Wall).await;
        client.run(10.0, |client| !client.updates.is_empty()).await.expect("a session");
        clients.push(client);
    }
    let walks = clients.into_iter().map(|mut client| {
        tokio::spawn(async move {
            let before = client.updates.len();
            client.walk(3.0).await.expect("a walk");
            client.updates.len() - before
        })
    });
    let mut counts = Vec::new();
    for walk in walks.collect::<Vec<_>>() {
        counts.push(walk.await.expect("a client"));
    }
    let (least, most) = (counts.iter().min().expect("some"), counts.iter().max().expect("some"));
    assert!(*least >= 4 && most <= &(2 * least), "{counts:?}");
    running.stop().await;
}

#[tokio::test]
async fn the_same_trace_on_the_virtual_clock_gives_the_same_bytes() {
    let running = start(Config { clock: Clock::Virtual, ..config() }, room(true), Duration::ZERO).await;
    let mut runs = Vec::new();
    for _ in 0..2 {
        let mut client = Client::connect(&running, Clock::Virtual).await;
        client.advance(0.0).await.expect("a step");
        for step in 1..40 {
            let t_s = f64::from(step) / 30.0;
            let mut pose = client.start_eye();
            pose.translation.x += 1.5 * t_s;
            client.session.set_pose(pose, Motion::along(DVec3::X * 1.5), t_s);
            client.advance(t_s).await.expect("a step");
        }
        assert!(client.updates.len() > 20, "one update a tick: {}", client.updates.len());
        let times: Vec<f64> = client.updates.iter().map(|update| update.scene_time_s).collect();
        assert!(
            times.windows(2).all(|pair| (pair[1] - pair[0] - 0.05).abs() < 0.005),
            "a tick, and what the round trip changed: {times:?}"
        );
        runs.push(client.heard);
    }
    let differs = runs[0].iter().zip(&runs[1]).position(|(a, b)| a != b);
    assert_eq!((runs[0].len(), differs), (runs[1].len(), None), "the runs differ");
    running.stop().await;
}

#[tokio::test]
async fn a_still_viewer_in_a_still_scene_costs_next_to_nothing() {
    let running = start(Config { clock: Clock::Virtual, ..config() }, room(false), Duration::ZERO).await;
    let mut client = Client::connect(&running, Clock::Virtual).await;
    client.advance(5.0).await.expect("a step");
    assert_eq!(client.updates.len(), 2, "a first set, and the viewer's own view");
    let before = client.session.bytes_received_and_sent();
    for step in 1..=60 {
        client.advance(5.0 + f64::from(step)).await.expect("a step");
    }
    let after = client.session.bytes_received_and_sent();
    assert_eq!(client.updates.len(), 2);
    // Advance and Advanced, which pace the test, are counted too.
    let bytes_per_s = ((after.0 - before.0) + (after.1 - before.1)) as f64 / 60.0;
    assert!(bytes_per_s <= 60.0, "{bytes_per_s} bytes a second");
    running.stop().await;
}

#[tokio::test]
async fn clients_are_told_when_the_server_stops() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut client = Client::connect(&running, Clock::Wall).await;
    client.run(10.0, |client| !client.updates.is_empty()).await.expect("a session");
    let ((), ended) = tokio::join!(running.stop(), client.run(5.0, |_| false));
    let error = ended.expect_err("the session ends");
    assert!(error.to_string().contains("the server stops"), "{error}");
}
