//! From the file as written to checked values. Every value is checked, so that all problems are reported at once.

use std::ops::Range;

use toml::Spanned;

use super::check_feed::{Planned, axis_limited, of_feedrate, overridden};
use super::diagnostics::{Diagnostic, Problems};
use super::file::{RawAxis, RawControl, RawDerivative, RawExponent, RawFeedrate, RawPlant, RawProfile, RawScenario};
use super::number_table::{NumberTable, out_of_range};
use super::part::Folder;
use super::{FeedProfile, Scenario, check_drive, check_learned, check_path};
use crate::feedrate::{Motion, Profile, optimize_n_c};
use crate::limits::Limits;
use crate::parameters::{OutOfRange, Parameters};
use crate::path::Path;
use crate::servo::{AxisParameters, Derivative, Drive, LoopSettings, Mechanics, Pdff, Plant};
use crate::simulation::SimulationError;

/// Characters that a name may not hold: it becomes the name of files.
const NOT_IN_NAMES: &[char] = &['/', '\\', ':', '*', '?', '"', '<', '>', '|'];

/// Longest name, in characters and in bytes: file systems take 255 bytes, with `-feedrate.svg` and the like behind it.
const MOST_NAME: (usize, usize) = (100, 200);

/// Length of the path that a feedrate is tried on while the real path is not known \[mm\].
const ANY_LENGTH_MM: f64 = 1000.0;

/// The checked scenario, or all its problems. `default_name` is its name where the file gives none.
pub(super) fn scenario(
    raw: &RawScenario,
    default_name: &str,
    source: &str,
    folder: &Folder,
) -> Result<Scenario, Problems> {
    let mut problems = Vec::new();
    let name = name(raw.name.as_ref(), default_name, &mut problems);
    let path = check_path::path(&raw.path).map_err(|mut found| problems.append(&mut found)).ok();
    let length_mm = path.as_ref().map_or(ANY_LENGTH_MM, |path| path.length_mm());
    let feedrate =
        feedrate(&raw.feedrate, length_mm, path.as_deref(), &mut problems).and_then(|(motion, profile, search)| {
            Some((overridden(&raw.feedrate, &motion, profile, path.as_deref(), &mut problems)?, profile, search))
        });
    let settings = control(&raw.control, &mut problems);
    let axes = [("x", &raw.axes.x), ("y", &raw.axes.y)].map(|(name, raw)| axis(name, raw, &mut problems));
    let drives = [("x", &raw.axes.x), ("y", &raw.axes.y)];
    let drives = std::array::from_fn(|i| {
        check_drive::drive((drives[i].0, i as u64), drives[i].1.get_ref(), &axes[i], &settings, &mut problems)
    });
    let coupling = raw.control.cross_coupling.as_ref();
    let cross_coupling = coupling.and_then(|raw| check_drive::cross_coupling(raw, &mut problems));
    let mut limits = limits(&raw.limits, &mut problems);
    let (Some(path), Some((motion, profile, n_c_search)), true) = (path, feedrate, problems.is_empty()) else {
        return Err(problems);
    };
    if let FeedProfile::AxisLimited(axes) = profile {
        limits.axes = Some(axes);
    }
    let mut scenario = Scenario {
        name,
        path,
        feed_mm_s: *raw.feedrate.feed_mm_s.get_ref(),
        motion,
        profile,
        n_c_search,
        axes,
        drives,
        cross_coupling,
        corrections_mm: None,
        settings,
        limits,
        source: source.to_owned(),
    };
    let samples = match scenario.simulation().map(|simulation| simulation.samples()) {
        Ok(samples) => samples,
        Err(error) => return Err(vec![whole(&error, raw, &scenario)]),
    };
    if let Some(raw) = &raw.learned {
        let read = check_learned::corrections(&raw.file, folder, samples, settings.period_s);
        scenario.corrections_mm = Some(read.map_err(|problem| vec![problem])?);
    }
    Ok(scenario)
}

/// A problem of values that are fine one by one.
fn whole(error: &SimulationError, raw: &RawScenario, scenario: &Scenario) -> Diagnostic {
    let feed = raw.feedrate.feed_mm_s.span();
    let problem = Diagnostic::new(error.to_string());
    // A plan that would be short enough without its override.
    let by_override = || {
        let motion = scenario.profile.motion(&*scenario.path, scenario.feed_mm_s).ok()?;
        let plan = Scenario { motion, ..scenario.clone() };
        plan.simulation().ok()?;
        raw.feedrate.feed_override.last()
    };
    match error {
        SimulationError::TooLong { .. } if let Some(last) = by_override() => problem
            .at(last.at_s.span())
            .help("the feed override makes the run so long: end the hold earlier, or raise `percent`"),
        SimulationError::TooLong { .. } => {
            let place = raw.control.period_s.as_ref().map_or(feed, Spanned::span);
            problem.at(place).help("raise `period_s` or `feed_mm_s`, lower `settling_s`, or shorten the path")
        }
        _ => problem.at(feed),
    }
}

