//! Files that are whole or not there: written beside their final name, given to the disk, then renamed.
//!
//! An unfinished file is called `.NAME.PID.part`. What a killed process has left of one is removed by the next that writes `NAME`; that of a
//! process that still runs is left alone.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::time::Duration;

/// Where it cannot be known whether a process runs, an unfinished file of this age is left over.
const LEFT_OVER: Duration = Duration::from_hours(24);

/// Writes a whole file; an existing one is replaced.
///
/// # Errors
/// The file cannot be written: nothing is left of it, and an existing one is as it was.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut draft = Draft::create(path)?;
    draft.file().write_all(bytes)?;
    draft.keep()
}

/// An unfinished file; removed when it is dropped before [`Draft::keep`].
#[derive(Debug)]
pub(crate) struct Draft {
    file: File,
    unfinished: PathBuf,
    path: PathBuf,
    is_kept: bool,
}

impl Draft {
    /// An empty file that will be `path`, and no left-over of it.
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        if path.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        remove_left_overs(path);
        let unfinished = path.with_file_name(unfinished_name(path, process::id())?);
        let file = File::create(&unfinished)?;
        Ok(Self { file, unfinished, path: path.to_owned(), is_kept: false })
    }

    /// What to write to.
    pub(crate) fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Gives the file its name, once the disk has all of it.
    pub(crate) fn keep(mut self) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.unfinished, &self.path)?;
        self.is_kept = true;
        sync_folder(&self.path);
        Ok(())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.is_kept {
            // The failure that is told of is why it was not finished.
            let _ = fs::remove_file(&self.unfinished);
        }
    }
}

/// `.NAME.PID.part`
fn unfinished_name(path: &Path, process: u32) -> io::Result<OsString> {
    let name = path.file_name().ok_or_else(|| io::Error::from(io::ErrorKind::InvalidFilename))?;
    let mut unfinished = OsString::from(".");
    unfinished.push(name);
    unfinished.push(format!(".{process}.part"));
    Ok(unfinished)
}

/// A renaming is on the disk once its folder is.
pub(crate) fn sync_folder(path: &Path) {
    // Some systems cannot: the file itself is there all the same.
    if cfg!(unix)
        && let Some(folder) = folder_of(path)
        && let Ok(folder) = File::open(folder)
    {
        let _ = folder.sync_all();
    }
}

fn folder_of(path: &Path) -> Option<&Path> {
    path.parent().map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
}

/// Removes what processes that no longer run have left unfinished of a file.
fn remove_left_overs(path: &Path) {
    let (Some(folder), Some(name)) = (folder_of(path), path.file_name().and_then(|name| name.to_str())) else { return };
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let file_name = entry.file_name();
        let process = file_name
            .to_str()
            .and_then(|other| other.strip_prefix('.')?.strip_prefix(name)?.strip_prefix('.')?.strip_suffix(".part"))
            .and_then(|process| process.parse::<u32>().ok());
        let Some(process) = process.filter(|process| *process != process::id()) else { continue };
        if entry.file_type().is_ok_and(|kind| kind.is_file()) && is_left_over(process, &entry) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn is_left_over(process: u32, entry: &fs::DirEntry) -> bool {
    if Path::new("/proc/self").exists() {
        return !Path::new(&format!("/proc/{process}")).exists();
    }
    let age = entry.metadata().and_then(|meta| meta.modified()).ok().and_then(|time| time.elapsed().ok());
    age.is_some_and(|age| age > LEFT_OVER)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_whole_and_left_overs_go() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.csv");
        fs::write(&file, "before").unwrap();
        // Of a process that has ended, of one that runs, and files of others.
        let mut ended = process::Command::new("true").spawn().unwrap();
        let dead = ended.id();
        ended.wait().unwrap();
        let mut alive = process::Command::new("sleep").arg("60").spawn().unwrap();
        let kept =
            [format!(".a.csv.{}.part", alive.id()), format!(".b.csv.{dead}.part"), "a.csv.1-of-3.part".to_owned()];
        for name in kept.iter().chain([&format!(".a.csv.{dead}.part")]) {
            fs::write(folder.path().join(name), "half").unwrap();
        }
        write(&file, b"after").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"after");
        let mut wanted = kept.to_vec();
        wanted.push("a.csv".to_owned());
        wanted.sort();
        assert_eq!(names(folder.path()), wanted);
        alive.kill().unwrap();
        alive.wait().unwrap();
        write(&file, b"again").unwrap();
        assert_eq!(names(folder.path()).len(), 3, "{:?}", names(folder.path()));
    }

    #[test]
    fn what_is_not_finished_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.csv");
        let mut draft = Draft::create(&file).unwrap();
        draft.file().write_all(b"half").unwrap();
        assert_eq!(names(folder.path()).len(), 1);
        drop(draft);
        assert!(names(folder.path()).is_empty());
        assert!(write(folder.path(), b"x").is_err());
        assert!(write(&folder.path().join("missing/a.csv"), b"x").is_err());
        assert!(write(Path::new("/"), b"x").is_err());
    }
}
