//! `servosim new`: writes a commented scenario to start from.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;

use super::output::{print, printable};
use super::{CliError, Outcome};

/// What is written; `{file}` stands for the file's name.
const STARTER: &str = include_str!("starter.toml");

/// Arguments of `servosim new`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  servosim new bracket        writes bracket.toml")]
pub(crate) struct NewArgs {
    /// Name of the scenario; the file is NAME.toml
    name: String,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
}

/// Writes the file.
pub(crate) fn run(args: &NewArgs) -> Result<Outcome, CliError> {
    let path = file_of(&args.name)?;
    let shown = printable(&path.display().to_string());
    let text = STARTER.replace("{file}", &shown.replace('\n', "\u{fffd}"));
    let mut options = OpenOptions::new();
    options.write(true);
    if args.force {
        options.create(true).truncate(true)
    } else {
        options.create_new(true)
    };
    let written = options.open(&path).and_then(|mut file| file.write_all(text.as_bytes()));
    match written {
        Ok(()) => {
            print(&format!("wrote {shown}; next: servosim run {shown}\n"))?;
            Ok(Outcome::Fine)
        }
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(CliError::Usage(format!(
            "{shown} exists already and is left as it is\nhelp: take another name, or replace the file with --force"
        ))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Err(CliError::Usage(format!("the folder of {shown} does not exist\nhelp: make it first with mkdir")))
        }
        Err(source) => Err(CliError::Write { path, source }),
    }
}

/// The file of a scenario's name, `.toml` appended where it is missing.
fn file_of(name: &str) -> Result<PathBuf, CliError> {
    let is_bad = |file: &str| {
        let stem = file.strip_suffix(".toml").unwrap_or(file).trim();
        stem.is_empty() || stem == "." || stem == ".." || file.chars().any(char::is_control)
    };
    let last = Path::new(name).file_name().map(|file| file.to_string_lossy().into_owned());
    match last {
        Some(file) if !is_bad(&file) && !name.ends_with(['/', '\\']) => {
            let suffix =
                if Path::new(name).extension().is_some_and(|extension| extension == "toml") { "" } else { ".toml" };
            Ok(PathBuf::from(format!("{name}{suffix}")))
        }
        _ => Err(CliError::Usage(format!(
            "`{}` is no name for a scenario\nhelp: give a name such as bracket, or a path such as parts/bracket",
            printable(name).replace('\n', " ")
        ))),
    }
}
