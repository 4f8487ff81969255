//! Cameras that people write into files of their own, for viewers to ask for by their names: `--graph-camera`.
//!
//! A file holds one camera or a list of them, as JSON; see [`camera::written`].

use std::io::Read;
use std::path::{Path, PathBuf};

use camera::written::{NamedCamera, NamedWritten, WrittenCamera, WrittenError};
use camera::{Camera, Rigid};
use protocol::wire::GRAPH_MAX_FRUSTA;
use scene::Scene;
use serde::Deserialize;
use thiserror::Error;

/// No file of as many cameras is longer.
const MAX_FILE_BYTES: u64 = 16 << 20;

/// Why a file of cameras was refused.
#[derive(Debug, Error)]
#[error("{}: {why}", path.display())]
pub struct CameraFileError {
    path: PathBuf,
    why: Why,
}

#[derive(Debug, Error)]
enum Why {
    #[error("cannot be read: {0}")]
    Read(#[from] std::io::Error),
    #[error("longer than {MAX_FILE_BYTES} bytes")]
    TooLong,
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    #[error("camera {name:?}: {why}")]
    Written { name: String, why: WrittenError },
    #[error("camera {name:?}: {why}")]
    Shape { name: String, why: serde_json::Error },
    #[error("camera {name:?}: the name must have 1 to {} bytes", WrittenCamera::MAX_NAME_BYTES)]
    Name { name: String },
    #[error("camera {name:?}: there is another one of this name")]
    SameName { name: String },
    #[error("camera {name:?}: it has {frusta} frusta, at most {GRAPH_MAX_FRUSTA} are sent")]
    TooManyFrusta { name: String, frusta: usize },
    #[error("camera {name:?}: a scene has at most {} cameras", WrittenCamera::MAX_CAMERAS)]
    TooMany { name: String },
}

/// Adds the cameras of a file to those of a scene; objects are known by the scene's names.
///
/// # Errors
/// [`CameraFileError`] names the file, the camera and the frustum.
pub fn add(scene: &mut Scene, path: &Path) -> Result<(), CameraFileError> {
    add_all(scene, path).map_err(|why| CameraFileError { path: path.to_owned(), why })
}

fn add_all(scene: &mut Scene, path: &Path) -> Result<(), Why> {
    let mut text = String::new();
    std::fs::File::open(path)?.take(MAX_FILE_BYTES + 1).read_to_string(&mut text)?;
    if text.len() as u64 > MAX_FILE_BYTES {
        return Err(Why::TooLong);
    }
    let written = match serde_json::from_str(&text)? {
        serde_json::Value::Array(cameras) => cameras,
        camera => vec![camera],
    };
    for camera in written {
        let name = camera.get("name").and_then(serde_json::Value::as_str).unwrap_or_default().to_owned();
        let named = NamedWritten::deserialize(camera).map_err(|why| Why::Shape { name, why })?;
        let camera = compiled(scene, named)?;
        scene.named_cameras.push(camera);
    }
    Ok(())
}

fn compiled(scene: &Scene, written: NamedWritten) -> Result<NamedCamera, Why> {
    let name = written.name.clone();
    if !(1..=WrittenCamera::MAX_NAME_BYTES).contains(&name.len()) {
        return Err(Why::Name { name });
    }
    if scene.named_cameras.iter().any(|known| known.name == name) {
        return Err(Why::SameName { name });
    }
    if scene.named_cameras.len() >= WrittenCamera::MAX_CAMERAS {
        return Err(Why::TooMany { name });
    }
    let bounds_of = |object: &str| scene.bounds_of_name(object);
    let camera = written.camera().and_then(|camera| camera.compile(&Rigid::IDENTITY, &bounds_of));
    let camera = camera.map_err(|why| Why::Written { name: name.clone(), why })?;
    if let Camera::Graph(graph) = &camera
        && graph.frusta().len() > GRAPH_MAX_FRUSTA
    {
        return Err(Why::TooManyFrusta { name, frusta: graph.frusta().len() });
    }
    Ok(NamedCamera { name, camera })
}
