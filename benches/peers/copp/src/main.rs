//! Times of motions under axis limits on three paths, ours and those of `copp`'s third-order cone program.
//!
//! `copp` keeps the limits at the points of a uniform grid and linearises the jerk limits around a profile that is given to it: first that
//! of its second-order solver, then its own answer, until the time moves by less than 1e-4. Ours is planned as a scenario
//! plans it, and its limits hold between the points too: `worst` is the largest share of a limit at ten places a grid interval. In the
//! end `copp` is asked for one motion on ever finer grids, to see which of both times the optimum is nearer to.

use std::time::Instant;

use copp::diag::CoppError;
use copp::robot::Robot;
use copp::solver::topp2_ra::{ReachSet2OptionsBuilder, Topp2ProblemBuilder, topp2_ra};
use copp::solver::topp3_socp::{ClarabelOptionsBuilder, Topp3ProblemBuilder, s_to_t_topp3, topp3_socp};
use nalgebra::{DMatrix, Vector2};
use servosim::feedrate::{AxisLimited, AxisLimits, Motion};
use servosim::interpolator::plan_under_axis_limits;
use servosim::path::{Cursor, Path, PhSpline};

/// Points of copp's grid.
const POINTS: usize = 1001;

/// Most rounds of linearisation.
const ROUNDS: usize = 12;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let alpha = [[0., 0.], [12., 18.], [24., 27.], [36., 9.], [24., -9.], [12., 0.], [0., 18.]].map(Vector2::from);
    let heart = [[-20., -50.], [0., -5.], [0., 5.], [-20., 50.], [40., 50.], [75., 5.], [75., -5.], [40., -50.]];
    let paths = [
        ("alpha", PhSpline::from_control_points(&alpha, false)?),
        ("heart", PhSpline::from_control_points(&heart.map(Vector2::from), true)?),
        ("500 points", PhSpline::from_nodal_points(&wandering(500), false, None)?),
    ];
    let machines = [(150.0, 2000.0, 50_000.0), (150.0, 1000.0, 20_000.0), (300.0, 5000.0, 1e6)];
    println!("path        limits of X and Y         ours s     copp s   ratio   worst   ours ms  points   copp ms  points  rounds");
    for (name, path) in &paths {
        for (velocity, acceleration, jerk) in machines {
            let planner = AxisLimited::new(AxisLimits {
                velocity_mm_s: [velocity; 2],
                acceleration_mm_s2: [acceleration; 2],
                jerk_mm_s3: [jerk; 2],
            });
            let start = Instant::now();
            let ours = plan_under_axis_limits(&planner, path)?;
            let ours_ms = 1e3 * start.elapsed().as_secs_f64();
            let ours_s = ours.motion.total_s();
            let worst = worst(&planner, path, &ours.motion, 10 * ours.grid_points as u32);
            let start = Instant::now();
            let points = if *name == "500 points" { 2 * POINTS - 1 } else { POINTS };
            let theirs = theirs(path, points, velocity, acceleration, jerk);
            let copp_ms = 1e3 * start.elapsed().as_secs_f64();
            let limits = format!("{velocity} {acceleration} {jerk}");
            match theirs {
                Ok((copp_s, rounds)) => println!(
                    "{name:10}  {limits:22}  {ours_s:9.5}  {copp_s:9.5}  {:6.4}  {worst:6.4}  {ours_ms:8.1}  {:6}  {copp_ms:8.1}  {points:6}  {rounds}",
                    ours_s / copp_s,
                    ours.grid_points,
                ),
                Err(error) => println!("{name:10}  {limits:22}  {ours_s:9.5}  copp: {error}"),
            }
        }
    }
    let (_, alpha) = &paths[0];
    for points in [501, 1001, 2001, 4001] {
        match theirs(alpha, points, 150.0, 2000.0, 50_000.0) {
            Ok((time, rounds)) => println!("alpha       150 2000 50000          copp on {points} points: {time:.5} s, {rounds} rounds"),
            Err(error) => println!("alpha       150 2000 50000          copp on {points} points: {error}"),
        }
    }
    for step in [0.2, 0.05, 0.0125] {
        let limits =
            AxisLimits { velocity_mm_s: [150.0; 2], acceleration_mm_s2: [2000.0; 2], jerk_mm_s3: [50_000.0; 2] };
        let planner = AxisLimited { step_mm: Some(step), ..AxisLimited::new(limits) };
        let plan = plan_under_axis_limits(&planner, alpha)?;
        println!(
            "alpha       150 2000 50000          ours on {} points: {:.5} s",
            plan.grid_points,
            plan.motion.total_s()
        );
    }
    Ok(())
}

