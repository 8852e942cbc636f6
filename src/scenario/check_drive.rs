//! An axis beyond its model: from the file as written to checked values.

use std::ops::Range;

use toml::Spanned;

use super::diagnostics::Diagnostic;
use super::diagnostics::Problems;
use super::drive_file::{
    RawCompensation, RawController, RawEffects, RawForce, RawFriction, RawPitch, RawPlace, RawVelocity,
};
use super::file::RawAxis;
use super::number_table::{NumberTable, out_of_range};
use super::numbers::RawPoint;
use crate::parameters::{OutOfRange, Parameters};
use crate::servo::compensation::{
    AccelerationFeedforward, BacklashCompensation, Compensation, CrossCouplingGains, Filter, FrictionFeedforward,
    LowPass, Notch,
};
use crate::servo::effects::{
    Backlash, Coulomb, CurrentLoop, CuttingForce, Dac, Delay, Effects, Encoder, EncoderPlace, Friction, Harmonic,
    Integration, LookupTable, LuGre, Mismatch, Noise, PitchError, TorqueRipple, TwoMass, VelocityEstimate,
};
use crate::servo::{AxisParameters, ControllerGains, ControllerKind, DriveModel, LoopSettings, Pdff};

/// A value of a table: what an error of the servo calls it, its key, and where it stands.
struct Value {
    name: &'static str,
    key: &'static str,
    span: Range<usize>,
    /// What it may be here, in numbers.
    bound: Option<String>,
}

/// Values of a table with their places: what an error of the servo is about.
struct Places<'p> {
    within: String,
    table: Range<usize>,
    values: Vec<Value>,
    /// What to do about those whose parameter does not say it.
    help: &'static str,
    /// Whether every value so far is in its range.
    sound: bool,
    problems: &'p mut Problems,
}

/// What to do about a value of most tables.
const UNITS: &str = "units are in the key's name; remove the table to switch this off";

impl Places<'_> {
    /// Notes the place of a value that errors call by `name`, and the file by `key`.
    fn note(&mut self, name: &'static str, key: &'static str, span: Range<usize>) {
        self.values.push(Value { name, key, span, bound: None });
    }

    /// Notes what a value may be here.
    fn bound(&mut self, name: &str, bound: impl FnOnce() -> String) {
        if let Some(value) = self.values.iter_mut().find(|value| value.name == name) {
            value.bound = Some(bound());
        }
    }

    /// A value in the range of its parameter, its place noted; told where it is not in range.
    fn get<T: Parameters>(&mut self, name: &'static str, raw: &Spanned<f64>) -> f64 {
        self.note(name, name, raw.span());
        let value = *raw.get_ref();
        if let Some(Err(error)) = T::parameter(name).map(|parameter| parameter.check(value)) {
            self.problems.push(out_of_range(&self.within, &error, raw.span(), self.help));
            self.sound = false;
        }
        value
    }

    /// The values of a table over those of `value`, their places noted.
    fn fill<T: Parameters>(&mut self, raw: &NumberTable<T>, value: &mut T) {
        for (entry, given) in &raw.given {
            self.note(entry.parameter.name(), entry.parameter.name(), given.span());
        }
        let Self { within, help, problems, .. } = self;
        self.sound &= raw.fill(value, |error, span| problems.push(out_of_range(within, error, span, help)));
    }

    /// Static friction that is not given is the Coulomb friction, and told of where that stands.
    fn static_friction(&mut self, coulomb: Option<Range<usize>>, curve: &mut Coulomb) {
        if curve.static_nm.is_nan() && !self.values.iter().any(|value| value.name == "static_nm") {
            curve.static_nm = curve.coulomb_nm;
            self.values.extend(coulomb.map(|span| Value { name: "static_nm", key: "coulomb_nm", span, bound: None }));
        }
    }

    /// Tells an error where the value is that it names, by its key, or on the whole table.
    fn tell(&mut self, error: &OutOfRange) {
        let problem = match self.values.iter().find(|value| error.name() == value.name) {
            Some(Value { key, span, bound, .. }) => {
                let message = format!("{}{}", self.within, error.message(key));
                let problem = Diagnostic::new(message).at(span.clone());
                bound.iter().fold(problem, |problem, bound| problem.note(bound.clone()))
            }
            None => Diagnostic::new(format!("{}{}", self.within, error.message(error.name()))).at(self.table.clone()),
        };
        self.problems.push(problem.help(if error.help.is_empty() { self.help } else { error.help }));
    }

    /// A key that has no part in what is chosen.
    fn idle<T>(&mut self, key: &str, raw: Option<&Spanned<T>>, with: &str) {
        if let Some(raw) = raw {
            self.problems.push(
                Diagnostic::new(format!("{}`{key}` does nothing with {with}", self.within))
                    .at(raw.span())
                    .help("remove the line, or choose what it belongs to"),
            );
        }
    }

    /// What ties the values together; not asked where one of them is out of its range.
    fn check<T>(mut self, value: T, check: impl FnOnce(&T) -> Result<(), OutOfRange>) -> Option<T> {
        if !self.sound {
            return None;
        }
        match check(&value) {
            Ok(()) => Some(value),
            Err(error) => {
                self.tell(&error);
                None
            }
        }
    }
}

