//! NC programs: steps a second beside the plain simulation of a path, and the first pass over ten million blocks.

use servosim::feedrate::{Motion, Profile};
use servosim::machining::{Machine, ProgramRun, ProgramStatistics};
use servosim::nc::{Action, Arc, Block, NcError, Plane};
use servosim::path::{Helix, Line, Path};
use servosim::servo::LoopSettings;
use servosim::simulation::Simulation;

use crate::{fastest, seconds};

/// A block at 100 mm/s from one point to the next.
fn block(line: usize, start_mm: [f64; 3], end_mm: [f64; 3], action: Action) -> Block {
    Block { line, start_mm, end_mm, feed_mm_min: Some(6000.0), action }
}

/// A wave in blocks of 0.1 mm.
fn wave(count: usize) -> impl Iterator<Item = Result<Block, NcError>> {
    let point = |i: usize| {
        let x = 0.1 * i as f64;
        // Back and forth, so that coordinates stay in range.
        let turn = (x / 100.0).rem_euclid(2.0);
        let (x, phase) = (if turn < 1.0 { turn } else { 2.0 - turn }, 0.02 * x);
        [100.0 * x, 20.0 * libm::sin(phase), 0.0]
    };
    (0..count).map(move |i| Ok(block(i + 1, point(i), point(i + 1), Action::Linear)))
}

pub(crate) fn bench(quick: bool) {
    let (_, [x, y]) = crate::alpha();
    let machine = Machine {
        axes: [x, y, x],
        settings: LoopSettings::default(),
        rapid_mm_s: 200.0,
        accel_mm_s2: 2000.0,
        jerk_mm_s3: 50_000.0,
        lateral_accel_mm_s2: 1000.0,
        corner_velocity_step_mm_s: 5.0,
        junction_accel_step_mm_s2: 50.0,
    };
    let rounds = if quick { 1 } else { 5 };
    let scale = if quick { 0.01 } else { 1.0 };
    let profile = Profile::JerkLimited { accel_mm_s2: machine.accel_mm_s2, jerk_mm_s3: machine.jerk_mm_s3 };

    // One long line and one helix, as a path and as a program of one block.
    let length = 100_000.0 * scale;
    let line = Line::new([0.0; 3].into(), [length, 0.0, 0.0].into()).expect("a line");
    let (start, end) = ([50.0, 0.0, 0.0], [0.0, 50.0, 1000.0 * scale]);
    let arc = Arc { plane: Plane::Xy, clockwise: true, centre_mm: [0.0; 3] };
    let sweep = arc.sweep_rad(start, end);
    let helix = Helix::new(start.into(), end.into(), [0.0; 3].into(), [0, 1, 2], sweep, true).expect("a helix");
    let cases: [(&str, &dyn Path<3>, Block); 2] = [
        ("line", &line, block(1, [0.0; 3], [length, 0.0, 0.0], Action::Linear)),
        ("helix", &helix, block(1, start, end, Action::Arc(arc))),
    ];
    for (name, path, one) in cases {
        let speed = if quick { 10.0 } else { 100.0 };
        let motion = Motion::plan(path.length_mm(), speed, profile).expect("a motion");
        let mut samples = 0;
        let plain = fastest((0..rounds).map(|_| {
            let simulation = Simulation::new(path, &motion, machine.axes, machine.settings).expect("a run");
            samples = simulation.samples();
            seconds(|| simulation.map(|p| p.contour_error_um).fold(0.0, f64::max)).0
        }));
        let mut steps = 0_u64;
        let program = fastest((0..rounds).map(|_| {
            let run = ProgramRun::new(std::iter::once(Ok(one.clone())), &machine).expect("a run");
            steps = 0;
            seconds(|| {
                run.map(|p| p.expect("a period").period.contour_error_um).inspect(|_| steps += 1).fold(0.0, f64::max)
            })
            .0
        }));
        let (plain, program) = (samples as f64 / plain / 1e6, steps as f64 / program / 1e6);
        println!(
            "program: {name}, 3 axes: {program:.2} million steps/s, plain simulation {plain:.2} ({:.0} %)",
            100.0 * program / plain
        );
    }

    // Straight blocks of 0.1 mm: one a millisecond.
    let count = if quick { 1000 } else { 200_000 };
    let mut steps = 0_u64;
    let mut held = 0;
    let time = fastest((0..rounds).map(|_| {
        let mut run = ProgramRun::new(wave(count), &machine).expect("a run");
        steps = 0;
        seconds(|| {
            while let Some(period) = run.next() {
                std::hint::black_box(period.expect("a period"));
                held = held.max(run.held());
                steps += 1;
            }
        })
        .0
    }));
    println!(
        "program: {count} blocks of 0.1 mm: {:.2} million steps/s ({steps} steps), at most {held} motions in memory",
        steps as f64 / time / 1e6
    );

    let count = if quick { 10_000 } else { 10_000_000 };
    // A period long enough for the run to be one.
    let long = Machine { settings: LoopSettings { period_s: 1e-3, ..machine.settings }, ..machine };
    let (time, statistics) = seconds(|| ProgramStatistics::of(wave(count), &long).expect("statistics"));
    println!(
        "program: first pass over {} blocks: {time:.2} s ({:.2} million blocks/s), motion of {:.0} s{}",
        statistics.blocks.linear,
        count as f64 / time / 1e6,
        statistics.time_s,
        peak_memory()
    );
}

/// The most memory that the process has had, where the system tells.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    peak.map_or_else(String::new, |peak| format!(", {} peak memory of the process", peak.trim()))
}
