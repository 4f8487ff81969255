//! Many clients follow one presenter: they hold what he holds, whenever they come, and cost no looks of their own.

mod net;

use std::time::Duration;

use net::{Client, VIEW, config, room, start};
use protocol::message::{Clock, Role};
use protocol::session::{ClientConfig, SessionError};
use vantage_server::Running;

fn presenter() -> Role {
    Role::Presenter("Ada".to_owned())
}

fn follower() -> Role {
    Role::Follower("Ada".to_owned())
}

/// Lets a client hear until it holds what another one does.
async fn catches_up(follower: &mut Client, presenter: &Client) {
    let digest = presenter.held.digest();
    follower.run(10.0, |client| client.held.digest() == digest).await.expect("a session");
    assert_eq!((follower.held.number, follower.held.digest()), (presenter.held.number, digest));
    assert!(follower.held.patches == presenter.held.patches);
}

async fn presents(running: &Running) -> Client {
    let mut presenter = Client::of_audience(running, presenter()).await;
    presenter.run(10.0, |client| !client.updates.is_empty()).await.expect("a session");
    presenter
}

#[tokio::test(flavor = "multi_thread")]
async fn whoever_follows_holds_what_the_presenter_holds() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut early = Client::of_audience(&running, follower()).await;
    early.run(0.3, |_| false).await.expect("a session");
    assert!(early.welcome.is_some() && early.updates.is_empty(), "nobody presents yet");
    let mut presenter = presents(&running).await;
    presenter.walk(0.5).await.expect("a session");
    let mut late = Client::of_audience(&running, follower()).await;
    catches_up(&mut late, &presenter).await;
    presenter.walk(0.5).await.expect("a session");
    presenter.run(0.5, |_| false).await.expect("a session");
    for follower in [&mut early, &mut late] {
        catches_up(follower, &presenter).await;
        assert!(follower.updates[0].clears, "it began with the whole copy");
        let eye = follower.presenter.expect("where the presenter's eye is").translation;
        assert!(eye.x > presenter.start_eye().translation.x + 0.5, "{eye}");
    }
    presenter.run(0.3, |_| false).await.expect("a session");
    let looks = vantage_server::plan::Reason::ALL.iter().map(|&reason| running.stats.looks(reason)).sum::<u64>();
    assert_eq!(looks, presenter.updates.len() as u64, "nobody was looked for but the presenter");
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_follower_whose_copy_broke_gets_it_anew() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let presenter = presents(&running).await;
    let mut follower = Client::of_audience(&running, follower()).await;
    catches_up(&mut follower, &presenter).await;
    let before = follower.updates.len();
    let now_s = follower.now_s();
    follower.session.broken(now_s);
    follower.run(10.0, |client| client.updates.len() > before).await.expect("a session");
    catches_up(&mut follower, &presenter).await;
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_next_presenter_takes_the_audience_over() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let first = presents(&running).await;
    let mut follower = Client::of_audience(&running, follower()).await;
    catches_up(&mut follower, &first).await;
    let mut second = Client::of_audience(&running, presenter()).await;
    let refused = second.run(10.0, |_| false).await.expect_err("the name is taken");
    assert!(matches!(&refused, SessionError::Goodbye { reason, .. } if reason.contains("Ada")), "{refused}");
    let held = follower.held.number;
    drop(first);
    follower.run(0.3, |_| false).await.expect("who follows stays");
    let mut next = Client::of_audience(&running, presenter()).await;
    next.run(10.0, |client| !client.updates.is_empty()).await.expect("the name is free again");
    next.walk(0.4).await.expect("a session");
    catches_up(&mut follower, &next).await;
    assert!(follower.held.number > held, "numbers go on");
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_cannot_follow_is_told_why() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let small = ClientConfig { role: follower(), budget_bytes: 1 << 20, ..ClientConfig::new(Clock::Wall, VIEW) };
    let nameless = ClientConfig { role: Role::Follower(String::new()), ..ClientConfig::new(Clock::Wall, VIEW) };
    for (config, words) in [(small, "256 MiB"), (nameless, "name")] {
        let mut client = Client::with(&running, config).await;
        let refused = client.run(10.0, |_| false).await.expect_err("it cannot follow");
        assert!(matches!(&refused, SessionError::Goodbye { reason, .. } if reason.contains(words)), "{refused}");
    }
    running.stop().await;
}
