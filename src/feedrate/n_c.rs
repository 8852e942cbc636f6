//! Choosing the exponent `n_c`: the one with the lowest peak jerk.

use std::ops::RangeInclusive;

use super::{ExponentialPhase, FeedrateError, Phase};
use crate::optimize::{Outcome, PatternSearch};

/// Where [`optimize_n_c`] searches.
pub const N_C_SEARCH_RANGE: RangeInclusive<f64> = 2.0..=12.0;

/// Pattern search for the exponent with the lowest peak jerk over `2 ≤ n_c ≤ 12`, from `n_c = 5`.
///
/// For 100 mm/s in 0.1 s the best is 8.350 with 48 146 mm/s³ (the quintic has 57 735 mm/s³, and no phase of that length
/// can have less than `4 V_f/T²` = 40 000 mm/s³).
///
/// # Errors
/// Feed or duration not positive and finite.
pub fn optimize_n_c(feed_mm_s: f64, phase_s: f64) -> Result<Outcome, FeedrateError> {
    ExponentialPhase::new(feed_mm_s, phase_s, *N_C_SEARCH_RANGE.start())?;
    let peak_jerk = |point: &[f64]| {
        ExponentialPhase::new(feed_mm_s, phase_s, point[0])
            .map_or(f64::INFINITY, |phase| Phase::Exponential(phase).peaks().jerk_mm_s3)
    };
    let search = PatternSearch {
        lower: vec![*N_C_SEARCH_RANGE.start()],
        upper: vec![*N_C_SEARCH_RANGE.end()],
        ..PatternSearch::default()
    };
    Ok(search.minimize(&[5.0], peak_jerk))
}
