//! One tick of one session: scene at a time -> plan -> views -> edits. The whole of what a server makes, in order.

mod ahead;
mod beside_eye;
mod camera_image;
mod in_portions;
mod inventory;
mod layers;
mod next;
mod shared;
mod views;

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

use camera::Pinhole;
use protocol::held::ObjectPose;
use protocol::message::Shadows;
use protocol::staging::{Excerpt, Parts};
use protocol::{Material, Purpose};
use scene::{Bounds, Instance, Scene, Snapshot};

use crate::account::findings::Lacking;
use crate::account::{Account, AccountRules, BYTES_PER_SAMPLE, Deforming, Surroundings};
use crate::allowance::Allowance;
use crate::bodies::Bodies;
use crate::client::Client;
use crate::coding::CodingRule;
use crate::config::Config;
use crate::density;
use crate::discretize::Discretization;
use crate::discretize::placement::Placement;
use crate::imager::{Imager, ImagerError, Occasion};
use crate::impostors::Needs;
use crate::impostors::relief::{Judged, Reliefs};
use crate::lattice::Lattice;
use crate::look_times::{Part, timed};
use crate::made::Came;
pub use crate::made::{LightWork, Made};
use crate::pace::Load;
use crate::plan::{Coverage, Focus, Plan, Reason, Rules, half_view, plan, precision_within, region_views};
use crate::pool::Pool;
use crate::portions;
use crate::render::{Blended, LeftOut, RenderError, triangle_bases};
use crate::rest::{self, Strip};
use crate::stage_error::StageError;
use crate::viewer::Viewer;

/// A copy has room for this many views' pixels at least: about what a plan's views show together, each a little more than the
/// others (on a nest of twigs 2.8 views of four).
const LEAST_VIEWS_HELD: u64 = 3;
/// Side of the one image that a client gets before its first set, as a share of theirs: of four images it has 1/16 of the pixels.
const COARSE_SIDE: f64 = 0.5;

/// Of the pixels of a set's images about so many are samples of it, where all of them show something: each image leaves out what those before hold.
const OF_A_SET: f64 = 0.4;

/// How the scene is put before a client, as far as all of an update follows from it.
struct Put {
    /// The objects that the client moves by clips.
    by_clip: BTreeSet<u16>,
    /// How fast its scene time goes.
    rate: f64,
    /// Whether the scene is cut open.
    is_open: bool,
}

impl Put {
    fn before(client: &Client) -> Put {
        let (by_clip, rate) = (client.account.moved_by_clips(), client.playback.rate);
        Put { by_clip, rate, is_open: client.excerpt.section.is_some() }
    }
}

/// What makes updates: the scene, and what draws it.
pub struct Stage {
    scene: Arc<Scene>,
    rules: Rules,
    account_rules: AccountRules,
    coding: CodingRule,
    method: Discretization,
    placement: Placement,
    coarse_first: bool,
    /// Whether images shrink where turns are waited for.
    sheds_load: bool,
    imager: Box<dyn Imager>,
    materials: Arc<[Material]>,
    /// Whether light changes how any of them looks.
    is_lit: bool,
    /// By object: the id of its first triangle. Empty where nothing deforms.
    first_triangles: Arc<[u32]>,
    /// Samples a pixel of an output at most, along each axis.
    densest: f64,
    needs: Needs,
    /// Of all stages of a server.
    reliefs: Arc<Mutex<Reliefs>>,
    /// Of all stages of a server.
    bodies: Arc<Bodies>,
    /// By material of the scene, see [`Imager::material_codes`].
    material_codes: Arc<[Option<u8>]>,
    /// How many of their shapes were judged, to be read while another thread judges one.
    judged_shapes: Arc<AtomicUsize>,
    /// Where what is rigid and moves is put.
    lattice: Lattice,
    /// The one snapshot of a scene that never changes.
    still: Option<Arc<Snapshot>>,
    /// Of all stages of a server, where they share what they do.
    pool: Option<Arc<Pool>>,
}

