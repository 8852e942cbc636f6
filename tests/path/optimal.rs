//! Motion under axis limits: closed forms, limits between grid points on random splines, bad input.

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{
    AxisLimited, AxisLimitedPlan, AxisLimits, FeedOverride, FeedrateError, Motion, MotionSample, OverrideStep,
    PathShape, Profile,
};
use servosim::path::{Circle, Cursor, Line, Path, PhSpline};

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
    let control = [[-20., -50.], [0., -5.], [0., 5.], [-20., 50.], [40., 50.], [75., 5.], [75., -5.], [40., -50.]]
        .map(Vector2::from);
    PhSpline::from_control_points(&control, true).unwrap()
}

fn line() -> PathShape<2> {
    PathShape { tangent: [0.8, 0.6], curvature_1_mm: [0.0; 2], curvature_rate_1_mm2: [0.0; 2] }
}

#[test]
fn validates_a_straight_line_against_the_seven_phases() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    for _ in 0..16 {
        let mut power = |low: f64, high: f64| 10.0_f64.powf(rng.random_range(low..high));
        let (velocity, acceleration, jerk, length) =
            (power(1.5, 3.0), power(2.0, 4.0), power(3.5, 6.0), power(0.0, 1.5));
        let plan = AxisLimited::new(planar(velocity, acceleration, jerk)).plan(length, |_| line()).unwrap();
        // X is the busier axis: the path may have 1/0.8 of its limits.
        let profile = Profile::JerkLimited { accel_mm_s2: acceleration / 0.8, jerk_mm_s3: jerk / 0.8 };
        let exact = Motion::plan(length, velocity / 0.8, profile).unwrap().total_s();
        // The jerk of an interval is held to its limit at the faster end of it: 1 % in time where intervals are coarse.
        let ratio = plan.motion.total_s() / exact;
        assert!((0.9998..1.012).contains(&ratio), "{velocity} {acceleration} {jerk} {length}: {ratio}");
    }
}

#[test]
fn validates_a_circle_at_the_speed_of_its_limits() {
    // Where an axis points to the centre v² = a r, or v³ = j r² at right angles to it.
    let (radius, acceleration) = (20.0, 1000.0);
    let circle = Circle::new(Vector2::zeros(), radius, 0.0, true).unwrap();
    for (jerk, exact) in [(1e6, (acceleration * radius).sqrt()), (2000.0, (2000.0 * radius * radius).cbrt())] {
        let planner = AxisLimited::new(planar(1e4, acceleration, jerk));
        let motion = plan(&planner, &circle).motion;
        // Nowhere faster than the tighter axis allows at 45 degrees to it, on the way never slower than the circle's own speed.
        let middle: Vec<f64> = (40..60).map(|i| motion.at(motion.total_s() * f64::from(i) / 100.0).feed_mm_s).collect();
        let slowest = middle.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((0.95..1.05).contains(&(slowest / exact)), "{slowest} {exact}");
        // Commanded to less than that the circle keeps the feed, within the gap of the search.
        let slower = plan(&planner.with_feed(0.8 * exact), &circle).motion;
        let cruise = slower.at(0.5 * slower.total_s());
        assert!((cruise.feed_mm_s / (0.8 * exact) - 1.0).abs() < 2e-3, "{cruise:?}");
    }
}

#[test]
fn validates_huge_jerk_limits_against_bang_bang_acceleration() {
    let planner = AxisLimited::new(planar(1e3, 1000.0, 1e9));
    for length in [1.0, 30.0, 400.0] {
        let plan = planner.plan(length, |_| line()).unwrap();
        let exact = 2.0 * (length * 0.8 / 1000.0_f64).sqrt();
        let ratio = plan.motion.total_s() / exact;
        assert!((0.9998..1.01).contains(&ratio), "{length}: {ratio}");
    }
}

