//! Feedrate: the profile table of the specification, closed forms, and identities on random motions.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{
    BernsteinPhase, ExponentialPhase, FeedState, FeedrateError, JerkLimitedPhase, Motion, Phase, Profile, optimize_n_c,
};
use servosim::optimize::PatternSearch;

const V: f64 = 100.0;
const T: f64 = 0.1;

fn exponential(n_c: f64) -> Phase {
    Phase::Exponential(ExponentialPhase::new(V, T, n_c).unwrap())
}

fn quintic() -> Phase {
    Phase::Bernstein(BernsteinPhase::quintic(FeedState::steady(0.0), FeedState::steady(V), T).unwrap())
}

#[test]
fn validates_the_profile_table_of_the_specification() {
    let (plain, paper) = (quintic().peaks(), exponential(8.12).peaks());
    assert_eq!(format!("{:.2}", plain.jerk_mm_s3), "57735.03");
    assert!((plain.jerk_mm_s3 - 10.0 / 3.0_f64.sqrt() * V / (T * T)).abs() < 1e-7, "{}", plain.jerk_mm_s3);
    assert_eq!(format!("{:.1}", plain.accel_mm_s2), "1875.0");
    assert!((plain.accel_mm_s2 - 1.875 * V / T).abs() < 1e-9, "{}", plain.accel_mm_s2);
    assert_eq!(format!("{:.0}", paper.jerk_mm_s3), "49127");
    assert_eq!(format!("{:.1}", paper.accel_mm_s2), "1777.7");

    let found = optimize_n_c(V, T).unwrap();
    assert!(found.converged);
    assert_eq!(format!("{:.3}", found.point[0]), "8.350");
    assert_eq!(format!("{:.0}", found.objective), "48146");
    let reduction = |jerk: f64| 100.0 * (1.0 - jerk / plain.jerk_mm_s3);
    assert_eq!(format!("{:.1}", reduction(paper.jerk_mm_s3)), "14.9");
    assert_eq!(format!("{:.1}", reduction(found.objective)), "16.6");

    // The floor: no phase from rest to V in T has less jerk than 4 V/T², which bang-bang jerk reaches.
    let bang_bang = Phase::JerkLimited(JerkLimitedPhase::new(V, 2.0 * V / T, 4.0 * V / (T * T)).unwrap());
    assert!((bang_bang.duration_s() - T).abs() < 1e-15, "{}", bang_bang.duration_s());
    assert!((bang_bang.peaks().jerk_mm_s3 - 40_000.0).abs() < 1e-9);
    assert!(found.objective > 40_000.0);
}

#[test]
fn validates_the_best_n_c_against_a_dense_search() {
    let found = optimize_n_c(V, T).unwrap();
    let dense = (0..=10_000)
        .map(|i| 2.0 + 1e-3 * f64::from(i))
        .map(|n| (exponential(n).peaks().jerk_mm_s3, n))
        .fold((f64::INFINITY, 0.0), |best, next| if next.0 < best.0 { next } else { best });
    assert!((found.point[0] - dense.1).abs() < 1.1e-3, "{found:?} {dense:?}");
    assert!(found.objective <= dense.0);
    let history = &found.history;
    assert!(history.windows(2).all(|pair| pair[1].objective <= pair[0].objective), "{history:?}");
    assert!(history.windows(2).all(|pair| pair[1].mesh == 2.0 * pair[0].mesh || pair[1].mesh == 0.5 * pair[0].mesh));
    assert_eq!(history[0].point, [5.0]);
}

#[test]
fn validates_pattern_search_on_a_rotated_valley_and_at_a_bound() {
    let search = PatternSearch { max_iterations: 100_000, mesh_tolerance: 1e-9, ..PatternSearch::default() };
    let f = |p: &[f64]| (p[0] - 3.0).powi(2) + 10.0 * (p[1] + p[0] - 1.0).powi(2);
    let found = search.minimize(&[-4.0, 7.0], f);
    assert!(found.converged && (found.point[0] - 3.0).abs() < 1e-6 && (found.point[1] + 2.0).abs() < 1e-6, "{found:?}");
    let bounded = PatternSearch { lower: vec![-1.0, 0.5], upper: vec![1.0, 9.0], ..search };
    let found = bounded.minimize(&[0.0, 5.0], |p| p[0] + p[1]);
    assert_eq!(found.point, [-1.0, 0.5]);
    // A start without a value is left for any that has one, and a search that finds no end gives up.
    let hole = |p: &[f64]| if p[0] == 0.0 { f64::NAN } else { (p[0] - 5.0).abs() };
    assert!((PatternSearch::default().minimize(&[0.0], hole).point[0] - 5.0).abs() < 1e-5);
    let brief = PatternSearch { max_iterations: 7, ..PatternSearch::default() }.minimize(&[0.0], |p| -p[0]);
    assert!(!brief.converged && brief.history.len() == 8, "{brief:?}");
    assert_eq!(brief.history.iter().map(|step| step.iteration).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6, 7]);
}

