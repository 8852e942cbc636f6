//! `--set KEY=VALUE`: values of a scenario replaced in its text, so that there is one way from text to values.

use toml::de::{DeTable, DeValue};
use toml_edit::{DocumentMut, Item, Key, TableLike, Value};

use super::diagnostics::{Diagnostic, brief};
use super::document_kind::DocumentKind;
use super::keys;

/// One override.
#[derive(Debug, Clone)]
pub(super) struct Override {
    /// As it was given.
    given: String,
    path: Vec<String>,
    value: Value,
}

impl Override {
    /// Reads `KEY=VALUE`: the key is a dotted TOML key, the value is TOML, or a bare word that is taken as a string.
    pub(super) fn parse(given: &str) -> Result<Self, Diagnostic> {
        let shown = brief(given);
        let form = "write it as KEY=VALUE, such as axes.x.pdff.kpp=120";
        let Some((key, value)) = given.split_once('=') else {
            return Err(Diagnostic::new(format!("`--set {shown}` has no `=`")).help(form));
        };
        if key.matches('.').count() > 16 {
            return Err(Diagnostic::new(format!("`--set {shown}`: the key is too long")).help(form));
        }
        let path = Key::parse(key.trim())
            .map_err(|_| Diagnostic::new(format!("`--set {shown}`: `{}` is not a key", brief(key))).help(form))?;
        let value = value.trim();
        if value.is_empty() {
            return Err(Diagnostic::new(format!("`--set {shown}` has no value")).help(form));
        }
        super::size_limits::check(&format!("value = {value}"))
            .map_err(|problem| Diagnostic::new(format!("`--set {shown}`: {}", problem.message)))?;
        let value = match value.parse::<Value>() {
            Ok(value) => value,
            Err(_) if is_word(value) => Value::from(value),
            Err(error) => {
                return Err(Diagnostic::new(format!(
                    "`--set {shown}`: the value is not TOML: {}",
                    brief(error.message())
                ))
                .help(super::toml_errors::help_for_value(value, error.message())));
            }
        };
        Ok(Self { given: given.to_owned(), path: path.iter().map(|key| key.get().to_owned()).collect(), value })
    }

    /// What a message calls it.
    fn shown(&self) -> String {
        format!("`--set {}`", brief(&self.given))
    }

    /// Puts the table that the document has chosen into a path that leaves it out. (A path of no value stays as it is:
    /// what is wrong with it is told when the scenario is read.)
    pub(super) fn complete(&mut self, form: &DocumentKind, document: &DocumentMut) {
        if let Some(path) = keys::full(form, &self.path, document) {
            self.path = path;
        }
    }

    /// Writes the value into the document; tables on the way are created.
    pub(super) fn apply(&self, form: &DocumentKind, document: &mut DocumentMut) -> Result<(), Diagnostic> {
        let Some((last, way)) = self.path.split_last() else { return Ok(()) };
        let mut table: &mut dyn TableLike = document.as_table_mut();
        for (depth, key) in way.iter().enumerate() {
            drop_other_choices(form, table, &self.path, depth);
            let key = keys::as_written(key, |name| table.contains_key(name));
            let next = table.entry(key).or_insert_with(|| {
                let mut table = toml_edit::Table::new();
                table.set_implicit(true);
                Item::Table(table)
            });
            table = next.as_table_like_mut().ok_or_else(|| {
                let shown = self.shown();
                Diagnostic::new(format!("{shown}: `{}` is a value, it has no keys", brief(key)))
                    .help(format!("`{}` lists every key", form.schema_command))
            })?;
        }
        drop_other_choices(form, table, &self.path, way.len());
        let mut value = self.value.clone();
        match table.get_mut(last) {
            Some(Item::Value(old)) => {
                // A comment behind the old value stays.
                *value.decor_mut() = old.decor().clone();
                *old = value;
            }
            _ => {
                table.insert(last, Item::Value(value));
            }
        }
        Ok(())
    }

    /// Whether the place (a span in `text`) lies in what this override wrote.
    fn wrote(&self, root: &DeTable<'_>, place: usize) -> bool {
        let Some((last, way)) = self.path.split_last() else { return false };
        let mut table = root;
        for key in way {
            match table.get(keys::as_written(key, |name| table.contains_key(name))).map(toml::Spanned::get_ref) {
                Some(DeValue::Table(next)) => table = next,
                _ => return false,
            }
        }
        table
            .get_key_value(last.as_str())
            .is_some_and(|(key, value)| key.span().contains(&place) || value.span().contains(&place))
    }
}

/// Adds to each problem which override it comes from, if any. `place_of` tells the table of a place.
pub(super) fn blame(overrides: &[Override], text: &str, problems: &mut [Diagnostic]) {
    if overrides.is_empty() {
        return;
    }
    let Ok(root) = DeTable::parse(text) else { return };
    for problem in problems {
        let Some(span) = problem.span.clone() else { continue };
        let table = super::toml_errors::place_of(text, &span);
        let culprit = overrides.iter().rev().find(|o| o.wrote(root.get_ref(), span.start)).map_or_else(
            || {
                overrides
                    .iter()
                    .rev()
                    .find(|o| o.path.len() > table.len() && o.path.starts_with(&table))
                    .filter(|_| !table.is_empty())
            },
            Some,
        );
        if let Some(culprit) = culprit {
            problem.notes.push(format!("this comes from {}, not from the file", culprit.shown()));
        }
    }
}

/// Where `path` goes through a choice at `depth`, the tables of the other choices go.
fn drop_other_choices(form: &DocumentKind, table: &mut dyn TableLike, path: &[String], depth: usize) {
    let (way, chosen) = (path.get(..depth).unwrap_or_default(), path.get(depth));
    if let Some(chosen) = chosen
        && form.choices.iter().any(|choice| choice.iter().eq(way.iter()))
    {
        let others: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).filter(|key| key != chosen).collect();
        for other in others {
            table.remove(&other);
        }
    }
}

/// Text that can only be meant as a string: words, and the path of a file.
fn is_word(value: &str) -> bool {
    let begins = value.starts_with(|c: char| c.is_alphabetic() || matches!(c, '_' | '/'));
    (begins || value.starts_with("./") || value.starts_with("../"))
        && value.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ' ' | '/'))
}