#[test]
fn limits_hold_between_grid_points_on_random_splines() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    let mut planned = 0;
    while planned < 30 {
        let mut power = |low: f64, high: f64| 10.0_f64.powf(rng.random_range(low..high));
        let size = power(0.0, 1.3);
        let mut limits = planar(1.0, 1.0, 1.0);
        for i in 0..2 {
            limits.velocity_mm_s[i] = power(1.5, 2.7);
            limits.acceleration_mm_s2[i] = power(2.5, 4.0);
            limits.jerk_mm_s3[i] = power(3.7, 6.0);
        }
        let feed = power(1.5, 3.0);
        let count = rng.random_range(4..9_u32);
        let closed = rng.random_range(0..3_u8) == 0;
        let points: Vec<Vector2<f64>> = (0..count)
            .map(|i| {
                let x = f64::from(i) + rng.random_range(-0.3..0.3);
                Vector2::new(x, rng.random_range(-1.0..1.0)) * size
            })
            .collect();
        // Not every set of points has a spline of the wanted kind.
        let Ok(path) = PhSpline::from_nodal_points(&points, closed && count > 4, None) else { continue };
        planned += 1;
        let planner = AxisLimited::new(limits).with_feed(feed);
        let plan = plan(&planner, &path);
        let times = 10 * u32::try_from(plan.grid_points).unwrap();
        let used = used(&planner, &path, &plan.motion, times);
        let case = format!("{points:?} {planner:?} {used:?} {} {} {}", plan.rounds, plan.worst_share, plan.grid_points);
        assert!(used.iter().all(|ratio| *ratio <= 1.001), "{case}");
        // Something is always at its limit.
        assert!(used.iter().any(|ratio| *ratio > 0.99), "{case}");
        assert!(plan.gap <= 1e-3, "{case} {}", plan.gap);
        let motion = &plan.motion;
        let (start, end) = (motion.at(0.0), motion.at(motion.total_s()));
        assert_eq!((start.s_mm, start.feed_mm_s, start.accel_mm_s2), (0.0, 0.0, 0.0));
        assert_eq!((end.s_mm, end.feed_mm_s, end.accel_mm_s2), (path.length_mm(), 0.0, 0.0));
        // The samples are derivatives of each other.
        let (t, h) = (0.37 * motion.total_s(), 1e-5 * motion.total_s());
        let (before, at, after) = (motion.at(t - h), motion.at(t), motion.at(t + h));
        let slope = (after.s_mm - before.s_mm) / (2.0 * h);
        assert!((slope - at.feed_mm_s).abs() <= 1e-4 * motion.feed_mm_s(), "{case}");
    }
}

#[test]
fn the_jerk_vanishes_at_constant_feed() {
    let diagonal = Line::new(Vector2::zeros(), Vector2::new(80.0, 60.0)).unwrap();
    let (alpha, heart) = (alpha(), heart());
    for (path, name) in [(&diagonal as &dyn Path<2>, "line"), (&alpha, "alpha"), (&heart, "heart")] {
        for (feed, limits) in [60.0, 100.0].into_iter().flat_map(|feed| {
            [planar(150.0, 2000.0, 50_000.0), planar(150.0, 1000.0, 20_000.0)].map(|limits| (feed, limits))
        }) {
            let planner = AxisLimited::new(limits).with_feed(feed);
            let plan = plan(&planner, path);
            let motion = &plan.motion;
            // In the end all of it may be a little slower.
            let cruise = motion.feed_mm_s();
            assert!(cruise >= feed * (1.0 - 3e-4), "{name} {feed}: {cruise}");
            // Constant where it is the same 5 ms before and after.
            let (dt, around) = (2.5e-4, 20_usize);
            let samples: Vec<MotionSample> = (0..100_000)
                .map(|i| dt * f64::from(i))
                .take_while(|t| *t < motion.total_s())
                .map(|t| motion.at(t))
                .collect();
            let constant = |window: &&[MotionSample]| window.iter().all(|m| m.feed_mm_s >= cruise * (1.0 - 2e-6));
            let cruising: Vec<MotionSample> =
                samples.windows(2 * around + 1).filter(constant).map(|window| window[around]).collect();
            let ratio = cruising.len() as f64 / samples.len() as f64;
            assert!(ratio > 0.5, "{name} {feed} {limits:?}: {ratio}");
            let jerk = cruising.iter().map(|m| m.jerk_mm_s3.abs()).fold(0.0, f64::max);
            // A point of the grid close to another tells 1e-7 of the feed as 1 %; elsewhere it is far less.
            assert!(jerk <= 0.02 * limits.jerk_mm_s3[0], "{name} {feed} {limits:?}: {jerk}");
        }
    }
}

