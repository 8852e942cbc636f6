//! What the TOML and serde errors mean for a scenario, in words that help.

use std::ops::Range;

use serde_json::Value;
use toml::de::{DeTable, DeValue};

use super::diagnostics::{Diagnostic, brief, nearest};
use super::document_kind::DocumentKind;
use super::numbers::{POINT, POINT3};
use super::schema::choices;

/// The first syntax error of a text.
pub(super) fn syntax(error: &toml::de::Error, text: &str) -> Diagnostic {
    let span = error.span().unwrap_or(text.len()..text.len());
    let mut message = error.message();
    let mut help =
        "a scenario is TOML: `key = value` lines under [table] headers; `servosim new NAME` writes an example";
    let rest = text.get(span.start..).unwrap_or_default();
    if message.starts_with("string values must be quoted") {
        if rest.trim_start_matches([' ', '\t']).starts_with(['\n', '\r', '#']) || rest.trim().is_empty() {
            message = "the key has no value";
            help = "write a value after the `=`, or remove the line";
        } else {
            message = "this is not a TOML value";
            help = "numbers look like 0.001 or 1e-3 (decimal point, no unit), text is in \"quotes\", points are [x, y]";
        }
    } else if is_decimal_comma(text, span.start) {
        message = "a comma in a number";
        help = "write decimals with a point: 97.38, not 97,38";
    } else if message.contains("number overflowed") {
        message = "a whole number beyond 64 bits";
        help = "write big numbers with an exponent, such as 1e20";
    } else if message.starts_with("duplicate key") {
        help = "remove one of the two: a key or table may be given once";
    } else if message.starts_with("key with no value") {
        help = "write `key = value`; a table header is in [brackets]";
    } else if message.contains("basic string") || message.contains("literal string") {
        help = "a string starts and ends with a quote on the same line; control characters are written as \\u001b";
    }
    Diagnostic::new(format!("not valid TOML: {}", brief_message(message))).at(span).help(help)
}

/// Whether the text from `at` on starts with the comma of a number like `97,38`.
fn is_decimal_comma(text: &str, at: usize) -> bool {
    let is_digit = |c: char| c.is_ascii_digit();
    let (Some(before), Some(after)) = (text.get(..at), text.get(at..)) else { return false };
    // A value, not an item of a list.
    let line = before.rsplit('\n').next().unwrap_or_default();
    let is_item = line.matches(['[', '{']).count() > line.matches([']', '}']).count();
    before.ends_with(is_digit) && after.strip_prefix(',').is_some_and(|rest| rest.starts_with(is_digit)) && !is_item
}

/// What to do about a value of `--set` that is not TOML.
pub(super) fn help_for_value(value: &str, message: &str) -> &'static str {
    let is_decimal = value.split_once(',').is_some_and(|(whole, decimals)| {
        whole.trim_start_matches(['+', '-']).chars().all(|c| c.is_ascii_digit())
            && !decimals.is_empty()
            && decimals.chars().all(|c| c.is_ascii_digit())
    });
    if is_decimal {
        "write decimals with a point: 97.38, not 97,38"
    } else if message.contains("number overflowed") {
        "write big numbers with an exponent, such as 1e20"
    } else if value.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.')) {
        "numbers look like 0.001 or 1e-3: decimal point, no unit"
    } else {
        "put quotes around text (within the shell's own: --set 'name=\"a, b\"'), lists in [brackets]"
    }
}

/// A library's message, which may quote a part of the text.
fn brief_message(message: &str) -> String {
    if message.chars().count() <= 200 { message.to_owned() } else { brief(message) }
}

/// An array where a table belongs.
pub(super) fn array_for_table(form: &DocumentKind, table: &DeTable<'_>) -> Option<Diagnostic> {
    for (key, value) in table {
        let name = key.get_ref().as_ref();
        match value.get_ref() {
            DeValue::Array(_) if form.is_table(name) => {
                return Some(
                    Diagnostic::new(format!("`{}` must be a table, not a list", brief(name)))
                        .at(key.span())
                        .help(format!("write a header in single brackets, like [{}]", brief(name))),
                );
            }
            DeValue::Table(inner) => {
                if let Some(problem) = array_for_table(form, inner) {
                    return Some(problem);
                }
            }
            _ => {}
        }
    }
    None
}

