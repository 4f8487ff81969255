//! Faults of the server itself: each ends what it happened in, and nothing else.

mod net;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

use camera::Pinhole;
use gpu::GpuError;
use net::{Client, NoiseImager, config, request, room};
use protocol::message::Clock;
use protocol::session::SessionError;
use protocol::{Lighting, Material, Purpose};
use scene::Snapshot;
use surface::{AddressView, HeldSurfaces};
use tracing_subscriber::layer::{Context, SubscriberExt};
use vantage_server::Running;
use vantage_server::account::Account;
use vantage_server::discretize::{Capture, Discretization};
use vantage_server::imager::{Imager, ImagerError};
use vantage_server::render::RenderError;

/// What imagers do next.
#[derive(Default)]
struct Orders {
    /// So many captures panic.
    panics: AtomicU32,
    /// So many captures find the device lost.
    losses: AtomicU32,
    /// No device comes back.
    is_gone: AtomicBool,
    devices: AtomicU32,
}

/// Draws noise, and does otherwise where it is told to.
struct Faulty {
    noise: NoiseImager,
    orders: Arc<Orders>,
    device: u32,
    is_lost: bool,
}

fn one_less(of: &AtomicU32) -> bool {
    of.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |count| count.checked_sub(1)).is_ok()
}

impl Imager for Faulty {
    fn anew(&self) -> Result<Option<Box<dyn Imager>>, ImagerError> {
        if self.orders.is_gone.load(Ordering::SeqCst) {
            return Err(lost());
        }
        let device = self.device + u32::from(self.is_lost);
        self.orders.devices.fetch_max(device, Ordering::SeqCst);
        let (noise, orders) = (NoiseImager { delay: Duration::ZERO }, self.orders.clone());
        Ok(Some(Box::new(Faulty { noise, orders, device, is_lost: false })))
    }

    fn device(&self) -> u32 {
        self.device
    }

    fn adapter(&self) -> String {
        self.noise.adapter()
    }

    fn materials(&self) -> Vec<Material> {
        self.noise.materials()
    }

    fn lighting(&self, snapshot: &Snapshot) -> Lighting {
        self.noise.lighting(snapshot)
    }

    fn captures(
        &mut self,
        snapshot: &Snapshot,
        views: &[Pinhole],
        method: Discretization,
    ) -> Result<Vec<Capture>, ImagerError> {
        self.is_lost |= one_less(&self.orders.losses);
        assert!(!one_less(&self.orders.panics), "a fault that a test asked for");
        if self.is_lost { Err(lost()) } else { self.noise.captures(snapshot, views, method) }
    }

    fn new_surfaces(&self) -> Option<HeldSurfaces> {
        None
    }

    fn copy_view(&mut self, account: &Account, purpose: Purpose, view: &Pinhole) -> Result<AddressView, ImagerError> {
        self.noise.copy_view(account, purpose, view)
    }
}

fn lost() -> ImagerError {
    ImagerError::Render(RenderError::Gpu(GpuError::Lost("a loss that a test asked for".to_owned())))
}

/// A server whose imager takes orders; everything moves, so that there is an update at every tick.
async fn served() -> (Running, Arc<Orders>) {
    let orders = Arc::<Orders>::default();
    let noise = NoiseImager { delay: Duration::ZERO };
    let imager = Faulty { noise, orders: orders.clone(), device: 0, is_lost: false };
    let running = vantage_server::serve(config(), Arc::new(room(true)), Box::new(imager)).await.expect("serve");
    (running, orders)
}

async fn with_update(running: &Running) -> Client {
    let mut client = Client::connect(running, Clock::Wall).await;
    goes_on(&mut client).await;
    client
}

/// It gets further updates.
async fn goes_on(client: &mut Client) {
    let so_far = client.updates.len();
    client.run(10.0, |client| client.updates.len() > so_far + 2).await.expect("a session that goes on");
    assert!(client.updates.len() > so_far + 2);
}

/// It is told that the server ended its session, and that it may come again.
fn is_told(ended: Result<(), SessionError>) -> bool {
    matches!(ended, Err(SessionError::Goodbye { reason, again: true }) if reason.contains("a fault of the server"))
}