#[test]
fn regression_times_of_alpha_and_heart() {
    for (path, limits, time_s) in [
        (alpha(), planar(150.0, 2000.0, 50_000.0), 0.7294),
        (alpha(), planar(150.0, 1000.0, 20_000.0), 0.9752),
        (alpha(), planar(300.0, 5000.0, 1e6), 0.4157),
        (heart(), planar(150.0, 2000.0, 50_000.0), 1.8951),
        (heart(), planar(150.0, 1000.0, 20_000.0), 2.0474),
        (heart(), planar(300.0, 5000.0, 1e6), 0.9674),
    ] {
        let planner = AxisLimited::new(limits);
        let motion = plan(&planner, &path).motion;
        assert!((motion.total_s() / time_s - 1.0).abs() < 5e-4, "{} {time_s}", motion.total_s());
        let used = used(&planner, &path, &motion, 20_000);
        assert!(used.iter().all(|ratio| *ratio <= 1.001), "{used:?}");
    }
}

#[test]
fn iterations_do_not_grow_with_the_grid() {
    let path = alpha();
    let found = [0.2, 0.1, 0.05, 0.025].map(|step| {
        let planner = AxisLimited { step_mm: Some(step), ..AxisLimited::new(planar(150.0, 2000.0, 50_000.0)) };
        let plan = plan(&planner, &path);
        assert!(
            (plan.motion.total_s() / 0.7294 - 1.0).abs() < 5e-4,
            "{} {step} {} {} {}",
            plan.motion.total_s(),
            plan.rounds,
            plan.worst_share,
            plan.gap
        );
        plan.iterations
    });
    assert!(found.iter().all(|count| *count <= 80), "{found:?}");
}

