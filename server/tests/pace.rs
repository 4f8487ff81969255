//! How large images are: coarse before a first set, and while a viewer moves on a slow path.

mod common;

use camera::Rigid;
use common::session::Session;
use glam::DVec3;
use vantage_server::frame::Made;
use vantage_server::plan::Reason;

#[test]
fn a_coarse_picture_comes_before_the_first_set_and_makes_way_for_it() {
    let mut session = Session::built_in("pillars");
    session.stage = session.stage.coarse_first(true);
    let images = |session: &Session| session.held.patches.len();
    let largest_px = |session: &Session| {
        let sizes = session.held.patches.values().map(|held| held.patch.image.mask.size_px().0);
        sizes.max().expect("something is held")
    };
    let coarse = session.tick().expect("a coarse picture");
    assert_eq!((coarse.reason, images(&session), largest_px(&session)), (Reason::First, 1, 32));
    assert!(session.held.sample_count() > 32 * 32 / 2, "a room fills its view");
    let set = session.tick().expect("the set");
    assert_eq!((set.reason, images(&session), largest_px(&session)), (Reason::First, 3, 64));
    session.settle();
    session.start_anew();
    let again = session.tick().expect("a coarse picture");
    assert_eq!((again.reason, images(&session)), (Reason::First, 1));
}

/// The viewer goes on along x, a tick.
fn step_m(session: &mut Session, x_m: f64) -> Made {
    let mut eye = session.viewer.world_from_eye;
    eye.translation.x += x_m;
    session.hear(Rigid { ..eye }, DVec3::X * x_m / common::session::INTERVAL_S);
    session.tick().expect("what came into view")
}

#[test]
fn who_waits_for_turns_gets_one_small_image_first_sets_too_and_whole_ones_when_standing() {
    // One of three images, of a quarter of the side.
    for (sheds_load, share) in [(false, 1), (true, 3 * 16)] {
        let mut session = Session::built_in("pillars");
        session.stage = session.stage.shed_load(sheds_load);
        let wait = |session: &mut Session| (0..3).for_each(|_| session.stage.waited(&mut session.client, 1.0));
        let whole_px = 3 * 64 * 64;
        wait(&mut session);
        let set = session.tick().expect("a set");
        assert_eq!((set.reason, set.pixels), (Reason::First, whole_px / share));
        session.settle();
        let moved = step_m(&mut session, 0.2);
        assert_eq!((moved.reason, moved.pixels), (Reason::Moved, whole_px / share));
        let eye = session.viewer.world_from_eye;
        session.hear(eye, DVec3::ZERO);
        let reasons: Vec<_> = (0..20).filter_map(|_| session.tick()).map(|made| (made.reason, made.pixels)).collect();
        assert!(reasons.contains(&(Reason::Settling, whole_px)), "{reasons:?}");
    }
}

#[test]
fn under_load_no_coarse_picture_comes_before_the_first_set() {
    let mut session = Session::built_in("pillars");
    session.stage = session.stage.coarse_first(true).shed_load(true);
    session.stage.waited(&mut session.client, 1.0);
    assert_eq!(session.tick().map(|made| made.reason), Some(Reason::First));
    assert_ne!(session.tick().map(|made| made.reason), Some(Reason::First));
}

#[test]
fn who_moves_on_a_slow_path_gets_smaller_images_and_whole_ones_when_standing() {
    let mut session = Session::built_in("pillars");
    let whole_px = session.tick().expect("a set").pixels;
    session.settle();
    let fast = step_m(&mut session, 0.2);
    assert_eq!((fast.reason, fast.pixels), (Reason::Moved, whole_px), "three views of a size");
    // A quarter of its pixels in an interval, and then less than any size has.
    session.client.pace.made(4000, whole_px);
    for (bytes_per_s, queue_s, share) in [(10e3, 0.1, 4), (5e3, 0.0, 4), (1.0, 0.1, 16)] {
        (session.viewer.bytes_per_s, session.viewer.queue_s) = (Some(bytes_per_s), queue_s);
        let slow = step_m(&mut session, 0.2);
        assert_eq!((slow.reason, slow.pixels), (Reason::Moved, whole_px / share));
    }
    let eye = session.viewer.world_from_eye;
    session.hear(eye, DVec3::ZERO);
    let reasons: Vec<_> = (0..20).filter_map(|_| session.tick()).map(|made| (made.reason, made.pixels)).collect();
    assert!(reasons.contains(&(Reason::Settling, whole_px)), "{reasons:?}");
}

#[test]
fn what_comes_into_view_on_a_slow_path_comes_view_by_view() {
    let jumps = |bytes_per_s: f64| {
        let mut session = Session::built_in("pillars");
        session.stage = session.stage.coarse_first(true);
        session.settle();
        // Images are as large as ever, as updates cost hardly anything so far.
        (0..40).for_each(|_| session.client.pace.made(1, 3 * 64 * 64));
        (session.viewer.bytes_per_s, session.viewer.queue_s) = (Some(bytes_per_s), 0.1);
        let made = [1.0, 0.01].map(|x_m| step_m(&mut session, x_m));
        made.map(|made| made.counts.added)
    };
    let [whole, _] = jumps(1e9);
    // Of three views the first one, which brings more than the 4 KiB that are carried in half a second.
    let [first, second] = jumps(10e3);
    assert!(first * 4 < whole * 3 && first > 0, "{first} of {whole}");
    assert!(second > 0, "what was left out comes next");
}
