//! Numbers of a program: whole multiples of a power of ten, so that what is written is exactly what is known of it.

use std::io::{self, Write};

/// Most decimals of a number.
pub const MAX_DECIMALS: u8 = 9;

const POWERS: [i64; 10] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000, 1_000_000_000];

/// A number with a stated count of decimals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fixed {
    units: i64,
    decimals: u8,
}

impl Fixed {
    /// The nearest such number. The value is at most 1e9 in magnitude, so that the units fit.
    pub(super) fn nearest(value: f64, decimals: u8) -> Self {
        let decimals = decimals.min(MAX_DECIMALS);
        // At most 1e18, which fits; a float saturates and NaN is 0.
        #[allow(clippy::cast_possible_truncation)]
        let units = (value * power(decimals) as f64).round() as i64;
        Self { units, decimals }
    }

    /// The number as a reader of the text takes it: the division of two whole numbers below 2^53 rounds as the text does.
    pub(super) fn value(self) -> f64 {
        self.units as f64 / power(self.decimals) as f64
    }

    /// What is left of it without another of the same decimals.
    pub(super) fn minus(self, other: Self) -> Self {
        Self { units: self.units.saturating_sub(other.units), ..self }
    }

    /// The least difference of two such numbers.
    pub(super) fn step(decimals: u8) -> f64 {
        1.0 / power(decimals) as f64
    }

    /// The number without zeros at its end, and without a point where it is whole.
    pub(super) fn write_short(self, out: &mut impl Write) -> io::Result<()> {
        let mut short = self;
        while short.decimals > 0 && short.units % 10 == 0 {
            short = Self { units: short.units / 10, decimals: short.decimals - 1 };
        }
        if short.decimals == 0 { write!(out, "{}", short.units) } else { short.write(out) }
    }

    /// The number with its decimals, at least a decimal point.
    pub(super) fn write(self, out: &mut impl Write) -> io::Result<()> {
        let (power, magnitude) = (power(self.decimals).unsigned_abs(), self.units.unsigned_abs());
        if self.units < 0 {
            out.write_all(b"-")?;
        }
        write!(out, "{}.", magnitude / power)?;
        match self.decimals {
            0 => Ok(()),
            decimals => write!(out, "{:0width$}", magnitude % power, width = usize::from(decimals)),
        }
    }
}

fn power(decimals: u8) -> i64 {
    POWERS.get(usize::from(decimals)).copied().unwrap_or(1_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_written_as_it_is_read() {
        for (value, decimals, text) in [
            (0.0, 3, "0.000"),
            (-0.0004, 3, "0.000"),
            (-0.0005, 3, "-0.001"),
            (1.5, 0, "2."),
            (-12.0625, 2, "-12.06"),
            (999_999.999_999_999, 9, "999999.999999999"),
            (0.1 + 0.2, 9, "0.300000000"),
        ] {
            let fixed = Fixed::nearest(value, decimals);
            let mut out = Vec::new();
            fixed.write(&mut out).unwrap();
            assert_eq!(String::from_utf8(out).unwrap(), text);
            assert_eq!(text.parse::<f64>().unwrap(), fixed.value());
        }
    }
}
