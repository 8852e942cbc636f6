//! Ranges of values.

use std::fmt;

/// An end of a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// The value itself is in the range.
    Closed(f64),
    /// The value itself is not; infinite for no bound at all, which leaves finite values.
    Open(f64),
}

impl Bound {
    /// Where the end is.
    pub fn value(self) -> f64 {
        match self {
            Self::Closed(value) | Self::Open(value) => value,
        }
    }

    /// Whether the value itself is out of the range.
    pub fn is_open(self) -> bool {
        matches!(self, Self::Open(_))
    }
}

/// The values that a parameter may have. Not a number is in none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: Bound,
    /// Upper end.
    pub high: Bound,
    /// Whether only whole numbers are in it.
    pub whole: bool,
}

impl Range {
    /// From 1e-9 to 1e9: quotients and products of such values neither overflow nor vanish.
    pub const POSITIVE: Self = Self::closed(1e-9, 1e9);

    /// From 0 to 1e9.
    pub const NOT_NEGATIVE: Self = Self::closed(0.0, 1e9);

    /// Every positive finite number.
    pub const ABOVE_ZERO: Self = Self { low: Bound::Open(0.0), high: Bound::Open(f64::INFINITY), whole: false };

    /// Zero and every positive finite number.
    pub const FROM_ZERO: Self = Self { low: Bound::Closed(0.0), high: Bound::Open(f64::INFINITY), whole: false };

    /// Every finite number.
    pub const FINITE: Self =
        Self { low: Bound::Open(f64::NEG_INFINITY), high: Bound::Open(f64::INFINITY), whole: false };

    /// From `low` to `high`, both in it.
    pub const fn closed(low: f64, high: f64) -> Self {
        Self { low: Bound::Closed(low), high: Bound::Closed(high), whole: false }
    }

    /// Above `low`, at most `high`.
    pub const fn above(low: f64, high: f64) -> Self {
        Self { low: Bound::Open(low), high: Bound::Closed(high), whole: false }
    }

    /// The whole numbers from `low` to `high`.
    pub const fn whole(low: u32, high: u32) -> Self {
        Self { low: Bound::Closed(low as f64), high: Bound::Closed(high as f64), whole: true }
    }

    /// Whether a value is in it.
    pub fn contains(&self, value: f64) -> bool {
        let above = match self.low {
            Bound::Closed(low) => value >= low,
            Bound::Open(low) => value > low,
        };
        let below = match self.high {
            Bound::Closed(high) => value <= high,
            Bound::Open(high) => value < high,
        };
        above && below && (!self.whole || value.trunc() == value)
    }

    /// In the notation of intervals: `[0, 1e9]`, `(0, ∞)`.
    pub fn interval(&self) -> String {
        let end = |bound: Bound| match bound.value() {
            value if value.is_finite() => written(value),
            value if value < 0.0 => "-∞".to_owned(),
            _ => "∞".to_owned(),
        };
        let open = if self.low.is_open() { "(" } else { "[" };
        let close = if self.high.is_open() { ")" } else { "]" };
        format!("{open}{}, {}{close}", end(self.low), end(self.high))
    }
}

impl fmt::Display for Range {
    /// As an error says it after "it must be".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (low, high) = (self.low.value(), self.high.value());
        let [l, h] = [low, high].map(written);
        if self.whole && (low, high) == (0.0, 1.0) {
            return f.write_str("0 or 1");
        }
        if self.whole {
            return write!(f, "a whole number from {l} to {h}");
        }
        match (self.low, self.high) {
            _ if low.is_infinite() && high.is_infinite() => write!(f, "a finite number"),
            (Bound::Open(0.0), _) if high.is_infinite() => write!(f, "a positive finite number"),
            (Bound::Closed(0.0), _) if high.is_infinite() => write!(f, "zero or a positive finite number"),
            (Bound::Open(0.0), Bound::Closed(_)) => write!(f, "a positive number, at most {h}"),
            (Bound::Closed(0.0), Bound::Closed(_)) if high >= 1e6 => {
                write!(f, "zero or a positive number, at most {h}")
            }
            (Bound::Closed(_), Bound::Closed(_)) if low > 0.0 && low <= 1e-5 => {
                write!(f, "a positive number, from {l} to {h}")
            }
            (Bound::Closed(_), Bound::Closed(_)) => write!(f, "from {l} to {h}"),
            (Bound::Open(_), Bound::Open(_)) => write!(f, "above {l} and below {h}"),
            (Bound::Open(_), Bound::Closed(_)) => write!(f, "above {l}, at most {h}"),
            (Bound::Closed(_), Bound::Open(_)) => write!(f, "at least {l}, below {h}"),
        }
    }
}

/// A number with its own digits, with an exponent where that is shorter by far: 0.001, 1000, 1e9.
pub(super) fn written(value: f64) -> String {
    let (plain, exponent) = (value.to_string(), format!("{value:e}"));
    if exponent.len() + 2 < plain.len() { exponent } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_says_what_is_in_it() {
        for (range, inside, outside, words, interval) in [
            (Range::POSITIVE, [1e-9, 1e9], [9.9e-10, 1.1e9], "a positive number, from 1e-9 to 1e9", "[1e-9, 1e9]"),
            (Range::NOT_NEGATIVE, [0.0, 1e9], [-1e-300, 1e10], "zero or a positive number, at most 1e9", "[0, 1e9]"),
            (Range::closed(0.01, 100.0), [0.01, 100.0], [0.0099, 101.0], "from 0.01 to 100", "[0.01, 100]"),
            (Range::ABOVE_ZERO, [1e-300, 1e300], [0.0, f64::INFINITY], "a positive finite number", "(0, ∞)"),
            (Range::FINITE, [-1e300, 1e300], [f64::NEG_INFINITY, f64::INFINITY], "a finite number", "(-∞, ∞)"),
            (Range::above(0.0, 1e6), [1e-300, 1e6], [0.0, 1.1e6], "a positive number, at most 1e6", "(0, 1e6]"),
            (Range::whole(2, 32), [2.0, 32.0], [2.5, 33.0], "a whole number from 2 to 32", "[2, 32]"),
        ] {
            assert!(inside.iter().all(|value| range.contains(*value)), "{range:?}");
            assert!(outside.iter().chain(&[f64::NAN]).all(|value| !range.contains(*value)), "{range:?}");
            assert_eq!((range.to_string().as_str(), range.interval().as_str()), (words, interval));
        }
    }

    #[test]
    fn numbers_are_written_short() {
        let cases = [(1e9, "1e9"), (1e-9, "1e-9"), (0.001, "0.001"), (99999999999.0, "99999999999"), (-0.5, "-0.5")];
        for (value, text) in cases {
            assert_eq!(written(value), text);
        }
    }
}
