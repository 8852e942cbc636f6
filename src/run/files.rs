//! The files of a run beside its recording.

use std::fs;
use std::path::{Path, PathBuf};

use super::error::RunError;
use crate::whole_file;

/// Makes the folder that files go to.
///
/// # Errors
/// It is a file, or cannot be made.
pub fn make_folder(folder: &Path) -> Result<(), RunError> {
    fs::create_dir_all(folder).map_err(|source| match fs::metadata(folder) {
        Ok(meta) if !meta.is_dir() => RunError::NoFolder { path: folder.to_owned() },
        _ => RunError::Write { path: folder.to_owned(), source },
    })
}

/// Writes the layout of the viewer beside the recording: `NAME.layout.json`.
pub(super) fn write_layout(folder: &Path, stem: &str, layout: &str) -> Result<PathBuf, RunError> {
    let path = folder.join(format!("{stem}.layout.json"));
    whole_file::write(&path, layout.as_bytes()).map_err(|source| RunError::Write { path: path.clone(), source })?;
    Ok(path)
}

/// Removes the plots of earlier runs called `stem`: they show another run.
#[cfg(feature = "plots")]
pub(super) fn remove_plots(folder: &Path, stem: &str) -> Vec<PathBuf> {
    use crate::report::{Format, PlotKind};
    let kinds = PlotKind::ALL.into_iter().flat_map(|kind| [Format::Svg, Format::Png].map(|format| (kind, format)));
    let files = kinds.map(|(kind, format)| folder.join(format!("{stem}-{}.{}", kind.name(), format.extension())));
    // One that cannot be removed is no reason to fail: the run is whole.
    files.filter(|file| file.is_file() && fs::remove_file(file).is_ok()).collect()
}
