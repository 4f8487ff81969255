use std::convert::Infallible;
use std::sync::Barrier;

use camera::{Camera, Pinhole, Rigid};
use glam::DVec3;

use super::super::request::{Settings, Subject};
use super::*;

/// Bytes of the images that are drawn here.
const BYTES: usize = 1 << 20;

/// What a camera so far aside sees.
fn request(aside_m: f64) -> Request {
    let eye = Rigid::look_along(DVec3::X * aside_m, DVec3::NEG_Z);
    let camera = Camera::Pinhole(Pinhole::symmetric(eye, (64, 64), 1.0, 0.1));
    Request { settings: Settings::default(), subject: Subject::CameraImage(camera) }
}

fn images() -> Answer {
    Answer::Ends(vec![0; BYTES / 2])
}

/// Asks for something; whether it had to be drawn.
fn is_drawn(pool: &Pool, aside_m: f64, occasion: Occasion) -> bool {
    let mut drawn = false;
    let draw = || {
        drawn = true;
        Ok::<_, Infallible>(images())
    };
    pool.answer(request(aside_m), occasion, draw).expect("it is drawn");
    drawn
}

fn stands(pool: &Pool, aside_m: f64) -> bool {
    is_drawn(pool, aside_m, Occasion::Standing)
}

fn pool(images: usize, ahead: usize) -> Pool {
    Pool::new(Caps { bytes: images * BYTES, ahead_bytes: ahead * BYTES, unasked: Duration::from_secs(10) })
}

#[test]
fn what_was_not_asked_for_the_longest_goes_first() {
    let pool = pool(3, 3);
    assert!([1.0, 2.0, 3.0].map(|aside_m| stands(&pool, aside_m)) == [true; 3]);
    assert!(!stands(&pool, 1.0), "it is kept");
    assert!(stands(&pool, 4.0));
    assert_eq!([1.0, 3.0, 4.0].map(|aside_m| stands(&pool, aside_m)), [false; 3]);
    assert!(stands(&pool, 2.0), "it went");
    assert_eq!(pool.bytes(), 3 * BYTES);
    assert_eq!((pool.drawn(), pool.shared()), (5, 4));
}

#[test]
fn what_is_larger_than_a_pool_drives_nothing_out() {
    let pool = pool(2, 2);
    stands(&pool, 1.0);
    let large = || Ok::<_, Infallible>(Answer::Ends(vec![0; 2 * BYTES]));
    pool.answer(request(9.0), Occasion::Standing, large).expect("it is drawn");
    assert!(!stands(&pool, 1.0) && stands(&pool, 9.0));
}

#[test]
fn what_is_drawn_ahead_drives_out_nothing_but_its_like() {
    let pool = pool(4, 2);
    stands(&pool, 1.0);
    for aside_m in [11.0, 12.0, 13.0, 14.0, 15.0] {
        assert!(is_drawn(&pool, aside_m, Occasion::Ahead));
    }
    assert!(!stands(&pool, 1.0));
    assert!(!is_drawn(&pool, 15.0, Occasion::Ahead) && is_drawn(&pool, 11.0, Occasion::Ahead));
    assert!([2.0, 3.0].map(|aside_m| stands(&pool, aside_m)) == [true; 2]);
    assert!(!is_drawn(&pool, 11.0, Occasion::Ahead) && is_drawn(&pool, 15.0, Occasion::Ahead), "one has room left");
    assert_eq!([1.0, 2.0, 3.0].map(|aside_m| stands(&pool, aside_m)), [false; 3]);
}

#[test]
fn who_passes_leaves_nothing_but_takes_what_is_there() {
    let pool = pool(4, 4);
    assert!([1, 2].map(|_| is_drawn(&pool, 1.0, Occasion::Passing)) == [true; 2]);
    assert_eq!(pool.bytes(), 0);
    stands(&pool, 1.0);
    assert!(!is_drawn(&pool, 1.0, Occasion::Passing));
}

#[test]
fn what_nobody_asks_for_is_given_back() {
    let pool = pool(4, 4);
    stands(&pool, 1.0);
    let now = Instant::now();
    assert!(!pool.forget_unasked(now + Duration::from_secs(9)), "for as long as a while");
    assert!(pool.bytes() > 0 && pool.forget_unasked(now + Duration::from_secs(11)));
    assert_eq!(pool.bytes(), 0);
}

#[test]
fn who_asks_for_what_is_being_drawn_waits_for_it() {
    let (pool, begun) = (pool(4, 4), Barrier::new(2));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            pool.answer(request(1.0), Occasion::Standing, || {
                begun.wait();
                std::thread::sleep(Duration::from_millis(20));
                Ok::<_, Infallible>(images())
            })
        });
        begun.wait();
        assert!(pool.holds(&request(1.0)) && !stands(&pool, 1.0));
    });
    assert_eq!((pool.drawn(), pool.shared()), (1, 1));
}

#[test]
fn nobody_waits_for_who_fails_or_panics() {
    let (pool, begun) = (pool(4, 4), Barrier::new(2));
    assert!(pool.answer(request(1.0), Occasion::Standing, || Err("lost")).is_err());
    assert!(stands(&pool, 1.0));
    std::thread::scope(|scope| {
        let panicking = scope.spawn(|| {
            let draw = || -> Result<Answer, Infallible> {
                begun.wait();
                std::thread::sleep(Duration::from_millis(20));
                panic!("a fault that a test asked for")
            };
            pool.answer(request(2.0), Occasion::Standing, draw)
        });
        begun.wait();
        assert!(stands(&pool, 2.0), "drawn by who waited");
        assert!(panicking.join().is_err());
    });
    assert!(!stands(&pool, 2.0), "and kept");
}
