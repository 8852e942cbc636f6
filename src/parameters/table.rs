//! The parameters of a struct, each with its accessor.

use std::borrow::Cow;

use super::{OutOfRange, Parameter};

/// A parameter of `T`, and how to reach its value.
#[derive(Debug)]
pub struct Entry<T> {
    /// The parameter.
    pub parameter: Parameter,
    /// Its value; none where this `T` has none (another variant of an enum, a limit that is not set).
    pub get: fn(&T) -> Option<f64>,
    /// Changes it, unchecked; whether this `T` can have it.
    pub set: fn(&mut T, f64) -> bool,
}

/// A struct of parameters: a table of the scenario file.
pub trait Parameters: Sized + 'static {
    /// What the table is: a phrase.
    const ABOUT: &'static str;

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

    /// The parameter that is called `name` in its table.
    fn parameter(name: &str) -> Option<&'static Parameter> {
        Self::ENTRIES.iter().map(|entry| &entry.parameter).find(|parameter| parameter.name() == name)
    }

    /// The error of a value that other parameters do not go with.
    fn refuse(name: &'static str, value: f64, needed: impl Into<Cow<'static, str>>) -> OutOfRange {
        match Self::parameter(name) {
            Some(parameter) => parameter.refuse(value, needed),
            None => OutOfRange::new(name, value, needed),
        }
    }

    /// An error of a part of this struct, under the key that the parameter has here.
    fn own(error: OutOfRange) -> OutOfRange {
        let key = Self::parameter(error.name()).map_or(error.key, |parameter| parameter.key);
        OutOfRange { key, ..error }
    }
}

/// Lists the parameters of a struct by its fields: `parameters!("about", Pdff { kpp_rad_s_mm: Parameter::new(…), … })`.
macro_rules! parameters {
    ($about:literal, $owner:ty { $($($field:ident).+ : $parameter:expr),+ $(,)? }) => {
        impl $crate::parameters::Parameters for $owner {
            const ABOUT: &'static str = $about;
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
