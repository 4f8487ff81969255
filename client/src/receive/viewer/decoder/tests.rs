//! A decoder with workers that live, die and lie.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use camera::{Camera, Pinhole, Rigid};
use protocol::codec::Coding;
use protocol::wire::{UpdateHead, encode_update};
use protocol::{DepthImage, DepthScale, Edit, Mask, NextSteps, Patch, PatchId, Purpose, Update};
use surface::{Corners, FarBytes, ProvokingVertex};

use super::elsewhere::{Elsewhere, PATIENCE_S};
use super::*;

/// The parts of an answer.
type Answer = Vec<Vec<u8>>;

/// What a worker does with the bytes of its n-th update.
type Behaviour = fn(usize, Question) -> Result<Option<Answer>, String>;

/// The bytes of an update, and how to build surfaces of it.
type Question = (Vec<u8>, u8);

#[derive(Debug)]
struct Fake {
    behaviour: Behaviour,
    sent: VecDeque<Question>,
    received: usize,
    given_up: Rc<RefCell<Vec<String>>>,
}

impl DecodeWorker for Fake {
    fn send(&mut self, bytes: &[u8], build: u8) {
        self.sent.push_back((bytes.to_vec(), build));
    }

    fn receive(&mut self) -> Result<Option<Vec<Box<dyn FarBytes>>>, String> {
        let Some(question) = self.sent.pop_front() else { return Ok(None) };
        self.received += 1;
        let answer = (self.behaviour)(self.received - 1, question)?;
        let part = |part| -> Box<dyn FarBytes> { Box::new(part) };
        Ok(answer.map(|answer| answer.into_iter().map(part).collect()))
    }

    fn give_up(&mut self, why: &str) {
        self.given_up.borrow_mut().push(why.to_owned());
    }
}

fn fake(behaviour: Behaviour) -> (Box<dyn DecodeWorker>, Rc<RefCell<Vec<String>>>) {
    let given_up = Rc::default();
    let worker = Fake { behaviour, sent: VecDeque::new(), received: 0, given_up: Rc::clone(&given_up) };
    (Box::new(worker), given_up)
}

fn live(_: usize, question: Question) -> Result<Option<Answer>, String> {
    Ok(Some(answer(&question)))
}

fn answer((bytes, build): &Question) -> Answer {
    let mut answer = Answer::new();
    answer_in_parts(bytes, *build, &Limits::default(), |part| answer.push(part));
    answer
}

fn update(number: u64) -> ReceivedUpdate {
    received(number, vec![Edit::Remove(PatchId(number as u32))])
}

fn received(number: u64, edits: Vec<Edit>) -> ReceivedUpdate {
    let update = Update { number, scene_time_s: 0.0, pose_seq: 0, edits, next: NextSteps::default(), digest: 7 };
    let bytes = encode_update(&update, Coding::default()).bytes;
    let head = UpdateHead::peek(&bytes).expect("sound bytes");
    ReceivedUpdate { head, sent_at_s: 0.0, arrived_at_s: number as f64, bytes }
}

/// The numbers of three updates as they come out, and whether they were still decoded beside at the end.
fn three_through(worker: Box<dyn DecodeWorker>) -> (Vec<u64>, bool) {
    let mut decoder = Decoder::elsewhere(Limits::default(), worker);
    (1..=3).for_each(|number| decoder.push(5, update(number)));
    let mut numbers = Vec::new();
    while let Some(decoded) = decoder.poll() {
        assert_eq!((decoded.session, decoded.arrived_at_s), (5, decoded.head.number as f64));
        let update = decoded.result.expect("sound bytes");
        assert_eq!(decoded.head.number, update.number);
        numbers.push(update.number);
    }
    (numbers, decoder.is_beside())
}

#[test]
fn a_worker_decodes_the_same_in_order() {
    let (worker, given_up) = fake(live);
    assert_eq!(three_through(worker), (vec![1, 2, 3], true));
    assert!(given_up.borrow().is_empty());
}

#[test]
fn nothing_is_lost_by_a_worker_that_dies() {
    let (worker, given_up) =
        fake(|number, question| if number == 1 { Err("out of memory".to_owned()) } else { live(0, question) });
    assert_eq!(three_through(worker), (vec![1, 2, 3], false));
    assert_eq!(*given_up.borrow(), ["out of memory"]);
}

#[test]
fn a_damaged_answer_ends_the_worker_and_nothing_is_lost() {
    for damage in [|_: Vec<u8>| Vec::new(), |_| vec![1], |_| vec![9; 20], |mut answer: Vec<u8>| answer.split_off(1)]
        as [fn(_) -> _; 4]
    {
        let whole = answer(&(update(1).bytes, 0)).remove(0);
        assert!(elsewhere::read_update(&damage(whole)).is_err());
    }
    let (worker, given_up) = fake(|_, question| Ok(Some(vec![answer(&question)[0][..30].to_vec()])));
    assert_eq!(three_through(worker), (vec![1, 2, 3], false));
    assert_eq!(*given_up.borrow(), ["a damaged answer: the bytes end early"]);
}

