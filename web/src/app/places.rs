//! What a person does with places of the picture: goes there, measures between them, chooses the parts that are there.

use camera::{Pinhole, Rigid};
use client::draw::pick::Picked;
use client::receive::viewer::Viewer;
use client::show::controls::Controls;
use client::show::tape::{Mark, Tape};
use glam::DVec2;

use crate::page::Page;
use crate::screen::Screen;

/// A pointer that rests for so long, in seconds, is asked for what is below it: asking takes a small picture.
const RESTS_AFTER_S: f64 = 0.12;

/// What clicks on the picture are for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Tool {
    /// Ends of a tape.
    Tape(Tape),
    /// The part that is there, which is then chosen.
    Parts(Option<u16>),
}

/// What becomes of a place of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Sought {
    /// The eye goes there.
    Visit,
    /// The tool takes it.
    Use,
    /// It is told what is there, beside the pointer.
    Name(DVec2),
}

/// Places are of the page, in CSS pixels.
#[derive(Debug, Default)]
pub(super) struct Places {
    tool: Option<Tool>,
    /// Something is to be done with a place as soon as it can be asked what is there.
    seeks: Option<(DVec2, Sought)>,
    /// What is to be done with what is being asked for.
    sought: Option<Sought>,
    /// Where a pointer came to rest that was not asked about yet, and when.
    pointer: Option<(DVec2, f64)>,
    /// What is below it.
    below: Option<(DVec2, u16)>,
}

impl Places {
    /// The tape, while something is measured.
    pub fn tape(&self) -> Option<&Tape> {
        if let Some(Tool::Tape(tape)) = &self.tool { Some(tape) } else { None }
    }

    /// Whether parts are chosen now, and which one is.
    pub fn chosen(&self) -> Option<Option<u16>> {
        if let Some(Tool::Parts(chosen)) = self.tool { Some(chosen) } else { None }
    }

    /// Whether clicks are for a tool.
    pub fn has_tool(&self) -> bool {
        self.tool.is_some()
    }

    /// Takes a tool, or lays it down where it is the one.
    pub fn toggle(&mut self, tool: Tool) {
        let is_same =
            self.tool.as_ref().is_some_and(|own| std::mem::discriminant(own) == std::mem::discriminant(&tool));
        *self = Places { tool: (!is_same).then_some(tool), ..Places::default() };
    }

    /// What was asked for last will have no answer: what it was asked of is gone.
    pub fn forget_asked(&mut self) {
        self.sought = None;
    }

    /// No pointer is over the picture, or what is below it has gone on.
    pub fn leave(&mut self) {
        (self.pointer, self.below) = (None, None);
    }

    /// The eye is to go to a place.
    pub fn visit(&mut self, at_px: DVec2) {
        self.seeks = Some((at_px, Sought::Visit));
    }

    /// The tool is used at a place.
    pub fn apply(&mut self, at_px: DVec2) {
        if self.tool.is_some() {
            self.seeks = Some((at_px, Sought::Use));
        }
    }

    /// A pointer is at a place.
    pub fn point(&mut self, at_px: DVec2, now_s: f64) {
        self.below = None;
        self.pointer = self.chosen().map(|_| (at_px, now_s));
    }

    /// What is to be asked for now.
    fn next(&self, now_s: f64) -> Option<(DVec2, Sought)> {
        let rests = self.pointer.filter(|(_, at_s)| now_s - at_s >= RESTS_AFTER_S);
        self.seeks.or_else(|| rests.map(|(at_px, _)| (at_px, Sought::Name(at_px))))
    }
}

/// Where a picture is taken from: the drawn eye, its vertical field of view, and the nearest distance that is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Eye {
    pub pose: Rigid,
    pub fov_y_rad: f64,
    pub near_m: f64,
}

impl Places {
    /// Asks what is at a place that something is to be done with, and does that once it is known. Where nothing is, nothing is done.
    pub fn seek(
        &mut self,
        (screen, viewer): (&mut Screen, &Viewer),
        controls: &mut Option<Controls>,
        eye: Eye,
        now_s: f64,
    ) {
        if let Some(found) = screen.picture.picked() {
            match (self.sought.take(), found, controls, &mut self.tool) {
                (Some(Sought::Visit), Some(Picked { at_world, .. }), Some(controls), _) => controls.visit(at_world),
                (Some(Sought::Use), Some(Picked { at_world, .. }), _, Some(Tool::Tape(tape))) => {
                    tape.mark(Mark::of(viewer.held(), at_world));
                }
                (Some(Sought::Use), found, _, Some(Tool::Parts(chosen))) => *chosen = found.map(|found| found.object),
                (Some(Sought::Name(at_px)), Some(Picked { object, .. }), _, Some(Tool::Parts(_))) => {
                    self.below = Some((at_px, object));
                }
                _ => {}
            }
        }
        let Some((at_px, sought)) = self.next(now_s).filter(|_| self.sought.is_none()) else { return };
        if screen.pick(viewer.held(), eye.pose, eye.fov_y_rad, eye.near_m, at_px) {
            match sought {
                Sought::Name(_) => self.pointer = None,
                Sought::Visit | Sought::Use => self.seeks = None,
            }
            self.sought = Some(sought);
        }
    }

    /// Shows the tape where its ends are in the picture, and the name of what is below the pointer.
    pub fn show(&self, page: &Page, viewer: &mut Viewer, seen: Option<(&Screen, Eye)>, now_s: f64) {
        let named = |(at_px, object): (DVec2, u16)| {
            let name = viewer.name_of(object, now_s)?;
            Some((at_px, if name.is_empty() { object.to_string() } else { name }))
        };
        let name = self.below.and_then(named);
        page.show_name(name.as_ref().map(|(at_px, name)| (*at_px, name.as_str())));
        page.show_parts(self.chosen().is_some());
        let (Some(tape), Some((screen, eye))) = (self.tape(), seen) else { return page.show_tape(None) };
        let size_px = (screen.canvas.client_width().max(1) as u32, screen.canvas.client_height().max(1) as u32);
        let camera = Pinhole::symmetric(eye.pose, size_px, eye.fov_y_rad, eye.near_m);
        page.show_tape(Some((&tape.in_picture(&camera), &tape.in_words())));
    }
}