#[test]
fn bad_input_is_told() {
    let good = planar(100.0, 1000.0, 1e5);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e10] {
        for which in 0..5 {
            let mut planner = AxisLimited::new(good);
            let mut length = 10.0;
            match which {
                0 => planner.limits.velocity_mm_s[1] = bad,
                1 => planner.limits.acceleration_mm_s2[0] = bad,
                2 => planner.limits.jerk_mm_s3[1] = bad,
                3 => planner.feed_mm_s = Some(bad),
                _ => length = bad,
            }
            let error = planner.plan(length, |_| line()).unwrap_err();
            assert!(matches!(error, FeedrateError::OutOfRange(_)), "{which} {bad}: {error}");
        }
    }
    let planner = AxisLimited::new(good);
    for bad in [f64::NAN, f64::INFINITY, 1e31] {
        let shape = |s: f64| PathShape { curvature_rate_1_mm2: [0.0, if s > 7.0 { bad } else { 0.0 }], ..line() };
        assert!(matches!(planner.plan(10.0, shape), Err(FeedrateError::BadShape { s_mm }) if s_mm > 6.9));
    }
    let nowhere = PathShape { tangent: [0.0; 2], ..line() };
    assert!(matches!(planner.plan(10.0, |_| nowhere), Err(FeedrateError::BadShape { .. })));
    // A corner, a cusp, and an arc right after a line: no speed keeps the limits.
    let corner = |s: f64| PathShape { tangent: if s > 3.0 { [0.6, 0.8] } else { [0.8, 0.6] }, ..line() };
    let cusp = |s: f64| PathShape { tangent: if s > 3.0 { [-0.8, -0.6] } else { [0.8, 0.6] }, ..line() };
    let arc = |s: f64| {
        let (sin, cos) = ((s - 3.0).max(0.0) / 10.0).sin_cos();
        let k = if s > 3.0 { 0.1 } else { 0.0 };
        PathShape {
            tangent: [cos, sin],
            curvature_1_mm: [-k * sin, k * cos],
            curvature_rate_1_mm2: [-k * k * cos, -k * k * sin],
        }
    };
    for shape in [&corner as &dyn Fn(f64) -> PathShape<2>, &cusp, &arc] {
        let error = planner.plan(10.0, shape).unwrap_err();
        assert!(matches!(error, FeedrateError::Corner { s_mm, .. } if (s_mm - 3.0).abs() < 1e-6), "{error}");
    }
    // Very tight and very wide limits are met all the same.
    for (velocity, acceleration, jerk) in [(1e-6, 1e-6, 1e-6), (1e9, 1e9, 1e9), (1e-3, 1e6, 1e9), (1e6, 1e-3, 1e-6)] {
        let planner = AxisLimited::new(planar(velocity, acceleration, jerk));
        let Ok(plan) = planner.plan(100.0, |_| line()) else {
            // More grid points than there may be.
            continue;
        };
        let motion = &plan.motion;
        for i in 0..=5000 {
            let m = motion.at(motion.total_s() * f64::from(i) / 5000.0);
            assert!(0.8 * m.feed_mm_s <= 1.001 * velocity, "{m:?}");
            assert!(0.8 * m.accel_mm_s2.abs() <= 1.001 * acceleration, "{m:?}");
            assert!(0.8 * m.jerk_mm_s3.abs() <= 1.001 * jerk, "{m:?}");
        }
    }
}

fn step(at_s: f64, ratio: f64, transition_s: f64) -> OverrideStep {
    OverrideStep { at_s, ratio, transition_s }
}

#[test]
fn validates_an_override_against_its_differences_and_keeps_the_path() {
    let planner = AxisLimited::new(planar(150.0, 2000.0, 50_000.0));
    let plan = plan(&planner, &alpha()).motion;
    let transition_s = 0.1;
    let step = |at_s: f64, ratio: f64| step(at_s, ratio, transition_s);
    // Half the feed, a hold, and on with the plan.
    let how = FeedOverride { steps: vec![step(0.1, 0.5), step(0.4, 0.0), step(0.8, 1.0)] };
    let motion = plan.with_override(&how).unwrap();
    let told: Vec<_> = motion.overrides().iter().map(|c| step(c.at_s, c.reached)).collect();
    assert_eq!(told, how.steps);
    // Time lost: a change costs the mean of its ends.
    let long: Vec<f64> = motion.overrides().iter().map(|change| change.transition_s).collect();
    assert!(long.iter().all(|long| (0.1 - 1e-9..0.2).contains(long)), "{long:?}");
    assert!(motion.total_s() > plan.total_s() + 0.1 * 0.25 + 0.2 * 0.5 + 0.1 * 0.75 + 0.3 - long[1] + 0.1 * 0.5);
    let held = motion.at(0.65);
    assert_eq!((held.feed_mm_s, held.accel_mm_s2, held.jerk_mm_s3), (0.0, 0.0, 0.0));
    assert_eq!(motion.at(0.79).s_mm, held.s_mm);
    assert_eq!(motion.at(motion.total_s()).s_mm, alpha().length_mm());
    // Up to the first change it is the plan, bit by bit.
    for i in 0..100 {
        let t = 0.001 * f64::from(i);
        assert_eq!(motion.at(t), plan.at(t));
    }
    let h = 1e-6;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(13);
    for _ in 0..2000 {
        let t = rng.random_range(h..motion.total_s() - h);
        let (before, at, after) = (motion.at(t - h), motion.at(t), motion.at(t + h));
        assert!(((after.s_mm - before.s_mm) / (2.0 * h) - at.feed_mm_s).abs() < 1e-3, "{t} {at:?}");
        assert!(((after.feed_mm_s - before.feed_mm_s) / (2.0 * h) - at.accel_mm_s2).abs() < 0.1, "{t} {at:?}");
        assert!(after.s_mm >= before.s_mm && at.feed_mm_s >= 0.0);
        assert!(at.accel_mm_s2.abs() <= 1.001 * plan.peaks().accel_mm_s2);
    }
    // A plan that ends while the pace changes, and one that ends before the next step.
    for at_s in [plan.total_s() - 0.03, plan.total_s() + 1.0] {
        let late = plan.with_override(&FeedOverride { steps: vec![step(at_s, 0.2)] }).unwrap();
        assert!((late.at(late.total_s() - 1e-9).s_mm - alpha().length_mm()).abs() < 1e-6, "{}", late.total_s());
        assert!(late.total_s() >= plan.total_s() && late.total_s() < plan.total_s() + 0.03, "{}", late.total_s());
    }
    // What comes after the end is told of and does nothing.
    let late = plan.with_override(&FeedOverride { steps: vec![step(plan.total_s() + 0.1, 0.0)] }).unwrap();
    assert!(late.overrides()[0].after_the_end && late.total_s() == plan.total_s() && late.at(0.3) == plan.at(0.3));
    // What changes nothing is the plan itself.
    for steps in [vec![], vec![step(0.1, 1.0), step(0.4, 1.0)]] {
        let same = plan.with_override(&FeedOverride { steps }).unwrap();
        assert_eq!((same.overrides(), &same), (&[][..], &plan));
    }
}

