//! A whole program.

use super::{Block, NcError, Reader, Reading, WriteError, Writer, Writing, Written};

/// A whole program in memory.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Program {
    /// Its blocks, in order.
    pub blocks: Vec<Block>,
}

impl Program {
    /// Reads a program from text; `origin` is what messages call it.
    ///
    /// # Errors
    /// See [`Reader`].
    pub fn read(text: &str, origin: &str) -> Result<Self, NcError> {
        let blocks = Reader::new(text.as_bytes(), origin, Reading::default()).collect::<Result<_, _>>()?;
        Ok(Self { blocks })
    }

    /// Writes the program; see [`Writer`].
    ///
    /// # Errors
    /// See [`Writer::write`].
    pub fn write(&self, out: impl std::io::Write, writing: Writing) -> Result<Written, WriteError> {
        let mut writer = Writer::new(out, writing)?;
        for block in &self.blocks {
            writer.write(block)?;
        }
        writer.finish()
    }
}
