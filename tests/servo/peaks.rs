//! Peaks of the plan and of its setpoints: along the path, of the vectors and of each axis.

use servosim::scenario::Scenario;
use servosim::summary::Summary;

use crate::common::scenario::bare;

fn summary(text: &str) -> Summary {
    let scenario = Scenario::from_toml(text, "it.toml").unwrap();
    let mut metrics = scenario.summary_observer();
    scenario.simulation().unwrap().run(&scenario.limits, None, &mut [&mut metrics]).unwrap();
    metrics.summary()
}

/// alpha with limits just above the peaks of its plan, 1777.743 mm/s² and 49127.245 mm/s³.
fn tight() -> String {
    bare().replace("accel_mm_s2 = 2000", "accel_mm_s2 = 1777.8").replace("jerk_mm_s3 = 50000", "jerk_mm_s3 = 49130")
}

fn with_hold(text: &str, at_s: f64, until_s: f64) -> String {
    let steps = format!("override = [{{ at_s = {at_s}, percent = 0 }}, {{ at_s = {until_s}, percent = 100 }}]\n");
    text.replacen("feed_mm_s = 100\n", &format!("feed_mm_s = 100\n{steps}"), 1)
}

#[test]
fn regression_a_feed_hold_keeps_the_limits_that_the_plan_keeps() {
    let plain = summary(&tight());
    assert!(plain.passed(), "{:?}", plain.limits);
    for at_s in [0.05, 0.3, 1.05] {
        let held = summary(&with_hold(&tight(), at_s, 1.5));
        assert!(held.motion_time_s > 1.5 && held.passed(), "{at_s}: {:?}", held.limits);
        // The changes keep the peaks of the plan to 0.1 %.
        assert!(held.peak_accel_mm_s2 <= 1.001 * plain.peak_accel_mm_s2);
    }
    // A limit that the plan itself breaks is broken with a hold too.
    let text = tight().replace("1777.8", "1775");
    assert!(!summary(&text).passed() && !summary(&with_hold(&text, 0.3, 1.5)).passed());
}

#[test]
fn validates_peaks_before_a_hold_are_those_of_the_plan() {
    // A change to 99.9 % deep in the cruise: the acceleration ramp before it is the plan's own, found by another search.
    let plain = summary(&bare());
    let steps = "override = [{ at_s = 0.4, percent = 99.9, transition_s = 0.2 }]\n";
    let turned = summary(&bare().replacen("feed_mm_s = 100\n", &format!("feed_mm_s = 100\n{steps}"), 1));
    assert_eq!(turned.overrides.len(), 1);
    for (a, b) in [(turned.peak_accel_mm_s2, plain.peak_accel_mm_s2), (turned.peak_jerk_mm_s3, plain.peak_jerk_mm_s3)] {
        assert!((a - b).abs() <= 1e-10 * b, "{a} {b}");
    }
}

/// A square of 40 mm with sharp corners, as `count` points that a spline passes through, at 100 mm/s.
fn square(count: u32, limits: &str) -> String {
    let side = count / 4;
    let points: Vec<String> = (0..4 * side)
        .map(|i| {
            let x = 40.0 * f64::from(i % side) / f64::from(side);
            let [a, b] = [[x, 0.0], [40.0, x], [40.0 - x, 40.0], [0.0, 40.0 - x]][(i / side) as usize];
            format!("[{a}, {b}]")
        })
        .collect();
    let text = bare();
    let from = text.find("control_points_mm").unwrap();
    let to = text.find("closed = false").unwrap();
    let text = format!("{}nodal_points_mm = [{}]\n{}", &text[..from], points.join(", "), &text[to..]);
    let text = text.replace("closed = false", "closed = true");
    let from = text.find("[limits]").unwrap();
    format!("{}[limits]\n{limits}\n", &text[..from])
}

