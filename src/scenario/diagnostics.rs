//! Problems of a scenario, shown with the line that they are on.

use std::fmt::{self, Write as _};
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};

/// Most problems that are shown; the rest is counted.
const MOST_SHOWN: usize = 20;

/// Most characters of a source line that are shown before and after the place that is pointed at.
const CONTEXT: (usize, usize) = (50, 80);

/// One problem of a scenario.
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
    pub(super) fn new(message: impl Into<String>) -> Self {
        Self {
            message: readable_numbers(&message.into()),
            span: None,
            label: String::new(),
            notes: Vec::new(),
            help: Vec::new(),
        }
    }

    pub(super) fn at(mut self, span: Range<usize>) -> Self {
        self.span = Some(span);
        self
    }

    pub(super) fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    pub(super) fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    pub(super) fn help(mut self, help: impl Into<String>) -> Self {
        self.help.push(help.into());
        self
    }
}

/// A scenario that cannot be used, with everything that is wrong with it.
///
/// [`fmt::Display`] gives what the command line prints, without colour; [`ScenarioError::render`] gives it with colour.
#[derive(Debug, Clone)]
pub struct ScenarioError {
    origin: String,
    source: String,
    problems: Vec<Diagnostic>,
}

impl std::error::Error for ScenarioError {}

impl ScenarioError {
    pub(super) fn new(origin: impl Into<String>, source: impl Into<String>, problems: Vec<Diagnostic>) -> Self {
        Self { origin: origin.into(), source: source.into(), problems }
    }

    /// Where the text comes from: a file name, as a person knows it.
    pub fn origin(&self) -> &str {
        &self.origin
    }

    /// What is wrong, in the order of checking.
    pub fn problems(&self) -> &[Diagnostic] {
        &self.problems
    }

    /// Line and column of a byte of the text, both from 1; columns count characters.
    pub fn line_column(&self, byte: usize) -> (usize, usize) {
        let line = Line::around(&self.source, byte);
        (line.number, line.column_of(byte))
    }

    /// Every problem with its line underlined and what to do about it, ending in a newline.
    ///
    /// `colour` adds ANSI escape codes. Control characters of the text are made visible, long lines are cropped.
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour { Renderer::styled().hyperlink(false) } else { Renderer::plain() };
        let mut out = String::new();
        for problem in self.problems.iter().take(MOST_SHOWN) {
            out.push_str(&self.rendered(problem, &renderer));
            out.push_str("\n\n");
        }
        if let Some(more @ 1..) = self.problems.len().checked_sub(MOST_SHOWN) {
            out.push_str(&renderer.render(&[Group::with_title(
                Level::ERROR.primary_title(format!("{more} more problems are not shown")),
            )]));
            out.push('\n');
        }
        while out.ends_with("\n\n") {
            out.pop();
        }
        out
    }

    fn rendered(&self, problem: &Diagnostic, renderer: &Renderer) -> String {
        let mut group = Group::with_title(Level::ERROR.primary_title(printable(&problem.message)));
        let origin = printable(&self.origin);
        // The column of a cropped line, as the renderer sees it and as it is.
        let mut columns = None;
        if let Some(span) = &problem.span {
            let line = Line::around(&self.source, span.start);
            let (shown, marked) = line.cropped(span);
            let seen = 1 + shown.get(..marked.start).map_or(0, |before| before.chars().count());
            columns = Some((line.number, seen, line.column_of(span.start)));
            let mut annotation = AnnotationKind::Primary.span(marked);
            if !problem.label.is_empty() {
                annotation = annotation.label(printable(&problem.label));
            }
            let snippet = Snippet::source(shown).path(origin.clone()).line_start(line.number).annotation(annotation);
            group = group.element(snippet);
        } else if !self.origin.is_empty() {
            group = group.element(Origin::path(origin.clone()));
        }
        for note in &problem.notes {
            group = group.element(Level::NOTE.message(printable(note)));
        }
        for help in &problem.help {
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

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.render(false).trim_end())
    }
}

/// One line of a text.
struct Line<'a> {
    /// From 1.
    number: usize,
    /// Byte offset of its first character.
    start: usize,
    /// Without its line end.
    text: &'a str,
}

impl<'a> Line<'a> {
    fn around(source: &'a str, byte: usize) -> Self {
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

    fn column_of(&self, byte: usize) -> usize {
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
pub(super) fn printable(text: &str) -> String {
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
pub(super) fn brief(text: &str) -> String {
    const MOST: usize = 60;
    let mut out: String = text.chars().take(MOST).map(|c| if c == '\n' { ' ' } else { c }).collect();
    if text.chars().nth(MOST).is_some() {
        out.push('…');
    }
    printable(&out)
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

/// The candidate that `name` was probably meant to be.
pub(super) fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name: String = name.chars().take(100).collect::<String>().to_lowercase();
    let mut best = None;
    let mut best_score = 0.75;
    for candidate in candidates {
        let score = strsim::jaro_winkler(&name, &candidate.to_lowercase());
        if score > best_score {
            (best, best_score) = (Some(candidate), score);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_is_cropped_around_its_place() {
        let source = format!("first\nvalues = [{}\u{1b}bad, {}]", "1, ".repeat(100_000), "2, ".repeat(100_000));
        let at = source.find("\u{1b}bad").unwrap();
        let error = ScenarioError::new("long.toml", source, vec![Diagnostic::new("it is bad").at(at..at + 4)]);
        let text = error.to_string();
        assert!(text.len() < 800, "{text}");
        assert!(text.contains("long.toml:2:300011"), "{text}");
        assert!(text.contains("␛bad"), "{text}");
        assert!(!text.contains('\u{1b}'), "{text}");
    }

    #[test]
    fn a_place_at_or_past_the_end_is_shown_too() {
        for source in ["", "a", "a\n", "ä"] {
            for span in [0..0, 1..2, 7..9] {
                let error = ScenarioError::new("x", source, vec![Diagnostic::new("m").at(span.clone())]);
                assert!(error.to_string().contains("--> x:"), "{source:?} {span:?}: {error}");
            }
        }
    }

    #[test]
    fn columns_count_characters() {
        let error = ScenarioError::new("x", "µ = 'é'\r\nzwei = 2", vec![]);
        assert_eq!(error.line_column(5), (1, 5));
        assert_eq!(error.line_column("µ = 'é'\r\nzwei".len()), (2, 5));
    }

    #[test]
    fn long_numbers_are_written_with_an_exponent() {
        let long = |value: f64| Diagnostic::new(format!("x = {value}, at most 1e9.")).message;
        assert_eq!(long(1e300), "x = 1e300, at most 1e9.");
        assert_eq!(long(-1e-300), "x = -1e-300, at most 1e9.");
        assert_eq!(long(-12.5), "x = -12.5, at most 1e9.");
        assert_eq!(long(9_223_372_036_854_775_807.0), "x = 9223372036854776000, at most 1e9.");
    }

    #[test]
    fn the_nearest_name_is_found_and_a_far_one_is_not() {
        let keys = ["kpp", "kpv", "kiv", "contour_error_um", "closed"];
        assert_eq!(nearest("contour_error", keys), Some("contour_error_um"));
        assert_eq!(nearest("KPV", keys), Some("kpv"));
        assert_eq!(nearest("elephant", keys), None);
    }
}
