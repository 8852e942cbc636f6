//! `cargo bench`: every speed that the project promises, as a ratio against something run beside it in the same minute.
//!
//! - the two-axis loop on a given setpoint array, against the same loop in plain C (`cc -O3 -march=native`, where there is one)
//! - the detailed drive model, effect by effect, beside the ideal loop
//! - batches of runs, against structures of arrays in C; a million gain sets
//! - the whole step with interpolation and exact contouring error
//! - recording, against the bare MCAP writer
//! - `servosim run` as a process
//! - NC programs: steps a second beside a path's, and ten million blocks
//! - control points and time of B-spline fits
//! - the drop cutter, against `OpenCAMLib` (`tests/drop_opencamlib.py`)
//! - nested rings of large contours
//! - the machining check: pieces of a path a second
//! - motions under axis limits: grids of 10³ … 10⁵ points
//! - splines of 10² … 10⁶ nodal points, time and memory

mod batch;
mod c;
mod drive;
mod drop;
mod fit;
mod guide;
mod optimal;
mod process;
mod program;
mod recording;
mod removal;
mod scale;
mod servo_loop;
mod whole_step;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` runs this too: one short round, to see that it works.
    let quick = !arguments.iter().any(|argument| argument == "--bench");
    // `cargo bench -- step` runs the benches with that in their name.
    let filters: Vec<&String> = arguments.iter().filter(|argument| !argument.starts_with('-')).collect();
    let benches: [Bench; 13] = [
        ("loop", servo_loop::bench),
        ("drive", drive::bench),
        ("batch", batch::bench),
        ("step", whole_step::bench),
        ("recording", recording::bench),
        ("process", process::bench),
        ("program", program::bench),
        ("scale", scale::bench),
        ("fit", fit::bench),
        ("drop", drop::bench),
        ("guide", guide::bench),
        ("removal", removal::bench),
        ("optimal", optimal::bench),
    ];
    for (name, bench) in benches {
        if filters.is_empty() || filters.iter().any(|filter| name.contains(filter.as_str())) {
            bench(quick);
        }
    }
}

/// A name, and what it measures (in one short round, or in earnest).
type Bench = (&'static str, fn(bool));

/// Seconds that `work` takes.
fn seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = std::time::Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64(), result)
}

/// The fastest round: what the work takes when nothing else disturbs it.
fn fastest(rounds: impl IntoIterator<Item = f64>) -> f64 {
    rounds.into_iter().fold(f64::INFINITY, f64::min)
}

/// The paper's alpha: path and axes.
fn alpha() -> (servosim::path::PhSpline, [servosim::servo::AxisParameters; 2]) {
    use servosim::servo::{AxisParameters, Drive, Pdff, Plant};
    let control =
        [[0., 0.], [12., 18.], [24., 27.], [36., 9.], [24., -9.], [12., 0.], [0., 18.]].map(nalgebra::Vector2::from);
    let path = servosim::path::PhSpline::from_control_points(&control, false).expect("alpha is a path");
    let axis = |gain_rad_s_v, time_constant_s, kpv_nm_s_rad, kiv_1_s| AxisParameters {
        plant: Plant { gain_rad_s_v, time_constant_s },
        drive: Drive::default(),
        pdff: Pdff { kpp_rad_s_mm: 97.38, kpv_nm_s_rad, kiv_1_s, kpf_rad_mm: 0.8, kvf: 0.85 },
    };
    (path, [axis(83.0089, 0.19936, 1.19, 252.8), axis(50.4977, 0.15641, 1.53, 253.2)])
}
