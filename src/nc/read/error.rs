//! Why a program could not be read.

use std::fmt;
use std::io;

use annotate_snippets::Renderer;

use crate::diagnostics::{Diagnostic, Line};

/// Why a program could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NcError {
    /// Something in the text is wrong or not known.
    #[error(transparent)]
    Syntax(Box<SyntaxError>),
    /// Reading failed.
    #[error("cannot read {origin}: {source}")]
    Read {
        /// What the text comes from.
        origin: String,
        /// Why.
        source: io::Error,
    },
}

/// Something in a program that is wrong or not known, with its place.
///
/// [`fmt::Display`] gives what the command line prints, without colour; [`SyntaxError::render`] gives it with colour.
#[derive(Debug, Clone, PartialEq)]
pub struct SyntaxError {
    origin: String,
    line: usize,
    text: String,
    problem: Diagnostic,
}

impl SyntaxError {
    pub(super) fn new(origin: &str, line: usize, text: &str, problem: Diagnostic) -> Self {
        Self { origin: origin.to_owned(), line, text: text.to_owned(), problem }
    }

    /// Where the text comes from: a file name, as a person knows it.
    pub fn origin(&self) -> &str {
        &self.origin
    }

    /// The line, from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// The column in characters, from 1.
    pub fn column(&self) -> usize {
        let start = self.problem.span.as_ref().map_or(0, |span| span.start);
        Line::around(&self.text, start).column_of(start)
    }

    /// What is wrong.
    pub fn message(&self) -> &str {
        &self.problem.message
    }

    /// What to do.
    pub fn help(&self) -> &[String] {
        &self.problem.help
    }

    /// The problem with its line underlined and what to do about it, ending in a newline. `colour` adds ANSI escape codes.
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour { Renderer::styled().hyperlink(false) } else { Renderer::plain() };
        let mut text = self.problem.rendered(&self.origin, &self.text, self.line.saturating_sub(1), &renderer);
        text.push('\n');
        text
    }
}

impl std::error::Error for SyntaxError {}

impl fmt::Display for SyntaxError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.render(false).trim_end())
    }
}
