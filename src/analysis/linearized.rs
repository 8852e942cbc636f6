//! Which effects of a drive are linear.

use serde::Serialize;

use crate::servo::DriveModel;
use crate::servo::compensation::{Compensation, Filter, LowPass, Notch};
use crate::servo::effects::{EffectKind, Effects, EncoderPlace, VelocityEstimate};

/// What a linear analysis of a detailed drive includes, and what it neglects, in words.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Linearized {
    /// Name of the controller: `pdff`, `p-pi`, `pid`, `cascade`.
    pub controller: &'static str,
    /// What is in the linear loop.
    pub modelled: Vec<String>,
    /// What is on but not in it. (The voltage limit never is.)
    pub neglected: Vec<String>,
}

impl Linearized {
    /// Of one axis.
    pub fn of(drive: &DriveModel) -> Self {
        let mut told = Self { controller: drive.controller.kind().name(), ..Self::default() };
        told.effects(&drive.effects);
        told.compensation(&drive.compensation);
        if drive.zero_phase {
            told.taken("zero-phase tracking");
        }
        told
    }

    fn taken(&mut self, what: &str) {
        self.modelled.push(what.to_owned());
    }

    fn left(&mut self, what: &str) {
        self.neglected.push(what.to_owned());
    }

    fn effects(&mut self, effects: &Effects) {
        for kind in EffectKind::ALL.into_iter().filter(|kind| effects.has(*kind)) {
            match kind {
                EffectKind::Mismatch | EffectKind::CurrentLoop => self.taken(kind.name()),
                EffectKind::TwoMass => self.taken("two masses"),
                EffectKind::Delay => {
                    let samples = effects.delay.map_or(0.0, |delay| delay.samples);
                    self.taken(&format!("delay of {samples} sample{}", if samples == 1.0 { "" } else { "s" }));
                }
                EffectKind::Encoder => {
                    let encoder = effects.encoder.unwrap_or_default();
                    match encoder.velocity {
                        VelocityEstimate::Tachometer => {}
                        VelocityEstimate::Difference => self.taken("velocity by difference"),
                        VelocityEstimate::LowPass { .. } => self.taken("velocity by difference and low pass"),
                        VelocityEstimate::Observer { .. } => self.taken("velocity by observer"),
                    }
                    if encoder.place == EncoderPlace::Table {
                        self.taken("scale at the table");
                    }
                    if encoder.resolution_um > 0.0 {
                        self.left("encoder quantisation");
                    }
                }
                EffectKind::Friction => {
                    let viscous = effects.friction.map_or(0.0, |friction| friction.curve().viscous_nm_s_rad);
                    if viscous > 0.0 {
                        self.taken("viscous friction");
                        self.left("friction but its viscous part");
                    } else {
                        self.left("friction");
                    }
                }
                EffectKind::Dac => self.left("DAC"),
                EffectKind::Noise => self.left("noise"),
                EffectKind::Backlash => self.left("backlash"),
                EffectKind::Pitch => self.left("pitch error"),
                EffectKind::Ripple => self.left("ripple"),
                EffectKind::Force => self.left("cutting force"),
            }
        }
    }

    fn compensation(&mut self, compensation: &Compensation) {
        for filter in &compensation.filters {
            match filter {
                Filter::Notch(Notch { frequency_hz, .. }) => self.taken(&format!("notch at {frequency_hz} Hz")),
                Filter::LowPass(LowPass { frequency_hz, .. }) => self.taken(&format!("low pass at {frequency_hz} Hz")),
            }
        }
        if compensation.acceleration.is_some() {
            self.taken("acceleration feedforward");
        }
        let rest = [
            (compensation.friction.is_some(), "friction feedforward"),
            (compensation.backlash.is_some(), "backlash compensation"),
            (compensation.pitch.is_some(), "pitch compensation"),
        ];
        for (_, what) in rest.into_iter().filter(|(on, _)| *on) {
            self.left(what);
        }
    }
}
