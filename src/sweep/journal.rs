//! The journal of a sweep: what is computed so far, on disk, whole blocks at a time.
//!
//! | bytes | |
//! |---|---|
//! | 17 | `servosim sweep 1` and a newline |
//! | 4 | length of the header |
//! | … | header, JSON: definition, shard, points of a block |
//! | 32 | SHA-256 of all before |
//! | then for every block: 8 | number of the block, from 0 |
//! | 4 | points in it |
//! | … | for every point: status (1 byte) and metrics (8 bytes each, IEEE 754) |
//! | 8 | the first bytes of the SHA-256 of the header's hash and the block |
//!
//! Numbers are little-endian. Every block but the last has the header's number of points, so that each byte has its place: a
//! file that ends within a block was cut by a kill, everything else that does not fit is damage.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::definition::Definition;
use super::error::SweepError;
use super::metric::{Rows, Status};

pub(super) const MAGIC: &[u8; 17] = b"servosim sweep 1\n";

/// Longest header that is read: a scenario's text may be 64 MiB.
const MAX_HEADER: u32 = 256 << 20;

/// Which part of a sweep: the `index`-th of `of`, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    /// From 1.
    pub index: u32,
    /// How many there are.
    pub of: u32,
}

impl Shard {
    /// The whole sweep.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// Its points, of `count`: contiguous, and none in two shards.
    #[allow(clippy::cast_possible_truncation)] // a share of `count`, which fits
    pub fn range(self, count: u64) -> Range<u64> {
        let bound = |i: u32| (u128::from(count) * u128::from(i) / u128::from(self.of.max(1))) as u64;
        bound(self.index.saturating_sub(1))..bound(self.index)
    }
}

/// What a journal begins with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    pub(super) definition: Definition,
    pub(super) shard: Shard,
    pub(super) block_points: u32,
}

impl Header {
    /// As it stands in the file, and its hash.
    pub(super) fn encode(&self) -> io::Result<(Vec<u8>, [u8; 32])> {
        let json = serde_json::to_vec(self)?;
        let length = u32::try_from(json.len()).ok().filter(|length| *length <= MAX_HEADER);
        let length = length.ok_or_else(|| io::Error::other("the scenario is too long"))?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend(length.to_le_bytes());
        bytes.extend(json);
        let hash: [u8; 32] = Sha256::digest(&bytes).into();
        bytes.extend(hash);
        Ok((bytes, hash))
    }

    /// Points of the shard.
    pub(super) fn points(&self) -> u64 {
        let range = self.shard.range(self.definition.count);
        range.end - range.start
    }

    /// Points of a block.
    fn block_len(&self, block: u64) -> u64 {
        let full = u64::from(self.block_points.max(1));
        self.points().saturating_sub(block * full).min(full)
    }

    /// Metrics of a point.
    fn width(&self) -> usize {
        self.definition.metrics.len()
    }

    pub(super) fn blocks(&self) -> u64 {
        self.points().div_ceil(u64::from(self.block_points.max(1)))
    }
}

/// Bytes of a block around its points: number and length before, checksum behind.
const FRAME: (usize, usize) = (12, 8);

/// Length of a block of so many points with so many metrics.
fn block_bytes(points: u64, width: usize) -> usize {
    usize::try_from(points).unwrap_or(usize::MAX).saturating_mul(1 + 8 * width).saturating_add(FRAME.0 + FRAME.1)
}

fn checksum(hash: &[u8; 32], block: &[u8]) -> [u8; 8] {
    let digest = Sha256::new().chain_update(hash).chain_update(block).finalize();
    std::array::from_fn(|i| digest[i])
}

/// A block as it stands in the file.
pub(super) fn encode_block(hash: &[u8; 32], block: u64, rows: &Rows) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(block_bytes(rows.len() as u64, rows.width));
    bytes.extend(block.to_le_bytes());
    bytes.extend(u32::try_from(rows.len()).unwrap_or(u32::MAX).to_le_bytes());
    for (place, status) in rows.status.iter().enumerate() {
        bytes
            .push(Status::ALL.iter().position(|known| known == status).and_then(|i| u8::try_from(i).ok()).unwrap_or(0));
        bytes.extend(rows.metrics_of(place).iter().flat_map(|metric| metric.to_bits().to_le_bytes()));
    }
    bytes.extend(checksum(hash, &bytes));
    bytes
}

