//! Step-over from scallop height.
//!
//! Two neighbouring passes of a ball of radius `r` leave a ridge between them, the scallop. Across the path the surface is an arc of
//! radius `R` (its normal curvature radius there: `R > 0` convex, `R < 0` concave). The ball's centre runs on the concentric arc of
//! radius `R + r`; with the distance `w` between the two cutter contact points the ridge is `h` high:
//!
//! | form | step-over |
//! |---|---|
//! | flat | `w = 2 √(2 r h - h²)` |
//! | exact | `w = |R| √(4 (R+r)² (R+h)² - (R² + 2 R r + (R+h)²)²) / (|R+r| |R+h|)` |
//! | fast | `w = √(8 h r R / (R + r))`, for `h` much smaller than `|R|` |
//!
//! The error `|w' - w|/w` of the fast form against the exact one:
//!
//! | | h = 0.01, r = 5 | h = 0.1, r = 5 |
//! |---|---|---|
//! | convex, R = 10 | 0.108 % | 1.088 % |
//! | convex, R = 4 | 0.210 % | 2.10 % |
//! | concave, R = -11 … -9 | 0.0235 … 0.0292 % | 0.236 … 0.293 % |
//!
//! Source: Akbari, Rokhzadi, "NURBS-based tool path generation for high speed machining".
//!
//! ```
//! use servosim::toolpath::stepover::{exact_mm, flat_mm};
//!
//! assert!((flat_mm(5.0, 0.25)? - 3.1225).abs() < 1e-4);
//! // On a convex surface the same scallop asks for narrower passes.
//! assert!(exact_mm(5.0, 0.25, 10.0)? < flat_mm(5.0, 0.25)?);
//! # Ok::<(), servosim::toolpath::stepover::StepoverError>(())
//! ```

use crate::path::MAX_COORDINATE_MM;

/// Why there is no step-over.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepoverError {
    /// The cutter radius is not a positive finite number.
    #[error("a cutter radius of {radius_mm} mm is not a positive finite number")]
    BadCutter {
        /// The radius.
        radius_mm: f64,
    },
    /// The scallop height is not positive, or not below the cutter radius.
    #[error(
        "a scallop height of {scallop_mm} mm is not possible: it must be above 0 and below the cutter radius of {radius_mm} mm"
    )]
    BadScallop {
        /// The scallop height.
        scallop_mm: f64,
        /// The cutter radius.
        radius_mm: f64,
    },
    /// The curvature radius is NaN or zero.
    #[error(
        "a curvature radius of {curvature_radius_mm} mm is not possible: it is positive where the surface is convex, negative where it is concave, infinite where it is flat"
    )]
    BadCurvature {
        /// The curvature radius.
        curvature_radius_mm: f64,
    },
    /// The cutter does not fit into the hollow.
    #[error("a cutter of radius {radius_mm} mm does not fit into a hollow of radius {} mm: take a smaller one, below that radius", -curvature_radius_mm)]
    CutterTooLarge {
        /// The cutter radius.
        radius_mm: f64,
        /// The curvature radius, negative.
        curvature_radius_mm: f64,
    },
    /// The ridge can not become as high as that: the passes would be a half turn of the surface apart.
    #[error(
        "on a surface of radius {curvature_radius_mm} mm a cutter of radius {radius_mm} mm leaves no scallop as high as {scallop_mm} mm: take a lower one"
    )]
    ScallopOutOfReach {
        /// The scallop height.
        scallop_mm: f64,
        /// The cutter radius.
        radius_mm: f64,
        /// The curvature radius.
        curvature_radius_mm: f64,
    },
}

fn check(r: f64, h: f64) -> Result<(), StepoverError> {
    if !(r > 0.0 && r <= MAX_COORDINATE_MM) {
        return Err(StepoverError::BadCutter { radius_mm: r });
    }
    if !(h > 0.0 && h < r) {
        return Err(StepoverError::BadScallop { scallop_mm: h, radius_mm: r });
    }
    Ok(())
}

