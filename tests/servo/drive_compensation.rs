//! The detailed drive model: what is done about its effects, where the effect is known exactly, and the effects that need no solver.

use crate::common::drive::{self, Bench, DT, axis, helped, open, table};
use servosim::servo::compensation::{AccelerationFeedforward, BacklashCompensation, Compensation, FrictionFeedforward};
use servosim::servo::controller::{Cascade, CascadeGains, PPiGains};
use servosim::servo::effects::{Backlash, Coulomb, CuttingForce, Effects, Friction, Integration, Mismatch, PitchError};
use servosim::servo::{Axis, AxisLoop, AxisParameters, AxisReference, Derivative, DetailedAxis, LoopSettings, Plant};

fn real(effects: &Effects, compensation: &Compensation) -> Bench {
    helped(effects, compensation, 0.0)
}

#[test]
fn validates_mismatch_as_another_plant() {
    let mismatch = Mismatch { gain_factor: 1.3, time_constant_factor: 0.7 };
    let mut real = real(&Effects { mismatch: Some(mismatch), ..Effects::default() }, &Compensation::default());
    let plant = Plant { gain_rad_s_v: 1.3 * 83.0089, time_constant_s: 0.7 * 0.19936 };
    let settings = LoopSettings::default();
    let mut other = AxisLoop::new(&AxisParameters { plant, ..axis() }, &settings, 0.0);
    for k in 0..1000 {
        let reference = AxisReference::at_rest(5.0 * (1.0 - libm::cos(4.0 * f64::from(k) * DT)));
        let (a, b) = (real.step(&reference), Axis::step(&mut other, &reference));
        assert!((a.actual_mm - b.actual_mm).abs() < 1e-11, "{k}: {} {}", a.actual_mm, b.actual_mm);
    }
}

#[test]
fn validates_table_that_repeats() {
    let table = table(&[(0.0, 1.0), (2.0, 3.0), (3.0, -1.0)], Some(4.0));
    for (x, value) in [(0.0, 1.0), (1.0, 2.0), (2.5, 1.0), (3.0, -1.0), (3.5, 0.0)] {
        for periods in [-1000.0, -1.0, 0.0, 1.0, 77.0] {
            let is = table.value(x + 4.0 * periods);
            assert!((is - value).abs() < 1e-12, "{x} {periods}: {is} {value}");
        }
    }
    // Under a run it is looked for from place to place: a force over time of 0.1 s, forth and back over its seam.
    let force = drive::table(&[(0.0, 0.0), (0.03, 40.0), (0.07, -40.0)], Some(0.1));
    let mut axis = real(
        &Effects { force: Some(CuttingForce::OverTime(force.clone())), ..Effects::default() },
        &Compensation::default(),
    );
    for k in 0..500 {
        axis.step(&AxisReference::at_rest(0.0));
        let foreseen = 1.59e-3 * force.value(f64::from(k) * DT);
        assert!((axis.drive_signals().force_nm - foreseen).abs() < 1e-12, "{k}");
    }
}

#[test]
fn validates_force_over_position_as_a_spring() {
    // 100 N/mm against a steady torque T: J θ'' + B θ' + κ θ = T in closed form.
    let force = CuttingForce::OverPosition(table(&[(-10.0, 1000.0), (10.0, -1000.0)], None));
    let (plant, drive) = (axis().plant, axis().drive);
    let (inertia, viscous) = (plant.inertia_kg_m2(&drive), plant.viscous_nm_s_rad(&drive));
    let stiffness = 1e5 * 1.59e-3 * 1.59e-3;
    let decay = 0.5 * viscous / inertia;
    let omega = (stiffness / inertia - decay * decay).sqrt();
    // A straight line over each step is all that is not exact: over 3 mm of travel without feedback, less with the square of the step.
    for (substeps, tolerance_mm) in [(1, 3e-5), (8, 5e-7)] {
        let integration = Integration { substeps, ..Integration::default() };
        let effects = Effects { force: Some(force.clone()), integration, ..Effects::default() };
        let mut spring = open(&effects, |_| 0.3);
        let mut worst = 0.0_f64;
        for k in 0..1000 {
            let t = f64::from(k) * DT;
            let swing = libm::exp(-decay * t) * (libm::cos(omega * t) + decay / omega * libm::sin(omega * t));
            let foreseen = 1.59 * 0.3 / stiffness * (1.0 - swing);
            worst = worst.max((spring.step(&AxisReference::default()).actual_mm - foreseen).abs());
        }
        println!("force over position, {substeps} a period: {:.4} nm apart", 1e6 * worst);
        assert!(worst < tolerance_mm, "{worst}");
    }
}

