//! A program's text, line by line, to blocks.

use std::collections::VecDeque;
use std::io::BufRead;

use super::block_words::BlockWords;
use super::error::NcError;
use super::error::SyntaxError;
use super::g_codes::Codes;
use super::initial_position::FirstPlace;
use super::lines::MAX_LINE_BYTES;
use super::lines::{Advance, Lines};
use super::modal_state::ModalState;
use super::reading::Reading;
use super::words::Words;
use crate::diagnostics::Diagnostic;
use crate::nc::{Action, Block};

/// Reads a program as a stream of blocks, in memory that does not grow with it (one curve is held at a time, at most
/// [`MAX_CONTROL_POINTS`](crate::nc::MAX_CONTROL_POINTS) points).
///
/// Ends after the first error. What stands after the program's end (`M30`, `M2`, `M17` or the second `%`) is an error unless it is a comment.
///
/// # Errors
/// [`NcError::Syntax`] with line and column of what is wrong or not known; [`NcError::Read`] where reading fails.
#[derive(Debug)]
pub struct Reader<R> {
    lines: Lines<R>,
    words: Words,
    origin: String,
    reading: Reading,
    ready: VecDeque<Block>,
    initial_position: FirstPlace,
    failed: Option<NcError>,
    over: bool,
    state: ModalState,
}

impl<R: BufRead> Reader<R> {
    /// Reads a program; `origin` is what messages call it.
    pub fn new(input: R, origin: impl Into<String>, reading: Reading) -> Self {
        Self {
            lines: Lines::new(input),
            words: Words::default(),
            origin: origin.into(),
            reading,
            ready: VecDeque::new(),
            initial_position: FirstPlace::new(reading.start_mm.is_some()),
            failed: None,
            over: false,
            state: ModalState::new(reading.start_mm),
        }
    }

    /// Reads one line; the blocks that it makes are then ready.
    fn step(&mut self) -> Result<(), NcError> {
        let advance = self.lines.advance().map_err(|source| NcError::Read { origin: self.origin.clone(), source })?;
        let result = match advance {
            Advance::Line => self.line(),
            Advance::TooLong => Err(Diagnostic::new("the line is too long")
                .at(0..0)
                .help(format!("a line has at most {MAX_LINE_BYTES} bytes: is this an NC program?"))),
            Advance::End => {
                self.over = true;
                self.state.end_curve(self.reading.uniform_knots, &mut self.ready)
            }
        };
        result.map_err(|problem| {
            let text = &self.lines.text;
            // What is wrong with a whole block is marked from its first to its last character.
            let first = text.len() - text.trim_start().len();
            let whole = first..text.trim_end().len().max(first);
            let problem = if problem.span.is_none() { problem.at(whole) } else { problem };
            NcError::Syntax(Box::new(SyntaxError::new(&self.origin, self.lines.number.max(1), text, problem)))
        })
    }

    fn line(&mut self) -> Result<(), Diagnostic> {
        let (text, number) = (self.lines.text.as_str(), self.lines.number);
        self.words.cut(text)?;
        for comment in self.words.comments.drain(..) {
            self.ready.push_back(self.state.still(number, Action::Comment(comment)));
        }
        if self.words.mark {
            if self.state.begun {
                self.state.end_curve(self.reading.uniform_knots, &mut self.ready)?;
                self.state.ended = true;
            }
            self.state.begun = true;
            return Ok(());
        }
        if self.words.list.is_empty() || (self.words.deletable && self.reading.skip_deleted) {
            return Ok(());
        }
        self.state.begun = true;
        let mut block_words = BlockWords::new(&self.words.list, text);
        if self.state.ended {
            return Err(Diagnostic::new("the program has ended before this block")
                .at(block_words.all())
                .help("remove everything after `M30`, `M2`, `M17` or the second `%`"));
        }
        block_words.once()?;
        let codes = Codes::of(&self.words, text)?;
        block_words.used = codes.used;
        self.state.block(&codes, &mut block_words, number, &self.reading, &mut self.ready)
    }
}

impl<R: BufRead> Iterator for Reader<R> {
    type Item = Result<Block, NcError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if self.initial_position.settled()
                && let Some(block) = self.ready.pop_front()
            {
                return Some(Ok(block));
            }
            if self.over {
                return self.failed.take().map(Err);
            }
            if let Err(error) = self.step() {
                self.over = true;
                self.ready.clear();
                self.failed = Some(error);
            }
            if !self.initial_position.settled() {
                for block in self.ready.drain(..) {
                    self.initial_position.hold(block, self.state.known);
                }
                if self.initial_position.settled() || self.over {
                    self.ready.extend(self.initial_position.settle());
                }
            }
        }
    }
}
