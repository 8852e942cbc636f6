//! Roundness of a set of points: how far apart two concentric circles are that hold them all.

use crate::optimize::golden_section;

/// A point of a profile: place on the plane counted from the nominal centre, and its distance less the nominal radius \[mm\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Point {
    pub(super) cos: f64,
    pub(super) sin: f64,
    /// Radial deviation \[mm\].
    pub(super) out_mm: f64,
}

/// Two concentric circles around a centre.
#[allow(clippy::struct_field_names)] // a unit
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Zone {
    /// The centre, from the nominal one \[mm\].
    pub(super) centre_mm: [f64; 2],
    /// Distance of the two circles \[mm\].
    pub(super) width_mm: f64,
    /// Mean distance of the points from the centre less the nominal radius \[mm\].
    pub(super) mean_mm: f64,
}

impl Zone {
    /// The zone around a given centre.
    fn around(points: &[Point], radius_mm: f64, centre_mm: [f64; 2]) -> Self {
        let [a, b] = centre_mm;
        let (mut low, mut high, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        for point in points {
            // |p - c| - R without the loss of digits of a difference of lengths: (|p - c|² - R²)/(|p - c| + R).
            let out = point.out_mm;
            let r = radius_mm + out;
            let along = a * point.cos + b * point.sin;
            let square = out * (2.0 * radius_mm + out) - 2.0 * r * along + a * a + b * b;
            let distance = (radius_mm * radius_mm + square).max(0.0).sqrt();
            let out = square / (distance + radius_mm);
            low = low.min(out);
            high = high.max(out);
            sum += out;
        }
        Self { centre_mm, width_mm: (high - low).max(0.0), mean_mm: sum / points.len().max(1) as f64 }
    }

    /// The zone around the least-squares centre, where `Σ (d - a cos θ - b sin θ - c)²` is smallest: exact for points evenly around, and to
    /// second order in deviation over radius.
    ///
    /// Source: ISO 230-4, section 3; A. B. Forbes, "Least-squares best-fit geometric elements", NPL report DITC 140/89.
    pub(super) fn least_squares(points: &[Point], radius_mm: f64) -> Self {
        let mut normal = nalgebra::Matrix3::<f64>::zeros();
        let mut right = nalgebra::Vector3::<f64>::zeros();
        for point in points {
            let row = nalgebra::Vector3::new(point.cos, point.sin, 1.0);
            normal += row * row.transpose();
            right += row * point.out_mm;
        }
        let centre_mm = normal.cholesky().map_or([0.0; 2], |c| {
            let solved = c.solve(&right);
            [solved[0], solved[1]]
        });
        Self::around(points, radius_mm, centre_mm)
    }

    /// The narrowest zone (minimum zone circles).
    ///
    /// To first order in deviation over radius the width is `max(d - a cos θ - b sin θ) - min(…)`, convex in the centre `(a, b)`. It is minimised
    /// over few points, to which the outermost of all are added until none is outside; the width told is the exact one around that centre.
    pub(super) fn narrowest(points: &[Point], radius_mm: f64) -> Self {
        let least = Self::least_squares(points, radius_mm);
        let mut active: Vec<Point> = points.iter().copied().step_by((points.len() / 16).max(1)).collect();
        let mut centre = least.centre_mm;
        for _ in 0..60 {
            let (inner, outer) = extremes(points, centre);
            let width = lag(outer, centre) - lag(inner, centre);
            let known = spread(&active, centre);
            if width <= known * (1.0 + 1e-9) + 1e-13 {
                break;
            }
            active.extend([inner, outer]);
            centre = minimum(&active, least.centre_mm, least.width_mm);
        }
        let found = Self::around(points, radius_mm, centre);
        if found.width_mm <= least.width_mm { found } else { least }
    }
}

/// Deviation of a point seen from another centre, to first order.
fn lag(point: Point, [a, b]: [f64; 2]) -> f64 {
    point.out_mm - a * point.cos - b * point.sin
}

/// The innermost and the outermost point.
fn extremes(points: &[Point], centre: [f64; 2]) -> (Point, Point) {
    let none = Point { cos: 1.0, sin: 0.0, out_mm: 0.0 };
    let first = points.first().copied().unwrap_or(none);
    let mut ends = ((lag(first, centre), first), (lag(first, centre), first));
    for &point in points {
        let out = lag(point, centre);
        if out < ends.0.0 {
            ends.0 = (out, point);
        }
        if out > ends.1.0 {
            ends.1 = (out, point);
        }
    }
    (ends.0.1, ends.1.1)
}

fn spread(points: &[Point], centre: [f64; 2]) -> f64 {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for &point in points {
        let out = lag(point, centre);
        low = low.min(out);
        high = high.max(out);
    }
    high - low
}

/// Where the spread is smallest: convex in both coordinates, so one golden section inside another finds it.
fn minimum(points: &[Point], around: [f64; 2], width: f64) -> [f64; 2] {
    let best_y = |x: f64| golden_section(around[1] - width, around[1] + width, 52, |y| spread(points, [x, y]));
    let (x, _) = golden_section(around[0] - width, around[0] + width, 52, |x| best_y(x).1);
    [x, best_y(x).0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn profile(count: u32, radius: f64, out: impl Fn(f64) -> f64, [a, b]: [f64; 2]) -> Vec<Point> {
        let place = |k| {
            let angle = TAU * f64::from(k) / f64::from(count);
            let r = radius + out(angle);
            let (x, y) = (a + r * angle.cos(), b + r * angle.sin());
            let distance = x.hypot(y);
            Point { cos: x / distance, sin: y / distance, out_mm: distance - radius }
        };
        (0..count).map(place).collect()
    }

    #[test]
    fn an_ellipse_off_centre_has_the_width_of_its_axes() {
        for centre in [[0.0, 0.0], [0.004, -0.009], [-0.02, 0.01]] {
            let points = profile(5000, 50.0, |t| 0.003 + 0.007 * (2.0 * t).cos(), centre);
            for zone in [Zone::least_squares(&points, 50.0), Zone::narrowest(&points, 50.0)] {
                // Linear in the centre: right to offset times deviation over radius, 6 nm here.
                assert!((zone.width_mm - 0.014).abs() < 6e-6, "{zone:?}");
                assert!((zone.centre_mm[0] - centre[0]).abs() < 1e-5, "{zone:?}");
                assert!((zone.mean_mm - 0.003).abs() < 1e-6, "{zone:?}");
            }
        }
    }

    #[test]
    fn one_spike_is_narrower_from_another_centre() {
        // From the centre of all others a lone spike of height h is h wide; moved by h/4 towards it the zone is narrower.
        let spike = |t: f64| if t == 0.0 { 0.01 } else { 0.0 };
        let points = profile(3600, 50.0, spike, [0.0, 0.0]);
        let (least, narrow) = (Zone::least_squares(&points, 50.0), Zone::narrowest(&points, 50.0));
        assert!((least.width_mm - 0.01).abs() < 1e-4, "{least:?}");
        // Moved by a: the spike is 0.01 - a, its neighbours -a, the far side a, so max(0.01 - a, a) + a; 0.01 from a = 0 on.
        assert!(narrow.width_mm <= 0.01 && narrow.width_mm > 0.00999, "{narrow:?}");
        // Two opposite dents and an egg: against a fine search over all centres.
        let points = profile(720, 20.0, |t| 0.004 * (3.0 * t).sin().powi(3) + 0.002 * (t + 0.3).cos().abs(), [0.0; 2]);
        let found = Zone::narrowest(&points, 20.0).width_mm;
        let mut best = f64::INFINITY;
        for i in -100..=100 {
            for j in -100..=100 {
                let centre = [f64::from(i) * 2e-5, f64::from(j) * 2e-5];
                best = best.min(Zone::around(&points, 20.0, centre).width_mm);
            }
        }
        assert!(found <= best + 1e-9 && found > best - 3e-5, "{found} {best}");
    }

    #[test]
    fn hostile_points_are_taken() {
        for points in [vec![], profile(1, 1.0, |_| 0.0, [0.0; 2]), profile(2, 1.0, |_| 0.1, [0.0; 2])] {
            let _ = (Zone::least_squares(&points, 1.0), Zone::narrowest(&points, 1.0));
        }
        let nan = [Point { cos: f64::NAN, sin: 0.0, out_mm: f64::NAN }; 4];
        let _ = Zone::narrowest(&nan, 1.0);
    }
}
