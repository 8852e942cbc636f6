//! What a tuning may change: controller gains, each within bounds.

use crate::parameters::{AXIS_NAMES, Entry, Parameter, Parameters};
use crate::scenario::Scenario;
use crate::servo::{AxisParameters, Drive, LoopSettings, Pdff};

use super::TuningError;

/// One gain of a PDFF controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Gain {
    /// Position gain \[rad/s/mm\].
    Kpp,
    /// Velocity gain \[N m s/rad\].
    Kpv,
    /// Velocity integral gain \[1/s\].
    Kiv,
    /// Velocity feedforward \[rad/mm\].
    Kpf,
    /// Share of the velocity command that acts directly.
    Kvf,
}

impl Gain {
    /// All of them, in the order in which they are written.
    pub const ALL: [Self; 5] = [Self::Kpp, Self::Kpv, Self::Kiv, Self::Kpf, Self::Kvf];

    /// Its entry among the parameters of [`Pdff`].
    fn entry(self) -> &'static Entry<Pdff> {
        // In the same order: a test holds them together.
        &Pdff::ENTRIES[(self as usize).min(Pdff::ENTRIES.len() - 1)]
    }

    /// What it is: unit, range, help.
    pub fn parameter(self) -> &'static Parameter {
        &self.entry().parameter
    }

    /// Its key in a scenario, below `pdff`.
    pub fn name(self) -> &'static str {
        self.parameter().name()
    }

    /// Its unit; empty for none.
    pub fn unit(self) -> &'static str {
        self.parameter().unit
    }

    /// Its value.
    pub fn of(self, pdff: &Pdff) -> f64 {
        (self.entry().get)(pdff).unwrap_or(f64::NAN)
    }

    /// Changes it.
    pub fn set(self, pdff: &mut Pdff, value: f64) {
        (self.entry().set)(pdff, value);
    }

    /// The gain of this name.
    ///
    /// # Errors
    /// There is none; the error names the nearest one.
    pub fn parse(name: &str) -> Result<Self, TuningError> {
        let found = Self::ALL.into_iter().find(|gain| gain.name() == name);
        found.ok_or_else(|| unknown(name, Self::ALL.iter().map(|gain| gain.name().to_owned())))
    }

    /// How far from its own value a gain is searched by default: a third to three times, half to twice for the feedforward
    /// gains. Of a gain that is zero: up to what a stiff loop of this plant and period would have.
    fn default_bounds(self, axis: &AxisParameters, settings: &LoopSettings) -> (f64, f64) {
        let value = self.of(&axis.pdff);
        let Drive { transmission_mm_rad: r_g, torque_to_voltage_v_nm: k_t, .. } = axis.drive;
        let (factor, stiff) = match self {
            // Loops closed at a fifth of the sampling rate: ω_c Δt = 0.2.
            Self::Kpp => (3.0, 0.2 / (settings.period_s * r_g)),
            Self::Kpv => (3.0, axis.plant.time_constant_s / (axis.plant.gain_rad_s_v * k_t) / settings.period_s),
            Self::Kiv => (3.0, 0.5 / settings.period_s),
            Self::Kpf => (2.0, 2.0 / r_g),
            Self::Kvf => (2.0, 2.0),
        };
        let (low, high) = if value > 0.0 { (value / factor, value * factor) } else { (0.0, stiff) };
        (rounded(low, 3), rounded(high, 3))
    }
}

/// A gain of an axis that may be changed, and how far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variable {
    /// Axis, from 0.
    pub axis: usize,
    /// Which gain.
    pub gain: Gain,
    /// Lower bound; where it is 0 the search goes in equal steps, otherwise in equal factors.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
}

/// Significant digits of a tuned gain: what is evaluated is what is written.
const DIGITS: usize = 7;

/// `value` with this many significant digits.
pub(super) fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

impl Variable {
    /// A gain of a scenario's axis with the default bounds: a third to three times its value (kpp, kpv, kiv), half to twice
    /// (kpf, kvf), and for a gain of zero from zero to that of a stiff loop.
    pub fn new(scenario: &Scenario, axis: usize, gain: Gain) -> Self {
        let (lower, upper) = gain.default_bounds(&scenario.axes[axis.min(1)], &scenario.settings);
        Self { axis: axis.min(1), gain, lower, upper }
    }

