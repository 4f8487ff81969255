//! An audience beyond one host: a server publishes, a relay passes on, and who follows there holds what the presenter holds, whatever goes away meanwhile.

mod broker;
mod net;

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use broker::RunningBroker;
use net::{Client, NoiseImager, VIEW, config, room, start};
use protocol::message::{Clock, Role};
use protocol::session::{ClientConfig, SessionError};
use scene::Scene;
use tokio_tungstenite::connect_async;
use vantage_server::{Config, Running, relay};

/// With all that is not allowed in a subject.
const NAME: &str = "Ada *.> Ł";

async fn server(broker: &RunningBroker) -> Running {
    start(Config { publish: Some(broker.named()), ..config() }, room(false), Duration::ZERO).await
}

async fn relay_of(broker: &RunningBroker) -> relay::Running {
    relay::serve(config(), broker.named()).await.expect("a relay")
}

/// Waits until a relay knows its server.
async fn knows(relay: &relay::Running) {
    for _ in 0..1000 {
        if net::request_at(relay.addr, "/readyz", "").await.starts_with("HTTP/1.1 200") {
            return;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    panic!("the relay hears of no server");
}

async fn client_at(addr: SocketAddr, role: Role) -> Client {
    let (socket, _) = connect_async(format!("ws://{addr}/ws")).await.expect("websocket");
    Client::over(socket, ClientConfig { role, ..ClientConfig::new(Clock::Wall, VIEW) })
}

async fn follower(relay: &relay::Running) -> Client {
    client_at(relay.addr, Role::Follower(NAME.to_owned())).await
}

/// Who presents, and holds some updates.
async fn presenter(server: &Running) -> Client {
    let mut presenter = Client::of_audience(server, Role::Presenter(NAME.to_owned())).await;
    presenter.run(10.0, |client| client.updates.len() > 1).await.expect("a session");
    settles(&mut presenter).await;
    presenter
}

/// Until nothing more comes.
async fn settles(presenter: &mut Client) {
    presenter.run(0.5, |_| false).await.expect("a session");
}

/// Lets both hear until they hold the same.
async fn catches_up(follower: &mut Client, presenter: &mut Client) {
    for _ in 0..200 {
        if follower.held.number == presenter.held.number {
            break;
        }
        let (followed, presented) = tokio::join!(follower.run(0.1, |_| false), presenter.run(0.1, |_| false));
        followed.and(presented).expect("sessions");
    }
    let came_to = |client: &Client| (client.held.number, client.held.digest());
    assert_eq!(came_to(follower), came_to(presenter));
    assert!(follower.held.patches == presenter.held.patches);
}

/// Whether updates came one after the other since the last beginning.
fn in_order(client: &Client) -> bool {
    client.updates.windows(2).all(|pair| pair[1].clears || pair[1].number == pair[0].number + 1)
}

#[tokio::test(flavor = "multi_thread")]
async fn who_follows_at_a_relay_holds_what_the_presenter_holds() {
    let Some(broker) = RunningBroker::start() else { return };
    let (server, relay) = (server(&broker).await, relay_of(&broker).await);
    knows(&relay).await;
    let mut presenter = presenter(&server).await;
    let published = &server.stats.published;
    assert_eq!(published.bytes.load(Ordering::Relaxed), 0, "nobody follows");
    let mut early = [follower(&relay).await, follower(&relay).await];
    for follower in &mut early {
        catches_up(follower, &mut presenter).await;
        assert!(follower.updates[0].clears, "it began with the whole copy");
    }
    presenter.walk(1.0).await.expect("a walk");
    settles(&mut presenter).await;
    let mut late = follower(&relay).await;
    for follower in early.iter_mut().chain([&mut late]) {
        catches_up(follower, &mut presenter).await;
        assert!(in_order(follower));
        let eye = follower.presenter.expect("where the presenter's eye is").translation;
        assert!(eye.x > presenter.start_eye().translation.x + 1.0, "{eye}");
    }
    assert!(early[0].updates.len() > 3, "each update came by itself");
    assert!(published.updates.load(Ordering::Relaxed) < 2 * early[0].updates.len() as u64, "once for both of them");
    assert!(published.wholes.load(Ordering::Relaxed) <= 3);
    assert_eq!(relay.relay.heard.gaps.load(Ordering::Relaxed), 0);
    relay.stop().await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_broker_that_went_away_is_found_again() {
    let Some(broker) = RunningBroker::start() else { return };
    let (server, relay) = (server(&broker).await, relay_of(&broker).await);
    knows(&relay).await;
    let mut presenter = presenter(&server).await;
    let mut follower = follower(&relay).await;
    catches_up(&mut follower, &mut presenter).await;
    let held = follower.held.clone();
    let starts = broker.kill();
    presenter.walk(1.0).await.expect("the server serves on");
    follower.run(0.2, |_| false).await.expect("who follows stays");
    assert!(follower.held.patches == held.patches && !held.patches.is_empty(), "it keeps its picture");
    let _broker = starts();
    presenter.walk(0.5).await.expect("a walk");
    settles(&mut presenter).await;
    catches_up(&mut follower, &mut presenter).await;
    assert!(follower.held.number > held.number);
    relay.stop().await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_last_update_is_not_missed_where_nothing_follows_it() {
    let Some(broker) = RunningBroker::start() else { return };
    let (server, relay) = (server(&broker).await, relay_of(&broker).await);
    knows(&relay).await;
    let mut presenter = presenter(&server).await;
    let mut follower = follower(&relay).await;
    catches_up(&mut follower, &mut presenter).await;
    let starts = broker.kill();
    presenter.walk(0.5).await.expect("the server serves on");
    settles(&mut presenter).await;
    // Longer than anybody is remembered who asks: what was sent meanwhile is gone.
    tokio::join!(follower.run(7.0, |_| false), presenter.run(7.0, |_| false)).0.expect("who follows stays");
    let _broker = starts();
    catches_up(&mut follower, &mut presenter).await;
    relay.stop().await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_relay_that_is_started_again_is_like_any_other() {
    let Some(broker) = RunningBroker::start() else { return };
    let (server, first) = (server(&broker).await, relay_of(&broker).await);
    knows(&first).await;
    let mut presenter = presenter(&server).await;
    let mut before = follower(&first).await;
    catches_up(&mut before, &mut presenter).await;
    let ((), ended) = tokio::join!(first.stop(), before.run(10.0, |_| false));
    assert!(matches!(ended, Err(SessionError::Goodbye { again: true, .. })), "{ended:?}");
    presenter.walk(0.5).await.expect("a walk");
    settles(&mut presenter).await;
    let second = relay_of(&broker).await;
    knows(&second).await;
    let mut after = follower(&second).await;
    catches_up(&mut after, &mut presenter).await;
    second.stop().await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_is_started_again_is_followed_again() {
    let Some(broker) = RunningBroker::start() else { return };
    let (first, relay) = (server(&broker).await, relay_of(&broker).await);
    knows(&relay).await;
    let mut presenter_before = presenter(&first).await;
    let mut before = follower(&relay).await;
    catches_up(&mut before, &mut presenter_before).await;
    drop(presenter_before);
    first.stop().await;
    before.run(0.5, |_| false).await.expect("it keeps its picture");
    let second = server(&broker).await;
    let mut presenter = presenter(&second).await;
    let ended = before.run(20.0, |_| false).await.expect_err("another server, another session");
    assert!(matches!(&ended, SessionError::Goodbye { again: true, reason } if reason.contains("anew")), "{ended}");
    let mut after = follower(&relay).await;
    catches_up(&mut after, &mut presenter).await;
    presenter.walk(0.3).await.expect("a walk");
    settles(&mut presenter).await;
    catches_up(&mut after, &mut presenter).await;
    relay.stop().await;
    second.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_in_place_of_another_is_published_in_its_place() {
    let Some(broker) = RunningBroker::start() else { return };
    let (server, relay) = (server(&broker).await, relay_of(&broker).await);
    knows(&relay).await;
    let mut presenter_before = presenter(&server).await;
    let mut before = follower(&relay).await;
    catches_up(&mut before, &mut presenter_before).await;
    let options = Config { publish: Some(broker.named()), ..config() };
    let other = Scene { name: "hall".into(), ..room(false) };
    let imager = Box::new(NoiseImager { delay: Duration::ZERO });
    server.show(options, Arc::new(other), imager).expect("shown");
    for (client, whose) in [(&mut presenter_before, "server"), (&mut before, "relay")] {
        let ended = client.run(20.0, |_| false).await.expect_err(whose);
        assert!(matches!(&ended, SessionError::Goodbye { again: true, reason } if reason.contains("anew")), "{ended}");
    }
    let mut presenter = presenter(&server).await;
    let mut after = follower(&relay).await;
    catches_up(&mut after, &mut presenter).await;
    assert_eq!(after.welcome.as_ref().expect("welcomed").scene_name, "hall");
    presenter.walk(0.3).await.expect("a walk");
    settles(&mut presenter).await;
    catches_up(&mut after, &mut presenter).await;
    relay.stop().await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn garbage_at_the_broker_holds_nobody_up() {
    let Some(broker) = RunningBroker::start() else { return };
    let (server, relay) = (server(&broker).await, relay_of(&broker).await);
    knows(&relay).await;
    let mut presenter = presenter(&server).await;
    let mut follower = follower(&relay).await;
    catches_up(&mut follower, &mut presenter).await;
    let stranger = async_nats::connect(format!("127.0.0.1:{}", broker.port)).await.expect("a connection");
    let mut heard = stranger.subscribe("vantage.>").await.expect("a subscription");
    let listens = async {
        let mut said = Vec::new();
        while let Ok(Some(message)) =
            tokio::time::timeout(Duration::from_secs(1), futures_util::StreamExt::next(&mut heard)).await
        {
            said.push(message);
            if said.len() > 60 {
                break;
            }
        }
        said
    };
    let (walked, said) = tokio::join!(presenter.walk(1.5), listens);
    walked.expect("a walk");
    assert!(said.iter().any(|message| message.subject.ends_with(".updates")), "it hears what is presented");
    // What was said again, cut, turned over, and on other subjects.
    for (index, message) in said.iter().enumerate() {
        let mut bytes = message.payload.to_vec();
        let (half, place) = (bytes.len() / 2, index * 7 % bytes.len().max(1));
        let other = &said[(index * 31 + 7) % said.len()].subject;
        stranger.publish(message.subject.clone(), bytes[..half].to_vec().into()).await.expect("published");
        stranger.publish(other.clone(), message.payload.clone()).await.expect("published");
        // Not the samples: what is sound and wrong, only who decodes it can tell.
        bytes[place.min(28)] ^= 0x55;
        stranger.publish(message.subject.clone(), bytes.into()).await.expect("published");
        stranger.publish(message.subject.clone(), vec![index as u8; index * 100].into()).await.expect("published");
    }
    stranger.flush().await.expect("sent");
    presenter.walk(0.5).await.expect("a walk");
    settles(&mut presenter).await;
    catches_up(&mut follower, &mut presenter).await;
    assert!(relay.relay.heard.refused.load(Ordering::Relaxed) > 20);
    relay.stop().await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_reads_nothing_is_cut_off_and_others_follow_on() {
    let Some(broker) = RunningBroker::start() else { return };
    let server = server(&broker).await;
    let mut patience = config();
    // More than between two pings of who reads.
    patience.limits.silence = Duration::from_secs(8);
    let relay = relay::serve(patience, broker.named()).await.expect("a relay");
    knows(&relay).await;
    let mut presenter = presenter(&server).await;
    let (mut reads, mut stalls) = (follower(&relay).await, follower(&relay).await);
    stalls.run(10.0, |client| client.welcome.is_some()).await.expect("a session");
    catches_up(&mut reads, &mut presenter).await;
    let until = std::time::Instant::now() + Duration::from_secs(20);
    while relay.relay.stats.cut_off.load(Ordering::Relaxed) == 0 && std::time::Instant::now() < until {
        tokio::join!(presenter.walk(0.5), reads.run(0.5, |_| false)).1.expect("it reads");
    }
    assert_eq!(relay.relay.stats.cut_off.load(Ordering::Relaxed), 1);
    settles(&mut presenter).await;
    catches_up(&mut reads, &mut presenter).await;
    assert!(in_order(&reads));
    relay.stop().await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_does_not_follow_is_told_whom_one_can_follow() {
    let Some(broker) = RunningBroker::start() else { return };
    let relay = relay_of(&broker).await;
    let early = client_at(relay.addr, Role::Viewer).await.run(10.0, |_| false).await.expect_err("no server yet");
    assert!(matches!(&early, SessionError::Goodbye { again: true, reason } if reason.contains("a test")), "{early}");
    assert!(net::request_at(relay.addr, "/readyz", "").await.starts_with("HTTP/1.1 503"));
    let server = server(&broker).await;
    knows(&relay).await;
    let _presenter = presenter(&server).await;
    // Until the relay has heard of him.
    tokio::time::sleep(Duration::from_millis(1500)).await;
    for role in [Role::Viewer, Role::Presenter("Grace".to_owned())] {
        let told = client_at(relay.addr, role).await.run(10.0, |_| false).await.expect_err("one only follows");
        let SessionError::Goodbye { reason, again: false } = &told else { panic!("{told}") };
        assert!(reason.contains("relay") && reason.contains(NAME), "{reason}");
    }
    let page = net::request_at(relay.addr, "/?fov=40", "").await;
    assert!(page.contains("307") && page.contains("location: /?fov=40&follow=Ada%20%2A%2E%3E%20%C5%81\r\n"), "{page}");
    for (asked, path) in [(relay.addr, "/?follow=Grace"), (server.addr, "/")] {
        assert!(net::request_at(asked, path, "").await.starts_with("HTTP/1.1 200"), "{path}");
    }
    let metrics = net::request_at(relay.addr, "/metrics", "").await;
    assert!(
        metrics.contains("\nvantage_relay_presenters 1\n") && metrics.contains("\nvantage_relay_up 1\n"),
        "{metrics}"
    );
    let health = net::request_at(relay.addr, "/healthz", "").await;
    assert!(health.contains("\"relays\":\"room\"") && health.contains("\"ok\":true"), "{health}");
    relay.stop().await;
    server.stop().await;
}
