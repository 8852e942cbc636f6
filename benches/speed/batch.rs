//! Batches of runs against the same loops in hand-written C, and a million gain sets.

use servosim::feedrate::{Motion, Profile};
use servosim::interpolator::Interpolator;
use servosim::path::Path;
use servosim::servo::{AxisParameters, LoopSettings};
use servosim::simulation::ReferenceTrajectory;

use crate::{c, fastest, seconds};

pub(crate) fn bench(quick: bool) {
    let (path, axes) = crate::alpha();
    let motion = Motion::plan(path.length_mm(), 100.0, Profile::Exponential { phase_s: 0.1, n_c: 8.12 })
        .expect("a motion along alpha");
    let settings = LoopSettings { settling_s: 0.0, ..LoopSettings::default() };
    let trajectory = ReferenceTrajectory::new(&path, &motion, settings).expect("a trajectory");
    let (rounds, runs) = if quick { (1, 64) } else { (60, 512) };
    let gains = spread(&axes, runs, 0.1);
    let steps = gains.len() as f64 * trajectory.samples() as f64;
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");

    let mut setpoints: Vec<[f64; 4]> = Vec::new();
    for setpoint in Interpolator::new(&path, &motion, settings.period_s) {
        let [x, y]: [f64; 2] = setpoint.position_mm.into();
        let before = setpoints.last().map_or([x, y], |s| [s[0], s[1]]);
        setpoints.push([x, y, (x - before[0]) * 1e3, (y - before[1]) * 1e3]);
    }
    let input: Vec<u8> = setpoints.iter().flatten().flat_map(|v| v.to_ne_bytes()).collect();
    let block = |lanes: usize| {
        let program = c::compile("batch", &["-mprefer-vector-width=512", &format!("-DLANES={lanes}")])
            .or_else(|| c::compile("batch", &[&format!("-DLANES={lanes}")]))?;
        Some((program, (gains.len() / lanes).max(1)))
    };
    let programs: Vec<_> = [16, 32, 64].map(block).into_iter().flatten().collect();

    let (mut bare, mut whole, mut theirs) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..rounds {
        one_core.install(|| {
            bare.push(1e9 * seconds(|| std::hint::black_box(trajectory.run_loop(&gains).expect("runs"))).0 / steps);
            whole.push(1e9 * seconds(|| std::hint::black_box(trajectory.run(&gains).expect("runs"))).0 / steps);
        });
        theirs.extend(programs.iter().map(|(program, passes)| c::run(program, *passes, &input).0));
    }
    let (bare, whole) = (fastest(bare), fastest(whole));
    println!(
        "batch, loop alone          {bare:7.3} ns/step  ({:.0} million steps/s a core, {} at once)",
        1e3 / bare,
        ReferenceTrajectory::<2>::lanes()
    );
    println!("batch, contouring error    {whole:7.3} ns/step  ({:.0} million steps/s a core)", 1e3 / whole);
    if theirs.is_empty() {
        println!("  the loop alone in C      not measured: no C compiler found");
    } else {
        let theirs = fastest(theirs);
        println!(
            "  the loop alone in C      {theirs:7.3} ns/step  ({:.2} and {:.2} of its speed; promised: 1.0 and 0.4)",
            theirs / bare,
            theirs / whole
        );
    }

    let million = if quick { 1000 } else { 1_000_000 };
    let trajectory = ReferenceTrajectory::new(&path, &motion, LoopSettings::default()).expect("a trajectory");
    let gains = spread(&axes, million, 0.3);
    let (time, metrics) = seconds(|| trajectory.run(&gains).expect("runs"));
    let best = metrics.iter().map(|f| f.max_contour_error_um).fold(f64::INFINITY, f64::min);
    println!(
        "{million} gain sets on alpha  {time:7.2} s        (promised: a million in 5 s on two idle cores; {} here, best {best:.2} µm)",
        rayon::current_num_threads()
    );
}

/// The axes with gains around their own, up to `share` either way: a low-discrepancy sequence, the same on every machine.
fn spread(axes: &[AxisParameters; 2], count: usize, share: f64) -> Vec<[AxisParameters; 2]> {
    // Powers of the generalised golden ratio of ten dimensions (Roberts 2018).
    let phi = 1.071_773_462_536_293_f64;
    (0..count)
        .map(|i| {
            let mut d = 0;
            let mut factor = || {
                d += 1;
                1.0 + share * (2.0 * (0.5 + (i + 1) as f64 / phi.powi(d)).fract() - 1.0)
            };
            axes.map(|mut axis| {
                axis.pdff.kpp_rad_s_mm *= factor();
                axis.pdff.kpv_nm_s_rad *= factor();
                axis.pdff.kiv_1_s *= factor();
                axis.pdff.kpf_rad_mm *= factor();
                axis.pdff.kvf *= factor();
                axis
            })
        })
        .collect()
}
