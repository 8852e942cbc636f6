//! Feeds under limits of the axes, and feed overrides.

use super::FeedProfile;
use super::check::{Planned, Problems, of_feedrate};
use super::diagnostics::Diagnostic;
use super::file::{RawAxisLimited, RawFeedrate};
use crate::feedrate::{
    AxisLimits, FeedOverride, FeedrateError, MAX_OVERRIDE_STEPS, Motion, MotionSample, OverrideStep, Turning, positive,
};
use crate::interpolator::Setpoint;
use crate::path::{Cursor, Path};

/// How much of the axes' limits of acceleration and jerk a change of the feed override may use. Where the plan itself runs at its
/// limits, a change that uses no more of the jerk than the plan leaves would take many times as long.
const ACCELERATION: f64 = 1.001;
/// See [`ACCELERATION`].
const JERK: f64 = 1.05;

/// The motion under axis limits, and none while the path is not known or the feed is wrong.
pub(super) fn axis_limited(
    raw: &RawAxisLimited,
    feed_mm_s: f64,
    path: Option<&dyn Path<2>>,
    problems: &mut Problems,
) -> Option<Planned> {
    let before = problems.len();
    for (name, point) in [
        ("velocity_mm_s", &raw.velocity_mm_s),
        ("acceleration_mm_s2", &raw.acceleration_mm_s2),
        ("jerk_mm_s3", &raw.jerk_mm_s3),
    ] {
        if let Some(error) = point.get_ref().0.iter().find_map(|&value| positive(name, value).err()) {
            problems.push(of_feedrate(&error, point.span()));
        }
    }
    if problems.len() > before {
        return None;
    }
    let limits = AxisLimits {
        velocity_mm_s: raw.velocity_mm_s.get_ref().0,
        acceleration_mm_s2: raw.acceleration_mm_s2.get_ref().0,
        jerk_mm_s3: raw.jerk_mm_s3.get_ref().0,
    };
    let profile = FeedProfile::AxisLimited(limits);
    match profile.motion(path?, feed_mm_s) {
        Ok(motion) => return Some((motion, profile, None)),
        Err(error) => problems.push(of_feedrate(&error, raw.velocity_mm_s.span())),
    }
    None
}

/// The planned motion under the feed override.
pub(super) fn overridden(
    raw: &RawFeedrate,
    plan: &Motion,
    profile: FeedProfile,
    path: Option<&dyn Path<2>>,
    problems: &mut Problems,
) -> Option<Motion> {
    let before = problems.len();
    let all = &raw.feed_override;
    if let Some(beyond) = all.get(MAX_OVERRIDE_STEPS) {
        let message = format!("the feed override changes {} times; at most {MAX_OVERRIDE_STEPS} are taken", all.len());
        problems.push(Diagnostic::new(message).at(beyond.at_s.span()).help("leave some of the changes out"));
        return None;
    }
    // What a change may use by itself. Limits of the axes hold whichever way the path runs.
    let least = |values: [f64; 2]| values[0].min(values[1]);
    let (accel_mm_s2, jerk_mm_s3, most) = match profile {
        FeedProfile::AxisLimited(limits) => (least(limits.acceleration_mm_s2), least(limits.jerk_mm_s3), 100.0),
        FeedProfile::Phases(_) => (plan.peaks().accel_mm_s2, plan.peaks().jerk_mm_s3, 200.0),
    };
    let mut cursor = Cursor::default();
    let mut fits = |motion: &MotionSample| match (profile, path) {
        (FeedProfile::AxisLimited(limits), Some(path)) => {
            let at = Setpoint::of(0.0, motion, &path.frame(motion.s_mm, &mut cursor));
            (0..2).all(|axis| {
                at.acceleration_mm_s2[axis].abs() <= ACCELERATION * limits.acceleration_mm_s2[axis]
                    && at.jerk_vector_mm_s3[axis].abs() <= JERK * limits.jerk_mm_s3[axis]
            })
        }
        _ => true,
    };
    let (mut share, mut turning) = (1.0, Turning::START);
    let mut steps = Vec::with_capacity(all.len());
    for raw in all {
        let (at_s, percent) = (*raw.at_s.get_ref(), *raw.percent.get_ref());
        if !(0.0..=1e9).contains(&at_s) {
            let error = FeedrateError::OutOfRange { name: "at_s", value: at_s, needed: "a time from 0 to 1e9 s" };
            problems.push(of_feedrate(&error, raw.at_s.span()));
        }
        if !(0.0..=most).contains(&percent) {
            let problem = Diagnostic::new(format!("percent = {percent} is out of range: it must be from 0 to {most}"));
            let help = if percent > most && percent <= 200.0 {
                "above 100 % the limits of the axes would not be kept: raise them, or feed_mm_s, instead"
            } else {
                "0 holds the feed, 50 halves it, 100 is the plan"
            };
            problems.push(problem.at(raw.percent.span()).help(help));
        }
        let to = percent / 100.0;
        let fitting = || {
            let shortest = OverrideStep::shortest_transition_s(to - share, plan.feed_mm_s(), accel_mm_s2, jerk_mm_s3);
            if problems.len() > before { shortest } else { turning.fitting_s(plan, (at_s, to), shortest, &mut fits) }
        };
        let transition_s = raw.transition_s.as_ref().map_or_else(fitting, |given| *given.get_ref());
        if let Some(given) = &raw.transition_s
            && let Err(error) = positive("transition_s", transition_s)
        {
            problems.push(of_feedrate(&error, given.span()));
        }
        share = to;
        let step = OverrideStep { at_s, share: to, transition_s };
        turning.turn(&step);
        steps.push(step);
    }
    if problems.len() > before {
        return None;
    }
    match plan.with_override(&FeedOverride { steps }) {
        Ok(motion) => return Some(motion),
        Err(error) => {
            let step = match error {
                FeedrateError::OverrideTooSoon { step, .. } | FeedrateError::HeldForEver { step, .. } => step,
                _ => 0,
            };
            let place = match (&error, all.get(step)) {
                (FeedrateError::HeldForEver { .. }, Some(raw)) => raw.percent.span(),
                (_, Some(raw)) => raw.at_s.span(),
                _ => raw.feed_mm_s.span(),
            };
            problems.push(of_feedrate(&error, place));
        }
    }
    None
}
