//! The circular test.

use crate::parameters::{AXIS_NAMES, OutOfRange, axis_title};
use std::f64::consts::TAU;

use nalgebra::{SMatrix, SVector};
use serde::Serialize;

use super::circle_path::Turns;
use super::roundness::{Point, Zone};
use super::{MeasureError, idle, neglected, um, within};
use crate::feedrate::{Motion, Profile};
use crate::limits::Limits;
use crate::path::Path;
use crate::scenario::Scenario;
use crate::simulation::{Event, Observer, ObserverError, Period, Simulation};

/// What circle is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleRequest {
    /// Radius \[mm\], from 0.001 to 1e5.
    pub radius_mm: f64,
    /// Feed along the circle \[mm/s\], from 1e-3 to 1e5.
    pub feed_mm_s: f64,
    /// Centre \[mm\].
    pub centre_mm: [f64; 2],
    /// Where the measured turns start and end, from +X counterclockwise \[deg\].
    pub start_deg: f64,
    /// Turns that are measured in each direction, 1 to 100.
    pub turns: u32,
}

impl CircleRequest {
    /// One turn of 50 mm around the origin at the scenario's feed, from +X on.
    pub fn of(scenario: &Scenario) -> Self {
        Self { radius_mm: 50.0, feed_mm_s: scenario.feed_mm_s, centre_mm: [0.0; 2], start_deg: 0.0, turns: 1 }
    }

    /// Whether a scenario can run it.
    ///
    /// # Errors
    /// A value out of its range.
    pub fn check(&self, scenario: &Scenario) -> Result<(), MeasureError> {
        let CircleRequest { radius_mm, feed_mm_s, turns, .. } = *self;
        within("radius_mm", radius_mm, 1e-3, 1e5)?;
        within("feed_mm_s", feed_mm_s, 1e-3, 1e5)?;
        within("start_deg", self.start_deg, -1e6, 1e6)?;
        for centre_mm in self.centre_mm {
            within("centre_mm", centre_mm, -1e8, 1e8)?;
        }
        within("turns", f64::from(turns), 1.0, 100.0)?;
        let once = TAU * radius_mm / feed_mm_s / scenario.settings.period_s;
        if !(once >= LEAST_PERIODS) {
            let most = TAU * radius_mm / LEAST_PERIODS / scenario.settings.period_s;
            let needed = format!("at most {most:.6}: a turn of this radius would have only {once:.1} control periods");
            return Err(MeasureError::Request(OutOfRange::new("feed_mm_s", feed_mm_s, needed)));
        }
        Ok(())
    }
}

/// One point of the actual path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radial {
    /// Polar angle from +X around the nominal centre, 0 to 360 \[deg\].
    pub angle_deg: f64,
    /// Distance from the nominal centre less the nominal radius \[µm\].
    pub deviation_um: f64,
}

/// What happens where an axis turns back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spike {
    /// The axis that turns back: `x` at 0° and 180°, `y` at 90° and 270°.
    pub axis: &'static str,
    /// Where, \[deg\].
    pub at_deg: f64,
    /// Its height: how far the path goes beyond both the level before and the level after \[µm\]; outwards positive.
    pub height_um: f64,
    /// The angle travelled from the reversal to its tip \[deg\].
    pub after_deg: f64,
    /// Polar angle of its tip \[deg\].
    pub tip_deg: f64,
    /// Radial deviation of its tip \[µm\].
    pub tip_um: f64,
    /// Whether it is one: half as high again as the ripple of the path between reversals at least. What is lower, or what a loop does that
    /// has lost its track, is no work of the reversal.
    pub clear: bool,
}

/// The actual path in one direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Direction {
    /// The direction.
    pub clockwise: bool,
    /// Circular deviation `G`: smallest distance of two concentric circles that hold the path (minimum zone) \[µm\].
    pub circular_deviation_um: f64,
    /// The same of circles around the least-squares centre \[µm\].
    pub circular_deviation_least_squares_um: f64,
    /// Least-squares centre from the nominal one \[µm\].
    pub centre_um: [f64; 2],
    /// Mean radius (around that centre) less the nominal one \[µm\].
    pub radius_um: f64,
    /// Radial deviation `F`, the largest one, around the nominal centre \[µm\].
    pub radial_max_um: f64,
    /// Its polar angle \[deg\].
    pub radial_max_at_deg: f64,
    /// Radial deviation `F`, the smallest one \[µm\].
    pub radial_min_um: f64,
    /// Its polar angle \[deg\].
    pub radial_min_at_deg: f64,
    /// Lost motion of X and of Y: how far the table is behind after a reversal beside before \[µm\].
    pub lost_motion_um: [f64; 2],
    /// Ripple: largest distance from the fit between reversals \[µm\].
    pub ripple_um: f64,
    /// At the four reversals, by angle.
    pub spikes: [Spike; 4],
    /// The path, in the order of travel.
    #[serde(skip)]
    pub trace: Vec<Radial>,
}

