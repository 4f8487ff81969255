//! What was done for one viewer does for all who come to where it stood.

mod common;

use std::sync::Arc;

use camera::Rigid;
use common::session::{Session, VIEW};
use glam::DVec3;
use protocol::Held;
use protocol::message::{Draws, Shadows, ViewSize};
use protocol::wire::encode_update;
use vantage_server::client::Client;
use vantage_server::plan::Reason;
use vantage_server::pool::Pool;
use vantage_server::start::start_pose;
use vantage_server::viewer::Viewer;

/// Ticks of a viewer who stands.
const STANDS: usize = 12;

/// A session whose stage shares what it does.
fn sharing(session: Session) -> (Session, Arc<Pool>) {
    let pool = Arc::new(Pool::default());
    (session.sharing(pool.clone()), pool)
}

/// Why updates were made, and their bytes.
type Sent = Vec<(Reason, Vec<u8>)>;

/// A new client where the scene begins, which draws what clients of this kind do.
fn arrive(session: &mut Session, draws: Draws) {
    session.viewer = Viewer::at_start(VIEW, start_pose(&session.scene), 0.0);
    (session.client, session.held, session.now_s) = (Client { draws, ..Client::default() }, Held::default(), 0.0);
}

fn ticks(session: &mut Session, count: usize) -> Sent {
    let sent = |made: vantage_server::frame::Made| {
        assert!(made.encoded() == encode_update(&made.update, made.coding), "coded as if for it alone");
        (made.reason, made.encoded().bytes)
    };
    (0..count).filter_map(|_| session.tick()).map(sent).collect()
}

/// What a new client is sent while it stands and then, after some steps, elsewhere.
fn visit(session: &mut Session, draws: Draws) -> (Sent, Sent) {
    arrive(session, draws);
    let stands = ticks(session, STANDS);
    let start = session.viewer.world_from_eye;
    let aside = Rigid { translation: start.translation + DVec3::new(0.3, 0.0, -0.2), ..start };
    session.walk_to(aside, 3);
    (stands, ticks(session, 3))
}

fn bytes(sent: &Sent) -> usize {
    sent.iter().map(|(_, bytes)| bytes.len()).sum()
}

#[test]
fn whoever_comes_second_costs_no_image_and_gets_the_same_bytes() {
    let shadows = Draws { shadows: Shadows::Soft, ..Draws::default() };
    for (name, draws) in
        [("pillars", Draws::default()), ("lamp-teapots", shadows), ("mirror-teapots", Draws::default())]
    {
        let (mut session, pool) = sharing(Session::resting(name));
        let first = visit(&mut session, draws);
        assert!(first.0.iter().any(|(reason, _)| *reason == Reason::Rest), "{name}: it rests");
        assert_eq!(pool.looks_shared(), 0, "{name}: nobody was there before");
        arrive(&mut session, draws);
        let drawn = pool.drawn();
        assert!(drawn > 0);
        let stands = ticks(&mut session, STANDS);
        assert_eq!(pool.drawn(), drawn, "{name}: all was there");
        assert!(stands == first.0, "{name}: the same bytes while they stand");
        assert!(pool.looks_shared() > 1, "{name}: {} looks", pool.looks_shared());
        let again = visit(&mut session, draws);
        assert!(again.0 == first.0, "{name}: and for whoever comes third");
        // Its copy is meshed as it is by then, not edit by edit: a sample or two look otherwise.
        let (first, again) = (bytes(&first.1), bytes(&again.1));
        assert!(again.abs_diff(first) <= first / 100, "{name}: it goes on as the first did, {first} and {again} bytes");
    }
}

