//! `servosim measure`: what is measured on a machine, measured on a scenario.

use std::fmt::Write as _;
use std::path::PathBuf;

use crate::measure::{
    AxisResponse, AxisSteps, CircleRequest, CircleTest, Direction, Response, ResponseRequest, Spike, StepRequest,
    Steps, circle, circle_observed, response, step,
};
use crate::recording::{Recorder, RecordingMetadata};
use crate::report;
use crate::scenario::{Document, Scenario};
use crate::summary::SummaryObserver;
use clap::{Args, Subcommand};

use super::interrupt::end_when_interrupted;
use super::output::{OutputArgs, make_folder, note, printable, short, significant, wrote};
use super::{CliError, Outcome, analyze};

/// Arguments of `servosim measure`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim measure circle alpha-real --radius-mm 50 --feed-mm-s 50
  servosim measure response alpha --points 100
  servosim measure step alpha --step-um 1 --window-um 0.1

The drives are those of the scenario, with effects and compensation, without cutting force. `servosim help \
measure KIND` describes each.")]
pub(crate) struct MeasureArgs {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Debug, Subcommand)]
enum Kind {
    /// Circular test after ISO 230-4: circular deviation, hysteresis, reversal spikes, polar plot
    Circle(CircleArgs),
    /// Frequency response by swept sine, beside the linear analysis: bandwidth, peak, Bode plot
    Response(ResponseArgs),
    /// Step and ramp: rise time, overshoot, settling to a window, following error
    Step(StepArgs),
}

/// What every measurement takes.
#[derive(Debug, Args)]
struct Common {
    /// Scenario file, or name of a built-in scenario
    scenario: String,
    /// Replace one value of the scenario, such as axes.x.pdff.kpp=120 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    out: OutputArgs,
}

impl Common {
    fn scenario(&self) -> Result<Scenario, CliError> {
        let mut document = Document::find(&self.scenario)?;
        for key_value in &self.set {
            document.set(key_value)?;
        }
        Ok(document.scenario()?)
    }
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim measure circle alpha-real
  servosim measure circle alpha-real --set axes.x.effects.friction.coulomb.static_nm=0.4
  servosim measure circle alpha --radius-mm 10 --format json --plots none

  G     smallest distance of two concentric circles that contain the path of one
        direction; G(b): of both
  F     radial deviation from the nominal circle
  D     mean radius minus the nominal one
  H     hysteresis: largest radial distance of the two paths

A reversal spike is what exceeds the levels before and after a reversal (-: nothing that stands out of the \
ripple elsewhere); lost motion is the step between these levels. Exits with 3 if an axis locks up.")]
struct CircleArgs {
    #[command(flatten)]
    common: Common,
    /// Radius of the circle
    #[arg(long, value_name = "MM", allow_hyphen_values = true, default_value_t = 50.0)]
    radius_mm: f64,
    /// Feed [default: that of the scenario]
    #[arg(long, value_name = "MM/S", allow_hyphen_values = true)]
    feed_mm_s: Option<f64>,
    /// Centre, X and Y
    #[arg(long, value_name = "X,Y", value_delimiter = ',', num_args = 1, default_values_t = [0.0, 0.0], allow_hyphen_values = true)]
    centre_mm: Vec<f64>,
    /// Where the measured turns start: 0 on +X, 90 on +Y
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    start_deg: f64,
    /// Turns measured in each direction, not counting those in which the feed is reached
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 1)]
    turns: u32,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim measure response alpha
  servosim measure response alpha-real --low-hz 2 --high-hz 200 --amplitude-um 20

Stepped sines: one frequency after the other, each until two blocks of whole periods agree. The amplitude is \
chosen so that no drive saturates. The bandwidth is then measured more finely between its two neighbouring \
frequencies. The linear analysis beside it is that of `servosim analyze`. Each axis is measured by itself, \
without cross-coupled control.

