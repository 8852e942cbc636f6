//! The corrections that a scenario names: from their file to checked values.

use std::io;
use std::path::Path;
use std::sync::Arc;

use nalgebra::Vector2;
use toml::Spanned;

use super::diagnostics::{Diagnostic, brief};
use super::part::Folder;
use crate::simulation::{CorrectionsError, read_corrections};

/// Reads the corrections of a run of so many samples.
pub(super) fn corrections(
    file: &Spanned<String>,
    folder: &Folder,
    samples: u64,
    period_s: f64,
) -> Result<Arc<[Vector2<f64>]>, Diagnostic> {
    let name = file.get_ref();
    let (reader, origin) = folder.open(name).map_err(|error| {
        let problem = Diagnostic::new(format!("the learned corrections `{}` cannot be read: {error}", brief(name)))
            .at(file.span());
        match error.kind() {
            io::ErrorKind::NotFound => absent(problem, name, folder),
            io::ErrorKind::IsADirectory => problem.help("give the CSV file that `servosim learn` wrote"),
            _ => problem,
        }
    })?;
    read_corrections(reader, samples, period_s).map_err(|error| {
        let origin = brief(&origin);
        let message = match &error {
            CorrectionsError::TooLong { .. } => error.to_string(),
            CorrectionsError::Read(_) | CorrectionsError::TooFew { .. } => format!("`{origin}` {error}"),
            _ => format!("`{origin}`, {error}"),
        };
        let problem = Diagnostic::new(message).at(file.span());
        match error {
            CorrectionsError::Period { .. } | CorrectionsError::TooFew { .. } | CorrectionsError::TooMany { .. } => problem
                .help("corrections belong to one run: remove `learned`, `servosim learn` again, and put the new file in its place"),
            CorrectionsError::Header { .. } | CorrectionsError::Line { .. } => {
                problem.help("give the CSV file that `servosim learn` wrote, as it wrote it")
            }
            CorrectionsError::TooLong { .. } => problem.help("remove `learned`"),
            _ => problem,
        }
    })
}

/// A file that is not where it is looked for may be seen from where the program was started.
fn absent(problem: Diagnostic, name: &str, folder: &Folder) -> Diagnostic {
    let problem = problem.note("the file is looked for in the folder of the scenario");
    match Some(Path::new(name)).filter(|here| here.is_file()).and_then(|here| folder.name_of(here)) {
        Some(meant) => problem.help(format!("from there it is `{}`", brief(&meant))),
        None => problem.help("`servosim learn FILE` writes it"),
    }
}