/// A circular test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CircleTest {
    /// Name of the scenario.
    pub scenario: String,
    /// Nominal radius.
    pub radius_mm: f64,
    /// Feed.
    pub feed_mm_s: f64,
    /// Turns a direction.
    pub turns: u32,
    /// Counterclockwise, then clockwise.
    pub directions: [Direction; 2],
    /// Bidirectional circular deviation `G(b)`: as `G`, of both paths together \[µm\].
    pub bidirectional_deviation_um: f64,
    /// The same around the common least-squares centre \[µm\].
    pub bidirectional_deviation_least_squares_um: f64,
    /// Mean bidirectional radial deviation `D`: mean radius of both less the nominal one \[µm\].
    pub mean_radial_deviation_um: f64,
    /// Hysteresis `H`: largest radial distance of the two paths \[µm\].
    pub hysteresis_um: f64,
    /// Its polar angle \[deg\].
    pub hysteresis_at_deg: f64,
    /// Whether an axis locked up: the metrics are those of a limit cycle.
    pub locked_up: bool,
    /// In words, for a person.
    pub warnings: Vec<String>,
}

/// After the feed is reached the loops get this time to settle \[s\].
const SETTLING_S: f64 = 0.5;
/// Most control periods of a direction.
const MOST_PERIODS: u64 = 4_000_000;
/// A circle of fewer samples is a polygon.
const LEAST_PERIODS: f64 = 72.0;
/// So far after a reversal a spike is looked for; the levels before and after are fitted to the rest \[deg\].
const SPIKE_DEG: f64 = 30.0;

/// A spike is as high as the ripple elsewhere by this factor.
const CLEAR: f64 = 1.5;

/// Runs a circle in both directions and tells how round it became: ISO 230-4, "Circular tests for numerically controlled machine tools",
/// sections 3 and 4 (the hysteresis is that of its first edition, 1996).
///
/// Each direction begins at rest, reaches the feed on whole turns that are left out, and ends the measured turns at full feed. Between
/// reversals the deviation of a loop with backlash is
///
/// ```text
/// d(φ) = c + e_x cos φ + e_y sin φ + a cos 2φ + b sin 2φ - ½ B_x sgn(ẋ) cos φ - ½ B_y sgn(ẏ) sin φ
/// ```
///
/// with the commanded angle `φ`: offset and centre, the ellipse of unequal axes, and the lost motion `B` of each axis. It is fitted to the
/// path more than 30° behind a reversal; a spike is what goes beyond it in these 30°, and beyond the ripple that there is elsewhere.
///
/// # Errors
/// A request out of its range, drives that cannot be simulated, a loop that diverges.
pub fn circle(scenario: &Scenario, request: &CircleRequest) -> Result<CircleTest, MeasureError> {
    circle_observed(scenario, request, [&mut [], &mut []])
}

/// As [`circle`], with observers of the two runs, counterclockwise and clockwise: each from rest over the turns in which the feed is reached
/// and the measured ones to rest.
///
/// # Errors
/// As [`circle`], and those of the observers.
pub fn circle_observed(
    scenario: &Scenario,
    request: &CircleRequest,
    observers: [&mut [&mut dyn Observer<2>]; 2],
) -> Result<CircleTest, MeasureError> {
    request.check(scenario)?;
    let CircleRequest { radius_mm, feed_mm_s, turns, .. } = *request;
    let idle = idle(scenario);
    let [first, second] = observers;
    let both = [turn(&idle, request, false, first)?, turn(&idle, request, true, second)?];
    let points: Vec<Point> = both.iter().flat_map(|run| run.samples.iter().map(|sample| sample.point)).collect();
    let (narrow, least) = (Zone::narrowest(&points, radius_mm), Zone::least_squares(&points, radius_mm));
    let (mut warnings, mut locked_up) = (Vec::new(), false);
    for run in &both {
        locked_up |= run.locked_up;
        warnings.extend(run.warning.iter().map(|text| format!("{}: {text}", name(run.clockwise))));
    }
    warnings.extend(neglected(scenario, false));
    let directions = both.map(|run| metrics(&run, radius_mm));
    let (hysteresis_um, hysteresis_at_deg) = hysteresis(&directions);
    Ok(CircleTest {
        scenario: scenario.name.clone(),
        radius_mm,
        feed_mm_s,
        turns,
        directions,
        bidirectional_deviation_um: um(narrow.width_mm),
        bidirectional_deviation_least_squares_um: um(least.width_mm),
        mean_radial_deviation_um: um(least.mean_mm),
        hysteresis_um,
        hysteresis_at_deg,
        locked_up,
        warnings,
    })
}

