//! Numbers for people.

/// A number with about `digits` digits, and no more decimals than that needs.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return if value.is_nan() { "-".to_owned() } else { "infinite".to_owned() };
    }
    let magnitude = value.abs();
    if !(1e-4..1e9).contains(&magnitude) {
        return format!("{value:.*e}", digits.saturating_sub(1));
    }
    let whole =
        (0_usize..9).rev().find(|&n| magnitude >= 10f64.powi(i32::try_from(n).unwrap_or(0))).map_or(0, |n| n + 1);
    format!("{value:.*}", digits.saturating_sub(whole))
}

/// As [`significant`], without zeros at the end of the decimals.
pub(crate) fn short(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}
