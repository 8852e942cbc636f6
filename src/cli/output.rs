//! What every command that gives metrics takes: where files go and what is printed. Standard output, and numbers for people.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::limits::is_kept;
use crate::recording::{Compression, RecordingOptions};
use crate::report;
use clap::{Args, ValueEnum};
use serde::Serialize;

pub(super) use crate::numbers::{short, significant};

use super::CliError;

/// Where files go, and what is printed.
#[derive(Debug, Args)]
pub(crate) struct OutputArgs {
    /// Folder for all output; created if it is missing
    #[arg(long = "output", value_name = "DIR", default_value = "output")]
    pub(super) folder: PathBuf,
    /// Format of the plots
    #[arg(long, value_enum, default_value = "svg")]
    pub(super) plots: Plots,
    #[command(flatten)]
    pub(super) print: PrintArgs,
}

/// How runs are recorded.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct RecordArgs {
    /// Compression of the recording: LZ4 makes about three quarters of its size
    #[arg(long, value_enum, default_value = "none")]
    compress: Compress,
    /// Record each Nth control period; the metrics know them all, the plots show what was recorded
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
}

/// Compression of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Compress {
    None,
    Lz4,
}

impl RecordArgs {
    pub(super) fn options(self) -> RecordingOptions {
        let compression = match self.compress {
            Compress::None => Compression::None,
            Compress::Lz4 => Compression::Lz4,
        };
        RecordingOptions { compression, every: self.every }
    }
}

/// What is printed.
#[derive(Debug, Args)]
pub(crate) struct PrintArgs {
    /// What to print: a table, or the metrics as one JSON object and nothing else
    #[arg(long, value_enum, default_value = "table")]
    format: Format,
    /// Print no table, progress or notes: only errors, broken limits, and JSON if asked for
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Format of plots, or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Plots {
    Svg,
    Png,
    None,
}

impl Plots {
    pub(crate) fn format(self) -> Option<report::Format> {
        match self {
            Self::Svg => Some(report::Format::Svg),
            Self::Png => Some(report::Format::Png),
            Self::None => None,
        }
    }
}

/// What goes to standard output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    Table,
    Json,
}

impl PrintArgs {
    /// Prints the metrics in the form that was asked for.
    pub(crate) fn show(&self, metrics: &impl Serialize, table: impl FnOnce() -> String) -> Result<(), CliError> {
        match self.format {
            Format::Json => print(&json(metrics)?),
            Format::Table if !self.quiet => print(&table()),
            Format::Table => Ok(()),
        }
    }

    /// Tells the user something on standard error, unless they want no notes.
    pub(crate) fn note(&self, text: &str) {
        if !self.quiet {
            note(text);
        }
    }

    /// Whether there is progress to be shown to a person.
    pub(crate) fn is_watched(&self) -> bool {
        !self.quiet && super::is_watched()
    }

    /// Whether a table is printed.
    pub(crate) fn has_table(&self) -> bool {
        !self.has_no_table()
    }

    /// Whether no table tells a person why the exit code is not 0.
    pub(crate) fn has_no_table(&self) -> bool {
        self.quiet || self.format == Format::Json
    }
}

/// Writes results to standard output. A reader that has gone away (a closed pipe) is no failure.
pub(crate) fn print(text: &str) -> Result<(), CliError> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(CliError::Stdout(error)),
        _ => Ok(()),
    }
}

/// Fields of JSON documents that have had another name: the present one, the former one, which stays beside it.
const FORMER_NAMES: [(&str, &str); 5] = [
    ("metrics", "figures"),
    ("metric", "figure"),
    ("sampled", "drawn"),
    ("modelled", "taken_in"),
    ("neglected", "left_out"),
];

