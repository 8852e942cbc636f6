//! Every numeric key of a scenario: what it is, and its value in a checked scenario.

use std::sync::LazyLock;

use super::{FeedProfile, Scenario};
use crate::feedrate::{FEED, Profile};
use crate::limits::Limits;
use crate::parameters::{AXIS_NAMES, Entry, Parameter, Parameters};
use crate::servo::compensation::CrossCouplingGains;
use crate::servo::{AxisParameter, LoopSettings, axis_parameters};

/// Where the value of a key is kept.
#[derive(Debug)]
enum Place {
    Feed,
    Profile(&'static Entry<Profile>),
    Control(&'static Entry<LoopSettings>),
    Coupling(&'static Entry<CrossCouplingGains>),
    Axis(usize, &'static AxisParameter),
    Limits(&'static Entry<Limits>),
}

/// A numeric key of a scenario.
///
/// A value is changed in the text, [`Document::set`](super::Document::set) with [`ScenarioParameter::setting`], so that everything that
/// follows from it is computed anew and checked; or, for an axis that is simulated by itself, with [`AxisParameter::set`].
#[derive(Debug)]
pub struct ScenarioParameter {
    /// The full key: `axes.x.pdff.kpp`.
    pub key: String,
    /// What it is. (Its own key, of an axis, is the part below `axes.x`.)
    pub parameter: &'static Parameter,
    place: Place,
}

impl ScenarioParameter {
    /// The parameter of a full key.
    pub fn find(key: &str) -> Option<&'static Self> {
        scenario_parameters().iter().find(|known| known.key == key)
    }

    /// Number of the axis that it belongs to, from 0; none where it belongs to none.
    pub fn axis(&self) -> Option<usize> {
        match self.place {
            Place::Axis(axis, _) => Some(axis),
            _ => None,
        }
    }

    /// The parameter of an axis that it is.
    pub fn of_axis(&self) -> Option<&'static AxisParameter> {
        match self.place {
            Place::Axis(_, parameter) => Some(parameter),
            _ => None,
        }
    }

    /// Its value in a scenario, given or default; none where the scenario has not chosen its table, does not set the limit, or keeps only
    /// what follows from it (the mechanics of a plant).
    pub fn get(&self, scenario: &Scenario) -> Option<f64> {
        match &self.place {
            Place::Feed => Some(scenario.feed_mm_s),
            Place::Profile(entry) => match &scenario.profile {
                FeedProfile::Phases(profile) => (entry.get)(profile),
                FeedProfile::AxisLimited(_) => None,
            },
            Place::Control(entry) => (entry.get)(&scenario.settings),
            Place::Coupling(entry) => (entry.get)(scenario.cross_coupling.as_ref()?),
            Place::Axis(axis, parameter) => parameter.get(scenario.axes.get(*axis)?, scenario.drives.get(*axis)?),
            Place::Limits(entry) => (entry.get)(&scenario.limits),
        }
    }

    /// `KEY=VALUE` as `--set` takes it.
    pub fn setting(&self, value: f64) -> String {
        // (A whole number is written as one, any other so that it reads back as the same.)
        if self.parameter.range.whole { format!("{}={value}", self.key) } else { format!("{}={value:e}", self.key) }
    }
}

/// Every numeric key of a scenario, in the order of the reference; those of X before those of Y.
pub fn scenario_parameters() -> &'static [ScenarioParameter] {
    static ALL: LazyLock<Vec<ScenarioParameter>> = LazyLock::new(all);
    &ALL
}

fn all() -> Vec<ScenarioParameter> {
    let mut list = vec![of(&FEED, Place::Feed)];
    list.extend(Profile::ENTRIES.iter().map(|entry| of(&entry.parameter, Place::Profile(entry))));
    list.extend(LoopSettings::ENTRIES.iter().map(|entry| of(&entry.parameter, Place::Control(entry))));
    list.extend(CrossCouplingGains::ENTRIES.iter().map(|entry| of(&entry.parameter, Place::Coupling(entry))));
    for (axis, name) in AXIS_NAMES.iter().enumerate().take(2) {
        list.extend(axis_parameters().iter().map(|known| ScenarioParameter {
            key: format!("axes.{name}.{}", known.parameter.key),
            parameter: known.parameter,
            place: Place::Axis(axis, known),
        }));
    }
    list.extend(Limits::ENTRIES.iter().map(|entry| of(&entry.parameter, Place::Limits(entry))));
    list
}

fn of(parameter: &'static Parameter, place: Place) -> ScenarioParameter {
    ScenarioParameter { key: parameter.key.to_owned(), parameter, place }
}
