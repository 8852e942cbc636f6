//! The whole step: motion, interpolation, both axes, exact contouring error; and with the drives of alpha-real.

use servosim::feedrate::{Motion, Profile};
use servosim::interpolator::Interpolator;
use servosim::path::Path;
use servosim::scenario::Scenario;
use servosim::servo::LoopSettings;
use servosim::simulation::Simulation;

use crate::{fastest, seconds};

pub(crate) fn bench(quick: bool) {
    let (path, axes) = crate::alpha();
    let motion = Motion::plan(path.length_mm(), 100.0, Profile::Exponential { phase_s: 0.1, n_c: 8.12 })
        .expect("a motion along alpha");
    let passes = if quick { 5 } else { 300 };
    let rounds = if quick { 1 } else { 25 };
    let drives = Scenario::builtin("alpha-real").expect("alpha-real").drives;
    let whole = |real: bool| {
        let (time, count) = seconds(|| {
            let mut count = 0;
            for _ in 0..passes {
                let settings = LoopSettings::default();
                let simulation = if real {
                    Simulation::with_drives(&path, &motion, axes, &drives, None, settings)
                } else {
                    Simulation::new(&path, &motion, axes, settings)
                };
                for period in simulation.expect("a run") {
                    std::hint::black_box(period.contour_error_um);
                    count += 1;
                }
            }
            count
        });
        1e9 * time / f64::from(count)
    };
    let interpolation = || {
        let (time, count) = seconds(|| {
            let mut count = 0;
            for _ in 0..passes {
                for setpoint in Interpolator::new(&path, &motion, 1e-3) {
                    std::hint::black_box(setpoint.position_mm);
                    count += 1;
                }
            }
            count
        });
        1e9 * time / f64::from(count)
    };
    let [step, real] = [false, true].map(|real| fastest((0..rounds).map(|_| whole(real))));
    let alone = fastest((0..rounds).map(|_| interpolation()));
    println!("whole step                 {step:7.1} ns       (promised: at most 150 ns)");
    println!("  of this interpolation    {alone:7.1} ns");
    println!("whole step, real drives    {real:7.1} ns");
}
