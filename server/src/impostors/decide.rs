use camera::Bounds;
use glam::DVec3;
use protocol::{DepthImage, Effect};
use scene::{Scene, Snapshot};

use super::choice::Rule;
use super::choices::Choices;
use super::choose;
use super::group::{Ball, Group, Shows, groups};
use super::plans::Plans;
use super::reflector::{Reflector, shown_by_mesh, shows};
use super::wanted::{Decision, Shot};

/// Reflectors that are smaller than this, seen from the viewer, show nothing that could be told: 0.01 rad is four pixels in a view of
/// 640 that is 90 degrees wide.
const LEAST_REFLECTOR_RAD: f64 = 0.01;
/// Groups of reflectors that are served, those with the largest one seen from the viewer.
const MAX_REFLECTORS: usize = 4;

/// What of a scene decides about impostors: worked out once.
#[derive(Debug, Clone)]
pub struct Needs {
    reflectors: Vec<(u16, Shows)>,
    /// By material.
    all_show: Vec<Option<Shows>>,
    plans: Plans,
    rule: Rule,
}

impl Needs {
    /// Of a scene: the objects whose materials are mirrors or glass, and its corridors where it knows them.
    pub fn new(scene: &Scene) -> Needs {
        Needs::of(scene, false)
    }

    /// The same under a sky, where metals that are rough count as mirrors as well ([`protocol::Material::is_rough_mirror`]).
    pub fn under_sky(scene: &Scene) -> Needs {
        Needs::of(scene, true)
    }

    fn of(scene: &Scene, under_sky: bool) -> Needs {
        let all_show = shows(scene, under_sky);
        let reflectors = scene.instances.iter().zip(0_u16..);
        let shown =
            |(instance, id): (&scene::Instance, u16)| Some((id, shown_by_mesh(scene, &all_show, instance.mesh)?));
        Needs {
            reflectors: reflectors.filter_map(shown).collect(),
            all_show,
            plans: Plans::of(scene),
            rule: Rule::default(),
        }
    }

    /// The same with another rule for what is served before anything was tried, or where nothing can be.
    pub fn with_rule(self, rule: Rule) -> Needs {
        Needs { rule, ..self }
    }

    /// Whether the scene has no reflector at all.
    pub fn is_nothing(&self) -> bool {
        self.reflectors.is_empty()
    }

    /// Whether any object shows others in this way.
    pub fn has(&self, effect: Effect) -> bool {
        self.reflectors.iter().any(|(_, shows)| match shows {
            Shows::Mirror | Shows::RoughMirror => effect == Effect::Mirror,
            Shows::Glass => effect == Effect::Glass,
        })
    }

    /// What a viewer at `eye_world` needs of the scene at a time, by what was chosen, or by rule where nothing was.
    pub fn decide(&self, scene: &Scene, snapshot: &Snapshot, eye_world: DVec3, choices: &Choices) -> Decision {
        if self.is_nothing() {
            return Decision { wanted: Vec::new(), reasons: vec!["no mirror and no glass: no impostors".to_owned()] };
        }
        let bounds = bounds(scene, snapshot);
        let (served, dropped) = self.served((scene, snapshot), &bounds, eye_world);
        let mut decision = Decision::default();
        for reflector in served {
            let by_rule = || reflector.by_rule(self.rule, eye_world, || self.plans.around(&reflector));
            let choice = choices.of(&reflector).cloned().unwrap_or_else(by_rule);
            let (wanted, parts) = reflector.images(&choice, eye_world);
            let effect = match reflector.shows {
                Shows::Mirror => "a mirror",
                Shows::RoughMirror => "a rough mirror",
                Shows::Glass => "glass",
            };
            let name = &scene.instances[usize::from(reflector.id)].name;
            let with = match reflector.members.len() {
                1 => String::new(),
                count => format!(" with {} near it", count - 1),
            };
            decision.reasons.push(format!("{name:?}{with} is {effect}: {}{}", parts.join(", "), choice.found));
            decision.wanted.extend(wanted);
        }
        if dropped > 0 {
            decision.reasons.push(format!("{dropped} smaller groups of reflectors get none"));
        }
        if decision.reasons.is_empty() {
            decision.reasons.push("no mirror or glass in reach: no impostors".to_owned());
        }
        decision
    }

    /// Chooses images for reflectors for which nothing was chosen yet, and anew for one at a time where a choice does not hold any more, by
    /// what `draw` shows of them.
    ///
    /// # Errors
    /// What `draw` fails with.
    pub fn choose<E>(
        &self,
        (scene, snapshot): (&Scene, &Snapshot),
        eye_world: DVec3,
        choices: &mut Choices,
        draw: &mut dyn FnMut(&Shot<'_>) -> Result<Option<DepthImage>, E>,
    ) -> Result<(), E> {
        if self.is_nothing() {
            return Ok(());
        }
        let bounds = bounds(scene, snapshot);
        for reflector in self.served((scene, snapshot), &bounds, eye_world).0 {
            let now = choices.of(&reflector);
            // What a flat mirror shows is all seen from one place, and a blur looks the same by any images: there is nothing to choose.
            if reflector.plane().is_some() || reflector.is_rough() || choices.holds(&reflector, eye_world) {
                continue;
            }
            let is_anew = now.is_some();
            let corridors = self.plans.around(&reflector);
            let best = choose::best(&reflector, now, corridors.clone(), eye_world, draw)?;
            // What could not be tried now need not be tried again at every look.
            let choice = best.unwrap_or_else(|| reflector.by_rule(self.rule, eye_world, || corridors));
            choices.insert(&reflector, eye_world, choice);
            if is_anew {
                break;
            }
        }
        Ok(())
    }

    /// The reflectors that are served, those that share images as one, the one that seems largest first, and how many are not.
    fn served<'a>(
        &'a self,
        (scene, snapshot): (&'a Scene, &'a Snapshot),
        bounds: &'a [Option<Bounds>],
        eye_world: DVec3,
    ) -> (Vec<Reflector<'a>>, usize) {
        let size_rad = |ball: &Ball| ball.radius_m / (ball.centre - eye_world).length().max(ball.radius_m);
        let balls = self.reflectors.iter().filter_map(|&(id, shows)| {
            let ball = Ball::around(bounds[usize::from(id)].as_ref()?);
            (size_rad(&ball) >= LEAST_REFLECTOR_RAD).then_some((id, shows, ball))
        });
        let reflector = |Group { lead, shows, ball, members }: Group| Reflector {
            id: lead,
            shows,
            ball,
            members,
            all_show: &self.all_show,
            scene,
            snapshot,
            bounds,
        };
        let mut served: Vec<Reflector<'a>> = groups(balls.collect()).into_iter().map(reflector).collect();
        served.sort_by(|a, b| size_rad(&b.ball).total_cmp(&size_rad(&a.ball)));
        let dropped = served.len().saturating_sub(MAX_REFLECTORS);
        served.truncate(MAX_REFLECTORS);
        (served, dropped)
    }
}

/// The boxes of all objects.
fn bounds(scene: &Scene, snapshot: &Snapshot) -> Vec<Option<Bounds>> {
    scene.instances.iter().zip(0_u16..).map(|(_, id)| scene.bounds_of(snapshot, id)).collect()
}
