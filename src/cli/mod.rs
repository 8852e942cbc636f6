//! The command line: one file a subcommand. Results go to standard output, everything else to standard error.

mod analyze;
mod check;
mod compare;
mod comparison_table;
mod inspect;
mod interrupt;
mod junit;
mod learn;
mod measure;
mod merge;
mod new;
mod output;
mod part_table;
mod plot;
mod program;
mod progress;
mod run;
mod running;
mod schema;
mod stepover;
mod suggest;
mod sweep;
mod table;
mod test;
mod tested;
mod toolpath;
mod tune;
mod tune_file;
mod tune_table;

use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use crate::learning::LearnError;
use crate::machining::ProgramError;
use crate::measure::MeasureError;
use crate::nc::{NcError, WriteError};
use crate::recording::{ReadError, RecordingError};
use crate::report::ReportError;
use crate::run::RunError;
use crate::scenario::ScenarioError;
use crate::simulation::SimulationError;
use crate::sweep::SweepError;
use crate::toolpath::plan::PlanError;
use clap::{Parser, Subcommand};

/// Closed-loop servo simulation for CNC feed drives: from a tool path to the contouring error in micrometres.
#[derive(Debug, Parser)]
#[command(version, propagate_version = true, max_term_width = 100, arg_required_else_help = true)]
#[command(after_help = "\
Examples:
  servosim run alpha.toml                        run a scenario: table, recording, plots
  servosim run heart --set axes.x.pdff.kpp=120   the same with another gain
  servosim sweep alpha --vary x.kpp=60:140:81    the same with 81 gains
  servosim tune alpha.toml                       better gains: output/alpha-tuned.toml
  servosim analyze alpha.toml                    stability margins, Bode and Nyquist plots
  servosim compare alpha-real                    the effects of the drives one by one
  servosim measure circle alpha-real             circular test
  servosim learn alpha                           learn a correction over repeated runs
  servosim toolpath patch.toml                   tool path and NC program of a part
  servosim run output/patch.nc                   the part that this machine would cut
  servosim plot alpha heart                      lay two runs over each other
  servosim inspect output/alpha.mcap --csv       every sample as CSV
  servosim test scenarios --junit report.xml     check the limits of a folder of scenarios
  servosim new mine && servosim run mine.toml    start your own

Exit codes:
  0  fine
  1  failed while running, or interrupted
  2  wrong usage, or an invalid scenario
  3  a limit was broken, a loop locked up or is unstable, or no gains keep the
     constraints")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a scenario or an NC program
    Run(running::RunArgs),
    /// Search gains with a smaller contouring error that keep stability margin
    Tune(tune::TuneArgs),
    /// Compare variants of a scenario: effects one by one, controllers, sets of gains
    Compare(compare::CompareArgs),
    /// Measure the drives as on a machine: circular test, frequency response, step
    Measure(measure::MeasureArgs),
    /// Learn a correction of the commands over repeated runs
    Learn(learn::LearnArgs),
    /// Run a scenario at many points: a grid, or sampled
    Sweep(sweep::SweepArgs),
    /// Join the shards of a sweep
    Merge(merge::MergeArgs),
    /// Plot recordings, one or several laid over each other
    Plot(plot::PlotArgs),
    /// Run many scenarios and check their limits: a table, JUnit XML for CI
    Test(test::TestArgs),
    /// Show what a recording holds, or export it as CSV
    Inspect(inspect::InspectArgs),
    /// Analyse the servo loops: margins, poles, step response; Bode and Nyquist plots
    Analyze(analyze::AnalyzeArgs),
    /// Check scenarios and parts without running them
    Check(check::CheckArgs),
    /// Write a commented scenario or part to start from
    New(new::NewArgs),
    /// Plan the tool path of a part, write its NC program and check the part as programmed
    Toolpath(toolpath::ToolpathArgs),
    /// Compare the step-over formulas: a table, and their error as a plot
    Stepover(stepover::StepoverArgs),
    /// Print the JSON schema of scenario files or of part files, for editors
    Schema(schema::SchemaArgs),
}