fn check_curved(r: f64, h: f64, curvature_radius_mm: f64) -> Result<(), StepoverError> {
    check(r, h)?;
    if curvature_radius_mm.is_nan() || curvature_radius_mm == 0.0 {
        return Err(StepoverError::BadCurvature { curvature_radius_mm });
    }
    if curvature_radius_mm < 0.0 && r >= -curvature_radius_mm {
        return Err(StepoverError::CutterTooLarge { radius_mm: r, curvature_radius_mm });
    }
    Ok(())
}

/// The step-over on a flat surface, `w = 2 √(2 r h - h²)` \[mm\], for cutter radius `r` and scallop height `h`.
///
/// # Errors
/// A radius that is not positive; a scallop height not between 0 and the radius.
pub fn flat_mm(radius_mm: f64, scallop_mm: f64) -> Result<f64, StepoverError> {
    check(radius_mm, scallop_mm)?;
    Ok(2.0 * (scallop_mm * (2.0 * radius_mm - scallop_mm)).sqrt())
}

/// The step-over on a curved surface \[mm\], exact: the distance of two contact points on the arc of radius `R` whose balls meet at
/// height `h` above it. Infinite `R`: [`flat_mm`].
///
/// With `a = R + r`, `b = R + h` the radicand is `((a+b)² - r²)(r² - (a-b)²)`, and both factors are products,
/// `(2R + h)(2R + 2r + h) · h (2r - h)`: no digits are lost where `R` is large.
///
/// # Errors
/// As [`flat_mm`]; `R` of 0 or NaN; a hollow that is not wider than the cutter; a scallop higher than neighbouring passes leave.
pub fn exact_mm(radius_mm: f64, scallop_mm: f64, curvature_radius_mm: f64) -> Result<f64, StepoverError> {
    let (r, h) = (radius_mm, scallop_mm);
    check_curved(r, h, curvature_radius_mm)?;
    if curvature_radius_mm.is_infinite() {
        return flat_mm(r, h);
    }
    // Divided by R: shares of it stay small numbers.
    let k = 1.0 / curvature_radius_mm;
    let radicand = (2.0 + h * k) * (2.0 + (2.0 * r + h) * k) * h * (2.0 * r - h);
    let below = (1.0 + r * k) * (1.0 + h * k);
    let w = radicand.sqrt() / below;
    // The ridge is highest where the balls stand on opposite sides of the arc; a hollow has none above its middle.
    if !(radicand > 0.0 && below > 0.0 && w.is_finite()) {
        return Err(StepoverError::ScallopOutOfReach { scallop_mm: h, radius_mm: r, curvature_radius_mm });
    }
    Ok(w)
}

