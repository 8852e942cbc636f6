//! `servosim run`: runs a scenario, records it, plots it and prints its metrics.

use crate::parameters::AXIS_NAMES;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use crate::comparison::{Column, Comparison};
use crate::recording::{Recorder, RecordingMetadata};
use crate::report;
use crate::scenario::{Document, Scenario};
use crate::simulation::{Ending, Observer};
use clap::Args;

use super::output::{OutputArgs, make_folder, note, short};
use super::progress::Progress;
use super::{CliError, Outcome, analyze, compare, plot, program, table};

/// Arguments of `servosim run`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim run alpha.toml
  servosim run alpha --set feedrate.feed_mm_s=150 --set limits.contour_error_um=50
  servosim run alpha.toml --set feedrate.profile.quintic.phase_s=0.1
  servosim run heart --format json --plots none
  servosim run output/patch.nc

Tables of a scenario beyond the ideal drive model:
  [axes.x.effects]          mismatch, encoder, noise, delay, dac, current_loop,
                            two_mass, friction, backlash, pitch, ripple, force;
                            integration (step size)
  [axes.x.compensation]     notch, low_pass, acceleration, friction, backlash,
                            pitch, zero_phase
  [axes.x.controller]       p_pi, pid, cascade
  [control.cross_coupling]  cross-coupled control
  [[feedrate.override]]     feed override and feed hold during the run
  learned.file              a correction that `servosim learn` has written

`servosim schema` lists every key. For a scenario with effects a table shows the error with each of them, and \
the recording has a topic /drives with the drive signals of every control period.

