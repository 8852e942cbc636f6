//! `servosim tune`: searches gains that make the contouring error small and keep stability margin.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use crate::report::{self, Convergence};
use crate::scenario::{Document, Scenario};
use crate::tuning::{
    Constraints, Gain, Method, Objective, Problem, Tuned, Tuning, TuningError, TuningReport, Uncertainty, Variable,
    report,
};
use clap::{Args, ValueEnum};

use super::interrupt::stop_flag;
use super::output::{OutputArgs, make_folder, significant, wrote};
use super::progress::SearchProgress;
use super::{CliError, Outcome, tune_file, tune_table};

/// Arguments of `servosim tune`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim tune alpha.toml && servosim run output/alpha-tuned.toml
  servosim tune heart --max-ms 1.4 --min-delay-margin-ms 1
  servosim tune alpha --gains kpp,kpf    these gains of both axes
  servosim tune alpha --vary axes.x.pdff.kpp=60:140 --vary x.kpf
  servosim tune alpha --objective rms --uncertainty 30% --method nelder-mead

The objective is that of the nominal plants plus --worst-weight times that of the worst plant at the corners of \
the uncertainty (without corners whose plants would need more than the voltage limit). Gains are allowed only if \
Ms and delay margin keep their limits, every plant of the uncertainty is stable, and no axis saturates or locks \
up.

Default bounds are a third to three times the scenario's own gain (kpp, kpv, kiv), half to twice (kpf, kvf), and \
for a gain of 0 from 0 to that of a stiff loop.

Tuning runs the ideal drive model, K/(1 + τ s) under PDFF control: effects and compensation are ignored, and \
other controllers are refused. `servosim compare FILE --gains output/NAME-tuned.toml` shows the tuned gains with \
the detailed drive model.

Writes NAME-tuned.toml, the scenario with its comments and the tuned gains, and NAME-tune.svg.

Exit codes: 0 tuned, 1 interrupted (the best so far is written), 2 wrong usage, 3 no gains keep the constraints.")]
pub(crate) struct TuneArgs {
    /// Scenario file, or name of a built-in scenario
    scenario: String,
    /// Replace one value of the scenario, such as axes.x.pdff.kvf=1 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Gains that may be changed, on both axes [default: all, kpp,kpv,kiv,kpf,kvf, if there is no --vary]
    #[arg(long, value_name = "GAINS", value_delimiter = ',')]
    gains: Vec<String>,
    /// One gain that may be changed, with its bounds or without (may be given again)
    #[arg(long, value_name = "KEY[=LOW:HIGH]")]
    vary: Vec<String>,
    /// What is minimised: the largest contouring error, its rms, or the largest one plus weighted peak voltage
    #[arg(long, value_enum, default_value = "max")]
    objective: ObjectiveName,
    /// Weight of the peak voltage in the weighted objective [µm/V]
    #[arg(long, value_name = "WEIGHT", default_value_t = 0.1, allow_negative_numbers = true)]
    voltage_weight: f64,
    /// Largest peak sensitivity of an axis
    #[arg(long, value_name = "MS", default_value_t = 1.6, allow_negative_numbers = true)]
    max_ms: f64,
    /// Smallest delay margin of an axis [ms]
    #[arg(long, value_name = "MARGIN", allow_negative_numbers = true)]
    min_delay_margin_ms: Option<f64>,
    /// Uncertainty of the plants' gain and time constant, or GAIN,TIME-CONSTANT
    #[arg(long, value_name = "SHARE", default_value = "20%", allow_hyphen_values = true)]
    uncertainty: String,
    /// Weight of the worst plant of the uncertainty beside the nominal ones; 0: none
    #[arg(long, value_name = "WEIGHT", default_value_t = 0.2, allow_negative_numbers = true)]
    worst_weight: f64,
    /// Search method of every start
    #[arg(long, value_enum, default_value = "cma-es")]
    method: MethodName,
    /// Number of starts: the scenario's own gains, the others sampled between the bounds
    #[arg(long, value_name = "N", default_value_t = Tuning::default().starts)]
    starts: usize,
    /// Seed of the random numbers: the same seed gives the same result
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// How many gain sets are evaluated [default: what takes a few seconds]
    #[arg(long, value_name = "EVALUATIONS")]
    budget: Option<usize>,
    #[command(flatten)]
    out: OutputArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ObjectiveName {
    Max,
    Rms,
    Weighted,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodName {
    NelderMead,
    CmaEs,
    PatternSearch,
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::NelderMead => Self::NelderMead,
            MethodName::CmaEs => Self::CmaEs,
            MethodName::PatternSearch => Self::PatternSearch,
        }
    }
}

