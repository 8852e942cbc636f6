//! Ranges, ticks at 1-2-5 and the numbers beside them.

/// The span of some values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Range {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Range {
    /// Of no value yet.
    pub(super) const EMPTY: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };

    /// Of all finite `values`.
    pub(super) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut range = Self::EMPTY;
        values.into_iter().for_each(|value| range.include(value));
        range
    }

    /// Of all finite `values` but a few far from the rest: of eight and more values up to a twentieth (and at least one) is left out where
    /// that makes the range at most half as wide, as few as do.
    pub(super) fn of_most(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let all = Self::of(values.iter().copied());
        let most = if values.len() < 8 { 0 } else { (values.len() / 20).clamp(1, 50) };
        for count in 1..=most {
            let without = |low: usize| {
                let (first, last) = (values.get(low)?, values.get(values.len() - 1 - (count - low))?);
                Some(Self { low: *first, high: *last })
            };
            let best = (0..=count).filter_map(without).reduce(|a, b| if b.span() < a.span() { b } else { a });
            if let Some(best) = best.filter(|best| best.span() <= 0.5 * all.span()) {
                return best;
            }
        }
        all
    }

    pub(super) fn include(&mut self, value: f64) {
        if value.is_finite() {
            self.low = self.low.min(value);
            self.high = self.high.max(value);
        }
    }

    pub(super) fn span(&self) -> f64 {
        (self.high - self.low).max(0.0)
    }

    /// Largest magnitude.
    pub(super) fn magnitude(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.low.abs().max(self.high.abs()) }
    }

    pub(super) fn is_empty(&self) -> bool {
        !(self.low <= self.high && self.low.is_finite() && self.high.is_finite())
    }

    pub(super) fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    pub(super) fn middle(&self) -> f64 {
        0.5 * self.low + 0.5 * self.high
    }

    /// Never empty and never so narrow that neighbouring ticks would differ in rounding noise only: at least `least`
    /// wide and a millionth of its magnitude, a tenth where all values are the same.
    #[must_use]
    pub(super) fn opened(self, least: f64) -> Self {
        if self.is_empty() {
            return Self { low: 0.0, high: 1.0 };
        }
        let relative = if self.low == self.high { 0.1 } else { 1e-6 };
        let wanted = (relative * self.magnitude()).max(least);
        if self.span() >= wanted {
            return self;
        }
        Self { low: self.middle() - 0.5 * wanted, high: self.middle() + 0.5 * wanted }
    }

    /// Room on both sides, as shares of the span.
    #[must_use]
    pub(super) fn padded(self, below: f64, above: f64) -> Self {
        Self { low: self.low - below * self.span(), high: self.high + above * self.span() }
    }
}

/// One labelled position of an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

/// An axis: where values go, and its ticks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    pub(super) range: Range,
    pub(super) ticks: Vec<Tick>,
    /// Labels are to be multiplied by ten to this power.
    factor: i32,
    logarithmic: bool,
}

impl Axis {
    /// A linear axis over `range` (opened first), with a tick about every `spacing_px` of its `length_px`; ticks on whole
    /// numbers only where `whole`.
    pub(super) fn linear(range: Range, length_px: f64, spacing_px: f64, whole: bool) -> Self {
        let range = range.opened(1e-12);
        let wanted = (length_px / spacing_px).clamp(2.0, 20.0);
        let (mut digit, mut exponent) = round_up_125(range.span() / wanted);
        if whole && exponent < 0 {
            (digit, exponent) = (1, 0);
        }
        let step = f64::from(digit) * power_of_ten(exponent);
        let factor = common_factor(range.magnitude(), exponent);
        let decimals = usize::try_from(factor - exponent).unwrap_or(0);
        let first = (range.low / step - 1e-9).ceil();
        let ticks = (0..100)
            .map(|i| first + f64::from(i))
            .take_while(|k| *k <= range.high / step + 1e-9)
            .map(|k| {
                let units = k * f64::from(digit);
                // Scaled from whole units: never 0.30000000000000004.
                let shown = if exponent >= factor {
                    units * power_of_ten(exponent - factor)
                } else {
                    units / power_of_ten(factor - exponent)
                };
                let value = if exponent < 0 { units / power_of_ten(-exponent) } else { units * power_of_ten(exponent) };
                Tick { value, label: signed(&format!("{shown:.decimals$}")) }
            })
            .collect();
        Self { range, ticks, factor, logarithmic: false }
    }

