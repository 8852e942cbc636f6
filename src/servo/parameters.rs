//! What an axis is made of: plant, drive, controller gains, and how the loop samples them.

use crate::parameters::{Entry, OutOfRange, Parameter, Parameters, Range, parameters};

/// First-order velocity plant `ω(s)/u(s) = K/(1 + τ s)` of a motor with its ballscrew axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plant {
    /// Gain `K` \[rad/s/V\], positive.
    pub gain_rad_s_v: f64,
    /// Time constant `τ` \[s\], positive.
    pub time_constant_s: f64,
}

parameters!(
    "Identified velocity plant K/(1 + τ s)",
    Plant {
        gain_rad_s_v: Parameter::new(
            "plant.first_order.gain_rad_s_v",
            "rad/s/V",
            Range::POSITIVE,
            "Gain K of the velocity plant K/(1 + τ s): motor speed per volt",
        )
        .logarithmic(1.0, 1000.0)
        .hint("give the motor's speed per volt in rad/s/V, such as 83.0"),
        time_constant_s: Parameter::new(
            "plant.first_order.time_constant_s",
            "s",
            Range::POSITIVE,
            "Time constant τ of the velocity plant",
        )
        .logarithmic(0.001, 10.0)
        .hint("give the plant's time constant in seconds, such as 0.2"),
    }
);

impl Plant {
    /// The plant of an axis given by its mechanics: `J ω' + B ω = T` with `J = J_m + m r_g²` and `T = u / k_T`, so that
    /// `K = 1/(k_T B)` and `τ = J/B`.
    ///
    /// - `mass_kg`: moved mass `m`; `inertia_kg_m2`: rotating inertia `J_m`; `viscous_nm_s_rad`: friction `B`
    /// - `drive`: transmission `r_g` and torque-to-voltage factor `k_T`
    pub fn from_mechanics(mass_kg: f64, inertia_kg_m2: f64, viscous_nm_s_rad: f64, drive: &Drive) -> Self {
        let transmission_m_rad = drive.transmission_mm_rad / 1000.0;
        let inertia = inertia_kg_m2 + mass_kg * transmission_m_rad * transmission_m_rad;
        Self {
            gain_rad_s_v: 1.0 / (drive.torque_to_voltage_v_nm * viscous_nm_s_rad),
            time_constant_s: inertia / viscous_nm_s_rad,
        }
    }

    /// Viscous friction `B = 1/(k_T K)` at the motor \[N m s/rad\], what [`from_mechanics`](Self::from_mechanics) was given.
    pub fn viscous_nm_s_rad(&self, drive: &Drive) -> f64 {
        1.0 / (drive.torque_to_voltage_v_nm * self.gain_rad_s_v)
    }

    /// Inertia `J = τ B` of the whole axis at the motor \[kg m²\].
    pub fn inertia_kg_m2(&self, drive: &Drive) -> f64 {
        self.time_constant_s * self.viscous_nm_s_rad(drive)
    }
}

/// An axis by its mechanics, what [`Plant::from_mechanics`] takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanics {
    /// Moved mass `m` \[kg\], not negative.
    pub mass_kg: f64,
    /// Rotating inertia `J_m` \[kg m²\], not negative.
    pub inertia_kg_m2: f64,
    /// Viscous friction `B` at the motor \[N m s/rad\], positive.
    pub viscous_friction_nm_s_rad: f64,
}

/// What to do about a value of the mechanics.
const MECHANICS: &str = "units are in the key's name: kg, kg m², N m s/rad";

