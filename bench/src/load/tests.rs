//! Runs against a server in this process.

use std::sync::Arc;
use std::time::Duration;

use gpu::Gpu;
use protocol::message::Clock;
use server::imager::GpuImager;

use super::{Behaviour, Limits, Load, Report, run, runtime};
use crate::stage::load_scene;

fn load(server: String, script: &str, seconds: f64) -> Load {
    Load {
        server,
        clients: 4,
        duration: Duration::from_secs_f64(seconds),
        tells_progress: false,
        ramp: Duration::ZERO,
        traces: Vec::new(),
        script: script.parse().expect("a script"),
        clock: Clock::Wall,
        audience: false,
        followed_at: Vec::new(),
        decoding: Some(2),
        scene: None,
        limits: Limits { latency_p99: Some(Duration::ZERO), interval_p99: None },
    }
}

fn missed(report: &Report) -> Vec<&str> {
    report.bars.iter().filter(|bar| bar.is_missed()).map(|bar| bar.what.as_str()).collect()
}

#[test]
fn a_storm_is_outlived_and_told_second_by_second() {
    let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
    let scene = load_scene("pillars", 1.0).expect("it is built in");
    let config = server::Config { port: 0, image_size_px: 32, ..server::Config::default() };
    let imager = GpuImager::new(&gpu, &scene, &config).expect("an imager");
    let runtime = runtime().expect("threads");
    let served = server::serve(config, Arc::new(scene), Box::new(imager));
    let running = runtime.block_on(served).expect("a server");
    let load = load(format!("ws://{}", running.addr), "reconnect:2,idle,orbit", 7.0);
    let report = runtime.block_on(run(&load)).expect("a run");
    runtime.block_on(running.stop());

    assert_eq!(missed(&report), ["from a pose to its update, p99"], "the limit is 0 s: {:?}", report.bars);
    assert_eq!((report.errors, report.empty_handed, report.reconnections), (0, 0, 2));
    for client in &report.clients {
        let came_back = u64::from(client.behaviour == Behaviour::Reconnect);
        assert_eq!((client.reconnections, client.held_samples > 0), (came_back, client.index < 2), "{client:?}");
    }
    assert_eq!(report.welcome.as_ref().map(|welcome| welcome.scene_name.as_str()), Some("pillars"));
    let seconds = &report.over_time;
    assert!((6..=8).contains(&seconds.len()), "{seconds:?}");
    assert_eq!(seconds.iter().map(|second| second.reconnections).sum::<u64>(), 2);
    assert!(seconds.iter().any(|second| second.connected == 4 && second.latency_ms.p99 > 0.0), "{seconds:?}");
    assert!(seconds.iter().all(|second| second.to_s < 4.5 || second.reconnections == 0 || second.to_s > 5.0));
}

#[test]
fn nobody_is_let_in_where_no_server_is() {
    let report = runtime().expect("threads").block_on(run(&load("ws://127.0.0.1:1".to_owned(), "idle", 0.5)));
    let report = report.expect("errors are part of the report");
    assert_eq!(report.errors, 4);
    assert!(missed(&report).contains(&"clients that ended by an error"), "{:?}", report.bars);
    assert!(report.errors_by_cause()[0].0.starts_with("cannot connect"), "{:?}", report.errors_by_cause());
}

#[test]
fn what_goes_by_real_time_has_no_virtual_clock() {
    let load = Load { clock: Clock::Virtual, ..load("ws://127.0.0.1:1".to_owned(), "walk,stall", 0.5) };
    let error = runtime().expect("threads").block_on(run(&load)).expect_err("no run");
    assert!(error.to_string().starts_with("stall goes by real time"), "{error}");
}
