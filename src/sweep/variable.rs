//! What is varied, and over which values: `axes.x.pdff.kpp=60:140:81`.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::error::SweepError;
use super::sampling::normal_quantile;
use crate::parameters::axis_name;
use crate::scenario::{Document, Scenario, ScenarioParameter};
use crate::servo::{AxisParameter, ControllerGains};

/// One value of a variable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A number.
    Number(f64),
    /// Anything else, as TOML: `"exact"`, `true`.
    Text(String),
}

impl Value {
    /// The number, where it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Text(_) => None,
        }
    }
}

impl fmt::Display for Value {
    /// As in TOML, and so that it reads back as the same number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write_number(f, *number),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// The shortest text that reads back as the same number, with an exponent where that is shorter by far.
pub(super) fn write_number(f: &mut impl fmt::Write, number: f64) -> fmt::Result {
    if number == 0.0 || (1e-5..1e15).contains(&number.abs()) { write!(f, "{number}") } else { write!(f, "{number:e}") }
}

/// The values that a variable takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Values {
    /// From `from` to `to`: `count` values evenly spaced, both ends among them, or any between without a count. Where
    /// `logarithmic`, it is the logarithm that is evenly spaced.
    Range {
        /// Lowest value.
        from: f64,
        /// Highest value.
        to: f64,
        /// How many; none for sampled methods.
        count: Option<u64>,
        /// Evenly spaced in the logarithm.
        logarithmic: bool,
    },
    /// These.
    List(Vec<Value>),
    /// Normally distributed.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
}

impl Values {
    /// How many there are; none where it is a continuum.
    pub fn count(&self) -> Option<u64> {
        match self {
            Self::Range { count, .. } => *count,
            Self::List(values) => Some(values.len() as u64),
            Self::Normal { .. } => None,
        }
    }

    /// Whether every value is a number.
    pub fn is_numeric(&self) -> bool {
        match self {
            Self::List(values) => values.iter().all(|value| value.number().is_some()),
            _ => true,
        }
    }

    /// Whether its logarithm is evenly spaced.
    pub fn is_logarithmic(&self) -> bool {
        matches!(self, Self::Range { logarithmic: true, .. })
    }

    /// Value number `level` of the [`count`](Self::count) ones.
    pub fn at_level(&self, level: u64) -> Value {
        match self {
            Self::Range { from, to, count, logarithmic } => {
                let last = count.unwrap_or(2).saturating_sub(1);
                Value::Number(match level {
                    0 => *from,
                    level if level >= last => *to,
                    level => between(*from, *to, level as f64, last as f64, *logarithmic),
                })
            }
            Self::List(values) => {
                let level = usize::try_from(level).unwrap_or(usize::MAX).min(values.len().saturating_sub(1));
                values.get(level).cloned().unwrap_or(Value::Number(f64::NAN))
            }
            Self::Normal { mean, .. } => Value::Number(*mean),
        }
    }

    /// The value at the share `u` in (0, 1) of them: the quantile of the distribution.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // u is in (0, 1)
    pub fn at_share(&self, u: f64) -> Value {
        match self {
            Self::Range { from, to, count: None, logarithmic } => {
                Value::Number(between(*from, *to, u, 1.0, *logarithmic))
            }
            Self::Normal { mean, deviation } => Value::Number(mean + deviation * normal_quantile(u)),
            counted => {
                let count = counted.count().unwrap_or(1);
                counted.at_level(((u * count as f64) as u64).min(count.saturating_sub(1)))
            }
        }
    }
}

/// The value at `part` of `whole` equal steps from `from` to `to`.
fn between(from: f64, to: f64, part: f64, whole: f64, logarithmic: bool) -> f64 {
    let value = if logarithmic {
        from * libm::exp(libm::log(to / from) * part / whole)
    } else {
        from + (to - from) * part / whole
    };
    value.max(from).min(to)
}

/// A variable of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variable {
    /// Full dotted key of the scenario's value.
    pub key: String,
    /// Which values it takes.
    pub values: Values,
}

impl Variable {
    /// Reads `KEY=SPEC`; the key may leave out the table that the scenario has chosen ([`Document::full_key`]).
    ///
    /// | spec | values |
    /// |---|---|
    /// | `60:140:81` | 81 from 60 to 140, evenly spaced; `60:140:81:log` in their logarithm |
    /// | `50,100,150` | these; words too: `backward,exact` |
    /// | `60:140`, `60:140:log` | any between, for sampled methods |
    /// | `±20%`, `±5` (or `+-`) | as a range around the scenario's own value; `±20%:5` with a count |
    /// | `normal(97.38, 2)`, `normal(±5%)` | normally distributed: mean and standard deviation |
    ///
    /// # Errors
    /// It is not of that form, the scenario has no such value, or none that a relative range could be taken of.
    pub fn parse(given: &str, document: &Document, scenario: &Scenario) -> Result<Self, SweepError> {
        let shown: String = given.chars().take(80).collect();
        let wrong = |problem: &str, help: &str| SweepError::request(format!("`--vary {shown}`: {problem}"), help);
        let Some((key, spec)) = given.split_once('=') else {
            return Err(wrong("there is no `=`", FORMS));
        };
        let key = document.full_key(key)?;
        let own = || {
            document.number(&key).or_else(|| ScenarioParameter::find(&key)?.get(scenario)).ok_or_else(|| {
                wrong(
                    &format!("the scenario gives no number for {key} that this could be relative to"),
                    "write FROM:TO",
                )
            })
        };
        let values = values(spec.trim(), &own, &wrong)?;
        Ok(Self { key, values })
    }