/// What is wrong with a block.
fn decode_block(hash: &[u8; 32], block: u64, points: u64, width: usize, bytes: &[u8]) -> Result<Rows, &'static str> {
    let (body, sum) = bytes.split_at(bytes.len().saturating_sub(FRAME.1));
    if checksum(hash, body) != sum {
        return Err("its checksum does not fit");
    }
    let (head, mut rest) = body.split_at(FRAME.0.min(body.len()));
    let (number, length) = head.split_at(8.min(head.len()));
    if number != block.to_le_bytes() || length != u32::try_from(points).unwrap_or(u32::MAX).to_le_bytes() {
        return Err("it is another block");
    }
    let mut rows = Rows { width, ..Rows::default() };
    while let Some((code, metrics)) = rest.split_first() {
        rows.status.push(Status::ALL.get(usize::from(*code)).copied().ok_or("it has a status that is not known")?);
        let (now, later) = metrics.split_at((8 * width).min(metrics.len()));
        rows.metrics.extend(
            now.chunks_exact(8)
                .map(|bytes| f64::from_le_bytes(std::array::from_fn(|i| bytes.get(i).copied().unwrap_or(0)))),
        );
        rest = later;
    }
    Ok(rows)
}

/// A journal on disk: of a sweep that is under way, or of a finished shard.
#[derive(Debug)]
pub struct Journal {
    pub(super) path: PathBuf,
    pub(super) header: Header,
    pub(super) hash: [u8; 32],
    /// Length of the header in the file.
    start: u64,
    /// Whole blocks that are there.
    pub(super) blocks: u64,
}

/// What a file holds.
pub(super) enum Content {
    Journal(Box<Journal>),
    /// Cut off within the header, or empty: nothing is lost with it.
    Beginning,
}

impl Journal {
    /// One that holds its header alone, of `start` bytes.
    pub(super) fn new(path: PathBuf, header: Header, hash: [u8; 32], start: u64) -> Self {
        Self { path, header, hash, start, blocks: 0 }
    }

    /// Opens a journal and checks every byte of it.
    ///
    /// # Errors
    /// It cannot be read, is no journal, or is damaged.
    pub fn open(path: &Path) -> Result<Self, SweepError> {
        let failed = |source| SweepError::Read { file: path.to_owned(), source };
        let file = File::open(path).map_err(failed)?;
        if file.metadata().map_err(failed)?.is_dir() {
            return Err(SweepError::unfit(format!("{} is a folder", path.display()), "name the parts: DIR/*.part"));
        }
        match Self::read(path, &file, MERGE_HELP)? {
            Content::Journal(journal) => Ok(*journal),
            Content::Beginning => Err(SweepError::unfit(
                format!("{} ends before its first point", path.display()),
                "run its shard again: it continues from there",
            )),
        }
    }