/// A key or value that a scenario does not have.
pub(super) fn structure(form: &DocumentKind, error: &toml::de::Error, text: &str) -> Diagnostic {
    let span = error.span().unwrap_or(0..0);
    let message = error.message();
    let place = place_of(text, &span);
    let within = |place: &[String]| {
        if place.is_empty() { format!("the {}", form.name) } else { format!("[{}]", place.join(".")) }
    };

    if let Some((name, expected)) = unknown(message, "unknown field `") {
        // In a header such as [axes.z] the unknown key is the last part of the place itself.
        let place = match place.split_last() {
            Some((last, way)) if last == name => way,
            _ => place.as_slice(),
        };
        return unknown_key(form, name, &expected, &within(place)).at(span);
    }
    if let Some((name, expected)) = unknown(message, "unknown variant `") {
        let holder = place.last().map_or("this", String::as_str);
        let problem = Diagnostic::new(format!("`{holder}` cannot be `{}`", brief(name)));
        return suggest(problem, name, &expected).at(span).help(format!("known here: {}", list(&expected)));
    }
    if let Some(name) = message.strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`')) {
        let problem = Diagnostic::new(format!("`{name}` is missing in {}", within(&place))).at(span);
        return missing_key(form, problem, name, &place);
    }
    if message.starts_with("wanted exactly 1 element") {
        let variants = variants_of(form, &place);
        if variants.is_empty() {
            return wanted_word(form, &place).at(span);
        }
        if let Some(problem) = keys_beside_choice(text, &place, &variants) {
            return problem;
        }
        let (how, help) = if message.contains("more than") {
            ("more than one of", "keep one and remove the tables of the others".to_owned())
        } else {
            (
                "none of",
                format!("add one, such as [{}.{}]", place.join("."), variants.first().map_or("…", String::as_str)),
            )
        };
        return Diagnostic::new(format!("{} holds {how} {}", within(&place), list(&variants))).at(span).help(help);
    }
    if message.starts_with("invalid type: unit variant") || message == "wanted string or table" {
        let variants = variants_of(form, &place);
        let Some(first) = variants.first() else { return wanted_word(form, &place).at(span) };
        return Diagnostic::new(format!("wrong type: `{0}` must be a table, such as [{0}.{first}]", place.join(".")))
            .at(span)
            .help(format!("known here: {}", list(&variants)));
    }
    wrong_type(form, message, place.last().map_or("", String::as_str)).at(span)
}

/// Keys beside the tables of a choice, where there may be none: `kind = "coulomb"`, or the keys of the table that is missing.
fn keys_beside_choice(text: &str, place: &[String], variants: &[String]) -> Option<Diagnostic> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    for key in place {
        table = match table.get(key.as_str())?.get_ref() {
            DeValue::Table(next) => next,
            _ => return None,
        };
    }
    let is_variant = |key: &str| variants.iter().any(|variant| variant == key);
    // In the order of the file.
    let (key, _) =
        table.iter().filter(|(key, _)| !is_variant(key.get_ref())).min_by_key(|(key, _)| key.span().start)?;
    let place = place.join(".");
    // A table that is named by a value is the one that is meant.
    let named = table.values().filter_map(|value| value.get_ref().as_str()).find(|word| is_variant(word));
    let meant = named.or_else(|| variants.iter().map(String::as_str).find(|variant| table.contains_key(*variant)));
    let meant = meant.or(variants.first().map(String::as_str)).unwrap_or("…");
    Some(
        Diagnostic::new(format!("unknown key `{}` in [{place}]", brief(key.get_ref())))
            .at(key.span())
            .label("not a key of this table")
            .note(format!("[{place}] holds one of the tables {}", list(variants)))
            .help(format!("write the keys below a header [{place}.{meant}]")),
    )
}

/// Something else where one of a few words belongs.
fn wanted_word(form: &DocumentKind, place: &[String]) -> Diagnostic {
    let path: Vec<&str> = place.iter().map(String::as_str).collect();
    let mut known = Vec::new();
    if let Some(node) = schema_node(form.schema(), &path) {
        words(node, &mut known);
    }
    Diagnostic::new(format!("wrong type: `{}` must be a word in quotes", place.join(".")))
        .help(format!("known here: {}", list(&known)))
}

fn unknown_key(form: &DocumentKind, name: &str, expected: &[&str], within: &str) -> Diagnostic {
    let problem =
        Diagnostic::new(format!("unknown key `{}` in {within}", brief(name))).label("not a key of this table");
    let mut problem = suggest(problem, name, expected);
    // A key that is known elsewhere is probably in the wrong table.
    let elsewhere = homes_of(form, name);
    if !elsewhere.is_empty() {
        problem = problem.help(format!("`{name}` belongs into {}", elsewhere.join(" or ")));
    }
    if expected.is_empty() { problem } else { problem.help(format!("known here: {}", list(expected))) }
}

fn missing_key(form: &DocumentKind, problem: Diagnostic, name: &str, place: &[String]) -> Diagnostic {
    let path = place.iter().map(String::as_str).chain([name]).collect::<Vec<_>>();
    let (about, is_table) = describe(form, &path).unwrap_or_default();
    let about = if about.is_empty() { about } else { format!("  # {about}") };
    let variants = variants_of(form, &path);
    if let Some(first) = variants.first() {
        problem.label("in here").help(format!("add a table such as [{}.{first}]{about}", path.join(".")))
    } else if is_table {
        problem.label("in here").help(format!("add a table [{}]{about}", path.join(".")))
    } else {
        problem.label("in this table").help(format!("add a line `{name} = …`{about}"))
    }
}

/// serde's "invalid type: FOUND, expected NEEDED" in words.
fn wrong_type(form: &DocumentKind, message: &str, key: &str) -> Diagnostic {
    let key = if key.is_empty() { String::new() } else { format!("`{}` ", brief(key)) };
    if message.contains("number overflowed") {
        return Diagnostic::new(format!("{key}is too big for a number"))
            .help("numbers are 64-bit floating point: at most about 1.8e308");
    }
    if message.contains("` as i128, ") || message.contains("` as u128, ") {
        return Diagnostic::new(format!("{key}is a whole number beyond 64 bits"))
            .help("write big numbers with an exponent, such as 1e20");
    }
    let Some((found, needed)) = message.rsplit_once(", expected ") else {
        return Diagnostic::new(brief(message))
            .help(format!("`{}` lists every key with its type", form.schema_command));
    };
    let found = found
        .strip_prefix("invalid type: ")
        .or_else(|| found.strip_prefix("invalid value: "))
        .unwrap_or(found)
        .replace("invalid length", "a list of length");
    let found = match found.as_str() {
        "sequence" => "a list".to_owned(),
        "map" => "a table".to_owned(),
        other if other.starts_with("a list") => other.to_owned(),
        other => format!("the {other}"),
    };
    let (needed, help) = match needed {
        "f64" => ("a number", "write a number such as 0.5 or 1e-3, without quotes and without its unit"),
        "i64" => ("a whole number", "write a whole number, without quotes"),
        "a string" => ("a string", "write text in \"quotes\""),
        "a number or \"optimize\"" => {
            (needed, "n_c is usually 5 to 10; n_c = \"optimize\" searches for the lowest peak jerk")
        }
        "a boolean" => ("true or false", "write true or false, without quotes"),
        "an array of length 2" => ("two numbers", "one for u and one for v, such as [3, 3]"),
        "a sequence" if key.contains("override") => {
            ("a list of tables", "write [[feedrate.override]] headers, each with at_s and percent below it")
        }
        "a sequence" => ("a list of points", "write a list of points: [[x, y], [x, y], …]"),
        // Limits of the axes: the only pairs that are no points.
        POINT if key.contains("_mm_s") => {
            ("one number for X and one for Y", "write a list of two, such as [2000, 2000]")
        }
        "u32" => ("a whole number from 0 to 4294967295", "write a whole number, without quotes"),
        POINT if key.contains("points_mm_um") => {
            ("[mm, µm]", "a point is a place in mm and an error in µm: [12.5, -3]")
        }
        POINT if key.contains("points_mm_n") => ("[mm, N]", "a point is a place in mm and a force in N: [12.5, -300]"),
        POINT if key.contains("points_s_n") => ("[s, N]", "a point is a time in s and a force in N: [0.5, -300]"),
        POINT => ("[x, y]", "a point is two numbers in mm: [12.5, -3]"),
        POINT3 => ("[x, y, z]", "a point is three numbers in mm: [12.5, -3, 40]"),
        _ if needed.starts_with("struct ") => ("a table", "write a [table] header with its keys below it"),
        other => (other, "the schema lists every key with its type"),
    };
    // A point stands in a list: the key names the list.
    let subject = if needed.starts_with('[') { "a point of ".to_owned() + &key } else { key };
    Diagnostic::new(format!("wrong type: {subject}must be {needed}, not {}", brief(&found))).help(help)
}

/// Name and known names out of serde's "unknown … `name`, expected …".
fn unknown<'a>(message: &'a str, prefix: &str) -> Option<(&'a str, Vec<&'a str>)> {
    let rest = message.strip_prefix(prefix)?;
    let at = rest.rfind("`, expected ").or_else(|| rest.rfind("`, there are no "))?;
    let (name, expected) = rest.split_at_checked(at)?;
    let expected = expected.get(1..)?;
    Some((name, expected.split('`').skip(1).step_by(2).collect()))
}

