//! A file of settings: TOML, whose keys are the names of options.

use std::any::TypeId;
use std::ffi::OsString;
use std::path::Path;

use clap::error::{ContextKind, ContextValue};
use clap::{Arg, ArgAction, Command};
use toml::de::{DeTable, DeValue};

use super::error::SettingsError;
use super::names::{is_setting, name};

/// See the module.
#[derive(Default)]
pub(super) struct File {
    name: String,
    pub(super) entries: Vec<Entry>,
}

/// A key with its value.
pub(super) struct Entry {
    /// The option's.
    pub(super) id: String,
    key: String,
    /// From 1 on.
    pub(super) line: usize,
    /// As a command line says the same.
    pub(super) arguments: Vec<OsString>,
}

impl File {
    pub(super) fn read(path: &Path, command: &Command) -> Result<File, SettingsError> {
        let mut file = File { name: path.display().to_string(), entries: Vec::new() };
        let text = std::fs::read_to_string(path)
            .map_err(|reason| SettingsError::Unreadable { file: file.name.clone(), reason })?;
        let line = |at: usize| 1 + text.bytes().take(at).filter(|&byte| byte == b'\n').count();
        let table = DeTable::parse(&text)
            .map_err(|error| file.wrong(line(error.span().map_or(0, |span| span.start)), error.message()))?;
        for (key, value) in table.get_ref() {
            let (line, key) = (line(key.span().start), key.get_ref());
            let arg = command.get_arguments().filter(|arg| is_setting(arg)).find(|arg| name(arg) == key);
            let arg = arg.ok_or_else(|| {
                file.wrong(line, format!("there is no setting {key:?}; --print-config shows all that there are"))
            })?;
            let arguments =
                arguments(arg, value.get_ref()).map_err(|what| file.wrong(line, format!("{key}: {what}")))?;
            file.entries.push(Entry { id: arg.get_id().to_string(), key: key.to_string(), line, arguments });
        }
        Ok(file)
    }

    /// For people.
    pub(super) fn place(&self, line: usize) -> String {
        format!("{}:{line}", self.name)
    }

    fn wrong(&self, line: usize, message: impl Into<String>) -> SettingsError {
        SettingsError::InFile { place: self.place(line), message: message.into() }
    }

    /// What is wrong with a command line, some of whose options are of this file.
    pub(super) fn blame(&self, error: clap::Error, entries: &[&Entry]) -> SettingsError {
        let of_context = |kind| match error.get(kind) {
            Some(ContextValue::String(option)) => Some(option.clone()),
            Some(ContextValue::Strings(options)) => options.first().cloned(),
            _ => None,
        };
        let named = [ContextKind::InvalidArg, ContextKind::PriorArg].into_iter().filter_map(of_context);
        let of_file = named.filter_map(|option| {
            let name = option.split([' ', '=']).next()?.trim_start_matches("--").to_owned();
            entries.iter().find(|entry| entry.key == name)
        });
        match of_file.into_iter().next() {
            None => error.into(),
            Some(entry) => {
                let text = error.to_string();
                let said = text.split("\n\n").next().unwrap_or(&text).trim_start_matches("error: ");
                self.wrong(entry.line, format!("{}: {said}", entry.key))
            }
        }
    }
}

/// What an option takes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Whole,
    Number,
    Text,
}

impl Kind {
    fn of(arg: &Arg) -> Kind {
        let takes = |kinds: &[TypeId]| kinds.iter().any(|kind| arg.get_value_parser().type_id() == *kind);
        if takes(&[TypeId::of::<u16>(), TypeId::of::<u32>(), TypeId::of::<u64>(), TypeId::of::<usize>()]) {
            Kind::Whole
        } else if takes(&[TypeId::of::<f32>(), TypeId::of::<f64>()]) {
            Kind::Number
        } else {
            Kind::Text
        }
    }
}

/// How a command line says the same; `Err` says what is wrong with the value's type.
fn arguments(arg: &Arg, value: &DeValue<'_>) -> Result<Vec<OsString>, String> {
    let told = |text: String| match arg.get_long() {
        Some(long) => OsString::from(format!("--{long}={text}")),
        None => text.into(),
    };
    match (arg.get_action(), value) {
        (ArgAction::SetTrue, DeValue::Boolean(true)) => Ok(vec![format!("--{}", name(arg)).into()]),
        (ArgAction::SetTrue, DeValue::Boolean(false)) => Ok(Vec::new()),
        (ArgAction::SetTrue, other) => Err(format!("true or false is needed, not {}", called(other))),
        (ArgAction::Append, DeValue::Array(values)) => {
            values.iter().map(|value| text(arg, value.get_ref()).map(told)).collect()
        }
        (_, value) => Ok(vec![told(text(arg, value)?)]),
    }
}

/// A single value as a command line has it.
fn text(arg: &Arg, value: &DeValue<'_>) -> Result<String, String> {
    let (kind, found) = (Kind::of(arg), called(value));
    match (kind, value) {
        (Kind::Whole | Kind::Number, DeValue::Integer(number)) => {
            let whole = i128::from_str_radix(number.as_str(), number.radix());
            whole.map(|whole| whole.to_string()).map_err(|error| error.to_string())
        }
        (Kind::Number, DeValue::Float(number)) => Ok(number.as_str().to_owned()),
        (Kind::Text, DeValue::String(text)) => Ok(text.to_string()),
        (Kind::Whole, _) => Err(format!("a whole number is needed, not {found}")),
        (Kind::Number, _) => Err(format!("a number is needed, not {found}")),
        (Kind::Text, _) => Err(format!("a string in quotes is needed, not {found}")),
    }
}

fn called(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

/// A value of a command line as a file has it.
pub(super) fn written(arg: &Arg, text: &str) -> String {
    let number = match Kind::of(arg) {
        Kind::Text => None,
        Kind::Whole => text.parse::<i128>().ok().map(|whole| whole.to_string()),
        Kind::Number => text.parse::<f64>().ok().map(|number| number.to_string()),
    };
    // JSON's strings are TOML's, too.
    number.unwrap_or_else(|| serde_json::Value::from(text).to_string())
}
