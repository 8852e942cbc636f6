//! Adaptive Gauss-Legendre quadrature on `[0, 1]`.

/// Positive nodes and weights of the 10-point rule on `[-1, 1]` (Abramowitz and Stegun, table 25.4).
pub(super) const RULE: [(f64, f64); 5] = [
    (0.14887433898163122, 0.29552422471475287),
    (0.4333953941292472, 0.26926671930999635),
    (0.6794095682990244, 0.21908636251598204),
    (0.8650633666889845, 0.1494513491505806),
    (0.9739065285171717, 0.06667134430868814),
];

fn gauss(f: &dyn Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    half * RULE.iter().map(|(x, w)| w * (f(middle - half * x) + f(middle + half * x))).sum::<f64>()
}

/// `∫₀¹ f`, each piece halved until halving changes it by less than `relative` of the whole, or by less than `absolute`: an
/// integrand that is rounding noise has no digits to agree in.
pub(super) fn integrate(f: &dyn Fn(f64) -> f64, relative: f64, absolute: f64) -> f64 {
    let mut stack = vec![(0.0, 1.0, gauss(f, 0.0, 1.0))];
    let mut scale = stack[0].2.abs();
    let mut sum = 0.0;
    while let Some((low, high, whole)) = stack.pop() {
        let middle = 0.5 * (low + high);
        let (left, right) = (gauss(f, low, middle), gauss(f, middle, high));
        scale = scale.max((sum + left + right).abs());
        if (left + right - whole).abs() <= absolute.max(relative * scale) || high - low < 1e-6 {
            sum += left + right;
        } else {
            stack.push((low, middle, left));
            stack.push((middle, high, right));
        }
    }
    sum
}