SCENARIO is looked for as a file, then in the folder scenarios, then among the built-in ones (alpha, alpha-real, \
heart, star). A name that ends in .nc (.ngc .mpf .tap .gcode …) is an NC program: it runs on the machine of its \
part, PROGRAM.part.toml beside it (`servosim toolpath` writes both), and the part that it would cut is compared \
with the surface.")]
pub(crate) struct RunArgs {
    /// Scenario file, name of a built-in scenario, or NC program
    pub(super) scenario: String,
    /// The part that a program belongs to: a part file [default: PROGRAM.part.toml beside the program]
    #[arg(long, value_name = "FILE")]
    pub(super) part: Option<String>,
    /// Replace one value of the scenario, such as axes.x.pdff.kpp=120 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

/// What a control period takes in a recording, about.
const BYTES_A_SAMPLE: u64 = 311;

/// The drive signals takes beside, where they are more than their model.
const BYTES_A_SAMPLE_OF_DRIVES: u64 = 212;

/// From this size on a recording is told of before it is written \[bytes\].
const WORTH_A_WARNING: u64 = 1_000_000_000;

/// Up to so many samples the effects of the drives are run one by one too.
const MOST_COMPARED: u64 = 1_000_000;

/// Runs the scenario.
pub(crate) fn run(args: &RunArgs) -> Result<Outcome, CliError> {
    if program::is_program(&args.scenario) {
        return program::run(args);
    }
    if args.part.is_some() {
        return Err(CliError::Usage(
            "--part goes with an NC program, such as output/patch.nc, not with a scenario".to_owned(),
        ));
    }
    let mut document = Document::find(&args.scenario)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let scenario = document.scenario()?;
    let stop = stop_flag();
    make_folder(&args.out.folder)?;

    let simulation = scenario.simulation()?;
    let of_drives = if scenario.is_model() { 0 } else { BYTES_A_SAMPLE_OF_DRIVES };
    let bytes = simulation.samples().saturating_mul(BYTES_A_SAMPLE + of_drives);
    if !args.out.print.quiet && bytes >= WORTH_A_WARNING {
        note(&format!(
            "note: {} samples make a recording of about {} GB in {}; Ctrl-C ends the run",
            simulation.samples(),
            short(bytes as f64 / 1e9, 2),
            args.out.folder.display()
        ));
    }
    let path = args.out.folder.join(format!("{}.mcap", scenario.name));
    let replaces = path.is_file();
    let mut recorder = Recorder::create(&path, RecordingMetadata::new(&scenario.name, &scenario.source))?;
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
    let mut metrics = scenario.summary_observer().with_recording(name);
    let mut progress = Progress::new(args.out.print.is_watched());
    let mut observers: Vec<&mut dyn Observer<2>> = vec![&mut metrics, &mut recorder, &mut progress];
    let ending = simulation.run(&scenario.limits, Some(&stop), &mut observers)?;
    progress.finish();
    let summary = metrics.summary();
    let effects = effects(&scenario, &stop);
    let show = || args.out.print.show(&summary, || table::table(&summary) + &effects);
    if ending == Ending::Interrupted {
        let recording = recorder.interrupted(&summary)?.path.unwrap_or(path);
        show()?;
        let time_s = summary.samples.saturating_sub(1) as f64 * summary.period_s;
        return Err(CliError::Interrupted { time_s, recording });
    }
    recorder.finish(&summary)?;
    let mut written = vec![path];
    let plots = plots(args, &scenario.name, &written[0], &stop);
    // Metrics and recording are there whatever becomes of the plots.
    show()?;
    let plots = plots.map(|files| written.extend(files));
    if !args.out.print.quiet {
        let replaced = if replaces { " (the recording of an earlier run was replaced)" } else { "" };
        note(&format!("{}{replaced}", plot::wrote(&written)));
    }
    plots?;
    if !args.out.print.quiet {
        warn_of_instability(&scenario);
        for warning in summary.warnings() {
            note(&format!("warning: {warning}"));
        }
    }
    if summary.passed() {
        return Ok(Outcome::Fine);
    }
    if args.out.print.has_no_table() {
        note(&table::failures(&summary));
    }
    Ok(Outcome::Broken)
}

/// What each effect of the drives costs, where they are more than their models.
fn effects(scenario: &Scenario, stop: &AtomicBool) -> String {
    let few = scenario.simulation().is_ok_and(|simulation| simulation.samples() <= MOST_COMPARED);
    if scenario.is_model() && scenario.corrections_mm.is_none() || !few {
        return String::new();
    }
    Comparison::until(stop, scenario, &[Column::Own]).ok().flatten().map_or(String::new(), |comparison| {
        let mut out = "\n".to_owned();
        compare::errors(&mut out, &comparison);
        out
    })
}

/// A loop that is unstable but has not had the time to show it passes every limit: somebody should hear of it.
fn warn_of_instability(scenario: &Scenario) {
    let Ok(loops) = analyze::loops(scenario) else { return };
    for (name, _) in AXIS_NAMES.iter().zip(loops).filter(|(_, axis)| !axis.is_stable()) {
        note(&format!(
            "note: the loop of axis {name} is unstable, even if this run does not show it; `servosim analyze` says more"
        ));
    }
}

/// Draws the plots of the recording, as `servosim plot` does: what is seen is what was recorded.
fn plots(args: &RunArgs, name: &str, recording: &Path, stop: &AtomicBool) -> Result<Vec<PathBuf>, CliError> {
    let Some(format) = args.out.plots.format() else { return Ok(Vec::new()) };
    let data = plot::load(recording, Some(stop))?;
    Ok(report::write_all(&[data], &args.out.folder, name, format)?)
}

/// Two signals closer together than this are one.
const TWICE: Duration = Duration::from_millis(300);

/// A flag that Ctrl-C raises, so that a run (a search) ends soon and in order; a second Ctrl-C ends the program at once.
pub(crate) fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    // Without a handler Ctrl-C just ends the program, which is no reason not to run.
    let first = OnceLock::new();
    let _ = ctrlc::set_handler(move || {
        // `timeout` and schedulers send one signal to the process and at once another to its group: that is one wish.
        let since = first.get_or_init(Instant::now).elapsed();
        if raised.swap(true, Ordering::Relaxed) && since > TWICE {
            std::process::exit(1);
        }
    });
    flag
}

/// Ctrl-C ends the program at once, with a word: for what leaves nothing half done.
pub(crate) fn end_when_interrupted(word: &'static str) {
    // Without a handler Ctrl-C just ends the program.
    let _ = ctrlc::set_handler(move || {
        note(word);
        std::process::exit(1);
    });
}
