//! Regression tests as a user would keep them for a machine of their own: copy, and change the name.

use servosim::scenario::Scenario;

fn max_contour_error_um(name: &str) -> f64 {
    let summary = Scenario::builtin(name).unwrap().run(&mut []).unwrap();
    assert!(summary.passed(), "{name}: {:?} {:?}", summary.limits, summary.lockup);
    summary.max_contour_error_um
}

#[test]
fn alpha_stays_under_30_um() {
    assert!(max_contour_error_um("alpha") < 30.0);
}

#[test]
fn heart_stays_under_30_um() {
    assert!(max_contour_error_um("heart") < 30.0);
}
