//! What a look sends beside the samples that the eye is shown: reliefs, impostors, what lights see, occluders.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use camera::Pinhole;
use glam::DVec3;
use protocol::message::Shadows;
use protocol::staging::{Excerpt, Parts};
use protocol::{Lighting, Viewpoint};
use scene::Snapshot;

use super::{BYTES_PER_SAMPLE, COARSE_SIDE, Client, LightWork, Stage, StageError, free};
use crate::account::Surroundings;
use crate::bodies;
use crate::discretize::{Discretization, placement};
use crate::impostors::Shot;
use crate::impostors::relief::{self, Eye, Otherwise};
use crate::lights::{self, Serving};
use crate::occluders;
use crate::plan::{Plan, output_focal_px};
use crate::portions::ALL;
use crate::render::{Blended, LeftOut};
use crate::viewer::Viewer;

/// Lights' first sets may take this part of a client's budget together.
const LIGHTS_SHARE: u64 = 4;
/// Occluders may take this part of it.
const OCCLUDERS_SHARE: u64 = 4;
/// The four images of a set together have no more samples than about so many of them: corners see nearly the same.
const IMAGES_A_LIGHT: u64 = 2;

impl Stage {
    /// Sends what is shown beside the eye's samples: layers, impostors, what lights see, occluders. `most` things begin at most; what is left begins at a later look.
    pub(super) fn send_beside(
        &mut self,
        plan: &Plan,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
        most: usize,
    ) -> Result<LightWork, StageError> {
        let eye_world = plan.coverage.world_from_eye.translation;
        let first = client.account.edits();
        // Where not all may begin, nothing does after something else was sent.
        let left = |client: &Client| if most < ALL && client.account.edits() > first { 0 } else { most };
        self.send_layers(plan, snapshot, now, client)?;
        if !client.begins_coarsely {
            self.send_impostors(plan, snapshot, now, client, left(client))?;
        }
        let viewpoint = Viewpoint { eye_world, focal_px: output_focal_px(viewer.view) };
        let lights = self.send_lights(snapshot, now, client, viewpoint, left(client))?;
        if left(client) > 0 {
            self.send_occluders(snapshot, now, client, eye_world)?;
        }
        Ok(lights)
    }