#[test]
fn whoever_comes_second_is_served_the_same_where_the_gpu_compares() {
    let (mut session, pool) = sharing(Session::built_in("pillars").comparing_on_gpu());
    let first = visit(&mut session, Draws::default());
    let again = visit(&mut session, Draws::default());
    assert!(again.0 == first.0 && pool.looks_shared() > 1, "{} looks", pool.looks_shared());
    // What it was sent for another's sake is known on the GPU, too: what it lacks elsewhere is the same.
    let (first, again) = (bytes(&first.1), bytes(&again.1));
    assert!(first > 0 && again.abs_diff(first) <= first / 100, "{first} and {again} bytes");
}

#[test]
fn rows_at_rest_that_come_at_other_times_change_no_look() {
    let (mut session, pool) = sharing(Session::resting("pillars"));
    let arrive = |session: &mut Session, bytes_per_s: Option<f64>| {
        arrive(session, Draws::default());
        session.viewer.view = ViewSize { width_px: 320, height_px: 160, ..VIEW };
        session.viewer.bytes_per_s = bytes_per_s;
    };
    arrive(&mut session, None);
    let first = ticks(&mut session, STANDS);
    // A slow path: few rows a turn, between looks.
    arrive(&mut session, Some(1e3));
    let shared = pool.looks_shared();
    let slow = ticks(&mut session, STANDS);
    let looks = |sent: &Sent| sent.iter().filter(|(reason, _)| *reason != Reason::Rest).count();
    let rows = |sent: &Sent| sent.iter().filter(|(reason, _)| *reason == Reason::Rest).count();
    assert!(rows(&slow) > rows(&first), "{} and {}", rows(&slow), rows(&first));
    assert!(pool.looks_shared() as usize - shared as usize >= looks(&slow), "every look was shared");
}

#[test]
fn whoever_draws_or_sees_something_else_shares_no_look() {
    let (mut session, pool) = sharing(Session::built_in("pillars"));
    visit(&mut session, Draws::default());
    for other in 0..3 {
        arrive(&mut session, Draws::default());
        match other {
            0 => session.client.draws.occlusion_reach_m = 0.5,
            1 => session.viewer.view.fov_y_rad = 1.1,
            _ => session.client.budget_bytes = 40 << 20,
        }
        ticks(&mut session, 1);
        assert_eq!(pool.looks_shared(), 0, "{other}");
    }
    arrive(&mut session, Draws::default());
    session.client.start_anew();
    ticks(&mut session, 1);
    assert_eq!(pool.looks_shared(), 0, "who begins anew clears what it held");
    arrive(&mut session, Draws::default());
    session.now_s = 7.0;
    ticks(&mut session, 1);
    assert_eq!(pool.looks_shared(), 1);
    let taken_s = session.held.patches.values().map(|held| held.patch.capture_time_s);
    assert!(taken_s.clone().count() > 0 && taken_s.clone().all(|time_s| time_s == 7.0), "at its own time");
}

#[test]
fn twins_share_and_who_moves_leaves_nothing() {
    let (mut session, pool) = sharing(Session::built_in("pillars"));
    arrive(&mut session, Draws::default());
    let first = ticks(&mut session, 2);
    session.stage = session.stage.twin().expect("nothing deforms");
    arrive(&mut session, Draws::default());
    let (drawn, bytes) = (pool.drawn(), pool.bytes());
    assert!(ticks(&mut session, 2) == first);
    assert_eq!((pool.drawn(), pool.bytes()), (drawn, bytes));
    assert_eq!(pool.looks_shared(), first.len() as u64);
    let start = session.viewer.world_from_eye;
    session.walk_to(Rigid { translation: start.translation + DVec3::X, ..start }, 1);
    session.hear(start, DVec3::X);
    ticks(&mut session, 2);
    assert!(pool.drawn() > drawn, "it was looked at");
}

#[test]
fn an_animated_scene_shares_nothing() {
    let (mut session, pool) = sharing(Session::built_in("pillars-moving"));
    for _ in 0..2 {
        arrive(&mut session, Draws::default());
        assert!(!ticks(&mut session, 2).is_empty());
    }
    assert_eq!((pool.drawn(), pool.shared(), pool.looks_shared(), pool.bytes()), (0, 0, 0, 0));
}