#[test]
fn regression_the_corners_of_a_square_break_a_limit_of_the_vector_and_warn_without_one() {
    let along = summary(&square(500, "accel_mm_s2 = 2236"));
    let vector = &along.vector_accel_mm_s2;
    // Along the path nothing is wrong; in the corners v²κ is an order of magnitude above.
    assert!(along.passed() && vector.peak > 5.0 * 2236.0, "{} {}", along.peak_accel_mm_s2, vector.peak);
    let near = |mm: f64| mm.abs() < 0.5 || (mm - 40.0).abs() < 0.5;
    assert!(vector.point_mm.iter().all(|mm| near(*mm)), "{:?}", vector.point_mm);
    let warnings = along.warnings();
    let factor = format!("{:.2} times limits.accel_mm_s2 = 2236", vector.peak / 2236.0);
    assert!(warnings[0].contains(&factor) && warnings[0].contains(&format!("{:.3} mm along", vector.at_mm)));
    assert_eq!(warnings.len(), 2, "the jerk too: {warnings:?}");

    let text = "vector_accel_mm_s2 = 2236\nvector_jerk_mm_s3 = 1e6\naxis_accel_mm_s2 = 2236\naxis_jerk_mm_s3 = 1e6";
    let limited = summary(&square(500, text));
    assert_eq!(limited.limits.iter().filter(|check| !check.kept).count(), 4, "{:?}", limited.limits);
    assert_eq!(limited.limits[0].value, vector.peak);
    assert!(limited.warnings().is_empty());
}

#[test]
fn validates_peaks_of_a_circle_against_their_closed_form() {
    // On a circle of radius R the acceleration is (a, v²/R) along and across, the jerk (j - v³/R², 3 v a/R). At constant feed each
    // axis reaches both lengths. The jerk is larger in the ramps of a quintic: v = V (10τ³ - 15τ⁴ + 6τ⁵), looked at closely.
    let text = bare();
    let (from, to) = (text.find("[path.ph_spline]").unwrap(), text.find("[feedrate]").unwrap());
    let text = format!("{}[path.circle]\ncentre_mm = [0, 0]\nradius_mm = 40\n{}", &text[..from], &text[to..]);
    let (from, to) = (text.find("[feedrate.profile").unwrap(), text.find("[control]").unwrap());
    let text = format!("{}[feedrate.profile.quintic]\nphase_s = 1\n{}", &text[..from], &text[to..]);
    let circle = summary(&text);
    let (accel, jerk) = (100.0 * 100.0 / 40.0, 100.0_f64.powi(3) / 1600.0);
    assert!((circle.vector_accel_mm_s2.peak / accel - 1.0).abs() < 1e-9, "{:?}", circle.vector_accel_mm_s2);
    let ramp = (0..=1_000_000).map(|i| {
        let t = f64::from(i) * 1e-6;
        let v = 100.0 * t.powi(3) * (10.0 + t * (6.0 * t - 15.0));
        let a = 3000.0 * (t * (1.0 - t)).powi(2);
        let j = 6000.0 * t * (1.0 - t) * (1.0 - 2.0 * t);
        (j - v.powi(3) / 1600.0).hypot(3.0 * v * a / 40.0)
    });
    let largest = ramp.fold(jerk, f64::max);
    // The peak is smooth: within half a sample of 1 ms it falls by 1e-6 of itself.
    assert!((circle.vector_jerk_mm_s3.peak / largest - 1.0).abs() < 5e-6, "{:?}", circle.vector_jerk_mm_s3);
    for axis in &circle.axes {
        // Samples every 2.5e-3 rad: the cosine of half of it is below 1 by 8e-7.
        assert!((axis.peak_velocity_mm_s / 100.0 - 1.0).abs() < 1e-5);
        assert!((axis.peak_accel_mm_s2 / accel - 1.0).abs() < 1e-5);
        assert!(axis.peak_jerk_mm_s3 > jerk * (1.0 - 1e-5) && axis.peak_jerk_mm_s3 <= largest);
    }
}