/// The largest share of a limit at evenly spaced times.
fn worst(planner: &AxisLimited<2>, path: &PhSpline, motion: &Motion, times: u32) -> f64 {
    let mut cursor = Cursor::default();
    let mut worst = 0.0_f64;
    for i in 0..=times {
        let m = motion.at(motion.total_s() * f64::from(i) / f64::from(times));
        let at = path.frame(m.s_mm, &mut cursor);
        let (v, a, j) = (m.feed_mm_s, m.accel_mm_s2, m.jerk_mm_s3);
        for i in 0..2 {
            let (t, k, r) = (at.tangent[i], at.curvature_1_mm[i], at.curvature_rate_1_mm2[i]);
            let limits = &planner.limits;
            worst = worst
                .max((t * v).abs() / limits.velocity_mm_s[i])
                .max((k * v * v + t * a).abs() / limits.acceleration_mm_s2[i])
                .max((r * v * v * v + 3.0 * k * v * a + t * j).abs() / limits.jerk_mm_s3[i]);
        }
    }
    worst
}

/// The time that copp finds, and after how many rounds it no longer moves.
fn theirs(path: &PhSpline, n: usize, velocity: f64, acceleration: f64, jerk: f64) -> Result<(f64, usize), CoppError> {
    // In units of the machine (its acceleration and jerk are 1), as copp's examples have it: in millimetres and seconds its cone solver
    // ends early, with times up to two thirds longer.
    let second = acceleration / jerk;
    let millimetre = acceleration * second * second;
    let length = path.length_mm() / millimetre;
    let s: Vec<f64> = (0..n).map(|i| length * i as f64 / (n - 1) as f64).collect();
    let mut cursor = Cursor::default();
    let frames: Vec<_> = s.iter().map(|&s| path.frame(s * millimetre, &mut cursor)).collect();
    let [x, x1, x2, x3] = [
        DMatrix::from_fn(2, n, |axis, i| frames[i].point_mm[axis] / millimetre),
        DMatrix::from_fn(2, n, |axis, i| frames[i].tangent[axis]),
        DMatrix::from_fn(2, n, |axis, i| frames[i].curvature_1_mm[axis] * millimetre),
        DMatrix::from_fn(2, n, |axis, i| frames[i].curvature_rate_1_mm2[axis] * millimetre * millimetre),
    ];
    let (v, a, j) = (vec![velocity * second / millimetre; 2], vec![1.0; 2], vec![1.0; 2]);
    let minus = |values: &[f64]| values.iter().map(|v| -v).collect::<Vec<f64>>();
    let mut robot = Robot::with_capacity(2, n);
    robot
        .with_s(s.as_slice())?
        .with_q(&x.as_view(), &x1.as_view(), &x2.as_view(), Some(&x3.as_view()), 0)?
        .with_axial_velocity((v.as_slice(), n), (minus(&v).as_slice(), n), 0)?
        .with_axial_acceleration((a.as_slice(), n), (minus(&a).as_slice(), n), 0)?
        .with_axial_jerk((j.as_slice(), n), (minus(&j).as_slice(), n), 0)?;
    let mut around = {
        let problem = Topp2ProblemBuilder::new(&robot, (0, n - 1), (0.0, 0.0)).build()?;
        topp2_ra(&problem, &ReachSet2OptionsBuilder::new().build()?)?
    };
    robot.constraints.amax_substitute(&around, 0)?;
    let options = ClarabelOptionsBuilder::new().allow_almost_solved(true).build()?;
    let mut before = f64::INFINITY;
    for round in 1..=ROUNDS {
        let profile = {
            let problem = Topp3ProblemBuilder::new(&mut robot, 0, &around, (0.0, 0.0), (0.0, 0.0))
                .build_with_linearization()?;
            topp3_socp(&problem, &options)?
        };
        let time = second * s_to_t_topp3(&s, profile.as_parts(), 0.0)?.0;
        if (time - before).abs() <= 1e-4 * time || round == ROUNDS {
            return Ok((time, round));
        }
        before = time;
        around.clone_from(&profile.a);
    }
    Ok((before, ROUNDS))
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
