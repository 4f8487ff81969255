//! What is found out on the GPU of a view and a copy is what the processor finds out.

mod common;

use std::collections::BTreeSet;

use camera::{Pinhole, Rigid};
use common::session::{Session, added};
use common::{gpu, moving_ball, swing};
use glam::{DQuat, DVec3};
use protocol::codec::ColourSteps;
use protocol::held::{HeldPatch, ObjectPose};
use protocol::{Mask, PatchId, Purpose};
use scene::Scene;
use vantage_server::Config;
use vantage_server::account::compare::Comparison;
use vantage_server::account::samples::Address;
use vantage_server::account::{Account, AccountRules, BYTES_PER_SAMPLE, Deforming, Surroundings};
use vantage_server::beside::{Asked, Found};
use vantage_server::config::ComparesOn;
use vantage_server::discretize::{Capture, DepthPrecision, Discretization};
use vantage_server::imager::{GpuImager, Imager};
use vantage_server::start::{near_m, start_pose};

/// Of all that is found, what rounding may decide: centres are projected in f32, not in f64, and a GPU may fuse what it multiplies and adds.
const MOST_SHARE: f64 = 0.002;

/// One client of a scene, looked at by both.
struct Both {
    scene: Scene,
    imager: GpuImager,
    account: Account,
    time_s: f64,
    /// What was found by both, and by one alone, of each kind: to send, to trim, to replace, to give up, and where what is sent ends.
    agreed: [usize; 5],
    differed: [usize; 5],
}

impl Both {
    fn new(scene: Scene) -> Both {
        let config = Config { compares_on: ComparesOn::Gpu, ..Config::default() };
        let imager = GpuImager::new(&gpu(), &scene, &config).expect("the scene uploads");
        Both { scene, imager, account: Account::default(), time_s: 0.0, agreed: [0; 5], differed: [0; 5] }
    }

    /// Looks from a view, lays both findings beside each other, and edits the copy by what the processor found.
    fn look(&mut self, view: &Pinhole, rules: AccountRules) {
        let snapshot = self.scene.at(self.time_s);
        let (materials, lighting) = (self.imager.materials(), self.imager.lighting(&snapshot));
        let instances = self.scene.instances.iter().zip(&snapshot.world_from_mesh).zip(0_u16..);
        let moving: Vec<ObjectPose> = instances
            .filter(|((instance, _), _)| instance.moves)
            .map(|((_, &world_from_object), object)| ObjectPose { object, world_from_object })
            .collect();
        let now = Surroundings {
            sky: None,
            colour: ColourSteps::Lossless,
            time_s: self.time_s,
            materials: &materials,
            lighting: &lighting,
            moving: &moving,
            deforming: &Deforming::default(),
        };
        let (imager, account) = (&mut self.imager, &mut self.account);
        account.draw_with(Purpose::Eye, || imager.new_surfaces());
        let comparer = imager.comparer().expect("compute shaders");
        account.begin(&now).expect("tables");
        assert!(comparer.takes(account, &[*view]), "there is room");
        let peers = account.captured_by(&[*view]);

        let kept = comparer.keep(&snapshot, &[*view]).expect("a view");
        let asked =
            Asked { rules, peers: &peers, trims: true, supersedes: rules.refines, is_seen: true, least_px: 0.0 };
        let on_gpu = comparer.compare(account, &kept[0], &asked).expect("it is read").expect("facts are kept");

        let captures = imager.captures(&snapshot, &[*view], Discretization::Conventional);
        let mut capture = captures.expect("a capture").remove(0);
        let copy = imager.copy_view(account, Purpose::Eye, view).expect("a view");
        let comparison = Comparison::new(&capture, (Purpose::Eye, &copy), account, &peers, rules);
        let (false_cover, lacking) = (comparison.false_cover(), comparison.lacking());
        let superseded = if rules.refines { account.superseded(&comparison, &lacking) } else { Vec::new() };

        drop(comparison);
        imager.tell_ends(&mut capture, &lacking.send).expect("it is drawn");
        assert_eq!(on_gpu.hits, capture.ids.iter().filter(|ids| ids[0] != 0).count());
        self.same_samples(&capture, &lacking.send, &on_gpu);
        self.same_addresses(1, &false_cover, &on_gpu.false_cover);
        self.same_addresses(2, &lacking.replaced, &on_gpu.lacking.replaced);
        self.same_addresses(3, &superseded, &on_gpu.superseded);

        self.account.retract(Purpose::Eye, &false_cover).expect("they are held");
        self.account.add(Purpose::Eye, &capture, &lacking, DepthPrecision::Finest, &now).expect("room");
        self.account.supersede(&superseded).expect("they are held");
        // As after each look of a server; there is always room.
        self.account.settle_facts(usize::MAX).expect("they are read");
    }