pub(super) fn name(raw: Option<&Spanned<String>>, default_name: &str, problems: &mut Problems) -> String {
    let too_long = |name: &str| name.chars().count() > MOST_NAME.0 || name.len() > MOST_NAME.1;
    let Some(raw) = raw else {
        // The name of a file that exists: only what its output files could not be called is refused.
        if too_long(default_name) || default_name.chars().any(char::is_control) {
            problems.push(
                Diagnostic::new(
                    "the file's name cannot be that of the output files: it is too long or has control characters",
                )
                .help("give the scenario a name of its own, at the top of the file or with --set: name = \"short\""),
            );
        }
        return default_name.to_owned();
    };
    let name = raw.get_ref();
    let wrong = if name.trim().is_empty() {
        Some("it is empty")
    } else if too_long(name) {
        Some("it is longer than 100 characters (or 200 bytes)")
    } else if name.chars().any(char::is_control) || name.contains(NOT_IN_NAMES) || name.starts_with('.') {
        Some("it has a character that a file name should not have")
    } else {
        None
    };
    if let Some(wrong) = wrong {
        problems.push(
            Diagnostic::new(format!("the name cannot be used: {wrong}"))
                .at(raw.span())
                .help("the name becomes that of the output files: letters, digits, spaces, - and _ are fine"),
        );
    }
    name.clone()
}

fn feedrate(raw: &RawFeedrate, length_mm: f64, path: Option<&dyn Path<2>>, problems: &mut Problems) -> Option<Planned> {
    let before = problems.len();
    // Each value by itself, beside others that are fine, so that none hides another.
    let mut alone = |span: Range<usize>, feed_mm_s: f64, profile: Profile| {
        if let Err(error) = Motion::plan(ANY_LENGTH_MM, feed_mm_s, profile) {
            problems.push(of_feedrate(&error, span));
        }
    };
    let feed_mm_s = *raw.feed_mm_s.get_ref();
    alone(raw.feed_mm_s.span(), feed_mm_s, Profile::Quintic { phase_s: 0.1 });
    let (phase, exponent) = match &raw.profile {
        RawProfile::Linear(phase) | RawProfile::Cubic(phase) | RawProfile::Quintic(phase) => {
            (Some(&phase.phase_s), None)
        }
        RawProfile::Exponential(raw) => (Some(&raw.phase_s), Some(&raw.n_c)),
        RawProfile::JerkLimited(raw) => {
            let (accel_mm_s2, jerk_mm_s3) = (*raw.accel_mm_s2.get_ref(), *raw.jerk_mm_s3.get_ref());
            alone(raw.accel_mm_s2.span(), 100.0, Profile::JerkLimited { accel_mm_s2, jerk_mm_s3: 1e5 });
            alone(raw.jerk_mm_s3.span(), 100.0, Profile::JerkLimited { accel_mm_s2: 1e3, jerk_mm_s3 });
            (None, None)
        }
        RawProfile::AxisLimited(raw) => {
            return axis_limited(raw, feed_mm_s, path.filter(|_| problems.len() == before), problems);
        }
    };
    if let Some(phase) = phase {
        alone(phase.span(), 100.0, Profile::Quintic { phase_s: *phase.get_ref() });
    }
    if let Some(exponent) = exponent
        && let RawExponent::Given(n_c) = *exponent.get_ref()
    {
        // A feed at which every exponent in range keeps the acceleration's sign.
        alone(exponent.span(), 1e9, Profile::Exponential { phase_s: 0.1, n_c });
    }
    if problems.len() > before {
        return None;
    }

    let mut search = None;
    let profile = match &raw.profile {
        RawProfile::Linear(raw) => Profile::Linear { phase_s: *raw.phase_s.get_ref() },
        RawProfile::Cubic(raw) => Profile::Cubic { phase_s: *raw.phase_s.get_ref() },
        RawProfile::Quintic(raw) => Profile::Quintic { phase_s: *raw.phase_s.get_ref() },
        RawProfile::Exponential(raw) => {
            let phase_s = *raw.phase_s.get_ref();
            let n_c = match *raw.n_c.get_ref() {
                RawExponent::Given(n_c) => n_c,
                RawExponent::Optimize => match optimize_n_c(feed_mm_s, phase_s) {
                    Ok(outcome) => search.insert(outcome).point.first().copied().unwrap_or(f64::NAN),
                    Err(error) => {
                        problems.push(of_feedrate(&error, raw.n_c.span()));
                        return None;
                    }
                },
            };
            Profile::Exponential { phase_s, n_c }
        }
        RawProfile::JerkLimited(raw) => {
            Profile::JerkLimited { accel_mm_s2: *raw.accel_mm_s2.get_ref(), jerk_mm_s3: *raw.jerk_mm_s3.get_ref() }
        }
        RawProfile::AxisLimited(_) => return None,
    };
    let place = exponent.map(Spanned::span).or(phase.map(Spanned::span)).unwrap_or(raw.feed_mm_s.span());
    match Motion::plan(length_mm, feed_mm_s, profile) {
        Err(error) => problems.push(of_feedrate(&error, place)),
        Ok(motion) => return Some((motion, FeedProfile::Phases(profile), search)),
    }
    None
}

