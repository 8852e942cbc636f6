//! Feed overrides: the limits of the plan, the path, holds and their ends, over many random plans and changes.

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{AxisLimited, AxisLimits, FeedOverride, Motion, OverrideStep, PathShape, Profile};
use servosim::path::{Cursor, Path, PhSpline};

fn step(at_s: f64, ratio: f64, transition_s: f64) -> OverrideStep {
    OverrideStep { at_s, ratio, transition_s }
}

fn under(plan: &Motion, steps: &[OverrideStep]) -> Motion {
    plan.with_override(&FeedOverride { steps: steps.to_vec() }).unwrap()
}

/// What the tests of limits allow: 0.1 %.
const KEPT: f64 = 1.001;

/// The largest shares of acceleration and jerk at so many times; the path only goes forwards.
fn used(motion: &Motion, accel: f64, jerk: f64, times: u32) -> [f64; 2] {
    let (mut used, mut before) = ([0.0_f64; 2], 0.0);
    for i in 0..=times {
        let m = motion.at(motion.total_s() * f64::from(i) / f64::from(times));
        // The exponential plan itself comes to rest from the far side, by some nm/s.
        assert!(m.s_mm >= before - 1e-9 && m.feed_mm_s >= -1e-6, "{m:?} after {before}");
        before = m.s_mm;
        used[0] = used[0].max(m.accel_mm_s2.abs() / accel);
        used[1] = used[1].max(m.jerk_mm_s3.abs() / jerk);
    }
    used
}

/// Steps at any time, some of them one right after the other; the last goes on.
fn turned(rng: &mut Xoshiro256PlusPlus, total_s: f64, most: f64) -> Vec<OverrideStep> {
    let count = rng.random_range(1..7);
    let mut steps: Vec<OverrideStep> = (0..count)
        .map(|_| {
            let ratio = match rng.random_range(0..4) {
                0 => 0.0,
                1 => 1.0,
                _ => rng.random_range(0.0..most),
            };
            let transition_s = match rng.random_range(0..4) {
                0 => rng.random_range(0.001..0.2) * total_s,
                _ => 0.0,
            };
            step(rng.random_range(0.0..1.5) * total_s, ratio, transition_s)
        })
        .collect();
    if rng.random_bool(0.3) {
        // In quick succession.
        let first = rng.random_range(0.0..total_s);
        for s in &mut steps {
            s.at_s = first + rng.random_range(0.0..0.1) * total_s;
        }
    }
    steps.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    let last = steps.last().unwrap().at_s;
    steps.push(step(last + rng.random_range(0.0..1.0) * total_s, rng.random_range(0.2..most), 0.0));
    steps
}

/// A hold stands still where it says it does.
fn stands_where_held(motion: &Motion) -> u32 {
    let changes = motion.overrides();
    let mut holds = 0;
    for (i, change) in changes.iter().enumerate() {
        if change.ratio == 0.0 && change.reached == 0.0 && !change.after_the_end {
            let from = change.at_s + change.transition_s;
            let to = changes.get(i + 1).map_or(from, |next| next.at_s);
            let at_rest = motion.at(from + 1e-9 * (1.0 + from));
            for k in 1..10 {
                let m = motion.at(from + (to - from) * f64::from(k) / 10.0 + 1e-9 * (1.0 + from));
                if from + 1e-6 < to {
                    assert_eq!((m.s_mm, m.feed_mm_s, m.accel_mm_s2, m.jerk_mm_s3), (at_rest.s_mm, 0.0, 0.0, 0.0));
                    holds += 1;
                }
            }
        }
    }
    holds
}

fn random_plan(rng: &mut Xoshiro256PlusPlus, kind: usize) -> Motion {
    let mut power = |low: f64, high: f64| 10.0_f64.powf(rng.random_range(low..high));
    let (length, feed, phase_s) = (power(0.5, 3.0), power(1.0, 2.3), power(-1.5, -0.5));
    let (accel_mm_s2, jerk_mm_s3) = (power(2.0, 4.0), power(3.5, 6.0));
    let profile = match kind % 5 {
        0 => Profile::Exponential { phase_s: phase_s.min(0.02 * feed.sqrt()), n_c: 5.0 },
        1 => Profile::Quintic { phase_s },
        2 => Profile::Cubic { phase_s },
        3 => Profile::Linear { phase_s },
        _ => Profile::JerkLimited { accel_mm_s2, jerk_mm_s3 },
    };
    Motion::plan(length, feed, profile)
        .unwrap_or_else(|_| Motion::plan(length, feed, Profile::Quintic { phase_s }).unwrap())
}

