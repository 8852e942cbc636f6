//! The detailed drive model, effect by effect, beside the ideal loop on the same references.

use servosim::lane::{Kernel, narrow};
use servosim::scenario::Document;
use servosim::servo::compensation::{
    AccelerationFeedforward, BacklashCompensation, Compensation, Filter, FrictionFeedforward, LowPass, Notch,
};
use servosim::servo::effects::{
    Backlash, Coulomb, CurrentLoop, CuttingForce, Dac, Delay, Effects, Encoder, EncoderPlace, Friction, Harmonic,
    LookupTable, LuGre, Mismatch, Noise, PitchError, TorqueRipple, TwoMass, VelocityEstimate,
};
use servosim::servo::{
    Axis, AxisLoop, AxisParameters, AxisReference, DetailedAxis, LoopSettings, Pdff, step_side_by_side,
};

use crate::{fastest, seconds};

pub(crate) fn bench(quick: bool) {
    let (_, axes) = crate::alpha();
    // Gains that leave a drive with delay, a resonance and an encoder stable: the paper's are for the ideal loop.
    let soft = axes.map(|axis| AxisParameters {
        pdff: Pdff { kpp_rad_s_mm: 40.0, kpv_nm_s_rad: 0.4, kiv_1_s: 40.0, kpf_rad_mm: 0.6, kvf: 0.85 },
        ..axis
    });
    let references: Vec<[AxisReference; 2]> =
        (0..1200).map(|k| [reference(k, 0.0), reference(k, std::f64::consts::PI)]).collect();
    let settings = LoopSettings::default();
    let (passes, rounds) = if quick { (2, 1) } else { (400, 9) };

    let ideal = fastest((0..rounds).map(|_| {
        let loops = axes.map(|axis| AxisLoop::new(&axis, &settings, 0.0));
        per_step(loops, &references, passes)
    }));
    println!("drive: ideal loop          {ideal:7.1} ns/two-axis step");
    for (name, effects, compensation) in rows() {
        let time = fastest((0..rounds).map(|_| {
            let real = [0, 1].map(|i| real(&soft[i], &effects, &compensation, i as u64));
            per_step(real, &references, passes)
        }));
        // As a run has it: each axis on a core of its own, here in blocks of 1200.
        let beside = fastest((0..rounds).map(|_| {
            let real = [0, 1].map(|i| real(&soft[i], &effects, &compensation, i as u64));
            per_step_side_by_side(real, &references, passes)
        }));
        let millions = |time: f64| 1e3 / time;
        println!(
            "  {name:24} {time:7.1} ns/two-axis step on one core ({:4.1} million a second), {beside:7.1} with an axis a core ({:4.1})",
            millions(time),
            millions(beside)
        );
    }
    whole_run(rounds);
}

/// A run of alpha's detailed drives: setpoints, axes, contouring error.
fn whole_run(rounds: u32) {
    let mut document = Document::builtin("alpha-real").expect("there is one");
    document.set("feedrate.feed_mm_s=12").expect("a feed");
    let scenario = document.scenario().expect("sound");
    let mut samples = 0;
    let time = fastest((0..rounds).map(|_| {
        let run = scenario.simulation().expect("sound");
        samples = run.samples();
        let (time, largest) = seconds(|| run.map(|period| period.contour_error_um.abs()).fold(0.0, f64::max));
        std::hint::black_box(largest);
        1e9 * time / samples as f64
    }));
    println!("  alpha-real, a whole run of {samples} samples with contouring errors: {time:.1} ns a sample");
}

fn real(axis: &AxisParameters, effects: &Effects, compensation: &Compensation, seed: u64) -> DetailedAxis {
    let noise = effects.noise.map(|noise| Noise { seed, ..noise });
    let effects = Effects { noise, ..effects.clone() };
    DetailedAxis::pdff(axis, &effects, compensation, &LoopSettings::default(), 0.0).expect("sound parameters")
}

/// Nanoseconds a step of both axes.
fn per_step<X: Axis>(mut axes: [X; 2], references: &[[AxisReference; 2]], passes: usize) -> f64 {
    let (time, sum) = seconds(|| {
        let mut sum = 0.0;
        for _ in 0..passes {
            sum += narrow(Run { axes: &mut axes, references });
        }
        sum
    });
    std::hint::black_box(sum);
    1e9 * time / (passes * references.len()) as f64
}

/// The same where the axes go side by side, in blocks as a run has them.
fn per_step_side_by_side<X: Axis + Send>(mut axes: [X; 2], references: &[[AxisReference; 2]], passes: usize) -> f64 {
    let references = [0, 1].map(|axis| references.iter().map(|both| both[axis]).collect::<Vec<_>>());
    let mut told = [0, 1].map(|_| Vec::with_capacity(references[0].len()));
    let (time, sum) = seconds(|| {
        let mut sum = 0.0;
        for _ in 0..passes {
            told.iter_mut().for_each(Vec::clear);
            step_side_by_side(&mut axes, &references, &mut told, |_, signals| signals.actual_mm);
            sum += told.iter().flatten().sum::<f64>();
        }
        sum
    });
    std::hint::black_box(sum);
    1e9 * time / (passes * references[0].len()) as f64
}

struct Run<'a, X> {
    axes: &'a mut [X; 2],
    references: &'a [[AxisReference; 2]],
}