pub(super) fn control(raw: &RawControl, problems: &mut Problems) -> LoopSettings {
    let mut settings = LoopSettings::default();
    let delay = raw.delay_samples.as_ref().map(|raw| Spanned::new(raw.span(), *raw.get_ref() as f64));
    for (name, raw) in [("period_s", &raw.period_s), ("settling_s", &raw.settling_s), ("delay_samples", &delay)] {
        let entry = LoopSettings::ENTRIES.iter().find(|entry| entry.parameter.name() == name);
        if let (Some(entry), Some(raw)) = (entry, raw) {
            (entry.set)(&mut settings, *raw.get_ref());
            if let Err(error) = entry.parameter.check(*raw.get_ref()) {
                problems.push(out_of_range("", &error, raw.span(), ""));
            }
        }
    }
    match raw.derivative {
        Some(RawDerivative::Backward) => settings.derivative = Derivative::Backward,
        Some(RawDerivative::Exact) => settings.derivative = Derivative::Exact,
        None => {}
    }
    settings
}

/// An axis whose every parameter is in range, where none is known.
const SOUND: AxisParameters = AxisParameters {
    plant: Plant { gain_rad_s_v: 1.0, time_constant_s: 1.0 },
    drive: Drive { transmission_mm_rad: 1.0, torque_to_voltage_v_nm: 1.0, voltage_limit_v: 1.0 },
    pdff: Pdff { kpp_rad_s_mm: 1.0, kpv_nm_s_rad: 1.0, kiv_1_s: 1.0, kpf_rad_mm: 1.0, kvf: 1.0 },
};

pub(super) fn axis(name: &str, raw: &Spanned<RawAxis>, problems: &mut Problems) -> AxisParameters {
    let (place, raw) = (raw.span(), raw.get_ref());
    let mut axis = AxisParameters { drive: Drive::default(), ..SOUND };
    let before = problems.len();
    let within = format!("axis {name}: ");
    let mut refuse = |error: &OutOfRange, span| problems.push(out_of_range(&within, error, span, ""));
    raw.drive.fill(&mut axis.drive, &mut refuse);
    if let Some(pdff) = &raw.pdff {
        pdff.fill(&mut axis.pdff, &mut refuse);
    }
    match &raw.plant {
        RawPlant::FirstOrder(raw) => {
            raw.fill(&mut axis.plant, &mut refuse);
        }
        RawPlant::Mechanics(raw) => {
            let header = raw.span();
            let mut mechanics = Mechanics { mass_kg: 0.0, inertia_kg_m2: 0.0, viscous_friction_nm_s_rad: 0.0 };
            raw.get_ref().fill(&mut mechanics, &mut refuse);
            if problems.len() == before {
                let Mechanics { mass_kg, inertia_kg_m2, viscous_friction_nm_s_rad } = mechanics;
                axis.plant = Plant::from_mechanics(mass_kg, inertia_kg_m2, viscous_friction_nm_s_rad, &axis.drive);
                if let Err(error) = (AxisParameters { plant: axis.plant, ..SOUND }).check() {
                    problems.push(
                        Diagnostic::new(format!(
                            "{within}the plant that follows from these mechanics is not sound: {error}"
                        ))
                        .at(header)
                        .help("K = 1/(k_T B) and τ = J/B with J = inertia + mass · transmission²: check the units"),
                    );
                }
            }
        }
    }
    match (&raw.pdff, &raw.controller) {
        (Some(_), _) => {}
        (None, Some(controller)) => match check_drive::pdff_of_controller(name, controller, &axis) {
            Ok(pdff) => axis.pdff = pdff,
            Err(problem) => problems.push(problem),
        },
        (None, None) => problems.push(
            Diagnostic::new(format!("`pdff` is missing in [axes.{name}]"))
                .at(place)
                .label("in here")
                .help(format!("add a table [axes.{name}.pdff]  # {}", Pdff::ABOUT)),
        ),
    }
    axis
}

fn limits(raw: &NumberTable<Limits>, problems: &mut Problems) -> Limits {
    let mut limits = Limits::default();
    raw.fill(&mut limits, |error, span| problems.push(out_of_range("limit ", error, span, "")));
    limits
}
