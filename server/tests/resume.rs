//! Clients whose connection is cut off come back and go on with what they hold.

mod net;

use std::sync::atomic::Ordering;
use std::time::Duration;

use net::{Client, VIEW, config, room, start};
use protocol::message::{Clock, Resume};
use protocol::session::ClientConfig;
use vantage_server::Running;

/// What a client would say that it holds.
fn holds(client: &Client) -> Resume {
    let (number, digest) = (client.held.number, client.held.digest());
    Resume { secret: client.welcome.as_ref().expect("welcomed").secret, number, digest }
}

/// A new connection of a client, beside the old one, as from where its eye is.
async fn again(running: &Running, client: &Client, resume: Resume) -> Client {
    let (resume, world_from_eye) = (Some(resume), Some(client.start_eye()));
    let config = ClientConfig { resume, world_from_eye, ..ClientConfig::new(Clock::Wall, VIEW) };
    let mut back = Client::with(running, config).await;
    back.held = client.held.clone();
    back
}

/// A client that holds this many updates.
async fn with_updates(running: &Running, count: usize) -> Client {
    let mut client = Client::connect(running, Clock::Wall).await;
    client.run(10.0, |client| client.updates.len() >= count).await.expect("a session");
    client
}

#[tokio::test(flavor = "multi_thread")]
async fn who_was_cut_off_goes_on_with_what_it_holds() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut client = with_updates(&running, 2).await;
    // Until it lacks nothing.
    client.run(1.0, |_| false).await.expect("a session");
    let so_far = client.held.number;
    let first_set_bytes = client.heard.len();
    let mut back = again(&running, &client, holds(&client)).await;
    drop(client);
    back.run(1.0, |_| false).await.expect("a session");
    assert!(back.welcome.as_ref().expect("welcomed").resumed);
    assert!(back.heard.len() * 10 <= first_set_bytes, "{} bytes after {first_set_bytes}", back.heard.len());
    back.walk(1.0).await.expect("a walk");
    assert!(!back.updates.is_empty() && back.updates.iter().all(|head| !head.clears && head.number > so_far));
    assert_eq!(running.stats.resumed.load(Ordering::Relaxed), 1);
    running.stop().await;
}

/// Whether a client that names this begins anew; nothing of what it held counts then.
async fn begins_anew(running: &Running, client: &Client, resume: Resume) -> bool {
    let mut back = again(running, client, resume).await;
    back.held = protocol::Held::default();
    back.run(10.0, |back| !back.updates.is_empty()).await.expect("a session");
    !back.welcome.as_ref().expect("welcomed").resumed
}

#[tokio::test(flavor = "multi_thread")]
async fn another_copy_begins_anew_and_a_session_is_there_once() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let client = with_updates(&running, 2).await;
    let right = holds(&client);
    assert!(begins_anew(&running, &client, Resume { digest: right.digest ^ 1, ..right }).await);
    assert!(begins_anew(&running, &client, right).await, "it was taken by who had another copy");
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_update_that_got_lost_is_sent_again() {
    let running = start(config(), room(false), Duration::from_millis(200)).await;
    let mut client = with_updates(&running, 1).await;
    let resume = holds(&client);
    // Cut off while the second one is made: nobody takes it.
    drop(std::mem::replace(&mut client.socket, net::socket(&running).await));
    tokio::time::sleep(Duration::from_millis(600)).await;
    let mut back = again(&running, &client, resume).await;
    back.run(10.0, |back| back.held.number >= 2).await.expect("a session");
    assert!(back.welcome.as_ref().expect("welcomed").resumed);
    assert_eq!(back.updates.iter().map(|head| head.number).next(), Some(2));
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_that_seems_alive_gives_way() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut client = with_updates(&running, 2).await;
    let mut back = again(&running, &client, holds(&client)).await;
    back.run(10.0, |back| back.welcome.is_some()).await.expect("a session");
    assert!(back.welcome.as_ref().expect("welcomed").resumed);
    let ended = client.run(10.0, |_| false).await;
    assert!(ended.is_err(), "two connections cannot have one session");
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn nobody_goes_on_without_the_secret() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let client = with_updates(&running, 2).await;
    let guessed = Resume { secret: holds(&client).secret ^ 1, ..holds(&client) };
    assert!(begins_anew(&running, &client, guessed).await);
    assert_eq!(running.stats.resumed.load(Ordering::Relaxed), 0);
    running.stop().await;
}