    /// The pixels that are sent are the same, and what is known of them.
    fn same_samples(&mut self, whole: &Capture, send: &Mask, found: &Found) {
        let part = &found.capture;
        let origin = whole.camera.centre_px - part.camera.centre_px;
        let (left, top) = (origin.x as u32, origin.y as u32);
        let mut sent = BTreeSet::new();
        for (x, y) in found.lacking.send.occupied() {
            sent.insert((x + left, y + top));
            let at = (y * part.camera.width_px + x) as usize;
            let of_whole = ((y + top) * whole.camera.width_px + x + left) as usize;
            assert_eq!(part.ids[at], whole.ids[of_whole]);
            assert_eq!(part.colour[at], whole.colour[of_whole]);
            assert_eq!(part.rests[at], whole.rests[of_whole]);
            assert_eq!(part.depth[at].to_bits(), whole.depth[of_whole].to_bits());
            let (ends, wanted) = (part.ends[at], whole.ends[of_whole]);
            self.count(4, usize::from(ends == wanted && ends != 0), usize::from(ends != wanted));
        }
        let wanted: BTreeSet<(u32, u32)> = send.occupied().collect();
        self.count(0, wanted.intersection(&sent).count(), wanted.symmetric_difference(&sent).count());
    }

    fn same_addresses(&mut self, kind: usize, wanted: &[Address], found: &[Address]) {
        let (wanted, found): (BTreeSet<_>, BTreeSet<_>) = (wanted.iter().collect(), found.iter().collect());
        self.count(kind, wanted.intersection(&found).count(), wanted.symmetric_difference(&found).count());
    }

    fn count(&mut self, kind: usize, agreed: usize, differed: usize) {
        self.agreed[kind] += agreed;
        self.differed[kind] += differed;
    }

    /// A way of views, each looked from as while moving, and the last one as at rest, twice.
    fn walk(&mut self, views: &[Pinhole], step_s: f64) {
        let passing = AccountRules { outlines_stand_in: true, ..AccountRules::default() };
        for (number, view) in views.iter().enumerate() {
            self.look(view, AccountRules { refines: number % 3 != 2, ..passing });
            self.time_s += step_s;
        }
        for _ in 0..2 {
            self.look(views.last().expect("a view"), AccountRules { outlines_stand_in: false, ..passing });
        }
    }

    /// Gives up all patches but the latest ones.
    fn keep_only_latest(&mut self, count: usize) {
        let patches = &self.account.held().patches;
        let of_patch = |(id, held): (&PatchId, &HeldPatch)| -> Vec<Address> {
            held.patch.image.mask.occupied().map(|(x, y)| (*id, x as u16, y as u16)).collect()
        };
        let count = patches.len().saturating_sub(count);
        let given_up: Vec<Address> = patches.iter().take(count).flat_map(of_patch).collect();
        self.account.supersede(&given_up).expect("they are held");
    }

    /// `least` of each kind were found.
    fn assert_agrees(&self, least: [usize; 5]) {
        for (kind, least) in least.into_iter().enumerate() {
            let (agreed, differed) = (self.agreed[kind], self.differed[kind]);
            assert!(agreed >= least, "kind {kind}: {agreed} are too few to tell: {:?}", self.agreed);
            let most = (agreed as f64 * MOST_SHARE).ceil() as usize;
            assert!(differed <= most, "kind {kind}: {differed} beside {agreed} differ");
        }
    }
}