fn name(clockwise: bool) -> &'static str {
    if clockwise { "clockwise" } else { "counterclockwise" }
}

/// One sample of the measured turns.
#[derive(Debug, Clone, Copy)]
struct Sample {
    /// Commanded angle \[rad\].
    angle: f64,
    point: Point,
}

/// The measured turns in one direction.
struct Run {
    clockwise: bool,
    samples: Vec<Sample>,
    locked_up: bool,
    warning: Option<String>,
}

/// Gathers the measured turns.
struct Gather {
    from_mm: f64,
    to_mm: f64,
    radius_mm: f64,
    start: f64,
    turn: f64,
    centre_mm: [f64; 2],
    samples: Vec<Sample>,
    saturated: u64,
    lockup: Option<String>,
}

impl Observer<2> for Gather {
    fn period(&mut self, period: &Period<2>) -> Result<(), ObserverError> {
        let s_mm = period.setpoint.s_mm;
        self.saturated += u64::from(period.axes.iter().any(|axis| axis.saturated));
        if s_mm >= self.from_mm && s_mm < self.to_mm {
            let [x, y] = [0, 1].map(|axis| period.actual_mm[axis] - self.centre_mm[axis]);
            let distance = libm::hypot(x, y);
            let out_mm = distance - self.radius_mm;
            let point = Point { cos: x / distance, sin: y / distance, out_mm };
            self.samples.push(Sample { angle: self.start + self.turn * s_mm / self.radius_mm, point });
        }
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), ObserverError> {
        if let Event::LockedUp { axis, .. } = event {
            let axis = axis_title(*axis);
            self.lockup.get_or_insert(format!("axis {axis} locked up: the metrics are those of a limit cycle"));
        }
        Ok(())
    }
}

/// Runs one direction.
fn turn(
    scenario: &Scenario,
    request: &CircleRequest,
    clockwise: bool,
    observers: &mut [&mut dyn Observer<2>],
) -> Result<Run, MeasureError> {
    let CircleRequest { radius_mm, feed_mm_s, centre_mm, start_deg, turns } = *request;
    let settings = &scenario.settings;
    // Along the path no more acceleration than across it.
    let phase_s = (radius_mm / feed_mm_s).max(0.1);
    let once_mm = TAU * radius_mm;
    let phase_turns = 0.5 * feed_mm_s * phase_s / once_mm;
    let run_in = (phase_turns + feed_mm_s * SETTLING_S / once_mm).ceil();
    let all = run_in + f64::from(turns) + phase_turns;
    let samples = (all * once_mm / feed_mm_s + phase_s) / settings.period_s;
    if !(samples <= MOST_PERIODS as f64) {
        let help = "take a smaller radius, a higher feed or fewer turns";
        return Err(MeasureError::TooLong { what: "circular test", samples, most: MOST_PERIODS, help });
    }
    let start = start_deg.rem_euclid(360.0).to_radians();
    // A little more than needed: the last measured sample is at full feed.
    let path = Turns::new(centre_mm, radius_mm, start, clockwise, all + 1e-6)?;
    let motion = Motion::plan(path.length_mm(), feed_mm_s, Profile::Quintic { phase_s })?;
    let coupling = scenario.cross_coupling.as_ref();
    let run = Simulation::with_drives(&path, &motion, scenario.axes, &scenario.drives, coupling, *settings)?;
    let mut gather = Gather {
        from_mm: run_in * once_mm * (1.0 - 1e-12),
        to_mm: (run_in + f64::from(turns)) * once_mm * (1.0 - 1e-12),
        radius_mm,
        start,
        turn: if clockwise { -1.0 } else { 1.0 },
        centre_mm,
        samples: Vec::new(),
        saturated: 0,
        lockup: None,
    };
    let mut all: Vec<&mut dyn Observer<2>> = vec![&mut gather];
    all.extend(observers.iter_mut().map(|observer| &mut **observer as &mut dyn Observer<2>));
    run.run(&Limits::default(), None, &mut all)?;
    let saturated = (gather.saturated > 0).then(|| format!("saturated in {} samples", gather.saturated));
    let locked_up = gather.lockup.is_some();
    Ok(Run { clockwise, samples: gather.samples, locked_up, warning: gather.lockup.or(saturated) })
}

