//! A GPU's device that is lost while a server draws on it: the scene goes onto another one, and sessions go on.

mod net;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use gpu::Gpu;
use net::{Client, VIEW, config, request};
use protocol::message::Clock;
use protocol::session::ClientConfig;
use vantage_server::Config;
use vantage_server::config::ComparesOn;
use vantage_server::devices::Devices;
use vantage_server::imager::GpuImager;
use vantage_server::source;

async fn survives(scene: &str, compares_on: ComparesOn) {
    let scene = Arc::new(source::load(scene, 1.0, &|_| {}).expect("a scene"));
    let config = Config { image_size_px: 48, compares_on, ..config() };
    let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
    let devices = Devices::new(None, scene.clone(), config.clone());
    let imager = GpuImager::new(&gpu, &scene, &config).expect("it uploads").on(devices);
    let running = vantage_server::serve(config, scene, Box::new(imager)).await.expect("serve");
    let mut clients = Vec::new();
    for _ in 0..2 {
        let mut client = Client::with(&running, ClientConfig::new(Clock::Wall, VIEW)).await;
        client.run(60.0, |client| client.updates.len() >= 2).await.expect("a session");
        clients.push(client);
    }
    gpu.lose();
    let begun = Instant::now();
    for client in &mut clients {
        // It moves, so that it is looked for.
        while !client.updates.iter().skip(1).any(|head| head.clears) {
            client.walk(0.5).await.expect("a session that goes on");
            assert!(begun.elapsed() < Duration::from_secs(120), "it does not begin anew");
        }
        let so_far = client.updates.len();
        while client.updates.len() < so_far + 2 {
            client.walk(0.5).await.expect("a session that goes on");
            assert!(begun.elapsed() < Duration::from_secs(120), "nothing comes any more");
        }
    }
    assert!(running.stats.renewals.load(Ordering::Relaxed) >= 1);
    assert_eq!(running.stats.connected.load(Ordering::Relaxed), 2);
    assert!(request(&running, "/readyz", "").await.starts_with("HTTP/1.1 200"));
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn where_the_processor_compares() {
    survives("pillars", ComparesOn::Processor).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn where_the_gpu_compares() {
    survives("pillars", ComparesOn::Gpu).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn in_a_scene_that_deforms_or_moves() {
    survives("pillars-moving", ComparesOn::Processor).await;
}