/// A frequency for a message, rounded down so that it may be typed.
fn hz(frequency_hz: f64) -> String {
    let digits = if frequency_hz >= 100.0 { 10.0 } else { 1000.0 };
    format!("{} Hz", (frequency_hz * digits).floor() / digits)
}

/// Checks one axis beyond its model. `index` keeps the noise of the axes apart.
pub(super) fn drive(
    (name, index): (&str, u64),
    raw: &RawAxis,
    axis: &AxisParameters,
    settings: &LoopSettings,
    problems: &mut Problems,
) -> DriveModel {
    let sound = axis.check().is_ok() && settings.check().is_ok();
    let controller = raw.controller.as_ref().map(|raw| controller(name, raw, axis, settings, sound, problems));
    let effects = effects((name, index), &raw.effects, axis, settings, sound, problems);
    let compensation = compensation(name, &raw.compensation, settings, problems);
    let drive = DriveModel {
        controller: controller.unwrap_or_default(),
        effects,
        compensation,
        zero_phase: raw.compensation.zero_phase.as_ref().is_some_and(|raw| *raw.get_ref()),
    };
    if let Some(zero_phase) = &raw.compensation.zero_phase
        && drive.zero_phase
    {
        if drive.controller != ControllerGains::Pdff {
            problems.push(
                Diagnostic::new(format!("axis {name}: zero-phase tracking undoes the PDFF loop, and this is another"))
                    .at(zero_phase.span())
                    .help(format!("remove `zero_phase` or `[axes.{name}.controller]`")),
            );
        } else if sound && let Err(error) = drive.axis(axis, settings, 0.0) {
            problems.push(Diagnostic::new(format!("axis {name}: {error}")).at(zero_phase.span()));
        }
    }
    drive
}

fn kind(raw: &RawController) -> ControllerKind {
    match raw {
        RawController::PPi(_) => ControllerKind::PPi,
        RawController::Pid(_) => ControllerKind::Pid,
        RawController::Cascade(_) => ControllerKind::Cascade,
    }
}

fn controller(
    name: &str,
    raw: &Spanned<RawController>,
    axis: &AxisParameters,
    settings: &LoopSettings,
    sound: bool,
    problems: &mut Problems,
) -> ControllerGains {
    let mut at = places(&format!("axis {name}: "), raw, problems);
    // Gains that are not given are those of the same loops.
    let gains = given_gains(raw.get_ref(), ControllerGains::like(kind(raw.get_ref()), axis, settings), &mut at);
    at.sound &= sound;
    at.bound("filter_hz", || format!("here at most {}", hz(0.5 / settings.period_s)));
    let checked = at.check(gains, |gains| match gains {
        ControllerGains::Pdff => Ok(()),
        ControllerGains::PPi(gains) => gains.check(),
        ControllerGains::Pid(gains) => gains.check(settings.period_s),
        ControllerGains::Cascade(gains) => gains.check(),
    });
    checked.unwrap_or_default()
}

/// The gains of a file over others of the same kind.
fn given_gains(raw: &RawController, mut gains: ControllerGains, at: &mut Places<'_>) -> ControllerGains {
    match (raw, &mut gains) {
        (RawController::PPi(raw), ControllerGains::PPi(gains)) => at.fill(raw, gains),
        (RawController::Pid(raw), ControllerGains::Pid(gains)) => at.fill(raw, gains),
        (RawController::Cascade(raw), ControllerGains::Cascade(gains)) => at.fill(raw, gains),
        _ => {}
    }
    gains
}

