//! A cell of the tables: one set of one lamp on one scene, drawn in one way. What finds it again, and its row.

use serde_json::{Value, json};
use server::discretize::Discretization;

use super::methods::{METHODS, Way};
use super::sets::Images;
use super::settings::{InAllWays, Settings, USUAL_LAMP};
use crate::report::Row;

/// See the module.
#[derive(Clone)]
pub(super) struct Cell {
    pub scene: String,
    pub set: String,
    pub images: Images,
    /// Its diagonal, in those of the scene's box.
    pub lamp: f64,
    pub image_px: u32,
    pub way: Way,
}

/// The full geometry's name among sets.
pub(super) const FULL_GEOMETRY: &str = "full geometry";

impl Cell {
    /// Drawn in the paper's way.
    pub fn new(scene: &str, (set, images): (&str, Images), (lamp, image_px): (f64, u32)) -> Cell {
        Cell { scene: scene.to_owned(), set: set.to_owned(), images, lamp, image_px, way: METHODS[0] }
    }

    /// Everything that its figures depend on, but the program. `what`: which figures.
    pub fn key(&self, what: &str, scene: &str, machine: &Value, settings: &Settings) -> Value {
        json!({
            "what": what,
            "scene": scene,
            "set": self.set,
            "lamp": self.lamp,
            "image_px": self.image_px,
            "way": self.way.name,
            "drawing": format!("{:?}", (self.way.settings)(settings.points, self.image_px)),
            "points": settings.points,
            "size_px": settings.size_px,
            "runs": settings.runs,
            "machine": machine,
        })
    }

    /// Its row, without figures.
    pub fn row(&self, settings: &Settings) -> Row {
        let mut row = Row::new(&self.scene, &self.label());
        row.parameters.set("set", self.set.as_str());
        row.parameters.set("method", self.way.name);
        row.parameters.set("image_px", self.image_px);
        row.parameters.set("lamp", self.lamp);
        row.parameters.set("points", settings.points);
        row
    }

    /// The set, and the way where it is not the paper's.
    pub fn label(&self) -> String {
        if self.way.is_papers() { self.set.clone() } else { format!("{}, {}", self.set, self.way.name) }
    }
}

impl Settings {
    /// Everything that the tables of a scene are made of, such that what is made for one cell serves the next ones.
    pub fn cells(&self, scene: &str) -> Vec<Cell> {
        let of_size = |&(lamp, image_px): &(f64, u32)| {
            let is_usual = lamp == USUAL_LAMP && image_px == self.usual_px;
            let of_set = move |(set, images): &(String, Images)| {
                let all = match self.in_all_ways {
                    InAllWays::Everything => true,
                    InAllWays::Usual if is_usual => true,
                    InAllWays::Usual | InAllWays::Ours => *images == Images::CORNERS,
                };
                let ways = self.ways.iter().filter(move |way| all || way.is_papers());
                let cell = Cell::new(scene, (set, *images), (lamp, image_px));
                ways.map(move |way| Cell { way: *way, ..cell.clone() }).collect::<Vec<_>>()
            };
            self.sets.iter().flat_map(of_set).collect::<Vec<_>>()
        };
        self.sizes.iter().flat_map(of_size).collect()
    }

    /// What is drawn of a scene of some number of triangles, each method in its first setting; the full geometry last.
    pub fn growth_cells(&self, scene: &str) -> Vec<Cell> {
        let one_size = Settings { sizes: vec![(USUAL_LAMP, self.growth_px)], ..self.clone() };
        let is_first = |cell: &Cell| cell.way.name == cell.way.method();
        // The paper's alone of the sets that are not ours.
        let is_drawn = |cell: &Cell| cell.way.is_papers() || cell.images == Images::CORNERS;
        let mut cells: Vec<Cell> =
            one_size.cells(scene).into_iter().filter(|cell| is_first(cell) && is_drawn(cell)).collect();
        let full = (FULL_GEOMETRY, Images::By(Discretization::Conventional));
        cells.push(Cell::new(scene, full, (USUAL_LAMP, self.growth_px)));
        cells
    }
}

/// What a file holds may change: its length and time, beside its name.
pub(super) fn source_of(scene: &str) -> String {
    let metadata = std::fs::metadata(scene).ok().filter(std::fs::Metadata::is_file);
    let stamp = |metadata: std::fs::Metadata| {
        let changed = metadata.modified().ok()?.duration_since(std::time::UNIX_EPOCH).ok()?;
        Some(format!("{scene}, {} bytes, {}", metadata.len(), changed.as_millis()))
    };
    metadata.and_then(stamp).unwrap_or_else(|| scene.to_owned())
}
