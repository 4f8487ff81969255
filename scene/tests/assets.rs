//! Loads every scene file below `$VANTAGE_ASSETS/scenes` and compares what happens with `assets.txt`, the table of
//! expected outcomes. A file that is not in the table fails, and so does a line whose file is gone. Without the variable
//! the tests are listed as ignored.
//!
//! Each file has [`TIME_CAP`] of wall-clock time. All malformed files together, loaded in a process of their own, may
//! make it no larger than [`MEMORY_CAP_KIB`] of address space: claims in files are never believed with memory.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use libtest_mimic::{Arguments, Failed, Trial};
use vantage_scene::load::{LoadError, LoadLimits, load};
use vantage_scene::{Scene, Snapshot};

const TABLE: &str = include_str!("assets.txt");

/// For one file, on a busy machine in the development profile.
const TIME_CAP: Duration = Duration::from_secs(20);

/// Address space of a process that loads every malformed file: one that believed a single one of their claims (a view
/// of 2 GiB, 4e9 elements) would pass it. The largest of the files has 0.5 MB.
const MEMORY_CAP_KIB: u64 = 512 * 1024;

/// Set for the process that the memory test starts.
const CHILD_VARIABLE: &str = "VANTAGE_LOAD_MALFORMED_ONLY";

/// Extensions of files that are scenes; others are parts of them, or notes.
const SCENE_EXTENSIONS: &[&str] = &["gltf", "glb", "obj", "ply", "stl"];

fn main() {
    if let Some(root) = std::env::var_os(CHILD_VARIABLE) {
        load_malformed(Path::new(&root));
        return;
    }
    let arguments = Arguments::from_args();
    let root = std::env::var_os("VANTAGE_ASSETS").map(|assets| PathBuf::from(assets).join("scenes"));
    let rows: Vec<Row> = TABLE.lines().filter_map(Row::parse).collect();
    let mut trials: Vec<Trial> = rows
        .iter()
        .map(|row| {
            let (row, root) = (row.clone(), root.clone());
            let ignored = root.is_none();
            Trial::test(row.path.clone(), move || row.check(&root.expect("ignored without assets")))
                .with_ignored_flag(ignored)
        })
        .collect();
    let ignored = root.is_none();
    trials.push(
        Trial::test("every file is in the table", {
            let root = root.clone();
            move || complete(&rows, &root.expect("ignored without assets"))
        })
        .with_ignored_flag(ignored),
    );
    let index_root = root.clone();
    trials.push(
        Trial::test("still scenes are as large as the index says", move || {
            sizes(&index_root.expect("ignored without assets"))
        })
        .with_ignored_flag(ignored),
    );
    let memory_root = root.clone();
    trials.push(
        Trial::test("malformed files take no more memory than the cap", move || {
            memory(&memory_root.expect("ignored without assets"))
        })
        .with_ignored_flag(ignored || !cfg!(target_os = "linux")),
    );
    libtest_mimic::run(&arguments, trials).exit();
}

/// Where the index does not measure what is drawn: it takes the corners of rotated boxes (2CylinderEngine, retroufo),
/// leaves out instances (SimpleInstancing, TeapotsGalore), and takes points and lines without the solids that stand for
/// them (MeshPrimitiveModes, city-helsinki-points).
const MEASURED_OTHERWISE: &[&str] =
    &["2CylinderEngine", "retroufo", "SimpleInstancing", "TeapotsGalore", "MeshPrimitiveModes", "city-helsinki-points"];

/// Compares sizes with those in `INDEX.md`, which were measured by another program at rest pose.
fn sizes(root: &Path) -> Result<(), Failed> {
    /// The index gives four digits.
    const TOLERANCE: f64 = 2e-3;
    let index = std::fs::read_to_string(root.join("INDEX.md"))?;
    let (mut compared, mut wrong) = (0, Vec::new());
    for line in index.lines().filter(|line| line.contains(" × ")) {
        let cells: Vec<&str> = line.split(" | ").collect();
        let path = cells[0].trim_start_matches("| ");
        if MEASURED_OTHERWISE.iter().any(|name| path.contains(name)) {
            continue;
        }
        let Some(expected) = cells.iter().find_map(|cell| size_of(cell)) else { continue };
        let Ok(scene) = load(&root.join(path), &LoadLimits::default(), &|_| {}) else { continue };
        if scene.is_animated() {
            continue;
        }
        compared += 1;
        let found = (scene.bounds.max - scene.bounds.min).to_array();
        let largest = expected.iter().copied().fold(0.0, f64::max);
        if found.iter().zip(expected).any(|(found, expected)| (found - expected).abs() > TOLERANCE * largest) {
            wrong.push(format!("{path}: {found:?}, not {expected:?}"));
        }
    }
    if compared == 0 || !wrong.is_empty() {
        return Err(format!("{compared} scenes compared; wrong:\n{}", wrong.join("\n")).into());
    }
    Ok(())
}