/// The gains of the PDFF controller with the loops of another controller, for an axis that gives no PDFF gains of its own: the other
/// controller has to be complete.
pub(super) fn pdff_of_controller(
    name: &str,
    raw: &Spanned<RawController>,
    axis: &AxisParameters,
) -> Result<Pdff, Diagnostic> {
    const UNKNOWN: Pdff =
        Pdff { kpp_rad_s_mm: f64::NAN, kpv_nm_s_rad: f64::NAN, kiv_1_s: f64::NAN, kpf_rad_mm: f64::NAN, kvf: f64::NAN };
    let (axis, settings) = (AxisParameters { pdff: UNKNOWN, ..*axis }, LoopSettings::default());
    let kind = kind(raw.get_ref());
    // (What is wrong with the values given is told when the controller is read.)
    let mut unheard = Problems::new();
    let mut at = places("", raw, &mut unheard);
    let gains = given_gains(raw.get_ref(), ControllerGains::like(kind, &axis, &settings), &mut at);
    let missing = match &gains {
        ControllerGains::Pdff => Vec::new(),
        ControllerGains::PPi(gains) => unknown(gains),
        ControllerGains::Pid(gains) => unknown(gains),
        ControllerGains::Cascade(gains) => unknown(gains),
    };
    if missing.is_empty() {
        return Ok(gains.like_pdff(&axis));
    }
    let missing: Vec<String> = missing.iter().map(|name| format!("`{name}`")).collect();
    let table = kind.name().replace('-', "_");
    Err(Diagnostic::new(format!(
        "axis {name}: {} of the controller {} not given, and there is no `pdff` to take them from",
        missing.join(", "),
        if missing.len() == 1 { "is" } else { "are" }
    ))
    .at(raw.span())
    .help(format!("give every gain in [axes.{name}.controller.{table}], or add a table [axes.{name}.pdff]")))
}

/// Names of the values that are not numbers.
fn unknown<T: Parameters>(gains: &T) -> Vec<&'static str> {
    let is_unknown = |value: Option<f64>| value.is_some_and(f64::is_nan);
    T::ENTRIES.iter().filter(|entry| is_unknown((entry.get)(gains))).map(|entry| entry.parameter.name()).collect()
}

fn effects(
    (name, index): (&str, u64),
    raw: &RawEffects,
    axis: &AxisParameters,
    settings: &LoopSettings,
    sound: bool,
    problems: &mut Problems,
) -> Effects {
    let within = format!("axis {name}: ");
    let mut out = Effects::default();
    electronics(&within, index, raw, settings, &mut out, problems);
    mechanics(&within, raw, axis, settings, sound, &mut out, problems);
    disturbances(&within, raw, &mut out, problems);
    if let Some(raw) = &raw.integration {
        out.integration =
            numbers(&within, raw, Integration::default(), problems, Integration::check).unwrap_or_default();
    }
    out
}

