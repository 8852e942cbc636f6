//! Exact steps of the linear machine, for a time and for its halves, quarters, … down to a 256th.
//!
//! With the state `z`, the voltage `u` constant and the torques at motor and table polynomials of time, a step of length `h` is
//! linear in `z`, `u` and the polynomials' coefficients: the matrix exponential of the augmented system
//! (C. Van Loan, "Computing integrals involving the matrix exponential", IEEE Transactions on Automatic Control 23, 1978).
//! It is computed once, by scaling and squaring; every intermediate square is kept, since it is the step over a fraction of `h`.
//! What is squared is `D = exp(hA) - I`, by `(I + D)² - I = 2D + D²`, so that short steps lose no digits.

use nalgebra::SMatrix;

/// Halvings of a step: an event is located to a 2⁻⁸th of it (4 µs at a period of 1 ms, in which a screw that closes its gap with
/// 10 mm/s goes 40 nm too deep at most), and the table's coming to rest inside of that by a straight line.
pub(super) const LEVELS: usize = 8;

/// Components of the state: motor torque, motor speed, twist, table speed, table position.
pub(super) const STATES: usize = 5;
/// State, voltage, four coefficients of the motor's torque, two of the table's.
const AUGMENTED: usize = STATES + 1 + 4 + 2;

/// Lanes of a column: the states, padded to whole vector registers.
pub(super) const LANES: usize = 8;
/// A column or a state.
pub(super) type Column = [f64; LANES];

/// Index of a state.
pub(super) const TORQUE: usize = 0;
pub(super) const MOTOR: usize = 1;
pub(super) const TWIST: usize = 2;
pub(super) const TABLE: usize = 3;
pub(super) const PLACE: usize = 4;

/// The linear machine, everything referred to the motor shaft.
#[derive(Debug, Clone, Copy)]
pub(super) struct Linear {
    /// Torque at rest per volt \[N m/V\].
    pub(super) torque_per_volt: f64,
    /// Rate of the current loop \[1/s\]; none: the torque follows the voltage at once.
    pub(super) current_rate: Option<f64>,
    /// Inertia of the motor's side, or of the whole where the axis is rigid \[kg m²\].
    pub(super) motor_inertia: f64,
    /// Inertia of the table; none: rigid.
    pub(super) table_inertia: Option<f64>,
    /// Viscous friction of the motor \[N m s/rad\].
    pub(super) motor_viscous: f64,
    /// Viscous friction of the table \[N m s/rad\].
    pub(super) table_viscous: f64,
    /// Stiffness of the screw \[N m/rad\].
    pub(super) stiffness: f64,
    /// Its damping \[N m s/rad\].
    pub(super) damping: f64,
}

impl Linear {
    /// Rates of the state, and how voltage, motor torque and table torque act on it.
    fn rates(&self, free: bool, stuck: bool) -> (SMatrix<f64, STATES, STATES>, SMatrix<f64, STATES, 3>) {
        let mut a = SMatrix::<f64, STATES, STATES>::zeros();
        let mut b = SMatrix::<f64, STATES, 3>::zeros();
        if let Some(rate) = self.current_rate {
            a[(TORQUE, TORQUE)] = -rate;
            b[(TORQUE, 0)] = rate * self.torque_per_volt;
        }
        // The motor's torque is a state behind a current loop, else the voltage's.
        let (from_state, from_voltage) =
            if self.current_rate.is_some() { (1.0, 0.0) } else { (0.0, self.torque_per_volt) };
        if let Some(table_inertia) = self.table_inertia {
            a[(MOTOR, TORQUE)] = from_state / self.motor_inertia;
            b[(MOTOR, 0)] = from_voltage / self.motor_inertia;
            b[(MOTOR, 1)] = 1.0 / self.motor_inertia;
            let (k, c) = if free { (0.0, 0.0) } else { (self.stiffness, self.damping) };
            a[(MOTOR, MOTOR)] = -(self.motor_viscous + c) / self.motor_inertia;
            a[(MOTOR, TWIST)] = -k / self.motor_inertia;
            a[(TWIST, MOTOR)] = 1.0;
            if !stuck {
                a[(MOTOR, TABLE)] = c / self.motor_inertia;
                a[(TWIST, TABLE)] = -1.0;
                a[(TABLE, MOTOR)] = c / table_inertia;
                a[(TABLE, TWIST)] = k / table_inertia;
                a[(TABLE, TABLE)] = -(self.table_viscous + c) / table_inertia;
                a[(PLACE, TABLE)] = 1.0;
                b[(TABLE, 2)] = 1.0 / table_inertia;
            }
        } else if !stuck {
            // One body: the motor's speed is the table's.
            for row in [MOTOR, TABLE] {
                a[(row, TORQUE)] = from_state / self.motor_inertia;
                b[(row, 0)] = from_voltage / self.motor_inertia;
                b[(row, 1)] = 1.0 / self.motor_inertia;
                b[(row, 2)] = 1.0 / self.motor_inertia;
                a[(row, TABLE)] = -(self.motor_viscous + self.table_viscous) / self.motor_inertia;
            }
            a[(PLACE, TABLE)] = 1.0;
        }
        (a, b)
    }