The highest frequency is 0.95 of the Nyquist frequency (475 Hz at a control period of 1 ms): closer to it the \
samples hardly distinguish a sine from its alias. Exits with 3 if a loop is unstable.")]
struct ResponseArgs {
    #[command(flatten)]
    common: Common,
    /// Lowest frequency [default: 1]
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    low_hz: Option<f64>,
    /// Highest frequency, at most 0.95 of the Nyquist frequency [default: half of it]
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    high_hz: Option<f64>,
    /// How many frequencies
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 60)]
    points: u32,
    /// Amplitude of the command [default: at each frequency what takes about half the voltage, at most 1 mm and the feed]
    #[arg(long, value_name = "UM", allow_hyphen_values = true)]
    amplitude_um: Option<f64>,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim measure step alpha
  servosim measure step alpha-real --step-um 1 --window-um 0.2 --feed-mm-s 30

Each axis by itself, without cross-coupled control: a step of its command, then a ramp from rest to the feed and \
back to rest. Exits with 3 if a loop is unstable or locks up.")]
struct StepArgs {
    #[command(flatten)]
    common: Common,
    /// Height of the step [default: the largest of 10, 5, 2, 1 … that saturates no drive]
    #[arg(long, value_name = "UM", allow_hyphen_values = true)]
    step_um: Option<f64>,
    /// Settled is what stays this near to its command [default: a tenth of the step]
    #[arg(long, value_name = "UM", allow_hyphen_values = true)]
    window_um: Option<f64>,
    /// Feed of the ramp [default: that of the scenario]
    #[arg(long, value_name = "MM/S", allow_hyphen_values = true)]
    feed_mm_s: Option<f64>,
    /// How long each is watched
    #[arg(long, value_name = "S", allow_hyphen_values = true, default_value_t = 0.5)]
    watch_s: f64,
}

/// Measures.
pub(crate) fn run(args: &MeasureArgs) -> Result<Outcome, CliError> {
    end_when_interrupted(
        "error: interrupted before the measurement was done; nothing was written but what `*.mcap.partial` holds of a circle",
    );
    match &args.kind {
        Kind::Circle(args) => {
            let scenario = args.common.scenario()?;
            let [x, y] = args.centre_mm[..] else {
                let given = args.centre_mm.len();
                return Err(CliError::Usage(format!("--centre-mm takes two numbers, X,Y, not {given}")));
            };
            let default = CircleRequest::of(&scenario);
            let request = CircleRequest {
                radius_mm: args.radius_mm,
                feed_mm_s: args.feed_mm_s.unwrap_or(default.feed_mm_s),
                centre_mm: [x, y],
                start_deg: args.start_deg,
                turns: args.turns,
            };
            let (test, recordings) = recorded_circle(&args.common.out, &scenario, &request)?;
            show(
                &args.common.out,
                &test,
                || circle_table(&test),
                |folder, format| {
                    let plots = report::write_circle(&test, folder, &scenario.name, format)?;
                    Ok(recordings.into_iter().chain(plots).collect())
                },
            )?;
            if !test.locked_up {
                return Ok(Outcome::Fine);
            }
            if args.common.out.print.has_no_table() {
                note(&test.warnings.join("\n"));
            }
            Ok(Outcome::Broken)
        }
        Kind::Response(args) => {
            let scenario = args.common.scenario()?;
            let request = ResponseRequest {
                low_hz: args.low_hz,
                high_hz: args.high_hz,
                points: Some(args.points),
                amplitude_um: args.amplitude_um,
            };
            let measured = response(&scenario, &request)?;
            show(
                &args.common.out,
                &measured,
                || response_table(&measured),
                |folder, format| report::write_response(&measured, folder, &scenario.name, format),
            )
        }
        Kind::Step(args) => {
            let scenario = args.common.scenario()?;
            let default = StepRequest::of(&scenario);
            let step_um = args.step_um.unwrap_or(default.step_um);
            let request = StepRequest {
                step_um,
                window_um: args.window_um.unwrap_or(0.1 * step_um),
                feed_mm_s: args.feed_mm_s.unwrap_or(default.feed_mm_s),
                watch_s: args.watch_s,
            };
            let measured = step(&scenario, &request)?;
            show(
                &args.common.out,
                &measured,
                || step_table(&measured),
                |folder, format| report::write_steps(&measured, folder, &scenario.name, format),
            )?;
            if measured.passed() {
                return Ok(Outcome::Fine);
            }
            if args.common.out.print.has_no_table() {
                for warning in &measured.warnings {
                    note(warning);
                }
            }
            Ok(Outcome::Broken)
        }
    }
}

