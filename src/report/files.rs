//! Figures into files.

use std::fs;
use std::path::{Path, PathBuf};

use super::error::ReportError;
use super::figure::Figure;
use super::format::Format;
use crate::whole_file;

/// Writes each figure as `STEM-NAME.svg` (or `.png`) into `folder`, which is made if it is missing; existing files are
/// replaced. Returns the files in the order of the figures. The way of every plot to its file, of runs and of anything else.
///
/// All figures are drawn before the first is written, and each file appears under its name only when it is complete.
///
/// # Errors
/// A stem that is no plain file name, a figure that cannot be drawn, a file or folder that cannot be written.
pub(super) fn write_figures(
    figures: impl IntoIterator<Item = (&'static str, Figure)>,
    folder: &Path,
    stem: &str,
    format: Format,
) -> Result<Vec<PathBuf>, ReportError> {
    check_stem(stem)?;
    let plots = figures
        .into_iter()
        .map(|(name, figure)| Ok((format!("{stem}-{name}.{}", format.extension()), drawn(&figure, name, format)?)))
        .collect::<Result<Vec<_>, ReportError>>()?;
    fs::create_dir_all(folder).map_err(|source| ReportError::Write { file: folder.to_owned(), source })?;
    let mut files = Vec::with_capacity(plots.len());
    for (name, bytes) in plots {
        let file = folder.join(name);
        write_file(&file, &bytes)?;
        files.push(file);
    }
    Ok(files)
}

/// The bytes of a figure; `plot` is what messages and file names call it.
pub(super) fn drawn(figure: &Figure, plot: &'static str, format: Format) -> Result<Vec<u8>, ReportError> {
    let drawn = match format {
        Format::Svg => figure.svg(),
        Format::Png => figure.png(),
    };
    drawn.map_err(|reason| ReportError::Draw { plot, reason })
}

pub(super) fn check_stem(stem: &str) -> Result<(), ReportError> {
    if stem.is_empty() || stem.chars().any(|c| matches!(c, '/' | '\\') || c.is_control()) {
        return Err(ReportError::Stem { stem: stem.to_owned() });
    }
    Ok(())
}

/// Writes a whole file, an existing one is replaced: it appears under its name only when it is complete.
///
/// # Errors
/// The file cannot be written; nothing is left of it, and an existing one is as it was.
pub fn write_file(file: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    whole_file::write(file, bytes).map_err(|source| ReportError::Write { file: file.to_owned(), source })
}