/// What of reliefs is known, where no other thread is about to add to it. Verdicts and images are made one after the other, so what a panic leaves is
/// whole.
fn free(reliefs: &Mutex<Reliefs>) -> Option<MutexGuard<'_, Reliefs>> {
    match reliefs.try_lock() {
        Ok(reliefs) => Some(reliefs),
        Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => None,
    }
}

impl Stage {
    /// A stage for one scene.
    pub fn new(scene: Arc<Scene>, rules: Rules, method: Discretization, imager: Box<dyn Imager>) -> Stage {
        let materials = imager.materials();
        let still = (!scene.is_animated()).then(|| Arc::new(scene.at(0.0)));
        let deforms = scene.instances.iter().any(|instance| instance.deforms);
        let densest = if deforms { density::DENSEST_DEFORMING } else { density::DENSEST };
        let (account_rules, coding) = (AccountRules::default(), CodingRule::default());
        let lattice = Lattice::new(&scene, rules.near_m);
        Stage {
            first_triangles: if deforms { triangle_bases(&scene).into() } else { Arc::default() },
            needs: if imager.sky().is_some() { Needs::under_sky(&scene) } else { Needs::new(&scene) },
            reliefs: Arc::default(),
            bodies: Arc::default(),
            material_codes: imager.material_codes().into(),
            judged_shapes: Arc::default(),
            scene,
            rules,
            account_rules,
            coding,
            method,
            placement: Placement::default(),
            coarse_first: false,
            sheds_load: false,
            imager,
            is_lit: materials.iter().any(|material| !material.unlit),
            materials: materials.into(),
            densest,
            lattice,
            still,
            pool: None,
        }
    }

    /// Another one of the same scene, for another thread; `None` where its imager is the only one there can be.
    pub fn twin(&self) -> Option<Stage> {
        Some(self.with(self.imager.twin()?))
    }

    /// Another one in place of this one, which failed; `None` where its imager is the only one there can be.
    pub fn anew(&self) -> Result<Option<Stage>, ImagerError> {
        Ok(self.imager.anew()?.map(|imager| self.with(imager)))
    }

    /// Whether the device that it draws on is lost.
    pub fn is_lost(&self) -> bool {
        self.imager.is_lost()
    }

    /// Readies a client for this stage: what was drawn of it on a device that is lost is gone, and it begins anew.
    pub fn takes(&self, client: &mut Client) {
        if std::mem::replace(&mut client.device, self.imager.device()) != self.imager.device() {
            client.account.leave_device();
            client.start_anew();
        }
    }

    /// The same with another imager of its scene.
    fn with(&self, imager: Box<dyn Imager>) -> Stage {
        Stage {
            scene: self.scene.clone(),
            rules: self.rules,
            account_rules: self.account_rules,
            coding: self.coding,
            method: self.method,
            placement: self.placement,
            coarse_first: self.coarse_first,
            sheds_load: self.sheds_load,
            imager,
            materials: self.materials.clone(),
            is_lit: self.is_lit,
            first_triangles: self.first_triangles.clone(),
            densest: self.densest,
            needs: self.needs.clone(),
            reliefs: self.reliefs.clone(),
            bodies: self.bodies.clone(),
            material_codes: self.material_codes.clone(),
            judged_shapes: self.judged_shapes.clone(),
            lattice: self.lattice.clone(),
            still: self.still.clone(),
            pool: self.pool.clone(),
        }
    }

    /// Whether views are compared on a GPU that is not only software.
    pub fn compares_on_hardware(&mut self) -> bool {
        self.imager.comparer().is_some_and(|comparer| !comparer.gpu().caps.software)
    }

    /// The same, which decides what is sent by other numbers.
    pub fn judged_by(self, account_rules: AccountRules) -> Stage {
        Stage { account_rules, ..self }
    }

    /// The same, whose sets by themselves are of views placed in a way.
    pub fn placed(self, placement: Placement) -> Stage {
        Stage { placement, ..self }
    }

