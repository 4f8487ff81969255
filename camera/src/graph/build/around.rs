//! The cube around a place in corridors, as faces whose rays bend where corners hide what a body there can see.

use std::collections::HashMap;

use glam::DVec3;

use super::corridors::{CorridorMap, CorridorMapError, Heading, Mouth, Run};
use crate::convex::{TOLERANCE, area_m2, clip, edges};
use crate::graph::{FaceDescription, FrustumDescription, GraphDescription, RootDescription};
use crate::{Bounds, HalfSpace, Pinhole};

impl CorridorMap {
    /// The camera of a view along a corridor, from the middle of a body, for rays that leave all of the body; `None` where no ray would
    /// bend, and the view itself shows the same. `view` looks along `heading` from a free cell, and the next cell there is free.
    ///
    /// Its first frustum is the view, as far as the run of cells straight ahead reaches. At each mouth in the run's sides or at its end a
    /// frustum begins that is seen from the point of the body which sees deepest round the mouth's nearer edge: where the line through that
    /// edge touches the circle of `radius_m` around the view's eye, level with it. What the eye sees through the mouth, that point sees too,
    /// and what lies between both lines is all that any other point of the circle sees beside; so rays bend by no more than the body needs,
    /// and what is seen straight keeps nearly all of its pixels. Where a mouth's nearer edge hides nothing, rays go straight on. Mouths
    /// that no ray comes to are left out.
    ///
    /// The papers' graph cameras turn all rays into each corridor (*Non-pinhole impostors*, section 5), so that one image holds a maze; see
    /// [`CorridorMap::describe`]. Around a mirror that spends pixels on what no ray of the mirror reaches.
    ///
    /// # Errors
    /// [`CorridorMapError`]; and the description is refused later where `view` does not look along `heading`.
    pub fn describe_around(
        &self,
        view: &Pinhole,
        heading: Heading,
        radius_m: f64,
    ) -> Result<Option<GraphDescription>, CorridorMapError> {
        let eye_world = view.world_from_eye.translation;
        let (column, row) = self.cell_of(eye_world).ok_or(CorridorMapError::Entrance)?;
        let mut runs = self.runs(row * self.columns + column, heading);
        let ball = Body { eye_world, radius_m };
        let mut ways: HashMap<String, Way> = HashMap::new();
        for run in &runs {
            let way = match &run.parent {
                None => Some(Way::of_view(view)),
                Some(parent) => ways.get(parent).and_then(|parent| self.way_into(run, parent, &ball)),
            };
            ways.extend(way.map(|way| (run.name(self), way)));
        }
        runs.retain(|run| ways.contains_key(&run.name(self)));
        if ways.values().all(|way| way.centre_world == eye_world) {
            return Ok(None);
        }
        Ok(Some(self.description(view, runs, &ways)))
    }

    /// How rays of a frustum go on through a run's mouth; `None` where none does.
    fn way_into(&self, run: &Run, parent: &Way, body: &Body) -> Option<Way> {
        let up = DVec3::Y * self.height_m;
        let Mouth { a, b, .. } = run.mouth;
        let whole = vec![a, b, b + up, a + up];
        let least_m2 = TOLERANCE * Bounds::around(whole.iter().copied())?.extent_m().powi(2);
        let whole_m2 = area_m2(&whole).length();
        let face = parent.sides.iter().fold(whole, |face, side| clip(&face, side));
        let face_m2 = area_m2(&face).length();
        if face_m2 <= least_m2 {
            return None;
        }
        // Of a mouth that this view shows in part another one shows the rest: both go straight on, so that they meet.
        let is_whole = whole_m2 - face_m2 <= least_m2;
        let round = if is_whole {
            self.hiding_edge(run, body).and_then(|edge| body.deepest_round(edge, run.heading))
        } else {
            None
        };
        Some(Way::through(round.unwrap_or(parent.centre_world), face))
    }

