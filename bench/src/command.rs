//! What people type after `vantage-report`.

use std::path::PathBuf;

use clap::Args;

use crate::all::AllArgs;
use crate::beside::BesideArgs;
use crate::render::RenderArgs;
use crate::topic::Topic;
use crate::{options, topics};

/// Scores a folder of frames against their truths, as `vantage-report render` draws them.
#[derive(Args)]
pub struct CompareArgs {
    /// Folder with frame_00000.png and so on, and the viewer's stats.json if there is one.
    #[arg(long, value_name = "DIR")]
    pub frames: PathBuf,
    /// Folder with the truth of each frame under the same name, and covered_00000.png if there is one.
    #[arg(long, value_name = "DIR")]
    pub truth: PathBuf,
    /// Write the figures as JSON, and as CSV beside it.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// Writes the neutral studio that models are lit with where no environment is given, as a Radiance file.
#[derive(Args)]
pub struct StudioArgs {
    /// The file to write.
    #[arg(value_name = "FILE.hdr")]
    pub file: PathBuf,
}

/// What every topic takes.
#[derive(Args)]
pub struct TopicArgs {
    /// A built-in scene or a scene file (glTF, GLB, OBJ, PLY, STL); may be given several times. Default: the topic's own.
    #[arg(long, value_name = "FILE|NAME")]
    pub scene: Vec<String>,
    /// A camera trace, one line `px py pz rx ry rz t_ms` a pose, for topics that follow one; `auto`: one of the topic's own.
    #[arg(long, value_name = "FILE|auto")]
    pub trace: Option<PathBuf>,
    /// Size of the output in pixels. Default: the topic's own.
    #[arg(long, value_name = "WxH", value_parser = options::size)]
    pub size: Option<(u32, u32)>,
    /// Where the files go. Default: target/report/TOPIC.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Fewer runs, for continuous integration; the report says which.
    #[arg(long)]
    pub quick: bool,
}

/// Every command with what it takes.
pub fn command() -> clap::Command {
    let all = AllArgs::augment_args(clap::Command::new("all"));
    let beside = BesideArgs::augment_args(clap::Command::new("beside"));
    let compare = CompareArgs::augment_args(clap::Command::new("compare"));
    let render = RenderArgs::augment_args(clap::Command::new("render"));
    let studio = StudioArgs::augment_args(clap::Command::new("studio"));
    let topic = |topic: &&dyn Topic| {
        let command = topic.arguments(TopicArgs::augment_args(clap::Command::new(topic.name())));
        // What arguments say of themselves is not what the topic is about.
        command.about(topic.about()).long_about(None)
    };
    clap::Command::new("vantage-report")
        .about("Reports with figures, the truth of a scene, and scores of frames.")
        .after_help("Exit code: 0 done, 1 a run could not be made, 2 wrong arguments, 69 no graphics adapter.")
        .version(env!("CARGO_PKG_VERSION"))
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommands(topics::ALL.iter().map(topic))
        .subcommand(all)
        .subcommand(render)
        .subcommand(compare)
        .subcommand(beside)
        .subcommand(studio)
}

#[cfg(test)]
mod tests {
    use super::command;
    use crate::topics;

    #[test]
    fn help_says_what_each_topic_is_about() {
        let command = command();
        for topic in topics::ALL {
            let shown = command.find_subcommand(topic.name()).expect("a subcommand a topic");
            assert_eq!(shown.get_about().map(ToString::to_string).as_deref(), Some(topic.about()));
            assert!(shown.get_long_about().is_none());
        }
    }
}
