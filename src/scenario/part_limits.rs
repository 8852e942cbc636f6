//! Limits of a part, and of the run of its program.

use crate::limits::Limits;
use crate::parameters::{Entry, Parameter, Parameters, Range};

/// Limits that a machined part is held to; a missing one is not checked.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PartLimits {
    /// Largest excess of the part as the program has it \[µm\].
    pub nominal_scallop_um: Option<f64>,
    /// Its deepest gouge \[µm\].
    pub nominal_gouge_um: Option<f64>,
    /// Largest excess of the part as the machine cuts it \[µm\].
    pub as_cut_scallop_um: Option<f64>,
    /// Its deepest gouge \[µm\].
    pub as_cut_gouge_um: Option<f64>,
}

/// The limits of a part's file: those of the part, and those of the run that a program has.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FileLimits {
    pub(super) part: PartLimits,
    pub(super) run: Limits,
}

const fn of_part(key: &'static str, help: &'static str) -> Parameter {
    Parameter::new(key, "µm", Range::ABOVE_ZERO, help)
        .otherwise("not checked")
        .logarithmic(1.0, 1000.0)
        .hint("remove the line if this is not to be checked")
}

/// A limit that may be set.
macro_rules! entry {
    ($($field:ident).+, $parameter:expr) => {
        Entry {
            parameter: $parameter,
            get: |limits| limits.$($field).+,
            set: |limits, value| {
                limits.$($field).+ = Some(value);
                true
            },
        }
    };
}

/// The parameter of the run's limits that has this place in their list.
const fn of_run(index: usize) -> Parameter {
    Limits::ENTRIES[index].parameter
}

impl Parameters for FileLimits {
    const ABOUT: &'static str = "Limits of the part; a missing one is not checked";
    const ENTRIES: &'static [Entry<Self>] = &[
        entry!(
            part.nominal_scallop_um,
            of_part("limits.nominal_scallop_um", "Largest excess of the nominal part over the surface")
        ),
        entry!(part.nominal_gouge_um, of_part("limits.nominal_gouge_um", "Deepest gouge of the nominal part")),
        entry!(
            part.as_cut_scallop_um,
            of_part("limits.as_cut_scallop_um", "Largest excess of the part as this machine cuts it")
        ),
        entry!(
            part.as_cut_gouge_um,
            of_part("limits.as_cut_gouge_um", "Deepest gouge of the part as this machine cuts it")
        ),
        entry!(run.contour_error_um, of_run(0)),
        entry!(run.tracking_error_um, of_run(1)),
        entry!(run.voltage_v, of_run(2)),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limits_of_the_run_have_their_own_keys() {
        let limits = Limits {
            contour_error_um: Some(1.0),
            tracking_error_um: Some(2.0),
            voltage_v: Some(3.0),
            ..Limits::default()
        };
        let all = FileLimits { run: limits, ..FileLimits::default() };
        for (key, value) in [("contour_error_um", 1.0), ("tracking_error_um", 2.0), ("voltage_v", 3.0)] {
            let entry = FileLimits::ENTRIES.iter().find(|entry| entry.parameter.name() == key).unwrap();
            assert_eq!((entry.get)(&all), Some(value));
        }
    }
}
