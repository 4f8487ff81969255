//! What sessions leave goes back to the system, and what is kept for others once nobody comes.
//!
//! glibc's allocator keeps what is freed for the next time, in an arena for every few threads: of 506 MiB, sixteen walkers left 361 with the process, of which
//! a trim gives back 288. Other allocators and systems are left alone.

use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use tokio::sync::Notify;

use crate::pool::Pool;

/// After a session ends, others that end with it are waited for.
const SETTLES_AFTER: Duration = Duration::from_secs(2);
/// Little beside the minutes for which anything is kept.
const LOOKS_EVERY: Duration = Duration::from_secs(20);

/// Gives memory back after sessions have ended, as long as it is told of them.
pub async fn give_back_after(ended: Arc<Notify>) {
    loop {
        ended.notified().await;
        tokio::time::sleep(SETTLES_AFTER).await;
        // Arenas are locked one by one meanwhile, for milliseconds.
        if tokio::task::spawn_blocking(trim).await.is_err() {
            return;
        }
    }
}

/// Gives back what a pool keeps that nobody asked for lately, as long as there is the pool.
pub async fn give_back_unasked(pool: Weak<Pool>) {
    let mut looks = tokio::time::interval(LOOKS_EVERY);
    loop {
        looks.tick().await;
        let Some(pool) = pool.upgrade() else { return };
        if pool.forget_unasked(Instant::now()) && tokio::task::spawn_blocking(trim).await.is_err() {
            return;
        }
    }
}

/// The one call that the standard library has no name for.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(unsafe_code, reason = "the allocator is asked by a C function; it takes a number, and any thread may call it")]
fn trim() {
    // SAFETY: malloc_trim(3) is MT-safe and has no preconditions.
    let gave_back = unsafe { libc::malloc_trim(0) } == 1;
    tracing::debug!(gave_back, "memory of sessions that ended");
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn trim() {}
