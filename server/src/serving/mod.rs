//! What a server shows: nothing while its first scene is loaded, then that, later perhaps another one in its place, and nothing new once it is to stop. Beside
//! it, where there is a folder of scenes, or people may bring some, each of those to who asks for it by its name.
//!
//! - `slot`: the first scene; `shelf`: the others; `stock` and `folder`: which there are; `within`: what is chosen within a file; `not_open`: what is said of one that is not open; [`options`]: the command line; `tend`: the task that loads them and puts them away.

mod folder;
mod not_open;
pub mod options;
mod shelf;
mod slot;
mod stock;
mod tend;
pub mod within;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use bytes::Bytes;
pub use folder::{Folder, FolderError};
pub(crate) use not_open::NotOpen;
use scene::model::SceneCamera;
use shelf::Shelf;
use slot::Slot;
pub use stock::Stock;
pub use tend::Load;
use within::{Within, file_of};

use crate::limits::SceneLimits;
use crate::session::{House, Over, Shared};
use crate::uploads::Uploads;

/// See the module.
#[derive(Default)]
pub(crate) struct Serving {
    first: Slot,
    /// What the first scene is called in the folder, where it is of it.
    first_name: OnceLock<String>,
    shelf: OnceLock<Arc<Shelf>>,
    drains: AtomicBool,
}

/// The scene that a name and a choice within its file mean.
enum Meant {
    First(Arc<Shared>),
    /// One of the shelf, by the name of its file there.
    Other(String, Within),
}

impl Serving {
    /// Says how far loading the first scene is.
    pub fn says(&self, said: String) {
        self.first.says(said);
    }

    /// New sessions that name no scene get this one. Those of the one before are told to come again.
    pub fn show(&self, shared: Arc<Shared>) {
        self.first.show(shared);
    }

    /// Offers further scenes too, and loads them as they are asked for. `first`: what the first scene is called there. Ends where that was done before.
    pub async fn offer(self: Arc<Self>, stock: Stock, first: Option<String>, load: Load, terms: (SceneLimits, House)) {
        let (limits, house) = terms;
        first.into_iter().for_each(|name| drop(self.first_name.set(name)));
        let shelf = Arc::new(Shelf::new(stock, limits, house));
        if self.shelf.set(shelf.clone()).is_ok() {
            tend::tend(&shelf, &load, || self.shared().map_or(0, |first| first.scene.bytes())).await;
        }
    }

    /// All further scenes that are open are loaded anew.
    pub fn reload_others(&self) {
        self.shelf.get().into_iter().for_each(|shelf| shelf.reload());
    }

    /// Lets nobody in any more, and tells all sessions that they are over.
    pub fn drain(&self) {
        self.drains.store(true, Ordering::SeqCst);
        self.first.end(Over::Stops);
        self.shelf.get().into_iter().for_each(|shelf| shelf.end(Over::Stops));
    }

    /// The first scene, or what to tell who comes too early.
    pub fn shared(&self) -> Result<Arc<Shared>, String> {
        self.first.shared()
    }

    /// The scene for a new session, or what to tell who comes too early, or too late. May read the folder where a scene is named.
    pub fn open(&self, name: Option<&str>, within: &Within) -> Result<Arc<Shared>, NotOpen> {
        if self.drains.load(Ordering::SeqCst) {
            return Err(NotOpen::for_now(DRAINING.to_owned()));
        }
        let (name, within) = match self.meant(name, within)? {
            Meant::First(first) => return Ok(first),
            Meant::Other(name, within) => (name, within),
        };
        match self.shelf.get() {
            Some(shelf) => shelf.open(&name, &within),
            None if !within.is_nothing() => {
                Err(NotOpen::for_ever("nothing can be chosen within the scene here".to_owned()))
            }
            None => Err(NotOpen::for_ever(format!("there is one scene here, and it is not called {name:?}"))),
        }
    }

    fn meant(&self, name: Option<&str>, within: &Within) -> Result<Meant, NotOpen> {
        if let Some(name) = name.filter(|name| !self.is_first(name)) {
            return Ok(Meant::Other(name.to_owned(), within.clone()));
        }
        let first = self.shared().map_err(NotOpen::for_now)?;
        let within = self.within_first(&first, within).map_err(NotOpen::for_ever)?;
        Ok(if within.is_nothing() { Meant::First(first) } else { Meant::Other(self.name_of_first(&first), within) })
    }

