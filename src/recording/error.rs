//! Why a recording could not be written or read.

use std::io;
use std::path::PathBuf;

use mcap::McapError;

/// Why a recording could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file could not be made.
    #[error("cannot create the recording {}: {source}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The folder does not exist.
    #[error("cannot create the recording {}: the folder {} does not exist; create it or name another", path.display(), folder.display())]
    NoFolder {
        /// The folder.
        folder: PathBuf,
        /// The file.
        path: PathBuf,
    },
    /// The path names a folder.
    #[error("cannot create the recording {}: that is a folder; name a file", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
    },
    /// Something else has that name.
    #[error("{} exists and is not a recording; move it away or name another file", path.display())]
    Occupied {
        /// The file.
        path: PathBuf,
    },
    /// Another run is writing it.
    #[error("{} is being written by another run; wait for it or name another file", path.display())]
    Busy {
        /// The partial file.
        path: PathBuf,
    },
    /// Writing failed, such as on a full disk.
    #[error("cannot write the recording {name}: {source}")]
    Write {
        /// The file, or what stands for it.
        name: String,
        /// Why.
        source: io::Error,
    },
    /// The finished file could not be given its name.
    #[error("the recording is whole but stays at {}: cannot rename it to {}: {source}", partial.display(), whole.display())]
    Rename {
        /// Where it is.
        partial: PathBuf,
        /// Where it should be.
        whole: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The recorder was used in another order than `begin`, `period` …, `finish`.
    #[error("cannot write the recording {name}: {what}")]
    Order {
        /// The file, or what stands for it.
        name: String,
        /// What is out of order.
        what: &'static str,
    },
}

/// Why a recording could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file could not be opened.
    #[error("cannot open {name}: {source}")]
    Open {
        /// The file.
        name: String,
        /// Why.
        source: io::Error,
    },
    /// The path names a folder.
    #[error("cannot open {name}: it is a folder; name a recording (.mcap) in it")]
    Folder {
        /// The folder.
        name: String,
    },
    /// The file has no bytes.
    #[error("{name} is empty")]
    Empty {
        /// The file.
        name: String,
    },
    /// Not an MCAP file.
    #[error("{name} is not a recording: it does not begin as an MCAP file does")]
    NotMcap {
        /// The file.
        name: String,
    },
    /// An MCAP file that something else wrote.
    #[error("{name} is an MCAP file of {library:?}, not a recording of servosim")]
    Foreign {
        /// The file.
        name: String,
        /// What wrote it.
        library: String,
    },
    /// The contents are not what was written.
    #[error("{name} is damaged: {what}")]
    Damaged {
        /// The file.
        name: String,
        /// What does not fit.
        what: String,
    },
    /// Reading failed.
    #[error("cannot read {name}: {source}")]
    Read {
        /// The file.
        name: String,
        /// Why.
        source: io::Error,
    },
    /// The visitor failed: it could not write what it was shown.
    #[error(transparent)]
    Visitor(io::Error),
}

/// The I/O error inside the writer's error, so that a message says "No space left on device" and no more.
pub(crate) fn into_io(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