/// Why a command did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CliError {
    /// The scenario cannot be used.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// Scenarios that were told of already cannot be used.
    #[error("{invalid} of {count} scenarios cannot be used")]
    Invalid {
        /// How many cannot.
        invalid: usize,
        /// How many were checked.
        count: usize,
    },
    /// The command line makes no sense.
    #[error("{0}")]
    Usage(String),
    /// No tool path.
    #[error("no tool path: {0}")]
    Plan(#[from] PlanError),
    /// The program could not be written.
    #[error("the program cannot be written: {0}")]
    WriteProgram(#[from] WriteError),
    /// A run failed, or its files.
    #[error(transparent)]
    RunFailed(RunError),
    /// The run did not reach its end.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// One scenario of a suite did not reach its end.
    #[error("{scenario}: {source}")]
    Run {
        /// Which one.
        scenario: String,
        /// Why.
        source: SimulationError,
    },
    /// Scenarios that were told of already failed.
    #[error("{failed} of {count} scenarios failed while running")]
    Failed {
        /// How many did.
        failed: usize,
        /// How many there are.
        count: usize,
    },
    /// The user stopped a suite.
    #[error("interrupted after {done} of {count} scenarios")]
    SuiteInterrupted {
        /// How many were run.
        done: usize,
        /// How many there are.
        count: usize,
    },
    /// The results of a suite could not be put into XML.
    #[error("cannot write the JUnit XML: {0}")]
    Junit(io::Error),
    /// The user stopped it.
    #[error("interrupted at t = {time_s:.3} s; the recording up to there is {}", recording.display())]
    Interrupted {
        /// When in the simulation.
        time_s: f64,
        /// What there is of the recording.
        recording: PathBuf,
    },
    /// The user stopped it.
    #[error("interrupted before {0}")]
    Stopped(&'static str),
    /// The user stopped the learning.
    #[error("interrupted after {runs} runs; the correction of the best one is in {}", file.display())]
    LearningInterrupted {
        /// How many are whole.
        runs: usize,
        /// What was learned.
        file: PathBuf,
    },
    /// A sweep could not be set up, computed or written.
    #[error(transparent)]
    Sweep(SweepError),
    /// Nothing could be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// Nothing could be learned.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// No gains keep the constraints of a tuning.
    #[error("{0}")]
    NothingAllowed(String),
    /// The user stopped a tuning.
    #[error("interrupted after {evaluations} evaluations; the best gains so far are in {}", scenario.display())]
    TuningInterrupted {
        /// How far it was.
        evaluations: usize,
        /// The tuned scenario.
        scenario: PathBuf,
    },
    /// The recording could not be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A recording could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The plots could not be drawn or written.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// A file or folder could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Which one.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Standard output failed.
    #[error("cannot write to standard output: {0}")]
    Stdout(io::Error),
}

impl From<SweepError> for CliError {
    fn from(error: SweepError) -> Self {
        match error {
            SweepError::Scenario(error) => Self::Scenario(error),
            other => Self::Sweep(other),
        }
    }
}

impl From<RunError> for CliError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Simulation(error) => Self::Simulation(error),
            RunError::Recording(error) => Self::Recording(error),
            RunError::Read(error) => Self::Read(error),
            RunError::Report(error) => Self::Report(error),
            other => Self::RunFailed(other),
        }
    }
}

