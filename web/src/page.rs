//! The page's elements around the canvas: figures, progress, status.

use client::draw::effects::Drawn;
use client::draw::shadow::SoftProgress;
use client::draw::steady::Resolution;
use client::receive::history::{Figure, History};
use client::receive::stats::Stats;
use client::receive::viewer::Progress;
use client::show::controls::Mode;
use client::show::panel::short_count;
use glam::DVec2;
use protocol::Inventory;
use protocol::message::Role;
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::*;
use web_sys::{Document, Element, HtmlCanvasElement, HtmlElement};

#[wasm_bindgen]
extern "C" {
    /// Words in the page's language: `say` of `words.js`.
    #[wasm_bindgen(js_namespace = window, js_name = vantageSays)]
    fn says(words: &str) -> String;
}

/// Bytes of a kibibyte, for the progress line.
const KIB: usize = 1024;

/// The page's document.
pub fn document() -> Document {
    web_sys::window().and_then(|window| window.document()).expect("the viewer runs in a page")
}

/// An element that the page must have.
pub fn element(id: &str) -> Result<HtmlElement, String> {
    let found = document().get_element_by_id(id).and_then(|element| element.dyn_into().ok());
    found.ok_or_else(|| format!("the page has no element #{id}"))
}

/// The one shape of a drawing that the page must have.
fn drawing(id: &str) -> Result<Element, String> {
    let found = document().get_element_by_id(id).and_then(|drawing| drawing.first_element_child());
    found.ok_or_else(|| format!("the page has no drawing #{id}"))
}

/// The canvas.
pub fn canvas() -> Result<HtmlCanvasElement, String> {
    element("view")?.dyn_into().map_err(|_| "#view is no canvas".to_owned())
}

/// A canvas remembers the first graphics interface that used it; this puts a fresh one in its place.
pub fn fresh_canvas() -> Result<HtmlCanvasElement, String> {
    let old = canvas()?;
    let fresh = old.clone_node().map_err(|_| "the canvas cannot be cloned".to_owned())?;
    let fresh: HtmlCanvasElement = fresh.dyn_into().map_err(|_| "#view is no canvas".to_owned())?;
    old.replace_with_with_node_1(&fresh).map_err(|_| "the canvas cannot be replaced".to_owned())?;
    Ok(fresh)
}

/// The elements that change.
pub struct Page {
    scene: HtmlElement,
    fps: HtmlElement,
    mbit: HtmlElement,
    round_trip: HtmlElement,
    age: HtmlElement,
    longest: HtmlElement,
    updates: HtmlElement,
    /// In the order of [`Figure::ALL`].
    curves: [Element; Figure::ALL.len()],
    timeline: Element,
    samples: HtmlElement,
    uncovered: HtmlElement,
    /// Two, shown together.
    soft: [HtmlElement; 2],
    soft_points: HtmlElement,
    resolution: HtmlElement,
    shadows: HtmlElement,
    occlusion: HtmlElement,
    renderer: HtmlElement,
    status: HtmlElement,
    loading: HtmlElement,
    loading_text: HtmlElement,
    loading_detail: HtmlElement,
    progress: HtmlElement,
    mode: HtmlElement,
    role: HtmlElement,
    tape: Element,
    measured: HtmlElement,
    tape_toggle: HtmlElement,
    named: HtmlElement,
    parts: HtmlElement,
    parts_toggle: HtmlElement,
}

