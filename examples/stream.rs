//! The rooms one by one, without a scenario file: path, motion, axes, and the run as a stream of control periods.
//! `cargo run --example stream`

use std::io::Write;

use nalgebra::Vector2;
use servosim::feedrate::{Motion, Profile};
use servosim::path::{Path, PhSpline};
use servosim::servo::{AxisParameters, Drive, LoopSettings, Pdff, Plant};
use servosim::simulation::Simulation;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let points = [[0.0, 0.0], [20.0, 15.0], [45.0, 5.0], [60.0, 30.0]].map(Vector2::from);
    let path = PhSpline::from_nodal_points(&points, false, None)?;
    let motion = Motion::plan(path.length_mm(), 80.0, Profile::Quintic { phase_s: 0.1 })?;
    let axis = AxisParameters {
        plant: Plant { gain_rad_s_v: 83.0, time_constant_s: 0.2 },
        drive: Drive::default(),
        pdff: Pdff { kpp_rad_s_mm: 97.4, kpv_nm_s_rad: 1.2, kiv_1_s: 250.0, kpf_rad_mm: 0.8, kvf: 0.85 },
    };
    let simulation = Simulation::new(&path, &motion, [axis; 2], LoopSettings::default())?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "time [s]  along the path [mm]  contouring error [µm]")?;
    for period in simulation.step_by(100) {
        writeln!(out, "{:8.3}  {:19.3}  {:21.3}", period.time_s, period.setpoint.s_mm, period.contour_error_um)?;
    }
    Ok(())
}