    /// Decides which objects a client is shown by reliefs, before it is looked at what it lacks of all others.
    pub(super) fn send_reliefs(
        &mut self,
        plan: &Plan,
        snapshot: &Snapshot,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<(), StageError> {
        let reliefs = self.reliefs.clone();
        let Some(mut reliefs) = free(&reliefs) else {
            // Another thread judges a shape or draws one: nothing is changed meanwhile.
            return Ok(());
        };
        if reliefs.is_nothing() {
            return Ok(());
        }
        let eye_world = plan.coverage.world_from_eye.translation;
        let focal_px = f64::from(viewer.view.height_px) / 2.0 / (viewer.view.fov_y_rad / 2.0).tan();
        // One coarse image is there sooner than reliefs, and none is cut open.
        let shows = !client.begins_coarsely && client.excerpt.section.is_none();
        let eye = shows.then_some(Eye { eye_world, focal_px });
        let mut objects = client.bodies.objects(&self.bodies);
        objects.extend(self.hidden(client));
        let (bodies, scene, codes) = (&self.bodies, &self.scene, &self.material_codes);
        let triangle_bytes = |object| bodies.rigid_bytes(object, scene, codes);
        let otherwise = Otherwise { objects: &objects, triangle_bytes: &triangle_bytes };
        // Their images are all clients'.
        self.imager.show(&Excerpt::default());
        let held = (&mut client.account, &mut client.reliefs);
        relief::serve(&mut reliefs, (&self.scene, snapshot), (eye, otherwise), now, held, &mut *self.imager)?;
        self.imager.show(&client.excerpt);
        self.judged_shapes.store(reliefs.judged_shapes(), Ordering::Relaxed);
        Ok(())
    }

    /// Decides which objects a client is sent as bodies, before it is looked at what it lacks of all others.
    pub(super) fn send_bodies(
        &mut self,
        plan: &Plan,
        snapshot: &Snapshot,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: &Viewer,
    ) -> Result<bodies::Sent, StageError> {
        // None is cut open.
        if self.bodies.is_nothing() || client.excerpt.section.is_some() {
            return Ok(bodies::Sent::NOTHING);
        }
        let hidden = self.hidden(client).collect();
        let eye = bodies::Eye {
            eye_world: plan.coverage.world_from_eye.translation,
            focal_px: output_focal_px(viewer.view),
            most_px: f64::from(viewer.view.width_px) * f64::from(viewer.view.height_px),
            update_hz: 1.0 / self.rules.update_interval_s,
            share: if client.begins_coarsely { COARSE_SIDE * COARSE_SIDE } else { 1.0 },
            allowance: plan.allowance,
            begins: !plan.reason.is_passing() || viewer.has_clear_path(self.rules.update_interval_s),
        };
        let bodies = self.bodies.clone();
        let held = (&mut client.account, &mut client.bodies);
        let at = (&*self.scene, snapshot);
        let imager = &mut *self.imager;
        let probe = || {
            let views: Vec<Pinhole> =
                plan.views.first().map(|view| placement::probe(view, bodies::PROBE_PX)).into_iter().collect();
            imager.leave_out(LeftOut::default());
            imager.blend(Blended::LeftOut);
            Ok(imager.captures(snapshot, &views, Discretization::Conventional)?.pop())
        };
        bodies::serve(&bodies, at, (&self.material_codes, &hidden), &eye, now, held, probe)
    }

    /// The objects that a client is not shown.
    fn hidden(&self, client: &Client) -> impl Iterator<Item = u16> {
        let objects = if client.excerpt.parts == Parts::All { 0 } else { self.scene.instances.len() };
        (0_u16..).take(objects).filter(|object| !client.excerpt.parts.shows(*object))
    }

    /// Sends the impostors that a client needs and does not hold as they are now, `most` at most.
    fn send_impostors(
        &mut self,
        plan: &Plan,
        snapshot: &Snapshot,
        now: &Surroundings<'_>,
        client: &mut Client,
        most: usize,
    ) -> Result<(), StageError> {
        let eye_world = plan.coverage.world_from_eye.translation;
        let imager = &mut *self.imager;
        let mut draw = |shot: &Shot<'_>| imager.impostor(snapshot, shot);
        self.needs.choose((&self.scene, snapshot), eye_world, &mut client.choices, &mut draw)?;
        let decision = self.needs.decide(&self.scene, snapshot, eye_world, &client.choices);
        if let Some(news) = client.impostors.news(&decision) {
            tracing::info!("impostors: {news}");
        }
        for wanted in client.impostors.lacking(&decision, client.account.held()).into_iter().take(most) {
            let Some(image) = self.imager.impostor(snapshot, &wanted.shot())? else { continue };
            let id = client.account.add_impostor(image, wanted.purpose, now)?;
            if let Some(old) = client.impostors.replace(wanted, id) {
                client.account.remove_whole(old)?;
            }
        }
        for old in client.impostors.drop_unwanted(&decision) {
            client.account.remove_whole(old)?;
        }
        Ok(())
    }

    /// Sends what lights see that a client draws shadows of, as far as it changed; `most_begun` sets begin at most.
    fn send_lights(
        &mut self,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
        viewer: Viewpoint,
        most_begun: usize,
    ) -> Result<LightWork, StageError> {
        let shadows = client.draws.shadows;
        if shadows == Shadows::None || client.begins_coarsely || !self.is_lit {
            return Ok(LightWork::default());
        }
        let (started, first) = (Instant::now(), client.account.edits());
        let serving = Serving {
            scene: &self.scene,
            snapshot,
            now,
            rules: self.account_rules,
            viewer,
            shadows,
            side_px: self.light_size_px(client, now.lighting),
            most_begun,
            account: &mut client.account,
            imager: &mut *self.imager,
        };
        lights::serve(serving, &mut client.lights)?;
        Ok(LightWork { edits: first..client.account.edits(), took: started.elapsed() })
    }

    /// Sends what occludes that the eye never saw, to a client that draws ambient occlusion, as far as it changed.
    fn send_occluders(
        &mut self,
        snapshot: &Arc<Snapshot>,
        now: &Surroundings<'_>,
        client: &mut Client,
        eye_world: DVec3,
    ) -> Result<(), StageError> {
        let reach_m = client.draws.occlusion_reach_m;
        let reaches = reach_m > 0.0 && reach_m.is_finite();
        if !reaches || client.begins_coarsely || !(self.is_lit && now.lighting.is_around()) {
            return Ok(());
        }
        let serving = occluders::Serving {
            scene: &self.scene,
            snapshot,
            now,
            eye_world,
            reach_m,
            side_px: self.rules.image_size_px,
            most_samples: (self.budget_bytes(client) / BYTES_PER_SAMPLE / OCCLUDERS_SHARE) as usize,
            account: &mut client.account,
            imager: &mut *self.imager,
        };
        occluders::serve(serving, &mut client.occluders)
    }

    /// The size of lights' images: that of the eye's, as far as all lights' sets together fit their share of a client's budget.
    fn light_size_px(&self, client: &Client, lighting: &Lighting) -> u32 {
        let lights = lighting.lights.len().clamp(1, Lighting::MAX_CASTING);
        let samples = self.budget_bytes(client) / BYTES_PER_SAMPLE / LIGHTS_SHARE;
        let pixels = samples / (lights as u64 * IMAGES_A_LIGHT);
        pixels.isqrt().min(self.rules.image_size_px.into()) as u32
    }
}