/// What reads and drives the axis, and what its plant is.
fn electronics(
    within: &str,
    index: u64,
    raw: &RawEffects,
    settings: &LoopSettings,
    out: &mut Effects,
    problems: &mut Problems,
) {
    if let Some(raw) = &raw.mismatch {
        let model = Mismatch { gain_factor: 1.0, time_constant_factor: 1.0 };
        out.mismatch = numbers(within, raw, model, problems, Mismatch::check);
    }
    if let Some(raw) = &raw.encoder {
        let mut at = places(within, raw, problems);
        let raw = raw.get_ref();
        let period_s = settings.period_s;
        let damping = raw.velocity_damping.as_ref().map_or(1.0, |raw| at.get::<Encoder>("velocity_damping", raw));
        let highest = VelocityEstimate::observer_below_hz(damping, period_s);
        let (chosen, default) = match raw.velocity {
            Some(RawVelocity::Observer) => ("observer", f64::min(200.0, 0.5 * highest)),
            Some(RawVelocity::LowPass) => ("low_pass", f64::min(200.0, 0.2 / period_s)),
            Some(RawVelocity::Difference) => ("difference", 200.0),
            Some(RawVelocity::Tachometer) | None => ("tachometer", 200.0),
        };
        let with = format!("velocity = \"{chosen}\"");
        if chosen != "observer" {
            at.idle("velocity_damping", raw.velocity_damping.as_ref(), &with);
        }
        if chosen != "observer" && chosen != "low_pass" {
            at.idle("velocity_hz", raw.velocity_hz.as_ref(), &with);
        }
        let frequency_hz = raw.velocity_hz.as_ref().map_or(default, |raw| at.get::<Encoder>("velocity_hz", raw));
        match raw.velocity {
            Some(RawVelocity::Observer) => {
                at.bound("velocity_hz", || format!("with this damping and period_s: below {}", hz(highest)));
            }
            _ => at.bound("velocity_hz", || format!("here at most {}", hz(0.5 / period_s))),
        }
        let encoder = Encoder {
            place: match raw.place {
                Some(RawPlace::Table) => EncoderPlace::Table,
                Some(RawPlace::Motor) | None => EncoderPlace::Motor,
            },
            resolution_um: raw.resolution_um.as_ref().map_or(0.0, |raw| at.get::<Encoder>("resolution_um", raw)),
            velocity: match raw.velocity {
                Some(RawVelocity::Tachometer) | None => VelocityEstimate::Tachometer,
                Some(RawVelocity::Difference) => VelocityEstimate::Difference,
                Some(RawVelocity::LowPass) => VelocityEstimate::LowPass { corner_hz: frequency_hz },
                Some(RawVelocity::Observer) => VelocityEstimate::Observer { bandwidth_hz: frequency_hz, damping },
            },
        };
        out.encoder = at.check(encoder, |encoder| encoder.check(period_s));
    }
    if let Some(raw) = &raw.noise {
        let mut at = places(within, raw, problems);
        let raw = raw.get_ref();
        let seed = Noise::seed_of_axis(raw.seed.unwrap_or(1), index);
        let noise = Noise { rms_um: at.get::<Noise>("rms_um", &raw.rms_um), seed };
        out.noise = at.check(noise, Noise::check);
    }
    if let Some(raw) = &raw.delay {
        out.delay = numbers(within, raw, Delay { samples: 0.0 }, problems, Delay::check);
    }
    if let Some(raw) = &raw.dac {
        out.dac = numbers(within, raw, Dac { bits: 0 }, problems, Dac::check);
    }
    if let Some(raw) = &raw.current_loop {
        out.current_loop = numbers(within, raw, CurrentLoop { bandwidth_hz: 0.0 }, problems, CurrentLoop::check);
    }
}

/// What moves.
fn mechanics(
    within: &str,
    raw: &RawEffects,
    axis: &AxisParameters,
    settings: &LoopSettings,
    sound: bool,
    out: &mut Effects,
    problems: &mut Problems,
) {
    let drive = &axis.drive;
    if let Some(raw) = &raw.two_mass {
        // Against what the plant is, where that is known.
        let plant = out.plant(&axis.plant);
        let blank = TwoMass { table_mass_kg: 0.0, stiffness_n_um: 0.0, damping_n_s_mm: 0.0 };
        let check = |two_mass: &TwoMass| if sound { two_mass.check(&plant, drive, settings.period_s) } else { Ok(()) };
        out.two_mass = numbers(within, raw, blank, problems, check).filter(|_| sound);
    }
    if let Some(raw) = &raw.friction {
        let mut at = places(within, raw, problems);
        let mut curve = Coulomb { coulomb_nm: 0.0, static_nm: f64::NAN, stribeck_mm_s: 0.0, viscous_nm_s_rad: 0.0 };
        let friction = match raw.get_ref() {
            RawFriction::Coulomb(raw) => {
                at.fill(raw, &mut curve);
                at.static_friction(raw.span("coulomb_nm"), &mut curve);
                Friction::Coulomb(curve)
            }
            RawFriction::LuGre(raw) => {
                let mut lu_gre = LuGre { curve, stiffness_nm_rad: 0.0, damping_nm_s_rad: 0.0 };
                at.fill(raw, &mut lu_gre);
                at.static_friction(raw.span("coulomb_nm"), &mut lu_gre.curve);
                Friction::LuGre(lu_gre)
            }
        };
        let most_nm = drive.voltage_limit_v / drive.torque_to_voltage_v_nm;
        at.bound("static_nm", || {
            format!("at its voltage limit the drive gives voltage_limit_v / torque_to_voltage_v_nm = {most_nm:.4} N m")
        });
        let rubbing_kg_m2 = out.rubbing_kg_m2(&axis.plant, drive);
        out.friction = at.check(friction, |friction| friction.check(rubbing_kg_m2, drive));
    }
    if let Some(raw) = &raw.backlash {
        out.backlash = numbers(within, raw, Backlash { gap_um: 0.0 }, problems, Backlash::check);
    }
    out.pitch = raw.pitch.as_ref().and_then(|raw| pitch(within, raw, problems));
}

