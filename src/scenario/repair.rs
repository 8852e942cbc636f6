//! Every key and value that a file should not have, not the first alone: each is told and set right in a copy, until the rest can be read.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::diagnostics::{Diagnostic, Problems};
use super::document_kind::DocumentKind;
use super::toml_errors::{place_of, structure};

/// Most problems that are looked for.
const MOST: usize = 50;

/// What a file comes to: its values, or what is wrong with it and, where that could be set right, the values without it.
pub(super) type Read<T> = Result<T, (Problems, Option<T>)>;

/// Reads a table. `sample` is the text of a file of the same kind in which everything is right: a value of the wrong type, or one that is
/// missing, is taken from there for the problems behind it to be found.
pub(super) fn read<T: DeserializeOwned>(
    form: &DocumentKind,
    mut table: Spanned<DeTable<'_>>,
    text: &str,
    sample: &'static str,
) -> Read<T> {
    let mut problems: Problems = Vec::new();
    let mut removed: Vec<Vec<String>> = Vec::new();
    while problems.len() < MOST {
        let error = match T::deserialize(toml::Deserializer::from(table.clone())) {
            Ok(values) if problems.is_empty() => return Ok(values),
            Ok(values) => return Err((problems, Some(values))),
            Err(error) => error,
        };
        let span = error.span().unwrap_or(0..0);
        let place = place_of(text, &span);
        let missing = error.message().strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`'));
        let missing = missing.map(|name| [place.as_slice(), &[name.to_owned()]].concat());
        // It is missing because it was taken away.
        if missing.as_ref().is_some_and(|missing| removed.contains(missing)) {
            break;
        }
        let problem = structure(form, &error, text);
        // What was set right is wrong again: there is no way on.
        if problems.iter().any(|known| known.span == problem.span && known.message == problem.message) {
            break;
        }
        problems.push(problem);
        let root = table.get_mut();
        let is_mended = if error.message().starts_with("unknown field `") {
            remove_key(root, &span)
        } else if let Some(missing) = missing {
            put(root, &missing, &span, sample)
        } else {
            put(root, &place, &span, sample) || {
                removed.push(place.clone());
                remove(root, &place)
            }
        };
        if !is_mended {
            break;
        }
    }
    Err((problems, None))
}

/// Removes the key that stands at a place of the text.
fn remove_key(table: &mut DeTable<'_>, span: &Range<usize>) -> bool {
    if let Some(name) = table.keys().find(|key| key.span() == *span).map(|key| key.get_ref().to_string()) {
        return table.remove(name.as_str()).is_some();
    }
    table.iter_mut().any(|(_, value)| match value.get_mut() {
        DeValue::Table(inner) => remove_key(inner, span),
        DeValue::Array(items) => items.iter_mut().any(|item| match item.get_mut() {
            DeValue::Table(inner) => remove_key(inner, span),
            _ => false,
        }),
        _ => false,
    })
}

/// The table that holds the last key of a path.
fn holder<'t, 'a>(table: &'t mut DeTable<'a>, path: &[String]) -> Option<&'t mut DeTable<'a>> {
    let mut table = table;
    for key in path {
        let (_, value) = table.iter_mut().find(|(known, _)| known.get_ref() == key.as_str())?;
        let DeValue::Table(inner) = value.get_mut() else { return None };
        table = inner;
    }
    Some(table)
}

fn remove(table: &mut DeTable<'_>, path: &[String]) -> bool {
    let Some((last, way)) = path.split_last() else { return false };
    let Some(table) = holder(table, way) else { return false };
    table.remove(last.as_str()).is_some()
}

/// Puts the number, word or switch that the sample has at a path to the same path, at a place of the text.
fn put(table: &mut DeTable<'_>, path: &[String], span: &Range<usize>, sample: &'static str) -> bool {
    let Some((last, way)) = path.split_last() else { return false };
    let Ok(sample) = DeTable::parse(sample) else { return false };
    let mut known = sample.into_inner();
    let Some(from) = holder(&mut known, way) else { return false };
    let Some((_, value)) = from.iter().find(|(key, _)| key.get_ref() == last.as_str()) else { return false };
    if matches!(value.get_ref(), DeValue::Table(_) | DeValue::Array(_)) {
        return false;
    }
    let value = Spanned::new(span.clone(), value.get_ref().clone());
    let Some(to) = holder(table, way) else { return false };
    to.remove(last.as_str());
    to.insert(Spanned::new(span.clone(), last.clone().into()), value);
    true
}

/// Problems of values, without those of what was set right, in the order of the file.
pub(super) fn joined(mut problems: Problems, more: Problems) -> Problems {
    let is_apart = |problem: &Diagnostic| match &problem.span {
        Some(span) => !problems.iter().filter_map(|known| known.span.as_ref()).any(|known| overlap(known, span)),
        // It is about the whole, of which parts were set right.
        None => problems.is_empty(),
    };
    let more: Problems = more.into_iter().filter(is_apart).collect();
    problems.extend(more);
    in_order(problems)
}

fn overlap(a: &Range<usize>, b: &Range<usize>) -> bool {
    a.start < b.end && b.start < a.end || a == b
}

/// In the order of the file; what has no place comes last.
pub(super) fn in_order(mut problems: Problems) -> Problems {
    problems.sort_by_key(|problem| problem.span.as_ref().map_or(usize::MAX, |span| span.start));
    problems
}
