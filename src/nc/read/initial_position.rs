//! The initial position of the tool, where the program does not state it.

use crate::nc::{Action, Block};

/// Most blocks that are held back.
const MOST_HELD: usize = 1000;

/// The first blocks of a program, held back until every axis has been given a place.
///
/// An axis is taken to be where the program first puts it: a program that begins `G0 X58 Y30 Z19` begins there, and does not cut
/// its way from the origin. At the first motion at the feed (or after [`MOST_HELD`] blocks) what is still not known is 0.
#[derive(Debug)]
pub(super) struct FirstPlace {
    held: Vec<Held>,
    settled: bool,
}

#[derive(Debug)]
struct Held {
    block: Block,
    /// Which axes have a place after it.
    known: [bool; 3],
}

impl FirstPlace {
    /// Nothing is held back where the place is `given`.
    pub(super) fn new(given: bool) -> Self {
        Self { held: Vec::new(), settled: given }
    }

    /// Whether every block that comes now goes out.
    #[inline]
    pub(super) fn settled(&self) -> bool {
        self.settled
    }

    /// Holds a block back, after which these axes have a place.
    pub(super) fn hold(&mut self, block: Block, known: [bool; 3]) {
        let waits = !matches!(block.action, Action::Linear | Action::Arc(_) | Action::Nurbs(_));
        self.held.push(Held { block, known });
        self.settled = !waits || known == [true; 3] || self.held.len() >= MOST_HELD;
    }

    /// The blocks held, with the places that are known now.
    pub(super) fn settle(&mut self) -> impl Iterator<Item = Block> + '_ {
        self.settled = true;
        for axis in 0..3 {
            if let Some(first) = self.held.iter().position(|held| held.known[axis]) {
                let place = self.held[first].block.end_mm[axis];
                for held in &mut self.held[..first] {
                    held.block.start_mm[axis] = place;
                    held.block.end_mm[axis] = place;
                }
                self.held[first].block.start_mm[axis] = place;
            }
        }
        self.held.drain(..).map(|held| held.block)
    }
}
