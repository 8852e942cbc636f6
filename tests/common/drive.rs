//! What the tests of drives as they are share.

use std::ops::Deref;

use servosim::servo::controller::{AnyController, Controller, Measured, Wanted};
use servosim::servo::effects::{Effects, Table};
use servosim::servo::remedies::Remedies;
use servosim::servo::{Axis, AxisParameters, AxisSignals, Demand, Drive, LoopSettings, Pdff, Plant, RealAxis};

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

/// An axis whose step is compiled once a controller: as the crate has it, it vanishes into every place that takes one.
pub struct Bench<C = AnyController>(pub RealAxis<C>);

impl<C: Controller> Bench<C> {
    #[inline(never)]
    pub fn step(&mut self, demand: &Demand) -> AxisSignals {
        self.0.step(demand)
    }
}

impl<C> Deref for Bench<C> {
    type Target = RealAxis<C>;

    fn deref(&self) -> &RealAxis<C> {
        &self.0
    }
}

/// The axis at rest on 0 mm, nothing done about its effects.
pub fn real(effects: &Effects) -> Bench {
    helped(effects, &Remedies::default(), 0.0)
}

/// The axis at rest on a place.
pub fn helped(effects: &Effects, remedies: &Remedies, start_mm: f64) -> Bench {
    Bench(RealAxis::pdff(&axis(), effects, remedies, &LoopSettings::default(), start_mm).expect("sound parameters"))
}

/// Torque \[N m\] by sample, no feedback.
pub struct Torque<'a>(Box<dyn FnMut(u32) -> f64 + 'a>, u32);

impl Controller for Torque<'_> {
    fn control(&mut self, _: &Demand, _: &Measured) -> Wanted {
        let torque_nm = (self.0)(self.1);
        self.1 += 1;
        Wanted { velocity_command_rad_s: 0.0, torque_nm }
    }

    fn settle(&mut self, _: f64) {}
}

/// The axis under torques in an open loop.
pub fn open<'a>(effects: &Effects, torque: impl FnMut(u32) -> f64 + 'a) -> Bench<Torque<'a>> {
    let torque = Torque(Box::new(torque), 0);
    let axis = RealAxis::new(&axis(), torque, effects, &Remedies::default(), &LoopSettings::default(), 0.0);
    Bench(axis.expect("sound parameters"))
}

/// A function by points.
pub fn table(points: &[(f64, f64)], period: Option<f64>) -> Table {
    Table::new(points.iter().copied(), period).expect("a table")
}
