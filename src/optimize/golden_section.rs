//! One variable, one valley.

/// The least of a function that falls and then rises between two places: where, and its value.
///
/// Every round costs one value and leaves 0.618 of the interval: 60 leave 3e-13 of it.
///
/// Source: J. Kiefer, "Sequential minimax search for a maximum", Proceedings of the American Mathematical Society 4, 1953.
pub(crate) fn golden_section(mut low: f64, mut high: f64, rounds: u32, value: impl Fn(f64) -> f64) -> (f64, f64) {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let (mut left, mut right) = (high - SHARE * (high - low), low + SHARE * (high - low));
    let (mut at_left, mut at_right) = (value(left), value(right));
    for _ in 0..rounds {
        if at_left < at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - SHARE * (high - low);
            at_left = value(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + SHARE * (high - low);
            at_right = value(right);
        }
    }
    if at_left < at_right { (left, at_left) } else { (right, at_right) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_the_bottom_of_valleys() {
        for bottom in [-2.0, -0.7, 0.0, 1.3, 3.0] {
            let (at, value) = golden_section(-2.0, 3.0, 60, |x| (x - bottom).abs() + 5.0);
            assert!((at - bottom).abs() < 1e-11 && (value - 5.0).abs() < 1e-11, "{bottom}: {at} {value}");
        }
    }
}