    /// A logarithmic axis with ticks on decades; values that are not positive have no place on it.
    pub(super) fn logarithmic(range: Range, most_ticks: u32) -> Self {
        let exponent = |value: f64| libm::log10(value.max(1e-300)).clamp(-300.0, 300.0);
        let positive = range.low > 0.0 && !range.is_empty();
        let (low, high) =
            if positive { (exponent(range.low).floor(), exponent(range.high).ceil()) } else { (0.0, 1.0) };
        let (low, high) = if low == high { (low - 1.0, high + 1.0) } else { (low, high) };
        let (low, high) = (whole(low), whole(high));
        let most = i32::try_from(most_ticks.max(1)).unwrap_or(1);
        let step = ((high - low + most - 1) / most).max(1);
        let first = low + (-low).rem_euclid(step);
        let ticks = (0..=600)
            .map(|i| first + i * step)
            .take_while(|e| *e <= high)
            .map(|e| Tick { value: power_of_ten(e), label: format!("10{}", superscript(e)) })
            .collect();
        let range = Range { low: power_of_ten(low), high: power_of_ten(high) };
        Self { range, ticks, factor: 0, logarithmic: true }
    }

    /// A logarithmic axis over just `range` (which is positive, else it is linear): ticks at 1, 2 and 5, at decades where
    /// they are many, at even steps where the range is narrow.
    pub(super) fn logarithmic_within(range: Range, length_px: f64, spacing_px: f64) -> Self {
        let linear = Self::linear(range, length_px, spacing_px, false);
        if !(range.low > 0.0) || range.is_empty() || range.low == range.high {
            return linear;
        }
        let wanted = length_px / spacing_px;
        let (low, high) = (whole(libm::floor(libm::log10(range.low))), whole(libm::ceil(libm::log10(range.high))));
        let inside = |value: &f64| (range.low * (1.0 - 1e-9)..=range.high * (1.0 + 1e-9)).contains(value);
        let ticks = |digits: &'static [u8], step: usize| -> Vec<Tick> {
            let values = (low..=high)
                .step_by(step)
                .flat_map(|exponent| digits.iter().map(move |digit| f64::from(*digit) * power_of_ten(exponent)));
            values.filter(inside).map(|value| Tick { value, label: significant(value, 6) }).collect()
        };
        let fine = ticks(&[1, 2, 5], 1);
        let mut factor = 0;
        let ticks = if fine.len() < 3 {
            factor = linear.factor;
            linear.ticks.into_iter().filter(|tick| inside(&tick.value)).collect()
        } else if fine.len() as f64 <= 1.3 * wanted {
            fine
        } else {
            let decades = ticks(&[1], 1);
            let step = usize::try_from(whole((decades.len() as f64 / wanted).ceil())).unwrap_or(1).max(1);
            ticks(&[1], step)
        };
        Self { range, ticks, factor, logarithmic: true }
    }

    /// A logarithmic axis over exactly `range` (positive), with labelled ticks at 1, 2 and 5 in every decade, or at decades
    /// alone where there are more than four.
    pub(super) fn decades(range: Range) -> Self {
        let rounded = Self::logarithmic(range, 12);
        if !(range.low > 0.0 && range.low < range.high && range.high.is_finite()) {
            return rounded;
        }
        let decades = libm::log10(range.high / range.low);
        if decades > 8.0 {
            return Self {
                range,
                ticks: rounded.ticks.into_iter().filter(|t| range.holds(t.value)).collect(),
                ..rounded
            };
        }
        let digits: &[u8] = if decades > 4.0 { &[1] } else { &[1, 2, 5] };
        let first = whole(libm::floor(libm::log10(range.low)));
        let exponents = first..=first + whole(decades) + 1;
        let ticks = exponents.flat_map(|e| digits.iter().map(move |d| (*d, e))).map(|(digit, exponent)| {
            let value = format!("{digit}e{exponent}").parse().unwrap_or(1.0);
            Tick { value, label: significant(value, 3) }
        });
        Self { range, ticks: ticks.filter(|tick| range.holds(tick.value)).collect(), factor: 0, logarithmic: true }
    }

    /// Where `value` lies: 0 at the low end, 1 at the high end.
    pub(super) fn share(&self, value: f64) -> f64 {
        let place = |v: f64| if self.logarithmic { libm::log10(v.max(1e-300)) } else { v };
        let (low, high) = (place(self.range.low), place(self.range.high));
        // Halved, so that the widest ranges do not overflow.
        (0.5 * place(value) - 0.5 * low) / (0.5 * high - 0.5 * low)
    }

    /// `quantity [unit]`, with the power of ten that the labels leave out.
    pub(super) fn title(&self, quantity: &str, unit: &str) -> String {
        match (self.factor, unit) {
            (0, "") => quantity.to_owned(),
            (0, _) => format!("{quantity} [{unit}]"),
            (factor, _) => {
                format!("{quantity} [10{}{}{unit}]", superscript(factor), if unit.is_empty() { "" } else { " " })
            }
        }
    }
}

