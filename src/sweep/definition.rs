//! What a sweep is: the scenario, the variables, the method; and where its points lie.

use std::fmt::{self, Write as _};

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::cache::ScenarioCache;
use super::error::SweepError;
use super::metric::Metric;
use super::sampling::Sampling;
use super::variable::{AxisValue, Value, Values, Variable, axis_value};
use super::{MAX_POINTS, MAX_VARIABLES, sobol};
use crate::scenario::{Document, Scenario};

/// Version of [`Definition`] and of what is computed from it.
const FORMAT: u32 = 1;

/// How points are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Every combination of the values; the last variable changes fastest.
    Grid,
    /// One point in each of as many strata of every variable as there are points (`McKay`, Beckman and Conover 1979).
    LatinHypercube,
    /// A scrambled Sobol sequence: fills the space more evenly than chance.
    Sobol,
    /// Independent random points.
    MonteCarlo,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Grid => "grid",
            Self::LatinHypercube => "latin-hypercube",
            Self::Sobol => "sobol",
            Self::MonteCarlo => "monte-carlo",
        })
    }
}

/// How a sweep is to be made of its variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Plan {
    /// How points are chosen. None: a grid where every variable has counted values and no number of samples is given, else
    /// Monte Carlo where one is normally distributed, else a Latin hypercube.
    pub method: Option<Method>,
    /// How many points a sampled method takes.
    pub samples: Option<u64>,
    /// Seed of the sampled methods.
    pub seed: u64,
    /// Whether the margins of every point's loops are computed too.
    pub margins: bool,
}

/// Everything that the points and metrics of a sweep depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Definition {
    /// Version of this form.
    pub format: u32,
    /// Version of servosim: another one may compute other digits.
    pub version: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Its text, overrides applied.
    pub scenario_toml: String,
    /// What is varied.
    pub variables: Vec<Variable>,
    /// How points are chosen.
    pub method: Method,
    /// How many there are.
    pub count: u64,
    /// Seed of the sampled methods, 0 for a grid.
    pub seed: u64,
    /// Names of the metrics.
    #[serde(alias = "figures")]
    pub metrics: Vec<String>,
    /// SHA-256 of the learned corrections, where the scenario has some: its text has only the name of their file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub learned: Option<String>,
}

impl Definition {
    /// What differs between two definitions, in words; none where nothing does.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let parts = |definition: &Self| {
            let variables: Vec<_> = definition.variables.iter().map(|variable| variable.key.as_str()).collect();
            [
                ("version of servosim", definition.version.clone()),
                ("scenario", definition.scenario.clone()),
                ("method", definition.method.to_string()),
                ("variables", variables.join(", ")),
                ("number of points", definition.count.to_string()),
                ("seed", definition.seed.to_string()),
                ("metrics", definition.metrics.join(", ")),
            ]
        };
        for ((name, ours), (_, theirs)) in parts(self).into_iter().zip(parts(other)) {
            if ours != theirs {
                return Some(format!("the {name}: {theirs} there, {ours} here"));
            }
        }
        for (ours, theirs) in self.variables.iter().zip(&other.variables) {
            if ours != theirs {
                return Some(format!("the values of {}", ours.key));
            }
        }
        if self.scenario_toml != other.scenario_toml {
            let mut lines = self.scenario_toml.lines().zip(other.scenario_toml.lines());
            let line = lines.find(|(ours, theirs)| ours != theirs);
            return Some(match line {
                Some((ours, theirs)) => {
                    format!("the scenario's text: `{}` there, `{}` here", theirs.trim(), ours.trim())
                }
                None => "the length of the scenario's text".to_owned(),
            });
        }
        if self.learned != other.learned {
            return Some("the learned corrections: the file has changed".to_owned());
        }
        (self != other).then(|| "the form of the definition".to_owned())
    }
}

/// A sweep: where its points are, and the metrics at them.
#[derive(Debug)]
pub struct Sweep {
    pub(super) definition: Definition,
    pub(super) document: Document,
    pub(super) scenario: Scenario,
    /// Variables that are parameters of an axis.
    pub(super) axis_values: Vec<Option<AxisValue>>,
    pub(super) cache: ScenarioCache,
    sampling: Option<Sampling>,
}