/// Tunes the scenario.
pub(crate) fn run(args: &TuneArgs) -> Result<Outcome, CliError> {
    let mut document = Document::find(&args.scenario)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let scenario = document.scenario()?;
    let problem = problem(args, &scenario)?;
    let defaults = Tuning::default_for(&problem);
    let tuning = Tuning {
        method: args.method.into(),
        starts: args.starts,
        seed: args.seed,
        budget: args.budget.unwrap_or(defaults.budget),
    };
    let file = tune_file::Place::new(&args.out.folder, &scenario.name)?;
    let stop = stop_flag();

    let progress = SearchProgress::new(args.out.print.is_watched(), "µm");
    let tuned = tuning.run(&problem, &stop, &|state| progress.show(state.evaluations, state.budget, state.best))?;
    progress.finish();
    let report = report(&problem, &tuning, &tuned);
    let tables = || if report.feasible { tune_table::tables(&report) } else { String::new() };
    let show = || args.out.print.show(&report, tables);
    if !report.feasible {
        show()?;
        return Err(nothing_allowed(&report));
    }
    let tuned_file = make_folder(&args.out.folder).and_then(|()| file.write(&document, &report));
    let plots = tuned_file.is_ok().then(|| plot_convergence(args, &scenario, &report, &tuned));
    // The metrics are shown whatever becomes of the files: with a full disk the gains in them are all that is left of the search.
    show()?;
    let mut written = vec![tuned_file?];
    let plots = plots.unwrap_or(Ok(Vec::new()));
    let plots = plots.map(|files| written.extend(files));
    args.out.print.note(&wrote(&written));
    if !report.notes.is_empty() {
        // The table tells what the search did not see.
        let tuned = written.first().map_or(String::new(), |file| file.display().to_string());
        args.out.print.note(&format!(
            "note: the gains were tuned on the ideal drive models; `servosim compare {} --gains {tuned}` judges them on the detailed drive \
             model",
            args.scenario
        ));
    }
    plots?;
    if tuned.interrupted || stop.load(Ordering::Relaxed) {
        let scenario = written.swap_remove(0);
        return Err(CliError::TuningInterrupted { evaluations: tuned.evaluations, scenario });
    }
    Ok(Outcome::Fine)
}

/// What the arguments ask for.
fn problem<'a>(args: &TuneArgs, scenario: &'a Scenario) -> Result<Problem<'a>, CliError> {
    let mut variables: Vec<Variable> =
        args.vary.iter().map(|text| Variable::parse(text, scenario)).collect::<Result<_, _>>()?;
    let own_bounds = variables.len();
    let mut gains = args.gains.iter().map(|name| Gain::parse(name.trim())).collect::<Result<Vec<_>, _>>()?;
    if gains.is_empty() && variables.is_empty() {
        gains.extend(Gain::ALL);
    }
    for axis in 0..2 {
        for &gain in &gains {
            // `--gains kpp --vary x.kpp=60:140`: the bounds of one of them are given.
            if !variables[..own_bounds].iter().any(|v| v.axis == axis && v.gain == gain) {
                variables.push(Variable::new(scenario, axis, gain));
            }
        }
    }
    let objective = match args.objective {
        ObjectiveName::Max => Objective::MaxContourError,
        ObjectiveName::Rms => Objective::RmsContourError,
        ObjectiveName::Weighted => Objective::Weighted { voltage_um_v: args.voltage_weight },
    };
    let constraints = Constraints {
        max_ms: args.max_ms,
        min_delay_margin_s: args.min_delay_margin_ms.map(|margin| margin / 1e3),
        uncertainty: uncertainty(&args.uncertainty)?,
    };
    Ok(Problem::new(scenario, variables, objective, constraints, args.worst_weight)?)
}

