//! Programs of the same build, for measurements of a server in a process of its own.

use std::path::PathBuf;

use anyhow::ensure;

/// The server that was built with this program.
pub fn server() -> anyhow::Result<PathBuf> {
    let this = std::env::current_exe()?;
    // A test lies a folder deeper than what is built for use.
    let folder = this.parent().filter(|folder| folder.ends_with("deps")).unwrap_or(&this);
    let server = folder.with_file_name("vantage-server");
    ensure!(
        server.is_file(),
        "{} is not built: cargo xtask report builds it for topics that need it",
        server.display()
    );
    Ok(server)
}
