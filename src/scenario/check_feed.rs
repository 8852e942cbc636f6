//! Feeds under limits of the axes, and feed overrides.

use super::FeedProfile;
use super::check::{Planned, Problems, of_feedrate};
use super::diagnostics::Diagnostic;
use super::file::{RawAxisLimited, RawFeedrate};
use crate::feedrate::{AxisLimits, FeedOverride, FeedrateError, MAX_OVERRIDE_STEPS, Motion, OverrideStep, positive};
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
    let most = if matches!(profile, FeedProfile::AxisLimited(_)) { 100.0 } else { 200.0 };
    let mut steps = Vec::with_capacity(all.len());
    for raw in all {
        let (at_s, percent) = (*raw.at_s.get_ref(), *raw.percent.get_ref());
        if !(0.0..=1e9).contains(&at_s) {
            let error = FeedrateError::OutOfRange(OutOfRange::new("at_s", at_s, "a time from 0 to 1e9 s"));
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
        if let Some(given) = &raw.transition_s
            && let Err(error) = positive("transition_s", *given.get_ref())
        {
            problems.push(of_feedrate(&error, given.span()));
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