fn suggest(problem: Diagnostic, name: &str, expected: &[&str]) -> Diagnostic {
    match nearest(name, expected.iter().copied()) {
        Some(known) => problem.help(format!("did you mean `{known}`?")),
        None => problem,
    }
}

fn list(names: &[impl AsRef<str>]) -> String {
    names.iter().map(|name| format!("`{}`", name.as_ref())).collect::<Vec<_>>().join(", ")
}

/// The table (or the value's key) that a span belongs to, as a path of keys.
pub(super) fn place_of(text: &str, span: &Range<usize>) -> Vec<String> {
    fn in_item(item: &DeValue<'_>, span: &Range<usize>, path: &mut Vec<String>) -> bool {
        match item {
            DeValue::Table(inner) => inner.keys().any(|key| key.span() == *span) || search(inner, span, path),
            _ => false,
        }
    }
    fn search(table: &DeTable<'_>, span: &Range<usize>, path: &mut Vec<String>) -> bool {
        for (key, value) in table {
            path.push(key.get_ref().to_string());
            // A table's span is that of its header; that of an implicit one is its key. An unknown key is no place itself.
            if value.span() == *span {
                return true;
            }
            match value.get_ref() {
                DeValue::Table(inner) => {
                    if inner.keys().any(|key| key.span() == *span) {
                        let at_its_value = inner.iter().any(|(k, v)| k.span() == *span && v.span() == *span);
                        if !at_its_value {
                            return true;
                        }
                    }
                    if search(inner, span, path) {
                        return true;
                    }
                }
                // The tables of a list, such as [[feedrate.override]].
                DeValue::Array(items) if items.iter().any(|item| in_item(item.get_ref(), span, path)) => return true,
                _ if value.span().start <= span.start && span.end <= value.span().end => return true,
                _ => {}
            }
            path.pop();
        }
        false
    }
    let mut path = Vec::new();
    if let Ok(root) = DeTable::parse(text) {
        search(root.get_ref(), span, &mut path);
    }
    path
}