/// `1 × 2 × 3` as numbers.
fn size_of(cell: &str) -> Option<[f64; 3]> {
    let numbers: Vec<f64> = cell.split(" × ").map_while(|number| number.trim().parse().ok()).collect();
    numbers.try_into().ok()
}

/// Loads everything below `root`, and prints the largest size that the process had, in KiB.
fn load_malformed(root: &Path) {
    let mut found = Vec::new();
    walk(root, &mut found);
    for path in &found {
        let _ = load(path, &LoadLimits::default(), &|_| {});
    }
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:")).expect("Linux tells it");
    println!("{} {}", found.len(), line.trim().trim_end_matches(" kB"));
}

fn memory(root: &Path) -> Result<(), Failed> {
    let output = std::process::Command::new(std::env::current_exe().expect("this program has a path"))
        .env(CHILD_VARIABLE, root.join("malformed"))
        // Arenas and stacks of threads would count as address space, without being used.
        .envs([("RAYON_NUM_THREADS", "1"), ("MALLOC_ARENA_MAX", "1")])
        .output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let (files, peak_kib) = text.trim().split_once(' ').ok_or_else(|| format!("the process failed: {output:?}"))?;
    let (files, peak_kib): (usize, u64) = (files.parse()?, peak_kib.parse()?);
    if files == 0 || peak_kib > MEMORY_CAP_KIB {
        return Err(format!("{files} files took {peak_kib} KiB, the cap is {MEMORY_CAP_KIB}").into());
    }
    Ok(())
}

fn complete(rows: &[Row], root: &Path) -> Result<(), Failed> {
    let known: BTreeSet<&str> = rows.iter().map(|row| row.path.as_str()).collect();
    let mut found = Vec::new();
    walk(root, &mut found);
    let missing: Vec<String> = found
        .iter()
        .map(|path| path.strip_prefix(root).expect("below the root").to_string_lossy().into_owned())
        .filter(|path| !known.contains(path.as_str()))
        .map(|path| format!("{path} | {}", Outcome::of(&root.join(&path)).row()))
        .collect();
    if missing.is_empty() { Ok(()) } else { Err(format!("not in the table:\n{}", missing.join("\n")).into()) }
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> =
        std::fs::read_dir(folder).expect("the folder exists").map(|entry| entry.expect("readable").path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            walk(&path, found);
        } else if path.extension().is_some_and(|e| SCENE_EXTENSIONS.contains(&e.to_string_lossy().as_ref())) {
            found.push(path);
        }
    }
}

/// What is expected of one file.
#[derive(Debug, Clone)]
struct Row {
    path: String,
    expected: Expected,
}

#[derive(Debug, Clone)]
enum Expected {
    /// `loads N` or `loads N: TEXT`: with N triangles, and without a warning or with one that contains TEXT.
    Loads { triangles: u64, warning: Option<String> },
    /// `refused: TEXT`: with an error that contains TEXT.
    Refused(String),
}

impl Row {
    fn parse(line: &str) -> Option<Row> {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            return None;
        }
        let (path, outcome) = line.split_once(" | ").unwrap_or_else(|| panic!("no ' | ' in {line:?}"));
        let (verdict, text) = match outcome.split_once(": ") {
            Some((verdict, text)) => (verdict.trim(), Some(text.trim().to_owned())),
            None => (outcome.trim(), None),
        };
        let expected = match (verdict.split_once(' '), text) {
            (Some(("loads", triangles)), warning) => {
                Expected::Loads { triangles: triangles.parse().expect("a number of triangles"), warning }
            }
            (None, Some(text)) if verdict == "refused" => Expected::Refused(text),
            _ => panic!("neither 'loads N' nor 'refused: …': {line:?}"),
        };
        Some(Row { path: path.trim().to_owned(), expected })
    }

    fn check(&self, root: &Path) -> Result<(), Failed> {
        let outcome = Outcome::of(&root.join(&self.path));
        let holds = match (&self.expected, &outcome) {
            (Expected::Loads { triangles, warning }, Outcome::Loaded(found, warnings)) => {
                triangles == found
                    && match warning {
                        Some(text) => warnings.iter().any(|warning| warning.contains(text.as_str())),
                        None => warnings.is_empty(),
                    }
            }
            (Expected::Refused(text), Outcome::Refused(error)) => error.contains(text.as_str()),
            _ => false,
        };
        if holds { Ok(()) } else { Err(format!("found: {} | {}", self.path, outcome.row()).into()) }
    }
}

/// What happened.
#[derive(Debug)]
enum Outcome {
    Loaded(u64, Vec<String>),
    Refused(String),
    Broken(String),
}