#[test]
fn validates_that_the_search_for_n_c_stays_between_2_and_12() {
    // The modification is 1 mm/s² exp(n_c τ): a fast feed would take more than 12, a slow one less than 2.
    assert_eq!(optimize_n_c(1e6, T).unwrap().point, [12.0]);
    assert_eq!(optimize_n_c(0.1, T).unwrap().point, [2.0]);
}

/// Every profile, with random values that make sense.
fn random_profile(rng: &mut Xoshiro256PlusPlus, kind: usize, feed: f64) -> Profile {
    let phase_s = rng.random_range(0.01..0.5);
    match kind {
        0 => Profile::Linear { phase_s },
        1 => Profile::Cubic { phase_s },
        2 => Profile::Quintic { phase_s },
        // The modification is 1 mm/s² exp(n_c): weak enough for the feed.
        3 => Profile::Exponential { phase_s, n_c: (feed / phase_s).ln().clamp(1.0, 9.0) },
        _ => Profile::JerkLimited {
            accel_mm_s2: 10.0_f64.powf(rng.random_range(1.0..5.0)),
            jerk_mm_s3: 10.0_f64.powf(rng.random_range(2.0..7.0)),
        },
    }
}

#[test]
fn validates_motions_by_integrating_their_own_derivatives() {
    // s, V, a, j of every profile belong together: each is the integral of the next (Simpson between samples; jumps of a
    // or j at the ends of a phase are left out), and the motion starts and ends at rest on the ends.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(30);
    for case in 0..3000 {
        let feed = 10.0_f64.powf(rng.random_range(0.5..3.0));
        let length = 10.0_f64.powf(rng.random_range(-1.0..3.0));
        let profile = random_profile(&mut rng, case % 5, feed);
        let motion = Motion::plan(length, feed, profile).unwrap_or_else(|e| panic!("case {case}: {e} {profile:?}"));
        let at = |t: f64| motion.at(t);
        let what = format!("case {case}: length {length}, feed {feed}, {profile:?}");
        let (start, end) = (at(0.0), at(motion.total_s()));
        assert!(start.s_mm.abs() < 1e-12 * length && start.feed_mm_s.abs() < 1e-9 * feed, "{what}");
        assert!(end.s_mm == length && end.feed_mm_s == 0.0, "{what}");
        let before = at(motion.total_s() * (1.0 - 1e-15));
        assert!((before.s_mm - length).abs() < 1e-9 * length, "{before:?} {what}");
        assert!(motion.feed_mm_s() <= feed * (1.0 + 1e-12), "{what}");

        let steps = 40;
        for (from, to) in [
            (0.0, motion.phase_s()),
            (motion.phase_s(), motion.phase_s() + motion.cruise_s()),
            (motion.phase_s() + motion.cruise_s(), motion.total_s()),
        ] {
            let h = (to - from) / f64::from(steps);
            // A phase of the jerk-limited kind is piecewise in itself: its own test covers it.
            if h <= 0.0 || matches!(profile, Profile::JerkLimited { .. }) {
                continue;
            }
            for i in 0..steps {
                // Inside the phase, a hair off its ends, where a and j may jump.
                let a = from + h * f64::from(i) + 1e-9 * h;
                let b = from + h * f64::from(i + 1) - 1e-9 * h;
                let (left, middle, right) = (at(a), at(0.5 * (a + b)), at(b));
                let simpson = |l: f64, m: f64, r: f64| (b - a) / 6.0 * (l + 4.0 * m + r);
                let ds = simpson(left.feed_mm_s, middle.feed_mm_s, right.feed_mm_s);
                assert!((right.s_mm - left.s_mm - ds).abs() < 1e-6 * feed * (to - from) + 1e-12 * length, "{what}");
                let dv = simpson(left.accel_mm_s2, middle.accel_mm_s2, right.accel_mm_s2);
                assert!((right.feed_mm_s - left.feed_mm_s - dv).abs() < 1e-5 * feed, "{dv} {what}");
                let da = simpson(left.jerk_mm_s3, middle.jerk_mm_s3, right.jerk_mm_s3);
                let size = feed / (to - from);
                assert!((right.accel_mm_s2 - left.accel_mm_s2 - da).abs() < 1e-3 * size, "{da} {what}");
            }
        }
    }
}