impl CliError {
    /// What to do, where the message of the library does not know the command line.
    fn help(&self) -> Option<&'static str> {
        match self {
            Self::Recording(
                RecordingError::Occupied { .. } | RecordingError::Folder { .. } | RecordingError::Busy { .. },
            ) => Some("--output DIR writes to another folder, --set name=NAME to another name"),
            Self::Read(ReadError::Open { source, .. }) if source.kind() == io::ErrorKind::NotFound => Some(
                "looked for a file of that name, with .mcap behind it, and in the folder output; `servosim run` records one",
            ),
            Self::RunFailed(RunError::NoFolder { .. }) => Some("--output takes a folder; it is made if it is missing"),
            Self::RunFailed(RunError::NoMotion { .. }) => {
                Some("it holds no G00, G01, G02, G03 or NURBS block that leads anywhere")
            }
            _ => None,
        }
    }

    fn exit_code(&self) -> u8 {
        match self {
            Self::RunFailed(error) if error.is_input() => 2,
            Self::Scenario(_)
            | Self::Plan(_)
            | Self::WriteProgram(WriteError::Rounding { .. })
            | Self::Invalid { .. }
            | Self::Usage(_)
            | Self::Measure(MeasureError::Request(_) | MeasureError::TooLong { .. })
            | Self::Learn(LearnError::Request(_) | LearnError::TooLong { .. })
            | Self::Sweep(
                SweepError::Request { .. }
                | SweepError::TooMany { .. }
                | SweepError::Unfit { .. }
                | SweepError::Foreign { .. }
                | SweepError::NothingValid { .. },
            )
            | Self::Report(ReportError::Stem { .. })
            | Self::Read(ReadError::Open { .. } | ReadError::Folder { .. })
            | Self::Recording(RecordingError::Occupied { .. } | RecordingError::Folder { .. }) => 2,
            Self::NothingAllowed(_)
            | Self::Simulation(SimulationError::Diverged { .. })
            | Self::Run { source: SimulationError::Diverged { .. }, .. }
            | Self::Measure(
                MeasureError::Unstable { .. }
                | MeasureError::Diverged { .. }
                | MeasureError::Simulation(SimulationError::Diverged { .. }),
            )
            | Self::Learn(LearnError::Unstable { .. } | LearnError::Simulation(SimulationError::Diverged { .. })) => 3,
            _ => 1,
        }
    }
}

/// What a command found, where it did what it was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All is well.
    Fine,
    /// A limit was broken, or the loop locked up.
    Broken,
}

/// Parses the command line of the process, does what it says, and returns the exit code.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            let error = suggest::subcommand(error);
            // Help and version come this way too; a reader that has gone away is no failure.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    crate::run::prepare_threads();
    let outcome = match &cli.command {
        Command::Run(args) => run::run(args),
        Command::Tune(args) => tune::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Measure(args) => measure::run(args),
        Command::Learn(args) => learn::run(args),
        Command::Sweep(args) => sweep::run(args),
        Command::Merge(args) => merge::run(args),
        Command::Plot(args) => plot::run(args),
        Command::Test(args) => test::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Analyze(args) => analyze::run(args),
        Command::Check(args) => check::run(args),
        Command::New(args) => new::run(args),
        Command::Toolpath(args) => toolpath::run(args),
        Command::Stepover(args) => stepover::run(args),
        Command::Schema(args) => schema::run(args),
    };
    match outcome {
        Ok(Outcome::Fine) => ExitCode::SUCCESS,
        Ok(Outcome::Broken) => ExitCode::from(3),
        Err(error) => {
            tell(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

/// Writes an error to standard error; colour only where a person sees it.
fn tell(error: &CliError) {
    let mut stderr = anstream::stderr().lock();
    let text = match error {
        CliError::Scenario(error) => error.render(true),
        CliError::RunFailed(RunError::Program { source: ProgramError::Read(NcError::Syntax(error)), .. }) => {
            error.render(true)
        }
        other => format!("error: {}\n", output::printable(&other.to_string())),
    };
    // Nobody is left to be told of a failure here.
    let _ = stderr.write_all(text.as_bytes());
    if let Some(help) = error.help() {
        let _ = writeln!(stderr, "help: {help}");
    }
}

/// Whether a person watches standard error.
fn is_watched() -> bool {
    io::stderr().is_terminal()
}
