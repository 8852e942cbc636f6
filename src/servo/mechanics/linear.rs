//! The machine as the analysis takes it: linear, free to move and in contact.

use nalgebra::{DMatrix, DVector};

use super::grid::{Linear, MOTOR, PLACE, Step, TABLE, TORQUE, TWIST};
use super::{AxisParameters, Effects};

/// One control period of a machine without friction but its viscous part, backlash, ripple and force: with the voltage `u₁` up to the switch
/// and `u₂` from there on, `z += step z + before u₁ + after u₂`. States that the machine does not have are left out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LinearMachine {
    /// `exp(AΔt) - I`: short periods lose no digits.
    pub(crate) step: DMatrix<f64>,
    /// Increments of the state for each volt of `u₁`.
    pub(crate) before: DVector<f64>,
    /// The same of `u₂`.
    pub(crate) after: DVector<f64>,
    /// Index of the motor's speed \[rad/s\] (of the one body, where the axis is rigid).
    pub(crate) motor: usize,
    /// Index of the twist \[rad\]: the motor is that much ahead of the table.
    pub(crate) twist: Option<usize>,
    /// Index of the table's place \[rad\].
    pub(crate) place: usize,
}

impl LinearMachine {
    /// - `switch_share`: the voltage switches at this share of the period (0: at its beginning)
    pub(crate) fn new(axis: &AxisParameters, effects: &Effects, period_s: f64, switch_share: f64) -> Self {
        let linear = Linear::new(axis, effects);
        let mut kept = Vec::with_capacity(5);
        if linear.current_rate.is_some() {
            kept.push(TORQUE);
        }
        let flexible = linear.table_inertia.is_some();
        if flexible {
            kept.extend([MOTOR, TWIST]);
        }
        kept.extend([TABLE, PLACE]);
        let switch_s = switch_share * period_s;
        let all = linear.step(period_s, false, false);
        let late = linear.step(period_s - switch_s, false, false);
        let early = linear.step(switch_s, false, false);
        let [before, after] = Step::joined(&all, &early, &late).voltage;
        let of = |column: &[f64; super::LANES]| DVector::from_iterator(kept.len(), kept.iter().map(|&row| column[row]));
        let step = DMatrix::from_fn(kept.len(), kept.len(), |row, column| {
            all.state.get(kept[column]).map_or(0.0, |from| from[kept[row]])
        });
        let index = |state: usize| kept.iter().position(|&kept| kept == state);
        let place = index(PLACE).unwrap_or(0);
        let motor = index(if flexible { MOTOR } else { TABLE }).unwrap_or(0);
        Self { step, before: of(&before), after: of(&after), motor, twist: index(TWIST), place }
    }
}