/// Terms of the fit.
const TERMS: usize = 7;

/// What a run comes to.
fn metrics(run: &Run, radius_mm: f64) -> Direction {
    let points: Vec<Point> = run.samples.iter().map(|sample| sample.point).collect();
    let (narrow, least) = (Zone::narrowest(&points, radius_mm), Zone::least_squares(&points, radius_mm));
    let trace: Vec<Radial> = points.iter().map(radial).collect();
    let first = Radial { angle_deg: 0.0, deviation_um: 0.0 };
    let pick = |better: fn(f64, f64) -> bool| {
        let best = |a: Radial, b: Radial| if better(b.deviation_um, a.deviation_um) { b } else { a };
        trace.iter().copied().reduce(best).unwrap_or(first)
    };
    let (high, low) = (pick(|a, b| a > b), pick(|a, b| a < b));
    let turn = if run.clockwise { -1.0 } else { 1.0 };
    let fit = fitted(&run.samples, turn);
    let ripple_um = um(ripple_mm(&run.samples, &fit, turn));
    Direction {
        clockwise: run.clockwise,
        circular_deviation_um: um(narrow.width_mm),
        circular_deviation_least_squares_um: um(least.width_mm),
        centre_um: least.centre_mm.map(um),
        radius_um: um(least.mean_mm),
        radial_max_um: high.deviation_um,
        radial_max_at_deg: high.angle_deg,
        radial_min_um: low.deviation_um,
        radial_min_at_deg: low.angle_deg,
        lost_motion_um: [um(fit[5]), um(fit[6])],
        ripple_um,
        spikes: spikes(&run.samples, &fit, turn)
            .map(|spike| Spike { clear: !run.locked_up && spike.height_um.abs() > CLEAR * ripple_um, ..spike }),
        trace,
    }
}

fn radial(point: &Point) -> Radial {
    let angle = libm::atan2(point.sin, point.cos).to_degrees();
    Radial { angle_deg: if angle < 0.0 { angle + 360.0 } else { angle }, deviation_um: um(point.out_mm) }
}

/// The reversal that was passed last, 0 to 3 in steps of 90°, and the angle travelled since \[deg\].
fn passed(angle: f64, turn: f64) -> (usize, f64) {
    // A sample on a reversal, but for rounding, belongs to what comes after it.
    let travelled = (turn * angle.to_degrees() + 1e-9).rem_euclid(360.0);
    let since = travelled.rem_euclid(90.0);
    let at = (turn * (travelled - since)).rem_euclid(360.0);
    let quadrant = [0.0, 90.0, 180.0, 270.0].iter().position(|q| (at - q).abs() < 45.0).unwrap_or(0);
    (quadrant, since)
}

/// The terms of the fit at a commanded angle; `turn` is +1 counterclockwise.
fn terms(angle: f64, turn: f64) -> SVector<f64, TERMS> {
    let (sin, cos) = libm::sincos(angle);
    let (quadrant, _) = passed(angle, turn);
    // Half way to the next reversal no sign is in doubt: ẋ goes as -sin φ, ẏ as cos φ, both turned around clockwise.
    let (sin_m, cos_m) = libm::sincos((90.0 * quadrant as f64 + 45.0 * turn).to_radians());
    let (right, up) = ((-turn * sin_m).signum(), (turn * cos_m).signum());
    let (sin2, cos2) = (2.0 * sin * cos, cos * cos - sin * sin);
    SVector::from([1.0, cos, sin, cos2, sin2, -0.5 * right * cos, -0.5 * up * sin])
}

/// Coefficients of the fit \[mm\].
fn fitted(samples: &[Sample], turn: f64) -> SVector<f64, TERMS> {
    let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
    let mut right = SVector::<f64, TERMS>::zeros();
    for sample in samples.iter().filter(|sample| passed(sample.angle, turn).1 >= SPIKE_DEG) {
        let row = terms(sample.angle, turn);
        normal += row * row.transpose();
        right += row * sample.point.out_mm;
    }
    normal.cholesky().map_or_else(SVector::zeros, |c| c.solve(&right))
}

/// Largest distance from the fit where it is fitted \[mm\].
fn ripple_mm(samples: &[Sample], fit: &SVector<f64, TERMS>, turn: f64) -> f64 {
    let between = samples.iter().filter(|sample| passed(sample.angle, turn).1 >= SPIKE_DEG);
    between.map(|sample| (sample.point.out_mm - terms(sample.angle, turn).dot(fit)).abs()).fold(0.0, f64::max)
}

