//! How environment and file name an option.

use clap::builder::BoolishValueParser;
use clap::{Arg, ArgAction};

/// Names the file.
pub(super) const CONFIG: &str = "config_file";
/// What only a command line can ask for.
const ACTIONS: [&str; 6] = ["help", "version", "list", "list_gpus", "print_config", CONFIG];

/// Whether an option may be told by environment and file.
pub(super) fn is_setting(arg: &Arg) -> bool {
    !ACTIONS.contains(&arg.get_id().as_str())
}

/// As the file names it: by its long name, or that of a place on the command line.
pub(super) fn name(arg: &Arg) -> &str {
    arg.get_long().unwrap_or(arg.get_id().as_str())
}

/// An option that the environment may tell, too.
pub(super) fn told_by_environment(arg: Arg) -> Arg {
    if !is_setting(&arg) {
        return arg;
    }
    let variable = format!("VANTAGE_{}", name(&arg).replace('-', "_").to_uppercase());
    let arg = arg.env(variable);
    match arg.get_action() {
        ArgAction::SetTrue => arg.value_parser(BoolishValueParser::new()),
        ArgAction::Append => arg.value_delimiter(','),
        _ => arg,
    }
}
