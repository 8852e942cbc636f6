//! Control points that a fit of the test curve takes, and how long: 500 points of an ellipse with a wave and, in the first figure
//! of each pair, a ripple. Then how the time grows with the number of points. Beside it: benches/peers/fitpack.py.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use servosim::toolpath::fit::{FitOptions, Method, fit};

use crate::seconds;

pub(crate) fn bench(quick: bool) {
    let tolerances = if quick { vec![0.5] } else { vec![0.5, 0.25, 0.05, 0.01, 0.005] };
    let curves = [1.5, 0.0].map(|ripple| curve(500, ripple));
    let promised = [
        (Method::Standard, "standard", "51/12 54/14 123/18 188/26 236/28"),
        (Method::Paper, "paper", "fewer"),
        (Method::Density, "density", "18/12 22/14 33/18 48/23 55/25, 1 s"),
        (Method::Free, "free", "14/9 18/11 23/14 36/22 51/26, 10 s"),
    ];
    for (method, name, promise) in promised {
        let mut slowest = 0.0_f64;
        let counts: Vec<String> = tolerances
            .iter()
            .map(|&tolerance| {
                let [rough, smooth] = [0, 1].map(|curve| {
                    let options = FitOptions { method, ..FitOptions::cubic(tolerance) };
                    let (time, fitted) = seconds(|| fit(&curves[curve], &options).expect("a fit"));
                    slowest = slowest.max(time);
                    fitted.curve.control_points_mm().len()
                });
                format!("{rough}/{smooth}")
            })
            .collect();
        println!("fit, {name:<9} {:<34} slowest {slowest:.2} s  (promised: {promise})", counts.join(" "));
    }
    let sizes = if quick { vec![1000] } else { vec![1000, 10_000, 100_000, 1_000_000] };
    for (method, name) in [(Method::Density, "density"), (Method::Free, "free")] {
        for &size in &sizes {
            let points = curve(size, 1.5);
            let options = FitOptions { method, ..FitOptions::cubic(0.01) };
            let (time, fitted) = seconds(|| fit(&points, &options).expect("a fit"));
            println!(
                "fit, {name:<9} {size:>8} points within 0.01 mm: {:>3} control points, {time:.3} s, {:.2} µs a point",
                fitted.curve.control_points_mm().len(),
                1e6 * time / f64::from(size)
            );
        }
    }
}

fn curve(points: u32, ripple: f64) -> Vec<Vector3<f64>> {
    let point = |i| {
        let t = TAU * f64::from(i) / f64::from(points - 1);
        let hump = (t - 4.0) / 0.25;
        let z = 3.0 * (3.0 * t).sin() + ripple * (24.0 * (t - 4.0)).sin() * (-hump * hump).exp();
        Vector3::new(40.0 * t.cos(), 25.0 * t.sin(), z)
    };
    (0..points).map(point).collect()
}
