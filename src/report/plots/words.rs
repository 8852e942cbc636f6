//! Words of titles and legends.

/// Without characters that XML forbids or that have no place in a line of text.
pub(in super::super) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') { ' ' } else { c }).collect()
}

pub(in super::super) fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map(|c| c.to_uppercase().chain(chars).collect()).unwrap_or_default()
}

/// `+8.3 %` between two metrics; nothing where there is no sense in it.
pub(in super::super) fn change(from: f64, to: f64) -> Option<String> {
    let percent = 100.0 * (to / from - 1.0);
    (percent.is_finite() && percent.abs() < 1e4).then(|| {
        let sign = if percent < 0.0 { "−" } else { "+" };
        format!("{sign}{:.1} %", percent.abs())
    })
}