#[test]
fn validates_friction_feedforward() {
    // Friction that is the same at every speed, and known: in one direction there is none.
    let curve = Coulomb { coulomb_nm: 0.1, static_nm: 0.1, stribeck_mm_s: 1.0, viscous_nm_s_rad: 0.0 };
    let effects = Effects { friction: Some(Friction::Coulomb(curve)), ..Effects::default() };
    let known = |coulomb_nm| Compensation {
        friction: Some(FrictionFeedforward { coulomb_nm, smoothing_mm_s: 0.01 }),
        ..Compensation::default()
    };
    let mut rid = real(&effects, &known(0.1));
    let mut half = real(&effects, &known(0.05));
    let mut without = real(&Effects::default(), &Compensation::default());
    let mut worst = [0.0_f64; 2];
    for k in 0..500 {
        let t = f64::from(k) * DT;
        let reference = AxisReference::at_rest(20.0 * t * t + t);
        let free = without.step(&reference).actual_mm;
        worst[0] = worst[0].max((rid.step(&reference).actual_mm - free).abs());
        worst[1] = worst[1].max((half.step(&reference).actual_mm - free).abs());
    }
    assert!(worst[0] < 1e-9 && worst[1] > 1e-5, "{worst:?}");
}

/// Where a run comes to rest on `stops`, one after the other \[mm\].
fn rests(axis: &mut Bench, stops: &[f64]) -> Vec<f64> {
    let mut at = 0.0_f64;
    let mut rests = Vec::new();
    for &stop in stops {
        for _ in 0..3000 {
            // Slowly at the end: an axis that overshoots would rest on the other side of its gap.
            at += (0.01 * (stop - at)).max(-0.01).min(0.01);
            axis.step(&AxisReference::at_rest(at));
        }
        rests.push(axis.step(&AxisReference::at_rest(at)).actual_mm);
    }
    rests
}

#[test]
fn validates_compensation_of_backlash_and_pitch() {
    let stops = [4.0, 2.0, 2.5, -1.0, 0.5];
    // Play in a rigid axis: half of it is lost on either side, and given back.
    let backlash = Effects { backlash: Some(Backlash { gap_um: 8.0 }), ..Effects::default() };
    let compensation = |gap_um| Compensation {
        backlash: Some(BacklashCompensation { gap_um, time_constant_s: 2e-3 }),
        ..Compensation::default()
    };
    let error = |rests: Vec<f64>| -> Vec<f64> { rests.iter().zip(stops).map(|(is, stop)| is - stop).collect() };
    let lost = error(rests(&mut real(&backlash, &Compensation::default()), &stops));
    let given = error(rests(&mut real(&backlash, &compensation(8.0)), &stops));
    let partly = error(rests(&mut real(&backlash, &compensation(6.0)), &stops));
    for (i, towards) in [1.0, -1.0, 1.0, -1.0, 1.0].into_iter().enumerate() {
        assert!((lost[i] + 4e-3 * towards).abs() < 2e-4, "{lost:?}");
        assert!(given[i].abs() < 1e-9, "{given:?}");
        assert!((partly[i] - lost[i] - 3e-3 * towards).abs() < 2e-4, "{partly:?}");
    }

    // Pitch error: known where the axis rests, it is gone (on the level parts of the table: elsewhere its slope times itself is left).
    let pitch = PitchError {
        error_um: table(&[(-1.5, 3.0), (-0.5, 3.0), (0.0, 0.0), (0.2, 0.0), (1.0, 5.0), (5.0, 5.0)], None),
    };
    let effects = Effects { pitch: Some(pitch.clone()), ..Effects::default() };
    let stops = [4.0, 2.0, -1.0, 0.1];
    let off = rests(&mut real(&effects, &Compensation::default()), &stops);
    let gone = rests(&mut real(&effects, &Compensation { pitch: Some(pitch), ..Compensation::default() }), &stops);
    for (i, error) in [5e-3, 5e-3, 3e-3, 0.0].into_iter().enumerate() {
        assert!((off[i] - stops[i] - error).abs() < 1e-9, "{off:?}");
        assert!((gone[i] - stops[i]).abs() < 1e-9, "{gone:?}");
    }
}