/// The circular test, with a recording of each direction where files are written.
fn recorded_circle(
    out: &OutputArgs,
    scenario: &Scenario,
    request: &CircleRequest,
) -> Result<(CircleTest, Vec<PathBuf>), CliError> {
    if out.plots.format().is_none() {
        return Ok((circle(scenario, request)?, Vec::new()));
    }
    request.check(scenario)?;
    make_folder(&out.folder)?;
    let stems = ["ccw", "cw"].map(|direction| format!("{}-circle-{direction}", scenario.name));
    let create = |stem: &str| {
        let metadata = RecordingMetadata::new(stem, &scenario.source).with_drives(&scenario.drives);
        Recorder::create(out.folder.join(format!("{stem}.mcap")), metadata)
    };
    let (mut first, mut second) = (create(&stems[0])?, create(&stems[1])?);
    let [mut one, mut two] = stems.each_ref().map(|stem| SummaryObserver::<2>::new(stem.as_str()));
    let test = circle_observed(scenario, request, [&mut [&mut one, &mut first], &mut [&mut two, &mut second]])?;
    let saved = [first.finish(&one.summary())?, second.finish(&two.summary())?];
    Ok((test, saved.into_iter().filter_map(|saved| saved.path).collect()))
}

/// Metrics first, then plots.
fn show(
    out: &OutputArgs,
    metrics: &impl serde::Serialize,
    table: impl FnOnce() -> String,
    draw: impl FnOnce(&std::path::Path, report::Format) -> Result<Vec<std::path::PathBuf>, report::ReportError>,
) -> Result<Outcome, CliError> {
    out.print.show(metrics, table)?;
    if let Some(format) = out.plots.format() {
        make_folder(&out.folder)?;
        out.print.note(&wrote(&draw(&out.folder, format)?));
    }
    Ok(Outcome::Fine)
}

/// Rows of a label, a value for each column and a unit.
struct Table {
    text: String,
    label: usize,
}

impl Table {
    fn new(title: &str, label: usize, columns: &[String]) -> Self {
        let mut table = Self { text: format!("{title}\n\n"), label };
        table.row("", columns, "");
        table
    }

    fn row(&mut self, label: &str, values: &[String], unit: &str) {
        let values: String = values.iter().fold(String::new(), |mut out, value| {
            let _ = write!(out, "  {value:>16}");
            out
        });
        let line = format!("  {label:<width$}{values}  {unit}", width = self.label);
        self.text.push_str(line.trim_end());
        self.text.push('\n');
    }

    fn warnings(mut self, warnings: impl Iterator<Item = String>) -> String {
        for (i, warning) in warnings.enumerate() {
            let _ = writeln!(self.text, "{}  {}", if i == 0 { "\n" } else { "" }, printable(&warning));
        }
        self.text
    }
}