    /// The nearer edge of a mouth, where a wall begins that the eye sees no face of behind the mouth.
    fn hiding_edge(&self, run: &Run, body: &Body) -> Option<DVec3> {
        let Mouth { a, b, middle } = run.mouth;
        let away_m = |edge: DVec3| (edge - body.eye_world).with_y(0.0).length();
        let edge = if away_m(a) <= away_m(b) { a } else { b };
        let into = run.heading.forward_world();
        let past = (edge - middle).with_y(0.0).normalize_or_zero();
        // A quarter of a cell past the edge, and as far behind the mouth.
        let beside = edge + (past + into) * (self.cell_m / 4.0);
        let is_wall = self.cell_of(beside.with_y(self.origin_world.y)).is_none();
        let is_turned_away = (body.eye_world - edge).dot(past - into * past.dot(into)) > 0.0;
        (is_wall && is_turned_away).then_some(edge)
    }

    fn description(&self, view: &Pinhole, mut runs: Vec<Run>, ways: &HashMap<String, Way>) -> GraphDescription {
        let mouths: Vec<HalfSpace> = runs.iter().skip(1).map(|run| run.mouth.plane(run.heading)).collect();
        runs.iter_mut().for_each(|run| run.cuts.retain(|cut| mouths.contains(cut)));
        let mut runs = runs.iter();
        let root =
            runs.next().map(|run| RootDescription { name: run.name(self), pinhole: *view, limits: self.limits(run) });
        let frustum = |run: &Run| {
            let (name, parent) = (run.name(self), run.parent.clone().unwrap_or_default());
            let way = &ways[&name];
            let faces = vec![FaceDescription { parent, corners: way.face.clone() }];
            FrustumDescription { name, centre: way.centre_world, faces, limits: self.limits(run) }
        };
        let root = root.expect("runs begin with the entrance's");
        GraphDescription { root, frusta: runs.map(frustum).collect(), min_face_px: 0.0 }
    }
}

/// What sends rays: a circle level with the eye.
struct Body {
    eye_world: DVec3,
    radius_m: f64,
}

impl Body {
    /// The point of the circle that sees deepest into `heading` round an upright edge: where a line through the edge touches it, on the
    /// side away from `heading`. `None` where the edge lies inside.
    fn deepest_round(&self, edge_world: DVec3, heading: Heading) -> Option<DVec3> {
        let to_edge = (edge_world - self.eye_world).with_y(0.0);
        let (ahead, away_m) = (to_edge.try_normalize()?, to_edge.length());
        let cosine = self.radius_m / away_m;
        let across = ahead.cross(DVec3::Y);
        let away = -across * across.dot(heading.forward_world()).signum();
        let sine = (1.0 - cosine * cosine).sqrt();
        (cosine < 1.0).then(|| self.eye_world + (ahead * cosine + away * sine) * self.radius_m)
    }
}

/// The rays of a frustum.
struct Way {
    centre_world: DVec3,
    /// What they come in through; empty for the view.
    face: Vec<DVec3>,
    /// The pyramid's sides.
    sides: Vec<HalfSpace>,
}

impl Way {
    fn of_view(view: &Pinhole) -> Way {
        let (width_px, height_px) = (f64::from(view.width_px), f64::from(view.height_px));
        let corners = [(0.0, 0.0), (width_px, 0.0), (width_px, height_px), (0.0, height_px)];
        let corner = |(u, v)| view.world_from_eye.transform_point(view.ray_eye_from_image(u, v));
        let way = Way::through(view.world_from_eye.translation, corners.map(corner).to_vec());
        Way { face: Vec::new(), ..way }
    }

    fn through(centre_world: DVec3, face: Vec<DVec3>) -> Way {
        let inside = face.iter().sum::<DVec3>() / face.len() as f64;
        let side = |(a, b): (DVec3, DVec3)| {
            let side = HalfSpace { point: centre_world, outward: (b - centre_world).cross(a - centre_world) };
            let side = if side.depth_m(inside) < 0.0 { side.opposite() } else { side };
            HalfSpace { outward: side.outward.normalize_or_zero(), ..side }
        };
        Way { centre_world, sides: edges(&face).map(side).collect(), face }
    }
}
