//! `servosim test`: runs many scenarios and holds each to its limits.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Instant;

use crate::limits::LimitCheck;
use crate::report;
use crate::scenario::Document;
use clap::Args;
use rayon::ThreadPoolBuilder;
use serde::Serialize;

use super::interrupt::stop_flag;
use super::output::{PrintArgs, make_folder, margin, note, printable, short, significant};
use super::tested::{Tested, Verdict, held};
use super::{CliError, Outcome, junit, tell};

/// Arguments of `servosim test`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim test scenarios                       every scenario of a folder
  servosim test alpha heart --set feedrate.feed_mm_s=120
  servosim test scenarios --junit report.xml    for a CI server

Nothing is recorded and nothing is plotted. The output does not depend on the number of jobs; JUnit reports also \
hold times. A scenario without limits is run and counts as skipped. Exits with 3 if a limit is broken or a loop locks up, with 2 if a scenario cannot be used (the others run), with 1 if one fails \
while running.")]
pub(crate) struct TestArgs {
    /// Scenario files, names of built-in scenarios, or folders (every *.toml file in them but parts)
    #[arg(required = true, value_name = "FILE_OR_FOLDER")]
    scenarios: Vec<PathBuf>,
    /// Replace one value of every scenario, such as axes.x.pdff.kpp=120 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write the results as JUnit XML
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Number of scenarios that run at a time [default: number of cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    #[command(flatten)]
    print: PrintArgs,
}

/// What `--format json` prints.
#[derive(Debug, Serialize)]
struct Suite<'a> {
    scenarios: &'a [Tested],
    passed: usize,
    skipped: usize,
    broken: usize,
    locked_up: usize,
    unusable: usize,
    failed: usize,
}

/// A scenario to be tested.
struct Job {
    label: String,
    /// In a folder: this very file. Else it is looked for.
    file: Option<PathBuf>,
}

/// Runs all scenarios.
pub(crate) fn run(args: &TestArgs) -> Result<Outcome, CliError> {
    let jobs = jobs(&args.scenarios)?;
    let stop = stop_flag();
    let mut results = in_parallel(&jobs, threads(args), |job| tested(job, &args.set, &stop));

    for result in &mut results {
        if let Some(error) = result.told.take() {
            tell(&error);
        }
    }
    let count = |verdict| results.iter().filter(|result| result.verdict == verdict).count();
    let stopped = count(Verdict::Interrupted);
    if stopped > 0 {
        return Err(CliError::SuiteInterrupted { done: results.len() - stopped, count: results.len() });
    }
    let suite = Suite {
        scenarios: &results,
        passed: count(Verdict::Passed),
        skipped: count(Verdict::Skipped),
        broken: count(Verdict::Broken),
        locked_up: count(Verdict::LockedUp),
        unusable: count(Verdict::Unusable),
        failed: count(Verdict::Failed),
    };
    args.print.show(&suite, || table(&suite))?;
    if let Some(file) = &args.junit {
        if let Some(folder) = file.parent().filter(|folder| *folder != Path::new("")) {
            make_folder(folder)?;
        }
        report::write_file(file, &junit::document(&results)?)?;
    }
    if args.print.has_no_table() {
        for result in results.iter().filter(|result| matches!(result.verdict, Verdict::Broken | Verdict::LockedUp)) {
            let told = broken(result).into_iter().map(|text| format!("{}: {text}", result.scenario));
            note(&told.collect::<Vec<_>>().join("\n"));
        }
    }
    match (suite.failed, suite.unusable, suite.broken + suite.locked_up) {
        (0, 0, 0) => Ok(Outcome::Fine),
        (0, 0, _) => Ok(Outcome::Broken),
        (0, invalid, _) => Err(CliError::Invalid { invalid, count: results.len() }),
        (failed, ..) => Err(CliError::Failed { failed, count: results.len() }),
    }
}

/// What is to be run, each scenario once.
fn jobs(given: &[PathBuf]) -> Result<Vec<Job>, CliError> {
    let mut jobs: Vec<Job> = Vec::new();
    for place in given {
        let found = if place.is_dir() {
            scenarios_in(place)?
                .into_iter()
                .map(|file| Job { label: file.display().to_string(), file: Some(file) })
                .collect()
        } else {
            vec![Job { label: place.display().to_string(), file: None }]
        };
        for job in found {
            if !jobs.iter().any(|other| other.label == job.label) {
                jobs.push(job);
            }
        }
    }
    Ok(jobs)
}

/// Every `*.toml` file of a folder, sorted by name.
fn scenarios_in(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let unreadable = |error| CliError::Usage(format!("cannot read the folder {}: {error}", folder.display()));
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        // Parts are for `servosim toolpath`; what cannot be read is told of later.
        let is_part = || Document::read(&file).is_ok_and(|document| document.is_part());
        if file.extension().is_some_and(|extension| extension == "toml") && !file.is_dir() && !is_part() {
            files.push(file);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(CliError::Usage(format!(
            "there is no scenario in {}: no file ends in .toml\nhelp: `servosim new NAME` writes one to start from",
            folder.display()
        )));
    }
    Ok(files)
}

fn threads(args: &TestArgs) -> usize {
    args.jobs.map_or_else(|| thread::available_parallelism().map_or(1, usize::from), usize::from)
}