#[test]
fn validates_the_exponential_feed_against_the_papers_form() {
    // V from the Bernstein coefficients with end accelerations that depend on τ, as the paper writes it.
    let phase = ExponentialPhase::new(V, T, 8.12).unwrap();
    for i in 0..=1000 {
        let tau = f64::from(i) / 1000.0;
        let (a_i, a_f) = (1.0 - (8.12 * tau).exp(), 1.0 - (8.12 * (1.0 - tau)).exp());
        let c = [0.0, T * a_i / 5.0, 2.0 * T * a_i / 5.0, V - 2.0 * T * a_f / 5.0, V - T * a_f / 5.0, V];
        let choose = [1.0, 5.0, 10.0, 10.0, 5.0, 1.0];
        let v: f64 = (0..6_u8)
            .map(|k| {
                c[usize::from(k)] * choose[usize::from(k)] * tau.powi(k.into()) * (1.0 - tau).powi(5 - i32::from(k))
            })
            .sum();
        let ours = phase.at(tau * T).feed_mm_s;
        assert!((ours - v).abs() < 1e-11, "τ {tau}: {ours} {v}");
        // Antisymmetric about the middle.
        let mirrored = phase.at((1.0 - tau) * T).feed_mm_s;
        assert!((ours + mirrored - V).abs() < 1e-11);
    }
    assert!((phase.at(T).s_mm - 0.5 * V * T).abs() < 1e-13);
}

#[test]
fn validates_general_end_conditions_of_the_quintic() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(31);
    for _ in 0..2000 {
        let mut state = || FeedState {
            feed_mm_s: rng.random_range(-100.0..100.0),
            accel_mm_s2: rng.random_range(-1e3..1e3),
            jerk_mm_s3: rng.random_range(-1e4..1e4),
        };
        let (a, b) = (state(), state());
        let t = rng.random_range(0.05..1.0);
        let phase = BernsteinPhase::quintic(a, b, t).unwrap();
        for (state, sample) in [(a, phase.at(0.0)), (b, phase.at(t))] {
            assert!((sample.feed_mm_s - state.feed_mm_s).abs() < 1e-9);
            assert!((sample.accel_mm_s2 - state.accel_mm_s2).abs() < 1e-7, "{sample:?} {state:?}");
            assert!((sample.jerk_mm_s3 - state.jerk_mm_s3).abs() < 1e-5, "{sample:?} {state:?}");
        }
        assert!((phase.at(t).s_mm - phase.distance_mm()).abs() < 1e-10);
        let cubic = BernsteinPhase::cubic(a, b, t).unwrap();
        for (state, sample) in [(a, cubic.at(0.0)), (b, cubic.at(t))] {
            assert!((sample.feed_mm_s - state.feed_mm_s).abs() < 1e-9);
            assert!((sample.accel_mm_s2 - state.accel_mm_s2).abs() < 1e-7);
        }
        // A cubic feed has a linear jerk: constant second difference.
        let j = |x: f64| cubic.at(x * t).jerk_mm_s3;
        assert!((j(0.0) - 2.0 * j(0.5) + j(1.0)).abs() < 1e-6 * (j(0.0).abs() + 1.0));
    }
}

