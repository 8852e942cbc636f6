//! A table that slides freely: no loop takes away what the integration misses, so that the longest step is seen as it is.

use servosim::servo::compensation::Compensation;
use servosim::servo::controller::{ControlOutput, Controller, Feedback};
use servosim::servo::effects::{
    Backlash, Coulomb, CuttingForce, Effects, Friction, Harmonic, LookupTable, LuGre, TorqueRipple, TwoMass,
};
use servosim::servo::{Axis, AxisParameters, AxisReference, DetailedAxis, Drive, LoopSettings, Pdff, Plant};

/// No controller at all.
struct Off;

impl Controller for Off {
    fn control(&mut self, _: &AxisReference, _: &Feedback) -> ControlOutput {
        ControlOutput { velocity_command_rad_s: 0.0, torque_nm: 0.0 }
    }

    fn anti_windup(&mut self, _: f64) {}
}

/// Places of the table every millisecond \[mm\].
fn slide(effects: &Effects, steps_per_ms: u32) -> Vec<f64> {
    let axis = AxisParameters {
        plant: Plant { gain_rad_s_v: 83.0089, time_constant_s: 0.19936 },
        drive: Drive::default(),
        pdff: Pdff { kpp_rad_s_mm: 97.38, kpv_nm_s_rad: 1.19, kiv_1_s: 252.8, kpf_rad_mm: 0.8, kvf: 0.85 },
    };
    let settings = LoopSettings { period_s: 1e-3 / f64::from(steps_per_ms), ..LoopSettings::default() };
    let mut axis =
        DetailedAxis::new(&axis, Off, effects, &Compensation::default(), &settings, 0.0).expect("sound effects");
    let mut place = |k: u32| (k, axis.step(&AxisReference::default()).actual_mm);
    (0..500 * steps_per_ms).map(&mut place).filter(|(k, _)| k % steps_per_ms == 0).map(|(_, place)| place).collect()
}

/// Pushed by 400 N, pulled as much, let go: periods of 1 ms beside fifty in each of them.
#[test]
fn validates_free_slides() {
    let table = |points: &[(f64, f64)]| LookupTable::new(points.iter().copied(), None).expect("a table");
    let over_time = Some(CuttingForce::OverTime(table(&[(0.0, 0.0), (0.1, 400.0), (0.3, -400.0), (0.4, 0.0)])));
    let over_place = [(-50.0, 400.0), (0.0, 300.0), (1.0, 100.0), (5.0, -300.0), (50.0, -400.0)];
    let curve = |static_nm| Coulomb { coulomb_nm: 0.2, static_nm, stribeck_mm_s: 3.0, viscous_nm_s_rad: 0.001 };
    let coulomb = |static_nm| Some(Friction::Coulomb(curve(static_nm)));
    let bristles = |stiffness_nm_rad, damping_nm_s_rad| {
        Some(Friction::LuGre(LuGre { curve: curve(0.3), stiffness_nm_rad, damping_nm_s_rad }))
    };
    let two_mass = Some(TwoMass { table_mass_kg: 150.0, stiffness_n_um: 120.0, damping_n_s_mm: 5.0 });
    let backlash = Some(Backlash { gap_um: 5.0 });
    let ripple = |per_revolution| {
        Some(TorqueRipple { harmonics: vec![Harmonic { per_revolution, amplitude_nm: 0.1, phase_rad: 0.3 }] })
    };
    let push = || Effects { force: over_time.clone(), ..Effects::default() };
    let rows = [
        ("two masses", Effects { two_mass, ..push() }, 0.01),
        ("Coulomb", Effects { friction: coulomb(0.2), ..push() }, 1.0),
        ("Stribeck", Effects { friction: coulomb(0.3), ..push() }, 1.0),
        ("two masses, gap", Effects { two_mass, backlash, ..push() }, 1.0),
        (
            "force over place",
            Effects { force: Some(CuttingForce::OverPosition(table(&over_place))), ..Effects::default() },
            5.0,
        ),
        ("ripple", Effects { ripple: ripple(24), ..push() }, 2.0),
        // What the tolerance lets through adds up: 1e-5 mm/s for 0.5 s are 5 nm, many times.
        ("two masses, Stribeck", Effects { two_mass, friction: coulomb(0.3), ..push() }, 40.0),
        ("LuGre", Effects { friction: bristles(30.0, 0.2), ..push() }, 40.0),
        ("stiff LuGre", Effects { friction: bristles(1000.0, 1.0), ..push() }, 150.0),
    ];
    for (name, effects, allowed_nm) in rows {
        let (long, short) = (slide(&effects, 1), slide(&effects, 50));
        let far_mm = short.iter().fold(0.0, |far: f64, place| far.max(place.abs()));
        let apart_nm = 1e6 * long.iter().zip(&short).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{name:24} {apart_nm:8.3} nm of {far_mm:.2} mm");
        assert!(far_mm > 1.0, "{name} slides");
        assert!(apart_nm < allowed_nm, "{name}: {apart_nm} nm");
    }
}