    /// The same, whose clients get one coarse image before their first set.
    pub fn coarse_first(self, coarse_first: bool) -> Stage {
        Stage { coarse_first, ..self }
    }

    /// The same, whose images are the smaller, the longer its clients wait for their turns.
    pub fn shed_load(self, sheds_load: bool) -> Stage {
        Stage { sheds_load, ..self }
    }

    /// Says how long a client waited for its turn.
    pub fn waited(&self, client: &mut Client, wait_s: f64) {
        client.pace.waited(wait_s, self.rules.update_interval_s);
    }

    /// The same, which shows many objects of a shape by one image. Not where views are made by rays, which meet everything.
    pub fn with_reliefs(self, judged: Judged) -> Stage {
        let reliefs = if self.method.needs_rays() { Reliefs::default() } else { Reliefs::new(&self.scene) };
        Stage { reliefs: Arc::new(Mutex::new(reliefs.judged(judged))), ..self }
    }

    /// The same, which sends what is less as its triangles than as samples as it is, see [`crate::bodies`]. Not where views are made by rays, which meet everything.
    pub fn with_bodies(self) -> Stage {
        let bodies =
            if self.method.needs_rays() { Bodies::default() } else { Bodies::new(&self.scene, &self.material_codes) };
        Stage { bodies: Arc::new(bodies), ..self }
    }

    /// The same, whose samples are coded by a rule.
    pub fn coded_by(self, coding: CodingRule) -> Stage {
        Stage { coding, ..self }
    }

    /// Does a piece of work that looks asked for and need not wait for; whether there was any.
    pub fn work_aside(&mut self) -> Result<bool, StageError> {
        let reliefs = self.reliefs.clone();
        let Some(mut reliefs) = free(&reliefs).filter(|reliefs| reliefs.is_asked()) else { return Ok(false) };
        // Shapes are rigid: they look the same at any time.
        let snapshot = self.snapshot(0.0);
        self.imager.draw_for(Occasion::Passing);
        self.imager.leave_out(LeftOut::default());
        self.imager.show(&Excerpt::default());
        let has_worked = reliefs.judge_next((&self.scene, &snapshot), &mut *self.imager)?;
        self.judged_shapes.store(reliefs.judged_shapes(), Ordering::Relaxed);
        Ok(has_worked)
    }

    /// Makes what a client lacks at a time, or nothing where it lacks nothing.
    pub fn update(&mut self, viewer: &Viewer, client: &mut Client, now_s: f64) -> Result<Option<Made>, StageError> {
        client.looked_at_s = now_s;
        self.imager.show(&client.excerpt);
        let made = match client.asked {
            Some(_) => self.camera_image(viewer, client, now_s),
            None => self.view(viewer, client, now_s),
        }?;
        if made.is_some() {
            client.made_at_s = now_s;
        }
        client.is_elsewhen = false;
        Ok(made)
    }

    /// Of what the client sees from where it is, what it lacks.
    fn view(&mut self, viewer: &Viewer, client: &mut Client, now_s: f64) -> Result<Option<Made>, StageError> {
        // Who stands still sees his own view before anything that he does not see.
        let strip = rest::lacking(&client.rules(&self.rules), client, viewer, now_s);
        client.begins_coarsely = self.begins_coarsely(client, viewer, now_s);
        let plan = if strip.is_none() { self.plan(viewer, client, now_s) } else { None };
        if strip.is_none() && plan.is_none() {
            return Ok(None);
        }
        let time_s = self.scene_time_s(viewer, client, now_s);
        let made = self.with_surroundings(time_s, Put::before(client), |stage, snapshot, now| match (strip, plan) {
            (Some(strip), _) => stage.rest(&strip, snapshot, now, client, viewer),
            (None, Some(plan)) => stage.look_once(&plan, snapshot, now, client, viewer),
            (None, None) => Ok(None),
        })?;
        client.picture_sent_at_s.get_or_insert(now_s);
        Ok(made)
    }

