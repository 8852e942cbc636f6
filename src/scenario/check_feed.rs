//! Feeds under limits of the axes, and feed overrides.

use std::ops::Range;

use super::FeedProfile;
use super::diagnostics::{Diagnostic, Problems};
use super::file::{RawAxisLimited, RawFeedrate};
use super::number_table::out_of_range;
use crate::feedrate::{
    AT, AxisLimits, FeedOverride, FeedrateError, MAX_OVERRIDE_STEPS, Motion, OF_EACH_AXIS, OverrideStep, TRANSITION,
};
use crate::optimize::Outcome;
use crate::parameters::OutOfRange;
use crate::path::Path;

/// The motion under axis limits, and none while the path is not known or the feed is wrong.
pub(super) fn axis_limited(
    raw: &RawAxisLimited,
    feed_mm_s: f64,
    path: Option<&dyn Path<2>>,
    problems: &mut Problems,
) -> Option<Planned> {
    let before = problems.len();
    for (parameter, point) in OF_EACH_AXIS.iter().zip([&raw.velocity_mm_s, &raw.acceleration_mm_s2, &raw.jerk_mm_s3]) {
        if let Some(error) = point.get_ref().0.iter().find_map(|&value| parameter.check(value).err()) {
            problems.push(out_of_range("", &error, point.span(), ""));
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
    let most = if matches!(profile, FeedProfile::AxisLimited(_)) { 100.0 } else { 200.0 };
    let mut steps = Vec::with_capacity(all.len());
    for raw in all {
        let (at_s, percent) = (*raw.at_s.get_ref(), *raw.percent.get_ref());
        if let Err(error) = AT.check(at_s) {
            problems.push(out_of_range("", &error, raw.at_s.span(), ""));
        }
        if !(0.0..=most).contains(&percent) {
            let help = if percent > most && percent <= 200.0 {
                "above 100 % the limits of the axes would not be kept: raise them, or feed_mm_s, instead"
            } else {
                "0 holds the feed, 50 halves it, 100 is the plan"
            };
            let error = OutOfRange::new("percent", percent, format!("from 0 to {most} %")).with_help(help);
            problems.push(out_of_range("", &error, raw.percent.span(), ""));
        }
        if let Some(given) = &raw.transition_s
            && let Err(error) = TRANSITION.check(*given.get_ref())
        {
            problems.push(out_of_range("", &error, given.span(), ""));
        }
        let transition_s = raw.transition_s.as_ref().map_or(0.0, |given| *given.get_ref());
        steps.push(OverrideStep { at_s, ratio: percent / 100.0, transition_s });
    }
    if problems.len() > before {
        return None;
    }
    let how = FeedOverride { steps };
    if how.steps.is_empty() {
        return Some(plan.clone());
    }
    match profile.with_override(plan, path?, &how) {
        Ok(motion) => return Some(motion),
        Err(error) => {
            let step = match error {
                FeedrateError::OverrideOrder { step, .. } | FeedrateError::HeldForEver { step, .. } => step,
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

pub(super) fn of_feedrate(error: &FeedrateError, span: Range<usize>) -> Diagnostic {
    let help = match error {
        FeedrateError::OutOfRange(error) => return out_of_range("", error, span, ""),
        FeedrateError::OverrideOrder { .. } => "put the changes of the override in the order of their at_s",
        FeedrateError::HeldForEver { .. } => "end the hold with a later [[feedrate.override]] that has percent = 100",
        FeedrateError::NotMonotone { .. } => {
            "lower n_c, shorten phase_s or raise feed_mm_s; or use [feedrate.profile.quintic]"
        }
        FeedrateError::BadShape { .. } | FeedrateError::Corner { .. } => {
            "limits of the axes need a path that is smooth up to its curvature; [feedrate.profile.jerk_limited] runs along any"
        }
    };
    Diagnostic::new(error.to_string()).at(span).help(help)
}

/// Motion, profile, and the search for its exponent.
pub(super) type Planned = (Motion, FeedProfile, Option<Outcome>);
