//! Completions for shells and manual pages, printed by the commands themselves, so that they fit the version that is installed.

use std::ffi::OsString;
use std::io::{self, Write};
use std::process::ExitCode;

use clap::{Command, ValueEnum};
use clap_complete::Shell;

/// What clap exits with for wrong usage.
const EXIT_USAGE: u8 = 2;

/// Ends what `--help` says.
pub const HELP: &str =
    "--completions bash|elvish|fish|powershell|zsh prints completions for a shell, --manual the manual page.";

/// Prints what this program's arguments ask for of its command, and how it is to end then; `None` where they ask for nothing.
pub fn answered(command: Command) -> Option<ExitCode> {
    match print_asked(std::env::args_os(), command, &mut io::stdout()) {
        Ok(false) => None,
        Ok(true) => Some(ExitCode::SUCCESS),
        Err(error) => {
            eprintln!("error: {error}");
            Some(ExitCode::from(EXIT_USAGE))
        }
    }
}

/// Prints what arguments ask for of a command, the program's name first; whether they ask for anything. They must be alone.
///
/// # Errors
/// What writing fails with, and a shell that nobody knows.
fn print_asked(
    arguments: impl IntoIterator<Item = OsString>,
    command: Command,
    out: &mut dyn Write,
) -> io::Result<bool> {
    let asked: Vec<OsString> = arguments.into_iter().skip(1).collect();
    let asked: Option<Vec<&str>> = asked.iter().map(|argument| argument.to_str()).collect();
    match asked.as_deref() {
        Some(["--manual"]) => clap_mangen::Man::new(command).render(out).map(|()| true),
        Some(["--completions", shell]) => {
            let shell = Shell::from_str(shell, true).map_err(|why| io::Error::new(io::ErrorKind::InvalidInput, why))?;
            let name = command.get_name().to_owned();
            clap_complete::generate(shell, &mut { command }, name, out);
            Ok(true)
        }
        _ => Ok(false),
    }
}

#[cfg(test)]
mod tests {
    use clap::Arg;

    use super::*;

    fn printed(arguments: &[&str]) -> io::Result<Option<String>> {
        let command = Command::new("tool").about("Does it").arg(Arg::new("deep").long("deep").help("All the way"));
        let mut out = Vec::new();
        let asked = print_asked(arguments.iter().map(OsString::from), command, &mut out)?;
        Ok(asked.then(|| String::from_utf8(out).expect("text")))
    }

    #[test]
    fn completions_and_manual_name_what_there_is() {
        for shell in ["bash", "zsh", "fish"] {
            let text = printed(&["tool", "--completions", shell]).expect("a shell").expect("asked for");
            assert!(text.contains("deep"), "{shell}: {text}");
        }
        let manual = printed(&["tool", "--manual"]).expect("a page").expect("asked for");
        assert!(manual.contains(".TH tool 1") && manual.contains("All the way"), "{manual}");
        assert_eq!(printed(&["tool", "--deep", "--manual"]).expect("no"), None, "they are alone");
        assert!(printed(&["tool", "--completions", "cmd"]).unwrap_err().to_string().contains("cmd"));
    }
}