#[test]
fn validates_changes_of_the_override_on_a_cruise_against_the_shortest_there_are() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(14);
    for case in 0..100 {
        let mut power = |low: f64, high: f64| 10.0_f64.powf(rng.random_range(low..high));
        let (feed, accel, jerk) = (power(1.0, 2.5), power(2.0, 4.0), power(3.5, 6.0));
        let line = Motion::plan(1e4, feed, Profile::JerkLimited { accel_mm_s2: accel, jerk_mm_s3: jerk }).unwrap();
        let accel = line.peaks().accel_mm_s2;
        let shares = [rng.random_range(0.0..0.9), 0.0, rng.random_range(1.2..2.0), 1.0];
        let (mut steps, mut at_s, mut from) = (Vec::new(), line.phase_s() + 0.01, 1.0_f64);
        let mut shortest = Vec::new();
        for ratio in shares {
            // Jerk, constant acceleration, jerk: between two feeds.
            let change = feed * (ratio - from).abs();
            let time = if change * jerk <= accel * accel {
                2.0 * (change / jerk).sqrt()
            } else {
                change / accel + accel / jerk
            };
            steps.push(step(at_s, ratio, 0.0));
            shortest.push(time);
            (at_s, from) = (at_s + 1.5 * time + 0.1, ratio);
        }
        let end = at_s;
        let motion = line.with_override(&FeedOverride { steps }).unwrap();
        for (change, shortest) in motion.overrides().iter().zip(&shortest) {
            let longer = change.transition_s / shortest;
            assert!((0.999..1.12).contains(&longer), "case {case}: {change:?} {shortest}");
            assert_eq!(change.reached, change.ratio);
        }
        let (mut largest, mut before) = ([0.0_f64; 2], 0.0);
        for i in 0..=20_000 {
            let m = motion.at(end * f64::from(i) / 20_000.0);
            largest[0] = largest[0].max(m.accel_mm_s2.abs() / accel);
            largest[1] = largest[1].max(m.jerk_mm_s3.abs() / jerk);
            // But for the rounding of the plan's time.
            assert!(m.s_mm >= before * (1.0 - 1e-14), "case {case}: back at {i}");
            before = m.s_mm;
        }
        assert!(largest.iter().all(|ratio| *ratio <= 1.001), "case {case}: {feed} {accel} {jerk} {largest:?}");
        assert_eq!(motion.at(motion.total_s()).s_mm, 1e4);
    }
}

