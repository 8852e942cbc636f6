//! A text line by line, in bounded memory.

use std::io::{self, BufRead, Read as _};

/// Longest line of a program \[bytes\]; a control takes a few hundred.
pub const MAX_LINE_BYTES: usize = 65_536;

/// The lines of a text.
#[derive(Debug)]
pub(super) struct Lines<R> {
    input: R,
    bytes: Vec<u8>,
    /// The line last read, without its end.
    pub(super) text: String,
    /// Its number, from 1.
    pub(super) number: usize,
}

/// What [`Lines::advance`] found.
pub(super) enum Advance {
    /// A line.
    Line,
    /// A line longer than [`MAX_LINE_BYTES`]; its beginning is there.
    TooLong,
    /// No more.
    End,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(input: R) -> Self {
        Self { input, bytes: Vec::new(), text: String::new(), number: 0 }
    }

    /// Reads the next line. At the end the last line stays.
    ///
    /// What is not UTF-8 is taken as Latin-1, as older controls and editors write it.
    pub(super) fn advance(&mut self) -> io::Result<Advance> {
        self.bytes.clear();
        let most = MAX_LINE_BYTES as u64 + 1;
        if (&mut self.input).take(most).read_until(b'\n', &mut self.bytes)? == 0 {
            return Ok(Advance::End);
        }
        self.number += 1;
        let too_long = self.bytes.len() > MAX_LINE_BYTES;
        while let [rest @ .., b'\n' | b'\r'] = self.bytes.as_slice() {
            let length = rest.len();
            self.bytes.truncate(length);
        }
        self.text.clear();
        match std::str::from_utf8(&self.bytes) {
            Ok(text) => self.text.push_str(text),
            Err(_) => self.text.extend(self.bytes.iter().map(|&byte| char::from(byte))),
        }
        // A byte order mark.
        if self.number == 1 && self.text.starts_with('\u{feff}') {
            self.text.drain(..'\u{feff}'.len_utf8());
        }
        Ok(if too_long { Advance::TooLong } else { Advance::Line })
    }
}