/// A value as an indented JSON document, ending in a newline.
fn json(value: &impl Serialize) -> Result<String, CliError> {
    let failed = |error: serde_json::Error| CliError::Stdout(error.into());
    let mut document = serde_json::to_value(value).map_err(failed)?;
    add_former_names(&mut document);
    let mut text = serde_json::to_string_pretty(&document).map_err(failed)?;
    text.push('\n');
    Ok(text)
}

/// Repeats each renamed field under its former name, so that scripts go on working.
fn add_former_names(value: &mut serde_json::Value) {
    match value {
        serde_json::Value::Object(fields) => {
            fields.values_mut().for_each(add_former_names);
            for (now, former) in FORMER_NAMES {
                if let Some(field) = fields.get(now).cloned() {
                    fields.entry(former).or_insert(field);
                }
            }
        }
        serde_json::Value::Array(items) => items.iter_mut().for_each(add_former_names),
        _ => {}
    }
}

/// Tells the user something on standard error. Nobody is left to be told when that fails.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", printable(text));
}

/// "wrote a, b and c".
pub(crate) fn wrote(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    match names.as_slice() {
        [] => "wrote nothing".to_owned(),
        [one] => format!("wrote {one}"),
        [first @ .., last] => format!("wrote {} and {last}", first.join(", ")),
    }
}

/// Makes the folder that output goes to.
pub(crate) fn make_folder(folder: &Path) -> Result<(), CliError> {
    Ok(crate::run::make_folder(folder)?)
}

/// `text` without control characters (newlines stay): file names may hold any.
pub(crate) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && c != '\n' { '\u{fffd}' } else { c }).collect()
}

/// By how many percent `value` is over `limit`, or how many are left: "over by 12.3 %", "9.9 % to spare".
pub(crate) fn margin(value: f64, limit: f64) -> String {
    let share = 100.0 * (value / limit - 1.0);
    if share.is_infinite() {
        "over without bound".to_owned()
    } else if !is_kept(value, limit) {
        format!("over by {} %", percent(share))
    } else {
        format!("{} % to spare", percent((-share).max(0.0)))
    }
}

/// A share that is not zero is not shown as zero.
pub(crate) fn percent(share: f64) -> String {
    if share == 0.0 {
        "0".to_owned()
    } else if share.abs() < 0.05 {
        format!("{share:.1e}")
    } else {
        format!("{share:.1}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn renamed_fields_stay_under_their_former_names() {
        let mut value =
            serde_json::json!({ "metric": "a", "after": [{ "metrics": { "sampled": 1 }, "modelled": [] }] });
        add_former_names(&mut value);
        let before = &value["after"][0];
        assert_eq!((&value["figure"], &before["figures"]["drawn"]), (&"a".into(), &1.into()));
        assert_eq!((&before["taken_in"], before.get("left_out")), (&serde_json::json!([]), None));
    }

    #[test]
    fn metrics_keep_their_digits() {
        assert_eq!(significant(27.026891, 5), "27.027");
        assert_eq!(significant(49127.2447, 6), "49127.2");
        assert_eq!(significant(0.129867327, 6), "0.129867");
        assert_eq!(significant(1777.7427, 5), "1777.7");
        assert_eq!(significant(f64::INFINITY, 5), "infinite");
        assert_eq!(significant(0.0, 5), "0");
        assert_eq!(significant(1.5e-7, 3), "1.50e-7");
        assert_eq!(significant(123_456_789.0, 4), "123456789");
        assert_eq!(short(50_000.0, 5), "50000");
        assert_eq!(short(8.12, 5), "8.12");
        assert_eq!(short(30.0, 5), "30");
    }

    #[test]
    fn margins_say_which_side() {
        assert_eq!(margin(33.0, 30.0), "over by 10.0 %");
        assert_eq!(margin(27.0, 30.0), "10.0 % to spare");
        assert_eq!(margin(f64::INFINITY, 30.0), "over without bound");
        assert_eq!(margin(2000.0000000000005, 2000.0), "0 % to spare");
        assert_eq!(margin(30.003, 30.0), "over by 1.0e-2 %");
    }
}
