//! One line of the log for each session, which says who was there, and no secret.

mod broker;
mod log;
mod net;

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use broker::RunningBroker;
use log::LOG;
use net::{Client, VIEW, config, room, secret, start};
use protocol::message::{Clock, Resume, Role};
use protocol::session::ClientConfig;
use serde_json::Value;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use vantage_server::{Config, Running, relay};

/// The lines of sessions of one role whose clients knew the token, once there are so many.
async fn lines(role: &str, count: usize) -> Vec<Value> {
    let begun = Instant::now();
    loop {
        let is_it = |line: &Value| line["role"] == role && line["by_token"] == true;
        let lines: Vec<Value> = LOG.of("audit").into_iter().filter(is_it).collect();
        if lines.len() >= count {
            return lines;
        }
        assert!(begun.elapsed() < Duration::from_secs(10), "{} lines of {role}", lines.len());
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

async fn connected(running: &Running, role: Role, resume: Option<Resume>) -> Client {
    connected_at(running.addr, role, resume).await
}

async fn connected_at(addr: SocketAddr, role: Role, resume: Option<Resume>) -> Client {
    let mut request = format!("ws://{addr}/ws").into_client_request().expect("a request");
    request.headers_mut().insert("authorization", "Bearer secret".parse().expect("a value"));
    request.headers_mut().insert("origin", "http://localhost:1".parse().expect("a value"));
    let (socket, _) = tokio_tungstenite::connect_async(request).await.expect("a socket");
    Client::over(socket, ClientConfig { role, resume, ..ClientConfig::new(Clock::Wall, VIEW) })
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_is_one_line_that_tells_all_but_secrets() {
    LOG.text();
    let running = start(Config { access: secret(), ..config() }, room(true), Duration::ZERO).await;
    let mut client = connected(&running, Role::Presenter("stage".to_owned()), None).await;
    client.run(10.0, |client| client.updates.len() >= 3).await.expect("a session");
    client.socket.close(None).await.expect("closed");
    drop(client);
    let line = &lines("presenter", 1).await[0];
    assert_eq!(
        (&line["level"], &line["message"], &line["why"]),
        (&"INFO".into(), &"session ended".into(), &"left".into()),
        "{line}"
    );
    assert!(line["peer"].as_str().is_some_and(|peer| peer.starts_with("127.0.0.1:")), "{line}");
    assert_eq!(
        (&line["by_token"], &line["origin"], &line["resumed"]),
        (&true.into(), &"http://localhost:1".into(), &false.into())
    );
    let number = |name: &str| line[name].as_f64().unwrap_or_else(|| panic!("{name} in {line}"));
    assert!(
        number("session") >= 1.0
            && number("updates") >= 3.0
            && number("bytes_out") > 1000.0
            && number("bytes_in") > 50.0,
        "{line}"
    );
    assert!(number("seconds") > 0.0 && number("began_unix_s") > 1.6e9, "{line}");

    // One that is cut off and goes on: two lines, the second one of which says so.
    let mut client = connected(&running, Role::Viewer, None).await;
    client.run(10.0, |client| client.updates.len() >= 2).await.expect("a session");
    let told = client.welcome.as_ref().expect("welcomed").secret;
    let resume = Resume { secret: told, number: client.held.number, digest: client.held.digest() };
    let held = client.held.clone();
    drop(client);
    lines("viewer", 1).await;
    let mut back = connected(&running, Role::Viewer, Some(resume)).await;
    back.held = held;
    back.run(10.0, |back| !back.updates.is_empty()).await.expect("a session");
    drop(back);
    let resumed: Vec<bool> = lines("viewer", 2).await.iter().map(|line| line["resumed"] == true).collect();
    assert_eq!(resumed, [false, true]);
    running.stop().await;

    let all = LOG.text();
    let hex = "736563726574";
    let secrets = ["Bearer secret".to_owned(), hex.to_owned(), told.to_string(), format!("{told:x}")];
    assert!(secrets.iter().all(|secret| !all.contains(secret)), "a secret in the log");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_relay_tells_of_sessions_as_a_server_does() {
    LOG.text();
    let Some(broker) = RunningBroker::start() else { return };
    let server = start(Config { publish: Some(broker.named()), ..config() }, room(true), Duration::ZERO).await;
    let relay = relay::serve(Config { access: secret(), ..config() }, broker.named()).await.expect("a relay");
    let mut presenter = Client::of_audience(&server, Role::Presenter("stage".to_owned())).await;
    let begun = Instant::now();
    while !relay.relay.knows_a_server() {
        assert!(begun.elapsed() < Duration::from_secs(20), "it hears of no server");
        presenter.run(0.1, |_| false).await.expect("a session");
    }
    let mut follower = connected_at(relay.addr, Role::Follower("stage".to_owned()), None).await;
    while follower.updates.len() < 3 {
        assert!(begun.elapsed() < Duration::from_secs(60), "nothing to follow");
        let (followed, presented) = tokio::join!(follower.run(0.1, |_| false), presenter.run(0.1, |_| false));
        followed.and(presented).expect("sessions");
    }
    follower.socket.close(None).await.expect("closed");
    drop(follower);
    let line = &lines("follower", 1).await[0];
    assert_eq!(
        (&line["why"], &line["by_token"], &line["session"]),
        (&"left".into(), &true.into(), &1.into()),
        "{line}"
    );
    assert!(line["updates"].as_u64().is_some_and(|updates| updates >= 3), "{line}");
    relay.stop().await;
    server.stop().await;
}
