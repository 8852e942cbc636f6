//! Exact steps of the linear machine, over 1, 2, … 32 ticks.
//!
//! With the state `z`, the voltage `u` constant and the torques at motor and table polynomials of time, a step of length `h` is
//! linear in `z`, `u` and the polynomials' coefficients: the matrix exponential of the augmented system
//! (C. Van Loan, "Computing integrals involving the matrix exponential", IEEE Transactions on Automatic Control 23, 1978).
//! That over one tick is computed once, by scaling and squaring, the others by joining steps. What is joined is
//! `D = exp(hA) - I`, by `(I + E)(I + D) - I = D + E + E D`, so that short steps lose no digits.

use nalgebra::SMatrix;

use crate::servo::AxisParameters;
use crate::servo::effects::Effects;

/// Ticks of the longest step: events are located to one (31 µs of a period of 1 ms), and inside of it by what acts meanwhile.
pub(super) const TICKS: usize = 32;

/// Components of the state: motor torque, motor speed, twist, table speed, table position.
pub(super) const STATES: usize = 5;
/// Coefficients of the motor's torque: a quintic. Of the table's: a cubic.
const AT_MOTOR: usize = STATES + 1;
const AT_TABLE: usize = AT_MOTOR + 6;
/// State, voltage and both.
const AUGMENTED: usize = AT_TABLE + 4;

/// Lanes of a column: the states and what follows from them, padded to whole vector registers.
pub(super) const LANES: usize = 8;
/// A column or a state.
pub(super) type Column = [f64; LANES];

/// Index of a state.
pub(super) const TORQUE: usize = 0;
pub(super) const MOTOR: usize = 1;
pub(super) const TWIST: usize = 2;
pub(super) const TABLE: usize = 3;
pub(super) const PLACE: usize = 4;
/// What follows from the states, and comes with them: the angle of the motor \[rad\], the torque of the screw \[N m\].
pub(super) const ANGLE: usize = 5;
pub(super) const SPRING: usize = 6;

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
    /// That of an axis with what is linear of its effects.
    pub(super) fn new(axis: &AxisParameters, effects: &Effects) -> Self {
        let (drive, plant) = (&axis.drive, effects.plant(&axis.plant));
        let table_inertia = effects.two_mass.map(|two_mass| two_mass.table_inertia_kg_m2(drive));
        Self {
            torque_per_volt: 1.0 / drive.torque_to_voltage_v_nm,
            current_rate: effects.current_loop.map(|c| 2.0 * std::f64::consts::PI * c.bandwidth_hz),
            motor_inertia: plant.inertia_kg_m2(drive) - table_inertia.unwrap_or(0.0),
            table_inertia,
            motor_viscous: plant.viscous_nm_s_rad(drive),
            table_viscous: effects.friction.map_or(0.0, |friction| friction.curve().viscous_nm_s_rad),
            stiffness: effects.two_mass.map_or(0.0, |two_mass| two_mass.stiffness_nm_rad(drive)),
            damping: effects.two_mass.map_or(0.0, |two_mass| two_mass.damping_nm_s_rad(drive)),
        }
    }

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

    /// The step of one mode over `h_s`.
    fn over(&self, h_s: f64, free: bool, stuck: bool) -> Joined {
        let (a, b) = self.rates(free, stuck);
        let mut rates = [[0.0; AUGMENTED]; STATES];
        let mut norm = 1.0_f64;
        for (row, rates) in rates.iter_mut().enumerate() {
            for (column, rate) in rates.iter_mut().enumerate().take(STATES) {
                *rate = h_s * a[(row, column)];
            }
            for (input, column) in [STATES, AT_MOTOR, AT_TABLE].into_iter().enumerate() {
                rates[column] = h_s * b[(row, input)];
            }
            norm = norm.max(rates.iter().map(|x| x.abs()).sum());
        }
        // Fine enough that the series ends after a few terms.
        let (mut halvings, mut share) = (0, 1.0);
        while norm * share > 0.0625 && halvings < 1000 {
            share *= 0.5;
            halvings += 1;
        }
        let rates = rates.map(|row| row.map(|x| share * x));
        let (mut term, mut rows) = (rates, rates);
        for n in 2..=12 {
            for (term, sum) in term.iter_mut().zip(&mut rows) {
                *term = times(term, &rates, share).map(|x| x / f64::from(n));
                for (sum, term) in sum.iter_mut().zip(&*term) {
                    *sum += term;
                }
            }
        }
        let mut joined = Joined { rows, ticks: share };
        for _ in 0..halvings {
            joined = Joined::of(&joined, &joined);
        }
        joined
    }

    /// Torque from the screw onto the table \[N m\], when it is in contact.
    #[inline(always)]
    pub(super) fn spring(&self, z: &Column) -> f64 {
        self.stiffness * z[TWIST] + self.damping * (z[MOTOR] - z[TABLE])
    }

    /// The steps of one mode over 1, 2, … [`TICKS`] ticks.
    pub(super) fn grid(&self, tick_s: f64, free: bool, stuck: bool) -> Vec<Step> {
        let tick = self.over(tick_s, free, stuck);
        let mut joined: Vec<Joined> = Vec::with_capacity(TICKS);
        joined.push(tick);
        for n in 2..=TICKS {
            // Of two halves: the fewest roundings.
            joined.push(Joined::of(&joined[n / 2 - 1], &joined[n - n / 2 - 1]));
        }
        joined.iter().map(|joined| joined.step(tick_s, self, free)).collect()
    }

    /// The step of one mode over `h_s`, for good.
    pub(super) fn step(&self, h_s: f64, free: bool, stuck: bool) -> Step {
        self.over(h_s, free, stuck).step(h_s, self, free)
    }
}

