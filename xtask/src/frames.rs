//! `cargo xtask frames`: how often a page shows a picture while somebody walks, beside a server on this machine.

use std::ffi::OsString;
use std::path::Path;

use crate::run::{Tool, cargo, step, target_dir};
use crate::setup::{self, Need};
use crate::web;

/// Sets up what is missing, and runs the script with `arguments` (`tests/browser/frames.mjs` lists them).
pub fn frames(arguments: &[OsString]) -> anyhow::Result<()> {
    setup::install(Need::USUAL)?;
    step("Building the server (release)");
    cargo().args(["build", "--release", "--package", "vantage-server", "--bin", "vantage-server"]).check()?;
    let web_dir = std::path::absolute(web::build(web::Profile::Release)?)?;
    let scripts = Path::new("tests/browser");
    Tool::new("npm").args(["ci", "--no-audit", "--no-fund", "--silent"]).dir(scripts).check()?;
    step("Walking");
    Tool::new("node")
        .args(["frames.mjs"])
        .args(arguments)
        .dir(scripts)
        .env("VANTAGE_SERVER_BIN", std::path::absolute(target_dir().join("release").join("vantage-server"))?)
        .env("VANTAGE_WEB_DIR", web_dir)
        .check()
}
