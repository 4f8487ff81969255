//! What websockets alone cost: a plain axum server that sends messages of the same sizes to as many clients, which only read them.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use anyhow::Context;
use axum::Router;
use axum::extract::State;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::routing::get;
use bytes::Bytes;
use futures_util::StreamExt;
use protocol::wire::FRAGMENT_BYTES;
use tokio::runtime::Runtime;
use tokio::sync::broadcast;

use crate::spent;

/// The name of the server's threads.
pub(super) const THREADS: &str = "plain-axum";
/// Updates that a slow client may lag behind before it misses some.
const QUEUE: usize = 64;

/// Bytes that clients got for a second of the server's processor time.
pub(super) fn bytes_per_core_s(
    load: &Runtime,
    clients: usize,
    (update_bytes, updates_per_s): (usize, f64),
    duration: Duration,
) -> anyhow::Result<f64> {
    let server = tokio::runtime::Builder::new_multi_thread().thread_name(THREADS).enable_all().build()?;
    let (updates, _) = broadcast::channel::<Bytes>(QUEUE);
    let addr = server.block_on(serve(updates.clone()))?;
    let readers: Vec<_> = (0..clients).map(|_| load.spawn(read(addr, duration))).collect();
    // Everybody is there before anything is sent.
    let patience = Instant::now();
    while updates.receiver_count() < clients && patience.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(10));
    }
    let before = spent::spent([THREADS]).context("the system does not tell processor time by thread")?;
    let sender = server.spawn(send(updates, update_bytes, updates_per_s));
    let mut bytes = 0;
    for reader in readers {
        bytes += load.block_on(reader)??;
    }
    let spent_s = spent::spent([THREADS]).map_or(f64::NAN, |after| after.since(&before).named_s[0]);
    sender.abort();
    server.shutdown_background();
    Ok(bytes as f64 / spent_s)
}

async fn serve(updates: broadcast::Sender<Bytes>) -> anyhow::Result<SocketAddr> {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await?;
    let addr = listener.local_addr()?;
    let router = Router::new().route("/ws", get(websocket)).with_state(updates);
    tokio::spawn(async move { axum::serve(listener, router).await });
    Ok(addr)
}

async fn websocket(
    State(updates): State<broadcast::Sender<Bytes>>,
    upgrade: WebSocketUpgrade,
) -> axum::response::Response {
    let receiver = updates.subscribe();
    upgrade.on_upgrade(move |socket| pass_on(socket, receiver))
}

async fn pass_on(mut socket: WebSocket, mut updates: broadcast::Receiver<Bytes>) {
    while let Ok(bytes) = updates.recv().await {
        if socket.send(Message::Binary(bytes)).await.is_err() {
            return;
        }
    }
}

/// Sends updates in messages as large as fragments at most.
async fn send(updates: broadcast::Sender<Bytes>, update_bytes: usize, updates_per_s: f64) {
    let update = Bytes::from(vec![7; update_bytes]);
    let mut ticks = tokio::time::interval(Duration::from_secs_f64(1.0 / updates_per_s));
    loop {
        ticks.tick().await;
        for from in (0..update_bytes).step_by(FRAGMENT_BYTES) {
            // Whoever is gone needs nothing.
            let _ = updates.send(update.slice(from..update_bytes.min(from + FRAGMENT_BYTES)));
        }
    }
}

/// Reads for a time; how many bytes came.
async fn read(addr: SocketAddr, duration: Duration) -> anyhow::Result<u64> {
    let (mut socket, _) = tokio_tungstenite::connect_async(format!("ws://{addr}/ws")).await?;
    let mut bytes = 0;
    let reading = async {
        while let Some(Ok(message)) = socket.next().await {
            bytes += message.len() as u64;
        }
    };
    // The time is over, which is how it ends.
    let _ = tokio::time::timeout(duration, reading).await;
    Ok(bytes)
}
