//! How long the device works at what is submitted.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use gpu::Gpu;
use web_time::Instant;

/// What was submitted and done since it was last asked, in its order, and how long the device took.
#[derive(Debug, Clone)]
pub(crate) struct DeviceTimes<T>(Arc<Mutex<Vec<(T, Duration)>>>);

impl<T> Default for DeviceTimes<T> {
    fn default() -> DeviceTimes<T> {
        DeviceTimes(Arc::default())
    }
}

impl<T: Send + 'static> DeviceTimes<T> {
    /// Something was submitted just now.
    pub(crate) fn submitted(&self, gpu: &Gpu, what: T) {
        let (begin, times) = (Instant::now(), DeviceTimes(Arc::clone(&self.0)));
        gpu.queue.on_submitted_work_done(move || times.add(what, begin.elapsed()));
    }

    /// Something took so long.
    pub(crate) fn add(&self, what: T, time: Duration) {
        self.lock().push((what, time));
    }

    pub(crate) fn take(&self) -> Vec<(T, Duration)> {
        std::mem::take(&mut self.lock())
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(T, Duration)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