    /// The steps of one mode over `h_s`, its half, its quarter, …
    pub(super) fn ladder(&self, h_s: f64, free: bool, stuck: bool) -> Vec<Step> {
        let (a, b) = self.rates(free, stuck);
        let mut g = SMatrix::<f64, AUGMENTED, AUGMENTED>::zeros();
        g.fixed_view_mut::<STATES, STATES>(0, 0).copy_from(&(a * h_s));
        for (input, column) in [STATES, STATES + 1, STATES + 5].into_iter().enumerate() {
            g.fixed_view_mut::<STATES, 1>(0, column).copy_from(&(b.column(input) * h_s));
        }
        // Chains: the column of a coefficient answers to τⁿ/n!, τ from 0 to 1 over the step.
        for row in [STATES + 1, STATES + 2, STATES + 3, STATES + 5] {
            g[(row, row + 1)] = 1.0;
        }
        // Fine enough that the series ends after a few terms.
        let mut levels = LEVELS;
        let mut norm = g.abs().row_sum().max() * halvings(LEVELS);
        while norm > 0.0625 && levels < 1000 {
            norm *= 0.5;
            levels += 1;
        }
        let x = g * halvings(levels);
        let mut d = x;
        let mut term = x;
        for n in 2..=12 {
            term = term * x / f64::from(n);
            d += term;
        }
        let mut steps = Vec::with_capacity(LEVELS + 1);
        loop {
            if levels <= LEVELS {
                steps.push(Step::of(&d, levels, h_s));
            }
            if levels == 0 {
                break;
            }
            d = d * 2.0 + d * d;
            levels -= 1;
        }
        steps.reverse();
        steps
    }
}

/// One exact step: what each number adds to the state.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))] // a column is a cache line
pub(super) struct Step {
    /// Torque, motor speed, twist, table speed.
    pub(super) state: [Column; 4],
    /// Voltage until it switches inside the step, and from there on.
    pub(super) voltage: [Column; 2],
    /// Motor torque at the beginning, and its slope times `h`, carried on in a straight line.
    pub(super) motor: [Column; 2],
    /// What the motor torque at the end, and its slope there times `h`, are more than carried on (a cubic through both).
    pub(super) motor_end: [Column; 2],
    /// Table torque at the beginning, and its increase over the step.
    pub(super) table: [Column; 2],
    /// Length \[s\].
    pub(super) h_s: f64,
}

impl Step {
    /// The step over a whole period in which the voltage switches: `all` has the period's length, `before` and `after` those of the
    /// parts.
    pub(super) fn joined(all: &Self, before: &Self, after: &Self) -> Self {
        // What the first voltage does by the switch goes on from there as any state does.
        let first = before.voltage[1];
        let mut late = first;
        for (column, state) in after.state.iter().zip(first) {
            add(&mut late, column, state);
        }
        Self { voltage: [late, after.voltage[1]], ..*all }
    }

    /// No step at all.
    pub(super) const NONE: Self = Self {
        state: [[0.0; LANES]; 4],
        voltage: [[0.0; LANES]; 2],
        motor: [[0.0; LANES]; 2],
        motor_end: [[0.0; LANES]; 2],
        table: [[0.0; LANES]; 2],
        h_s: 0.0,
    };

    fn of(d: &SMatrix<f64, AUGMENTED, AUGMENTED>, level: usize, h_s: f64) -> Self {
        let column =
            |index: usize| -> Column { std::array::from_fn(|row| if row < STATES { d[(row, index)] } else { 0.0 }) };
        // The chains count time in whole steps; a shorter step counts in its own length.
        let power = |first: usize, n: usize| {
            let scale = 1.0 / halvings(level * n);
            column(first + n).map(|x| x * scale)
        };
        let [m0, m1, m2, m3] = [0, 1, 2, 3].map(|n| power(STATES + 1, n));
        let combine = |x: f64, y: f64| -> Column { std::array::from_fn(|row| x * m2[row] + y * m3[row]) };
        Self {
            state: [TORQUE, MOTOR, TWIST, TABLE].map(column),
            voltage: [[0.0; LANES], column(STATES)],
            motor: [m0, m1],
            // Hermite: 3τ² - 2τ³ and τ³ - τ².
            motor_end: [combine(6.0, -12.0), combine(-2.0, 6.0)],
            table: [power(STATES + 5, 0), power(STATES + 5, 1)],
            h_s: h_s * halvings(level),
        }
    }
}

/// `2⁻ⁿ`, exactly.
pub(super) fn halvings(n: usize) -> f64 {
    (0..n).fold(1.0, |half, _| 0.5 * half)
}

/// `to += column * factor`.
#[inline(always)]
pub(super) fn add(to: &mut Column, column: &Column, factor: f64) {
    for lane in 0..LANES {
        to[lane] = column[lane].mul_add(factor, to[lane]);
    }
}