/// The schema's node of a key, through the choices on the way.
fn schema_node<'a>(node: &'a Value, path: &[&str]) -> Option<&'a Value> {
    let Some((first, rest)) = path.split_first() else { return Some(node) };
    if let Some(next) = node.get("properties").and_then(|p| p.get(first)) {
        return schema_node(next, rest);
    }
    choices(node).find_map(|choice| schema_node(choice, path))
}

/// First sentence of a key's description, and whether it is a table.
fn describe(form: &DocumentKind, path: &[&str]) -> Option<(String, bool)> {
    let node = schema_node(form.schema(), path)?;
    let text = node.get("description")?.as_str()?.lines().next()?.to_owned();
    let is_table = node.get("properties").is_some() || choices(node).next().is_some();
    Some((text.trim_end_matches('.').to_owned(), is_table))
}

/// Names of the choices of an externally tagged enum.
fn variants_of(form: &DocumentKind, path: &[impl AsRef<str>]) -> Vec<String> {
    let path: Vec<&str> = path.iter().map(AsRef::as_ref).collect();
    let Some(node) = schema_node(form.schema(), &path) else { return Vec::new() };
    let mut found = Vec::new();
    variants(node, &mut found);
    found
}

/// Those of a node; of one that may be left out they stand a level deeper.
fn variants(node: &Value, found: &mut Vec<String>) {
    for choice in choices(node) {
        match choice.get("properties").and_then(Value::as_object) {
            Some(properties) => found.extend(properties.keys().next().cloned()),
            None => variants(choice, found),
        }
    }
}

