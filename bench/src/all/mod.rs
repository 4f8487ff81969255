//! `vantage-report all`: every run of docs/papers.md, of one commit, piece by piece.
//!
//! [`pieces()`] is the list. Each piece is a process of its own and has a folder of its own, DIR/COMMIT/PIECE ([`folder`]); what is
//! finished there is not run again, so that an interrupted run goes on where it stopped ([`walk`]). A page shows them all
//! ([`page`]), those too that are yet to be run.

pub mod folder;
pub mod page;
pub mod pieces;
pub mod walk;

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};
use clap::Args;

use crate::report::kept::Source;
use crate::report::machine::COMMIT_VARIABLE;
use folder::Folder;
use pieces::{Piece, pieces};

/// Every run of docs/papers.md, piece by piece; a piece that is finished is not run again. Writes DIR/COMMIT/index.html and bars.md after
/// each of them.
#[derive(Args)]
pub struct AllArgs {
    /// Where the folder of the commit goes.
    #[arg(long, value_name = "DIR", default_value = "target/report/all")]
    pub out: PathBuf,
    /// Each topic at its quick setting, to try the whole way through; in a folder of its own.
    #[arg(long)]
    pub quick: bool,
    /// Only the pieces whose name or topic holds one of these words; may be given several times.
    #[arg(long, value_name = "WORD")]
    pub only: Vec<String>,
    /// Only prints the pieces with their commands.
    #[arg(long)]
    pub list: bool,
}

/// Runs what was asked for; an error where a piece failed.
pub fn all(args: &AllArgs) -> anyhow::Result<()> {
    let pieces = pieces(args.quick);
    let is_chosen = |piece: &&Piece| {
        args.only.is_empty() || args.only.iter().any(|word| piece.name.contains(word) || piece.topic().contains(word))
    };
    let chosen: Vec<&Piece> = pieces.iter().filter(is_chosen).collect();
    ensure!(!chosen.is_empty(), "no piece is named so; --list prints them");
    if args.list {
        for piece in chosen {
            println!("{:36} cargo xtask report {}", piece.name, piece.command);
        }
        return Ok(());
    }
    let source = Source::now()?;
    let name = folder::short(&source.commit) + if args.quick { "-quick" } else { "" };
    let folder = Folder { path: args.out.join(name), source };
    let program = copy_of_this_program(&folder.path)?;
    let assets = std::env::var_os("VANTAGE_ASSETS").map(PathBuf::from);
    walk::walk(&folder, &pieces, &chosen, |piece, out| {
        if piece.needs_assets() && assets.is_none() {
            return Ok(None);
        }
        let mut command = Command::new(&program);
        command.args(piece.arguments(assets.as_deref().unwrap_or(Path::new("")))?).arg("--out").arg(out);
        command.env(COMMIT_VARIABLE, &folder.source.commit);
        Ok(Some(command))
    })
}

/// A copy that stays as it is while others build; the program that made a folder's figures lies beside them.
fn copy_of_this_program(folder: &Path) -> anyhow::Result<PathBuf> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let copy = folder.join("vantage-report").with_extension(std::env::consts::EXE_EXTENSION);
    let this = std::env::current_exe().context("the path of this program")?;
    // Another run may go on by the copy that is there: it keeps it, as only the name is given to the new one.
    let new = folder.join(format!("vantage-report-{}", std::process::id()));
    std::fs::copy(&this, &new)
        .and_then(|_| std::fs::rename(&new, &copy))
        .with_context(|| copy.display().to_string())?;
    std::path::absolute(&copy).with_context(|| copy.display().to_string())
}