impl Outcome {
    /// Loads a file in a thread of its own, so that one that hangs fails alone.
    fn of(path: &Path) -> Outcome {
        let (sender, receiver) = mpsc::channel();
        let owned = path.to_owned();
        let worker = std::thread::spawn(move || {
            let result = load(&owned, &LoadLimits::default(), &|_| {});
            let _ = sender.send(result.map_or_else(|error| Outcome::refused(&error), |scene| Outcome::loaded(&scene)));
        });
        match receiver.recv_timeout(TIME_CAP) {
            Ok(outcome) => outcome,
            Err(mpsc::RecvTimeoutError::Timeout) => Outcome::Broken(format!("not done after {TIME_CAP:?}")),
            Err(mpsc::RecvTimeoutError::Disconnected) => {
                let _ = worker.join();
                Outcome::Broken("it panicked".into())
            }
        }
    }

    fn refused(error: &LoadError) -> Outcome {
        Outcome::Refused(error.to_string())
    }

    fn loaded(scene: &Scene) -> Outcome {
        for time_s in [0.0, 0.73, -3.1, 1e6] {
            let snapshot = scene.at(time_s);
            let placed = scene.places(time_s).into_iter().zip(&snapshot.world_from_mesh).zip(&scene.instances);
            if placed.into_iter().any(|((alone, place), instance)| !instance.deforms && alone != *place) {
                return Outcome::Broken(format!("at {time_s} s: places alone are others"));
            }
            if let Err(fault) = check_snapshot(scene, &snapshot) {
                return Outcome::Broken(format!("at {time_s} s: {fault}"));
            }
        }
        match check_scene(scene) {
            Ok(()) => Outcome::Loaded(scene.triangle_count(), scene.warnings.clone()),
            Err(fault) => Outcome::Broken(fault),
        }
    }

    fn row(&self) -> String {
        match self {
            Outcome::Loaded(triangles, warnings) if warnings.is_empty() => format!("loads {triangles}"),
            Outcome::Loaded(triangles, warnings) => format!("loads {triangles}: {}", warnings.join(" // ")),
            Outcome::Refused(error) => format!("refused: {error}"),
            Outcome::Broken(fault) => format!("BROKEN: {fault}"),
        }
    }
}

/// What everything after the loader relies on.
fn check_scene(scene: &Scene) -> Result<(), String> {
    for (index, mesh) in scene.meshes.iter().enumerate() {
        if mesh.indices.len() % 3 != 0 || mesh.indices.iter().any(|&i| i as usize >= mesh.vertices.len()) {
            return Err(format!("mesh {index} has an index that is out of range"));
        }
        if mesh.material as usize >= scene.materials.len() {
            return Err(format!("mesh {index} has no material"));
        }
        check_vertices(&mesh.vertices).map_err(|fault| format!("mesh {index}: {fault}"))?;
        let reach = mesh.bounds.iter().flatten().fold(0.0_f32, |reach, x| reach.max(x.abs()));
        let size = (0..3).map(|axis| mesh.bounds[1][axis] - mesh.bounds[0][axis]).fold(0.0, f32::max);
        if reach > size {
            return Err(format!("mesh {index} is not centred: {:?}", mesh.bounds));
        }
    }
    let textures_exist = scene.materials.iter().flat_map(|m| m.texture).all(|t| (t as usize) < scene.textures.len());
    let meshes_exist = scene.instances.iter().all(|instance| (instance.mesh as usize) < scene.meshes.len());
    if !textures_exist || !meshes_exist {
        return Err("a texture or mesh that does not exist is referred to".into());
    }
    if scene.bounds.is_empty() || !scene.bounds.min.is_finite() || !scene.bounds.max.is_finite() {
        return Err(format!("bounds are {:?}", scene.bounds));
    }
    Ok(())
}

fn check_vertices(vertices: &[vantage_scene::Vertex]) -> Result<(), String> {
    for (index, vertex) in vertices.iter().enumerate() {
        let length = vertex.normal.iter().map(|x| x * x).sum::<f32>().sqrt();
        if !vertex.position.iter().chain(&vertex.uv).all(|x| x.is_finite()) || (length - 1.0).abs() > 1e-3 {
            return Err(format!("vertex {index} is {vertex:?}"));
        }
    }
    Ok(())
}

fn check_snapshot(scene: &Scene, snapshot: &Snapshot) -> Result<(), String> {
    if snapshot.world_from_mesh.len() != scene.instances.len() {
        return Err("not as many places as instances".into());
    }
    for (index, place) in snapshot.world_from_mesh.iter().enumerate() {
        if !place.is_finite() || !place.inverse().is_finite() {
            return Err(format!("instance {index} has no invertible place: {place:?}"));
        }
    }
    let deforming = scene.instances.iter().filter(|instance| instance.deforms).count();
    if snapshot.deformed.len() != deforming {
        return Err(format!("{} deformed, {deforming} should be", snapshot.deformed.len()));
    }
    for deformed in &snapshot.deformed {
        let mesh = &scene.meshes[scene.instances[deformed.instance as usize].mesh as usize];
        if deformed.vertices.len() != mesh.vertices.len() {
            return Err(format!("instance {} has other vertices than its mesh", deformed.instance));
        }
        check_vertices(&deformed.vertices).map_err(|fault| format!("instance {}: {fault}", deformed.instance))?;
    }
    Ok(())
}
