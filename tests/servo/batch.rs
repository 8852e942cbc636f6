//! Batches: every lane is the single run, whatever its neighbours, and the quick contouring error is the exact one.

use crate::common::{Case, PROFILE, random_ring, random_walk};
use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{Motion, Profile};
use servosim::limits::Limits;
use servosim::path::{Circle, Cursor, Line, Path, PhSpline};
use servosim::servo::{AxisParameters, Derivative, LoopSettings};
use servosim::simulation::{ReferenceTrajectory, RunMetrics, Simulation, SimulationError};
use servosim::summary::SummaryObserver;

/// The axes with every gain, plant and voltage limit multiplied by a random factor up to `spread` either way.
fn around(rng: &mut Xoshiro256PlusPlus, axes: &[AxisParameters; 2], spread: f64) -> [AxisParameters; 2] {
    let mut factor = || spread.powf(rng.random_range(-1.0..1.0));
    axes.map(|mut axis| {
        axis.pdff.kpp_rad_s_mm *= factor();
        axis.pdff.kpv_nm_s_rad *= factor();
        axis.pdff.kiv_1_s *= factor();
        axis.pdff.kpf_rad_mm *= factor();
        axis.pdff.kvf *= factor();
        axis.plant.gain_rad_s_v *= factor();
        axis.plant.time_constant_s *= factor();
        axis.drive.voltage_limit_v *= factor();
        axis
    })
}

/// The same run through the stream of periods.
fn single(path: &dyn Path<2>, motion: &Motion, axes: [AxisParameters; 2], settings: LoopSettings) -> RunMetrics<2> {
    let mut metrics = SummaryObserver::<2>::new("single");
    let simulation = Simulation::new(path, motion, axes, settings).unwrap();
    simulation.run(&Limits::default(), None, &mut [&mut metrics]).unwrap();
    let summary = metrics.summary();
    RunMetrics {
        max_contour_error_um: summary.max_contour_error_um,
        rms_contour_error_um: summary.rms_contour_error_um,
        max_tracking_error_um: summary.max_tracking_error_um,
        rms_tracking_error_um: summary.rms_tracking_error_um,
        peak_voltage_v: [summary.axes[0].peak_voltage_v, summary.axes[1].peak_voltage_v],
        saturated_share: summary.saturated_share,
        locked_up: summary.locked_up,
    }
}

/// Holds a lane against its run: the loop bit for bit (the voltage shows it), positions to 1e-12 mm, the contouring error to 1 nm.
fn assert_same(lane: &RunMetrics<2>, run: &RunMetrics<2>, what: &str) {
    assert_eq!(lane.peak_voltage_v.map(f64::to_bits), run.peak_voltage_v.map(f64::to_bits), "{what}");
    assert_eq!(lane.saturated_share.to_bits(), run.saturated_share.to_bits(), "{what}");
    assert_eq!(lane.locked_up, run.locked_up, "{what}");
    let close = |a: f64, b: f64, tolerance: f64| (a - b).abs() <= tolerance + 1e-12 * b;
    // 1e-9 µm is 1e-12 mm; the sums of squares round by 1e-13 of themselves.
    assert!(close(lane.max_tracking_error_um, run.max_tracking_error_um, 1e-9), "{what}: {lane:?} {run:?}");
    assert!(close(lane.rms_tracking_error_um, run.rms_tracking_error_um, 1e-9), "{what}: {lane:?} {run:?}");
    assert!(close(lane.max_contour_error_um, run.max_contour_error_um, 1e-3), "{what}: {lane:?} {run:?}");
    assert!(close(lane.rms_contour_error_um, run.rms_contour_error_um, 1e-3), "{what}: {lane:?} {run:?}");
}

#[test]
fn validates_every_lane_against_its_single_run() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(60);
    let (mut saturated, mut locked) = (0, 0);
    for case in Case::both() {
        for derivative in [Derivative::Backward, Derivative::Exact] {
            for one_sample_delay in [false, true] {
                let settings = LoopSettings { derivative, one_sample_delay, ..LoopSettings::default() };
                let motion = case.motion(PROFILE);
                let trajectory = ReferenceTrajectory::new(&case.path, &motion, settings).unwrap();
                let mut axes: Vec<_> = (0..19).map(|_| around(&mut rng, &case.axes, 1.15)).collect();
                // Far too little gain locks up.
                let mut weak = case.axes;
                weak[0].plant.gain_rad_s_v *= 0.15;
                axes.push(weak);
                for (i, (lane, axes)) in trajectory.run(&axes).unwrap().iter().zip(&axes).enumerate() {
                    let run = single(&case.path, &motion, *axes, settings);
                    assert_same(lane, &run, &format!("{} {settings:?} {i}: {axes:?}", case.name));
                    saturated += u32::from(run.saturated_share > 0.0);
                    locked += u32::from(run.locked_up);
                }
            }
        }
    }
    assert!(saturated > 3 && locked > 3, "the test must see both: {saturated} {locked}");
}

