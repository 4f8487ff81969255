//! A server while it serves, as its operator sees it: a signal stops it or has its scene loaded anew.
//!
//! What is loaded anew is made ready beside what is served, which goes on meanwhile, so for that time the GPU holds both. Where it cannot be loaded, all stays
//! as it is. Scenes of a folder that are open follow one by one.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use tokio::task::JoinHandle;

use crate::app::Running;
use crate::prepare::{PrepareError, Prepared};
use crate::signals::{Asked, Signals};

/// Makes the scene ready once more.
pub type Prepare = Arc<dyn Fn() -> Result<Prepared, PrepareError> + Send + Sync>;

/// Serves until a signal says stop, or no images can be made any more: then `Some` says why.
pub async fn operate(running: &Running, signals: &mut Signals, prepare: Prepare) -> Option<String> {
    let mut loading: Option<JoinHandle<_>> = None;
    // Who asks while it is loaded may have changed it since that began.
    let mut once_more = false;
    loop {
        tokio::select! {
            asked = signals.next() => match asked {
                Asked::Stop => return None,
                Asked::Reload if loading.is_some() => once_more = true,
                Asked::Reload => loading = Some(begin(running, &prepare)),
            },
            failure = running.failed() => return Some(failure),
            loaded = async { loading.as_mut().expect("polled only while there is one").await }, if loading.is_some() => {
                show(running, loaded.map_err(|panic| panic.to_string()).and_then(|loaded| loaded.map_err(|error| error.to_string())));
                loading = std::mem::take(&mut once_more).then(|| begin(running, &prepare));
            }
        }
    }
}

fn begin(running: &Running, prepare: &Prepare) -> JoinHandle<Result<Prepared, PrepareError>> {
    tracing::info!("the scene is being loaded anew");
    running.reload_others();
    running.stats.reloads.fetch_add(1, Ordering::Relaxed);
    let prepare = prepare.clone();
    tokio::task::spawn_blocking(move || prepare())
}

fn show(running: &Running, loaded: Result<Prepared, String>) {
    let shown = loaded.and_then(|prepared| {
        let Prepared { config, scene, imager } = prepared;
        running.show(config, scene, imager).map_err(|error| error.to_string())
    });
    running.stats.reload_failed.store(shown.is_err(), Ordering::Relaxed);
    match shown {
        Ok(()) => tracing::info!("new sessions get the new scene, and old ones are told to come again"),
        Err(why) => tracing::error!("the scene stays as it was: {why}"),
    }
}
