//! A box of allowed points.

/// Bounds of every coordinate; missing ones are none.
pub(super) struct Bounds<'a> {
    pub(super) lower: &'a [f64],
    pub(super) upper: &'a [f64],
}

impl Bounds<'_> {
    fn of(&self, i: usize) -> (f64, f64) {
        let low = self.lower.get(i).copied().unwrap_or(f64::NEG_INFINITY);
        (low, self.upper.get(i).copied().unwrap_or(f64::INFINITY))
    }

    /// The nearest allowed value of coordinate `i`.
    pub(super) fn clip(&self, value: f64, i: usize) -> f64 {
        let (low, high) = self.of(i);
        value.min(high).max(low)
    }

    /// The nearest allowed point.
    pub(super) fn clipped(&self, point: &[f64]) -> Vec<f64> {
        point.iter().enumerate().map(|(i, &value)| self.clip(value, i)).collect()
    }

    /// Whether all coordinates are allowed.
    pub(super) fn hold(&self, point: &[f64]) -> bool {
        point.iter().enumerate().all(|(i, &value)| {
            let (low, high) = self.of(i);
            low <= value && value <= high
        })
    }

    /// `value` moved by `step`, the other way where a bound is in the way and there is more room there.
    pub(super) fn moved(&self, value: f64, step: f64, i: usize) -> f64 {
        let (there, back) = (self.clip(value + step, i), self.clip(value - step, i));
        if (there - value).abs() >= (back - value).abs() { there } else { back }
    }
}
