//! The task that loads scenes of a folder, one at a time, and puts them away.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::shelf::Shelf;
use super::within::SceneFile;
use crate::prepare::{PrepareError, Prepared};
use crate::session::Shared;

/// Makes a scene's file ready, and says how far that is.
pub type Load = Arc<dyn Fn(&SceneFile, &(dyn Fn(String) + Sync)) -> Result<Prepared, PrepareError> + Send + Sync>;

/// Between two looks at what nobody wants any more. Little beside how long that is kept.
const LOOKS_EVERY: Duration = Duration::from_secs(1);

/// Runs for ever. `others_bytes`: what scenes take that are not of the shelf.
pub(super) async fn tend(shelf: &Arc<Shelf>, load: &Load, others_bytes: impl Fn() -> u64) {
    loop {
        tokio::select! {
            () = shelf.asked.notified() => {}
            () = tokio::time::sleep(LOOKS_EVERY) => {}
        }
        shelf.tidy(Instant::now());
        while let Some((name, file)) = shelf.next_asked() {
            if shelf.has_place(&name) {
                match made(shelf, &name, file.clone(), load).await {
                    Ok(shared) => shelf.show((&name, file), shared, others_bytes()),
                    Err(why) => shelf.failed(&name, &why),
                }
            }
        }
    }
}

/// Loads a scene and opens it, on a thread that may take its time. A fault of that ends nothing else.
async fn made(shelf: &Arc<Shelf>, name: &str, file: SceneFile, load: &Load) -> Result<Arc<Shared>, String> {
    shelf.says(name, String::new());
    let (shelf, load, name) = (shelf.clone(), load.clone(), name.to_owned());
    let opened = tokio::task::spawn_blocking(move || {
        let prepared = load(&file, &|said| shelf.says(&name, said)).map_err(|error| error.to_string())?;
        let Prepared { config, scene, imager } = prepared;
        Shared::open(config, scene, imager, shelf.house.clone()).map_err(|error| error.to_string())
    });
    opened.await.map_err(|fault| fault.to_string())?
}