/// The circular test for people.
fn circle_table(test: &CircleTest) -> String {
    let title = format!(
        "{}: circular test, radius {} mm at {} mm/s",
        printable(&test.scenario),
        short(test.radius_mm, 6),
        short(test.feed_mm_s, 6)
    );
    let columns = test.directions.iter().map(|d| if d.clockwise { "clockwise" } else { "counterclockwise" }.to_owned());
    let mut table = Table::new(&title, 34, &columns.collect::<Vec<_>>());
    let both = |pick: &dyn Fn(&Direction) -> String| test.directions.iter().map(pick).collect::<Vec<_>>();
    let f = |value: f64| significant(value, 5);
    table.row("circular deviation G", &both(&|d| f(d.circular_deviation_um)), "µm");
    table.row("  around the least-squares centre", &both(&|d| f(d.circular_deviation_least_squares_um)), "µm");
    table.row("mean radius, less the nominal one", &both(&|d| f(d.radius_um)), "µm");
    table.row("radial deviation F: largest", &both(&|d| f(d.radial_max_um)), "µm");
    table.row("  at", &both(&|d| significant(d.radial_max_at_deg, 4)), "°");
    table.row("  smallest", &both(&|d| f(d.radial_min_um)), "µm");
    table.row("  at", &both(&|d| significant(d.radial_min_at_deg, 4)), "°");
    for (axis, name) in ["X", "Y"].into_iter().enumerate() {
        table.row(&format!("lost motion {name}"), &both(&|d| f(d.lost_motion_um[axis])), "µm");
    }
    for quadrant in 0..4 {
        let Some(spike) = test.directions[0].spikes.get(quadrant) else { continue };
        let label = format!("spike at {}° ({} turns back)", spike.at_deg, spike.axis.to_uppercase());
        let height = |spike: &Spike| if spike.clear { f(spike.height_um) } else { "-".to_owned() };
        table.row(&label, &both(&|d| height(&d.spikes[quadrant])), "µm");
    }
    table.row("ripple between reversals", &both(&|d| f(d.ripple_um)), "µm");
    table.text.push('\n');
    for (label, value, remark) in [
        ("bidirectional deviation G(b)", test.bidirectional_deviation_um, String::new()),
        ("  around the least-squares centre", test.bidirectional_deviation_least_squares_um, String::new()),
        ("mean radial deviation D", test.mean_radial_deviation_um, String::new()),
        ("hysteresis H", test.hysteresis_um, format!("at {}°", significant(test.hysteresis_at_deg, 4))),
    ] {
        table.row(label, &[f(value)], &format!("µm  {remark}"));
    }
    table.warnings(test.warnings.iter().cloned())
}

/// The frequency response for people.
fn response_table(measured: &Response) -> String {
    let title = format!("{}: frequency response, command to table", printable(&measured.scenario));
    let columns: Vec<String> = measured.axes.iter().map(|axis| axis.axis.to_uppercase()).collect();
    let mut table = Table::new(&title, 34, &columns);
    let each = |pick: &dyn Fn(&AxisResponse) -> Option<f64>, digits: usize| -> Vec<String> {
        measured.axes.iter().map(|axis| pick(axis).map_or("-".to_owned(), |value| significant(value, digits))).collect()
    };
    let rad_s = |hz: Option<f64>| hz.map(|hz| std::f64::consts::TAU * hz);
    let again = |first: Option<f64>, last: Option<f64>| last.filter(|last| Some(*last) != first);
    table.row("bandwidth (-3 dB)", &each(&|axis| axis.bandwidth_hz, 5), "Hz");
    table.row("", &each(&|axis| rad_s(axis.bandwidth_hz), 5), "rad/s");
    if measured.axes.iter().any(|axis| again(axis.bandwidth_hz, axis.bandwidth_last_hz).is_some()) {
        let last = each(&|axis| again(axis.bandwidth_hz, axis.bandwidth_last_hz), 5);
        table.row("  rises again, below from here on", &last, "Hz");
    }
    table.row("  of the linear analysis", &each(&|axis| axis.model_bandwidth_hz, 5), "Hz");
    table.row("", &each(&|axis| rad_s(axis.model_bandwidth_hz), 5), "rad/s");
    if measured.axes.iter().any(|axis| again(axis.model_bandwidth_hz, axis.model_bandwidth_last_hz).is_some()) {
        let last = each(&|axis| again(axis.model_bandwidth_hz, axis.model_bandwidth_last_hz), 5);
        table.row("  rises again, below from here on", &last, "Hz");
    }
    table.row("peak", &each(&|axis| Some(axis.peak_db), 4), "dB");
    table.row("  at", &each(&|axis| Some(axis.peak_hz), 4), "Hz");
    table.row("largest distance from the analysis", &each(&|axis| axis.model_deviation_db, 3), "dB");
    table.row("", &each(&|axis| axis.model_deviation_deg, 3), "°");
    let count = |axis: &AxisResponse| axis.points.len().to_string();
    table.row("frequencies", &measured.axes.iter().map(count).collect::<Vec<_>>(), "");
    let warnings = measured
        .axes
        .iter()
        .flat_map(|axis| axis.warnings.iter().map(|w| format!("{}: {w}", axis.axis.to_uppercase())));
    let linear = measured.axes.iter().map(|axis| (axis.axis.as_str(), &axis.linearized));
    let linear = analyze::linearized(linear).into_iter().map(|line| format!("linear analysis of {line}"));
    table.warnings(linear.chain(warnings).chain(measured.warnings.iter().cloned()))
}