    /// What the codes of materials mean. Of a scene that is cut open insides are seen: all has two sides there, as both of one surface may be seen from places near by.
    fn materials_of(&self, is_open: bool) -> Arc<[Material]> {
        if !is_open {
            return self.materials.clone();
        }
        self.materials.iter().map(|material| Material { double_sided: true, ..*material }).collect()
    }

    /// Makes an update by what the scene is at a time, and tells where objects go from there but for those that the client moves `by_clip`.
    fn with_surroundings(
        &mut self,
        scene_time_s: f64,
        Put { by_clip, rate, is_open }: Put,
        make: impl FnOnce(&mut Stage, &Arc<Snapshot>, &Surroundings<'_>) -> Result<Option<Made>, StageError>,
    ) -> Result<Option<Made>, StageError> {
        let snapshot = self.snapshot(scene_time_s);
        let lighting = self.imager.lighting(&snapshot);
        let sky = self.imager.sky();
        let moving = self.moving_objects(&snapshot);
        let materials = self.materials_of(is_open);
        let (scene, first_triangles) = (self.scene.clone(), self.first_triangles.clone());
        let deforming = Deforming::new(&scene, &snapshot, &first_triangles);
        let now = Surroundings {
            time_s: scene_time_s,
            colour: self.coding.colour,
            materials: &materials,
            lighting: &lighting,
            sky: sky.as_ref(),
            moving: &moving,
            deforming: &deforming,
        };
        let made = make(self, &snapshot, &now);
        let mut made = made?;
        if let Some(made) = &mut made
            && made.reason != Reason::Camera
        {
            made.update.next = self.next_steps(&made.update, rate, &moving, &by_clip);
        }
        Ok(made)
    }

    /// Where to look, with images as large as the client's memory and its path are.
    fn plan(&self, viewer: &Viewer, client: &Client, now_s: f64) -> Option<Plan> {
        let allowance = self.allowance(viewer);
        let allowed = |plan: Plan| Plan { allowance, ..plan };
        let focus = client.focus.as_ref();
        if client.begins_coarsely {
            return self.planned(viewer, client, now_s, focus, (1, COARSE_SIDE)).map(allowed);
        }
        let mut whole = self.planned(viewer, client, now_s, focus, (self.rules.images, 1.0)).map(allowed)?;
        let goes_on = self.goes_on_from_coarse(&whole, client);
        let focus = goes_on.as_ref().or(focus);
        if goes_on.is_some() {
            whole = self.planned(viewer, client, now_s, focus, (self.rules.images, 1.0)).map(allowed)?;
        }
        let by_path = client.pace.side_share(whole.pixels(), viewer, self.rules.update_interval_s, allowance);
        let load = self.load(client);
        let share = by_path.min(load.side_share);
        // A first set may as well be for many who come at once, unless they all come to where somebody stood.
        let is_dear = || load.is_heavy() && !self.is_done(&whole, client, viewer);
        let shrinks = whole.reason.is_passing() || whole.reason == Reason::First && is_dear();
        if shrinks && share < 1.0 {
            let coarse = self.planned(viewer, client, now_s, focus, (load.images(self.rules.images), share))?;
            // A path that carries less is used at every tick.
            let coverage = Coverage { way: None, ..coarse.coverage };
            Some(Plan { is_coarse: true, coverage, ..allowed(coarse) })
        } else {
            Some(whole)
        }
    }

    /// The same in so many images, whose sides are a share of the largest.
    fn planned(
        &self,
        viewer: &Viewer,
        client: &Client,
        now_s: f64,
        last: Option<&Focus>,
        (images, share): (usize, f64),
    ) -> Option<Plan> {
        let image_size_px = (f64::from(self.image_size_px(client)) * share).round() as u32;
        let rules = client.rules(&self.rules);
        let animated = rules.animated && (client.is_elsewhen || !self.goes_by_itself(client));
        plan(&Rules { images, image_size_px, animated, ..rules }, viewer, now_s, last)
    }

    /// What an update may bring. On the virtual clock a trace begins with the first set, however long that takes.
    fn allowance(&self, viewer: &Viewer) -> Allowance {
        let is_cut = self.coarse_first && self.method != Discretization::Conventional;
        if is_cut { Allowance::of(viewer) } else { Allowance::ALL }
    }

    /// Where a path carries less than a first set at once, a coarse picture is gone on from.
    fn goes_on_from_coarse(&self, whole: &Plan, client: &Client) -> Option<Focus> {
        let (samples, pixels) = (client.account.samples_for(Purpose::Eye) as f64, whole.pixels() as f64);
        let coarse_px = pixels / whole.views.len().max(1) as f64 * COARSE_SIDE * COARSE_SIDE;
        let set_bytes = samples / coarse_px * pixels * OF_A_SET * portions::BYTES_PER_SAMPLE;
        let is_cut =
            whole.reason == Reason::First && client.picture_sent_at_s.is_some() && set_bytes > whole.allowance.bytes();
        is_cut.then_some(Focus { coverage: whole.coverage, settled: false, passing: false, looks: 1 })
    }

    /// Whether of all that a client is shown only bodies change with time, which it moves by itself.
    fn goes_by_itself(&self, client: &Client) -> bool {
        let shown = client.account.shown_bent();
        let stands = |instance: &Instance| !instance.moves && !instance.deforms;
        let is_shown = |(instance, object): (&Instance, u16)| {
            stands(instance) || shown.contains(&object) || !client.excerpt.parts.shows(object)
        };
        // Mirrors and soft shadows are of images, in which bodies stand as they stood.
        let by_images = !self.needs.is_nothing() || client.draws.shadows == Shadows::Soft;
        let is_all = || self.scene.instances.iter().zip(0_u16..).all(is_shown);
        !shown.is_empty() && !by_images && !self.scene.lights_move && is_all()
    }

    /// Under load a first set is as quick as a coarse image before it would be, unless another client got that.
    fn begins_coarsely(&self, client: &mut Client, viewer: &Viewer, now_s: f64) -> bool {
        let has_nothing = client.focus.is_none() && client.picture_sent_at_s.is_none();
        client.begins_coarsely = self.coarse_first && has_nothing;
        let is_done = |client: &Client| {
            self.plan(viewer, client, now_s).is_some_and(|coarse| self.is_done(&coarse, client, viewer))
        };
        client.begins_coarsely && (!self.load(client).is_heavy() || is_done(client))
    }

    /// What waiting says that there is time for.
    fn load(&self, client: &Client) -> Load {
        if self.sheds_load { client.pace.load() } else { Load::NONE }
    }

    fn look(
        &mut self,
        plan: &Plan,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<Option<Made>, StageError> {
        let mut pixels = plan.pixels();
        let denser = self.denser(snapshot, client, viewer);
        let plan = &Plan { views: plan.views.iter().map(denser).collect(), ..plan.clone() };
        self.imager.draw_for(if Stage::stands(plan, viewer) { Occasion::Standing } else { Occasion::Passing });
        client.account.draw_with(Purpose::Eye, || self.imager.new_surfaces());
        client.account.begin(now)?;
        self.drop_rest(client, viewer)?;
        // Nothing is held that would stand for anything: a set of images by itself (2016 paper, Alg. 1 and 3).
        let anew = self.method == Discretization::Conventional || plan.reason == Reason::First;
        if anew {
            client.account.forget()?;
        }
        let bodies = self.send_bodies(plan, snapshot, now, client, viewer)?;
        self.send_reliefs(plan, snapshot, now, client, viewer)?;
        self.imager.leave_out(client.account.left_out());
        self.imager.blend(Blended::LeftOut);
        let is_passing = plan.reason.is_passing();
        let in_portions = !plan.allowance.is_all() && !anew && !is_passing;
        let came = if in_portions && bodies.bytes > plan.allowance.bytes() / 2.0 {
            Came::default()
        } else if in_portions {
            self.look_in_portions(plan, snapshot, now, client, viewer)?
        } else {
            let mut is_whole = true;
            if !self.may_lack(plan, snapshot, client) {
                pixels = 0;
            } else if is_passing && !anew && !plan.allowance.is_all() {
                is_whole = self.look_in_passing(plan, snapshot, now, client)?;
            } else {
                self.look_at_all(plan, snapshot, now, anew, client)?;
            }
            // What is shown beside comes while nothing waits for it, one after the other.
            let most = match () {
                () if client.begins_coarsely || plan.allowance.is_all() => portions::ALL,
                () if is_passing && viewer.has_clear_path(self.rules.update_interval_s) => 1,
                () => 0,
            };
            let lights = self.send_beside(plan, snapshot, now, client, viewer, most)?;
            Came { lights, has_ended: is_whole && most == portions::ALL }
        };
        let budget_samples = (self.budget_bytes(client) / BYTES_PER_SAMPLE) as usize;
        client.account.settle_facts(budget_samples).map_err(|error| ImagerError::from(RenderError::from(error)))?;
        client.account.evict(budget_samples)?;
        let counts = client.account.counts();
        if counts.evicted > 0 {
            client.ahead.evicted();
        }
        let looks = client.focus.map_or(0, |focus| focus.looks) + 1;
        // A full copy is as complete as it gets: what a still viewer's look evicts would be sent again at the next.
        let is_full = plan.reason == Reason::Settling && counts.evicted > 0;
        // A coarse look that finds nothing says nothing of what whole images would find.
        let found_nothing = counts.is_still() && !plan.is_coarse && came.has_ended && bodies.are_all;
        let settled = found_nothing || is_full || self.method == Discretization::Conventional;
        // After a coarse picture the first set is still to come.
        let focus = Focus { coverage: plan.coverage, settled, passing: is_passing, looks };
        client.focus = (!client.begins_coarsely).then_some(focus);
        self.take_stock(client, viewer);
        let update = client.account.seal(now.time_s, viewer.pose_seq, self.rules.animated)?;
        let coding = self.coding.coding(viewer.bytes_per_s);
        Ok(update.map(|update| Made {
            reason: plan.reason,
            update,
            coding,
            counts,
            pixels,
            lights: came.lights,
            coded: Arc::default(),
        }))
    }

    /// Brings what the eye is shown up to date by all of a plan's views; `anew`: by images that stand for themselves.
    fn look_at_all(
        &mut self,
        plan: &Plan,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        anew: bool,
        client: &mut Client,
    ) -> Result<(), StageError> {
        let account = &mut client.account;
        if !anew {
            return self.look_from_all(plan, snapshot, now, account);
        }
        let views = self.set_views(plan, snapshot)?;
        for mut capture in timed(Part::Scene, || self.imager.captures(snapshot, &views, self.method))? {
            account.counts_mut().look_at(Purpose::Eye, &capture);
            let lacking = Lacking::all(&capture);
            timed(Part::Scene, || self.imager.tell_ends(&mut capture, &lacking.send))?;
            timed(Part::Keep, || account.add(Purpose::Eye, &capture, &lacking, plan.precision, now))?;
        }
        Ok(())
    }

    /// Sends rows of a view at rest.
    fn rest(
        &mut self,
        strip: &Strip,
        snapshot: &Snapshot,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<Option<Made>, StageError> {
        client.account.begin_rest(now)?;
        self.drop_rest(client, viewer)?;
        let precision = precision_within(&self.rules, viewer.view, 0.0);
        let fine = rest::parts::fine(&strip.camera);
        let in_parts = client.draws.antialiased && fine.width_px <= self.imager.largest_side_px();
        self.imager.draw_for(Occasion::Standing);
        let images = self.imager.view_at_rest(snapshot, &strip.camera, in_parts, precision)?;
        let patches = images.into_iter().map(|image| client.account.add_rest(image, now));
        client.rest.sent(strip, &patches.collect::<Result<Vec<_>, _>>()?);
        let counts = client.account.counts();
        let update = client.account.seal(now.time_s, viewer.pose_seq, self.rules.animated)?;
        let coding = self.coding.coding(viewer.bytes_per_s);
        let pixels = u64::from(strip.camera.width_px) * u64::from(strip.camera.height_px);
        let lights = LightWork::default();
        Ok(update.map(|update| Made {
            reason: Reason::Rest,
            update,
            coding,
            counts,
            pixels,
            lights,
            coded: Arc::default(),
        }))
    }

    /// Takes back what was sent of a view at rest that the viewer has left.
    fn drop_rest(&self, client: &mut Client, viewer: &Viewer) -> Result<(), StageError> {
        let rules = client.rules(&self.rules);
        for patch in rest::outdated(&rules, client, viewer, client.looked_at_s) {
            client.account.remove_whole(patch)?;
        }
        Ok(())
    }

    /// What a client's copy may cost it: never less than all of a plan's views of the least size, and one more.
    fn budget_bytes(&self, client: &Client) -> u64 {
        let least_px = u64::from(*Config::IMAGE_SIZES_PX.start()).pow(2);
        client.budget_bytes.max((self.rules.images as u64 + 1) * least_px * BYTES_PER_SAMPLE)
    }

    /// The size of images for a client's budget.
    fn image_size_px(&self, client: &Client) -> u32 {
        let pixels = self.budget_bytes(client) / BYTES_PER_SAMPLE / LEAST_VIEWS_HELD;
        pixels.isqrt().min(self.rules.image_size_px.into()) as u32
    }

    fn snapshot(&self, time_s: f64) -> Arc<Snapshot> {
        self.still.clone().unwrap_or_else(|| {
            let mut snapshot = self.scene.at(time_s);
            self.lattice.settle(&mut snapshot.world_from_mesh);
            Arc::new(snapshot)
        })
    }

    /// The scene's time at the end of the time for which what is made now is shown: it is on its way, and then shown until the next one is there, in which clients take rigid objects
    /// from where the last update left them to where this one does. What deforms they cannot take so; where something does, it is the middle of that time. What moves by a clip is so
    /// seen where it is, not where it was. Where one gets there sooner than the one before, no time is taken back; a clock that was set back does that.
    fn scene_time_s(&self, viewer: &Viewer, client: &Client, now_s: f64) -> f64 {
        if self.still.is_some() {
            return now_s;
        }
        let is_set_back = now_s < client.made_at_s || client.is_elsewhen;
        let shown_for_s = viewer.taken_s.max(self.rules.update_interval_s);
        let deforms = !self.first_triangles.is_empty();
        let ahead_s = viewer.one_way_s + shown_for_s * if deforms { 0.5 } else { 1.0 };
        let held_s = client.account.held().scene_time_s;
        let there_s = client.playback.scene_time_s(now_s + ahead_s);
        if is_set_back { there_s } else { there_s.max(held_s) }
    }

    /// Makes views of a snapshot spend their pixels where something is.
    fn denser(&self, snapshot: &Snapshot, client: &Client, viewer: &Viewer) -> impl Fn(&Pinhole) -> Pinhole + use<> {
        let Bounds { min, max } = self.scene.bounds;
        let at_rest = || (!self.scene.bounds.is_empty()).then_some(camera::Bounds { min, max });
        let parts = &client.excerpt.parts;
        let is_all_at_rest = self.still.is_some() && *parts == Parts::All;
        let extent = if is_all_at_rest { at_rest() } else { density::extent(&self.scene, snapshot, parts) };
        let (output, densest) = (viewer.view, self.densest);
        move |view| extent.map_or(*view, |extent| density::around(view, &extent, output, densest))
    }

    fn moving_objects(&self, snapshot: &Snapshot) -> Vec<ObjectPose> {
        let instances = self.scene.instances.iter().zip(&snapshot.world_from_mesh).zip(0_u16..);
        instances
            .filter(|((instance, _), _)| instance.moves && !instance.deforms)
            .map(|((_, &world_from_object), object)| ObjectPose { object, world_from_object })
            .collect()
    }
}
