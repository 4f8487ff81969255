//! What a program is told, from four places: its command line, else its environment, else a file, else defaults.
//!
//! There is one list of options, that of the command line. From it follow the names of the others: `--max-clients` is `VANTAGE_MAX_CLIENTS` in the environment
//! and `max-clients` in the file, which is TOML. What takes several values is a list there, and parted by commas in the environment.

mod error;
mod file;
mod names;

use std::ffi::OsString;
use std::fmt::Write;
use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command, CommandFactory, FromArgMatches};

pub use error::SettingsError;
use file::{Entry, File};
use names::{CONFIG, is_setting, name, told_by_environment};

/// What a program is told, and by what.
pub struct Settings<T> {
    /// All options.
    pub options: T,
    command: Command,
    matches: ArgMatches,
    /// Options that are as the file says, with the places there.
    of_file: Vec<(String, String)>,
}

/// Reads all four. `arguments` begin with the program's name.
pub fn read<T: CommandFactory + FromArgMatches>(
    arguments: impl IntoIterator<Item = impl Into<OsString>>,
) -> Result<Settings<T>, SettingsError> {
    let mut arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let command =
        T::command().mut_args(told_by_environment).mut_subcommands(|command| command.mut_args(told_by_environment));
    // Whatever is wrong is said when all is read once more.
    let told = command.clone().ignore_errors(true).try_get_matches_from(&arguments)?;
    // A subcommand has settings of its own, after its name.
    let (of, told, place) = match told.subcommand() {
        None => (&command, &told, 1),
        Some((name, told)) => {
            let named = arguments.iter().position(|argument| argument == name).unwrap_or(0);
            (command.find_subcommand(name).unwrap_or(&command), told, named + 1)
        }
    };
    let path = told.try_get_one::<PathBuf>(CONFIG).ok().flatten();
    let file = path.map(|path| File::read(path, of)).transpose()?.unwrap_or_default();
    let is_weaker = |entry: &&Entry| matches!(told.value_source(&entry.id), None | Some(ValueSource::DefaultValue));
    let entries: Vec<&Entry> = file.entries.iter().filter(is_weaker).collect();
    arguments.splice(place..place, entries.iter().flat_map(|entry| entry.arguments.iter().cloned()));
    let mut matches = command.clone().try_get_matches_from(arguments).map_err(|error| file.blame(error, &entries))?;
    let of_file = entries.iter().map(|entry| (entry.id.clone(), file.place(entry.line))).collect();
    let options = T::from_arg_matches_mut(&mut matches.clone())?;
    let of = of.clone();
    let matches = matches.remove_subcommand().map_or(matches, |(_, of_subcommand)| of_subcommand);
    Ok(Settings { options, command: of, matches, of_file })
}

impl<T> Settings<T> {
    /// All that holds, as a file that would say the same, with where it is from. Secrets are left out.
    pub fn print(&self) -> String {
        let mut text = String::new();
        for arg in self.command.get_arguments().filter(|arg| is_setting(arg)) {
            let (name, source) = (name(arg), self.source(arg));
            let line = match self.value(arg) {
                None => format!("# {name} is not set"),
                Some(_) if arg.is_hide_env_values_set() => format!("# {name} is set and secret: {source}"),
                Some(value) => format!("{name} = {value} # {source}"),
            };
            writeln!(text, "{line}").expect("a string takes all");
        }
        text
    }

    fn source(&self, arg: &Arg) -> String {
        let id = arg.get_id().as_str();
        if let Some((_, place)) = self.of_file.iter().find(|(of_file, _)| of_file == id) {
            return place.clone();
        }
        match self.matches.value_source(id) {
            Some(ValueSource::CommandLine) => "command line".to_owned(),
            Some(ValueSource::EnvVariable) => {
                arg.get_env().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
            }
            _ => "default".to_owned(),
        }
    }

    /// As TOML; `None` where there is none.
    fn value(&self, arg: &Arg) -> Option<String> {
        let id = arg.get_id().as_str();
        if !arg.get_action().takes_values() {
            return Some(self.matches.get_flag(id).to_string());
        }
        let raw = self.matches.try_get_raw(id).ok().flatten()?;
        let written = |value: &std::ffi::OsStr| file::written(arg, &value.to_string_lossy());
        let mut values = raw.map(written);
        match arg.get_action() {
            ArgAction::Append => Some(format!("[{}]", values.collect::<Vec<_>>().join(", "))),
            _ => values.next(),
        }
    }
}

#[cfg(test)]
mod tests;
