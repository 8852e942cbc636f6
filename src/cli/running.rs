//! What runs of scenarios and of programs share: arguments, progress, and what is told at the end.

use std::fmt::Write as _;

use crate::run::{RunReport, RunRequest, Stage, Watch};
use crate::simulation::{Event, Observer, ObserverError, Period, Place, RunPlan};
use clap::Args;

use super::output::{OutputArgs, RecordArgs, note, wrote};
use super::progress::{Progress, Stages};
use super::{CliError, Outcome, table};

/// Arguments of `servosim run`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim run alpha.toml
  servosim run alpha --set feedrate.feed_mm_s=150 --set limits.contour_error_um=50
  servosim run alpha.toml --set feedrate.profile.quintic.phase_s=0.1
  servosim run heart --format json --plots none
  servosim run output/patch.nc
  servosim run alpha --name before --set axes.x.pdff.kpp=80

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

NAME.mcap is the recording, NAME.layout.json the layout of a viewer (Foxglove, Lichtblick) for it; plots of an \
earlier run of the same name that this one does not draw are removed.

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
    /// Name of the recording and the plots [default: that of the scenario or the program]
    #[arg(long, value_name = "NAME")]
    pub(super) name: Option<String>,
    #[command(flatten)]
    pub(super) record: RecordArgs,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

impl RunArgs {
    /// What is asked of the run.
    pub(super) fn request(&self) -> RunRequest {
        let mut request = RunRequest::new(&self.out.folder);
        request.name.clone_from(&self.name);
        request.recording = self.record.options();
        request.plots = self.out.plots.format();
        request.compare_effects = self.out.print.has_table();
        request
    }
}

/// What a run ends with once its metrics are shown: files, notes, and what the exit code is.
pub(super) fn finish(args: &RunArgs, report: RunReport, on_instability: &str) -> Result<Outcome, CliError> {
    if report.interrupted {
        let time_s = report.summary.samples.saturating_sub(1) as f64 * report.summary.period_s;
        return Err(CliError::Interrupted { time_s, recording: report.recording });
    }
    if !args.out.print.quiet {
        let mut text = wrote(&report.written);
        if report.replaced {
            text.push_str(" (the recording of an earlier run was replaced)");
        }
        if !report.removed.is_empty() {
            // Writing to a string does not fail.
            let count = report.removed.len();
            let _ = write!(text, "; {count} plot{} of an earlier run removed", if count == 1 { "" } else { "s" });
        }
        note(&text);
    }
    if let Some(error) = report.plots_error {
        return Err(error.into());
    }
    if !args.out.print.quiet {
        // A loop that is unstable but has not had the time to show it passes every limit: somebody should hear of it.
        for name in &report.unstable_axes {
            note(&format!(
                "note: the loop of axis {name} is unstable, even if this run does not show it{on_instability}"
            ));
        }
        for warning in report.summary.warnings() {
            note(&format!("warning: {warning}"));
        }
    }
    if report.summary.passed() {
        return Ok(Outcome::Fine);
    }
    if args.out.print.has_no_table() {
        note(&table::failures(&report.summary));
    }
    Ok(Outcome::Broken)
}

/// Shows on standard error how far a run is.
pub(super) struct Shown {
    progress: Progress,
    stages: Option<Stages>,
    is_watched: bool,
}

impl Shown {
    pub(super) fn new(is_watched: bool) -> Self {
        Self { progress: Progress::new(is_watched), stages: None, is_watched }
    }

    /// Clears what is shown.
    pub(super) fn finish(&mut self) {
        self.progress.finish();
        self.stages = None;
    }
}

impl<const A: usize> Observer<A> for Shown {
    fn begin(&mut self, plan: &RunPlan<'_, A>) -> Result<(), ObserverError> {
        Observer::<A>::begin(&mut self.progress, plan)
    }

    fn place(&mut self, place: &Place) -> Result<(), ObserverError> {
        Observer::<A>::place(&mut self.progress, place)
    }

    fn period(&mut self, period: &Period<A>) -> Result<(), ObserverError> {
        self.progress.period(period)
    }

    fn event(&mut self, event: &Event) -> Result<(), ObserverError> {
        Observer::<A>::event(&mut self.progress, event)
    }
}

impl<const A: usize> Watch<A> for Shown {
    fn stage(&mut self, stage: Stage) {
        if stage == Stage::Simulating {
            return;
        }
        self.progress.finish();
        if stage == Stage::CuttingNominalPart {
            let stages = Stages::new(self.is_watched);
            stages.begin("cutting the part as the program has it");
            self.stages = Some(stages);
        } else {
            self.stages = None;
        }
    }
}