impl Page {
    /// Finds them.
    pub fn new() -> Result<Page, String> {
        let is_secure = web_sys::window().is_some_and(|window| window.is_secure_context());
        element("insecure")?.set_hidden(is_secure);
        Ok(Page {
            scene: element("scene")?,
            fps: element("fps")?,
            mbit: element("mbit")?,
            round_trip: element("round-trip")?,
            age: element("age")?,
            longest: element("longest")?,
            updates: element("updates")?,
            curves: [
                drawing("curve-fps")?,
                drawing("curve-mbit")?,
                drawing("curve-round-trip")?,
                drawing("curve-age")?,
                drawing("curve-longest")?,
            ],
            timeline: drawing("timeline")?,
            samples: element("samples")?,
            uncovered: element("uncovered")?,
            soft: [element("soft-name")?, element("soft")?],
            soft_points: element("soft-points")?,
            resolution: element("resolution")?,
            shadows: element("shadows")?,
            occlusion: element("occlusion")?,
            renderer: element("renderer")?,
            status: element("status")?,
            loading: element("loading")?,
            loading_text: element("loading-text")?,
            loading_detail: element("loading-detail")?,
            progress: element("progress")?,
            mode: element("mode")?,
            role: element("role")?,
            tape: drawing("tape")?,
            measured: element("measured")?,
            tape_toggle: element("tape-toggle")?,
            named: element("named")?,
            parts: element("parts")?,
            parts_toggle: element("parts-toggle")?,
        })
    }