impl Sweep {
    /// A sweep of the document's scenario over `vary`: `KEY=FROM:TO:COUNT` and the other forms of [`Variable::parse`].
    ///
    /// # Errors
    /// The scenario cannot be used, a variable makes no sense, the method does not fit the variables, or there are more than
    /// [`MAX_POINTS`] points.
    pub fn new(document: &Document, vary: &[impl AsRef<str>], plan: &Plan) -> Result<Self, SweepError> {
        let scenario = document.scenario()?;
        if vary.is_empty() {
            return Err(SweepError::request(
                "nothing is varied",
                "say what with --vary KEY=VALUES, such as --vary axes.x.pdff.kpp=60:140:81",
            ));
        }
        if vary.len() > MAX_VARIABLES {
            return Err(SweepError::request(
                format!("{} values are varied; at most {MAX_VARIABLES} can be", vary.len()),
                "leave some of them at one value with --set",
            ));
        }
        let mut variables: Vec<Variable> = Vec::with_capacity(vary.len());
        for given in vary {
            let variable = Variable::parse(given.as_ref(), document, &scenario)?;
            if variable.key == "learned.file" {
                return Err(SweepError::request(
                    "the file of the learned corrections cannot be varied",
                    "run the scenario with each of them: servosim run FILE --set learned.file=…",
                ));
            }
            if variables.iter().any(|other| other.key == variable.key) {
                return Err(SweepError::request(
                    format!("{} is varied twice", variable.key),
                    "give all of its values in one --vary",
                ));
            }
            // A word that the scenario does not take is a slip, not a point without metrics.
            if let Values::List(values) = &variable.values {
                for value in values.iter().filter(|value| value.number().is_none()) {
                    let mut trial = document.clone();
                    trial.set(&variable.setting(value))?;
                    trial.scenario()?;
                }
            }
            variables.push(variable);
        }
        let method = method(plan, &variables);
        let count = count(method, plan, &variables)?;
        let definition = Definition {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scenario: scenario.name.clone(),
            scenario_toml: scenario.source.clone(),
            variables,
            method,
            count,
            seed: if method == Method::Grid { 0 } else { plan.seed },
            metrics: Metric::all(plan.margins).map(|metric| metric.name().to_owned()).collect(),
            learned: scenario.corrections_mm.as_deref().map(digest),
        };
        Ok(Self::assemble(definition, document.clone(), scenario))
    }

    /// The sweep that a journal holds the definition of.
    ///
    /// # Errors
    /// The definition is of another version, or not sound.
    pub fn from_definition(definition: Definition) -> Result<Self, SweepError> {
        let ours = env!("CARGO_PKG_VERSION");
        if definition.format != FORMAT || definition.version != ours {
            return Err(SweepError::unfit(
                format!("the sweep was computed by servosim {}, this is {ours}", definition.version),
                "use that version, or compute the sweep anew",
            ));
        }
        let mut document =
            Document::from_text(definition.scenario_toml.as_str(), format!("{}.toml", definition.scenario));
        // Their file may be elsewhere; what they have done is in the metrics.
        document.forget_learned()?;
        let scenario = document.scenario()?;
        let (method, count_given) = (Some(definition.method), Some(definition.count));
        let plan = Plan { method, samples: count_given, seed: definition.seed, margins: false };
        let is_known = |margins| Metric::all(margins).map(Metric::name).eq(definition.metrics.iter());
        let sampled = definition.method != Method::Grid;
        let plan = if sampled { plan } else { Plan { samples: None, ..plan } };
        if definition.variables.is_empty()
            || definition.variables.len() > MAX_VARIABLES
            || definition.variables.iter().any(|variable| variable.values.count() == Some(0))
            || definition.count != count(definition.method, &plan, &definition.variables)?
            || !(is_known(false) || is_known(true))
        {
            return Err(SweepError::unfit("the definition of the sweep is not sound", "compute the sweep anew"));
        }
        Ok(Self::assemble(definition, document, scenario))
    }

    fn assemble(definition: Definition, document: Document, scenario: Scenario) -> Self {
        let Definition { method, seed, count, ref variables, .. } = definition;
        let axis_values = variables.iter().map(|variable| axis_value(variable, variables, &document, &scenario));
        Self {
            axis_values: axis_values.collect(),
            sampling: (method != Method::Grid).then(|| Sampling::new(method, seed, count, variables.len())),
            cache: ScenarioCache::default(),
            definition,
            document,
            scenario,
        }
    }

    /// Everything that it depends on.
    pub fn definition(&self) -> &Definition {
        &self.definition
    }

    /// The scenario that is varied.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The metrics of every point, in the order of the tables' columns.
    pub fn metrics(&self) -> impl Iterator<Item = Metric> {
        Metric::all(true).take(self.definition.metrics.len())
    }

    /// How many points it has.
    pub fn count(&self) -> u64 {
        self.definition.count
    }

