//! What is refused before the text is parsed: too long, too deep, too many points.

use std::ops::Range;

use super::diagnostics::{Diagnostic, brief};

/// Longest scenario text \[bytes\].
pub const MAX_TEXT_BYTES: usize = 64 << 20;

/// Most points (or other items) of one array in a scenario.
pub const MAX_ARRAY_ITEMS: usize = 1_000_000;

/// Deepest nesting of brackets, and most parts of a dotted key.
const MAX_DEPTH: usize = 16;

/// What a scan of the text found.
#[derive(Debug, Default)]
struct Census {
    /// Key and number of items of the array with the most items.
    biggest: Option<(Range<usize>, usize)>,
    /// The bracket or key that is too deep.
    too_deep: Option<Range<usize>>,
}

/// Refuses a text that would cost too much to parse.
pub(super) fn check(text: &str) -> Result<(), Diagnostic> {
    if text.len() > MAX_TEXT_BYTES {
        return Err(too_long(text));
    }
    let census = scan(text);
    if let Some(span) = census.too_deep {
        return Err(Diagnostic::new("the text is nested too deeply")
            .at(span)
            .label("this is where it becomes too deep")
            .help(format!("a scenario needs no more than 4 levels; up to {MAX_DEPTH} are read")));
    }
    match census.biggest {
        Some((key, items)) if items > MAX_ARRAY_ITEMS => {
            let name = brief(text.get(key.clone()).unwrap_or_default());
            Err(Diagnostic::new(format!("`{name}` holds {items} items: at most {MAX_ARRAY_ITEMS} are read from a file"))
                .at(key)
                .label("this array")
                .help("leave out points (a spline needs few), or make the path from Rust: `path::PhSpline` takes more"))
        }
        _ => Ok(()),
    }
}

/// The problem of a text over [`MAX_TEXT_BYTES`], of which at least the first part is known.
pub(super) fn too_long(text: &str) -> Diagnostic {
    let problem =
        Diagnostic::new(format!("the scenario is longer than {} MiB: it is not read", MAX_TEXT_BYTES >> 20));
    match scan(text).biggest {
        Some((key, items)) => {
            let name = brief(text.get(key.clone()).unwrap_or_default());
            problem
                .at(key)
                .label(format!("the biggest array, at least {items} items"))
                .help(format!("give `{name}` fewer items: at most {MAX_ARRAY_ITEMS} are read from a file"))
        }
        None => problem.help("is this a scenario? `servosim new NAME` writes one to start from"),
    }
}

/// Where the scan is.
enum Place {
    /// Before a `=`, or in a table header.
    Key,
    /// After it.
    Value,
}

/// Reads just enough of TOML (strings, comments, brackets, keys) to count; takes any text and never fails.
fn scan(text: &str) -> Census {
    let bytes = text.as_bytes();
    let mut census = Census::default();
    // Key and commas of each open bracket.
    let mut open: Vec<(Range<usize>, usize, bool)> = Vec::new();
    let mut place = Place::Key;
    let mut key = 0..0;
    let mut dots = 0;
    let mut at = 0;
    let close = |census: &mut Census, (key, commas, some): (Range<usize>, usize, bool)| {
        let items = commas + usize::from(some);
        if census.biggest.as_ref().is_none_or(|(_, most)| items > *most) {
            census.biggest = Some((key, items));
        }
    };
    while let Some(&byte) = bytes.get(at) {
        match byte {
            b'#' => at = skip_to(bytes, at, b'\n').saturating_sub(1),
            b'"' | b'\'' => {
                let end = skip_string(bytes, at);
                if matches!(place, Place::Key) {
                    key = if dots > 0 { key.start..end } else { at..end };
                }
                mark(&mut open);
                at = end - 1;
            }
            b'\n' if open.is_empty() => (place, dots) = (Place::Key, 0),
            b'=' => (place, dots) = (Place::Value, 0),
            b'[' if open.is_empty() && matches!(place, Place::Key) => dots = 0,
            b'[' | b'{' => {
                mark(&mut open);
                if open.len() == MAX_DEPTH {
                    census.too_deep = Some(at..at + 1);
                    return census;
                }
                open.push((key.clone(), 0, false));
                place = if byte == b'{' { Place::Key } else { Place::Value };
                dots = 0;
            }
            b']' | b'}' => {
                if let Some(closed) = open.pop() {
                    close(&mut census, closed);
                }
                place = if open.is_empty() && byte == b']' { Place::Key } else { Place::Value };
            }
            b',' => {
                if let Some((_, commas, some)) = open.last_mut() {
                    *commas += 1;
                    *some = false;
                }
                // In an inline table a key follows; in an array this only renames what has no key.
                if !matches!(place, Place::Key) && in_table(bytes, at) {
                    place = Place::Key;
                }
                dots = 0;
            }
            b'.' if matches!(place, Place::Key) => {
                dots += 1;
                if dots == MAX_DEPTH {
                    census.too_deep = Some(key.start..at + 1);
                    return census;
                }
            }
            b' ' | b'\t' | b'\r' | b'\n' => {}
            _ => {
                mark(&mut open);
                let end = skip_word(bytes, at);
                if matches!(place, Place::Key) {
                    key = if dots > 0 { key.start..end } else { at..end };
                }
                at = end - 1;
            }
        }
        at += 1;
    }
    while let Some(unclosed) = open.pop() {
        close(&mut census, unclosed);
    }
    census
}

/// Notes that the innermost bracket has something since its last comma.
fn mark(open: &mut [(Range<usize>, usize, bool)]) {
    if let Some((_, _, some)) = open.last_mut() {
        *some = true;
    }
}
