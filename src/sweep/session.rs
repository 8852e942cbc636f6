//! A sweep, or one shard of it, computed into a journal that a kill does not harm.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use super::definition::Sweep;
use super::error::SweepError;
use super::journal::{Content, Header, Journal, Shard, encode_block};

/// What to do about a journal that cannot be gone on with.
const FRESH: &str = "--fresh throws it away and starts anew, --output DIR writes to another folder";

/// Control periods that a block takes, about: at most a second of work.
const BLOCK_PERIODS: u64 = 1 << 23;
/// A sweep has at least so many blocks where they do not become tiny: that share of it is lost with a kill.
const LEAST_BLOCKS: u64 = 32;

/// How a session starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// With nothing.
    New,
    /// With so many points that an earlier session has computed.
    Resumed(u64),
    /// A finished shard is there already.
    Finished,
}

/// A sweep that is being computed.
#[derive(Debug)]
pub struct Session<'a> {
    sweep: &'a Sweep,
    journal: Journal,
    file: File,
    start: Start,
    /// Name that a finished shard gets; none for a whole sweep.
    part: Option<PathBuf>,
}

impl<'a> Session<'a> {
    /// Opens the journal of the sweep in `folder` (which is made if it is missing), or goes on with the one that is there.
    ///
    /// `fresh` throws away what is there. `block_points` is the number of points of a block; none for a good one.
    ///
    /// # Errors
    /// The shard does not exist; the journal is of another sweep, damaged, or being written by another session; the file
    /// cannot be read or written.
    pub fn open(
        sweep: &'a Sweep,
        folder: &Path,
        shard: Shard,
        fresh: bool,
        block_points: Option<u32>,
    ) -> Result<Self, SweepError> {
        if shard.index < 1 || shard.index > shard.of {
            return Err(SweepError::request(
                format!("there is no shard {}/{}", shard.index, shard.of),
                "shards are numbered from 1: 1/4, 2/4, 3/4, 4/4",
            ));
        }
        if u64::from(shard.of) > sweep.count() {
            return Err(SweepError::request(
                format!("{} points cannot be divided into {} shards", sweep.count(), shard.of),
                "take at most as many shards as there are points",
            ));
        }
        let header = Header {
            definition: sweep.definition().clone(),
            shard,
            block_points: block_points.unwrap_or_else(|| default_block(sweep)).max(1),
        };
        let name = &sweep.scenario().name;
        let stem = if shard.of > 1 {
            format!("{name}-sweep.{}-of-{}", shard.index, shard.of)
        } else {
            format!("{name}-sweep")
        };
        let path = folder.join(format!("{stem}.journal"));
        let part = (shard.of > 1).then(|| folder.join(format!("{stem}.part")));
        let write = |source| SweepError::Write { file: path.clone(), source, kept: String::new() };
        fs::create_dir_all(folder).map_err(|source| SweepError::Write {
            file: folder.to_owned(),
            source,
            kept: String::new(),
        })?;

        let file = open_locked(&path)?;
        if let Some(part) = part.as_ref().filter(|part| !fresh && part.exists())
            && let Ok(journal) = Journal::open(part)
            && journal.is_complete()
            && journal.header.shard == shard
            && journal.definition().difference(sweep.definition()).is_none()
        {
            // The journal beside it is empty, or of no use any more.
            let _ = fs::remove_file(&path);
            return Ok(Self { sweep, journal, file, start: Start::Finished, part: None });
        }
        let found = match Journal::read(&path, &file, FRESH) {
            // What is no journal is not thrown away.
            Err(error) if !fresh || matches!(error, SweepError::Foreign { .. }) => return Err(error),
            Ok(found) if !fresh => found,
            _ => Content::Beginning,
        };
        let (journal, start) = match found {
            Content::Journal(journal) => {
                if let Some(what) = sweep.definition().difference(journal.definition()) {
                    return Err(SweepError::unfit(
                        format!("{} is the journal of another sweep; what differs is {what}", path.display()),
                        FRESH,
                    ));
                }
                file.set_len(journal.end()).map_err(write)?;
                let done = journal.done();
                (*journal, if done == 0 { Start::New } else { Start::Resumed(done) })
            }
            Content::Beginning => {
                let (bytes, hash) = header.encode().map_err(write)?;
                if !fresh && !is_beginning(&file, &bytes).map_err(write)? {
                    return Err(SweepError::Damaged {
                        file: path,
                        what: "its header does not end".to_owned(),
                        help: FRESH,
                    });
                }
                file.set_len(0).map_err(write)?;
                (&file).rewind().and_then(|()| (&file).write_all(&bytes)).map_err(write)?;
                (Journal::new(path.clone(), header, hash, bytes.len() as u64), Start::New)
            }
        };
        Ok(Self { sweep, journal, file, start, part })
    }

