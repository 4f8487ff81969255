//! What the end-to-end tests share: the whole system on loopback, golden images, and where test data outside of the
//! repository lies.

pub mod golden;
pub mod system;

use std::path::PathBuf;

/// A file of the test data outside of the repository; `None` where `VANTAGE_ASSETS` is not set.
pub fn asset(path: &str) -> Option<PathBuf> {
    std::env::var_os("VANTAGE_ASSETS").map(|root| PathBuf::from(root).join(path))
}
