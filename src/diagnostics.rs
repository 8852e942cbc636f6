//! Problems of a text that a user wrote, shown with the line that they are on.

use std::fmt::Write as _;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};

/// Most characters of a source line that are shown before and after the place that is pointed at.
const CONTEXT: (usize, usize) = (50, 80);

/// One problem of a text that a user wrote.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// What is wrong.
    pub message: String,
    /// Where in the text, in bytes; none where the problem has no place in it.
    pub span: Option<Range<usize>>,
    /// A few words for the place itself; may be empty.
    pub label: String,
    /// What else is worth knowing.
    pub notes: Vec<String>,
    /// What to do.
    pub help: Vec<String>,
}

impl Diagnostic {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self {
            message: readable_numbers(&message.into()),
            span: None,
            label: String::new(),
            notes: Vec::new(),
            help: Vec::new(),
        }
    }

    pub(crate) fn at(mut self, span: Range<usize>) -> Self {
        self.span = Some(span);
        self
    }

    pub(crate) fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    pub(crate) fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help.push(help.into());
        self
    }

    /// The problem with its line underlined and what to do about it. `source` is the text, or the part of it that begins
    /// after `lines_before` lines; `origin` is what a person calls it.
    pub(crate) fn rendered(&self, origin: &str, source: &str, lines_before: usize, renderer: &Renderer) -> String {
        let mut group = Group::with_title(Level::ERROR.primary_title(printable(&self.message)));
        let origin = printable(origin);
        // The column of a cropped line, as the renderer sees it and as it is.
        let mut columns = None;
        if let Some(span) = &self.span {
            let line = Line::around(source, span.start);
            let (shown, marked) = line.cropped(span);
            let seen = 1 + shown.get(..marked.start).map_or(0, |before| before.chars().count());
            let number = lines_before + line.number;
            columns = Some((number, seen, line.column_of(span.start)));
            let mut annotation = AnnotationKind::Primary.span(marked);
            if !self.label.is_empty() {
                annotation = annotation.label(printable(&self.label));
            }
            let snippet = Snippet::source(shown).path(origin.clone()).line_start(number).annotation(annotation);
            group = group.element(snippet);
        } else if !origin.is_empty() {
            group = group.element(Origin::path(origin.clone()));
        }
        for note in &self.notes {
            group = group.element(Level::NOTE.message(printable(note)));
        }
        for help in &self.help {
            group = group.element(Level::HELP.message(printable(help)));
        }
        let text = renderer.render(&[group]);
        match columns {
            Some((line, seen, is)) if seen != is => {
                text.replacen(&format!("{origin}:{line}:{seen}"), &format!("{origin}:{line}:{is}"), 1)
            }
            _ => text,
        }
    }
}

/// One line of a text.
pub(crate) struct Line<'a> {
    /// From 1.
    pub(crate) number: usize,
    /// Byte offset of its first character.
    start: usize,
    /// Without its line end.
    text: &'a str,
}

impl<'a> Line<'a> {
    pub(crate) fn around(source: &'a str, byte: usize) -> Self {
        let byte = floor_char_boundary(source, byte);
        let (before, after) = source.split_at(byte);
        let start = before.rfind('\n').map_or(0, |at| at + 1);
        let end = after.find('\n').map_or(source.len(), |at| byte + at);
        let number = 1 + before.bytes().filter(|&b| b == b'\n').count();
        let text = source.get(start..end).unwrap_or_default();
        Self { number, start, text: text.strip_suffix('\r').unwrap_or(text) }
    }

    fn offset(&self, byte: usize) -> usize {
        floor_char_boundary(self.text, byte.saturating_sub(self.start))
    }

    pub(crate) fn column_of(&self, byte: usize) -> usize {
        1 + self.text.get(..self.offset(byte)).map_or(0, |before| before.chars().count())
    }

    /// The line as it may be shown, and where `span` lies in that.
    fn cropped(&self, span: &Range<usize>) -> (String, Range<usize>) {
        let from = self.offset(span.start);
        let to = self.offset(span.end).max(from);
        let (before, rest) = self.text.split_at(from);
        let first = before.char_indices().rev().take(CONTEXT.0).last().map_or(from, |(at, _)| at);
        let last = rest.char_indices().nth(CONTEXT.1).map_or(self.text.len(), |(at, _)| from + at);

        let mut shown = String::new();
        if first > 0 {
            shown.push('…');
        }
        let mut marked = None;
        let mut end = None;
        for (at, c) in self.text.get(first..last).unwrap_or_default().char_indices() {
            if first + at == from {
                marked = Some(shown.len());
            }
            if first + at == to {
                end = Some(shown.len());
            }
            shown.push(visible(c));
        }
        let start = marked.unwrap_or(shown.len());
        let end = end.unwrap_or(shown.len()).max(start);
        if last < self.text.len() {
            shown.push('…');
        }
        (shown, start..end)
    }
}

fn floor_char_boundary(text: &str, byte: usize) -> usize {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
}

/// Characters that change the direction or the place of what follows, or that cannot be seen.
fn is_harmful(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}')
}

/// One character for one, so that columns stay right.
fn visible(c: char) -> char {
    match c {
        '\t' => ' ',
        '\u{7f}' => '␡',
        '\0'..='\u{1f}' => char::from_u32(0x2400 + u32::from(c)).unwrap_or('\u{fffd}'),
        c if is_harmful(c) => '\u{fffd}',
        c => c,
    }
}

/// `text` with every control character written out (newlines stay).
pub(crate) fn printable(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if c != '\n' && is_harmful(c) {
            out.extend(c.escape_unicode());
        } else {
            out.push(c);
        }
    }
    out
}

/// A name or value of the user's as it is shown in a message: on one line and not too long.
pub(crate) fn brief(text: &str) -> String {
    const MOST: usize = 60;
    let mut out: String = text.chars().take(MOST).map(|c| if c == '\n' { ' ' } else { c }).collect();
    if text.chars().nth(MOST).is_some() {
        out.push('…');
    }
    printable(&out)
}

/// A number as a person reads it in a message: its own digits where they are few, six of them where they are many.
pub(crate) fn readable(value: f64) -> String {
    let magnitude = value.abs();
    let in_full = magnitude == 0.0 || (1e-4..1e9).contains(&magnitude);
    let text = if in_full { value.to_string() } else { format!("{value:e}") };
    if text.len() <= 10 || !value.is_finite() {
        return text;
    }
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if in_full { rounded.to_string() } else { format!("{rounded:e}") }
}

/// `text` with every number of more than 20 digits written with an exponent: 1e300 rather than 1 and 300 zeros.
fn readable_numbers(text: &str) -> String {
    const MOST: usize = 20;
    let is_number = |c: char| c.is_ascii_digit() || c == '.';
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find(is_number) {
        let (before, from) = rest.split_at(start);
        let (number, after) = from.split_at(from.find(|c| !is_number(c)).unwrap_or(from.len()));
        out.push_str(before);
        let _ = match number.parse::<f64>() {
            // Writing to a string does not fail.
            Ok(value) if number.len() > MOST => write!(out, "{value:e}"),
            _ => out.write_str(number),
        };
        rest = after;
    }
    out.push_str(rest);
    out
}
