//! The effects by name.

use super::Effects;

/// One of the [`Effects`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum EffectKind {
    /// Mismatch between model and plant.
    Mismatch,
    /// Encoder: resolution, place, velocity estimate.
    Encoder,
    /// Measurement noise.
    Noise,
    /// Computation delay.
    Delay,
    /// Resolution of the voltage.
    Dac,
    /// Bandwidth of the current loop.
    CurrentLoop,
    /// Flexible ballscrew.
    TwoMass,
    /// Friction.
    Friction,
    /// Backlash.
    Backlash,
    /// Pitch error.
    Pitch,
    /// Torque ripple.
    Ripple,
    /// Cutting force.
    Force,
}

impl EffectKind {
    /// All of them, in the order of the signal from the plant's model to the cut.
    pub const ALL: [Self; 12] = [
        Self::Mismatch,
        Self::Encoder,
        Self::Noise,
        Self::Delay,
        Self::Dac,
        Self::CurrentLoop,
        Self::TwoMass,
        Self::Friction,
        Self::Backlash,
        Self::Pitch,
        Self::Ripple,
        Self::Force,
    ];

    /// Name in tables; the key of the scenario is this with `_` for a space.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mismatch => "mismatch",
            Self::Encoder => "encoder",
            Self::Noise => "noise",
            Self::Delay => "delay",
            Self::Dac => "dac",
            Self::CurrentLoop => "current loop",
            Self::TwoMass => "two mass",
            Self::Friction => "friction",
            Self::Backlash => "backlash",
            Self::Pitch => "pitch",
            Self::Ripple => "ripple",
            Self::Force => "force",
        }
    }
}

impl Effects {
    /// These effects with one of them alone left.
    #[must_use]
    pub fn only(&self, kind: EffectKind) -> Self {
        let mut out = Self { integration: self.integration, ..Self::default() };
        match kind {
            EffectKind::Mismatch => out.mismatch = self.mismatch,
            EffectKind::Encoder => out.encoder = self.encoder,
            EffectKind::Noise => out.noise = self.noise,
            EffectKind::Delay => out.delay = self.delay,
            EffectKind::Dac => out.dac = self.dac,
            EffectKind::CurrentLoop => out.current_loop = self.current_loop,
            EffectKind::TwoMass => out.two_mass = self.two_mass,
            EffectKind::Friction => out.friction = self.friction,
            EffectKind::Backlash => out.backlash = self.backlash,
            EffectKind::Pitch => out.pitch.clone_from(&self.pitch),
            EffectKind::Ripple => out.ripple.clone_from(&self.ripple),
            EffectKind::Force => out.force.clone_from(&self.force),
        }
        out
    }

    /// Whether this one is on.
    pub fn has(&self, kind: EffectKind) -> bool {
        match kind {
            EffectKind::Mismatch => self.mismatch.is_some(),
            EffectKind::Encoder => self.encoder.is_some(),
            EffectKind::Noise => self.noise.is_some(),
            EffectKind::Delay => self.delay.is_some(),
            EffectKind::Dac => self.dac.is_some(),
            EffectKind::CurrentLoop => self.current_loop.is_some(),
            EffectKind::TwoMass => self.two_mass.is_some(),
            EffectKind::Friction => self.friction.is_some(),
            EffectKind::Backlash => self.backlash.is_some(),
            EffectKind::Pitch => self.pitch.is_some(),
            EffectKind::Ripple => self.ripple.is_some(),
            EffectKind::Force => self.force.is_some(),
        }
    }
}
