use std::path::PathBuf;

use clap::Parser;

use super::*;

#[derive(Debug, Clone, PartialEq, Parser)]
struct Told {
    scene: Option<String>,
    #[arg(long, default_value_t = 80)]
    port: u16,
    #[arg(long, default_value_t = 10.0)]
    update_hz: f64,
    #[arg(long, hide_env_values = true)]
    token: Option<String>,
    #[arg(long)]
    self_signed: bool,
    #[arg(long, conflicts_with = "self_signed", requires = "key")]
    cert: Option<PathBuf>,
    #[arg(long)]
    key: Option<PathBuf>,
    #[arg(long)]
    allow: Vec<String>,
    #[arg(long = "config")]
    config_file: Option<PathBuf>,
    #[arg(long)]
    print_config: bool,
}

#[derive(Debug, Parser)]
#[command(args_conflicts_with_subcommands = true)]
struct Either {
    #[arg(long, default_value_t = 80)]
    port: u16,
    #[command(subcommand)]
    other: Option<Other>,
}

#[derive(Debug, PartialEq, clap::Subcommand)]
enum Other {
    Relay {
        #[arg(long)]
        subscribe: String,
        #[arg(long, default_value_t = 80)]
        port: u16,
        #[arg(long = "config")]
        config_file: Option<PathBuf>,
    },
}

/// A file of its own for each test.
fn file(name: &str, text: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("vantage-settings-{}-{name}.toml", std::process::id()));
    std::fs::write(&path, text).expect("a file");
    path
}

fn told(path: &std::path::Path, line: &str) -> Result<Settings<Told>, SettingsError> {
    let config = format!("--config={}", path.display());
    read(["program", &config].into_iter().chain(line.split_whitespace()))
}

#[test]
fn the_command_line_is_stronger_than_the_file_and_that_than_defaults() {
    let path = file(
        "order",
        "# a comment\nscene = \"a.glb\"\nport = 8_081\nupdate-hz = 5\nself-signed = true\nallow = [\"a\", \"b\"]\n",
    );
    let settings = told(&path, "--port 90 --allow c").expect("sound");
    let Told { scene, port, update_hz, self_signed, allow, .. } = settings.options.clone();
    assert_eq!((scene.as_deref(), port, update_hz, self_signed), (Some("a.glb"), 90, 5.0, true));
    assert_eq!(allow, ["c"]);
    let other = told(&path, "b.obj").expect("sound").options;
    assert_eq!((other.scene.as_deref(), other.port), (Some("b.obj"), 8081));
    assert_eq!(other.allow, ["a", "b"]);
    std::fs::remove_file(path).expect("removed");
}

#[test]
fn what_is_wrong_in_a_file_is_named_with_its_place() {
    for (number, (text, line, says)) in [
        ("\n\nprot = 1\n", 3, "no setting \"prot\""),
        ("port = \"80\"\n", 1, "port: a whole number is needed, not a string"),
        ("port = 1.5\n", 1, "port: a whole number is needed, not a number"),
        ("port = 70000\n", 1, "port: invalid value '70000'"),
        ("\nscene = 3\n", 2, "scene: a string in quotes is needed, not a whole number"),
        ("self-signed = 1\n", 1, "self-signed: true or false is needed"),
        ("allow = [1]\n", 1, "allow: a string"),
        ("token = [\"a\"]\n", 1, "token: a string in quotes is needed, not a list"),
        ("port = 1\nport = 2\n", 2, "duplicate"),
        ("print-config = true\n", 1, "no setting \"print-config\""),
        ("port = \n", 1, ""),
        ("cert = \"a\"\nkey = \"b\"\nself-signed = true\n", 1, "cannot be used with"),
    ]
    .into_iter()
    .enumerate()
    {
        let path = file(&format!("wrong-{number}"), text);
        let error = told(&path, "").err().expect(text).to_string();
        let place = format!("{}:", path.display());
        assert!(error.starts_with(&place) && error.contains(says), "{text:?}: {error}");
        let at: usize = error[place.len()..].split(':').next().expect("a line").parse().expect("a line");
        // Of two that do not go together either may be named.
        assert!(at == line || says.starts_with("cannot"), "{text:?}: {error}");
        std::fs::remove_file(path).expect("removed");
    }
    assert!(matches!(told(std::path::Path::new("/nowhere.toml"), ""), Err(SettingsError::Unreadable { .. })));
}

#[test]
fn what_holds_is_printed_as_a_file_that_says_the_same() {
    let path = file("print", "scene = \"a \\\"b\\\".glb\"\ntoken = \"secret\"\nallow = [\"a\"]\n");
    let settings = told(&path, "--update-hz 2.5").expect("sound");
    let printed = settings.print();
    assert!(!printed.contains("\"secret\""), "{printed}");
    for line in [
        format!("scene = \"a \\\"b\\\".glb\" # {}:1", path.display()),
        "port = 80 # default".to_owned(),
        "update-hz = 2.5 # command line".to_owned(),
        format!("# token is set and secret: {}:2", path.display()),
        "# cert is not set".to_owned(),
    ] {
        assert!(printed.lines().any(|printed| printed == line), "{line} in\n{printed}");
    }
    let again = file("print-again", &printed);
    let same = Told { token: Some("secret".to_owned()), ..told(&again, "--token secret").expect("sound").options };
    assert_eq!(Told { config_file: None, ..same }, Told { config_file: None, ..settings.options });
    for path in [path, again] {
        std::fs::remove_file(path).expect("removed");
    }
}

#[test]
fn every_setting_has_a_variable() {
    let command = Told::command().mut_args(told_by_environment);
    let variable = |id: &str| {
        let arg = command.get_arguments().find(|arg| arg.get_id() == id).expect(id);
        arg.get_env().map(|name| name.to_string_lossy().into_owned())
    };
    assert_eq!(variable("update_hz").as_deref(), Some("VANTAGE_UPDATE_HZ"));
    assert_eq!(variable("scene").as_deref(), Some("VANTAGE_SCENE"));
    assert_eq!(variable("print_config"), None);
}

#[test]
fn a_subcommand_has_settings_of_its_own() {
    let path = file("relay", "subscribe = \"nats://a\"\nport = 81\n");
    let told = |line: &str| {
        let config = format!("--config={}", path.display());
        read::<Either>(["program", "relay", &config].into_iter().chain(line.split_whitespace()))
    };
    let settings = told("").expect("sound");
    let Some(Other::Relay { subscribe, port, .. }) = &settings.options.other else { panic!("no relay") };
    assert_eq!((subscribe.as_str(), *port, settings.options.port), ("nats://a", 81, 80));
    let printed = settings.print();
    assert!(printed.contains(&format!("subscribe = \"nats://a\" # {}:1\n", path.display())), "{printed}");
    let settings = told("--port 82").expect("sound");
    assert!(matches!(settings.options.other, Some(Other::Relay { port: 82, .. })), "the command line is stronger");
    std::fs::write(&path, "subscribe = \"nats://a\"\nscene = \"pillars\"\n").expect("a file");
    let error = told("").err().expect("a server's").to_string();
    assert!(error.starts_with(&format!("{}:2: there is no setting \"scene\"", path.display())), "{error}");
    std::fs::remove_file(path).expect("removed");
}
