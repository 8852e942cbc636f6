//! The steps of an override as they are asked for, and what comes of them.

/// Most steps of an override.
pub const MAX_OVERRIDE_STEPS: usize = 1000;

/// Highest override ratio.
pub const MAX_OVERRIDE: f64 = 2.0;

/// From a time on, another override ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverrideStep {
    /// When the feed scale begins to change \[s\], in the time of the run.
    pub at_s: f64,
    /// Override ratio that it changes to: 1 is the plan, 0 a feed hold, at most [`MAX_OVERRIDE`].
    pub ratio: f64,
    /// The shortest length of the change \[s\]; 0: as short as the limits allow. Where they need more it takes longer.
    pub transition_s: f64,
}

/// Changes of the feed override during a run.
///
/// The plan `s(τ)` is run at the feed scale `f(t) = dτ/dt`, 1 at first, so that along the path
///
/// ```text
/// v = f v(τ)      a = f² a(τ) + f' v(τ)      j = f³ j(τ) + 3 f f' a(τ) + f'' v(τ)
/// ```
///
/// The path is the same and no point of it is skipped. At each step the feed scale goes to the next ratio as fast as the limits allow that
/// the plan itself keeps: the acceleration and the jerk that it reaches along the path ([`Motion::with_override`](crate::feedrate::Motion::with_override)), or the limits of every axis
/// ([`AxisLimited::with_override`](crate::feedrate::AxisLimited::with_override)), to 0.1 %. `f''` is constant over short steps. Each step is the
/// largest that the limits allow now and from which the feed scale can still come to a steady ratio, within the limits, on the plan ahead;
/// a steady ratio of at most 1 always keeps them. Where the plan leaves nothing, in a deceleration at its limit, say, the change
/// waits: no machine could slow down faster there.
///
/// A ratio above 1 would ask for its square in acceleration and its cube in jerk. It is therefore used while the plan cruises at a steady feed: the
/// ramps of the plan run at 1, and so does a motion that has no cruise. A change may come while the one before still goes on. A step at
/// the very start, where the tool stands, acts at once.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FeedOverride {
    /// The steps in the order of time.
    pub steps: Vec<OverrideStep>,
}

/// Result of a change of the override.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverrideChange {
    /// When it began \[s\].
    pub at_s: f64,
    /// The override ratio that was asked for.
    pub ratio: f64,
    /// The shortest length that was asked for \[s\]; 0: as short as the limits allow.
    pub asked_s: f64,
    /// How long it took \[s\], to its ratio or to where the next change or the end of the motion cut it off.
    pub transition_s: f64,
    /// The ratio that it came to: `ratio`, but where it was cut off, or where limits allow no ratio above 1.
    pub reached: f64,
    /// Whether it came after the end of the motion, so that it changed nothing.
    pub after_the_end: bool,
}
