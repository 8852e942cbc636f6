//! Cutters: surfaces of revolution around the tool axis Z.

use std::fmt;

use crate::path::MAX_COORDINATE_MM;

/// A cutter, described by the profile of its bottom: a flat disc of radius `R - c` with a quarter round of corner radius `c`
/// around it. The tip is the lowest point on the axis; programs give its place.
///
/// | cutter | corner radius |
/// |---|---|
/// | ball | `c = R` |
/// | flat | `c = 0` |
/// | bull-nose | `0 < c < R` |
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cutter {
    radius_mm: f64,
    corner_radius_mm: f64,
}

impl fmt::Display for Cutter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { radius_mm, corner_radius_mm } = self;
        if self.is_ball() {
            write!(f, "ball cutter, radius {radius_mm} mm")
        } else {
            write!(f, "cutter of radius {radius_mm} mm, corner radius {corner_radius_mm} mm")
        }
    }
}

/// Why a cutter is none.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CutterError {
    /// The radius is not a positive finite number in range.
    #[error("a cutter radius of {radius_mm} mm is not a positive finite number")]
    BadRadius {
        /// The radius.
        radius_mm: f64,
    },
    /// The corner radius is not between 0 and the radius.
    #[error(
        "a corner radius of {corner_radius_mm} mm is not possible: it is from 0 (a flat end) to the cutter radius of {radius_mm} mm (a ball)"
    )]
    BadCorner {
        /// The corner radius.
        corner_radius_mm: f64,
        /// The cutter radius.
        radius_mm: f64,
    },
}

/// Smallest cutter radius \[mm\].
const MIN_RADIUS_MM: f64 = 1e-3;

impl Cutter {
    /// A ball-end cutter.
    ///
    /// # Errors
    /// A radius that is not a positive finite number.
    pub fn ball(radius_mm: f64) -> Result<Self, CutterError> {
        Self::bull_nose(radius_mm, radius_mm)
    }

    /// A flat-end cutter.
    ///
    /// # Errors
    /// A radius that is not a positive finite number.
    pub fn flat(radius_mm: f64) -> Result<Self, CutterError> {
        Self::bull_nose(radius_mm, 0.0)
    }

    /// A bull-nose cutter: radius `R`, corner radius `c`, 0 to `R`.
    ///
    /// # Errors
    /// A radius that is not a positive finite number, a corner radius out of range.
    pub fn bull_nose(radius_mm: f64, corner_radius_mm: f64) -> Result<Self, CutterError> {
        if !(MIN_RADIUS_MM..=MAX_COORDINATE_MM).contains(&radius_mm) {
            return Err(CutterError::BadRadius { radius_mm });
        }
        if !(0.0..=radius_mm).contains(&corner_radius_mm) {
            return Err(CutterError::BadCorner { corner_radius_mm, radius_mm });
        }
        Ok(Self { radius_mm, corner_radius_mm })
    }

    /// Radius `R` \[mm\].
    pub fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// Corner radius `c` \[mm\].
    pub fn corner_radius_mm(&self) -> f64 {
        self.corner_radius_mm
    }

    /// Whether it is a ball.
    pub fn is_ball(&self) -> bool {
        self.corner_radius_mm == self.radius_mm
    }

    /// Height of the cutter's bottom above its tip at distance `rho_mm` from the axis \[mm\]:
    /// `g(ρ) = c - √(c² - (ρ - (R - c))²)` beyond the flat disc, 0 on it. None beyond the radius.
    #[inline]
    pub fn profile_mm(&self, rho_mm: f64) -> Option<f64> {
        if !(rho_mm <= self.radius_mm) {
            return None;
        }
        let (c, out) = (self.corner_radius_mm, (rho_mm - (self.radius_mm - self.corner_radius_mm)).max(0.0));
        // (c - √(c² - x²)) without losing digits where x is small.
        let root = ((c - out) * (c + out)).max(0.0).sqrt();
        Some(if out > 0.0 { out * out / (c + root) } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_profiles_against_the_circle() {
        let (ball, flat, bull) =
            (Cutter::ball(5.0).unwrap(), Cutter::flat(5.0).unwrap(), Cutter::bull_nose(5.0, 2.0).unwrap());
        for i in 0..=100 {
            let rho = 0.05 * f64::from(i);
            assert!((ball.profile_mm(rho).unwrap() - (5.0 - (25.0 - rho * rho).max(0.0).sqrt())).abs() < 1e-7);
            assert_eq!(flat.profile_mm(rho), Some(0.0));
            let out: f64 = (rho - 3.0).max(0.0);
            assert!((bull.profile_mm(rho).unwrap() - (2.0 - (4.0 - out * out).max(0.0).sqrt())).abs() < 1e-7);
        }
        for cutter in [ball, flat, bull] {
            assert_eq!(cutter.profile_mm(5.000001), None);
            assert_eq!(cutter.profile_mm(f64::NAN), None);
        }
        assert!(ball.is_ball() && !flat.is_ball() && !bull.is_ball());
    }

    #[test]
    fn impossible_cutters_are_refused() {
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e7] {
            assert!(matches!(Cutter::ball(radius), Err(CutterError::BadRadius { .. })));
        }
        for corner in [-0.1, 5.1, f64::NAN] {
            let error = Cutter::bull_nose(5.0, corner).unwrap_err();
            assert!(error.to_string().contains("corner radius"), "{error}");
        }
    }
}
