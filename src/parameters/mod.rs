//! What a parameter is: key, unit, valid range, default, slider, help; the error of a value out of its range; names of the axes.
//!
//! A struct of parameters lists them beside its fields ([`Parameters`]): everything that needs to know what parameters there are reads these
//! tables (reading and checking scenario files, their schema and reference, sweeps, tuning, sliders).
//!
//! ```
//! use servosim::parameters::Parameters;
//! use servosim::servo::Pdff;
//!
//! let kpp = Pdff::ENTRIES.iter().find(|entry| entry.parameter.name() == "kpp").unwrap();
//! assert_eq!((kpp.parameter.key, kpp.parameter.unit), ("pdff.kpp", "rad/s/mm"));
//! let error = kpp.parameter.check(-1.0).unwrap_err();
//! assert_eq!(error.to_string(), "pdff.kpp = -1 is out of range: it must be zero or a positive number, at most 1e9 rad/s/mm");
//! ```

mod axis_names;
mod out_of_range;
mod parameter;
mod range;
mod table;

pub use axis_names::{AXIS_NAMES, axis_name, axis_title};
pub use out_of_range::OutOfRange;
pub use parameter::{Parameter, Presence, Scale, Slider};
pub use range::{Bound, Range};
pub(crate) use table::parameters;
pub use table::{Entry, Parameters};
