//! Small files made by hand, loaded as if from the disk.

mod build;
mod formats;
mod gltf;
mod hostile;
mod merge;
mod motion;
mod packed;
mod points;

use std::path::PathBuf;

use super::source::Folder;
use super::{Choice, LoadError, LoadLimits, Request};
use crate::Scene;

/// A new folder below the system's temporary one, removed when dropped.
struct TestFolder(PathBuf);

impl TestFolder {
    fn new(name: &str) -> TestFolder {
        let path = std::env::temp_dir().join(format!("vantage-scene-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        TestFolder(path)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for TestFolder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

type Loader = fn(&[u8], &Request<'_>) -> Result<Scene, LoadError>;

fn load_with(loader: Loader, bytes: &[u8], limits: &LoadLimits) -> Result<Scene, LoadError> {
    load_chosen(loader, bytes, (limits, &Choice::default()))
}

fn load_chosen(loader: Loader, bytes: &[u8], (limits, choice): (&LoadLimits, &Choice)) -> Result<Scene, LoadError> {
    let folder = Folder::of(&std::env::temp_dir().join("scene")).unwrap();
    loader(bytes, &Request { name: "test".into(), folder, choice, limits, progress: &|_| {} })
}

fn load_gltf(bytes: &[u8]) -> Result<Scene, LoadError> {
    load_with(|bytes, request| super::gltf::load(bytes.to_vec(), request), bytes, &LoadLimits::default())
}

fn load_obj(text: &str) -> Result<Scene, LoadError> {
    load_with(super::obj::load, text.as_bytes(), &LoadLimits::default())
}

fn load_ply(bytes: &[u8]) -> Result<Scene, LoadError> {
    load_with(super::ply::load, bytes, &LoadLimits::default())
}

fn load_stl(bytes: &[u8]) -> Result<Scene, LoadError> {
    load_with(super::stl::load, bytes, &LoadLimits::default())
}

/// The message of a load that fails.
fn refusal(result: Result<Scene, LoadError>) -> String {
    match result {
        Ok(scene) => panic!("it loads, with {:?}", scene.warnings),
        Err(error) => error.to_string(),
    }
}

/// Where the vertices of the first instance's first triangle are at a time.
fn first_triangle(scene: &Scene, time_s: f64) -> [glam::DVec3; 3] {
    let snapshot = scene.at(time_s);
    let mesh = &scene.meshes[scene.instances[0].mesh as usize];
    let deformed = snapshot.deformed.iter().find(|deformed| deformed.instance == 0);
    let vertices = deformed.map_or(&mesh.vertices, |deformed| &deformed.vertices);
    [0, 1, 2].map(|corner| {
        let vertex = vertices[mesh.indices[corner] as usize];
        snapshot.world_from_mesh[0].transform_point3(glam::DVec3::from(vertex.position.map(f64::from)))
    })
}

fn assert_near(found: glam::DVec3, expected: [f64; 3]) {
    let expected = glam::DVec3::from(expected);
    assert!((found - expected).length() < 1e-5, "{found} is not {expected}");
}