#[test]
fn validates_the_contouring_error_on_random_paths() {
    // Splines with tight and with dense segments, lines, circles: pieces that end in every way.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(61);
    let base = Case::alpha().axes;
    let mut runs = 0;
    for case in 0..80 {
        let count = rng.random_range(3..40);
        let path: Box<dyn Path<2>> = match case % 4 {
            0 => {
                let angle = rng.random_range(0.0..6.0_f64);
                Box::new(Line::new(Vector2::zeros(), Vector2::new(angle.cos(), angle.sin()) * 20.0).unwrap())
            }
            1 => {
                Box::new(Circle::new(Vector2::new(3.0, -2.0), rng.random_range(0.3..40.0), 1.0, case % 8 == 1).unwrap())
            }
            2 => match PhSpline::from_nodal_points(&random_ring(&mut rng, count), true, None) {
                Ok(path) => Box::new(path),
                Err(_) => continue,
            },
            _ => match PhSpline::from_nodal_points(&random_walk(&mut rng, count, 1.0), false, None) {
                Ok(path) => Box::new(path),
                Err(_) => continue,
            },
        };
        // Short, so that thousands of samples are not spent on one path.
        let feed_mm_s = (path.length_mm() / 0.4).clamp(1.0, 400.0);
        let motion = Motion::plan(path.length_mm(), feed_mm_s, Profile::Quintic { phase_s: 0.1 }).unwrap();
        if motion.total_s() > 5.0 {
            continue;
        }
        let settings = LoopSettings::default();
        let trajectory = ReferenceTrajectory::new(&*path, &motion, settings).unwrap();
        let axes: Vec<_> = (0..4).map(|_| around(&mut rng, &base, 1.2)).collect();
        for (lane, axes) in trajectory.run(&axes).unwrap().iter().zip(&axes) {
            let run = single(&*path, &motion, *axes, settings);
            assert_same(lane, &run, &format!("case {case}, {} mm, {feed_mm_s} mm/s: {axes:?}", path.length_mm()));
            runs += 1;
        }
    }
    assert!(runs > 200, "only {runs} runs");
}

#[test]
fn a_result_does_not_depend_on_its_neighbours() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(62);
    let case = Case::alpha();
    let motion = case.motion(PROFILE);
    let trajectory = ReferenceTrajectory::new(&case.path, &motion, LoopSettings::default()).unwrap();
    let axes: Vec<_> = (0..70).map(|_| around(&mut rng, &case.axes, 1.2)).collect();
    let whole = trajectory.run(&axes).unwrap();
    for size in [1, 3, 16, 17] {
        let pieces: Vec<_> = axes.chunks(size).flat_map(|chunk| trajectory.run(chunk).unwrap()).collect();
        assert_eq!(whole, pieces, "in pieces of {size}");
    }
    let backwards: Vec<_> = axes.iter().rev().copied().collect();
    assert!(whole.iter().eq(trajectory.run(&backwards).unwrap().iter().rev()));
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(whole, one_core.install(|| trajectory.run(&axes).unwrap()));
    assert!(trajectory.run(&[]).unwrap().is_empty());
}

#[test]
fn validates_graphs_against_the_path_itself() {
    // Points of the path near the foot of the tangent, put into the polynomial: 0.1 nm, and 1e-12 mm for rounding.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(63);
    let mut checked = 0;
    for case in 0..300 {
        let count = rng.random_range(3..30);
        let closed = case % 2 == 0;
        let points = if closed { random_ring(&mut rng, count) } else { random_walk(&mut rng, count, 1.5) };
        let Ok(path) = PhSpline::from_nodal_points(&points, closed, None) else { continue };
        for _ in 0..20 {
            let s = rng.random_range(0.0..path.length_mm());
            let mut cursor = Cursor::default();
            let graph = path.graph(s, &mut cursor).unwrap();
            assert!(graph.from_mm <= 0.0 && graph.to_mm >= 0.0 && graph.to_mm > graph.from_mm);
            for i in 0..=20 {
                // Arc length is at least the chord along the tangent: the point asked for may lie a little inside.
                let ahead = graph.from_mm + (graph.to_mm - graph.from_mm) * f64::from(i) / 20.0;
                let away = path.point_mm(s + ahead, &mut Cursor::default()) - graph.point_mm;
                let (x, y) = (away.dot(&graph.tangent), graph.tangent.x * away.y - graph.tangent.y * away.x);
                let polynomial = graph.coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c) * x * x;
                let scale = 1e-13 * path.length_mm();
                assert!(
                    (polynomial - y).abs() < 1.0e-7 + scale + 1e-12,
                    "case {case} s {s} x {x}: {polynomial} {y} {graph:?}"
                );
                checked += 1;
            }
        }
    }
    assert!(checked > 50_000, "only {checked}");
}

#[test]
fn a_course_that_cannot_be_kept_is_refused() {
    let line = Line::new(Vector2::zeros(), Vector2::new(1e6, 0.0)).unwrap();
    let motion = Motion::plan(1e6, 1.0, Profile::Quintic { phase_s: 0.1 }).unwrap();
    let error = ReferenceTrajectory::new(&line, &motion, LoopSettings::default()).err().unwrap();
    assert!(matches!(error, SimulationError::TooLongForBatch { periods: 1_000_000_001.. }), "{error}");
    let case = Case::alpha();
    let trajectory = ReferenceTrajectory::new(&case.path, &case.motion(PROFILE), LoopSettings::default()).err();
    assert!(trajectory.is_none());
    let motion = case.motion(PROFILE);
    let mut wrong = case.axes;
    wrong[1].pdff.kpp_rad_s_mm = f64::NAN;
    let error = ReferenceTrajectory::new(&case.path, &motion, LoopSettings::default())
        .unwrap()
        .run(&[case.axes, wrong])
        .unwrap_err();
    assert!(error.to_string().contains("kpp"), "{error}");
}