/// The power of ten, a multiple of three, that all labels share: none while the plain numbers are short.
fn common_factor(magnitude: f64, step_exponent: i32) -> i32 {
    if (1e-2..1e5).contains(&magnitude) || magnitude == 0.0 {
        return 0;
    }
    let factor = whole(libm::floor(libm::log10(magnitude) / 3.0 + 1e-12)) * 3;
    // A long offset before small steps: the plain numbers say it better while they are not too long.
    if factor - step_exponent > 4 && (1e-2..1e8).contains(&magnitude) { 0 } else { factor }
}

/// The next of 1, 2, 5 times a power of ten at or above `value`: digit and exponent.
pub(super) fn round_up_125(value: f64) -> (u8, i32) {
    let value = if value.is_finite() { value.max(1e-300) } else { 1.0 };
    let exponent = whole(libm::floor(libm::log10(value)));
    let lead = value / power_of_ten(exponent) * (1.0 - 1e-12);
    match lead {
        l if l <= 1.0 => (1, exponent),
        l if l <= 2.0 => (2, exponent),
        l if l <= 5.0 => (5, exponent),
        _ => (1, exponent + 1),
    }
}

/// Exactly rounded `10^exponent`.
pub(super) fn power_of_ten(exponent: i32) -> f64 {
    format!("1e{exponent}").parse().unwrap_or(1.0)
}

#[allow(clippy::cast_possible_truncation)] // small by construction; a cast saturates
fn whole(value: f64) -> i32 {
    value as i32
}

/// With a real minus sign, and none before a zero.
fn signed(number: &str) -> String {
    match number.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => number.to_owned(),
    }
}

fn superscript(number: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    number
        .to_string()
        .chars()
        .map(|c| c.to_digit(10).and_then(|d| DIGITS.get(d as usize)).copied().unwrap_or('⁻'))
        .collect()
}

/// A figure in a sentence: `digits` significant ones, thousands set apart from 10 000 on, powers of ten at the extremes.
pub(super) fn significant(value: f64, digits: u8) -> String {
    if !value.is_finite() {
        return if value.is_nan() { "?".to_owned() } else { signed(if value < 0.0 { "-∞" } else { "∞" }) };
    }
    let digits = i32::from(digits.max(1));
    let text = format!("{value:.*e}", usize::try_from(digits - 1).unwrap_or(0));
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if value != 0.0 && !(-4..7).contains(&exponent) {
        return format!("{}·10{}", signed(trimmed(mantissa)), superscript(exponent));
    }
    let decimals = usize::try_from(digits - 1 - exponent).unwrap_or(0);
    let plain = format!("{value:.decimals$}");
    let plain = signed(trimmed(&plain));
    if plain.contains('.') || exponent < 4 {
        return plain;
    }
    let mut grouped = String::new();
    let count = plain.chars().filter(char::is_ascii_digit).count();
    let mut left = count;
    for c in plain.chars() {
        if c.is_ascii_digit() && left < count && left % 3 == 0 {
            grouped.push('\u{a0}');
        }
        left -= usize::from(c.is_ascii_digit());
        grouped.push(c);
    }
    grouped
}

/// Values as [`significant`] writes them, with more digits (up to twelve) where different values would read alike.
pub(super) fn told_apart(values: &[f64], digits: u8) -> Vec<String> {
    let written = |digits: u8| -> Vec<String> { values.iter().map(|value| significant(*value, digits)).collect() };
    let is_alike = |texts: &[String]| {
        (0..values.len()).any(|i| (0..i).any(|j| texts[i] == texts[j] && values[i].to_bits() != values[j].to_bits()))
    };
    (digits..=12).map(written).find(|texts| !is_alike(texts)).unwrap_or_else(|| written(12))
}

