//! The servo: one axis is a first-order plant under a PDFF controller, sampled once a control period.
//!
//! Per axis, at sample `k` (period `Δt`), in this order:
//!
//! ```text
//! ẋ_com = (x_com[k] - x_com[k-1]) / Δt                     0 at k = 0
//! ω_com = kpp (x_com - x_act) + kpf ẋ_com                  rad/s
//! T     = kpv (kvf ω_com - ω + kiv I)                      N m
//! u     = clamp(k_T T, ±u_max)                             V
//! I    += Δt (ω_com - ω)     unless u is clamped and this would push it further
//! plant: ω(s)/u(s) = K/(1 + τ s),  θ = ∫ω,  x_act = r_g θ
//! ```
//!
//! Source: Jahanpour, Dolatabadi, Vahedian Azimi, "Jerk limited machining using C2 Pythagorean-hodograph quintic spline
//! curves", section 6-2 and table 2; the velocity loop is Ellis' pseudo-derivative feedback with feedforward.
//!
//! [`AxisLoop`] is generic over [`Lane`](crate::lane::Lane): `f64` for one run, vector registers for a batch of parameters. It is one piece of
//! code, so that a batch cannot disagree with a run.
//!
//! That is the model. [`DetailedAxis`] is the detailed drive model: the same loop with [`effects`] between controller and table, other
//! [`controller`]s and [`compensation`]. Both are an [`Axis`].

mod axis;
mod axis_registry;
mod block;
pub mod compensation;
pub mod controller;
mod detailed_axis;
mod drive_model;
pub mod effects;
mod lockup;
mod mechanics;
mod parameters;
mod pdff_law;
mod reference;

pub(crate) use axis::coasting_s;
pub use axis::{AxisLoop, AxisSignals};
pub use axis_registry::{AxisParameter, axis_parameters};
pub(crate) use block::step_alone;
pub use block::step_side_by_side;
pub use detailed_axis::{DetailedAxis, DriveSignals};
pub use drive_model::{ControllerGains, ControllerKind, DriveModel};
pub use lockup::{Lockup, LockupKind, LockupWatch};
pub(crate) use mechanics::LinearMachine;
pub use parameters::{AxisParameters, Derivative, Drive, LoopSettings, Mechanics, Pdff, Plant};
pub use reference::{Axis, AxisReference};
