//! Motions under axis limits along ever longer paths: time grows linearly with the points of the grid.

use nalgebra::Vector2;
use servosim::feedrate::{AxisLimited, AxisLimits};
use servosim::interpolator::plan_under_axis_limits;
use servosim::path::{Path, PhSpline};

use crate::seconds;

pub(crate) fn bench(quick: bool) {
    let limits = AxisLimits { velocity_mm_s: [150.0; 2], acceleration_mm_s2: [2000.0; 2], jerk_mm_s3: [50_000.0; 2] };
    let counts: &[u32] = if quick { &[10] } else { &[30, 300, 3000] };
    for &count in counts {
        let path = PhSpline::from_nodal_points(&wandering(count), false, None).expect("a spline");
        let (time, plan) = seconds(|| plan_under_axis_limits(&AxisLimited::new(limits), &path).expect("a motion"));
        println!(
            "axis limits, {:6} grid points  {:9.1} ms  ({:.1} µs a point, {} iterations; {:.0} mm in {:.3} s)",
            plan.grid_points,
            1e3 * time,
            1e6 * time / plan.grid_points as f64,
            plan.iterations,
            path.length_mm(),
            plan.motion.total_s()
        );
        let motion = &plan.motion;
        let samples = 1_000_000;
        let (time, _) = seconds(|| {
            (0..samples).map(|i| motion.at(motion.total_s() * f64::from(i) / f64::from(samples)).feed_mm_s).sum::<f64>()
        });
        println!("axis limits, a sample of the motion  {:.0} ns", 1e9 * time / f64::from(samples));
    }
}

/// Points about 10 mm apart on a trajectory whose direction swings without repeating itself.
fn wandering(count: u32) -> Vec<Vector2<f64>> {
    let mut point = Vector2::zeros();
    (0..count)
        .map(|i| {
            let x = f64::from(i);
            let heading = 0.9 * (0.31 * x).sin() + 0.7 * (0.123 * x + 1.0).sin() + 0.4 * (0.77 * x + 2.0).sin();
            point += Vector2::new(heading.cos(), heading.sin()) * (10.0 + 3.0 * (0.57 * x).sin());
            point
        })
        .collect()
}