/// The step-over on a curved surface \[mm\], `w = √(8 h r R / (R + r))`: near [`exact_mm`] where `h` is much smaller than `|R|`.
/// Infinite `R`: `√(8 h r)`.
///
/// # Errors
/// As [`flat_mm`]; `R` of 0 or NaN; a hollow that is not wider than the cutter.
pub fn fast_mm(radius_mm: f64, scallop_mm: f64, curvature_radius_mm: f64) -> Result<f64, StepoverError> {
    let (r, h) = (radius_mm, scallop_mm);
    check_curved(r, h, curvature_radius_mm)?;
    Ok((8.0 * h * r / (1.0 + r / curvature_radius_mm)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The formula as the specification writes it.
    fn written(r: f64, h: f64, radius: f64) -> f64 {
        let (a, b) = (radius + r, radius + h);
        let inner = radius * radius + 2.0 * radius * r + b * b;
        radius.abs() * (4.0 * a * a * b * b - inner * inner).sqrt() / (a.abs() * b.abs())
    }

    fn error_percent(r: f64, h: f64, radius: f64) -> f64 {
        let exact = exact_mm(r, h, radius).unwrap();
        100.0 * (fast_mm(r, h, radius).unwrap() - exact).abs() / exact
    }

    #[test]
    fn validates_the_papers_table_to_every_digit() {
        let rounded = |x: f64, digits: usize| format!("{x:.digits$}");
        assert_eq!(rounded(error_percent(5.0, 0.01, 10.0), 3), "0.108");
        assert_eq!(rounded(error_percent(5.0, 0.1, 10.0), 3), "1.088");
        assert_eq!(rounded(error_percent(5.0, 0.01, 4.0), 3), "0.210");
        assert_eq!(rounded(error_percent(5.0, 0.1, 4.0), 2), "2.10");
        // The specification writes 0.024 … 0.029 % for the first: 0.02349 % is that after rounding twice.
        for (h, digits, low, high) in [(0.01, 4, "0.0235", "0.0292"), (0.1, 2, "0.24", "0.29")] {
            let ends = [error_percent(5.0, h, -9.0), error_percent(5.0, h, -11.0)];
            let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            assert_eq!([rounded(least, digits), rounded(most, digits)], [low, high]);
            // Between the ends there is nothing outside.
            for i in 0..=100 {
                let error = error_percent(5.0, h, -9.0 - 0.02 * f64::from(i));
                assert!((least - 1e-12..=most + 1e-12).contains(&error), "{i}: {error}");
            }
        }
    }

    #[test]
    fn validates_the_exact_form_against_geometry() {
        // Two balls whose contact points are w apart on the circle of radius R: where their circles meet on the bisector, by the
        // law of cosines.
        for r in [0.5, 5.0, 8.0] {
            for h in [0.001, 0.1, 0.4] {
                for radius in [-1e7, -50.0, -9.0, 4.0, 10.0, 300.0, 1e7] {
                    let w = exact_mm(r, h, radius).unwrap();
                    assert!((w / written(r, h, radius) - 1.0).abs() < 1e-6 || radius.abs() > 1e6);
                    let half = (0.5 * w / radius.abs()).asin();
                    let a = radius + r;
                    // Distance from the surface's centre to the ridge, on the side of the surface.
                    let (along, across) = (a.abs() * half.cos(), a.abs() * half.sin());
                    // The balls meet twice: the ridge is where they do so nearer to the surface.
                    let ridge = radius.signum() * (along - radius.abs()) - (r * r - across * across).sqrt();
                    // At R = 1e7 the difference of two such numbers is 1e-9 and worse.
                    assert!((ridge - h).abs() < 1e-10 + 1e-14 * radius.abs(), "r {r} h {h} R {radius}: {ridge}");
                }
                let flat = flat_mm(r, h).unwrap();
                assert!((exact_mm(r, h, 1e9).unwrap() / flat - 1.0).abs() < 1e-7);
                assert_eq!(exact_mm(r, h, f64::INFINITY), Ok(flat));
                assert_eq!(exact_mm(r, h, f64::NEG_INFINITY), Ok(flat));
                assert!((fast_mm(r, h, f64::INFINITY).unwrap() - (8.0 * h * r).sqrt()).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn impossible_input_is_refused() {
        use StepoverError::{BadCurvature, BadCutter, BadScallop, CutterTooLarge, ScallopOutOfReach};
        for r in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(flat_mm(r, 0.1), Err(BadCutter { .. })));
        }
        for h in [0.0, -0.1, 5.0, 6.0, f64::NAN, f64::INFINITY] {
            for result in [flat_mm(5.0, h), exact_mm(5.0, h, 10.0), fast_mm(5.0, h, 10.0)] {
                assert!(matches!(result, Err(BadScallop { .. })), "{h}");
            }
        }
        for result in [exact_mm(5.0, 0.1, 0.0), exact_mm(5.0, 0.1, f64::NAN), fast_mm(5.0, 0.1, 0.0)] {
            assert!(matches!(result, Err(BadCurvature { .. })));
        }
        for radius in [-5.0, -4.0, -0.1] {
            for result in [exact_mm(5.0, 0.1, radius), fast_mm(5.0, 0.1, radius)] {
                assert!(matches!(result, Err(CutterTooLarge { .. })), "{radius}");
            }
        }
        for radius in [-5.001, -5.1, -6.0, -9.0] {
            for h in [0.1, 1.0, 4.0, 4.9] {
                match exact_mm(5.0, h, radius) {
                    // The distance of two points of a circle is at most its diameter.
                    Ok(w) => assert!(w <= -2.0 * radius, "{radius} {h}: {w}"),
                    Err(error) => assert!(matches!(error, ScallopOutOfReach { .. }), "{error}"),
                }
            }
        }
        for error in [flat_mm(0.0, 0.1), exact_mm(5.0, 0.1, -4.0)] {
            assert!(error.unwrap_err().to_string().contains("mm"));
        }
    }
}
