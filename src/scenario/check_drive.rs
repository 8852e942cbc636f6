//! An axis beyond its model: from the file as written to checked values.

use crate::parameters::OutOfRange;
use std::ops::Range;

use toml::Spanned;

use super::check::Problems;
use super::diagnostics::Diagnostic;
use super::drive_file::{
    RawCompensation, RawController, RawCrossCoupling, RawEffects, RawForce, RawFriction, RawIntegration, RawPitch,
    RawPlace, RawVelocity,
};
use super::file::RawAxis;
use super::numbers::RawPoint;
use crate::servo::compensation::{
    AccelerationFeedforward, BacklashCompensation, Compensation, CrossCouplingGains, Filter, FrictionFeedforward,
};
use crate::servo::controller::{CascadeGains, PPiGains, PidGains};
use crate::servo::effects::{
    Backlash, Coulomb, CurrentLoop, CuttingForce, Dac, Delay, Effects, Encoder, EncoderPlace, Friction, Harmonic,
    Integration, LookupTable, LuGre, Mismatch, Noise, PitchError, TorqueRipple, TwoMass, VelocityEstimate,
};
use crate::servo::{AxisParameters, ControllerGains, ControllerKind, DriveModel, LoopSettings};

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
    /// What to do about any of them.
    help: &'static str,
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

    /// A value, its place noted.
    fn get(&mut self, name: &'static str, raw: &Spanned<f64>) -> f64 {
        self.note(name, name, raw.span());
        *raw.get_ref()
    }

    fn or(&mut self, name: &'static str, raw: Option<&Spanned<f64>>, default: f64) -> f64 {
        raw.map_or(default, |raw| self.get(name, raw))
    }

    /// Tells an error where the value is that it names, by its key, or on the whole table.
    fn tell(&mut self, error: &OutOfRange) {
        let name = error.key;
        let problem = match self.values.iter().find(|value| name.contains(value.name)) {
            Some(Value { key, span, bound, .. }) => {
                let message = format!("{}{}", self.within, error.message(key));
                let problem = Diagnostic::new(message).at(span.clone());
                bound.iter().fold(problem, |problem, bound| problem.note(bound.clone()))
            }
            None => Diagnostic::new(format!("{}{error}", self.within)).at(self.table.clone()),
        };
        self.problems.push(problem.help(self.help));
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

    fn check<T>(mut self, value: T, check: impl FnOnce(&T) -> Result<(), OutOfRange>) -> Option<T> {
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
    let controller = raw.controller.as_ref().map(|raw| controller(name, raw, axis, settings, problems));
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

fn controller(
    name: &str,
    raw: &Spanned<RawController>,
    axis: &AxisParameters,
    settings: &LoopSettings,
    problems: &mut Problems,
) -> ControllerGains {
    let within = format!("axis {name}: ");
    let mut at = Places { within, table: raw.span(), values: Vec::new(), help: UNITS, problems };
    let kind = match raw.get_ref() {
        RawController::PPi(_) => ControllerKind::PPi,
        RawController::Pid(_) => ControllerKind::Pid,
        RawController::Cascade(_) => ControllerKind::Cascade,
    };
    let gains = match (raw.get_ref(), ControllerGains::like(kind, axis, settings)) {
        (RawController::PPi(raw), ControllerGains::PPi(own)) => ControllerGains::PPi(PPiGains {
            position_rad_s_mm: at.or("position_rad_s_mm", raw.position_rad_s_mm.as_ref(), own.position_rad_s_mm),
            velocity_nm_s_rad: at.or("velocity_nm_s_rad", raw.velocity_nm_s_rad.as_ref(), own.velocity_nm_s_rad),
            integral_1_s: at.or("integral_1_s", raw.integral_1_s.as_ref(), own.integral_1_s),
        }),
        (RawController::Pid(raw), ControllerGains::Pid(own)) => ControllerGains::Pid(PidGains {
            proportional_v_mm: at.or("proportional_v_mm", raw.proportional_v_mm.as_ref(), own.proportional_v_mm),
            integral_v_mm_s: at.or("integral_v_mm_s", raw.integral_v_mm_s.as_ref(), own.integral_v_mm_s),
            derivative_v_s_mm: at.or("derivative_v_s_mm", raw.derivative_v_s_mm.as_ref(), own.derivative_v_s_mm),
            filter_hz: at.or("filter_hz", raw.filter_hz.as_ref(), own.filter_hz),
        }),
        (RawController::Cascade(raw), ControllerGains::Cascade(own)) => ControllerGains::Cascade(CascadeGains {
            loops: PPiGains {
                position_rad_s_mm: at.or(
                    "position_rad_s_mm",
                    raw.position_rad_s_mm.as_ref(),
                    own.loops.position_rad_s_mm,
                ),
                velocity_nm_s_rad: at.or(
                    "velocity_nm_s_rad",
                    raw.velocity_nm_s_rad.as_ref(),
                    own.loops.velocity_nm_s_rad,
                ),
                integral_1_s: at.or("integral_1_s", raw.integral_1_s.as_ref(), own.loops.integral_1_s),
            },
            velocity_rad_mm: at.or("velocity_rad_mm", raw.velocity_rad_mm.as_ref(), own.velocity_rad_mm),
            viscous_nm_s_mm: at.or("viscous_nm_s_mm", raw.viscous_nm_s_mm.as_ref(), own.viscous_nm_s_mm),
            acceleration_nm_s2_mm: at.or(
                "acceleration_nm_s2_mm",
                raw.acceleration_nm_s2_mm.as_ref(),
                own.acceleration_nm_s2_mm,
            ),
        }),
        // `like` gives the kind that it is asked for.
        (_, own) => own,
    };
    at.bound("filter_hz", || format!("here at most {}", hz(0.5 / settings.period_s)));
    let checked = at.check(gains, |gains| match gains {
        ControllerGains::Pdff => Ok(()),
        ControllerGains::PPi(gains) => gains.check(),
        ControllerGains::Pid(gains) => gains.check(settings.period_s),
        ControllerGains::Cascade(gains) => gains.check(),
    });
    checked.unwrap_or_default()
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
        out.integration = integration(&within, raw, problems);
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
        let mut at = places(within, raw, problems);
        let raw = raw.get_ref();
        let mismatch = Mismatch {
            gain_factor: at.or("gain_factor", raw.gain_factor.as_ref(), 1.0),
            time_constant_factor: at.or("time_constant_factor", raw.time_constant_factor.as_ref(), 1.0),
        };
        out.mismatch = at.check(mismatch, Mismatch::check);
    }
    if let Some(raw) = &raw.encoder {
        let mut at = places(within, raw, problems);
        let raw = raw.get_ref();
        let period_s = settings.period_s;
        let damping = raw.velocity_damping.as_ref().map_or(1.0, |raw| *raw.get_ref());
        if let Some(raw) = &raw.velocity_damping {
            at.note("damping", "velocity_damping", raw.span());
        }
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
        let frequency_hz = raw.velocity_hz.as_ref().map_or(default, |raw| *raw.get_ref());
        if let Some(raw) = &raw.velocity_hz {
            at.note("bandwidth_hz", "velocity_hz", raw.span());
            at.bound("bandwidth_hz", || format!("with this damping and period_s: below {}", hz(highest)));
            at.note("corner_hz", "velocity_hz", raw.span());
            at.bound("corner_hz", || format!("here at most {}", hz(0.5 / period_s)));
        }
        let encoder = Encoder {
            place: match raw.place {
                Some(RawPlace::Table) => EncoderPlace::Table,
                Some(RawPlace::Motor) | None => EncoderPlace::Motor,
            },
            resolution_um: at.or("resolution_um", raw.resolution_um.as_ref(), 0.0),
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
        let seed = u64::from(raw.seed.unwrap_or(1));
        let noise = Noise { rms_um: at.get("rms_um", &raw.rms_um), seed: seed.wrapping_mul(8).wrapping_add(index) };
        out.noise = at.check(noise, Noise::check);
    }
    if let Some(raw) = &raw.delay {
        let mut at = places(within, raw, problems);
        let delay = Delay { samples: at.get("samples", &raw.get_ref().samples) };
        out.delay = at.check(delay, Delay::check);
    }
    if let Some(raw) = &raw.dac {
        let mut at = places(within, raw, problems);
        let bits = &raw.get_ref().bits;
        at.note("bits", "bits", bits.span());
        // What does not fit is out of range in any case.
        let dac = Dac { bits: u32::try_from(*bits.get_ref()).unwrap_or(u32::MAX) };
        out.dac = at.check(dac, Dac::check);
    }
    if let Some(raw) = &raw.current_loop {
        let mut at = places(within, raw, problems);
        let current_loop = CurrentLoop { bandwidth_hz: at.get("bandwidth_hz", &raw.get_ref().bandwidth_hz) };
        out.current_loop = at.check(current_loop, CurrentLoop::check);
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
        let mut at = places(within, raw, problems);
        let raw = raw.get_ref();
        let two_mass = TwoMass {
            table_mass_kg: at.get("table_mass_kg", &raw.table_mass_kg),
            stiffness_n_um: at.get("stiffness_n_um", &raw.stiffness_n_um),
            damping_n_s_mm: at.or("damping_n_s_mm", raw.damping_n_s_mm.as_ref(), 0.0),
        };
        // Against what the plant is, where that is known.
        let plant = out.plant(&axis.plant);
        if sound {
            out.two_mass = at.check(two_mass, |two_mass| two_mass.check(&plant, drive, settings.period_s));
        }
    }
    if let Some(raw) = &raw.friction {
        let mut at = places(within, raw, problems);
        let mut curve = |coulomb_nm, static_nm: &Option<_>, stribeck_mm_s: &Option<_>, viscous_nm_s_rad: &Option<_>| {
            let value = at.get("coulomb_nm", coulomb_nm);
            if static_nm.is_none() {
                at.note("static_nm", "coulomb_nm", coulomb_nm.span());
            }
            let coulomb_nm = value;
            let static_nm = at.or("static_nm", static_nm.as_ref(), coulomb_nm);
            let most_nm = drive.voltage_limit_v / drive.torque_to_voltage_v_nm;
            at.bound("static_nm", || {
                format!(
                    "at its voltage limit the drive gives voltage_limit_v / torque_to_voltage_v_nm = {most_nm:.4} N m"
                )
            });
            Coulomb {
                coulomb_nm,
                static_nm,
                stribeck_mm_s: at.or("stribeck_mm_s", stribeck_mm_s.as_ref(), 1.0),
                viscous_nm_s_rad: at.or("viscous_nm_s_rad", viscous_nm_s_rad.as_ref(), 0.0),
            }
        };
        let friction = match raw.get_ref() {
            RawFriction::Coulomb(raw) => {
                Friction::Coulomb(curve(&raw.coulomb_nm, &raw.static_nm, &raw.stribeck_mm_s, &raw.viscous_nm_s_rad))
            }
            RawFriction::LuGre(raw) => Friction::LuGre(LuGre {
                curve: curve(&raw.coulomb_nm, &raw.static_nm, &raw.stribeck_mm_s, &raw.viscous_nm_s_rad),
                stiffness_nm_rad: at.get("stiffness_nm_rad", &raw.stiffness_nm_rad),
                damping_nm_s_rad: at.or("damping_nm_s_rad", raw.damping_nm_s_rad.as_ref(), 0.0),
            }),
        };
        let rubbing_kg_m2 = out.rubbing_kg_m2(&axis.plant, drive);
        out.friction = at.check(friction, |friction| friction.check(rubbing_kg_m2, drive));
    }
    if let Some(raw) = &raw.backlash {
        let mut at = places(within, raw, problems);
        let backlash = Backlash { gap_um: at.get("gap_um", &raw.get_ref().gap_um) };
        out.backlash = at.check(backlash, Backlash::check);
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

/// How finely all that is integrated.
fn integration(within: &str, raw: &Spanned<RawIntegration>, problems: &mut Problems) -> Integration {
    let mut at = places(within, raw, problems);
    at.help = "leave the key out for its default: substeps = 1, tolerance_mm_s = 1e-5";
    let RawIntegration { substeps, tolerance_mm_s } = raw.get_ref();
    let mut out = Integration::default();
    out.tolerance_mm_s = at.or("tolerance_mm_s", tolerance_mm_s.as_ref(), out.tolerance_mm_s);
    if let Some(raw) = substeps {
        at.note("substeps", "substeps", raw.span());
        match u32::try_from(*raw.get_ref()) {
            Ok(substeps) => out.substeps = substeps,
            // As it stands in the file.
            Err(_) => {
                at.tell(&OutOfRange::new("substeps", *raw.get_ref() as f64, Integration::SUBSTEPS));
            }
        }
    }
    at.check(out, Integration::check).unwrap_or_default()
}

fn places<'p, T>(within: &str, raw: &Spanned<T>, problems: &'p mut Problems) -> Places<'p> {
    Places { within: within.to_owned(), table: raw.span(), values: Vec::new(), help: UNITS, problems }
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
    let mut at = Places { within: within.to_owned(), table: span, values: Vec::new(), help: UNITS, problems };
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
        let mut at = places(&within, raw, problems);
        let raw = raw.get_ref();
        let notch = Filter::Notch {
            frequency_hz: at.get("frequency_hz", &raw.frequency_hz),
            depth: at.or("depth", raw.depth.as_ref(), 0.0),
            damping: at.or("damping", raw.damping.as_ref(), 0.5),
        };
        at.bound("frequency_hz", || format!("here below {}", hz(Filter::HIGHEST / period_s)));
        out.filters.extend(at.check(notch, |filter| filter.check(period_s)));
    }
    if let Some(raw) = &raw.low_pass {
        let mut at = places(&within, raw, problems);
        let raw = raw.get_ref();
        let low_pass = Filter::LowPass {
            frequency_hz: at.get("frequency_hz", &raw.frequency_hz),
            damping: at.or("damping", raw.damping.as_ref(), std::f64::consts::FRAC_1_SQRT_2),
        };
        at.bound("frequency_hz", || format!("here below {}", hz(Filter::HIGHEST / period_s)));
        out.filters.extend(at.check(low_pass, |filter| filter.check(period_s)));
    }
    if let Some(raw) = &raw.acceleration {
        let mut at = places(&within, raw, problems);
        let acceleration = AccelerationFeedforward { share: at.or("share", raw.get_ref().share.as_ref(), 1.0) };
        out.acceleration = at.check(acceleration, AccelerationFeedforward::check);
    }
    if let Some(raw) = &raw.friction {
        let mut at = places(&within, raw, problems);
        let raw = raw.get_ref();
        let friction = FrictionFeedforward {
            coulomb_nm: at.get("coulomb_nm", &raw.coulomb_nm),
            smoothing_mm_s: at.or("smoothing_mm_s", raw.smoothing_mm_s.as_ref(), 1.0),
        };
        out.friction = at.check(friction, FrictionFeedforward::check);
    }
    if let Some(raw) = &raw.backlash {
        let mut at = places(&within, raw, problems);
        let raw = raw.get_ref();
        let backlash = BacklashCompensation {
            gap_um: at.get("gap_um", &raw.gap_um),
            time_constant_s: at.or("time_constant_s", raw.time_constant_s.as_ref(), 0.0),
        };
        out.backlash = at.check(backlash, BacklashCompensation::check);
    }
    out.pitch = raw.pitch.as_ref().and_then(|raw| pitch(&within, raw, problems));
    out
}

/// The cross-coupled controller of the whole machine.
pub(super) fn cross_coupling(raw: &Spanned<RawCrossCoupling>, problems: &mut Problems) -> Option<CrossCouplingGains> {
    let mut at = places("", raw, problems);
    let raw = raw.get_ref();
    let gains = CrossCouplingGains {
        proportional: at.get("proportional", &raw.proportional),
        integral_1_s: at.or("integral_1_s", raw.integral_1_s.as_ref(), 0.0),
        derivative_s: at.or("derivative_s", raw.derivative_s.as_ref(), 0.0),
        limit_um: at.or("limit_um", raw.limit_um.as_ref(), 100.0),
    };
    at.check(gains, CrossCouplingGains::check)
}