async fn eventually(what: &str, condition: impl Fn() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < Duration::from_secs(30), "{what}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_in_a_turn_ends_its_session_and_no_other() {
    let (running, orders) = served().await;
    let (mut one, mut other) = (with_update(&running).await, with_update(&running).await);
    orders.panics.store(1, Ordering::SeqCst);
    let (one_ended, other_ended) = tokio::join!(one.run(2.0, |_| false), other.run(2.0, |_| false));
    let told = [is_told(one_ended), is_told(other_ended)];
    assert_eq!(told.iter().filter(|told| **told).count(), 1, "{told:?}");
    let survivor = if told[0] { &mut other } else { &mut one };
    goes_on(survivor).await;
    drop(with_update(&running).await);
    let stats = &running.stats;
    assert_eq!((stats.faults.load(Ordering::Relaxed), stats.renewals.load(Ordering::Relaxed)), (1, 1));
    assert_eq!(stats.cut_off.load(Ordering::Relaxed), 0, "it was not the client's doing");
    assert!(request(&running, "/healthz", "").await.contains("\"ok\":true"));
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_device_is_replaced_and_sessions_go_on() {
    let (running, orders) = served().await;
    let (mut one, mut other) = (with_update(&running).await, with_update(&running).await);
    let so_far = [one.updates.len(), other.updates.len()];
    orders.losses.store(1, Ordering::SeqCst);
    eventually("another device", || orders.devices.load(Ordering::SeqCst) == 1).await;
    for (client, so_far) in [&mut one, &mut other].into_iter().zip(so_far) {
        // Any number of updates of the first device may still be on their way.
        let clears = |client: &Client| client.updates.iter().skip(so_far).filter(|head| head.clears).count();
        client.run(10.0, |client| clears(client) > 0).await.expect("a session that goes on");
        goes_on(client).await;
        assert_eq!(clears(client), 1, "what was drawn of its copy is gone, and it begins anew once");
    }
    assert_eq!(running.stats.connected.load(Ordering::Relaxed), 2);
    assert_eq!(running.stats.renewals.load(Ordering::Relaxed), 1);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn where_no_device_comes_back_the_server_says_so_and_ends() {
    let (running, orders) = served().await;
    let mut client = with_update(&running).await;
    orders.is_gone.store(true, Ordering::SeqCst);
    orders.losses.store(1, Ordering::SeqCst);
    let ended = client.run(60.0, |_| false).await.expect_err("no more images");
    assert!(ended.to_string().contains("no more images"), "{ended}");
    assert!(running.failed().await.contains("lost"));
    assert!(request(&running, "/readyz", "").await.starts_with("HTTP/1.1 503"));
    running.stop().await;
}

/// Panics when a session logs that its client begins anew, while it is armed: in the session's own task.
struct Tripwire(Arc<AtomicBool>);

impl<S: tracing::Subscriber> tracing_subscriber::Layer<S> for Tripwire {
    fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
        struct Meant(bool);
        impl tracing::field::Visit for Meant {
            fn record_debug(&mut self, field: &tracing::field::Field, value: &dyn std::fmt::Debug) {
                self.0 |= field.name() == "message" && format!("{value:?}").contains("starting anew");
            }
        }
        let mut meant = Meant(false);
        event.record(&mut meant);
        assert!(!(meant.0 && self.0.swap(false, Ordering::SeqCst)), "a fault that a test asked for");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_in_a_session_ends_it_and_leaves_nothing_behind() {
    let armed = Arc::new(AtomicBool::new(false));
    let log = tracing_subscriber::registry().with(Tripwire(armed.clone()));
    tracing::subscriber::set_global_default(log).expect("the only one of this process");
    let (running, _) = served().await;
    let (mut one, mut other) = (with_update(&running).await, with_update(&running).await);
    armed.store(true, Ordering::SeqCst);
    one.session.broken(one.now_s());
    assert!(is_told(one.run(10.0, |_| false).await));
    goes_on(&mut other).await;
    eventually("one session", || running.stats.clients.load(Ordering::Relaxed) == 1).await;
    assert_eq!(running.stats.faults.load(Ordering::Relaxed), 1);
    drop(with_update(&running).await);
    running.stop().await;
}
