//! An axis beyond its model: from the file as written to checked values.

use std::ops::Range;

use toml::Spanned;

use super::check::Problems;
use super::diagnostics::Diagnostic;
use super::drive_file::{
    RawController, RawCrossCoupling, RawEffects, RawForce, RawFriction, RawPitch, RawPlace, RawRemedies, RawVelocity,
};
use super::file::RawAxis;
use super::numbers::RawPoint;
use crate::servo::controller::{CascadeGains, PPiGains, PidGains};
use crate::servo::effects::{
    Backlash, Coulomb, CurrentLoop, CuttingForce, Dac, Delay, Effects, Encoder, EncoderPlace, Friction, Harmonic,
    LuGre, Mismatch, Noise, PitchError, Table, TorqueRipple, TwoMass, VelocityEstimate,
};
use crate::servo::remedies::{
    AccelerationFeedforward, BacklashCompensation, CrossCouplingGains, Filter, FrictionFeedforward, Remedies,
};
use crate::servo::{AxisParameters, ControllerGains, ControllerKind, LoopSettings, RealDrive, ServoError};

/// Values of a table with their places: what an error of the servo is about.
struct Places<'p> {
    within: String,
    table: Range<usize>,
    values: Vec<(&'static str, Range<usize>)>,
    problems: &'p mut Problems,
}

impl Places<'_> {
    /// A value, its place noted.
    fn get(&mut self, name: &'static str, raw: &Spanned<f64>) -> f64 {
        self.values.push((name, raw.span()));
        *raw.get_ref()
    }

    fn or(&mut self, name: &'static str, raw: Option<&Spanned<f64>>, default: f64) -> f64 {
        raw.map_or(default, |raw| self.get(name, raw))
    }

    /// Tells an error where the value is that it names, or on the whole table.
    fn tell(&mut self, error: &ServoError) {
        let named = self.values.iter().find(|(name, _)| error.name.contains(name));
        let span = named.map_or(self.table.clone(), |(_, span)| span.clone());
        self.problems.push(
            Diagnostic::new(format!("{}{error}", self.within))
                .at(span)
                .help("units are in the key's name; remove the table to switch this off"),
        );
    }

    fn check<T>(mut self, value: T, check: impl FnOnce(&T) -> Result<(), ServoError>) -> Option<T> {
        match check(&value) {
            Ok(()) => Some(value),
            Err(error) => {
                self.tell(&error);
                None
            }
        }
    }
}

