//! Closed splines of 10² … 10⁶ nodal points: time grows linearly.

use nalgebra::Vector2;
use servosim::path::{Path, PhSpline};

use crate::seconds;

pub(crate) fn bench(quick: bool) {
    let largest = if quick { 3 } else { 6 };
    for power in 2..=largest {
        let count = 10_usize.pow(power);
        let points = wavy_circle(count);
        let before = resident_bytes();
        let (time, spline) = seconds(|| PhSpline::from_nodal_points(&points, true, None).expect("a spline"));
        println!(
            "spline, 10^{power} nodal points  {:9.3} ms  ({:.0} ns a point{}, {:.0} mm long)",
            1e3 * time,
            1e9 * time / count as f64,
            memory(before, count),
            spline.length_mm()
        );
    }
}

/// Memory of this process \[bytes\], where the system tells.
fn resident_bytes() -> Option<f64> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(4096.0 * pages.split_whitespace().nth(1)?.parse::<f64>().ok()?)
}

/// What the spline holds, for sizes that stand out from the pages.
fn memory(before: Option<f64>, count: usize) -> String {
    match (before, resident_bytes()) {
        (Some(before), Some(after)) if count >= 100_000 => {
            format!(", {:.0} bytes a point", (after - before) / count as f64)
        }
        _ => String::new(),
    }
}

/// A circle with a ripple, its points about 10 mm apart.
fn wavy_circle(count: usize) -> Vec<Vector2<f64>> {
    let radius = 10.0 * count as f64 / std::f64::consts::TAU;
    (0..count)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / count as f64;
            let r = radius + 5.0 * (0.7 * i as f64).sin();
            Vector2::new(r * angle.cos(), r * angle.sin())
        })
        .map(|p| p * (1e6 / (radius + 10.0)).min(1.0))
        .collect()
}
