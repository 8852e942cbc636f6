//! Prints the motion of a real drive under a given torque, for `tests/drive_scipy.py` to compare with its own: motor and table \[mm\]
//! once a millisecond, under Coulomb and Stribeck friction, then under bristles.

use servosim::servo::compensation::Compensation;
use servosim::servo::controller::{ControlOutput, Controller, Feedback};
use servosim::servo::effects::{
    Coulomb, CurrentLoop, Effects, Friction, Harmonic, Integration, LuGre, TorqueRipple, TwoMass,
};
use servosim::servo::{Axis, AxisParameters, AxisReference, DetailedAxis, Drive, LoopSettings, Pdff, Plant};

/// `T = 0.5 sin(2π 3 t)`, held over each sample.
struct Swing(u32);

impl Controller for Swing {
    fn control(&mut self, _: &AxisReference, _: &Feedback) -> ControlOutput {
        let torque_nm = 0.5 * (std::f64::consts::TAU * 3.0 * f64::from(self.0) * 1e-3).sin();
        self.0 += 1;
        ControlOutput { velocity_command_rad_s: 0.0, torque_nm }
    }

    fn anti_windup(&mut self, _: f64) {}
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let axis = AxisParameters {
        plant: Plant { gain_rad_s_v: 83.0089, time_constant_s: 0.19936 },
        drive: Drive::default(),
        pdff: Pdff { kpp_rad_s_mm: 0.0, kpv_nm_s_rad: 0.0, kiv_1_s: 0.0, kpf_rad_mm: 0.0, kvf: 0.0 },
    };
    let curve = Coulomb { coulomb_nm: 0.1, static_nm: 0.15, stribeck_mm_s: 3.0, viscous_nm_s_rad: 0.001 };
    let lugre = LuGre { curve, stiffness_nm_rad: 30.0, damping_nm_s_rad: 0.2 };
    let harmonic = |per_revolution, amplitude_nm, phase_rad| Harmonic { per_revolution, amplitude_nm, phase_rad };
    for (name, friction) in [("coulomb", Friction::Coulomb(curve)), ("lugre", Friction::LuGre(lugre))] {
        let effects = Effects {
            two_mass: Some(TwoMass { table_mass_kg: 150.0, stiffness_n_um: 120.0, damping_n_s_mm: 5.0 }),
            current_loop: Some(CurrentLoop { bandwidth_hz: 1000.0 }),
            friction: Some(friction),
            ripple: Some(TorqueRipple { harmonics: vec![harmonic(6, 0.03, 0.4), harmonic(24, 0.01, 1.1)] }),
            // Nothing holds the table back to its path here: what the default may miss by would add up.
            integration: Integration { substeps: 8, tolerance_mm_s: 1e-6 },
            ..Effects::default()
        };
        let (compensation, settings) = (Compensation::default(), LoopSettings::default());
        let mut axis = DetailedAxis::new(&axis, Swing(0), &effects, &compensation, &settings, 0.0)?;
        for _ in 0..700 {
            let table_mm = axis.step(&AxisReference::default()).actual_mm;
            println!("{name} {:.15e} {table_mm:.15e}", axis.drive_signals().motor_mm);
        }
    }
    Ok(())
}