/// Checks one axis beyond its model. `index` keeps the noise of the axes apart.
pub(super) fn drive(
    (name, index): (&str, u64),
    raw: &RawAxis,
    axis: &AxisParameters,
    settings: &LoopSettings,
    problems: &mut Problems,
) -> RealDrive {
    let sound = axis.check().is_ok() && settings.check().is_ok();
    let controller = raw.controller.as_ref().map(|raw| controller(name, raw, axis, settings, problems));
    let effects = effects((name, index), &raw.effects, axis, settings, sound, problems);
    let remedies = remedies(name, &raw.remedies, settings, problems);
    let drive = RealDrive {
        controller: controller.unwrap_or_default(),
        effects,
        remedies,
        zero_phase: raw.remedies.zero_phase.as_ref().is_some_and(|raw| *raw.get_ref()),
    };
    if let Some(zero_phase) = &raw.remedies.zero_phase
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
    let mut at = Places { within, table: raw.span(), values: Vec::new(), problems };
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
    let checked = at.check(gains, |gains| match gains {
        ControllerGains::Pdff => Ok(()),
        ControllerGains::PPi(gains) => gains.check(),
        ControllerGains::Pid(gains) => gains.check(),
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
        let hz = at.or("bandwidth_hz", raw.velocity_hz.as_ref(), 200.0);
        if let Some(raw) = &raw.velocity_hz {
            at.values.push(("corner_hz", raw.span()));
        }
        let damping = at.or("damping", raw.velocity_damping.as_ref(), 1.0);
        let encoder = Encoder {
            place: match raw.place {
                Some(RawPlace::Table) => EncoderPlace::Table,
                Some(RawPlace::Motor) | None => EncoderPlace::Motor,
            },
            resolution_um: at.or("resolution_um", raw.resolution_um.as_ref(), 0.0),
            velocity: match raw.velocity {
                Some(RawVelocity::Tachometer) | None => VelocityEstimate::Tachometer,
                Some(RawVelocity::Difference) => VelocityEstimate::Difference,
                Some(RawVelocity::LowPass) => VelocityEstimate::LowPass { corner_hz: hz },
                Some(RawVelocity::Observer) => VelocityEstimate::Observer { bandwidth_hz: hz, damping },
            },
        };
        out.encoder = at.check(encoder, |encoder| encoder.check(settings.period_s));
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
        at.values.push(("bits", bits.span()));
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
            let coulomb_nm = at.get("coulomb_nm", coulomb_nm);
            Coulomb {
                coulomb_nm,
                static_nm: at.or("static_nm", static_nm.as_ref(), coulomb_nm),
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
        at.values.push(("harmonics", raw.get_ref().harmonics.span()));
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
            at.values.push(("per_revolution", raw.per_revolution.span()));
            at.values.push(("amplitude_nm", raw.amplitude_nm.span()));
            at.values.extend(raw.phase_deg.as_ref().map(|deg| ("phase_rad", deg.span())));
        }
        out.ripple = at.check(ripple, TorqueRipple::check);
    }
    if let Some(raw) = &raw.force {
        let (points, period, over_time) = match raw.get_ref() {
            RawForce::OverTime(raw) => (&raw.points_s_n, &raw.period_s, true),
            RawForce::OverPosition(raw) => (&raw.points_mm_n, &raw.period_mm, false),
        };
        if let Some((table, at)) = table(within, raw.span(), points, period.as_ref(), problems) {
            let force = if over_time { CuttingForce::OverTime(table) } else { CuttingForce::OverPosition(table) };
            out.force = at.check(force, CuttingForce::check);
        }
    }
}

fn places<'p, T>(within: &str, raw: &Spanned<T>, problems: &'p mut Problems) -> Places<'p> {
    Places { within: within.to_owned(), table: raw.span(), values: Vec::new(), problems }
}

fn table<'p>(
    within: &str,
    span: Range<usize>,
    points: &Spanned<Vec<RawPoint>>,
    period: Option<&Spanned<f64>>,
    problems: &'p mut Problems,
) -> Option<(Table, Places<'p>)> {
    let values = points.get_ref().iter().map(|point| point.get_ref().0);
    let mut at = Places { within: within.to_owned(), table: span, values: Vec::new(), problems };
    if let Some(period) = period {
        at.values.push(("period", period.span()));
    }
    at.values.push(("table", points.span()));
    match Table::new(values.map(|[x, y]| (x, y)), period.map(|period| *period.get_ref())) {
        Ok(table) => Some((table, at)),
        Err(error) => {
            at.tell(&error);
            None
        }
    }
}

fn pitch(within: &str, raw: &Spanned<RawPitch>, problems: &mut Problems) -> Option<PitchError> {
    let RawPitch { points_mm_um, period_mm } = raw.get_ref();
    let (error_um, at) = table(within, raw.span(), points_mm_um, period_mm.as_ref(), problems)?;
    at.check(PitchError { error_um }, PitchError::check)
}

fn remedies(name: &str, raw: &RawRemedies, settings: &LoopSettings, problems: &mut Problems) -> Remedies {
    let within = format!("axis {name}: ");
    let mut out = Remedies::default();
    let period_s = settings.period_s;
    if let Some(raw) = &raw.notch {
        let mut at = places(&within, raw, problems);
        let raw = raw.get_ref();
        let notch = Filter::Notch {
            frequency_hz: at.get("frequency_hz", &raw.frequency_hz),
            depth: at.or("depth", raw.depth.as_ref(), 0.0),
            damping: at.or("damping", raw.damping.as_ref(), 0.5),
        };
        out.filters.extend(at.check(notch, |filter| filter.check(period_s)));
    }
    if let Some(raw) = &raw.low_pass {
        let mut at = places(&within, raw, problems);
        let raw = raw.get_ref();
        let low_pass = Filter::LowPass {
            frequency_hz: at.get("frequency_hz", &raw.frequency_hz),
            damping: at.or("damping", raw.damping.as_ref(), std::f64::consts::FRAC_1_SQRT_2),
        };
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