/// What pushes the axis about.
fn disturbances(within: &str, raw: &RawEffects, out: &mut Effects, problems: &mut Problems) {
    if let Some(raw) = &raw.ripple {
        let mut at = places(within, raw, problems);
        at.note("harmonics", "number of harmonics", raw.get_ref().harmonics.span());
        let harmonics = raw.get_ref().harmonics.get_ref().iter();
        let ripple = TorqueRipple {
            harmonics: harmonics
                .map(|raw| Harmonic {
                    per_revolution: u32::try_from(*raw.per_revolution.get_ref()).unwrap_or(0),
                    amplitude_nm: *raw.amplitude_nm.get_ref(),
                    phase_rad: raw.phase_deg.as_ref().map_or(0.0, |deg| deg.get_ref().to_radians()),
                })
                .collect(),
        };
        // The first harmonic that is wrong.
        let all = raw.get_ref().harmonics.get_ref();
        let wrong = all
            .iter()
            .zip(&ripple.harmonics)
            .find(|(_, harmonic)| TorqueRipple { harmonics: vec![**harmonic] }.check().is_err());
        if let Some((raw, _)) = wrong {
            at.note("per_revolution", "per_revolution", raw.per_revolution.span());
            at.note("amplitude_nm", "amplitude_nm", raw.amplitude_nm.span());
            if let Some(deg) = &raw.phase_deg {
                at.note("phase_rad", "phase_deg in rad", deg.span());
            }
        }
        out.ripple = at.check(ripple, TorqueRipple::check);
    }
    if let Some(raw) = &raw.force {
        let (points, over_time) = match raw.get_ref() {
            RawForce::OverTime(raw) => {
                let (keys, units) = (["points_s_n", "period_s"], ["s", "N"]);
                (RawTable { points: &raw.points_s_n, period: raw.period_s.as_ref(), keys, units }, true)
            }
            RawForce::OverPosition(raw) => {
                let (keys, units) = (["points_mm_n", "period_mm"], ["mm", "N"]);
                (RawTable { points: &raw.points_mm_n, period: raw.period_mm.as_ref(), keys, units }, false)
            }
        };
        if let Some((table, at)) = table(within, raw.span(), &points, problems) {
            let force = if over_time { CuttingForce::OverTime(table) } else { CuttingForce::OverPosition(table) };
            out.force = at.check(force, CuttingForce::check);
        }
    }
}

/// A table of numbers, over what `value` holds where none is given.
fn numbers<T: Parameters>(
    within: &str,
    raw: &Spanned<NumberTable<T>>,
    mut value: T,
    problems: &mut Problems,
    check: impl FnOnce(&T) -> Result<(), OutOfRange>,
) -> Option<T> {
    let mut at = places(within, raw, problems);
    at.fill(raw.get_ref(), &mut value);
    at.check(value, check)
}

fn places<'p, T>(within: &str, raw: &Spanned<T>, problems: &'p mut Problems) -> Places<'p> {
    Places { within: within.to_owned(), table: raw.span(), values: Vec::new(), help: UNITS, sound: true, problems }
}

/// A function by points, as it stands in a file.
struct RawTable<'r> {
    points: &'r Spanned<Vec<RawPoint>>,
    period: Option<&'r Spanned<f64>>,
    /// Keys of the two.
    keys: [&'static str; 2],
    /// What the first and the second number of a point are.
    units: [&'static str; 2],
}

impl RawTable<'_> {
    /// What is wrong with its points, row by row; what is wrong with the function is for [`LookupTable::new`].
    fn problem(&self) -> Option<Diagnostic> {
        let ([key, _], [x, y]) = (self.keys, self.units);
        let rows = self.points.get_ref();
        if rows.is_empty() {
            let problem =
                Diagnostic::new(format!("`{key}` is empty: it takes at least 1 point")).at(self.points.span());
            return Some(problem.help(format!("write points [{x}, {y}], such as [[0, 0], [10, 2]]")));
        }
        let values = || rows.iter().map(|row| row.get_ref().0);
        if let Some((row, [a, b])) = rows.iter().zip(values()).find(|(_, v)| v.iter().any(|v| !(v.abs() <= 1e9))) {
            let wrong = if a.abs() <= 1e9 { b } else { a };
            let problem = Diagnostic::new(format!("`{key}` holds {wrong}: it takes finite numbers, at most 1e9"));
            return Some(problem.at(row.span()).help(format!("a point is [{x}, {y}]")));
        }
        let mut pairs = rows.iter().skip(1).zip(values().zip(values().skip(1))).zip(2..);
        pairs.find(|((_, ([before, _], [at, _])), _)| at <= before).map(|((row, ([before, _], [at, _])), number)| {
            Diagnostic::new(format!(
                "`{key}`: point {number} is at {at} {x}, the one before it at {before}: places must rise strictly"
            ))
            .at(row.span())
            .help("order the points by their first number, each only once")
        })
    }
}

