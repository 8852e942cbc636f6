//! Parameters of points: where on the curve, between 0 and 1, each of them is expected.

use nalgebra::SVector;

/// How parameters are first given to the points.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Parametrization {
    /// In proportion to the length of the polygon.
    #[default]
    Chord,
    /// In proportion to the sum of the square roots of its legs.
    Centripetal,
    /// Equal steps.
    Uniform,
}

/// From 0 to 1, rising strictly as long as neighbouring points differ.
pub(super) fn parameters<const D: usize>(points: &[SVector<f64, D>], kind: Parametrization) -> Vec<f64> {
    let mut sum = 0.0;
    let mut out = Vec::with_capacity(points.len());
    out.push(0.0);
    for pair in points.windows(2) {
        let leg = (pair[1] - pair[0]).norm();
        sum += match kind {
            Parametrization::Chord => leg,
            Parametrization::Centripetal => leg.sqrt(),
            Parametrization::Uniform => 1.0,
        };
        out.push(sum);
    }
    for t in &mut out {
        *t /= sum;
    }
    if let Some(last) = out.last_mut() {
        *last = 1.0;
    }
    out
}
