//! What is made for a client, and what is left out, as a person reads it: see [`Inventory`].

use std::collections::BTreeSet;
use std::sync::Arc;

use protocol::codec::ColourSteps;
use protocol::message::Shadows;
use protocol::{Inventory, Purpose};

use super::{Client, Stage};
use crate::viewer::Viewer;

impl Stage {
    /// Writes down what is made for a client, and logs it where it is made otherwise than at the last look.
    pub(super) fn take_stock(&self, client: &mut Client, viewer: &Viewer) {
        let inventory = self.inventory(client, viewer);
        if !inventory.is_alike(&client.inventory) {
            tracing::info!("for a client is made:\n{inventory}");
        }
        client.inventory = Arc::new(inventory);
    }

    fn inventory(&self, client: &Client, viewer: &Viewer) -> Inventory {
        let mut parts = Inventory::default();
        self.of_images(client, viewer, &mut parts);
        self.of_shapes(client, &mut parts);
        self.of_reflections(client, &mut parts);
        self.of_shadows(client, &mut parts);
        self.of_rest(client, &mut parts);
        parts
    }

    /// Images for the eye, and what is kept of their samples.
    fn of_images(&self, client: &Client, viewer: &Viewer, parts: &mut Inventory) {
        let (images, side_px) = (self.rules.images, self.image_size_px(client));
        let held = client.account.samples_for(Purpose::Eye);
        if held == 0 {
            parts.leaves_out("images", "all that is seen goes as triangles, or nothing is seen");
        } else {
            let made = format!("up to {images} of {side_px} x {side_px}, {held} samples held");
            parts.makes("images", made, "what views around the eye lack");
            let error_px = self.rules.parallax_error_px;
            let why = format!("parallax off by {error_px} px at most where the eye may go");
            parts.makes("depth", format!("{} bits at most of 16", client.account.depth_bits()), why);
        }
        let reflects = !self.needs.is_nothing() || self.imager.sky().is_some();
        match reflects {
            true => parts.makes("fine normals", "16 bits an axis where it reflects", "something reflects"),
            false => parts.leaves_out("fine normals", "nothing reflects: 8 bits an axis shade"),
        }
        match self.coding.coding(viewer.bytes_per_s).colour {
            ColourSteps::Lossless => parts.makes("fine colours", "as drawn", "the path carries them"),
            _ => parts.leaves_out("fine colours", "the path is narrow: colours in steps"),
        }
        let layers = self.imager.layers().len();
        match layers {
            0 => parts.leaves_out("layers", "nothing is blended"),
            _ => parts.makes("layers", layers.to_string(), "of what is seen through, front and back"),
        }
    }

    /// Triangles, and images of many objects.
    fn of_shapes(&self, client: &Client, parts: &mut Inventory) {
        let held = client.account.held();
        let bodies = client.account.shown_as_bodies();
        if self.bodies.is_nothing() {
            parts.leaves_out(
                "bodies",
                "no object is of a material that is the same everywhere but for its colour, or they are off",
            );
        } else if bodies.is_empty() {
            parts.leaves_out("bodies", "samples of what is seen are less than its triangles");
        } else {
            let made = format!("{} objects by {} meshes", bodies.len(), held.bodies.len());
            parts.makes("bodies", made, "triangles are less than samples");
        }
        let reliefs: BTreeSet<u16> = client.account.shown_otherwise().difference(&bodies).copied().collect();
        let nothing = self.reliefs.try_lock().is_ok_and(|reliefs| reliefs.is_nothing());
        match (reliefs.len(), nothing) {
            (0, true) => parts.leaves_out("reliefs", "no shape is that of many objects, or they are off"),
            (0, false) => parts.leaves_out("reliefs", "no image holds nearly all of a shape, or triangles are less"),
            (objects, _) => parts.makes("reliefs", format!("{objects} objects"), "many are of one shape"),
        }
    }

    /// What mirrors and glass show.
    fn of_reflections(&self, client: &Client, parts: &mut Inventory) {
        let (images, reasons) = client.impostors.made();
        let why = if reasons.is_empty() { "no mirror and no glass".to_owned() } else { reasons.join("; ") };
        match images {
            0 => parts.leaves_out("impostors", why),
            _ => parts.makes("impostors", format!("{images} images"), why),
        }
        match self.imager.sky() {
            Some(_) => parts.makes("sky", "one image", "light comes from all around"),
            None => parts.leaves_out("sky", "a plain look has none, and what is unlit needs none"),
        }
    }

    /// What keeps light off.
    fn of_shadows(&self, client: &Client, parts: &mut Inventory) {
        let samples = |is_of: fn(Purpose) -> bool| {
            let held = client.account.held().patches.values().filter(|held| is_of(held.patch.purpose));
            held.map(|held| held.patch.image.sample_count()).sum::<usize>()
        };
        match (client.draws.shadows, client.lights.made()) {
            _ if !self.is_lit => parts.leaves_out("light sets", "nothing is lit"),
            (Shadows::None, _) => parts.leaves_out("light sets", "the client draws no shadows"),
            (_, (0, 0)) => parts.leaves_out("light sets", "there is no light that casts"),
            (_, (0, _)) => parts.leaves_out("light sets", "no light casts anything on anything"),
            (_, (lights, _)) => {
                let count = samples(|purpose| matches!(purpose, Purpose::Light(_)));
                parts.makes("light sets", format!("{lights} lights, {count} samples"), "the client draws shadows");
            }
        }
        match (client.draws.occlusion_reach_m > 0.0, samples(|purpose| purpose == Purpose::Occluders)) {
            _ if !self.is_lit => parts.leaves_out("occluders", "nothing is lit"),
            (false, _) => parts.leaves_out("occluders", "the client draws no ambient occlusion"),
            (true, 0) => parts.leaves_out("occluders", "nothing occludes that the eye has not seen"),
            (true, count) => {
                let why = format!("within {:.2} m of surfaces, and never seen", client.draws.occlusion_reach_m);
                parts.makes("occluders", format!("{count} samples"), why);
            }
        }
    }

    /// What is made where nobody moves.
    fn of_rest(&self, client: &Client, parts: &mut Inventory) {
        let (animated, goes_by_itself) = (self.rules.animated, self.goes_by_itself(client));
        let rules = client.rules(&self.rules);
        match (animated, goes_by_itself) {
            (false, _) => parts.leaves_out("motion", "nothing in the scene moves"),
            (true, _) if !rules.animated => parts.leaves_out("motion", "the scene is paused"),
            (true, true) => parts.leaves_out("motion", "clips move all that moves: nothing is sent for it"),
            (true, false) => parts.makes("motion", "places at each update", "something moves"),
        }
        match (self.rules.rests, rules.animated) {
            (true, false) => parts.makes(
                "view at rest",
                "once the viewer stands still",
                "what is looked at closely is the scene itself",
            ),
            (true, true) => parts.leaves_out("view at rest", "the scene does not rest"),
            (false, _) => parts.leaves_out("view at rest", "it is off"),
        }
        match (self.rules.anticipates, animated) {
            (true, _) => {
                parts.makes("views ahead", "while nobody needs anything", "what comes into view next is there before");
            }
            (false, true) => parts.leaves_out("views ahead", "the scene never rests"),
            (false, false) => parts.leaves_out("views ahead", "they are off"),
        }
    }
}