#[test]
fn changes_keep_the_limits_of_the_plan_wherever_they_fall() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(41);
    let (mut holds, mut worst) = (0, [0.0_f64; 2]);
    for case in 0..CASES {
        let plan = random_plan(&mut rng, case);
        let steps = turned(&mut rng, plan.total_s(), 2.0);
        let motion = under(&plan, &steps);
        let peaks = plan.peaks();
        let used = used(&motion, peaks.accel_mm_s2, peaks.jerk_mm_s3, 8000);
        worst = [worst[0].max(used[0]), worst[1].max(used[1])];
        if !used.iter().all(|ratio| *ratio <= KEPT) {
            println!("case {case}: {used:?} {plan:?}\n{steps:?}\n{:?}", motion.overrides());
        }
        assert_eq!(motion.at(motion.total_s()).s_mm, plan.length_mm());
        let near = motion.at(motion.total_s() * (1.0 - 1e-9));
        assert!(
            (near.s_mm / plan.length_mm() - 1.0).abs() < 1e-6 && near.feed_mm_s < 1e-3 * peaks.feed_mm_s,
            "case {case}: {near:?}"
        );
        holds += stands_where_held(&motion);
    }
    assert!(holds > 20 && worst.iter().all(|ratio| *ratio <= KEPT), "{worst:?}, {holds} holds");
}

const CASES: usize = 60;

fn alpha() -> PhSpline {
    let control = [[0., 0.], [12., 18.], [24., 27.], [36., 9.], [24., -9.], [12., 0.], [0., 18.]].map(Vector2::from);
    PhSpline::from_control_points(&control, false).unwrap()
}

fn shape(path: &dyn Path<2>) -> impl FnMut(f64) -> PathShape<2> {
    let mut cursor = Cursor::default();
    move |s| PathShape::from(&path.frame(s, &mut cursor))
}

/// The largest shares of the axes' limits of velocity, acceleration and jerk.
fn used_by_axes(path: &dyn Path<2>, motion: &Motion, limits: &AxisLimits<2>, times: u32) -> [f64; 3] {
    let mut shape = shape(path);
    let mut used = [0.0_f64; 3];
    for i in 0..=times {
        let m = motion.at(motion.total_s() * f64::from(i) / f64::from(times));
        let (v, a, j, at) = (m.feed_mm_s, m.accel_mm_s2, m.jerk_mm_s3, shape(m.s_mm));
        for i in 0..2 {
            let (t, k, r) = (at.tangent[i], at.curvature_1_mm[i], at.curvature_rate_1_mm2[i]);
            used[0] = used[0].max((t * v).abs() / limits.velocity_mm_s[i]);
            used[1] = used[1].max((k * v * v + t * a).abs() / limits.acceleration_mm_s2[i]);
            used[2] = used[2].max((r * v * v * v + 3.0 * k * v * a + t * j).abs() / limits.jerk_mm_s3[i]);
        }
    }
    used
}

#[test]
fn changes_keep_the_limits_of_the_axes() {
    let path = alpha();
    // A seed that has found a change, cut off on its way up, that would have gone on beyond 100 %.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1043);
    let (mut worst, mut holds) = ([0.0_f64; 3], 0);
    for _ in 0..3 {
        let mut two = |low: f64, high: f64| [(); 2].map(|()| 10.0_f64.powf(rng.random_range(low..high)));
        let limits =
            AxisLimits { velocity_mm_s: two(1.7, 2.3), acceleration_mm_s2: two(2.8, 3.6), jerk_mm_s3: two(4.2, 5.2) };
        let planner = AxisLimited::new(limits);
        let plan = planner.plan(path.length_mm(), shape(&path)).unwrap().motion;
        for case in 0..8 {
            let steps = turned(&mut rng, plan.total_s(), 1.0);
            let motion = planner.with_override(&plan, &FeedOverride { steps: steps.clone() }, shape(&path)).unwrap();
            let used = used_by_axes(&path, &motion, &limits, 5000);
            worst = std::array::from_fn(|i| worst[i].max(used[i]));
            if !used.iter().all(|ratio| *ratio <= KEPT) {
                println!("case {case}: {used:?} {limits:?}\n{steps:?}\n{:?}", motion.overrides());
            }
            holds += stands_where_held(&motion);
        }
    }
    assert!(holds > 20 && worst.iter().all(|ratio| *ratio <= KEPT), "{worst:?}, {holds} holds");
}

#[test]
fn a_hold_under_limits_of_the_axes_is_prompt() {
    let path = alpha();
    let limits =
        AxisLimits { velocity_mm_s: [80.0, 150.0], acceleration_mm_s2: [2000.0, 1500.0], jerk_mm_s3: [5e4, 4e4] };
    let planner = AxisLimited::new(limits);
    let plan = planner.plan(path.length_mm(), shape(&path)).unwrap().motion;
    let (mut longest, mut sum) = (0.0_f64, 0.0);
    for i in 1..20 {
        let at_s = 0.05 * f64::from(i) * plan.total_s();
        let how = FeedOverride { steps: vec![step(at_s, 0.0, 0.0), step(at_s + 0.4, 1.0, 0.0)] };
        let motion = planner.with_override(&plan, &how, shape(&path)).unwrap();
        let used = used_by_axes(&path, &motion, &limits, 3000);
        assert!(used.iter().all(|ratio| *ratio <= KEPT), "{at_s}: {used:?}");
        longest = longest.max(motion.overrides()[0].transition_s);
        sum += motion.overrides()[0].transition_s;
    }
    // From 150 mm/s: v/a + a/j is 0.14 s. Where the plan speeds up or slows down at the limits itself that has to end first.
    assert!(longest < 0.21 && sum / 19.0 < 0.12, "{longest} {sum}");
}
