//! The choice among images that may serve a reflector, by the error of rays against them for the bytes that they cost.
//!
//! Images are tried, not reckoned with: [`Probes`] are rays with known answers, and every candidate's images are drawn and coded. Of one scene and one
//! kind of images the error falls at best with the width of a pixel, so with the square root of the bytes; `error * sqrt(bytes)` compares two
//! sets as if they were of equal bytes. First the six images around the reflector with all in them, then those bent round corners; then images of
//! single objects, which cost more images, and must gain what probes can tell from chance.

use std::sync::Arc;

use camera::{Camera, CorridorMap};
use glam::DVec3;

use super::choice::{Choice, OwnImage};
use super::probes::{Draw, Picture, Probes, Wrong, picture_of};
use super::reflector::Reflector;
use super::wanted::Wanted;

/// Of the figure of merit, at most this part must be left for another image: as far as that a choice may be off the best one, and what serves already costs
/// neither time nor bytes anew.
const WORTH_AN_IMAGE: f64 = 0.95;

/// The best choice for what a viewer sees in a reflector, given what serves it now; `None` where nothing can be drawn, or he sees none of it.
pub(super) fn best<E>(
    reflector: &Reflector<'_>,
    now: Option<&Choice>,
    corridors: Option<Arc<CorridorMap>>,
    eye_world: DVec3,
    draw: &mut Draw<'_, E>,
) -> Result<Option<Choice>, E> {
    let Some(probes) = Probes::new(reflector, eye_world, draw)? else { return Ok(None) };
    let mut trial = Trial { reflector, probes, eye_world, drawn: Vec::new() };
    let mut near = reflector.near_objects(eye_world);
    // Only off an image of its own does a ray go on from another mirror.
    let mirrors = near.iter().filter(|&&object| reflector.is_mirror(object)).map(|&object| (object, OwnImage::Plain));
    let least = Choice { own: mirrors.collect(), ..Choice::default() };
    let Some(mut best) = trial.around(least, corridors, draw)? else { return Ok(None) };
    near.sort_by(|&a, &b| best.wrong.of(b).total_cmp(&best.wrong.of(a)));
    for object in near {
        let limit = WORTH_AN_IMAGE * best.merit();
        best = trial.with_image_of(object, &best, limit, draw)?.unwrap_or(best);
    }
    // What is held already costs nothing more.
    if let Some(now) = now
        && let Some(now) = trial.candidate(now.clone(), draw)?
        && best.merit() >= WORTH_AN_IMAGE * now.merit()
    {
        best = now;
    }
    let found = format!(" (rays against them err by {:.3} for {} kB)", best.wrong.error, best.bytes.div_ceil(1000));
    Ok(Some(Choice { found, ..best.choice }))
}

/// A choice, and what probes say of it.
struct Candidate {
    choice: Choice,
    wrong: Wrong,
    bytes: usize,
}

impl Candidate {
    fn root_bytes(&self) -> f64 {
        (self.bytes as f64).sqrt()
    }

    /// Less is better.
    fn merit(&self) -> f64 {
        self.wrong.error * self.root_bytes()
    }

    /// What it would be with a part of the error less, at no byte more.
    fn merit_less(&self, error: f64) -> f64 {
        (self.wrong.error - error) * self.root_bytes()
    }
}

/// Candidates of one reflector; what several need is drawn once.
struct Trial<'a> {
    reflector: &'a Reflector<'a>,
    probes: Probes,
    eye_world: DVec3,
    drawn: Vec<(Wanted, Arc<Picture>)>,
}

impl Trial<'_> {
    /// The better ones of six images around, straight or bent, beside what there has to be.
    fn around<E>(
        &mut self,
        least: Choice,
        corridors: Option<Arc<CorridorMap>>,
        draw: &mut Draw<'_, E>,
    ) -> Result<Option<Candidate>, E> {
        let bent = Choice { corridors, ..least.clone() };
        let Some(straight) = self.candidate(least, draw)? else { return Ok(None) };
        let images = self.reflector.images(&bent, self.eye_world).0;
        if !images.iter().any(|wanted| matches!(wanted.camera, Camera::Graph(_))) {
            return Ok(Some(straight));
        }
        let bent = self.candidate(bent, draw)?;
        Ok(Some(bent.filter(|bent| bent.merit() < straight.merit()).unwrap_or(straight)))
    }

    /// A candidate and an image of one more object, where that is better than `limit`.
    fn with_image_of<E>(
        &mut self,
        object: u16,
        best: &Candidate,
        limit: f64,
        draw: &mut Draw<'_, E>,
    ) -> Result<Option<Candidate>, E> {
        if best.merit_less(best.wrong.of(object)) >= limit {
            return Ok(None);
        }
        let Some(plain) = self.candidate(best.choice.with(object, OwnImage::Plain), draw)? else { return Ok(None) };
        let finest = self.reflector.finest(object);
        // What is seen past a silhouette costs more bytes, and takes time to draw.
        let past = plain.merit_less(plain.wrong.past_silhouette_of(object));
        let past = if finest != OwnImage::Plain && past < limit.min(WORTH_AN_IMAGE * plain.merit()) {
            self.candidate(best.choice.with(object, finest), draw)?
        } else {
            None
        };
        let better = [Some(plain), past].into_iter().flatten().min_by(|a, b| a.merit().total_cmp(&b.merit()));
        Ok(better.filter(|better| better.merit() < limit))
    }

    fn candidate<E>(&mut self, choice: Choice, draw: &mut Draw<'_, E>) -> Result<Option<Candidate>, E> {
        let inside = protocol::Purpose::Inside(self.reflector.id);
        let mut pictures = Vec::new();
        for wanted in self.reflector.images(&choice, self.eye_world).0 {
            if wanted.purpose == inside {
                continue;
            }
            let is_same = |(drawn, _): &&(Wanted, _)| drawn.camera == wanted.camera && drawn.drawn == wanted.drawn;
            if let Some((_, picture)) = self.drawn.iter().find(is_same) {
                pictures.push(Arc::clone(picture));
                continue;
            }
            let Some(picture) = picture_of(&wanted, draw)? else { return Ok(None) };
            pictures.push(Arc::clone(&picture));
            self.drawn.push((wanted, picture));
        }
        let bytes: usize = pictures.iter().map(|picture| picture.bytes).sum();
        let wrong = self.probes.wrong(&pictures);
        tracing::debug!("{:?}, bent: {}: {:.4} for {bytes} bytes", choice.own, choice.corridors.is_some(), wrong.error);
        Ok(Some(Candidate { wrong, choice, bytes }))
    }
}

impl Choice {
    /// The same with this image for an object.
    fn with(&self, object: u16, image: OwnImage) -> Choice {
        let mut choice = self.clone();
        choice.own.retain(|(other, _)| *other != object);
        choice.own.push((object, image));
        choice
    }
}
