//! The words of a block; what is left unused is reported.

use super::words::{Address, Word};
use crate::diagnostics::{Diagnostic, brief};

pub(super) const AXES: [Address; 3] = [Address::Letter(b'X'), Address::Letter(b'Y'), Address::Letter(b'Z')];
pub(super) const OFFSETS: [Address; 3] = [Address::Letter(b'I'), Address::Letter(b'J'), Address::Letter(b'K')];
pub(super) const F: Address = Address::Letter(b'F');
pub(super) const K: Address = Address::Letter(b'K');
pub(super) const L: Address = Address::Letter(b'L');
pub(super) const P: Address = Address::Letter(b'P');
pub(super) const R: Address = Address::Letter(b'R');
pub(super) const S: Address = Address::Letter(b'S');
pub(super) const W: Address = Address::Letter(b'W');

/// The words of a line, and which have been used.
pub(super) struct BlockWords<'a> {
    pub(super) words: &'a [Word],
    pub(super) text: &'a str,
    pub(super) used: u64,
}

impl<'a> BlockWords<'a> {
    pub(super) fn new(words: &'a [Word], text: &'a str) -> Self {
        Self { words, text, used: 0 }
    }

    pub(super) fn peek(&self, address: Address) -> Option<&'a Word> {
        if self.used & address.bit() != 0 {
            return None;
        }
        self.words.iter().find(|word| word.address == address)
    }

    pub(super) fn take(&mut self, address: Address) -> Option<&'a Word> {
        let word = self.peek(address);
        if word.is_some() {
            self.used |= address.bit();
        }
        word
    }

    pub(super) fn any(&self, addresses: &[Address]) -> bool {
        addresses.iter().any(|&address| self.peek(address).is_some())
    }

    /// The whole line without the spaces around it.
    pub(super) fn all(&self) -> std::ops::Range<usize> {
        let start = self.words.first().map_or(0, |word| word.span().start);
        start..self.words.last().map_or(start, |word| word.span().end)
    }

    /// Every word has a use.
    pub(super) fn finish(&self) -> Result<(), Diagnostic> {
        let Some(word) = self.words.iter().find(|word| self.used & word.address.bit() == 0) else { return Ok(()) };
        let shown = brief(&word.text(self.text).to_ascii_uppercase());
        let problem = Diagnostic::new(format!("`{shown}` has no use in this block")).at(word.span());
        Err(match word.address {
            Address::Letter(b'A' | b'B' | b'C' | b'U' | b'V' | b'W') => {
                problem.help("only the axes X, Y and Z are supported")
            }
            Address::Letter(b'I' | b'J' | b'K' | b'R') | Address::Radius => {
                problem.help("it belongs to an arc (`G2`, `G3`) in the plane in force (`G17`, `G18`, `G19`)")
            }
            Address::Letter(b'E') => problem.help("numbers of a program have no exponent"),
            Address::Letter(b'X' | b'Y' | b'Z') => problem.help("write the motion in a block of its own"),
            Address::Degree | Address::Weight | Address::Interval => problem.help("it belongs to a `BSPLINE`"),
            _ => problem.help("remove it, or write the code that it belongs to into the same block"),
        })
    }

    /// No word but G and M stands twice in a block.
    pub(super) fn once(&self) -> Result<(), Diagnostic> {
        let mut seen = 0;
        for word in self.words {
            let bit = word.address.bit();
            let several = matches!(word.address, Address::Letter(b'G' | b'M') | Address::Switch);
            if seen & bit != 0 && !several {
                let shown = brief(&word.text(self.text).to_ascii_uppercase());
                return Err(Diagnostic::new(format!("`{shown}`: the word is in this block already"))
                    .at(word.span())
                    .label("again here")
                    .help("remove one of them"));
            }
            seen |= bit;
        }
        Ok(())
    }
}
