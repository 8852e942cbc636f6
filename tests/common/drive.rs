//! What the tests of detailed drives share.

use std::ops::Deref;

use servosim::servo::compensation::Compensation;
use servosim::servo::controller::{AnyController, ControlOutput, Controller, Feedback};
use servosim::servo::effects::{Effects, LookupTable};
use servosim::servo::{
    Axis, AxisParameters, AxisReference, AxisSignals, DetailedAxis, Drive, LoopSettings, Pdff, Plant,
};

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
pub struct Bench<C = AnyController>(pub DetailedAxis<C>);

impl<C: Controller> Bench<C> {
    #[inline(never)]
    pub fn step(&mut self, reference: &AxisReference) -> AxisSignals {
        self.0.step(reference)
    }
}

impl<C> Deref for Bench<C> {
    type Target = DetailedAxis<C>;

    fn deref(&self) -> &DetailedAxis<C> {
        &self.0
    }
}

/// The axis at rest on 0 mm, nothing done about its effects.
pub fn real(effects: &Effects) -> Bench {
    helped(effects, &Compensation::default(), 0.0)
}

/// The axis at rest on a place.
pub fn helped(effects: &Effects, compensation: &Compensation, start_mm: f64) -> Bench {
    Bench(
        DetailedAxis::pdff(&axis(), effects, compensation, &LoopSettings::default(), start_mm)
            .expect("sound parameters"),
    )
}

/// Torque \[N m\] by sample, no feedback.
pub struct Torque<'a>(Box<dyn FnMut(u32) -> f64 + 'a>, u32);

impl Controller for Torque<'_> {
    fn control(&mut self, _: &AxisReference, _: &Feedback) -> ControlOutput {
        let torque_nm = (self.0)(self.1);
        self.1 += 1;
        ControlOutput { velocity_command_rad_s: 0.0, torque_nm }
    }

    fn anti_windup(&mut self, _: f64) {}
}

/// The axis under torques in an open loop.
pub fn open<'a>(effects: &Effects, torque: impl FnMut(u32) -> f64 + 'a) -> Bench<Torque<'a>> {
    let torque = Torque(Box::new(torque), 0);
    let axis = DetailedAxis::new(&axis(), torque, effects, &Compensation::default(), &LoopSettings::default(), 0.0);
    Bench(axis.expect("sound parameters"))
}

/// A function by points.
pub fn table(points: &[(f64, f64)], period: Option<f64>) -> LookupTable {
    LookupTable::new(points.iter().copied(), period).expect("a table")
}