    /// As [`Journal::open`], from an open file; `help` is what to do about damage.
    pub(super) fn read(path: &Path, file: &File, help: &'static str) -> Result<Content, SweepError> {
        let damaged = |what: String| SweepError::Damaged { file: path.to_owned(), what, help };
        let failed = |source| SweepError::Read { file: path.to_owned(), source };
        let length = file.metadata().map_err(failed)?.len();
        let mut reader = BufReader::with_capacity(1 << 20, file);
        reader.rewind().map_err(failed)?;

        let mut fixed = Vec::with_capacity(MAGIC.len() + 4);
        (&mut reader).take(MAGIC.len() as u64 + 4).read_to_end(&mut fixed).map_err(failed)?;
        let magic = fixed.get(..MAGIC.len().min(fixed.len())).unwrap_or_default();
        if !MAGIC.starts_with(magic) {
            return Err(SweepError::Foreign { file: path.to_owned() });
        }
        let Some(Ok(header_length)) = fixed.get(MAGIC.len()..).map(<[u8; 4]>::try_from) else {
            return Ok(Content::Beginning);
        };
        let header_length = u32::from_le_bytes(header_length);
        if header_length > MAX_HEADER {
            return Err(damaged("the length of its header is not possible".to_owned()));
        }
        let mut json = Vec::new();
        (&mut reader).take(u64::from(header_length)).read_to_end(&mut json).map_err(failed)?;
        let mut hash = Vec::with_capacity(32);
        (&mut reader).take(32).read_to_end(&mut hash).map_err(failed)?;
        let Ok(hash) = <[u8; 32]>::try_from(hash) else {
            return Ok(Content::Beginning);
        };
        fixed.extend(&json);
        if <[u8; 32]>::from(Sha256::digest(&fixed)) != hash {
            return Err(damaged("the checksum of its header does not fit".to_owned()));
        }
        let header: Header = serde_json::from_slice(&json).map_err(|_| {
            SweepError::unfit(
                format!("{} is of another version of servosim", path.display()),
                "use that version, or compute the sweep anew",
            )
        })?;
        let mut journal = Self::new(path.to_owned(), header, hash, fixed.len() as u64 + 32);
        let mut blocks = Blocks::new(&journal, reader);
        let whole = loop {
            match blocks.next_block()? {
                Next::Rows(_) => {}
                Next::End => break true,
                Next::Cut => break false,
            }
        };
        journal.blocks = blocks.block;
        if whole && length > journal.end() {
            return Err(damaged(format!("{} bytes follow its last block", length - journal.end())));
        }
        Ok(Content::Journal(Box::new(journal)))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The sweep that it belongs to.
    pub fn definition(&self) -> &Definition {
        &self.header.definition
    }

    /// The part of the sweep that it is of.
    pub fn shard(&self) -> Shard {
        self.header.shard
    }

    /// Points that are computed.
    pub fn done(&self) -> u64 {
        self.header.points().min(self.blocks * u64::from(self.header.block_points.max(1)))
    }

    /// Whether all points of its shard are computed.
    pub fn is_complete(&self) -> bool {
        self.blocks == self.header.blocks()
    }

    /// Where the next block goes.
    pub(super) fn end(&self) -> u64 {
        let bytes = |block: u64| block_bytes(self.header.block_len(block), self.header.width()) as u64;
        // All blocks but the last are of one length.
        self.start + self.blocks.checked_sub(1).map_or(0, |last| last * bytes(0) + bytes(last))
    }

    /// Points of the next block, counted from the beginning of the sweep; none where all are there.
    pub(super) fn next_range(&self) -> Option<Range<u64>> {
        let points = self.header.block_len(self.blocks);
        let start = self.header.shard.range(self.header.definition.count).start + self.done();
        (points > 0).then_some(start..start + points)
    }

    /// Hands every block to `take`, with the number of its first point in the sweep.
    ///
    /// # Errors
    /// The file cannot be read (or is not any more what it was), or `take` fails.
    pub fn for_each(&self, mut take: impl FnMut(u64, &Rows) -> Result<(), SweepError>) -> Result<(), SweepError> {
        let failed = |source| SweepError::Read { file: self.path.clone(), source };
        let mut reader = BufReader::with_capacity(1 << 20, File::open(&self.path).map_err(failed)?);
        reader.seek(SeekFrom::Start(self.start)).map_err(failed)?;
        let mut blocks = Blocks::new(self, reader);
        let mut index = self.header.shard.range(self.header.definition.count).start;
        while blocks.block < self.blocks {
            let Next::Rows(rows) = blocks.next_block()? else {
                return Err(SweepError::Damaged {
                    file: self.path.clone(),
                    what: "it became shorter while it was read".to_owned(),
                    help: MERGE_HELP,
                });
            };
            take(index, &rows)?;
            index += rows.len() as u64;
        }
        Ok(())
    }
}

const MERGE_HELP: &str = "compute it anew with --fresh";

/// Reads block after block.
struct Blocks<'a, R> {
    path: &'a Path,
    header: &'a Header,
    hash: &'a [u8; 32],
    reader: R,
    block: u64,
    bytes: Vec<u8>,
}

enum Next {
    Rows(Rows),
    End,
    /// The file ends within the block.
    Cut,
}

impl<'a, R: Read> Blocks<'a, R> {
    fn new(journal: &'a Journal, reader: R) -> Self {
        Self { path: &journal.path, header: &journal.header, hash: &journal.hash, reader, block: 0, bytes: Vec::new() }
    }

    fn next_block(&mut self) -> Result<Next, SweepError> {
        let points = self.header.block_len(self.block);
        if points == 0 {
            return Ok(Next::End);
        }
        let width = self.header.width();
        let length = block_bytes(points, width);
        self.bytes.clear();
        let read = (&mut self.reader).take(length as u64).read_to_end(&mut self.bytes);
        read.map_err(|source| SweepError::Read { file: self.path.to_owned(), source })?;
        if self.bytes.len() < length {
            return Ok(Next::Cut);
        }
        let rows =
            decode_block(self.hash, self.block, points, width, &self.bytes).map_err(|what| SweepError::Damaged {
                file: self.path.to_owned(),
                what: format!("block {} of {} is not what was written: {what}", self.block + 1, self.header.blocks()),
                help: MERGE_HELP,
            })?;
        self.block += 1;
        Ok(Next::Rows(rows))
    }
}
