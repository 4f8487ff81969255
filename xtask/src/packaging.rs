//! What is shipped beside the server, held against the tools that will read it, where those are there.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};

use crate::package;
use crate::run::{Tool, target_dir};
use crate::setup::on_path;

/// Brings the schemas that manifests are held against, of Kubernetes 1.37.
const SCHEMAS: &str = "kubernetes-validate==1.37.0";

/// Run a notebook with the widget that is for it.
const NOTEBOOK: &[&str] = &["anywidget==0.11.0", "nbclient==0.11.0", "ipykernel==7.4.0"];

/// What became of a check: `Ok(None)` where it passed, or why it was left out.
type Checked = anyhow::Result<Option<String>>;

/// What is checked, and how.
type Check = (&'static str, fn() -> Checked);

/// All checks.
pub const CHECKS: &[Check] = &[
    ("the systemd unit", unit),
    ("the manifests", manifests),
    ("the element's package", element),
    ("the notebook", notebook),
    ("the packaged page", page),
];

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
    let Some(python) = python_with("kubernetes-schemas", "kubernetes_validate", &[SCHEMAS])? else {
        return Ok(Some(format!("no python3 with venv, or {SCHEMAS} cannot be installed")));
    };
    Tool::new(python).args(["packaging/kubernetes/check.py"]).check()?;
    Ok(None)
}

/// The example, run by a kernel of its own.
fn notebook() -> Checked {
    let Some(python) = python_with("notebook", "anywidget, nbclient, ipykernel", NOTEBOOK)? else {
        return Ok(Some(format!("no python3 with venv, or {NOTEBOOK:?} cannot be installed")));
    };
    let path = std::env::var("PATH").unwrap_or_default();
    let beside = python.parent().context("it lies in a folder")?;
    let check = Tool::new(&python).args(["check.py", "example.ipynb"]).dir(&package::notebook()?);
    // Kernels are started by the python that is found first.
    check.env("PATH", format!("{}:{path}", beside.display())).env("PYTHONPATH", ".").check()?;
    Ok(None)
}

/// A Python in an environment of its own that has these modules, of these packages; `None` where there can be none.
fn python_with(environment: &str, modules: &str, packages: &[&str]) -> anyhow::Result<Option<PathBuf>> {
    let folder = target_dir().join(environment);
    let python = std::path::absolute(folder.join("bin/python"))?;
    let has_them = || Tool::new(&python).args(["-c", &format!("import {modules}")]).succeeds();
    if has_them() {
        return Ok(Some(python));
    }
    let made = Tool::new("python3").args(["-m".as_ref(), "venv".as_ref(), folder.as_os_str()]).succeeds();
    let install = ["-m", "pip", "install", "--quiet"];
    let installed = made && Tool::new(&python).args(install.iter().chain(packages)).succeeds();
    Ok((installed && has_them()).then_some(python))
}

/// By npm and by TypeScript, as who uses it would have it.
fn element() -> Checked {
    if !on_path("npm") {
        return Ok(Some("npm is not there".to_owned()));
    }
    let folder = package::element()?;
    let listed = Tool::new("npm").args(["pack", "--dry-run", "--json"]).dir(&folder).output();
    let listed = listed.context("npm packs it not")?;
    for file in ["vantage-view.js", "vantage-view.d.ts", "example.html", "README.md"] {
        ensure!(listed.contains(&format!("\"{file}\"")), "the package lacks {file}");
    }
    let tests = Path::new("tests/browser");
    Tool::new("npm").args(["ci", "--no-audit", "--no-fund", "--silent"]).dir(tests).check()?;
    Tool::new("npm").args(["exec", "--", "tsc"]).dir(tests).check()?;
    Ok(None)
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