    /// Key and value as `--set` takes them.
    pub(super) fn setting(&self, value: &Value) -> String {
        format!("{}={value}", self.key)
    }
}

const FORMS: &str = "write KEY=60:140:81 (from, to, how many; :log behind it for even steps of the logarithm), KEY=50,100,150, \
                     and for sampled sweeps KEY=60:140, KEY=±20%, KEY=±5 or KEY=normal(97.38, 2)";

fn values(
    spec: &str,
    own: &dyn Fn() -> Result<f64, SweepError>,
    wrong: &dyn Fn(&str, &str) -> SweepError,
) -> Result<Values, SweepError> {
    if spec.is_empty() {
        return Err(wrong("no values are given", FORMS));
    }
    if let Some(inner) = spec.strip_prefix("normal(").and_then(|rest| rest.strip_suffix(')')) {
        return normal(inner, own, wrong);
    }
    let spec = spec.strip_prefix("+-").map_or_else(|| spec.to_owned(), |rest| format!("±{rest}"));
    if let Some(rest) = spec.strip_prefix('±') {
        let (spread, rest) = rest.split_once(':').map_or((rest, None), |(spread, rest)| (spread, Some(rest)));
        let (own, spread) = (own()?, half_width(spread, own, wrong)?);
        return range(own - spread, own + spread, rest, &spec, wrong);
    }
    let is_range = spec.contains(':') && !spec.contains(['"', '\'', '[']);
    if is_range {
        let mut parts = spec.splitn(3, ':');
        let from = number(parts.next().unwrap_or_default(), wrong)?;
        let to = number(parts.next().unwrap_or_default(), wrong)?;
        return range(from, to, parts.next(), &spec, wrong);
    }
    list(&spec, wrong)
}

/// What stands behind FROM:TO: a count, `log`, or both.
fn range(
    from: f64,
    to: f64,
    rest: Option<&str>,
    spec: &str,
    wrong: &dyn Fn(&str, &str) -> SweepError,
) -> Result<Values, SweepError> {
    let (count, logarithmic) = match rest.map(str::trim) {
        None => (None, false),
        Some("log") => (None, true),
        Some(rest) => match rest.split_once(':').map(|(count, scale)| (count, scale.trim())) {
            None => (Some(rest), false),
            Some((count, "log")) => (Some(count), true),
            Some((_, other)) => {
                return Err(wrong(&format!("`{other}` is not known here"), "the scale is `log` or omitted"));
            }
        },
    };
    let shown = |number: f64| Value::Number(number).to_string();
    if from > to {
        let help =
            spec.replacen(&format!("{}:{}", shown(from), shown(to)), &format!("{}:{}", shown(to), shown(from)), 1);
        return Err(wrong("the bounds are the wrong way round", &format!("the lower one comes first: {help}")));
    }
    if from == to {
        return Err(wrong("both bounds are the same", &format!("give one value as KEY={}, or a range", shown(from))));
    }
    if !(to - from).is_finite() {
        return Err(wrong("the range is too wide for a number", FORMS));
    }
    if logarithmic && from <= 0.0 {
        return Err(wrong("a logarithmic range must be positive", "raise the lower bound, or omit `log`"));
    }
    let count = match count.map(str::trim) {
        None => None,
        Some(text) if !text.is_empty() && text.chars().all(|c| c.is_ascii_digit()) => match text.parse::<u64>() {
            Ok(0) => return Err(wrong("a count of 0 leaves nothing to compute", "give at least 2 values")),
            Ok(1) => {
                return Err(wrong("a count of 1 between two bounds", "give at least 2, or one value as KEY=VALUE"));
            }
            Ok(count) => Some(count),
            Err(_) => return Err(SweepError::TooMany { count: text.trim_start_matches('0').to_owned() }),
        },
        Some(text) => {
            return Err(wrong(&format!("`{text}` is not a count"), "the third part is how many values: KEY=60:140:81"));
        }
    };
    Ok(Values::Range { from, to, count, logarithmic })
}

