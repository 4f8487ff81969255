//! What is shipped beside the server, held against the tools that will read it, where those are there.

use std::path::PathBuf;

use anyhow::{Context, ensure};

use crate::package;
use crate::run::{Tool, target_dir};
use crate::setup::on_path;

/// Brings the schemas that manifests are held against, of Kubernetes 1.37.
const SCHEMAS: &str = "kubernetes-validate==1.37.0";

/// What became of a check: `Ok(None)` where it passed, or why it was left out.
type Checked = anyhow::Result<Option<String>>;

/// What is checked, and how.
type Check = (&'static str, fn() -> Checked);

/// All checks.
pub const CHECKS: &[Check] = &[("the systemd unit", unit), ("the manifests", manifests), ("the packaged page", page)];

/// By systemd's own reader, with a program that is there in place of the server.
fn unit() -> Checked {
    if !on_path("systemd-analyze") {
        return Ok(Some("systemd-analyze is not there".to_owned()));
    }
    let folder = target_dir().join("packaging");
    std::fs::create_dir_all(&folder)?;
    let unit = std::fs::read_to_string("packaging/vantage-server.service")?;
    ensure!(unit.contains("ExecStart=/usr/local/bin/vantage-server\n"), "the unit starts another program");
    let copy = folder.join("vantage-server.service");
    std::fs::write(&copy, unit.replace("ExecStart=/usr/local/bin/vantage-server", "ExecStart=/bin/true"))?;
    // It complains about what it does not know, and yet succeeds.
    let mut complains = false;
    let verify = Tool::new("systemd-analyze").args(["verify".as_ref(), copy.as_os_str()]);
    let succeeded = verify.watch(|line| complains |= !line.trim().is_empty())?;
    ensure!(succeeded && !complains, "systemd-analyze verify complains");
    Ok(None)
}

/// By Kubernetes' schemas, from a package of Python's, in an environment of its own.
fn manifests() -> Checked {
    let Some(python) = schemas()? else {
        return Ok(Some(format!("no python3 with venv, or {SCHEMAS} cannot be installed")));
    };
    Tool::new(python).args(["packaging/kubernetes/check.py"]).check()?;
    Ok(None)
}

/// A Python that has them; `None` where there can be none.
fn schemas() -> anyhow::Result<Option<PathBuf>> {
    let folder = target_dir().join("kubernetes-schemas");
    let python = std::path::absolute(folder.join("bin/python"))?;
    let has_them = || Tool::new(&python).args(["-c", "import kubernetes_validate"]).succeeds();
    if has_them() {
        return Ok(Some(python));
    }
    let made = Tool::new("python3").args(["-m".as_ref(), "venv".as_ref(), folder.as_os_str()]).succeeds();
    let installed = made && Tool::new(&python).args(["-m", "pip", "install", "--quiet", SCHEMAS]).succeeds();
    Ok((installed && has_them()).then_some(python))
}

/// As the package serves it.
fn page() -> Checked {
    let server = package::folder().join("vantage-server");
    if !server.is_file() {
        return Ok(Some("there is no package: cargo xtask package".to_owned()));
    }
    package::check_page().with_context(|| server.display().to_string())?;
    Ok(None)
}