/// Without zeros behind the decimal point that say nothing.
fn trimmed(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        Axis::linear(Range { low, high }, 600.0, 80.0, false).ticks.into_iter().map(|t| t.label).collect()
    }

    #[test]
    fn ticks_stand_at_1_2_5_with_short_labels() {
        assert_eq!(labels(0.0, 0.7), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7"]);
        assert_eq!(labels(-30.0, 30.0), ["−30", "−20", "−10", "0", "10", "20", "30"]);
        assert_eq!(labels(0.0, 1.2), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0", "1.2"]);
        assert_eq!(labels(999999.5, 1000000.5).first().map(String::as_str), Some("999999.6"));
        assert!(labels(-6e4, 6e4).contains(&"−60000".to_owned()));
    }

    #[test]
    fn large_and_small_values_share_a_power_of_ten() {
        let axis = Axis::linear(Range { low: -6e5, high: 6e5 }, 600.0, 80.0, false);
        assert_eq!(axis.title("jerk", "mm/s³"), "jerk [10³ mm/s³]");
        assert!(axis.ticks.iter().any(|t| t.label == "−400"));
        let axis = Axis::linear(Range { low: 0.0, high: 3e-7 }, 600.0, 80.0, false);
        assert_eq!(axis.title("time", "s"), "time [10⁻⁹ s]");
    }

    #[test]
    fn any_range_gives_a_few_finite_ticks() {
        let ends = [0.0, 1e-300, 1e-12, 1.0, 1.0 + 1e-15, 1e6, 1e15, 1e100, -1e100, -3.0, f64::NAN, f64::INFINITY];
        for low in ends {
            for high in ends {
                for axis in [
                    Axis::linear(Range { low, high }, 600.0, 60.0, false),
                    Axis::linear(Range { low, high }, 600.0, 60.0, true),
                    Axis::logarithmic(Range { low, high }, 8),
                    Axis::decades(Range { low, high }),
                ] {
                    assert!(axis.ticks.len() <= 41, "{low} {high}: {}", axis.ticks.len());
                    assert!(axis.ticks.iter().all(|t| t.value.is_finite() && t.label.len() < 40));
                    assert!(
                        axis.share(axis.range.low).abs() < 1e-9 && (axis.share(axis.range.high) - 1.0).abs() < 1e-9
                    );
                }
            }
        }
    }

    #[test]
    fn one_value_far_from_the_rest_does_not_make_the_range() {
        let mut values: Vec<f64> = (0..59).map(|i| f64::from(i % 13)).collect();
        values.push(-48.0);
        assert_eq!(Range::of_most(values.clone()), Range { low: 0.0, high: 12.0 });
        // A twentieth is left out, more are not.
        values.extend([-48.0, -47.0]);
        assert_eq!(Range::of_most(values.clone()), Range { low: 0.0, high: 12.0 });
        values.extend([-46.0, -45.0]);
        assert_eq!(Range::of_most(values), Range { low: -48.0, high: 12.0 });
        // Few values are all shown, and so is a steady slope.
        assert_eq!(Range::of_most([0.0, 1.0, -48.0]), Range { low: -48.0, high: 1.0 });
        assert_eq!(Range::of_most((0..100).map(f64::from)), Range { low: 0.0, high: 99.0 });
        assert!(Range::of_most([f64::NAN]).is_empty());
    }

    #[test]
    fn different_values_never_read_alike() {
        assert_eq!(told_apart(&[27.0269, 27.0271, 27.5], 4), ["27.0269", "27.0271", "27.5"]);
        assert_eq!(told_apart(&[27.0, 27.0], 4), ["27", "27"]);
        assert_eq!(told_apart(&[1.0, 2.0], 4), ["1", "2"]);
        assert_eq!(told_apart(&[1.0, 1.0 + 1e-15], 4), ["1", "1"]);
        assert!(told_apart(&[], 4).is_empty());
    }

    #[test]
    fn metrics_read_as_a_person_writes_them() {
        assert_eq!(significant(27.0269, 4), "27.03");
        assert_eq!(significant(48146.2, 5), "48\u{a0}146");
        assert_eq!(significant(1234567.0, 7), "1\u{a0}234\u{a0}567");
        assert_eq!(significant(-0.5, 3), "−0.5");
        assert_eq!(significant(5.0, 4), "5");
        assert_eq!(significant(0.0, 4), "0");
        assert_eq!(significant(1.5e9, 3), "1.5·10⁹");
        assert_eq!(significant(2e-7, 3), "2·10⁻⁷");
        assert_eq!(significant(f64::INFINITY, 3), "∞");
    }
}
