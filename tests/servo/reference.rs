//! The paper's two runs against an independent implementation, sample by sample, and the published table.

use crate::common::{Case, PROFILE, numbers, points};
use nalgebra::Vector2;
use servosim::feedrate::Profile;
use servosim::limits::Limits;
use servosim::path::{Cursor, Path};
use servosim::simulation::Period;
use servosim::summary::{Summary, SummaryObserver};

/// The reference is printed with 13 significant digits: below 1e-10 mm for coordinates under 100 mm. The issue asks 1e-9.
const POSITION_MM: f64 = 1e-9;

#[test]
fn validates_paths_against_the_reference() {
    for case in Case::both() {
        let path = &case.reference["path"];
        for (ours, theirs) in case.path.nodal_points_mm().iter().zip(points(&path["nodal_points"])) {
            assert!((ours - theirs).norm() < POSITION_MM, "{}: {ours} {theirs}", case.name);
        }
        let z: Vec<_> = case.path.preimage().map(Vector2::from).collect();
        let reference_z = points(&path["z"]);
        assert_eq!(z.len(), reference_z.len());
        // The solution is determined up to one common sign.
        let sign = z[0].dot(&reference_z[0]).signum();
        for (ours, theirs) in z.iter().zip(&reference_z) {
            assert!((ours * sign - theirs).norm() < 1e-9, "{}: {ours} {theirs}", case.name);
        }
        for (ours, theirs) in case.path.lengths_at_nodes_mm().iter().zip(numbers(&path["length_at_nodes"])) {
            assert!((ours - theirs).abs() < POSITION_MM, "{}: {ours} {theirs}", case.name);
        }
        let samples = &path["samples"];
        let (s, point, curvature) = (numbers(&samples["s"]), points(&samples["point"]), numbers(&samples["curvature"]));
        assert_eq!(s.len(), 41);
        let mut cursor = Cursor::default();
        for ((s, point), curvature) in s.iter().zip(point).zip(curvature) {
            let frame = case.path.frame(*s, &mut cursor);
            assert!((frame.point_mm - point).norm() < POSITION_MM, "{} at {s}: {frame:?} {point}", case.name);
            let signed = frame.tangent.perp(&frame.curvature_1_mm);
            assert!((signed - curvature).abs() < 1e-10, "{} at {s}: {signed} {curvature}", case.name);
        }
    }
}

#[test]
fn validates_every_closed_loop_sample_against_the_reference() {
    for case in Case::both() {
        let closed_loop = &case.reference["closed_loop"];
        let ks: Vec<u64> = closed_loop["k"].as_array().unwrap().iter().map(|k| k.as_u64().unwrap()).collect();
        let (command, actual) = (points(&closed_loop["command"]), points(&closed_loop["actual"]));
        let voltage = [numbers(&closed_loop["volt_x"]), numbers(&closed_loop["volt_y"])];
        let contour = numbers(&closed_loop["contour_abs"]);
        let mut compared = 0;
        for period in case.simulation(PROFILE) {
            let Some(i) = ks.iter().position(|&k| k == period.k) else { continue };
            compared += 1;
            let at = format!("{} at k = {}", case.name, period.k);
            assert!((period.setpoint.position_mm - command[i]).norm() < 1e-9, "{at}: command");
            assert!((period.actual_mm - actual[i]).norm() < 1e-9, "{at}: actual {} {}", period.actual_mm, actual[i]);
            assert!((period.contour_error_um.abs() * 1e-3 - contour[i]).abs() < 1e-6, "{at}: contour");
            // The issue asks 1e-6 mm; the projection is exact, and the two agree to the reference's own digits.
            assert!((period.contour_error_um.abs() * 1e-3 - contour[i]).abs() < 1e-9, "{at}: contour to 1e-9 mm");
            for (axis, voltage) in voltage.iter().enumerate() {
                assert!((period.axes[axis].voltage_v - voltage[i]).abs() < 1e-8, "{at}: voltage of axis {axis}");
            }
        }
        assert_eq!(compared, ks.len(), "{}", case.name);
    }
}

fn summary(case: &Case, profile: Profile) -> Summary {
    let mut observer = SummaryObserver::<2>::new(case.name);
    case.simulation(profile).run(&Limits::default(), None, &mut [&mut observer]).unwrap();
    observer.summary()
}

/// `value` printed with as many decimals as the table shows.
fn shown(value: f64, decimals: usize) -> String {
    format!("{value:.decimals$}")
}

#[test]
fn validates_the_table_of_the_servo_specification_to_every_digit_shown() {
    let [alpha, heart] = Case::both();
    let (a, h) = (summary(&alpha, PROFILE), summary(&heart, PROFILE));
    let rows = |s: &Summary| {
        [
            shown(s.path_length_mm, 6),
            shown(s.motion_time_s, 6),
            shown(s.max_curvature_1_mm, 6),
            shown(s.max_contour_error_um, 3),
            shown(s.rms_contour_error_um, 2),
            shown(s.max_tracking_error_um, 2),
            shown(s.peak_voltage_v, 3),
        ]
    };
    assert_eq!(rows(&a), ["99.941551", "1.099416", "0.129867", "27.027", "12.66", "176.88", "3.511"]);
    // The specification prints 156.75 for the tracking error; its reference run has 156.744770.
    assert_eq!(rows(&h), ["296.759079", "3.067591", "0.072750", "12.506", "5.35", "156.74", "4.028"]);
    let quintic = Profile::Quintic { phase_s: 0.1 };
    assert_eq!(shown(summary(&alpha, quintic).peak_voltage_v, 3), "3.679");
    assert_eq!(shown(summary(&heart, quintic).peak_voltage_v, 3), "4.214");
    for (ours, case) in [(&a, &alpha), (&h, &heart)] {
        let reference = &case.reference["summary"];
        let number = |key: &str| reference[key].as_f64().unwrap();
        assert_eq!(ours.samples as f64, number("samples"));
        assert!((ours.max_contour_error_um - number("max_contour_um")).abs() < 1e-6);
        let (rms, theirs) = (ours.rms_contour_error_um, number("rms_contour_um"));
        // Not 1e-6: on alpha the reference's own rms is 7.9e-5 µm lower. `validates_the_contouring_error_of_whole_runs`
        // (tests/servo/contour.rs) holds every sample of ours to a third route within 7e-5 µm.
        assert!((rms - theirs).abs() < 1e-4, "{rms} {theirs}");
        assert!((ours.max_tracking_error_um - number("max_tracking_um")).abs() < 1e-6);
        assert!((ours.peak_voltage_v - number("peak_volt")).abs() < 1e-9);
    }
}

#[test]
fn regression_a_closure_is_an_observer_and_sees_every_period() {
    let case = Case::alpha();
    let mut seen = Vec::new();
    let mut observer = |period: &Period<2>| seen.push(period.k);
    case.simulation(PROFILE).run(&Limits::default(), None, &mut [&mut observer]).unwrap();
    assert_eq!(seen, (0..1201).collect::<Vec<u64>>());
}