    /// Shows the figures.
    pub fn show_stats(&self, stats: &Stats, renderer: &str) {
        let whole = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.0}"));
        set_as_is(&self.scene, if stats.scene.is_empty() { "Vantage" } else { &stats.scene });
        set_text(&self.fps, &format!("{:.0}", stats.fps));
        set_text(&self.mbit, &format!("{:.2}", stats.mbit_per_s));
        set_text(&self.round_trip, &whole(stats.round_trip_ms.or(stats.ping_ms)));
        set_text(&self.age, &whole(stats.age_ms));
        set_text(&self.samples, &short_count(stats.samples));
        let uncovered = stats.uncovered_share.map_or_else(|| "–".to_owned(), |share| format!("{:.1}", share * 100.0));
        set_text(&self.uncovered, &uncovered);
        set_text(&self.renderer, renderer);
    }

    /// Shows the last minute, and the last updates.
    pub fn show_history(&self, history: &History) {
        let longest = history.now(Figure::LongestFrame);
        set_text(&self.longest, &longest.map_or_else(|| "–".to_owned(), |ms| format!("{ms:.0}")));
        set_text(&self.updates, &history.updates_in_words());
        for (curve, figure) in self.curves.iter().zip(Figure::ALL) {
            // From the top down.
            let points = history.curve(figure).into_iter().map(|[x, y]| format!("{x:.3},{:.3} ", 1.0 - y));
            set_attribute(curve, "points", &points.collect::<String>());
        }
        let bars = history.updates().into_iter().map(|[x, height]| format!("M{x:.4} 1V{:.3}", 1.0 - height));
        set_attribute(&self.timeline, "d", &bars.collect::<String>());
    }

    /// Shows how many points of its lights a picture has soft shadows of, and by which method, if any.
    pub fn show_soft(&self, progress: Option<SoftProgress>) {
        self.soft.iter().for_each(|element| element.set_hidden(progress.is_none()));
        if let Some(progress) = progress {
            set_text(&self.soft_points, &progress.to_string());
        }
    }

    /// Shows how fine pictures are.
    pub fn show_resolution(&self, resolution: Option<Resolution>) {
        if let Some(resolution) = resolution {
            set_text(&self.resolution, &resolution.to_string());
        }
    }

    /// Shows what became of shadows and of ambient occlusion.
    pub fn show_effects(&self, effects: Option<[Drawn; 2]>) {
        if let Some([shadows, occlusion]) = effects {
            set_text(&self.shadows, &shadows.to_string());
            set_text(&self.occlusion, &occlusion.to_string());
        }
    }

    /// Shows which way the eye moves.
    pub fn show_mode(&self, mode: Option<Mode>) {
        let walking = mode == Some(Mode::Walk);
        set_text(&self.mode, if walking { "Walking" } else { "Turning" });
        set_attribute(&self.mode, "aria-pressed", if walking { "true" } else { "false" });
    }

    /// Shows who presents or is followed; pressed while the eye goes with his.
    pub fn show_role(&self, role: &Role, is_led: bool) {
        let text = match role {
            Role::Viewer | Role::Camera(_) => String::new(),
            Role::Presenter(name) => format!("Presenting as {name}"),
            Role::Follower(name) if is_led => format!("Following {name}"),
            Role::Follower(name) => format!("Follow {name}"),
        };
        set_text(&self.role, &text);
        self.role.set_hidden(text.is_empty());
        set_attribute(&self.role, "aria-pressed", if is_led { "true" } else { "false" });
    }

    /// Shows a tape, whose ends are at places of the page, and what it says; nothing while nothing is measured.
    pub fn show_tape(&self, tape: Option<(&[DVec2], &str)>) {
        set_attribute(&self.tape_toggle, "aria-pressed", if tape.is_some() { "true" } else { "false" });
        self.measured.set_hidden(tape.is_none());
        let (ends_px, words) = tape.unwrap_or((&[], ""));
        set_text(&self.measured, words);
        // A ring around each end, and a line between them.
        let ring = |&DVec2 { x, y }: &DVec2| format!("M{:.1} {y:.1}a5 5 0 1 0 10 0a5 5 0 1 0 -10 0", x - 5.0);
        let line = match ends_px {
            [a, b] => format!("M{:.1} {:.1}L{:.1} {:.1}", a.x, a.y, b.x, b.y),
            _ => String::new(),
        };
        set_attribute(&self.tape, "d", &ends_px.iter().map(ring).chain([line]).collect::<String>());
    }

    /// Shows the name of what is at a place of the page, or none.
    pub fn show_name(&self, name: Option<(DVec2, &str)>) {
        self.named.set_hidden(name.is_none());
        let Some((at_px, name)) = name else { return };
        set_as_is(&self.named, name);
        // The style exists; setting lengths cannot fail.
        let _ = self.named.style().set_property("left", &format!("{:.0}px", at_px.x));
        let _ = self.named.style().set_property("top", &format!("{:.0}px", at_px.y));
    }

    /// Shows what is done with parts, while they are chosen.
    pub fn show_parts(&self, are_chosen: bool) {
        set_attribute(&self.parts_toggle, "aria-pressed", if are_chosen { "true" } else { "false" });
        self.parts.set_hidden(!are_chosen);
    }

    /// Shows what is wrong, or nothing.
    pub fn show_status(&self, status: &str) {
        set_text(&self.status, status);
        self.status.set_hidden(status.is_empty());
    }

    /// Shows how far the first picture is; `None` once it is there.
    pub fn show_progress(&self, progress: Option<Progress>, connected: bool) {
        self.loading.set_hidden(progress.is_none());
        let Some(Progress { bytes, of_bytes }) = progress else { return };
        if of_bytes == 0 {
            set_text(&self.loading_text, if connected { "Waiting for the first picture" } else { "Connecting" });
            set_text(&self.loading_detail, "");
            // An attribute that is not there is as good.
            let _ = self.progress.remove_attribute("aria-valuenow");
            return;
        }
        let percent = (100.0 * bytes as f64 / of_bytes as f64).round();
        set_text(&self.loading_text, "Receiving the first picture");
        set_text(&self.loading_detail, &format!("{} of {} KiB", bytes.div_ceil(KIB), of_bytes.div_ceil(KIB)));
        set_attribute(&self.progress, "aria-valuenow", &percent.to_string());
        if let Some(bar) = self.progress.first_element_child().and_then(|bar| bar.dyn_into::<HtmlElement>().ok()) {
            // The style exists; setting a plain width cannot fail.
            let _ = bar.style().set_property("width", &format!("{percent}%"));
        }
    }
}

/// A dialog of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialog {
    /// How to move around.
    Help,
    /// What is sent, and what is left out.
    Inventory,
}

impl Dialog {
    fn element(self) -> Option<Element> {
        document().get_element_by_id(match self {
            Dialog::Help => "help",
            Dialog::Inventory => "inventory",
        })
    }

    /// Whether it is open.
    pub fn is_open(self) -> bool {
        self.element().is_some_and(|dialog| dialog.has_attribute("open"))
    }
}

/// Whether any dialog is open, which takes the keys.
pub fn has_open_dialog() -> bool {
    document().query_selector("dialog[open]").is_ok_and(|found| found.is_some())
}