parameters!(
    "Motor and mechanics: the same plant from moved mass, rotating inertia and friction",
    Mechanics {
        mass_kg: Parameter::new("plant.mechanics.mass_kg", "kg", Range::FROM_ZERO, "Moved mass")
            .logarithmic(1.0, 1000.0)
            .hint(MECHANICS),
        inertia_kg_m2: Parameter::new(
            "plant.mechanics.inertia_kg_m2",
            "kg m²",
            Range::FROM_ZERO,
            "Rotating inertia of motor, coupling and screw",
        )
        .logarithmic(1e-6, 0.1)
        .hint(MECHANICS),
        viscous_friction_nm_s_rad: Parameter::new(
            "plant.mechanics.viscous_friction_nm_s_rad",
            "N m s/rad",
            Range::ABOVE_ZERO,
            "Viscous friction at the motor",
        )
        .logarithmic(1e-5, 1.0)
        .hint(MECHANICS),
    }
);

/// What lies between the controller's torque and the table: amplifier and ballscrew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Travel per motor angle `r_g` \[mm/rad\], positive.
    pub transmission_mm_rad: f64,
    /// Torque-to-voltage factor `k_T` \[V/(N m)\], positive.
    pub torque_to_voltage_v_nm: f64,
    /// Output limit of the amplifier, either sign \[V\], positive.
    pub voltage_limit_v: f64,
}

parameters!(
    "Amplifier and ballscrew",
    Drive {
        transmission_mm_rad: Parameter::new(
            "drive.transmission_mm_rad",
            "mm/rad",
            Range::POSITIVE,
            "Travel of the table per motor angle",
        )
        .or(1.59)
        .logarithmic(0.1, 10.0)
        .hint("give the travel per motor angle in mm/rad: the screw's lead divided by 2π"),
        torque_to_voltage_v_nm: Parameter::new(
            "drive.torque_to_voltage_v_nm",
            "V/(N m)",
            Range::POSITIVE,
            "Voltage per commanded torque",
        )
        .otherwise("1/0.716")
        .logarithmic(0.1, 100.0)
        .hint("give the voltage per torque in V/(N m), such as 1.4"),
        voltage_limit_v: Parameter::new(
            "drive.voltage_limit_v",
            "V",
            Range::POSITIVE,
            "Output limit of the amplifier, either sign",
        )
        .or(5.0)
        .logarithmic(0.5, 50.0)
        .hint("give the amplifier's largest voltage in V, such as 5"),
    }
);

impl Default for Drive {
    /// The drive of the paper: 1.59 mm/rad, 1/0.716 V/(N m), ±5 V.
    fn default() -> Self {
        Self { transmission_mm_rad: 1.59, torque_to_voltage_v_nm: 1.0 / 0.716, voltage_limit_v: 5.0 }
    }
}

/// Gains of the PDFF controller, none negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pdff {
    /// Position gain \[rad/s/mm\].
    pub kpp_rad_s_mm: f64,
    /// Velocity gain \[N m s/rad\].
    pub kpv_nm_s_rad: f64,
    /// Velocity integral gain \[1/s\].
    pub kiv_1_s: f64,
    /// Velocity feedforward \[rad/mm\]; `1/r_g` is full feedforward.
    pub kpf_rad_mm: f64,
    /// Fraction of the velocity command that acts directly (1: PI, 0: pseudo-derivative feedback).
    pub kvf: f64,
}

/// What to do about a gain out of its range.
const GAINS: &str = "gains are zero or positive; the paper's are kpp 97, kpv 1.2, kiv 253, kpf 0.8, kvf 0.85";

parameters!(
    "Gains of the PDFF controller",
    Pdff {
        kpp_rad_s_mm: Parameter::new("pdff.kpp", "rad/s/mm", Range::NOT_NEGATIVE, "Position gain")
            .logarithmic(1.0, 500.0)
            .hint(GAINS),
        kpv_nm_s_rad: Parameter::new("pdff.kpv", "N m s/rad", Range::NOT_NEGATIVE, "Velocity gain")
            .logarithmic(0.01, 10.0)
            .hint(GAINS),
        kiv_1_s: Parameter::new("pdff.kiv", "1/s", Range::NOT_NEGATIVE, "Velocity integral gain")
            .linear(0.0, 1000.0)
            .hint(GAINS),
        kpf_rad_mm: Parameter::new(
            "pdff.kpf",
            "rad/mm",
            Range::NOT_NEGATIVE,
            "Velocity feedforward; 1/transmission_mm_rad is full feedforward",
        )
        .linear(0.0, 2.0)
        .hint(GAINS),
        kvf: Parameter::new(
            "pdff.kvf",
            "",
            Range::NOT_NEGATIVE,
            "Fraction of the velocity command that acts directly: 1 is a PI controller, 0 pseudo-derivative feedback",
        )
        .linear(0.0, 2.0)
        .hint(GAINS),
    }
);

