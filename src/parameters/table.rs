//! The parameters of a struct, each with its accessor.

use super::{OutOfRange, Parameter};

/// A parameter of `T`, and how to reach its value.
#[derive(Debug)]
pub struct Entry<T> {
    /// The parameter.
    pub parameter: Parameter,
    /// Its value; none where this `T` has none (another variant of an enum).
    pub get: fn(&T) -> Option<f64>,
    /// Changes it, unchecked; whether this `T` has it.
    pub set: fn(&mut T, f64) -> bool,
}

/// A struct of parameters.
pub trait Parameters: Sized + 'static {
    /// Its numeric parameters, in the order of the reference.
    const ENTRIES: &'static [Entry<Self>];

    /// Every parameter that is there, each in its own range.
    ///
    /// # Errors
    /// Names the first one that is not.
    fn check_ranges(&self) -> Result<(), OutOfRange> {
        let checked = |entry: &Entry<Self>| (entry.get)(self).map_or(Ok(()), |v| entry.parameter.check(v).map(|_| ()));
        Self::ENTRIES.iter().try_for_each(checked)
    }
}

/// Lists the parameters of a struct by its fields: `parameters!(Pdff { kpp_rad_s_mm: Parameter::new(…), … })`.
macro_rules! parameters {
    ($owner:ty { $($($field:ident).+ : $parameter:expr),+ $(,)? }) => {
        impl $crate::parameters::Parameters for $owner {
            const ENTRIES: &'static [$crate::parameters::Entry<Self>] = &[$($crate::parameters::Entry {
                parameter: $parameter,
                get: |owner| Some(owner.$($field).+),
                set: |owner, value| {
                    owner.$($field).+ = value;
                    true
                },
            }),+];
        }
    };
}
pub(crate) use parameters;
