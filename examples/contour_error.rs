//! A run in ten lines: `cargo run --example contour_error`.

use servosim::scenario::Scenario;
use servosim::simulation::Period;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut scenario = Scenario::builtin("alpha")?;
    scenario.axes[0].pdff.kpp_rad_s_mm = 90.0;
    let mut late = 0;
    let mut count_late = |period: &Period<2>| late += u32::from(period.tracking_error_um > 100.0);
    let summary = scenario.run(&mut [&mut count_late])?;
    println!("contouring error at most {:.3} µm", summary.max_contour_error_um);
    println!("{late} of {} samples are more than 0.1 mm behind the setpoint", summary.samples);
    Ok(())
}