    /// What is chosen within the first scene's file; nothing where that is what is shown anyway.
    fn within_first(&self, first: &Shared, within: &Within) -> Result<Within, String> {
        let within = within.resolved(&first.scene.offer)?;
        let own = self.shelf.get().map(|shelf| shelf.stock().first_within()).unwrap_or_default();
        let own = own.resolved(&first.scene.offer).unwrap_or_default();
        let chosen = within.or(&own);
        Ok(if chosen == own { Within::default() } else { chosen })
    }

    fn is_first(&self, name: &str) -> bool {
        match self.first_name.get() {
            Some(first) => first == name,
            None => self.shared().is_ok_and(|shared| shared.scene.name == name),
        }
    }

    /// Whether there may be scenes beside the first.
    pub fn has_others(&self) -> bool {
        self.shelf.get().is_some_and(|shelf| shelf.stock().has_others())
    }

    /// Every scene that is open, the first one first, by the name that it is asked for by.
    pub fn open_ones(&self) -> Vec<(String, Arc<Shared>)> {
        let first = self.shared().ok().map(|shared| (self.name_of_first(&shared), shared));
        let others = self.shelf.get().into_iter().flat_map(|shelf| shelf.open_ones());
        first.into_iter().chain(others).collect()
    }

    fn name_of_first(&self, shared: &Shared) -> String {
        self.first_name.get().unwrap_or(&shared.scene.name).clone()
    }

    /// All scenes that anybody may choose, as JSON: the first one first, then those of the folder, which it reads; and what may be brought.
    pub fn list(&self) -> serde_json::Value {
        let open = self.open_ones();
        let first = self.shared().ok().map(|shared| self.name_of_first(&shared));
        let of_folder = self.shelf.get().map(|shelf| shelf.stock().names()).unwrap_or_default();
        let others = of_folder.into_iter().filter(|name| Some(name) != first.as_ref());
        let listed = |name: &String| {
            let of_file: Vec<_> = open.iter().filter(|(of, _)| file_of(of) == name).map(|(_, shared)| shared).collect();
            serde_json::json!({
                "name": name,
                "open": !of_file.is_empty(),
                "sessions": of_file.iter().map(|shared| shared.session_count()).sum::<usize>(),
                "bytes": of_file.first().map(|_| of_file.iter().map(|shared| shared.scene.bytes()).sum::<u64>()),
                "thumbnail": self.thumbnail(name).is_some(),
            })
        };
        let scenes: Vec<_> = first.iter().cloned().chain(others).map(|name| listed(&name)).collect();
        let uploads = self.uploads().map(|uploads| serde_json::json!({ "bytes": uploads.most_bytes() }));
        serde_json::json!({ "scenes": scenes, "uploads": uploads })
    }

    /// What may be chosen within the file of a scene that is open, and what its cameras see, as JSON; `None` where it is not.
    pub fn offered(&self, name: Option<&str>, within: &Within) -> Option<serde_json::Value> {
        let shared = self.shown(name, within)?;
        let scene = &shared.scene;
        let camera = |(name, camera): (&String, &SceneCamera)| {
            let target = camera.eye_world + camera.forward_world * scene.bounds.radius_m();
            serde_json::json!({
                "name": name,
                "eye": camera.eye_world.to_array(),
                "target": target.to_array(),
                "fov_deg": camera.fov_y_rad.to_degrees(),
            })
        };
        // Only where another one can be loaded.
        let others = |names: &[String]| if self.shelf.get().is_some() { names.to_vec() } else { Vec::new() };
        Some(serde_json::json!({
            "scenes": others(&scene.offer.scenes),
            "shown_scene": scene.offer.shown_scene,
            "variants": others(&scene.offer.variants),
            "cameras": scene.offer.cameras.iter().zip(&scene.cameras).map(camera).collect::<Vec<_>>(),
        }))
    }

    /// A scene that is shown now.
    fn shown(&self, name: Option<&str>, within: &Within) -> Option<Arc<Shared>> {
        match self.meant(name, within).ok()? {
            Meant::First(first) => Some(first),
            Meant::Other(name, within) => self.shelf.get()?.peek(&name, &within),
        }
    }

    /// A small picture of a scene that is or was open, a JPEG.
    pub fn thumbnail(&self, name: &str) -> Option<Bytes> {
        if self.is_first(name) {
            return self.shared().ok()?.thumbnail.clone();
        }
        self.shelf.get()?.thumbnail(name)
    }

    /// Where people bring files of their own; `None` where they may not.
    pub fn uploads(&self) -> Option<Arc<Uploads>> {
        self.shelf.get()?.stock().uploads().cloned()
    }

    /// Waits until the first scene can be drawn no more, and says why.
    pub async fn failed(&self) -> String {
        self.first.failed().await
    }
}

/// What is said once nobody is let in any more.
pub(crate) const DRAINING: &str = "draining: the server stops";
