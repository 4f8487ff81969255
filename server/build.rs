//! Puts the built web client into the server, where `VANTAGE_EMBEDDED_WEB` names its folder (`cargo xtask package` does). Without it the server has no page
//! of its own.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=VANTAGE_EMBEDDED_WEB");
    let mut files = Vec::new();
    if let Some(folder) = env::var_os("VANTAGE_EMBEDDED_WEB").filter(|folder| !folder.is_empty()) {
        let folder = PathBuf::from(folder).canonicalize()?;
        println!("cargo:rerun-if-changed={}", folder.display());
        list(&folder, "", &mut files)?;
        files.sort();
    }
    let entry = |(path, file): &(String, PathBuf)| format!("    ({path:?}, include_bytes!({file:?})),\n");
    let table = format!("&[\n{}]\n", files.iter().map(entry).collect::<String>());
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo tells"));
    fs::write(out.join("page.rs"), table)
}

/// All files below a folder: as a page names them, and where they are.
fn list(folder: &Path, prefix: &str, files: &mut Vec<(String, PathBuf)>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            list(&entry.path(), &format!("{name}/"), files)?;
        } else {
            files.push((name, entry.path()));
        }
    }
    Ok(())
}
