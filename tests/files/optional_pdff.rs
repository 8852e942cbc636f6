//! An axis whose controller is given in full needs no `pdff`.

use servosim::scenario::{Document, Scenario, ScenarioError};
use servosim::servo::{ControllerGains, ControllerKind};

/// Alpha with this controller on Y, without the table `pdff` of that axis.
fn without_pdff(controller: &str) -> Result<Scenario, ScenarioError> {
    let alpha = Document::builtin("alpha").unwrap();
    let (before, rest) = alpha.text().split_once("[axes.y.pdff]").unwrap();
    let rest = rest.split_once("\n[").map_or(String::new(), |(_, rest)| format!("[{rest}"));
    Scenario::from_toml(&format!("{before}{controller}\n{rest}"), "alpha.toml")
}

fn with_pdff(kvf: &str, controller: &str) -> Scenario {
    let mut document = Document::builtin("alpha").unwrap();
    for setting in [kvf, "axes.y.pdff.kpf=0"] {
        document.set(setting).unwrap();
    }
    Scenario::from_toml(&format!("{}\n{controller}", document.text()), "alpha.toml").unwrap()
}

const P_PI: &str = "[axes.y.controller.p_pi]\nposition_rad_s_mm = 97\nvelocity_nm_s_rad = 1.19\nintegral_1_s = 250\n";
const CASCADE: &str =
    "[axes.y.controller.cascade]\nposition_rad_s_mm = 97\nvelocity_nm_s_rad = 1.19\nintegral_1_s = 250\n";
const PID: &str = "[axes.y.controller.pid]\nproportional_v_mm = 400\nintegral_v_mm_s = 40000\nderivative_v_s_mm = 1\n";

#[test]
fn validates_a_complete_controller_alone_against_the_same_beside_pdff() {
    for (controller, kind) in
        [(P_PI, ControllerKind::PPi), (CASCADE, ControllerKind::Cascade), (PID, ControllerKind::Pid)]
    {
        let alone = without_pdff(controller).unwrap();
        let beside = with_pdff("axes.y.pdff.kvf=1", controller);
        assert_eq!(alone.drives[1].controller.kind(), kind);
        assert_eq!(alone.drives, beside.drives);
        // Whatever `pdff` says, the controller that runs is the other one: the same run to the bit.
        let (a, b) = (alone.run(&mut []).unwrap(), beside.run(&mut []).unwrap());
        assert_eq!(a.max_contour_error_um, b.max_contour_error_um, "{controller}");
        assert!(a.max_contour_error_um > 1.0 && a.max_contour_error_um.is_finite());
    }
    // The ideal drive model of the axis has the loops of its controller.
    let pdff = without_pdff(P_PI).unwrap().axes[1].pdff;
    assert_eq!(
        [pdff.kpp_rad_s_mm, pdff.kpv_nm_s_rad, pdff.kiv_1_s, pdff.kpf_rad_mm, pdff.kvf],
        [97.0, 1.19, 250.0, 0.0, 1.0]
    );
}

#[test]
fn validates_the_loops_of_other_controllers_both_ways() {
    let scenario = Scenario::builtin("alpha").unwrap();
    for scale in [0.1, 0.5, 1.0, 2.0] {
        let mut axis = scenario.axes[0];
        axis.pdff.kiv_1_s *= scale;
        axis.pdff.kpp_rad_s_mm *= 2.0;
        for kind in [ControllerKind::PPi, ControllerKind::Pid, ControllerKind::Cascade] {
            let back = ControllerGains::like(kind, &axis, &scenario.settings).like_pdff(&axis);
            let pairs = [
                (back.kpp_rad_s_mm, axis.pdff.kpp_rad_s_mm),
                (back.kpv_nm_s_rad, axis.pdff.kpv_nm_s_rad),
                (back.kiv_1_s, axis.pdff.kiv_1_s),
            ];
            // The larger solution of the PID equations is kp where kp > ki/r_g.
            let unique = axis.pdff.kpp_rad_s_mm > axis.pdff.kiv_1_s / axis.drive.transmission_mm_rad;
            for (back, own) in pairs.into_iter().filter(|_| unique || kind != ControllerKind::Pid) {
                assert!((back - own).abs() <= 1e-12 * own, "{kind:?} {scale}: {back} {own}");
            }
        }
    }
}

#[test]
fn what_is_missing_is_told() {
    let told = |controller: &str| without_pdff(controller).unwrap_err().to_string();
    let error = told("");
    assert!(error.contains("`pdff` is missing in [axes.y]") && error.contains("[axes.y.pdff]"), "{error}");
    let error = told("[axes.y.controller.p_pi]\nposition_rad_s_mm = 97\n");
    assert!(error.contains("`velocity_nm_s_rad`, `integral_1_s` of the controller are not given"), "{error}");
    assert!(error.contains("[axes.y.controller.p_pi]") && error.contains('^'), "{error}");
    // A wrong value is told as such, once.
    let error = told(&P_PI.replace("= 97", "= -97"));
    assert_eq!(error.matches("error:").count(), 1, "{error}");
    assert!(error.contains("position_rad_s_mm = -97 is out of range"), "{error}");
}