/// The axis is homed where it starts, whatever its table says there: neither effect nor compensation moves it at rest.
#[test]
fn validates_pitch_from_where_the_axis_starts() {
    // Sloping at the start, level where it rests.
    let pitch = PitchError { error_um: table(&[(-60.0, 0.0), (0.0, 0.0), (20.0, 5.0), (60.0, 5.0)], None) };
    let effects = Effects { pitch: Some(pitch.clone()), ..Effects::default() };
    let compensation = Compensation { pitch: Some(pitch.clone()), ..Compensation::default() };
    let start_mm = 8.0;
    let at_start_mm = 1e-3 * pitch.error_um.value(start_mm);
    assert!((at_start_mm - 2e-3).abs() < 1e-12);
    for (effects, compensation, foreseen) in [
        (&effects, &Compensation::default(), 1.0),
        (&effects, &compensation, 0.0),
        // A compensation without its effect, the other way.
        (&Effects::default(), &compensation, -1.0),
    ] {
        let mut axis = helped(effects, compensation, start_mm);
        for _ in 0..200 {
            let still = axis.step(&AxisReference::at_rest(start_mm));
            assert!((still.actual_mm - start_mm).abs() < 1e-12 && still.voltage_v.abs() < 1e-12, "{still:?}");
        }
        // To where the error is 5 µm and to where it is none: off by what that is more than at the start.
        let mut at = start_mm;
        for (stop, error_mm) in [(25.0, 5e-3), (-3.0, 0.0)] {
            for _ in 0..4000 {
                at += (stop - at).max(-0.02).min(0.02);
                axis.step(&AxisReference::at_rest(at));
            }
            let off = axis.step(&AxisReference::at_rest(at)).actual_mm - stop;
            assert!((off - foreseen * (error_mm - at_start_mm)).abs() < 1e-9, "{stop}: {off}");
        }
    }
}

#[test]
fn validates_acceleration_feedforward() {
    let loops = PPiGains { position_rad_s_mm: 60.0, velocity_nm_s_rad: 0.8, integral_1_s: 60.0 };
    let settings = LoopSettings { derivative: Derivative::Exact, ..LoopSettings::default() };
    let run = |axis: &AxisParameters,
               gains: &CascadeGains,
               share: f64,
               reference: &dyn Fn(f64) -> AxisReference|
     -> Vec<f64> {
        let compensation =
            Compensation { acceleration: Some(AccelerationFeedforward { share }), ..Compensation::default() };
        let cascade = Cascade::new(gains, DT).expect("gains");
        let mut real = DetailedAxis::new(axis, cascade, &Effects::default(), &compensation, &settings, 0.0)
            .expect("sound parameters");
        (0..400).map(|k| real.step(&reference(f64::from(k) * DT)).actual_mm).collect()
    };
    let only_velocity = |axis: &AxisParameters| CascadeGains {
        viscous_nm_s_mm: 0.0,
        acceleration_nm_s2_mm: 0.0,
        ..CascadeGains::with_feedforward(loops, axis)
    };
    // A body without friction under a steady acceleration: the torque is the same for good, and nothing is left to correct.
    let bare = AxisParameters { plant: Plant { gain_rad_s_v: 83.0089e6, time_constant_s: 0.19936e6 }, ..axis() };
    let steady = |t: f64| AxisReference {
        position_mm: 250.0 * t * t,
        velocity_mm_s: 500.0 * t,
        acceleration_mm_s2: 500.0,
        ..AxisReference::default()
    };
    let apart = |run: &[f64]| {
        run.iter().enumerate().map(|(k, x)| (x - 250.0 * (k as f64 * DT).powi(2)).abs()).fold(0.0, f64::max)
    };
    let (all, none) =
        (run(&bare, &only_velocity(&bare), 1.0, &steady), run(&bare, &only_velocity(&bare), 0.0, &steady));
    assert!(apart(&all) < 1e-8 && apart(&none) > 1e-3, "{} {}", apart(&all), apart(&none));
    // And on any path it is what the cascade's own feedforward is.
    let swing = |t: f64| AxisReference {
        position_mm: 5.0 * (1.0 - libm::cos(9.0 * t)),
        velocity_mm_s: 45.0 * libm::sin(9.0 * t),
        acceleration_mm_s2: 405.0 * libm::cos(9.0 * t),
        ..AxisReference::default()
    };
    let own = run(&axis(), &CascadeGains::with_feedforward(loops, &axis()), 0.0, &swing);
    let compensation = run(&axis(), &only_velocity(&axis()), 1.0, &swing);
    assert!(own.iter().zip(&compensation).all(|(a, b)| (a - b).abs() < 1e-11));
}