impl<X: Axis> Kernel for Run<'_, X> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = 0.0;
        let [x, y] = self.axes;
        for [first, second] in self.references {
            sum += x.step(first).actual_mm + y.step(second).actual_mm;
        }
        sum
    }
}

/// Two cycles along 16 mm in 1.2 s: four reversals, from rest (a jump of the feed would lock a loop up), 84 mm/s at most.
fn reference(k: usize, phase: f64) -> AxisReference {
    let (t, w, a) = (k as f64 * 1e-3, 2.0 * std::f64::consts::PI / 0.6, 8.0);
    let (sine, cosine) = (libm::sin(w * t + phase), libm::cos(w * t + phase));
    AxisReference {
        position_mm: a * (libm::cos(phase) - cosine),
        velocity_mm_s: a * w * sine,
        acceleration_mm_s2: a * w * w * cosine,
        jerk_mm_s3: -a * w * w * w * sine,
        torque_nm: 0.0,
        command_offset_mm: 0.0,
    }
}

/// What is measured: effects one by one, then together.
fn rows() -> Vec<(&'static str, Effects, Compensation)> {
    let curve = Coulomb { coulomb_nm: 0.1, static_nm: 0.15, stribeck_mm_s: 3.0, viscous_nm_s_rad: 0.001 };
    let harmonic = |per_revolution, amplitude_nm| Harmonic { per_revolution, amplitude_nm, phase_rad: 0.3 };
    let table = |points: &[(f64, f64)], period| LookupTable::new(points.iter().copied(), period).expect("a table");
    let off = Effects::default();
    let none = Compensation::default();
    let every = Effects {
        mismatch: Some(Mismatch { gain_factor: 1.1, time_constant_factor: 0.9 }),
        encoder: Some(Encoder {
            place: EncoderPlace::Motor,
            resolution_um: 0.1,
            velocity: VelocityEstimate::Difference,
        }),
        noise: Some(Noise { rms_um: 0.05, seed: 7 }),
        delay: Some(Delay { samples: 0.3 }),
        dac: Some(Dac { bits: 14 }),
        current_loop: Some(CurrentLoop { bandwidth_hz: 1000.0 }),
        two_mass: Some(TwoMass { table_mass_kg: 150.0, stiffness_n_um: 120.0, damping_n_s_mm: 5.0 }),
        friction: Some(Friction::Coulomb(curve)),
        backlash: Some(Backlash { gap_um: 5.0 }),
        pitch: Some(PitchError { error_um: table(&[(0.0, 0.0), (3.0, 2.0), (6.0, -1.0)], Some(10.0)) }),
        ripple: Some(TorqueRipple { harmonics: vec![harmonic(6, 0.03), harmonic(24, 0.01)] }),
        force: Some(CuttingForce::OverTime(table(&[(0.0, 0.0), (0.1, 60.0), (0.25, -40.0)], Some(0.4)))),
        ..off.clone()
    };
    let lugre = Friction::LuGre(LuGre { curve, stiffness_nm_rad: 30.0, damping_nm_s_rad: 0.2 });
    let compensation = Compensation {
        filters: vec![
            Filter::Notch(Notch { frequency_hz: 150.0, depth: 0.1, damping: 0.5 }),
            Filter::LowPass(LowPass { frequency_hz: 450.0, damping: 0.7 }),
        ],
        acceleration: Some(AccelerationFeedforward { share: 0.5 }),
        friction: Some(FrictionFeedforward { coulomb_nm: 0.1, smoothing_mm_s: 1.0 }),
        backlash: Some(BacklashCompensation { gap_um: 5.0, time_constant_s: 2e-3 }),
        ..none.clone()
    };
    let only = |change: fn(&Effects) -> Effects| change(&every);
    vec![
        ("all off", off, none.clone()),
        ("mismatch", only(|e| Effects { mismatch: e.mismatch, ..Effects::default() }), none.clone()),
        ("converter", only(|e| Effects { dac: e.dac, ..Effects::default() }), none.clone()),
        ("encoder", only(|e| Effects { encoder: e.encoder, ..Effects::default() }), none.clone()),
        ("noise", only(|e| Effects { noise: e.noise, ..Effects::default() }), none.clone()),
        ("delay", only(|e| Effects { delay: e.delay, ..Effects::default() }), none.clone()),
        ("current loop", only(|e| Effects { current_loop: e.current_loop, ..Effects::default() }), none.clone()),
        ("two masses", only(|e| Effects { two_mass: e.two_mass, ..Effects::default() }), none.clone()),
        ("friction", only(|e| Effects { friction: e.friction, ..Effects::default() }), none.clone()),
        ("LuGre", Effects { friction: Some(lugre), ..Effects::default() }, none.clone()),
        ("gap", only(|e| Effects { two_mass: e.two_mass, backlash: e.backlash, ..Effects::default() }), none.clone()),
        ("ripple", only(|e| Effects { ripple: e.ripple.clone(), ..Effects::default() }), none.clone()),
        ("force", only(|e| Effects { force: e.force.clone(), ..Effects::default() }), none.clone()),
        ("pitch", only(|e| Effects { pitch: e.pitch.clone(), ..Effects::default() }), none.clone()),
        ("every effect", every.clone(), none.clone()),
        ("every effect, LuGre", Effects { friction: Some(lugre), ..every.clone() }, none),
        ("with compensation", every, compensation),
    ]
}