#[test]
fn a_damaged_update_is_refused_and_the_worker_stays() {
    let (worker, _) = fake(live);
    let mut decoder = Decoder::elsewhere(Limits::default(), worker);
    let sound = update(1);
    let cut = sound.bytes[..sound.bytes.len() - 1].to_vec();
    decoder.push(1, ReceivedUpdate { bytes: cut, ..sound });
    assert_eq!(decoder.poll().expect("an answer").result, Err("the bytes end early".to_owned()));
    assert!(decoder.is_beside());
}

#[test]
fn a_silent_worker_is_given_up_but_not_for_a_page_that_slept() {
    let (worker, given_up) = fake(|_, _| Ok(None));
    let mut elsewhere = Elsewhere::new(worker);
    let begin = Instant::now();
    let at = |seconds: f64| begin + Duration::from_secs_f64(seconds);
    let is_waiting = |poll: Result<Option<Decoded>, VecDeque<Job>>| matches!(poll, Ok(None));
    assert!(is_waiting(elsewhere.poll(at(0.0))));
    assert!(is_waiting(elsewhere.poll(at(1000.0))), "nothing is owed");
    elsewhere.push(Job { session: 1, update: update(1), build: None });
    assert!(is_waiting(elsewhere.poll(at(2000.0))), "the page slept");
    let looks = (1..).map(|look| at(2000.0 + f64::from(look) * 0.5));
    let mut polls = looks.map(|now| elsewhere.poll(now)).skip_while(|poll| matches!(poll, Ok(None)));
    let unanswered = polls.next().expect("without end").expect_err("given up");
    assert_eq!(unanswered.len(), 1);
    assert_eq!(*given_up.borrow(), [format!("no answer for {PATIENCE_S} s")]);
}

/// An update of a patch with a sample and of one that is no surface.
fn adding() -> ReceivedUpdate {
    let mut mask = Mask::empty(8, 8);
    mask.set(3, 4, true);
    let image = DepthImage {
        camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (8, 8), 1.0, 0.1)),
        depth_scale: DepthScale { w_min: 0.5, w_step: 0.0 },
        mask,
        depth: vec![0],
        normal: vec![[128, 128]],
        normal_rest: Vec::new(),
        ends: Vec::new(),
        colour: vec![[1, 2, 3]],
        colour_rest: Vec::new(),
        object: vec![1],
        material: vec![0],
        share: Vec::new(),
    };
    let patch = |id, purpose| {
        Edit::Add(Box::new(Patch {
            id: PatchId(id),
            purpose,
            capture_time_s: 0.0,
            objects: Vec::new(),
            image: image.clone(),
        }))
    };
    received(1, vec![patch(1, Purpose::Eye), patch(2, Purpose::Environment)])
}

/// How many surfaces come with an update.
fn surfaces(mut decoder: Decoder, build: Option<Build>) -> usize {
    build.into_iter().for_each(|build| decoder.set_build(build));
    decoder.push(1, adding());
    let decoded = (0..1000).find_map(|_| {
        std::thread::sleep(Duration::from_millis(2));
        decoder.poll()
    });
    let decoded = decoded.expect("decoded within two seconds");
    assert_eq!(decoded.result.expect("sound bytes").edits.len(), 2);
    decoded.built.len()
}

#[test]
fn surfaces_are_built_beside_the_drawing_where_anything_is_drawn() {
    let limits = Limits::default;
    let build = Some(Build { corners: Corners::Averaged, provoking: ProvokingVertex::Last });
    let thread = || Decoder::on_thread(limits(), std::sync::Arc::new(|| {})).expect("a thread");
    assert_eq!((surfaces(thread(), build), surfaces(thread(), None)), (1, 0));
    let worker = || Decoder::elsewhere(limits(), fake(live).0);
    assert_eq!((surfaces(worker(), build), surfaces(worker(), None)), (1, 0));
    assert_eq!(surfaces(Decoder::inline(limits()), build), 0);
}

#[test]
fn a_worker_whose_surfaces_are_damaged_is_given_up() {
    let (worker, given_up) = fake(|_, question| {
        let mut answer = answer(&question);
        answer[1].pop();
        Ok(Some(answer))
    });
    let build = Build { corners: Corners::Averaged, provoking: ProvokingVertex::First };
    assert_eq!(surfaces(Decoder::elsewhere(Limits::default(), worker), Some(build)), 0);
    assert_eq!(*given_up.borrow(), ["a damaged answer: the bytes of a surface are damaged"]);
}