/// One axis: plant, drive and controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisParameters {
    /// Motor and mechanics.
    pub plant: Plant,
    /// Amplifier and ballscrew.
    pub drive: Drive,
    /// Controller gains.
    pub pdff: Pdff,
}

/// Where the velocity feedforward takes the command's velocity from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Derivative {
    /// Backward difference of the position command: what a drive that receives positions only can do.
    #[default]
    Backward,
    /// The interpolator's own velocity at the sample.
    Exact,
}

/// How the loop is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopSettings {
    /// Control period `Δt` \[s\], positive.
    pub period_s: f64,
    /// How long the run continues after the last setpoint \[s\], not negative.
    pub settling_s: f64,
    /// Source of the velocity command.
    pub derivative: Derivative,
    /// Whether the voltage computed at a sample reaches the plant one sample later.
    pub one_sample_delay: bool,
}

impl Parameters for LoopSettings {
    const ABOUT: &'static str = "How the servo loop is sampled";
    const ENTRIES: &'static [Entry<Self>] = &[
        Entry {
            parameter: Parameter::new("control.period_s", "s", Range::POSITIVE, "Control period")
                .or(0.001)
                .logarithmic(5e-5, 0.01)
                .hint("give the control period in seconds, such as 0.001"),
            get: |settings| Some(settings.period_s),
            set: |settings, value| {
                settings.period_s = value;
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "control.settling_s",
                "s",
                Range::NOT_NEGATIVE,
                "How long the run continues after the last setpoint",
            )
            .or(0.1)
            .linear(0.0, 1.0)
            .hint("give the time to go on after the last setpoint in seconds, such as 0.1"),
            get: |settings| Some(settings.settling_s),
            set: |settings, value| {
                settings.settling_s = value;
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "control.delay_samples",
                "control periods",
                Range::whole(0, 1),
                "How much later the voltage reaches the plant",
            )
            .or(0.0)
            .linear(0.0, 1.0)
            .hint("0: the voltage acts at once, as in the paper; 1: one control period later, as in most drives"),
            get: |settings| Some(f64::from(u8::from(settings.one_sample_delay))),
            set: |settings, value| {
                settings.one_sample_delay = value > 0.5;
                true
            },
        },
    ];
}

impl Default for LoopSettings {
    /// 1 ms, 0.1 s of settling, backward difference, no delay.
    fn default() -> Self {
        Self { period_s: 1e-3, settling_s: 0.1, derivative: Derivative::Backward, one_sample_delay: false }
    }
}

/// Largest magnitude of any parameter: beyond it the sums and products of the loop could overflow.
pub(super) const LARGEST: f64 = 1e9;

/// A sampled filter with a higher corner has no effect that could be seen.
pub(super) fn at_most_nyquist<T: Parameters>(
    name: &'static str,
    frequency_hz: f64,
    period_s: f64,
) -> Result<(), OutOfRange> {
    let needed = "at most the Nyquist frequency, half of 1/period_s";
    if frequency_hz * period_s <= 0.5 { Ok(()) } else { Err(T::refuse(name, frequency_hz, needed)) }
}

impl AxisParameters {
    /// Every parameter finite and in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.plant.check_ranges()?;
        self.drive.check_ranges()?;
        self.pdff.check_ranges()
    }
}

impl LoopSettings {
    /// Period positive, settling not negative, both finite.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}
