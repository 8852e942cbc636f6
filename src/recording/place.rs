//! Where a recording is written: under a temporary name, renamed when it is complete.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use mcap::MAGIC;

use super::error::RecordingError;
use crate::whole_file::sync_folder;

/// The two names of a recording on disk.
#[derive(Debug)]
pub(crate) struct Place {
    /// The name that it gets at the end.
    pub(crate) whole: PathBuf,
    /// The name that it is written under.
    pub(crate) partial: PathBuf,
    /// Holds the lock on the partial file: a second run to the same name is refused while this one lasts.
    lock: Option<File>,
}

impl Place {
    /// Opens `<path>.partial`, empty and locked, beside `path`.
    pub(crate) fn open(path: &Path) -> Result<(Self, File), RecordingError> {
        check_whole(path)?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if fs::metadata(folder).is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
            return Err(RecordingError::NoFolder { folder: folder.to_owned(), path: path.to_owned() });
        }
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".partial");
        let partial = path.with_file_name(name);
        let file = open_partial(&partial)?;
        let place = Self { whole: path.to_owned(), partial, lock: file.try_clone().ok() };
        Ok((place, file))
    }

    /// Gives the finished file its final name.
    pub(crate) fn keep(&self) -> Result<(), RecordingError> {
        // It may have come into being since the run began.
        check_whole(&self.whole)?;
        let renamed =
            |source| RecordingError::Rename { partial: self.partial.clone(), whole: self.whole.clone(), source };
        // On the disk before it has its name.
        if let Some(file) = &self.lock {
            file.sync_all().map_err(renamed)?;
        }
        fs::rename(&self.partial, &self.whole).map_err(renamed)?;
        sync_folder(&self.whole);
        Ok(())
    }

    /// Removes the unfinished file.
    pub(crate) fn discard(&self) {
        // Nothing better can be done when it fails: the run has failed already and says why.
        let _ = fs::remove_file(&self.partial);
    }
}

/// A final name that is free, or that of a recording: those are replaced.
fn check_whole(path: &Path) -> Result<(), RecordingError> {
    if path.file_name().is_none() {
        return Err(RecordingError::Folder { path: path.to_owned() });
    }
    match fs::metadata(path) {
        Ok(meta) if meta.is_dir() => Err(RecordingError::Folder { path: path.to_owned() }),
        Ok(meta) if !meta.is_file() => Err(RecordingError::Occupied { path: path.to_owned() }),
        Ok(_) => match starts_as_recording(File::open(path)) {
            Ok(Some(MAGIC_LENGTH)) => Ok(()),
            Ok(_) => Err(RecordingError::Occupied { path: path.to_owned() }),
            Err(source) => Err(RecordingError::Create { path: path.to_owned(), source }),
        },
        // Whatever else is wrong with the path is found when the partial file is opened.
        Err(_) => Ok(()),
    }
}

const MAGIC_LENGTH: usize = MAGIC.len();

/// How many bytes of the format's mark the file begins with, or none when it begins otherwise.
fn starts_as_recording(file: io::Result<File>) -> io::Result<Option<usize>> {
    let mut start = Vec::with_capacity(MAGIC_LENGTH);
    file?.take(MAGIC_LENGTH as u64).read_to_end(&mut start)?;
    Ok(MAGIC.starts_with(&start).then_some(start.len()))
}

fn open_partial(path: &Path) -> Result<File, RecordingError> {
    let failed = |source| RecordingError::Create { path: path.to_owned(), source };
    // Each round that fails is another run that finished between two of these lines.
    for _ in 0..16 {
        // Looked at before it is opened: opening a pipe would wait for its other end.
        match fs::symlink_metadata(path) {
            Ok(meta) if meta.is_dir() => return Err(RecordingError::Folder { path: path.to_owned() }),
            Ok(meta) if !meta.is_file() => return Err(RecordingError::Occupied { path: path.to_owned() }),
            _ => {}
        }
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(RecordingError::Busy { path: path.to_owned() });
        }
        // (A file system without locks cannot tell; the run goes on there.)
        if !is_still_at(&file, path).map_err(failed)? {
            continue;
        }
        if starts_as_recording(file.try_clone()).map_err(failed)?.is_none() {
            return Err(RecordingError::Occupied { path: path.to_owned() });
        }
        io::Seek::rewind(&mut &file).map_err(failed)?;
        file.set_len(0).map_err(failed)?;
        return Ok(file);
    }
    Err(RecordingError::Busy { path: path.to_owned() })
}

/// Whether `path` still names the open file: another run may have finished and renamed it before it was locked.
#[cfg(unix)]
fn is_still_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let open = file.metadata()?;
    match fs::symlink_metadata(path) {
        Ok(named) => Ok(named.dev() == open.dev() && named.ino() == open.ino()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(not(unix))]
#[allow(clippy::unnecessary_wraps)] // the other systems' signature
fn is_still_at(_: &File, path: &Path) -> io::Result<bool> {
    Ok(path.exists())
}