/// A row times the matrix of the augmented rates, of which `rates` are the rows of the state.
///
/// The others are chains: the column of a coefficient answers to τⁿ/n!, τ from 0 to 1 over the step, of which this is a share.
fn times(row: &[f64; AUGMENTED], rates: &[[f64; AUGMENTED]; STATES], share: f64) -> [f64; AUGMENTED] {
    let mut product = [0.0; AUGMENTED];
    for (factor, rates) in row.iter().zip(rates) {
        for (to, rate) in product.iter_mut().zip(rates) {
            *to += factor * rate;
        }
    }
    for column in (AT_MOTOR + 1..AT_TABLE).chain(AT_TABLE + 1..AUGMENTED) {
        product[column] += row[column - 1] * share;
    }
    product
}

/// The rows of the state of `D`; time counts in ticks.
struct Joined {
    rows: [[f64; AUGMENTED]; STATES],
    ticks: f64,
}

impl Joined {
    /// One step and then another.
    fn of(first: &Self, then: &Self) -> Self {
        let mut rows = [[0.0; AUGMENTED]; STATES];
        for (row, (first_row, then_row)) in rows.iter_mut().zip(first.rows.iter().zip(&then.rows)) {
            for (column, to) in row.iter_mut().enumerate() {
                *to = first_row[column] + then_row[column];
            }
            for (factor, of_state) in then_row.iter().zip(&first.rows) {
                for (to, from) in row.iter_mut().zip(of_state) {
                    *to += factor * from;
                }
            }
            // A coefficient of time has by then become part of those before it: τⁿ/n! is Σ (t^k/k!) (τ - t)^(n-k)/(n-k)!.
            for chain in [AT_MOTOR..AT_TABLE, AT_TABLE..AUGMENTED] {
                for column in chain.clone() {
                    let mut share = 1.0;
                    for (k, earlier) in (chain.start..column).rev().enumerate() {
                        share *= first.ticks / (k + 1) as f64;
                        row[column] += then_row[earlier] * share;
                    }
                }
            }
        }
        Self { rows, ticks: first.ticks + then.ticks }
    }

    fn step(&self, tick_s: f64, linear: &Linear, free: bool) -> Step {
        let column = |index: usize| -> Column {
            let mut column: Column = std::array::from_fn(|row| self.rows.get(row).map_or(0.0, |row| row[index]));
            column[ANGLE] = column[PLACE] + column[TWIST];
            column[SPRING] = if free { 0.0 } else { linear.spring(&column) };
            column
        };
        // The chains count time in ticks; a step counts in its own length.
        let power = |first: usize, n: usize| {
            let scale = (0..n).fold(1.0, |scale, _| scale / self.ticks);
            column(first + n).map(|x| x * scale)
        };
        let mix = |columns: &[(f64, Column)]| -> Column {
            std::array::from_fn(|row| columns.iter().map(|(factor, column)| factor * column[row]).sum())
        };
        let [m0, m1, m2, m3, m4, m5] = [0, 1, 2, 3, 4, 5].map(|n| power(AT_MOTOR, n));
        let [t0, t1, t2, t3] = [0, 1, 2, 3].map(|n| power(AT_TABLE, n));
        let quintic = |x: f64, y: f64, z: f64| mix(&[(x, m3), (y, m4), (z, m5)]);
        let cubic = |x: f64, y: f64| mix(&[(x, t2), (y, t3)]);
        Step {
            state: [TORQUE, MOTOR, TWIST, TABLE].map(column),
            voltage: [[0.0; LANES], column(STATES)],
            motor: [m0, m1, m2],
            // Hermite: 10τ³ - 15τ⁴ + 6τ⁵, -4τ³ + 7τ⁴ - 3τ⁵ and (τ³ - 2τ⁴ + τ⁵)/2.
            motor_end: [quintic(60.0, -360.0, 720.0), quintic(-24.0, 168.0, -360.0), quintic(3.0, -24.0, 60.0)],
            table: [t0, t1],
            // 3τ² - 2τ³ and τ³ - τ².
            table_end: [cubic(6.0, -12.0), cubic(-2.0, 6.0)],
            h_s: self.ticks * tick_s,
        }
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
    /// Motor torque at the beginning, its slope times `h` and its curvature times `h²`, carried on in a parabola.
    pub(super) motor: [Column; 3],
    /// What the motor torque at the end, its slope and curvature there are more than carried on (a quintic through both ends).
    pub(super) motor_end: [Column; 3],
    /// Table torque at the beginning, and its slope times `h`, carried on in a straight line.
    pub(super) table: [Column; 2],
    /// What the table torque at the end, and its slope there, are more than carried on (a cubic through both ends).
    pub(super) table_end: [Column; 2],
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
        motor: [[0.0; LANES]; 3],
        motor_end: [[0.0; LANES]; 3],
        table: [[0.0; LANES]; 2],
        table_end: [[0.0; LANES]; 2],
        h_s: 0.0,
    };
}

/// `to += column * factor`.
#[inline(always)]
pub(super) fn add(to: &mut Column, column: &Column, factor: f64) {
    for lane in 0..LANES {
        to[lane] = column[lane].mul_add(factor, to[lane]);
    }
}