#[test]
fn validates_the_jerk_limited_profile_in_closed_form() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(32);
    for case in 0..5000 {
        let power = |rng: &mut Xoshiro256PlusPlus, low, high| 10.0_f64.powf(rng.random_range(low..high));
        let (feed, accel, jerk) = (power(&mut rng, 0.0, 3.0), power(&mut rng, 1.0, 4.0), power(&mut rng, 2.0, 6.0));
        let length = power(&mut rng, -2.0, 3.0);
        let motion = Motion::plan(length, feed, Profile::JerkLimited { accel_mm_s2: accel, jerk_mm_s3: jerk }).unwrap();
        let what = format!("case {case}: length {length} feed {feed} accel {accel} jerk {jerk}");
        let peaks = motion.peaks();
        assert!(peaks.accel_mm_s2 <= accel * (1.0 + 1e-12) && peaks.jerk_mm_s3 <= jerk * (1.0 + 1e-12), "{what}");
        assert!(peaks.feed_mm_s <= feed * (1.0 + 1e-12), "{what}");
        // Where the path is long enough, the time is the textbook's: L/V + V/a + a/j, or with √(V/j) where a is not reached.
        let v = motion.feed_mm_s();
        let phase = if v >= accel * accel / jerk { v / accel + accel / jerk } else { 2.0 * (v / jerk).sqrt() };
        assert!((motion.phase_s() - phase).abs() < 1e-12 * phase + 1e-15, "{what}");
        assert!((motion.total_s() - (length / v + phase)).abs() < 1e-9 * motion.total_s(), "{what}");
        // Where it is not, there is no cruise and both phases cover the path.
        if v < feed {
            assert!(motion.cruise_s() < 1e-9 * motion.total_s(), "{what}");
            assert!((v * phase - length).abs() < 1e-9 * length, "{what}");
        }
        // Jerk up, none, down; the deceleration undoes the acceleration.
        let rest = 0.5 * (accel / jerk).min((v / jerk).sqrt());
        assert_eq!(motion.at(rest).jerk_mm_s3, jerk, "{what}");
        assert_eq!(motion.at(motion.phase_s() - rest).jerk_mm_s3, -jerk, "{what}");
        // Simpson over the pieces of constant jerk is exact for s.
        let mut s = 0.0;
        let tj = (accel / jerk).min((v / jerk).sqrt());
        let joints = [0.0, tj, motion.phase_s() - tj, motion.phase_s()];
        for pair in joints.windows(2) {
            let f = |t: f64| motion.at(t).feed_mm_s;
            s += (pair[1] - pair[0]) / 6.0 * (f(pair[0]) + 4.0 * f(0.5 * (pair[0] + pair[1])) + f(pair[1]));
        }
        assert!((s - 0.5 * v * phase).abs() < 1e-9 * s, "{what}: {s}");
    }
}

#[test]
fn validates_that_a_short_path_lowers_feed_and_keeps_the_limits() {
    for n_c in [2.0, 8.12] {
        let profile = Profile::Exponential { phase_s: T, n_c };
        let long = Motion::plan(50.0, V, profile).unwrap().peaks();
        for length in [9.999, 5.0, 1.0, 1e-3] {
            let motion = Motion::plan(length, V, profile).unwrap();
            let peaks = motion.peaks();
            let share = length / (V * T);
            assert!((motion.feed_mm_s() - share * V).abs() < 1e-12 * V);
            // All of the shape falls with the feed.
            assert!((peaks.accel_mm_s2 - share * long.accel_mm_s2).abs() < 1e-9 * long.accel_mm_s2);
            assert!((peaks.jerk_mm_s3 - share * long.jerk_mm_s3).abs() < 1e-9 * long.jerk_mm_s3);
            assert_eq!(motion.cruise_s(), 0.0);
            assert_eq!(motion.at(motion.total_s()).s_mm, length);
        }
    }
}

#[test]
fn bad_values_are_refused_by_name() {
    let plan = |length, feed, profile| Motion::plan(length, feed, profile).unwrap_err();
    let quintic = Profile::Quintic { phase_s: 0.1 };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e10] {
        assert!(matches!(plan(10.0, bad, quintic), FeedrateError::OutOfRange(error) if error.name() == "feed_mm_s"));
        assert!(matches!(plan(bad, 10.0, quintic), FeedrateError::OutOfRange(error) if error.name() == "length_mm"));
        assert!(matches!(
            plan(10.0, 10.0, Profile::Quintic { phase_s: bad }),
            FeedrateError::OutOfRange(error) if error.name() == "phase_s"));
        assert!(matches!(
            plan(10.0, 10.0, Profile::JerkLimited { accel_mm_s2: bad, jerk_mm_s3: 1.0 }),
            FeedrateError::OutOfRange(error) if error.name() == "accel_mm_s2"));
    }
    for n_c in [0.5, 21.0, f64::NAN] {
        let error = plan(10.0, 10.0, Profile::Exponential { phase_s: 0.1, n_c });
        assert!(matches!(&error, FeedrateError::OutOfRange(error) if error.name() == "n_c"), "{error}");
    }
    // exp(8.12) mm/s² is a strong modification of a feed of 1 mm/s.
    let error = plan(10.0, 1.0, Profile::Exponential { phase_s: 0.1, n_c: 8.12 });
    assert!(matches!(error, FeedrateError::NotMonotone { .. }), "{error}");
}
