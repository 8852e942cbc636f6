//! Analysis of the *sampled* loop of one axis, without a simulation.
//!
//! The loop is that of [`servo`](crate::servo): PDFF controller, exact zero-order-hold plant, linear (no saturation). It is
//! broken at the plant input, where the voltage goes in:
//!
//! ```text
//! δ = z - 1,  a = exp(-Δt/τ),  c = 1 - a,  w = kpp r_g,  G = k_T kpv
//! P(δ) = K (Δt - τ c) δ + K c Δt                                    θ/u = P/(δ (δ + c)),  ω/u = K c/(δ + c)
//! N(δ) = δ G [kvf w P + K c δ] + Δt G kiv [w P + K c δ]
//! L(z) = N / (δ² (δ + c))                                           times 1/z with one sample of delay
//! ```
//!
//! [`SampledLoop`] holds these coefficients: frequency response, poles, closed-loop matrix. [`margins`] computes how far
//! the loop is from instability, in microseconds. [`bandwidth`], [`step_response`] and
//! [`error_constants`] tell how it follows.
//!
//! [`DriveLoop`] is the same of the detailed drive model: with its delay, current loop, two masses, viscous friction, velocity estimate, filters and
//! whatever controller it has; nonlinear effects are neglected, and named.
//!
//! On the unit circle `z = (1 + jv)/(1 - jv)` with `v = tan(ω Δt/2)` makes every condition a small polynomial in `v²`:
//! crossovers, phase crossovers and the stationary points of the sensitivity of the model are its positive roots. Nothing is sampled
//! on a grid, so nothing is missed between two points of one. (The loop of a detailed drive has no such small polynomial, and is.)
//!
//! ```
//! use servosim::{analysis, scenario::Scenario};
//!
//! let alpha = Scenario::builtin("alpha")?;
//! let margins = analysis::margins(&alpha.axes[0], &alpha.settings);
//! assert!(margins.stable && margins.peak_sensitivity < 1.6);
//! // Conditionally stable: a fifth of the gain is too little.
//! assert!(margins.gain_down > 0.2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod drive_loop;
mod eigen;
mod grid;
mod linear_drive;
mod linearized;
mod margins;
mod metrics;
mod polynomial;
mod response;
mod sampled_loop;

pub use drive_loop::DriveLoop;
pub use linearized::Linearized;
pub use margins::{Margins, PeakSensitivity, margins, peak_sensitivity, stable_gain_factors};
pub use metrics::{LoopMetrics, Pole, StepTimes};
pub use response::{
    Bandwidth, ErrorConstants, Feedforward, StepMetrics, StepResponse, bandwidth, error_constants, step_response,
};
pub use sampled_loop::SampledLoop;
