//! Points of a file.

use std::fmt;

use serde::de::{self, Deserialize, Deserializer, IgnoredAny, SeqAccess, Visitor};
use toml::Spanned;

/// A point `[x, y]` in millimetres.
pub(super) type RawPoint = Spanned<Numbers<2>>;

/// A point `[x, y, z]` in millimetres.
pub(super) type RawPoint3 = Spanned<Numbers<3>>;

/// So many numbers. Unlike `[f64; N]` it refuses one more.
#[derive(Debug, Clone, Copy)]
pub(super) struct Numbers<const N: usize>(pub(super) [f64; N]);

/// What [`Numbers`] of two and of three are called in messages.
pub(super) const POINT: &str = "a point [x, y] of two numbers";
/// See [`POINT`].
pub(super) const POINT3: &str = "a point [x, y, z] of three numbers";

impl<'de, const N: usize> Deserialize<'de> for Numbers<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumbersVisitor<const N: usize>;

        impl<'de, const N: usize> Visitor<'de> for NumbersVisitor<N> {
            type Value = Numbers<N>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(if N == 2 { POINT } else { POINT3 })
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<Numbers<N>, A::Error> {
                let mut all = [0.0; N];
                for (length, number) in all.iter_mut().enumerate() {
                    *number = numbers.next_element()?.ok_or_else(|| de::Error::invalid_length(length, &self))?;
                }
                let mut length = N;
                while numbers.next_element::<IgnoredAny>()?.is_some() {
                    length += 1;
                }
                if length == N { Ok(Numbers(all)) } else { Err(de::Error::invalid_length(length, &self)) }
            }
        }

        deserializer.deserialize_any(NumbersVisitor)
    }
}
