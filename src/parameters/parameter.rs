//! A parameter.

use std::fmt;

use super::{Bound, OutOfRange, Range};

/// What holds where a file does not give the parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Presence {
    /// It has to be given.
    Required,
    /// This value.
    Default(f64),
    /// What the text says: `that of kpp`.
    Otherwise(&'static str),
}

/// How a slider divides its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps.
    Linear,
    /// Equal factors.
    Logarithmic,
}

/// Where a slider moves: the values that are usual, not all that are allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slider {
    /// Lowest value; positive where the scale is logarithmic.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// How it divides its way.
    pub scale: Scale,
}

/// A numeric parameter of a scenario: everything about it but its value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Key in a scenario file; that of a parameter of an axis below `axes.x`, such as `pdff.kpp`.
    pub key: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Which values it may have. Further conditions may tie it to other parameters.
    pub range: Range,
    /// What holds where it is not given.
    pub presence: Presence,
    /// Usual values.
    pub slider: Slider,
    /// What it is: a phrase without its unit.
    pub help: &'static str,
    /// What to do about a value out of its range; empty where range and unit say it.
    pub hint: &'static str,
}

impl Parameter {
    /// A parameter that has to be given, with a slider that is logarithmic from a thousandth of 1 to a thousand.
    pub const fn new(key: &'static str, unit: &'static str, range: Range, help: &'static str) -> Self {
        let slider = Slider { low: 1e-3, high: 1e3, scale: Scale::Logarithmic };
        Self { key, unit, range, presence: Presence::Required, slider, help, hint: "" }
    }

    /// With a default.
    #[must_use]
    pub const fn or(mut self, default: f64) -> Self {
        self.presence = Presence::Default(default);
        self
    }

    /// With a default that is said in words.
    #[must_use]
    pub const fn otherwise(mut self, what: &'static str) -> Self {
        self.presence = Presence::Otherwise(what);
        self
    }

    /// With a slider in equal steps.
    #[must_use]
    pub const fn linear(mut self, low: f64, high: f64) -> Self {
        self.slider = Slider { low, high, scale: Scale::Linear };
        self
    }

    /// With a slider in equal factors.
    #[must_use]
    pub const fn logarithmic(mut self, low: f64, high: f64) -> Self {
        self.slider = Slider { low, high, scale: Scale::Logarithmic };
        self
    }

    /// With what to do about a wrong value.
    #[must_use]
    pub const fn hint(mut self, hint: &'static str) -> Self {
        self.hint = hint;
        self
    }

    /// The same parameter under another key.
    #[must_use]
    pub const fn at(mut self, key: &'static str) -> Self {
        self.key = key;
        self
    }

    /// The last part of the key: what it is called in its table.
    pub fn name(&self) -> &'static str {
        self.key.rsplit('.').next().unwrap_or(self.key)
    }

    /// The key of its table; empty where it has none.
    pub fn table(&self) -> &'static str {
        self.key.rsplit_once('.').map_or("", |(table, _)| table)
    }

    /// Whether a file has to give it.
    pub fn is_required(&self) -> bool {
        self.presence == Presence::Required
    }

    /// The value, if it is in range.
    ///
    /// # Errors
    /// It is not.
    pub fn check(&self, value: f64) -> Result<f64, OutOfRange> {
        if self.range.contains(value) { Ok(value) } else { Err(self.refuse(value, self.range_with_unit())) }
    }

    /// The error of a value that is not what other parameters need it to be.
    pub fn refuse(&self, value: f64, needed: impl Into<std::borrow::Cow<'static, str>>) -> OutOfRange {
        OutOfRange { key: self.key, value, needed: needed.into(), unit: self.unit, help: self.hint }
    }

    /// `from 0 to 1e9 mm`.
    fn range_with_unit(&self) -> String {
        let range = self.range;
        if self.unit.is_empty() { range.to_string() } else { format!("{range} {}", self.unit) }
    }

    /// What the schema says about it: help, unit, default.
    pub fn description(&self) -> String {
        // The unit stands behind what the parameter is, before what else is to be said about it.
        let at = self.help.find([';', ':', '(']).map_or(self.help.len(), |at| self.help[..at].trim_end().len());
        let (what, rest) = self.help.split_at(at);
        let unit = if self.unit.is_empty() { String::new() } else { format!(", in {}", self.unit) };
        match self.default_text() {
            Some(default) => format!("{what}{unit}{rest}. Default: {default}."),
            None => format!("{what}{unit}{rest}."),
        }
    }

    /// The default in words; none where the parameter has to be given.
    pub fn default_text(&self) -> Option<String> {
        match self.presence {
            Presence::Required => None,
            Presence::Default(value) => Some(super::range::written(value)),
            Presence::Otherwise(what) => Some(what.to_owned()),
        }
    }

    /// A value just below the range and one just above it, as far as there are such.
    pub fn just_outside(&self) -> impl Iterator<Item = f64> {
        let step = |value: f64, up: bool| match (self.range.whole, up) {
            (true, true) => value + 1.0,
            (true, false) => value - 1.0,
            (false, true) => value.next_up(),
            (false, false) => value.next_down(),
        };
        let ends = [(self.range.low, false), (self.range.high, true)];
        ends.into_iter().filter(|(bound, _)| bound.value().is_finite()).map(move |(bound, up)| match bound {
            Bound::Open(value) => value,
            Bound::Closed(value) => step(value, up),
        })
    }
}

impl fmt::Display for Parameter {
    /// `pdff.kpp [rad/s/mm]`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.unit.is_empty() { f.write_str(self.key) } else { write!(f, "{} [{}]", self.key, self.unit) }
    }
}