    /// The variables' values at a point, in the order of the variables.
    pub fn values(&self, index: u64) -> Vec<Value> {
        let variables = &self.definition.variables;
        if let Some(sampling) = &self.sampling {
            let point = sampling.point(index);
            return variables.iter().zip(point).map(|(variable, u)| variable.values.at_share(u)).collect();
        }
        self.levels(index).into_iter().zip(variables).map(|(level, variable)| variable.values.at_level(level)).collect()
    }

    /// Numbers of the variables' values at a point of a grid.
    pub(super) fn levels(&self, index: u64) -> Vec<u64> {
        let mut rest = index;
        let mut levels: Vec<u64> = self
            .definition
            .variables
            .iter()
            .rev()
            .map(|variable| {
                let count = variable.values.count().unwrap_or(1).max(1);
                let level = rest % count;
                rest /= count;
                level
            })
            .collect();
        levels.reverse();
        levels
    }

    /// The scenario's own values of the variables, where it gives a number.
    pub fn own_values(&self) -> Vec<Option<f64>> {
        self.definition.variables.iter().map(|variable| self.document.number(&variable.key)).collect()
    }
}

/// SHA-256 of corrections, as hexadecimal digits.
fn digest(corrections_mm: &[Vector2<f64>]) -> String {
    let mut hash = Sha256::new();
    for shift in corrections_mm {
        hash.update(shift.x.to_le_bytes());
        hash.update(shift.y.to_le_bytes());
    }
    hash.finalize().iter().fold(String::new(), |mut out, byte| {
        // Writing to a string does not fail.
        let _ = write!(out, "{byte:02x}");
        out
    })
}

fn method(plan: &Plan, variables: &[Variable]) -> Method {
    plan.method.unwrap_or_else(|| {
        if plan.samples.is_none() && variables.iter().all(|variable| variable.values.count().is_some()) {
            Method::Grid
        } else if variables.iter().any(|variable| matches!(variable.values, Values::Normal { .. })) {
            Method::MonteCarlo
        } else {
            Method::LatinHypercube
        }
    })
}

/// The number of points, refused where there are too many.
fn count(method: Method, plan: &Plan, variables: &[Variable]) -> Result<u64, SweepError> {
    if method != Method::Grid {
        let Some(samples) = plan.samples else {
            let uncounted = variables.iter().find(|variable| variable.values.count().is_none());
            let problem = match uncounted.filter(|_| plan.method.is_none()) {
                Some(variable) => format!("{} has a range of values, and no number of samples is given", variable.key),
                None => format!("method {method} needs a number of samples"),
            };
            return Err(SweepError::request(
                problem,
                "say how many points with --samples 1000, or give the range a count: FROM:TO:COUNT",
            ));
        };
        if method == Method::Sobol && variables.len() > sobol::MAX_DIMENSIONS {
            return Err(SweepError::request(
                format!("{} values are varied; a Sobol sweep takes at most {}", variables.len(), sobol::MAX_DIMENSIONS),
                "use --method latin-hypercube",
            ));
        }
        return match samples {
            0 => Err(SweepError::request("0 samples leave nothing to compute", "give at least 1")),
            samples if samples > MAX_POINTS => Err(SweepError::TooMany { count: samples.to_string() }),
            samples => Ok(samples),
        };
    }
    if plan.samples.is_some() {
        return Err(SweepError::request(
            "a grid has as many points as its counts make, not a number of samples",
            "omit --samples, or choose another method",
        ));
    }
    let mut counts = Vec::with_capacity(variables.len());
    for variable in variables {
        let Some(count) = variable.values.count() else {
            return Err(SweepError::request(
                format!("a grid needs counted values, and {} has a range", variable.key),
                "give it a count: FROM:TO:COUNT, or choose another method with --samples",
            ));
        };
        counts.push(count);
    }
    let product = counts.iter().try_fold(1_u64, |product, count| product.checked_mul(*count));
    match product {
        Some(product) if product <= MAX_POINTS => Ok(product),
        _ => Err(SweepError::TooMany { count: written_out(&counts) }),
    }
}

/// The product of any size, in decimal.
fn written_out(counts: &[u64]) -> String {
    let mut digits = vec![1_u8];
    for count in counts {
        let mut carry = 0_u128;
        for digit in &mut digits {
            carry += u128::from(*digit) * u128::from(*count);
            *digit = u8::try_from(carry % 10).unwrap_or(0);
            carry /= 10;
        }
        while carry > 0 {
            digits.push(u8::try_from(carry % 10).unwrap_or(0));
            carry /= 10;
        }
    }
    let written: String = digits.iter().rev().map(|digit| char::from(b'0' + digit)).collect();
    if written.len() > 60 { format!("about 1e{}", written.len() - 1) } else { written }
}
