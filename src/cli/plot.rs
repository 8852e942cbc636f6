//! `servosim plot`: plots of recordings, one or several laid over each other.

use std::path::{Path, PathBuf};

use crate::report::{self, RunData};
use crate::run::recorded;
use clap::{Args, ValueEnum};

use super::output::{make_folder, note, wrote};
use super::{CliError, Outcome};

/// Most runs that one plot takes.
const MOST_RUNS: usize = 16;

/// Arguments of `servosim plot`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim plot output/alpha.mcap                     plots of one run
  servosim plot before/alpha.mcap after/alpha.mcap    two runs laid over each other
  servosim plot alpha heart --format png              output/alpha.mcap, output/heart.mcap")]
pub(crate) struct PlotArgs {
    /// Recordings: files, or names of recordings in the folder output
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Folder for the plots; created if it is missing
    #[arg(long, value_name = "DIR", default_value = "output")]
    output: PathBuf,
    /// Format of the plots
    #[arg(long, value_enum, default_value = "svg")]
    format: Format,
    /// Prefix of the plots' file names [default: the runs' names]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Do not list the files that were written
    #[arg(long, short)]
    quiet: bool,
}

/// Format of plots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    Svg,
    Png,
}

impl From<Format> for report::Format {
    fn from(format: Format) -> Self {
        match format {
            Format::Svg => Self::Svg,
            Format::Png => Self::Png,
        }
    }
}

/// Draws the plots.
pub(crate) fn run(args: &PlotArgs) -> Result<Outcome, CliError> {
    let count = args.recordings.len();
    if count > MOST_RUNS {
        return Err(CliError::Usage(format!("{count} recordings are too many for one plot: at most {MOST_RUNS}")));
    }
    let files: Vec<PathBuf> = args.recordings.iter().map(|name| find(name)).collect();
    let mut runs = files.iter().map(|file| recorded(file, None)).collect::<Result<Vec<_>, _>>()?;
    let stem = match &args.name {
        Some(name) => name.clone(),
        None => runs.iter().map(|run| run.metadata().name.as_str()).take(4).collect::<Vec<_>>().join("-vs-"),
    };
    tell_apart(&mut runs, &files);
    make_folder(&args.output)?;
    let written = report::write_all(&runs, &args.output, &stem, args.format.into())?;
    if !args.quiet {
        note(&wrote(&written));
    }
    Ok(Outcome::Fine)
}

/// The recording that is meant: a file of that name, else `NAME.mcap`, else `output/NAME.mcap`; the name itself where there
/// is none.
pub(crate) fn find(name: &Path) -> PathBuf {
    let mut with_ending = name.as_os_str().to_owned();
    with_ending.push(".mcap");
    let candidates = [name.to_owned(), with_ending.clone().into(), Path::new("output").join(with_ending)];
    candidates.iter().find(|path| path.is_file()).cloned().unwrap_or_else(|| name.to_owned())
}

/// Runs of the same name get that of their folder in front: `before/alpha` and `after/alpha`.
fn tell_apart(runs: &mut [RunData], files: &[PathBuf]) {
    let names: Vec<String> = runs.iter().map(|run| run.metadata().name.clone()).collect();
    for (i, (run, file)) in runs.iter_mut().zip(files).enumerate() {
        let is_shared = names.iter().enumerate().any(|(j, name)| j != i && *name == run.metadata().name);
        if is_shared && let Some(folder) = file.parent().and_then(Path::file_name) {
            let metadata = run.metadata_mut();
            metadata.name = format!("{}/{}", folder.to_string_lossy(), metadata.name);
        }
    }
}