/// `20%`, `0.2` or `±20%`, once for both or once for the gain and once for the time constant.
fn uncertainty(text: &str) -> Result<Uncertainty, CliError> {
    let share = |text: &str| {
        let text = text.trim().trim_start_matches('±');
        let (number, scale) = text.strip_suffix('%').map_or((text, 1.0), |number| (number.trim(), 100.0));
        number.parse::<f64>().map(|value| value / scale).map_err(|_| {
            CliError::Usage(format!(
                "--uncertainty {text}: not a share\nhelp: write 20% (gain and time constant), or 20%,10% (gain, then time constant)"
            ))
        })
    };
    match text.split_once(',') {
        Some((gain, time_constant)) => Ok(Uncertainty { gain: share(gain)?, time_constant: share(time_constant)? }),
        None => share(text).map(|both| Uncertainty { gain: both, time_constant: both }),
    }
}

/// No gains keep the constraints: which ones are broken, and by how much at the closest.
fn nothing_allowed(report: &TuningReport) -> CliError {
    let gains: Vec<String> =
        report.gains.iter().map(|gain| format!("{} = {}", gain.name, significant(gain.after, 5))).collect();
    let begun = if report.search.interrupted { "interrupted before any" } else { "no" };
    CliError::NothingAllowed(format!(
        "{begun} gains were found that keep every constraint; nothing was written. The closest ones ({}):\n  {}\nhelp: \
         loosen the limit (--max-ms, --min-delay-margin-ms, --uncertainty), widen the bounds (--vary), or search longer \
         (--budget, --starts)",
        gains.join(", "),
        report.broken.join("\n  ")
    ))
}

fn plot_convergence(
    args: &TuneArgs,
    scenario: &Scenario,
    report: &TuningReport,
    tuned: &Tuned,
) -> Result<Vec<PathBuf>, CliError> {
    let Some(format) = args.out.plots.format() else { return Ok(Vec::new()) };
    let subtitle = tune_table::headline(report);
    let searches = tuned.traces.iter().map(|trace| (trace.start, trace.steps.as_slice())).collect();
    let convergence = Convergence { name: &scenario.name, subtitle: &subtitle, unit: "µm", searches };
    Ok(report::write_convergence(&convergence, &args.out.folder, &scenario.name, format)?)
}

impl From<TuningError> for CliError {
    fn from(error: TuningError) -> Self {
        match error {
            TuningError::Simulation(error) => Self::Simulation(error),
            error => {
                let help = match &error {
                    TuningError::UnknownVariable { .. } => {
                        "\nhelp: the gains are kpp, kpv, kiv, kpf and kvf; one axis' gain is axes.x.pdff.kpp, or x.kpp"
                    }
                    TuningError::Bounds { .. } => "\nhelp: write KEY=LOW:HIGH, such as axes.x.pdff.kpp=60:140",
                    TuningError::NoStart => "\nhelp: --starts 1 searches from the scenario's own gains alone",
                    TuningError::Controller { .. } => {
                        "\nhelp: take the table of its controller out of the scenario to tune its PDFF gains; `servosim compare FILE \
                         --controllers pdff,p-pi,pid,cascade` runs them side by side"
                    }
                    TuningError::Budget { .. } => "\nhelp: raise --budget, or lower --starts",
                    _ => "",
                };
                Self::Usage(format!("{error}{help}"))
            }
        }
    }
}