/// The words that a node may be.
fn words(node: &Value, found: &mut Vec<String>) {
    let listed = node.get("enum").and_then(Value::as_array).into_iter().flatten();
    found.extend(listed.chain(node.get("const")).filter_map(Value::as_str).map(str::to_owned));
    choices(node).for_each(|choice| words(choice, found));
}

/// The tables that have a key of this name.
fn homes_of(form: &DocumentKind, name: &str) -> Vec<String> {
    fn search(node: &Value, name: &str, path: &mut Vec<String>, found: &mut Vec<String>) {
        if let Some(properties) = node.get("properties").and_then(Value::as_object) {
            for (key, inner) in properties {
                if key == name && !path.is_empty() {
                    found.push(format!("[{}]", path.join(".")));
                }
                path.push(key.clone());
                search(inner, name, path, found);
                path.pop();
            }
        }
        for choice in choices(node) {
            search(choice, name, path, found);
        }
    }
    let mut found = Vec::new();
    search(form.schema(), name, &mut Vec::new(), &mut found);
    found.truncate(4);
    found
}

#[cfg(test)]
mod tests {
    use super::super::file::RawScenario;
    use super::*;
    use serde::Deserialize;

    /// What the libraries say of a text.
    fn said(text: &str) -> String {
        let told = |error: toml::de::Error| error.message().to_owned();
        let read = |table| RawScenario::deserialize(toml::Deserializer::from(table)).map_err(told);
        DeTable::parse(text).map_err(told).and_then(read).expect_err(text)
    }

    /// What they say of alpha with a part of it replaced.
    fn said_of(from: &str, to: &str) -> String {
        let alpha = include_str!("../../scenarios/alpha.toml");
        assert!(alpha.contains(from), "{from}");
        said(&alpha.replacen(from, to, 1))
    }

    /// The sentences of `toml` and `serde` that are put in other words here: another version of them is noticed.
    #[test]
    fn the_sentences_of_the_libraries_are_those_that_are_known() {
        let whole = "99999999999999999999999999999999999999999999";
        for (said, known) in [
            (said("a ="), "string values must be quoted"),
            (said("a = b"), "string values must be quoted"),
            (said("a = 1\na = 2"), "duplicate key"),
            (said("a"), "key with no value"),
            (said("a = \"b"), "invalid basic string"),
            (said("a = 'b"), "invalid literal string"),
            (said_of("\nkpp = ", "\nkp = "), "unknown field `kp`, expected one of `kpp`, `kpv`, `kiv`, `kpf`, `kvf`"),
            (
                said_of("\nperiod_s = ", "\nperiod = "),
                "unknown field `period`, expected one of `period_s`, `settling_s`",
            ),
            (said_of("path.ph_spline", "path.spline"), "unknown variant `spline`, expected one of `ph_spline`, `line`"),
            (said_of("\nphase_s = ", "\n# "), "missing field `phase_s`"),
            (said_of("\nkpp = ", "\n# "), "missing field `kpp`"),
            (
                said_of("[path.ph_spline]", "[path.line]\n[path.ph_spline]"),
                "wanted exactly 1 element, more than 1 element",
            ),
            (said_of("[path.ph_spline]", "[path]\n[unused]"), "wanted exactly 1 element"),
            (said_of("derivative = \"backward\"", "derivative = 3"), "wanted string or table"),
            (said("path = 'line'"), "invalid type: unit variant"),
            (said_of("\nkpp = ", "\nkpp = \"x\" #"), "invalid type: string \"x\", expected f64"),
            (said_of("\nkpp = ", "\nkpp = 99999999999999999999 #"), "` as i128, expected f64"),
            (said_of("\nkpp = ", &format!("\nkpp = {whole} #")), "number overflowed"),
            (said_of("delay_samples = 0", "delay_samples = 0.5"), "invalid type: floating point `0.5`, expected i64"),
            (said_of("[limits]", "[[limits]]"), "invalid type: sequence, expected struct "),
            (said_of("[12, 18]", "[12]"), "invalid length 1, expected a point [x, y]"),
        ] {
            assert!(said.contains(known), "expected: {known}\nfound: {said}");
        }
    }
}
