//! The tuned scenario as a file.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::scenario::Document;
use crate::tuning::TuningReport;
use crate::whole_file;

use super::CliError;
use super::output::{printable, significant};

/// What every file of ours begins with.
const MARK: &str = "# Tuned by servosim ";

/// Where the tuned scenario goes.
pub(crate) struct Place {
    path: PathBuf,
    /// Name of the tuned scenario.
    name: String,
}

impl Place {
    /// `FOLDER/NAME-tuned.toml`, if that name is free or holds a tuned scenario.
    pub(crate) fn new(folder: &Path, scenario: &str) -> Result<Self, CliError> {
        let name = format!("{scenario}-tuned");
        let place = Self { path: folder.join(format!("{name}.toml")), name };
        place.check()?;
        Ok(place)
    }

    fn check(&self) -> Result<(), CliError> {
        let shown = printable(&self.path.display().to_string());
        let occupied = |what: &str| {
            CliError::Usage(format!(
                "{shown} exists already and is {what}: it is left as it is\nhelp: --output DIR writes to another folder, \
                 or move that file away"
            ))
        };
        match fs::metadata(&self.path) {
            Ok(meta) if meta.is_dir() => Err(occupied("a folder")),
            Ok(meta) if !meta.is_file() => Err(occupied("no file")),
            Ok(_) => {
                let mut start = Vec::with_capacity(MARK.len());
                let read =
                    fs::File::open(&self.path).and_then(|file| file.take(MARK.len() as u64).read_to_end(&mut start));
                match read {
                    Ok(_) if start == MARK.as_bytes() => Ok(()),
                    Ok(_) => Err(occupied("not one that `servosim tune` wrote")),
                    Err(source) => Err(CliError::Write { path: self.path.clone(), source }),
                }
            }
            // Whatever else is wrong with the path is found when the file is written.
            Err(_) => Ok(()),
        }
    }

    /// Writes the scenario with the tuned gains: its own text, only the values changed.
    pub(crate) fn write(&self, document: &Document, report: &TuningReport) -> Result<PathBuf, CliError> {
        // The file may have come into being since the search began.
        self.check()?;
        let mut tuned = document.clone();
        // What was learned with other gains, and is not seen from here.
        tuned.forget_learned()?;
        for gain in report.gains.iter().filter(|gain| gain.after != gain.before) {
            tuned.set(&format!("{}={}", gain.key, gain.after))?;
        }
        let text = |document: &Document| format!("{}{}", head(document, report), without_head(document.text()));
        let mut whole = text(&tuned);
        if Document::from_text(whole.clone(), self.path.to_string_lossy()).scenario()?.name != self.name {
            // The text says what it is called; its output must not fall on that of the original.
            tuned.set(&format!("name={}", toml_string(&self.name)))?;
            whole = text(&tuned);
        }
        whole_file::write(&self.path, whole.as_bytes())
            .map_err(|source| CliError::Write { path: self.path.clone(), source })?;
        Ok(self.path.clone())
    }
}

/// First lines of the file: where it comes from.
fn head(document: &Document, report: &TuningReport) -> String {
    let line = |text: &str| printable(text).replace('\n', " ");
    let origin = Path::new(document.origin()).file_name().map(|name| name.to_string_lossy().into_owned());
    let error = |side: &crate::tuning::GainSet| side.metrics.map_or(f64::NAN, |metrics| metrics.max_contour_error_um);
    let ms: Vec<String> = report
        .after
        .axes
        .iter()
        .map(|axis| format!("{} {}", axis.axis, significant(axis.peak_sensitivity, 5)))
        .collect();
    format!(
        "{MARK}{} from {}: largest contouring error {} um -> {} um,\n# Ms {} (at most {}); {}, seed {}, {} evaluations.\n\n",
        env!("CARGO_PKG_VERSION"),
        line(&origin.unwrap_or_default()),
        significant(error(&report.before), 5),
        significant(error(&report.after), 4),
        ms.join(", "),
        report.search.max_ms,
        report.search.method,
        report.search.seed,
        report.search.evaluations,
    )
}

/// The text without the head of an earlier tuning.
fn without_head(text: &str) -> &str {
    if !text.starts_with(MARK) {
        return text;
    }
    text.split_once("\n\n").map_or(text, |(_, rest)| rest)
}

fn toml_string(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}