fn table<'p>(
    within: &str,
    span: Range<usize>,
    raw: &RawTable<'_>,
    problems: &'p mut Problems,
) -> Option<(LookupTable, Places<'p>)> {
    if let Some(mut problem) = raw.problem() {
        problem.message.insert_str(0, within);
        problems.push(problem);
        return None;
    }
    let values = raw.points.get_ref().iter().map(|point| point.get_ref().0);
    let mut at =
        Places { within: within.to_owned(), table: span, values: Vec::new(), help: UNITS, sound: true, problems };
    let [key, period_key] = raw.keys;
    if let Some(period) = raw.period {
        at.note("period", period_key, period.span());
    }
    at.note("error_um", key, raw.points.span());
    at.note("force_n", key, raw.points.span());
    match LookupTable::new(values.map(|[x, y]| (x, y)), raw.period.map(|period| *period.get_ref())) {
        Ok(table) => Some((table, at)),
        Err(error) => {
            at.tell(&error);
            None
        }
    }
}

fn pitch(within: &str, raw: &Spanned<RawPitch>, problems: &mut Problems) -> Option<PitchError> {
    let RawPitch { points_mm_um, period_mm } = raw.get_ref();
    let keys = ["points_mm_um", "period_mm"];
    let points = RawTable { points: points_mm_um, period: period_mm.as_ref(), keys, units: ["mm", "µm"] };
    let (error_um, at) = table(within, raw.span(), &points, problems)?;
    at.check(PitchError { error_um }, PitchError::check)
}

fn compensation(name: &str, raw: &RawCompensation, settings: &LoopSettings, problems: &mut Problems) -> Compensation {
    let within = format!("axis {name}: ");
    let mut out = Compensation::default();
    let period_s = settings.period_s;
    if let Some(raw) = &raw.notch {
        let mut notch = Notch { frequency_hz: 0.0, depth: 0.0, damping: 0.0 };
        let mut at = places(&within, raw, problems);
        at.fill(raw.get_ref(), &mut notch);
        at.bound("frequency_hz", || format!("here below {}", hz(Filter::HIGHEST / period_s)));
        out.filters.extend(at.check(Filter::Notch(notch), |filter| filter.check(period_s)));
    }
    if let Some(raw) = &raw.low_pass {
        let mut low_pass = LowPass { frequency_hz: 0.0, damping: 0.0 };
        let mut at = places(&within, raw, problems);
        at.fill(raw.get_ref(), &mut low_pass);
        at.bound("frequency_hz", || format!("here below {}", hz(Filter::HIGHEST / period_s)));
        out.filters.extend(at.check(Filter::LowPass(low_pass), |filter| filter.check(period_s)));
    }
    if let Some(raw) = &raw.acceleration {
        let blank = AccelerationFeedforward { share: 0.0 };
        out.acceleration = numbers(&within, raw, blank, problems, AccelerationFeedforward::check);
    }
    if let Some(raw) = &raw.friction {
        let blank = FrictionFeedforward { coulomb_nm: 0.0, smoothing_mm_s: 0.0 };
        out.friction = numbers(&within, raw, blank, problems, FrictionFeedforward::check);
    }
    if let Some(raw) = &raw.backlash {
        let blank = BacklashCompensation { gap_um: 0.0, time_constant_s: 0.0 };
        out.backlash = numbers(&within, raw, blank, problems, BacklashCompensation::check);
    }
    out.pitch = raw.pitch.as_ref().and_then(|raw| pitch(&within, raw, problems));
    out
}

/// The cross-coupled controller of the whole machine.
pub(super) fn cross_coupling(
    raw: &Spanned<NumberTable<CrossCouplingGains>>,
    problems: &mut Problems,
) -> Option<CrossCouplingGains> {
    let blank = CrossCouplingGains { proportional: 0.0, integral_1_s: 0.0, derivative_s: 0.0, limit_um: 0.0 };
    numbers("", raw, blank, problems, CrossCouplingGains::check)
}