fn way(start: Rigid, near_m: f64, steps: usize) -> Vec<Pinhole> {
    let forward = start.transform_vector(DVec3::Z);
    let aside = start.transform_vector(DVec3::X);
    let view = |step: usize| {
        let eye = start.translation + forward * (0.35 * step as f64) + aside * (0.1 * (step as f64 * 1.7).sin());
        let towards = forward + aside * (0.06 * step as f64);
        Pinhole::symmetric(Rigid::look_along(eye, towards), (120, 88), 1.1, near_m)
    };
    (0..steps).map(view).collect()
}

#[test]
fn a_walk_among_pillars_finds_the_same_on_both() {
    let scene = scene::builtin::load("pillars").expect("a built-in scene");
    let views = way(start_pose(&scene), near_m(&scene), 8);
    let mut both = Both::new(scene);
    both.walk(&views, 0.0);
    both.assert_agrees([20_000, 50, 1000, 100, 500]);
}

#[test]
fn facts_move_together_once_most_of_their_slots_are_empty() {
    let scene = scene::builtin::load("pillars").expect("a built-in scene");
    let views = way(start_pose(&scene), near_m(&scene), 5);
    let mut both = Both::new(scene);
    let mut most = 0;
    for _ in 0..3 {
        both.walk(&views, 0.0);
        most = most.max(both.account.facts().expect("they are kept").slots());
        both.keep_only_latest(3);
    }
    both.walk(&views, 0.0);
    both.assert_agrees([50_000, 100, 1000, 300, 1000]);
    let slots = both.account.facts().expect("they are kept").slots() as usize;
    assert!(slots * 3 < both.agreed[0] * 2, "{slots} slots, {most} at most, of {} samples", both.agreed[0]);
}

#[test]
fn what_moves_is_found_where_it_is_now() {
    let scene = moving_ball(|time_s| swing(time_s, 4.0));
    let views = way(Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z), 0.1, 6);
    let mut both = Both::new(scene);
    both.walk(&views, 0.2);
    both.assert_agrees([10_000, 10, 1000, 20, 100]);
}

/// A walk and a stop, and what the copy shows wrongly at its end.
fn walked(mut session: Session) -> (usize, f64, Session) {
    let start = session.viewer.world_from_eye;
    let ahead = Rigid { translation: start.translation + start.transform_vector(DVec3::new(0.4, 0.0, 1.6)), ..start };
    session.tick();
    let mut counts = session.walk_to(ahead, 12);
    counts.extend(session.ticks(6));
    let wrong = session.witness().wrong_share(&session.held, ahead);
    (added(&counts), wrong, session)
}

#[test]
fn a_session_is_sent_the_same_by_both() {
    for session in [|| Session::built_in("pillars"), || Session::new(moving_ball(|time_s| swing(time_s, 4.0)))] {
        let (by_processor, wrong, _) = walked(session());
        let (by_gpu, wrong_by_gpu, _) = walked(session().comparing_on_gpu());
        let apart = by_gpu.abs_diff(by_processor) as f64 / by_processor as f64;
        assert!(apart < 0.02, "{by_gpu} samples were sent, {by_processor} by the processor");
        assert!(wrong_by_gpu < wrong + 0.005, "{wrong_by_gpu} is shown wrongly, {wrong} by the processor");
    }
}

#[test]
fn a_full_copy_gives_up_what_was_seen_least_recently_and_goes_on() {
    let mut session = Session::built_in("pillars").comparing_on_gpu();
    let start = session.viewer.world_from_eye;
    // Room for what a plan's views show, and a little more: turning round evicts.
    session.client.budget_bytes = 3 * 64 * 64 * BYTES_PER_SAMPLE;
    session.tick();
    let mut evicted = 0;
    for step in 1..=40 {
        let turned = Rigid { rotation: DQuat::from_rotation_y(f64::from(step) * 0.15) * start.rotation, ..start };
        session.hear(turned, DVec3::ZERO);
        evicted += session.ticks(1).iter().map(|counts| counts.evicted).sum::<usize>();
        // What was just seen is there, and not what gave way.
        assert!(session.held.sample_count() > 0);
    }
    session.ticks(6);
    assert!(evicted > 1000, "{evicted} were given up");
    let last = session.viewer.world_from_eye;
    let wrong = session.witness().wrong_share(&session.held, last);
    assert!(wrong < 0.02, "{wrong} is shown wrongly");
}
