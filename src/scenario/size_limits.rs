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
            Err(Diagnostic::new(format!(
                "`{name}` holds {items} items: at most {MAX_ARRAY_ITEMS} are read from a file"
            ))
            .at(key)
            .label("this array")
            .help("use fewer points (a spline needs few), or build the path in Rust: `path::PhSpline` takes more"))
        }
        _ => Ok(()),
    }
}

/// The problem of a text over [`MAX_TEXT_BYTES`], of which at least the first part is known.
pub(super) fn too_long(text: &str) -> Diagnostic {
    let problem = Diagnostic::new(format!("the scenario is longer than {} MiB: it is not read", MAX_TEXT_BYTES >> 20));
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

/// A bracket that is open.
struct Open {
    /// The key whose value it belongs to.
    key: Range<usize>,
    /// `{` rather than `[`.
    is_table: bool,
    commas: usize,
    /// Whether something stands after the last comma.
    started: bool,
}

impl Open {
    fn items(&self) -> usize {
        self.commas + usize::from(self.started)
    }
}

/// Reads just enough of TOML (strings, comments, brackets, keys) to count; takes any text and never fails.
fn scan(text: &str) -> Census {
    let bytes = text.as_bytes();
    let mut census = Census::default();
    let mut open: Vec<Open> = Vec::new();
    // Whether a key stands here (before a `=`, or in a table header), which one, and how many dots it has.
    let (mut in_key, mut key, mut dots) = (true, 0..0, 0);
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let mut end = at + 1;
        match byte {
            b' ' | b'\t' | b'\r' => {}
            b'#' => end = skip_while(bytes, at, |b| b != b'\n'),
            b'\n' => {
                if open.is_empty() {
                    (in_key, dots) = (true, 0);
                }
            }
            b'=' => (in_key, dots) = (false, 0),
            b'[' if open.is_empty() && in_key => {}
            b'[' | b'{' => {
                start_item(&mut open);
                if open.len() == MAX_DEPTH {
                    census.too_deep = Some(at..end);
                    return census;
                }
                let is_table = byte == b'{';
                open.push(Open { key: key.clone(), is_table, commas: 0, started: false });
                (in_key, dots) = (is_table, 0);
            }
            b']' | b'}' => {
                if let Some(closed) = open.pop() {
                    census.count(&closed);
                    in_key = false;
                }
            }
            b',' => {
                if let Some(inner) = open.last_mut() {
                    inner.commas += 1;
                    inner.started = false;
                    (in_key, dots) = (inner.is_table, 0);
                }
            }
            b'.' if in_key => {
                dots += 1;
                if dots == MAX_DEPTH {
                    census.too_deep = Some(at..end);
                    return census;
                }
            }
            _ => {
                start_item(&mut open);
                end = match byte {
                    b'"' | b'\'' => skip_string(bytes, at),
                    _ => skip_while(bytes, end, |b| !b" \t\r\n#=[]{},\"'".contains(&b) && (b != b'.' || !in_key)),
                };
                if in_key {
                    key = at..end;
                }
            }
        }
        at = end;
    }
    for unclosed in &open {
        census.count(unclosed);
    }
    census
}

impl Census {
    fn count(&mut self, array: &Open) {
        let items = array.items();
        if !array.is_table && self.biggest.as_ref().is_none_or(|(_, most)| items > *most) {
            self.biggest = Some((array.key.clone(), items));
        }
    }
}

/// Something stands in the innermost bracket.
fn start_item(open: &mut [Open]) {
    if let Some(inner) = open.last_mut() {
        inner.started = true;
    }
}

/// The first place from `at` on where `condition` does not hold.
fn skip_while(bytes: &[u8], at: usize, condition: impl Fn(u8) -> bool) -> usize {
    bytes.iter().skip(at).position(|&b| !condition(b)).map_or(bytes.len(), |n| at + n)
}

/// The place after the string that starts at `at`, or after its line where a one-line string is not closed.
fn skip_string(bytes: &[u8], at: usize) -> usize {
    let rest = bytes.get(at..).unwrap_or_default();
    let quote = rest.first().copied().unwrap_or(b'"');
    let is_end = |i: usize| rest.iter().skip(i).take(3).filter(|&&b| b == quote).count() == 3;
    let long = is_end(0);
    let mut i = if long { 3 } else { 1 };
    while let Some(&byte) = rest.get(i) {
        if byte == b'\\' && quote == b'"' {
            i += 1;
        } else if byte == b'\n' && !long {
            return at + i;
        } else if byte == quote && (!long || is_end(i)) {
            return at + i + if long { 3 } else { 1 };
        }
        i += 1;
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn biggest(text: &str) -> Option<(&str, usize)> {
        scan(text).biggest.map(|(key, items)| (text.get(key).unwrap(), items))
    }

    #[test]
    fn the_array_with_the_most_items_is_found_with_its_key() {
        let text = "[a.b] # [[[[\nname = \"x = [1, 2, 3, 4, 5]\"\nlong = [[1, 2], [3, 4],\n [5, 6], # seven, eight\n]\nt = { k = [1, 2], l = 3 }\n";
        assert_eq!(biggest(text), Some(("long", 3)));
        assert_eq!(biggest("t = { u = 1, k = [1, 2, 3], l = 3 }"), Some(("k", 3)));
        assert_eq!(biggest("a.b.\"c d\" = [1, 2"), Some(("\"c d\"", 2)));
        assert_eq!(biggest("x = '''\n[1,2,3]\n''' \ny = [1]"), Some(("y", 1)));
        assert_eq!(biggest("x = \"\\\"[1,2\"\ny = [1, 1.5, -2e3]"), Some(("y", 3)));
        assert_eq!(biggest("[table]\nx = 1"), None);
    }

    #[test]
    fn depth_is_bounded() {
        for text in [
            format!("a = {}", "[".repeat(100_000)),
            format!("a = {}", "{a=".repeat(100_000)),
            format!("a{} = 1", ".a".repeat(100_000)),
            format!("[a{}]", ".a".repeat(100_000)),
        ] {
            let problem = check(&text).unwrap_err();
            assert!(problem.message.contains("too deeply"), "{problem:?}");
        }
        assert_eq!(check("[a.b.c.d]\ne.f = [[[1.5]], [[2.5]], { g.h = 3 }]\n"), Ok(()));
    }

    #[test]
    fn any_text_is_taken() {
        for text in ["\"", "'''", "]]]}}}", "\"\\", "=[,,,]", "é'é\"é", "a = [\"\n]"] {
            check(text).unwrap();
        }
    }
}
