//! A value out of its range.

use std::borrow::Cow;
use std::fmt;

use super::range::written;

/// A value out of its range.
#[derive(Debug, Clone, PartialEq)]
pub struct OutOfRange {
    /// The parameter: its key, or what else it is called, with its unit where that says none.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// What it has to be.
    pub needed: Cow<'static, str>,
    /// Unit of the value; empty for none.
    pub unit: &'static str,
    /// What to do about it; empty where nothing more is to be said.
    pub help: &'static str,
}

impl std::error::Error for OutOfRange {}

impl OutOfRange {
    /// A value that is not what it has to be.
    pub fn new(key: &'static str, value: f64, needed: impl Into<Cow<'static, str>>) -> Self {
        Self { key, value, needed: needed.into(), unit: "", help: "" }
    }

    /// The last part of the key: what the parameter is called in its table.
    pub fn name(&self) -> &'static str {
        self.key.rsplit('.').next().unwrap_or(self.key)
    }

    /// The same with what to do about it.
    #[must_use]
    pub fn with_help(mut self, help: &'static str) -> Self {
        self.help = help;
        self
    }

    /// What is wrong, the value called by `name`: the key as it stands in a table, or with its table before it.
    pub fn message(&self, name: &str) -> String {
        format!("{name} = {} is out of range: it must be {}", written(self.value), self.needed)
    }
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message(self.key))
    }
}
