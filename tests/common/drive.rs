//! What the tests of drives as they are share.

use servosim::servo::controller::{Controller, Measured, Wanted};
use servosim::servo::effects::{Effects, Table};
use servosim::servo::remedies::Remedies;
use servosim::servo::{AxisParameters, Demand, Drive, LoopSettings, Pdff, Plant, RealAxis};

/// The control period \[s\].
pub const DT: f64 = 1e-3;

/// Alpha's X axis.
pub fn axis() -> AxisParameters {
    AxisParameters {
        plant: Plant { gain_rad_s_v: 83.0089, time_constant_s: 0.19936 },
        drive: Drive::default(),
        pdff: Pdff { kpp_rad_s_mm: 97.38, kpv_nm_s_rad: 1.19, kiv_1_s: 252.8, kpf_rad_mm: 0.8, kvf: 0.85 },
    }
}

/// The axis at rest on 0 mm, nothing done about its effects.
pub fn real(effects: &Effects) -> RealAxis {
    helped(effects, &Remedies::default(), 0.0)
}

/// The axis at rest on a place.
pub fn helped(effects: &Effects, remedies: &Remedies, start_mm: f64) -> RealAxis {
    RealAxis::pdff(&axis(), effects, remedies, &LoopSettings::default(), start_mm).expect("sound parameters")
}

/// Torque \[N m\] by sample, no feedback.
pub struct Torque<F>(F, u32);

impl<F: FnMut(u32) -> f64> Controller for Torque<F> {
    fn control(&mut self, _: &Demand, _: &Measured) -> Wanted {
        let torque_nm = (self.0)(self.1);
        self.1 += 1;
        Wanted { velocity_command_rad_s: 0.0, torque_nm }
    }

    fn settle(&mut self, _: f64) {}
}

/// The axis under torques in an open loop.
pub fn open<F: FnMut(u32) -> f64>(effects: &Effects, torque: F) -> RealAxis<Torque<F>> {
    RealAxis::new(&axis(), Torque(torque, 0), effects, &Remedies::default(), &LoopSettings::default(), 0.0)
        .expect("sound parameters")
}

/// A function by points.
pub fn table(points: &[(f64, f64)], period: Option<f64>) -> Table {
    Table::new(points.iter().copied(), period).expect("a table")
}
