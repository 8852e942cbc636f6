//! Motion under axis limits: closed forms, limits between grid points on random splines, bad input.

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{
    AxisLimited, AxisLimitedPlan, AxisLimits, FeedrateError, Motion, MotionSample, PathShape, Profile,
};
use servosim::path::{Circle, Cursor, Path, PhSpline};

/// How a path runs, as the planner asks for it.
fn shape<const D: usize>(path: &dyn Path<D>) -> impl FnMut(f64) -> PathShape<D> {
    let mut cursor = Cursor::default();
    move |s| {
        let frame = path.frame(s, &mut cursor);
        PathShape {
            tangent: frame.tangent.into(),
            curvature_1_mm: frame.curvature_1_mm.into(),
            curvature_rate_1_mm2: frame.curvature_rate_1_mm2.into(),
        }
    }
}

fn plan<const D: usize>(planner: &AxisLimited<D>, path: &dyn Path<D>) -> AxisLimitedPlan {
    planner.plan(path.length_mm(), shape(path)).unwrap()
}

fn planar(velocity: f64, acceleration: f64, jerk: f64) -> AxisLimits<2> {
    AxisLimits { velocity_mm_s: [velocity; 2], acceleration_mm_s2: [acceleration; 2], jerk_mm_s3: [jerk; 2] }
}

/// The largest shares of velocity, acceleration and jerk limits that a motion uses along a path, at evenly spaced times.
fn used<const D: usize>(planner: &AxisLimited<D>, path: &dyn Path<D>, motion: &Motion, times: u32) -> [f64; 3] {
    let mut shape = shape(path);
    let mut used = [0.0_f64; 3];
    let mut before = 0.0;
    for i in 0..=times {
        let m = motion.at(motion.total_s() * f64::from(i) / f64::from(times));
        assert!(m.s_mm >= before, "{m:?} after {before}");
        before = m.s_mm;
        let MotionSample { feed_mm_s: v, accel_mm_s2: a, jerk_mm_s3: j, .. } = m;
        let at = shape(m.s_mm);
        used[0] = used[0].max(planner.feed_mm_s.map_or(0.0, |feed| v / feed));
        for i in 0..D {
            let (t, k, r) = (at.tangent[i], at.curvature_1_mm[i], at.curvature_rate_1_mm2[i]);
            used[0] = used[0].max((t * v).abs() / planner.limits.velocity_mm_s[i]);
            used[1] = used[1].max((k * v * v + t * a).abs() / planner.limits.acceleration_mm_s2[i]);
            used[2] = used[2].max((r * v * v * v + 3.0 * k * v * a + t * j).abs() / planner.limits.jerk_mm_s3[i]);
        }
    }
    used
}

fn alpha() -> PhSpline {
    let control = [[0., 0.], [12., 18.], [24., 27.], [36., 9.], [24., -9.], [12., 0.], [0., 18.]].map(Vector2::from);
    PhSpline::from_control_points(&control, false).unwrap()
}

fn heart() -> PhSpline {
    let control =
        [[-20., -50.], [0., -5.], [0., 5.], [-20., 50.], [40., 50.], [75., 5.], [75., -5.], [40., -50.]].map(Vector2::from);
    PhSpline::from_control_points(&control, true).unwrap()
}

#[test]
fn explore() {
    for path in [alpha(), heart()] {
        for limits in [planar(150.0, 2000.0, 50_000.0), planar(150.0, 1000.0, 20_000.0), planar(300.0, 5000.0, 1e6)] {
            for step in [None, Some(0.1), Some(0.05)] {
                let mut planner = AxisLimited::new(limits);
                planner.step_mm = step;
                let start = std::time::Instant::now();
                let plan = plan(&planner, &path);
                let time = start.elapsed().as_secs_f64();
                println!("{:.6} {:?} grid {} it {} rounds {} worst {:.5} gap {:.1e} used {:?} time {:.3}", plan.motion.total_s(), step,
                    plan.grid_points, plan.iterations, plan.rounds, plan.worst_share, plan.gap,
                    used(&planner, &path, &plan.motion, 20_000), time);
            }
        }
    }
}
