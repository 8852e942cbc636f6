//! Tables of numbers of a file: keys, ranges and descriptions are those of [`Parameters`].

use std::any::type_name;
use std::borrow::Cow;
use std::fmt;
use std::ops::Range;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{self, Deserialize, DeserializeSeed, Deserializer, MapAccess, Visitor};
use serde_json::{Map, Value, json};
use toml::Spanned;

use super::diagnostics::Diagnostic;
use crate::parameters::{Bound, Entry, OutOfRange, Parameter, Parameters, Presence};

/// The values of a table that are given, in the order of the file.
#[derive(Debug)]
pub(super) struct NumberTable<T: 'static> {
    pub(super) given: Vec<(&'static Entry<T>, Spanned<f64>)>,
}

/// No value is given.
impl<T> Default for NumberTable<T> {
    fn default() -> Self {
        Self { given: Vec::new() }
    }
}

impl<T: Parameters> NumberTable<T> {
    /// Where the value of this name stands, if it is given.
    pub(super) fn span(&self, name: &str) -> Option<Range<usize>> {
        self.given.iter().find(|(entry, _)| entry.parameter.name() == name).map(|(_, raw)| raw.span())
    }

    /// Writes defaults and given values into `value`, which holds what else is to be taken where none is given. Values out of their
    /// range are written too; `refuse` hears of them.
    ///
    /// Returns whether all are in range.
    pub(super) fn fill(&self, value: &mut T, mut refuse: impl FnMut(&OutOfRange, Range<usize>)) -> bool {
        for entry in T::ENTRIES {
            if let Presence::Default(default) = entry.parameter.presence {
                (entry.set)(value, default);
            }
        }
        let mut sound = true;
        for (entry, raw) in &self.given {
            let number = *raw.get_ref();
            (entry.set)(value, number);
            if let Err(error) = entry.parameter.check(number) {
                sound = false;
                refuse(&error, raw.span());
            }
        }
        sound
    }
}

/// A value out of its range, called as it is in its table; with `help` where the parameter says none.
pub(super) fn out_of_range(within: &str, error: &OutOfRange, span: Range<usize>, help: &str) -> Diagnostic {
    let help = if error.help.is_empty() { help } else { error.help };
    let problem = Diagnostic::new(format!("{within}{}", error.message(error.name()))).at(span);
    if help.is_empty() { problem } else { problem.help(help) }
}

/// A value that stands by itself; told where it is not in the range of its parameter.
pub(super) fn number(parameter: &Parameter, raw: &Spanned<f64>, problems: &mut Vec<Diagnostic>) -> f64 {
    let value = *raw.get_ref();
    if let Err(error) = parameter.check(value) {
        problems.push(out_of_range("", &error, raw.span(), ""));
    }
    value
}

impl<'de, T: Parameters> Deserialize<'de> for NumberTable<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // (The name says to the deserializer that it is a table.)
        deserializer.deserialize_struct("NumberTable", &[], TableVisitor(std::marker::PhantomData))
    }
}

struct TableVisitor<T>(std::marker::PhantomData<T>);

impl<'de, T: Parameters> Visitor<'de> for TableVisitor<T> {
    type Value = NumberTable<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("struct of numbers")
    }

    // The messages are those of derived code, which are put in other words later.
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<NumberTable<T>, A::Error> {
        let mut given: Vec<(&'static Entry<T>, Spanned<f64>)> = Vec::new();
        while let Some(entry) = map.next_key_seed(KeySeed(std::marker::PhantomData::<T>))? {
            let value = if entry.parameter.range.whole {
                let whole: Spanned<i64> = map.next_value()?;
                Spanned::new(whole.span(), *whole.get_ref() as f64)
            } else {
                map.next_value()?
            };
            given.push((entry, value));
        }
        // (The table comes in the order of the alphabet.)
        given.sort_by_key(|(_, raw)| raw.span().start);
        let is_given = |parameter: &Parameter| given.iter().any(|(entry, _)| entry.parameter.key == parameter.key);
        let mut parameters = T::ENTRIES.iter().map(|entry| &entry.parameter);
        match parameters.find(|parameter| parameter.is_required() && !is_given(parameter)) {
            Some(missing) => Err(de::Error::custom(format_args!("missing field `{}`", missing.name()))),
            None => Ok(NumberTable { given }),
        }
    }
}

/// A key of the table.
struct KeySeed<T>(std::marker::PhantomData<T>);

impl<'de, T: Parameters> DeserializeSeed<'de> for KeySeed<T> {
    type Value = &'static Entry<T>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl<T: Parameters> Visitor<'_> for KeySeed<T> {
    type Value = &'static Entry<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("field identifier")
    }

    fn visit_str<E: de::Error>(self, key: &str) -> Result<Self::Value, E> {
        T::ENTRIES.iter().find(|entry| entry.parameter.name() == key).ok_or_else(|| {
            let known: Vec<String> = T::ENTRIES.iter().map(|entry| format!("`{}`", entry.parameter.name())).collect();
            E::custom(format_args!("unknown field `{key}`, expected one of {}", known.join(", ")))
        })
    }
}

impl<T: Parameters> JsonSchema for NumberTable<T> {
    fn schema_name() -> Cow<'static, str> {
        type_name::<T>().into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let mut properties = Map::new();
        let mut required = Vec::new();
        for Entry { parameter, .. } in T::ENTRIES {
            let kind = if parameter.range.whole { "integer" } else { "number" };
            let mut node = Map::new();
            if parameter.is_required() {
                node.insert("type".to_owned(), json!(kind));
                required.push(parameter.name());
            } else {
                node.insert("type".to_owned(), json!([kind, "null"]));
            }
            describe(parameter, &mut node);
            properties.insert(parameter.name().to_owned(), Value::Object(node));
        }
        let mut table = Map::new();
        table.insert("description".to_owned(), json!(format!("{}.", T::ABOUT)));
        table.insert("type".to_owned(), json!("object"));
        table.insert("properties".to_owned(), Value::Object(properties));
        table.insert("additionalProperties".to_owned(), json!(false));
        if !required.is_empty() {
            table.insert("required".to_owned(), json!(required));
        }
        table.into()
    }
}

/// Writes what is known of a parameter into its node of a schema.
pub(super) fn describe(parameter: &Parameter, node: &mut Map<String, Value>) {
    node.shift_insert(0, "description".to_owned(), json!(parameter.description()));
    for key in ["minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum"] {
        node.shift_remove(key);
    }
    let ends = [
        (parameter.range.low, ["minimum", "exclusiveMinimum"]),
        (parameter.range.high, ["maximum", "exclusiveMaximum"]),
    ];
    for (bound, [closed, open]) in ends {
        match bound {
            Bound::Closed(value) => _ = node.insert(closed.to_owned(), json_number(value)),
            Bound::Open(value) if value.is_finite() => _ = node.insert(open.to_owned(), json_number(value)),
            Bound::Open(_) => {}
        }
    }
}

/// A whole number without a point.
#[allow(clippy::cast_possible_truncation)] // small
fn json_number(value: f64) -> Value {
    if value.trunc() == value && value.abs() < 1e15 { json!(value as i64) } else { json!(value) }
}