/// `work` on every item, at most `threads` at a time; the results in the order of the items.
fn in_parallel<T: Sync, R: Send>(items: &[T], threads: usize, work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(items.len()));
    let worker = || {
        while let Some((i, item)) = Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|i| Some((i, items.get(i)?))) {
            let result = work(item);
            done.lock().unwrap_or_else(PoisonError::into_inner).push((i, result));
        }
    };
    // On threads of rayon's, where each run stays on its own.
    match ThreadPoolBuilder::new().num_threads(threads.min(items.len()).max(1)).build() {
        Ok(pool) => drop(pool.broadcast(|_| worker())),
        Err(_) => worker(),
    }
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(i, _)| *i);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Runs a scenario, and takes its time.
fn tested(job: &Job, set: &[String], stop: &AtomicBool) -> Tested {
    let start = Instant::now();
    let result = judged(job, set, stop);
    Tested { seconds: start.elapsed().as_secs_f64(), ..result }
}

fn judged(job: &Job, set: &[String], stop: &AtomicBool) -> Tested {
    let result = |verdict| Tested {
        scenario: printable(&job.label),
        verdict,
        limits: Vec::new(),
        lockup: None,
        error: None,
        told: None,
        seconds: 0.0,
    };
    if stop.load(Ordering::Relaxed) {
        return result(Verdict::Interrupted);
    }
    let scenario = || {
        let mut document = match &job.file {
            Some(file) => Document::read(file)?,
            None => Document::find(&job.label)?,
        };
        for key_value in set {
            document.set(key_value)?;
        }
        document.scenario()
    };
    let scenario = match scenario() {
        Ok(scenario) => scenario,
        Err(error) => {
            let text = error.problems().iter().map(|problem| problem.message.as_str()).collect::<Vec<_>>().join("; ");
            return Tested { error: Some(printable(&text)), told: Some(error.into()), ..result(Verdict::Unusable) };
        }
    };
    match scenario.run_until(Some(stop), &mut []) {
        Ok(summary) if !summary.complete => result(Verdict::Interrupted),
        Ok(summary) => {
            let verdict = match (summary.locked_up, summary.passed()) {
                (true, _) => Verdict::LockedUp,
                (false, true) if summary.limits.is_empty() => Verdict::Skipped,
                (false, true) => Verdict::Passed,
                (false, false) => Verdict::Broken,
            };
            Tested { limits: summary.limits, lockup: summary.lockup, ..result(verdict) }
        }
        Err(error) => {
            let text = error.to_string();
            let scenario = printable(&job.label);
            let told = CliError::Run { scenario, source: error };
            Tested { error: Some(printable(&text)), told: Some(told), ..result(Verdict::Failed) }
        }
    }
}

/// One text for every limit that is broken, and for a lock-up.
fn broken(result: &Tested) -> Vec<String> {
    let limits = result
        .limits
        .iter()
        .filter(|check| !check.kept)
        .map(|check| format!("limit {} broken: {}", check.name, held(check)));
    limits.chain(result.lockup.clone()).collect()
}

fn table(suite: &Suite<'_>) -> String {
    let header = ["scenario", "limit", "", "value", "limit", "margin"].map(str::to_owned);
    let mut rows = vec![header];
    for result in suite.scenarios {
        // The name stands in the first row of a scenario only.
        let mut name = result.scenario.clone();
        let mut row = |cells: [String; 5]| {
            let [a, b, c, d, e] = cells;
            rows.push([std::mem::take(&mut name), a, b, c, d, e]);
        };
        let told = |text: &str| [text.to_owned(), String::new(), String::new(), String::new(), String::new()];
        for LimitCheck { name, value, limit, kept } in &result.limits {
            let verdict = if *kept { "kept" } else { "BROKEN" }.to_owned();
            row([name.clone(), verdict, significant(*value, 5), short(*limit, 5), margin(*value, *limit)]);
        }
        match result.verdict {
            Verdict::Unusable => row(told("CANNOT BE USED")),
            Verdict::Failed => row(told("FAILED")),
            Verdict::Skipped => row(told("skipped: no limits")),
            _ => {}
        }
        if let Some(lockup) = &result.lockup {
            row(told(&lockup.replacen("locked up", "LOCKED UP", 1)));
        }
    }
    // A row that is one remark makes no column wider.
    let is_remark = |row: &[String; 6]| row[2].is_empty() && row[3].is_empty();
    let width = |column: usize| {
        let cells = rows.iter().filter(|row| column == 0 || !is_remark(row)).map(|row| row[column].chars().count());
        cells.max().unwrap_or(0)
    };
    let widths: [usize; 6] = std::array::from_fn(width);
    let mut out = String::new();
    for row in &rows {
        let mut line = String::new();
        for (i, (cell, width)) in row.iter().zip(widths).enumerate() {
            let _ = match i {
                3 | 4 => write!(line, "{cell:>width$}  "),
                _ => write!(line, "{cell:<width$}  "),
            };
        }
        out.push_str(line.trim_end());
        out.push('\n');
    }
    let _ = writeln!(out, "\n{}", total(suite));
    out
}

/// "3 scenarios: 2 passed, 1 broke a limit"
fn total(suite: &Suite<'_>) -> String {
    let count = suite.scenarios.len();
    let parts = [
        (suite.passed, "passed"),
        (suite.skipped, "skipped, without limits"),
        (suite.broken, if suite.broken == 1 { "broke a limit" } else { "broke limits" }),
        (suite.locked_up, "locked up"),
        (suite.unusable, "cannot be used"),
        (suite.failed, "failed"),
    ];
    let told = parts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}"));
    let told = told.collect::<Vec<_>>().join(", ");
    format!("{count} scenario{}: {told}", if count == 1 { "" } else { "s" })
}