fn normal(
    inner: &str,
    own: &dyn Fn() -> Result<f64, SweepError>,
    wrong: &dyn Fn(&str, &str) -> SweepError,
) -> Result<Values, SweepError> {
    let inner = inner.trim().replacen("+-", "±", 1);
    let (mean, deviation) = if let Some(spread) = inner.strip_prefix('±') {
        (own()?, half_width(spread, own, wrong)?)
    } else {
        let Some((mean, deviation)) = inner.split_once(',') else {
            return Err(wrong(
                "normal(…) needs a mean and a standard deviation",
                "write normal(97.38, 2) or normal(±5%)",
            ));
        };
        (number(mean, wrong)?, number(deviation, wrong)?)
    };
    if !(deviation > 0.0) {
        return Err(wrong("the standard deviation must be positive", "write normal(97.38, 2) or normal(±5%)"));
    }
    Ok(Values::Normal { mean, deviation })
}

/// `20%` of the scenario's own value, or `5` of its unit.
fn half_width(
    spread: &str,
    own: &dyn Fn() -> Result<f64, SweepError>,
    wrong: &dyn Fn(&str, &str) -> SweepError,
) -> Result<f64, SweepError> {
    let width = match spread.trim().strip_suffix('%') {
        Some(percent) => match own()? {
            0.0 => return Err(wrong("the scenario's own value is 0, and so is every share of it", "write FROM:TO")),
            own => (own * (number(percent, wrong)? / 100.0)).abs(),
        },
        None => number(spread, wrong)?,
    };
    let is_negative = spread.trim().starts_with('-');
    if width > 0.0 && !is_negative {
        Ok(width)
    } else {
        Err(wrong("the value after ± must be positive", "write ±20% or ±5"))
    }
}

fn number(text: &str, wrong: &dyn Fn(&str, &str) -> SweepError) -> Result<f64, SweepError> {
    let text = text.trim();
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(wrong(
            &format!("`{}` is not a finite number", text.chars().take(40).collect::<String>()),
            "numbers look like 0.001 or 1e-3: decimal point, no unit",
        )),
    }
}

fn list(spec: &str, wrong: &dyn Fn(&str, &str) -> SweepError) -> Result<Values, SweepError> {
    let mut values = Vec::new();
    for item in items(spec) {
        let item = item.trim();
        if item.is_empty() {
            return Err(wrong("a value of the list is missing", "write KEY=50,100,150"));
        }
        let value = match item.parse::<f64>() {
            Ok(number) if number.is_finite() => Value::Number(number),
            Ok(_) => return Err(wrong(&format!("`{item}` is not a finite number"), FORMS)),
            Err(_) => Value::Text(item.to_owned()),
        };
        if values.contains(&value) {
            return Err(wrong(&format!("{value} is in the list twice"), "give every value once"));
        }
        values.push(value);
    }
    Ok(Values::List(values))
}

/// The parts between commas that stand in no quotes or brackets.
fn items(spec: &str) -> Vec<&str> {
    let (mut parts, mut start, mut depth, mut quote) = (Vec::new(), 0, 0_u32, None);
    for (at, c) in spec.char_indices() {
        match (quote, c) {
            (Some(open), c) if c == open => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth = depth.saturating_sub(1),
            (None, ',') if depth == 0 => {
                parts.push(spec.get(start..at).unwrap_or_default());
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(spec.get(start..).unwrap_or_default());
    parts
}

/// A parameter of one axis that is written straight into the loop.
#[derive(Debug, Clone, Copy)]
pub(super) struct AxisValue {
    pub(super) axis: usize,
    pub(super) parameter: &'static AxisParameter,
}

/// The parameter that a key stands for, where it is one that can be written without reading the scenario anew: a value of the axis' model
/// that nothing else was made of. With a plant from its mechanics the drive is a part of the plant; the gains of a controller that is not
/// given in full follow from plant, drive and PDFF gains.
pub(super) fn axis_value(
    variable: &Variable,
    all: &[Variable],
    document: &Document,
    scenario: &Scenario,
) -> Option<AxisValue> {
    // What is no number is told of when the scenario is read.
    let known = ScenarioParameter::find(&variable.key).filter(|_| variable.values.is_numeric())?;
    let (axis, parameter) = (known.axis()?, known.of_axis().filter(|parameter| parameter.is_of_model())?);
    let controller = format!("axes.{}.controller.", axis_name(axis));
    let chosen = all.iter().any(|other| other.key.starts_with(&controller));
    if chosen || scenario.drives.get(axis)?.controller != ControllerGains::Pdff {
        return None;
    }
    let gain = format!("axes.{}.plant.first_order.gain_rad_s_v", axis_name(axis));
    let alone = known.parameter.table() == "pdff" || known.parameter.key == "drive.voltage_limit_v";
    (alone || document.number(&gain).is_some()).then_some(AxisValue { axis, parameter })
}

/// A TOML string without its quotes: `"exact"` is exact.
pub(super) fn plain(text: &str) -> String {
    let inner = ['"', '\''].iter().find_map(|&quote| text.strip_prefix(quote)?.strip_suffix(quote));
    inner.filter(|inner| !inner.contains(['"', '\'', '\\'])).unwrap_or(text).to_owned()
}
