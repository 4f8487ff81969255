//! Scripts that drive browsers (`tests/browser`), with what they need beside them.

use std::ffi::OsString;
use std::path::Path;

use crate::run::{Profile, Tool, built, step};
use crate::setup::{self, Need};
use crate::web;

/// A script of `tests/browser`, whose head says what arguments it takes.
pub struct Script {
    file: &'static str,
    /// The package and the binary that it starts, and the variable that names that.
    package: &'static str,
    binary: &'static str,
    variable: &'static str,
    says: &'static str,
}

/// How often a page shows a picture while somebody walks, beside a server on this machine.
pub const FRAMES: Script = Script {
    file: "frames.mjs",
    package: "vantage-server",
    binary: "vantage-server",
    variable: "VANTAGE_SERVER_BIN",
    says: "Walking",
};

/// The cases of report `stability` in browsers.
pub const STIFF: Script = Script {
    file: "stiff.mjs",
    package: "vantage-bench",
    binary: "vantage-report",
    variable: "VANTAGE_REPORT_BIN",
    says: "Showing the cases of stability",
};

impl Script {
    /// Sets up what is missing, and runs it.
    pub fn run(&self, arguments: &[OsString]) -> anyhow::Result<()> {
        setup::install(Need::USUAL)?;
        let binary = built(Profile::Release, self.package, self.binary)?;
        let web_dir = std::path::absolute(web::build(web::Profile::Release)?)?;
        let scripts = Path::new("tests/browser");
        Tool::new("npm").args(["ci", "--no-audit", "--no-fund", "--silent"]).dir(scripts).check()?;
        step(self.says);
        Tool::new("node")
            .args([self.file])
            .args(arguments)
            .dir(scripts)
            .env(self.variable, binary)
            .env("VANTAGE_WEB_DIR", web_dir)
            .check()
    }
}
