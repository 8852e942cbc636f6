//! STL, binary and ASCII. `stl_io` takes the triangles out; here the two kinds are told apart for certain, and whatever is wrong
//! gets its place.
//!
//! Beyond the crate: a binary file may begin with "solid"; a text may have several solids, capital letters, and normals that are
//! no numbers (exporters write them for triangles without an area; no normal of a file is used).

use std::io::{self, Cursor, Read, Seek, SeekFrom};

use nalgebra::Vector3;

use super::{Builder, MAX_TRIANGLES, Mesh, MeshError};

/// Most bytes that are read: room for [`MAX_TRIANGLES`] in binary form, or some 5 million in ASCII.
const MAX_BYTES: u64 = 1 << 30;
/// Bytes of a binary file before the triangles, and of each triangle.
const HEADER: usize = 84;
const RECORD: usize = 50;

impl Mesh {
    /// Reads an STL, binary or ASCII, millimetres. `origin` is what messages call it, such as the file's name.
    ///
    /// Memory grows with the data that is really there, not with what a header promises.
    ///
    /// # Errors
    /// Data that are no STL or damaged, with the place; a coordinate that is not a finite number in range; no triangle with an
    /// area; too many of them.
    pub fn from_stl(reader: impl Read, origin: &str) -> Result<Self, MeshError> {
        let mut bytes = Vec::new();
        let read = reader.take(MAX_BYTES + 1).read_to_end(&mut bytes);
        read.map_err(|source| MeshError::Read { origin: origin.into(), source })?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(MeshError::TooLarge { origin: origin.into(), most: MAX_BYTES });
        }
        if bytes.is_empty() {
            return Err(MeshError::NoStl { origin: origin.into(), problem: "it is empty".into() });
        }
        let start = bytes.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(bytes.len());
        let text = bytes.get(start..start + 5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
        // Binary headers may say "solid" too; texts have no zero byte, and binary files of such a length always do or fit.
        let fits = count(&bytes).is_some_and(|count| bytes.len() == HEADER + RECORD * count);
        if text && !fits && !bytes.contains(&0) { ascii(&bytes, origin) } else { binary(bytes, origin) }
    }
}

/// The number of triangles that a binary header promises.
fn count(bytes: &[u8]) -> Option<usize> {
    let field: [u8; 4] = bytes.get(80..HEADER)?.try_into().ok()?;
    Some(u32::from_le_bytes(field) as usize)
}

fn binary(mut bytes: Vec<u8>, origin: &str) -> Result<Mesh, MeshError> {
    let Some(counted) = count(&bytes) else {
        let problem =
            format!("{} bytes are too few for a binary one, and it does not begin with \"solid\"", bytes.len());
        return Err(MeshError::NoStl { origin: origin.into(), problem });
    };
    let whole = (bytes.len() - HEADER) / RECORD;
    if counted > whole {
        let (byte, triangle) = (bytes.len(), whole + 1);
        return Err(MeshError::CutShort { origin: origin.into(), byte, counted, triangle });
    }
    if counted > MAX_TRIANGLES {
        return Err(MeshError::TooMany { origin: origin.into(), counted });
    }
    if bytes.len() > HEADER + RECORD * counted {
        let (found, needed) = (bytes.len(), HEADER + RECORD * counted);
        let problem = format!("its header counts {counted} triangles, which take {needed} bytes, but it has {found}");
        return Err(MeshError::NoStl { origin: origin.into(), problem });
    }
    // The crate takes a header that begins with "solid" for a text.
    if let Some(name) = bytes.get_mut(..80) {
        name.fill(0)
    }
    let mut cursor = Cursor::new(bytes);
    let failed = |source| MeshError::Read { origin: origin.into(), source };
    let mut builder = Builder::default();
    for triangle in stl_io::create_stl_reader(&mut cursor).map_err(failed)? {
        let triangle = triangle.map_err(failed)?;
        builder.add(origin, corners(&triangle))?;
    }
    builder.finish(origin)
}

fn corners(triangle: &stl_io::Triangle) -> [Vector3<f64>; 3] {
    triangle.vertices.map(|vertex| Vector3::from(vertex.0).map(f64::from))
}

fn ascii(bytes: &[u8], origin: &str) -> Result<Mesh, MeshError> {
    let lines = std::cell::Cell::new(0);
    let mut text = Lines { rest: bytes, line: Vec::new(), at: 0, started: false, number: &lines };
    let mut builder = Builder::default();
    let wrong = |triangle: usize, source: &io::Error| MeshError::Ascii {
        origin: origin.into(),
        line: lines.get(),
        triangle,
        problem: source.to_string(),
    };
    for triangle in stl_io::create_stl_reader(&mut text).map_err(|source| wrong(1, &source))? {
        let triangle = triangle.map_err(|source| wrong(builder.count() + 1, &source))?;
        builder.add(origin, corners(&triangle))?;
    }
    builder.finish(origin)
}

/// A text as the crate wants it, a line at a time, so that the line where it stops is known: keywords in small letters, one
/// solid, normals of zeros.
struct Lines<'a> {
    rest: &'a [u8],
    /// The line that is being given out, and how far.
    line: Vec<u8>,
    at: usize,
    started: bool,
    number: &'a std::cell::Cell<usize>,
}

impl Lines<'_> {
    /// The next line that the crate is to see.
    fn next_line(&mut self) {
        self.line.clear();
        self.at = 0;
        while !self.rest.is_empty() && self.line.is_empty() {
            let end = self.rest.iter().position(|&b| b == b'\n').map_or(self.rest.len(), |at| at + 1);
            let (line, rest) = self.rest.split_at(end);
            self.rest = rest;
            self.number.set(self.number.get() + 1);
            let words = line.trim_ascii().to_ascii_lowercase();
            let first = words.split(u8::is_ascii_whitespace).next().unwrap_or_default();
            match first {
                b"solid" if !self.started => self.line.extend_from_slice(b"solid mesh"),
                // Where another solid follows, its triangles belong to the mesh too.
                b"solid" => {}
                b"endsolid" if rest.iter().any(|b| !b.is_ascii_whitespace()) => {}
                b"facet" if words.split(u8::is_ascii_whitespace).any(|word| word == b"normal") => {
                    self.line.extend_from_slice(b"facet normal 0 0 0");
                }
                _ => self.line.extend_from_slice(&words),
            }
            self.started |= !self.line.is_empty();
        }
        if !self.line.is_empty() {
            self.line.push(b'\n')
        }
    }
}

impl Read for Lines<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.at == self.line.len() {
            self.next_line()
        }
        let left = self.line.get(self.at..).unwrap_or_default();
        let count = left.len().min(buffer.len());
        buffer[..count].copy_from_slice(&left[..count]);
        self.at += count;
        Ok(count)
    }
}

impl Seek for Lines<'_> {
    /// Back to the start: the crate looks at the first line, then begins again.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if to != SeekFrom::Start(0) {
            return Err(io::ErrorKind::Unsupported.into());
        }
        self.at = 0;
        Ok(0)
    }
}
