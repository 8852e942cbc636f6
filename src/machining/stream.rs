//! Motions and their spans, as they are needed.

use super::feed::FeedPlanner;
use super::shape::{Motion, MotionReader};
use super::{Machine, ProgramError};
use crate::feedrate::Span;
use crate::nc::{Block, NcError};

/// A length or time as a sum without loss over any number of terms.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Sum {
    high: f64,
    low: f64,
}

impl Sum {
    pub(super) fn add(&mut self, value: f64) {
        // Knuth's two-sum.
        let sum = self.high + value;
        let part = sum - self.high;
        self.low += (self.high - (sum - part)) + (value - part);
        self.high = sum;
    }

    pub(super) fn value(&self) -> f64 {
        self.high + self.low
    }

    /// `value - self`, exact to rounding of the difference.
    pub(super) fn until(&self, value: f64) -> f64 {
        (value - self.high) - self.low
    }

    /// `self - other`.
    pub(super) fn since(&self, other: &Self) -> f64 {
        (self.high - other.high) + (self.low - other.low)
    }
}

/// What comes out of a program next.
pub(super) enum Next {
    /// A motion, whose span comes later.
    Motion(Motion),
    /// How to run along the motions that have come.
    Span(Span),
    /// Nothing more: the tool rests for this long after the last motion \[s\].
    End(f64),
}

/// The stream of both; motions come before the spans along them.
#[derive(Debug, Clone)]
pub(super) struct Stream<I> {
    pub(super) shapes: MotionReader<I>,
    planner: FeedPlanner,
    over: bool,
}

impl<I: Iterator<Item = Result<Block, NcError>>> Stream<I> {
    pub(super) fn new(blocks: I, machine: &Machine) -> Result<Self, ProgramError> {
        machine.check()?;
        let planner = FeedPlanner::new(machine).map_err(|fault| ProgramError::Motion { line: 0, fault })?;
        Ok(Self { shapes: MotionReader::new(blocks), planner, over: false })
    }

    /// The next motion, if the program goes on.
    pub(super) fn pull(&mut self, see: &mut dyn FnMut(&Block)) -> Result<Option<Motion>, ProgramError> {
        if self.over {
            return Ok(None);
        }
        let Some(motion) = self.shapes.next_seeing(see) else {
            self.over = true;
            self.planner.look_ahead.finish();
            return Ok(None);
        };
        let motion = motion?;
        let line = motion.place.line;
        self.planner.push(&motion).map_err(|fault| ProgramError::Motion { line, fault })?;
        Ok(Some(motion))
    }

    /// A span if one is settled, else a motion.
    pub(super) fn next(&mut self, see: &mut dyn FnMut(&Block)) -> Result<Next, ProgramError> {
        if let Some(span) = self.planner.look_ahead.next() {
            return Ok(Next::Span(span));
        }
        if let Some(motion) = self.pull(see)? {
            return Ok(Next::Motion(motion));
        }
        Ok(match self.planner.look_ahead.next() {
            Some(span) => Next::Span(span),
            None => Next::End(self.shapes.pause_s()),
        })
    }

    /// Whether the program has been read to its end and every span has been taken.
    pub(super) fn is_over(&self) -> bool {
        self.over && !self.planner.look_ahead.is_ready()
    }
}
