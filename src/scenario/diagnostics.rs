//! What is wrong with a scenario, all of it at once.

use std::fmt;

use annotate_snippets::{Group, Level, Renderer};

pub use crate::diagnostics::Diagnostic;
use crate::diagnostics::Line;
pub(super) use crate::diagnostics::brief;

/// Most problems that are shown; the rest is counted.
const MOST_SHOWN: usize = 20;

/// Everything that is wrong, in the order in which it is found.
pub(super) type Problems = Vec<Diagnostic>;

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
            out.push_str(&problem.rendered(&self.origin, &self.source, 0, &renderer));
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
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.render(false).trim_end())
    }
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