#[test]
fn overrides_that_cannot_be_are_told() {
    let plan = Motion::plan(100.0, 100.0, Profile::Quintic { phase_s: 0.1 }).unwrap();
    let told = |steps: Vec<OverrideStep>| plan.with_override(&FeedOverride { steps }).unwrap_err();
    for bad in [
        step(-1.0, 0.5, 0.1),
        step(f64::NAN, 0.5, 0.1),
        step(0.1, f64::NAN, 0.1),
        step(0.1, -0.1, 0.1),
        step(0.1, 2.1, 0.1),
        step(0.1, 0.5, -0.1),
        step(0.1, 0.5, f64::INFINITY),
    ] {
        assert!(matches!(told(vec![bad]), FeedrateError::OutOfRange(_)), "{bad:?}");
    }
    assert!(matches!(told(vec![step(0.1, 0.5, 0.1); 1001]), FeedrateError::OutOfRange(_)));
    let held = told(vec![step(0.1, 0.5, 0.1), step(0.3, 0.0, 0.1)]);
    assert_eq!(held, FeedrateError::HeldForEver { step: 1, at_s: 0.3 });
    let order = told(vec![step(0.3, 0.5, 0.1), step(0.1, 1.0, 0.1)]);
    assert!(matches!(order, FeedrateError::OverrideOrder { step: 1, .. }), "{order}");
}

/// Points on a trajectory whose direction swings without repeating itself.
fn wandering(count: u32, apart_mm: f64) -> PhSpline {
    let mut point = Vector2::zeros();
    let points: Vec<Vector2<f64>> = (0..count)
        .map(|i| {
            let x = f64::from(i);
            let heading = 0.9 * (0.31 * x).sin() + 0.7 * (0.123 * x + 1.0).sin() + 0.4 * (0.77 * x + 2.0).sin();
            point += Vector2::new(heading.cos(), heading.sin()) * (apart_mm * (1.0 + 0.3 * (0.57 * x).sin()));
            point
        })
        .collect();
    PhSpline::from_nodal_points(&points, false, None).unwrap()
}

#[test]
fn longer_paths_keep_the_limits_and_cost_in_proportion() {
    let planner = AxisLimited::new(planar(150.0, 2000.0, 50_000.0));
    let mut iterations = Vec::new();
    for (count, low, high) in [(32, 310.0, 340.0), (125, 1230.0, 1300.0)] {
        let path = wandering(count, 10.0);
        assert!((low..high).contains(&path.length_mm()), "{}", path.length_mm());
        let plan = plan(&planner, &path);
        let times = 3 * u32::try_from(plan.grid_points).unwrap();
        let used = used(&planner, &path, &plan.motion, times);
        assert!(used.iter().all(|ratio| *ratio <= 1.001), "{count}: {used:?}");
        iterations.push(plan.iterations as f64);
    }
    assert!(iterations[1] < 1.6 * iterations[0], "{iterations:?}");
}

#[test]
fn regression_limits_far_apart_end_in_a_motion() {
    // The jumps of the third derivative were judged at a speed of 150 mm/s that this jerk never reaches: every change was one, and the
    // times were no numbers (or the search for joints did not end).
    for (jerk, time_s) in [(1e-3, 221.466), (1e-6, 2214.66)] {
        let planner = AxisLimited::new(planar(150.0, 2000.0, jerk));
        let total_s = plan(&planner, &alpha()).motion.total_s();
        // Where jerk alone limits, times go with its cube root.
        assert!((total_s / time_s - 1.0).abs() < 2e-3, "{jerk}: {total_s}");
    }
}