    /// How it starts.
    pub fn start(&self) -> Start {
        self.start
    }

    /// Points that are computed.
    pub fn done(&self) -> u64 {
        self.journal.done()
    }

    /// Points of the shard.
    pub fn points(&self) -> u64 {
        self.journal.header.points()
    }

    /// Computes what is missing; `progress` is told after every block how many points are done. Of a shard the finished
    /// journal is renamed to `NAME-sweep.I-of-N.part`.
    ///
    /// # Errors
    /// `stop` was raised, or the journal cannot be written; what is computed stays.
    pub fn compute(mut self, stop: Option<&AtomicBool>, progress: &mut dyn FnMut(u64)) -> Result<Journal, SweepError> {
        while let Some(range) = self.journal.next_range() {
            let Some(rows) = self.sweep.evaluate(range, stop) else {
                return Err(SweepError::Interrupted {
                    done: self.done(),
                    count: self.points(),
                    journal: self.journal.path.clone(),
                });
            };
            let bytes = encode_block(&self.journal.hash, self.journal.blocks, &rows);
            let written =
                (&self.file).seek(SeekFrom::Start(self.journal.end())).and_then(|_| (&self.file).write_all(&bytes));
            written.map_err(|source| self.failed(source))?;
            self.journal.blocks += 1;
            progress(self.done());
        }
        if let Some(part) = self.part.take() {
            fs::rename(&self.journal.path, &part).map_err(|source| SweepError::Write {
                file: part.clone(),
                source,
                kept: format!("the shard is whole in {}", self.journal.path.display()),
            })?;
            self.journal.path = part;
        }
        Ok(self.journal)
    }

    fn failed(&self, source: io::Error) -> SweepError {
        SweepError::Write {
            file: self.journal.path.clone(),
            source,
            kept: format!(
                "it keeps {} of {} points; when there is room, the same command continues from there",
                self.done(),
                self.points()
            ),
        }
    }
}

/// Whether the file is the beginning of `bytes`: what a kill leaves of a header.
fn is_beginning(mut file: &File, bytes: &[u8]) -> io::Result<bool> {
    file.rewind()?;
    let mut there = Vec::new();
    file.take(bytes.len() as u64 + 1).read_to_end(&mut there)?;
    Ok(bytes.starts_with(&there))
}

/// A number of points that depends on the sweep alone.
#[allow(clippy::cast_possible_truncation)] // clamped
fn default_block(sweep: &Sweep) -> u32 {
    let periods = sweep.scenario().simulation().map_or(1000, |simulation| simulation.samples()).max(1);
    (BLOCK_PERIODS / periods).min(sweep.count() / LEAST_BLOCKS).clamp(16, 1 << 14) as u32
}

/// The journal, locked: a second session with the same one is refused while this one lasts.
fn open_locked(path: &Path) -> Result<File, SweepError> {
    let failed = |source| SweepError::Write { file: path.to_owned(), source, kept: String::new() };
    let busy = || {
        SweepError::unfit(
            format!("{} is being written by another sweep", path.display()),
            "wait for it, or name another folder with --output",
        )
    };
    // A moment of patience: a process that another thread starts holds the lock until it has become its program.
    for _ in 0..20 {
        if fs::metadata(path).is_ok_and(|meta| !meta.is_file()) {
            return Err(SweepError::unfit(
                format!("{} exists and is not a journal", path.display()),
                "move it away, or name another folder with --output",
            ));
        }
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            std::thread::sleep(Duration::from_millis(10));
            continue;
        }
        // Another session may have finished with it, and removed it, before it was locked.
        if path.exists() {
            return Ok(file);
        }
    }
    Err(busy())
}
