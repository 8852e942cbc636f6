//! The two-axis loop against plain C.

use servosim::feedrate::{Motion, Profile};
use servosim::interpolator::Interpolator;
use servosim::lane::{Kernel, vectorized};
use servosim::path::Path;
use servosim::servo::{AxisLoop, AxisParameters, LoopSettings};

use crate::{c, fastest, seconds};

pub(crate) fn bench(quick: bool) {
    let (path, axes) = crate::alpha();
    let motion = Motion::plan(path.length_mm(), 100.0, Profile::Exponential { phase_s: 0.1, n_c: 8.12 })
        .expect("a motion along alpha");
    let setpoints: Vec<[f64; 2]> = Interpolator::new(&path, &motion, 1e-3).map(|s| s.position_mm.into()).collect();
    let passes = if quick { 20 } else { 5_000 };
    let rounds = if quick { 1 } else { 25 };
    let settings = LoopSettings::default();
    let steps = (passes * setpoints.len()) as f64;

    let mut out = vec![[0.0; 4]; setpoints.len()];
    let mut single = || {
        let (time, ()) = seconds(|| {
            for _ in 0..passes {
                vectorized(Single { axes: &axes, settings: &settings, setpoints: &setpoints, out: &mut out });
                std::hint::black_box(&mut out);
            }
        });
        let sum: f64 = out.iter().map(|o| o[0].abs() + o[2].abs()).sum();
        (1e9 * time / steps, sum)
    };

    let program = c::compile("servo_loop", &[]);
    let input: Vec<u8> = setpoints.iter().flatten().flat_map(|v| v.to_ne_bytes()).collect();
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        let (time, sum) = single();
        ours.push(time);
        if let Some(program) = &program {
            let (time, c_sum) = c::run(program, passes, &input);
            assert!((sum - c_sum).abs() < 1e-6, "both loops must go the same way: {sum} {c_sum}");
            theirs.push(time);
        }
    }
    let ours = fastest(ours);
    println!("two-axis loop              {ours:7.2} ns/step  ({:.0} million steps/s)", 1e3 / ours);
    if theirs.is_empty() {
        println!("  plain C                  not measured: no C compiler found");
    } else {
        let theirs = fastest(theirs);
        println!("  plain C                  {theirs:7.2} ns/step  (C takes {:.2} times as long)", theirs / ours);
    }
}

/// Both axes along all setpoints, every position and voltage kept.
struct Single<'a> {
    axes: &'a [AxisParameters; 2],
    settings: &'a LoopSettings,
    setpoints: &'a [[f64; 2]],
    out: &'a mut [[f64; 4]],
}

impl Kernel for Single<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let [mut x, mut y] = self.axes.map(|axis| AxisLoop::new(&axis, self.settings, 0.0));
        for (command, out) in self.setpoints.iter().zip(self.out) {
            let (x, y) = (x.step(command[0], 0.0), y.step(command[1], 0.0));
            *out = [x.actual_mm, x.voltage_v, y.actual_mm, y.voltage_v];
        }
    }
}
