//! The text of the built-in alpha, and pieces of it replaced.

use std::fmt::Write as _;

use servosim::scenario::{Document, Scenario, ScenarioError};

/// The text of the built-in alpha.
pub fn alpha() -> String {
    Document::builtin("alpha").unwrap().text().to_owned()
}

/// The same without comments and empty lines, so that a piece of it is found where it counts.
pub fn bare() -> String {
    let text = alpha();
    let lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    lines.fold(String::new(), |mut out, line| {
        let _ = writeln!(out, "{line}");
        out
    })
}

/// alpha (without comments) with one piece of its text replaced.
pub fn altered(from: &str, to: &str) -> String {
    let text = bare();
    assert!(text.contains(from), "alpha.toml holds no `{from}`");
    text.replacen(from, to, 1)
}

pub fn refusal(text: &str) -> ScenarioError {
    match Scenario::from_toml(text, "it.toml") {
        Err(error) => error,
        Ok(scenario) => panic!("accepted: {scenario:?}\n{text}"),
    }
}