/// Step and ramp for people.
fn step_table(measured: &Steps) -> String {
    let title = format!(
        "{}: step of {} µm, window ±{} µm",
        printable(&measured.scenario),
        short(measured.step_um, 6),
        short(measured.window_um, 6)
    );
    let columns: Vec<String> = measured.axes.iter().map(|axis| axis.axis.to_uppercase()).collect();
    let mut table = Table::new(&title, 34, &columns);
    let each = |pick: &dyn Fn(&AxisSteps) -> Option<f64>, digits: usize, none: &str| -> Vec<String> {
        measured
            .axes
            .iter()
            .map(|axis| pick(axis).map_or(none.to_owned(), |value| significant(value, digits)))
            .collect()
    };
    let never = "never";
    table.row("step: rise, 10 to 90 %", &each(&|a| a.step.rise_s.map(|s| 1e3 * s), 4, never), "ms");
    table.row("  overshoot", &each(&|a| Some(a.step.overshoot_percent), 4, never), "%");
    table.row("  settled", &each(&|a| a.step.settling_s.map(|s| 1e3 * s), 4, never), "ms");
    // Less than rounding is nothing.
    let rest = |um: f64| Some(if um.abs() < 1e-9 { 0.0 } else { um });
    table.row("  remaining error at rest", &each(&|a| rest(a.step.rest_um), 3, never), "µm (negative: beyond)");
    let feed = measured.axes.first().map_or(0.0, |axis| axis.ramp.feed_mm_s);
    let label = format!("following error at {} mm/s", short(feed, 5));
    table.row(&label, &each(&|a| Some(a.ramp.following_error_um), 5, never), "µm (negative: ahead)");
    table.row("  of the linear analysis", &each(&|a| a.ramp.model_following_error_um, 5, "-"), "µm");
    table.row("  velocity gain Kv (feed over error)", &each(&|a| a.ramp.kv_1_s, 4, "-"), "1/s");
    table.row("", &each(&|a| a.ramp.kv_1_s.map(|kv| 0.06 * kv), 4, "-"), "m/min/mm");
    table.row("  ripple", &each(&|a| Some(a.ramp.ripple_um), 3, never), "µm");
    table.row("  largest of the whole ramp", &each(&|a| Some(a.ramp.largest_error_um), 5, never), "µm");
    table.row("  settled after its end", &each(&|a| a.ramp.settling_s.map(|s| 1e3 * s), 4, never), "ms");
    table.row("  remaining error at rest", &each(&|a| rest(a.ramp.rest_um), 3, never), "µm (negative: beyond)");
    table.warnings(measured.warnings.iter().cloned())
}