/// Whether keys are meant for the view: no button or field has the focus.
pub fn looks_at_view() -> bool {
    let active = document().active_element();
    active.is_none_or(|element| element.id() == "view" || element.tag_name() == "BODY")
}

/// Whether clicks on the picture are for a tool.
pub fn has_tool() -> bool {
    let tools = "#tape-toggle[aria-pressed=true], #parts-toggle[aria-pressed=true]";
    document().query_selector(tools).is_ok_and(|found| found.is_some())
}

/// Whether what moves the eye is meant for this page: it has the focus, and no dialog is open.
pub fn has_keys() -> bool {
    document().has_focus().unwrap_or(false) && !has_open_dialog()
}

/// Whether the person wants no more motion than there must be.
pub fn wants_less_motion() -> bool {
    let query = web_sys::window().and_then(|window| window.match_media("(prefers-reduced-motion: reduce)").ok()?);
    query.is_some_and(|query| query.matches())
}

/// As a click on a button does, where it is shown.
pub fn press(id: &str) {
    if let Ok(button) = element(id)
        && !button.hidden()
    {
        button.click();
    }
}

/// Opens or closes a dialog.
pub fn toggle(dialog: Dialog) {
    let Some(dialog) = dialog.element() else { return };
    let Ok(dialog) = dialog.dyn_into::<web_sys::HtmlDialogElement>() else { return };
    if dialog.open() {
        dialog.close();
    } else {
        // Both fail only where it is open already.
        let _ = dialog.show_modal();
        let _ = dialog.focus();
        // Its first button, which had the focus for a moment, may lie far down.
        dialog.set_scroll_top(0);
    }
}

/// Writes down what is sent, and what is left out.
pub fn show_inventory(inventory: &Inventory) -> Result<(), String> {
    let table = element("inventory-parts")?;
    let of = |name: &str| document().create_element(name).map_err(|_| format!("no <{name}> can be made"));
    let rows = inventory.parts.iter().map(|part| {
        let row = of("tr")?;
        row.set_class_name(if part.made.is_some() { "" } else { "left-out" });
        for text in [&part.name, part.made.as_ref().unwrap_or(&"left out".to_owned()), &part.why] {
            let cell = of("td")?;
            cell.set_text_content(Some(&says(text)));
            row.append_child(&cell).map_err(|_| "a row takes no cell".to_owned())?;
        }
        Ok(row)
    });
    let rows = rows.collect::<Result<Vec<Element>, String>>()?;
    let text: String = rows.iter().filter_map(|row| row.text_content()).collect();
    if table.text_content() != Some(text) {
        table.set_inner_html("");
        for row in rows {
            table.append_child(&row).map_err(|_| "the table takes no row".to_owned())?;
        }
    }
    Ok(())
}

/// Shows or hides the figures.
pub fn toggle_figures() {
    let (Ok(figures), Ok(toggle)) = (element("figures"), element("panel-toggle")) else { return };
    let show = figures.hidden();
    figures.set_hidden(!show);
    set_attribute(&toggle, "aria-expanded", if show { "true" } else { "false" });
}

/// A panic ends the program; the page says so.
pub fn report_panics() {
    std::panic::set_hook(Box::new(|info| {
        console_error_panic_hook::hook(info);
        if let Ok(status) = element("status") {
            set_text(&status, "the viewer stopped by a fault of its own; reload the page to start it again");
            status.set_hidden(false);
        }
    }));
}

/// Text is set in the page's language, and only where it changes: assistive technology reads what is set.
fn set_text(element: &HtmlElement, text: &str) {
    set_as_is(element, &says(text));
}

/// The same of names, which are no words.
fn set_as_is(element: &HtmlElement, text: &str) {
    if element.text_content().as_deref() != Some(text) {
        element.set_text_content(Some(text));
    }
}

fn set_attribute(element: &Element, name: &str, value: &str) {
    if element.get_attribute(name).as_deref() != Some(value) {
        // Fails only for names that are no names.
        let _ = element.set_attribute(name, value);
    }
}