/// What goes beyond the fit behind each reversal.
fn spikes(samples: &[Sample], fit: &SVector<f64, TERMS>, turn: f64) -> [Spike; 4] {
    let mut spikes = [0, 1, 2, 3].map(|quadrant| Spike {
        axis: AXIS_NAMES[quadrant % 2],
        at_deg: 90.0 * quadrant as f64,
        height_um: 0.0,
        after_deg: 0.0,
        tip_deg: 90.0 * quadrant as f64,
        tip_um: 0.0,
        clear: false,
    });
    for sample in samples {
        let (quadrant, since) = passed(sample.angle, turn);
        if since >= SPIKE_DEG {
            continue;
        }
        let row = terms(sample.angle, turn);
        let after = row.dot(fit);
        // The axis that turned back had the other sign.
        let lost = 5 + quadrant % 2;
        let before = after - 2.0 * row[lost] * fit[lost];
        let out = sample.point.out_mm;
        let beyond = (out - before.max(after)).max(0.0) + (out - before.min(after)).min(0.0);
        if um(beyond).abs() > spikes[quadrant].height_um.abs() {
            let Radial { angle_deg, deviation_um } = radial(&sample.point);
            let spike = &mut spikes[quadrant];
            (spike.height_um, spike.after_deg, spike.tip_deg, spike.tip_um) =
                (um(beyond), since, angle_deg, deviation_um);
        }
    }
    spikes
}

/// Largest radial distance of the two paths, and where.
///
/// Between its samples a path is taken as straight in polar coordinates, so the distance of two paths is largest at a sample of one of them:
/// every sample is tried, and no spike is too narrow.
fn hysteresis(directions: &[Direction; 2]) -> (f64, f64) {
    hysteresis_of(directions.each_ref().map(|direction| direction.trace.as_slice()))
}

fn hysteresis_of(traces: [&[Radial]; 2]) -> (f64, f64) {
    let sorted = traces.map(|trace| {
        let mut trace = trace.to_vec();
        trace.sort_by(|a, b| a.angle_deg.total_cmp(&b.angle_deg));
        trace
    });
    let angles = sorted.iter().flatten().map(|radial| radial.angle_deg);
    angles
        .map(|angle| ((between(&sorted[0], angle) - between(&sorted[1], angle)).abs(), angle))
        .fold((0.0, 0.0), |best, next| if next.0 > best.0 { next } else { best })
}

/// The deviation at an angle, interpolated between the neighbours of a sorted trace.
fn between(trace: &[Radial], angle_deg: f64) -> f64 {
    let after = trace.partition_point(|radial| radial.angle_deg < angle_deg);
    let (Some(first), Some(last)) = (trace.first(), trace.last()) else { return 0.0 };
    let a = after.checked_sub(1).and_then(|k| trace.get(k)).map_or((last.angle_deg - 360.0, last.deviation_um), pair);
    let b = trace.get(after).map_or((first.angle_deg + 360.0, first.deviation_um), pair);
    if b.0 > a.0 { a.1 + (b.1 - a.1) * (angle_deg - a.0) / (b.0 - a.0) } else { a.1 }
}

fn pair(radial: &Radial) -> (f64, f64) {
    (radial.angle_deg, radial.deviation_um)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regression_no_spike_is_too_narrow_for_the_hysteresis() {
        // Samples at uneven angles, and a spike of one sample between two angles of any even grid of some thousands.
        let trace = |spike: f64| -> Vec<Radial> {
            (0..5000_u32)
                .map(|k| {
                    let angle_deg = 0.072 * f64::from(k) + 0.0123;
                    let spike = if k == 1234 { spike } else { 0.0 };
                    Radial { angle_deg, deviation_um: libm::sin(2.0 * angle_deg.to_radians()) + spike }
                })
                .collect()
        };
        for spike in [2.0312, -1.2448] {
            let (plain, spiked) = (trace(0.0), trace(spike));
            let (um, at_deg) = hysteresis_of([&plain, &spiked]);
            assert!(
                (um - spike.abs()).abs() < 1e-12 && (at_deg - (0.072 * 1234.0 + 0.0123)).abs() < 1e-9,
                "{um} {at_deg}"
            );
            // Whichever direction has it, and however its samples are sorted.
            let backwards: Vec<Radial> = spiked.into_iter().rev().collect();
            assert_eq!(hysteresis_of([&backwards, &plain]).0, um);
        }
    }
}