    /// Reads `axes.x.pdff.kpp=60:140`, or without bounds `axes.x.pdff.kpp`; `x.kpp` will do for the key.
    ///
    /// # Errors
    /// No such key, bounds that are no numbers, not finite, negative or the wrong way round.
    pub fn parse(text: &str, scenario: &Scenario) -> Result<Self, TuningError> {
        let (key, bounds) = text.split_once('=').map_or((text, None), |(key, bounds)| (key, Some(bounds)));
        let key = key.trim();
        let all = || (0..2).flat_map(|axis| Gain::ALL.map(|gain| Self { axis, gain, lower: 0.0, upper: 0.0 }));
        let found = all().find(|v| v.key() == key || v.short() == key);
        let Some(Self { axis, gain, .. }) = found else {
            return Err(unknown(key, all().flat_map(|v| [v.key(), v.short()])));
        };
        let variable = Self::new(scenario, axis, gain);
        let Some(bounds) = bounds else { return Ok(variable) };
        let wrong = |why| TuningError::Bounds { key: variable.key(), given: bounds.trim().to_owned(), why };
        let Some((low, high)) = bounds.split_once(':') else {
            return Err(wrong("there is no `:` between two numbers"));
        };
        let range = gain.parameter().range;
        let number = |text: &str| {
            let value: f64 = text.trim().parse().map_err(|_| wrong("a bound is not a number"))?;
            match value {
                v if !v.is_finite() => Err(wrong("a bound is not finite")),
                v if v < range.low.value() => Err(wrong("a gain is not negative")),
                v => Ok(v),
            }
        };
        let (lower, upper) = (number(low)?, number(high)?);
        match () {
            () if lower > upper => Err(wrong("the lower bound comes first, the upper one behind the `:`")),
            () if lower == upper => Err(wrong("the two bounds are the same: nothing is left to choose")),
            () if !range.contains(upper) => Err(wrong("a gain is at most 1e9")),
            () => Ok(Self { lower, upper, ..variable }),
        }
    }

    /// `axes.x.pdff.kpp`.
    pub fn key(&self) -> String {
        format!("axes.{}.pdff.{}", AXIS_NAMES[self.axis.min(1)], self.gain.name())
    }

    /// `x.kpp`.
    pub fn short(&self) -> String {
        format!("{}.{}", AXIS_NAMES[self.axis.min(1)], self.gain.name())
    }

    /// The gain at a position between the bounds: 0 is the lower one, 1 the upper one; with as many digits as are written.
    pub fn value(&self, position: f64) -> f64 {
        let Self { lower, upper, .. } = *self;
        if position <= 0.0 {
            return lower;
        }
        if position >= 1.0 {
            return upper;
        }
        let value = if lower > 0.0 {
            lower * libm::exp(position * libm::log(upper / lower))
        } else {
            lower + position * (upper - lower)
        };
        rounded(value, DIGITS).max(lower).min(upper)
    }

    /// Where a gain lies between the bounds, from 0 to 1; one beyond them lies on the nearer one.
    pub fn position(&self, value: f64) -> f64 {
        let Self { lower, upper, .. } = *self;
        let position = if lower > 0.0 {
            libm::log(value.max(lower) / lower) / libm::log(upper / lower)
        } else {
            (value - lower) / (upper - lower)
        };
        position.max(0.0).min(1.0)
    }
}

/// A key that nothing answers to.
fn unknown(key: &str, known: impl Iterator<Item = String>) -> TuningError {
    let known: Vec<String> = known.collect();
    let similarity = |name: &String| strsim::jaro_winkler(&key.to_lowercase(), name);
    // Of equals the first.
    let nearest = known.iter().rev().max_by(|a, b| similarity(a).total_cmp(&similarity(b)));
    let suggestion = nearest.filter(|name| similarity(name) > 0.6).cloned();
    TuningError::UnknownVariable { key: key.to_owned(), suggestion }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_are_the_parameters_of_the_pdff_controller() {
        let mut pdff = Pdff { kpp_rad_s_mm: 1.0, kpv_nm_s_rad: 2.0, kiv_1_s: 3.0, kpf_rad_mm: 4.0, kvf: 5.0 };
        assert_eq!(Gain::ALL.map(Gain::name), ["kpp", "kpv", "kiv", "kpf", "kvf"]);
        assert_eq!(Gain::ALL.map(Gain::unit), ["rad/s/mm", "N m s/rad", "1/s", "rad/mm", ""]);
        assert_eq!(Gain::ALL.map(|gain| gain.of(&pdff)), [1.0, 2.0, 3.0, 4.0, 5.0]);
        Gain::Kpf.set(&mut pdff, 6.0);
        assert_eq!(pdff.kpf_rad_mm, 6.0);
        assert_eq!(Gain::ALL.len(), Pdff::ENTRIES.len());
    }
}
