//! Servo loops as their plots show them: what Bode, Nyquist and step plots share.

use super::super::axis::{Range, significant};
use super::super::curve::Dash;
use super::super::font;
use super::super::style::{CURVE_PX, Colour, LineStyle, MUTED};
use super::super::subplot::{Entry, Heading, TITLE_EM};
use crate::analysis::{DriveLoop, Margins};

/// Points of a frequency response.
const POINTS: u32 = 3000;
/// Reference lines: 0 dB, -180°, the unit circle.
pub(super) const REFERENCE: LineStyle = LineStyle { colour: MUTED, width_px: 1.2, dash: None };
/// Gain factors that are farther away than this are no margin that anybody needs: their places are marked, and not labelled.
pub(super) const LABELLED: f64 = 8.0;
pub(super) const THIN: Dash = Dash::new(4.0, 4.0);

/// One axis as it is drawn.
pub(in super::super) struct Drawn<'a> {
    pub(in super::super) name: String,
    pub(in super::super) colour: Colour,
    pub(in super::super) drive: &'a DriveLoop,
    pub(in super::super) margins: Margins,
    pub(in super::super) crossovers: Vec<f64>,
    pub(in super::super) phase_crossovers: Vec<(f64, f64)>,
}

impl Drawn<'_> {
    pub(super) fn line_style(&self) -> LineStyle {
        LineStyle::solid(self.colour, CURVE_PX)
    }
}

pub(super) fn heading(title: &str, what: &str, axes: &[Drawn<'_>]) -> Heading {
    let unstable = axes.iter().filter(|axis| !axis.margins.stable);
    Heading {
        title: format!("{}: {what}", font::shortened(title, TITLE_EM, 700.0)),
        warnings: unstable
            .map(|axis| format!("{}: unstable, largest pole {}", axis.name, significant(axis.margins.pole_radius, 5)))
            .collect(),
        ..Heading::default()
    }
}

/// What is in the loops beyond their models; nothing of models.
pub(super) fn in_the_loop(axes: &[Drawn<'_>]) -> String {
    let mut taken: Vec<&str> = Vec::new();
    for what in axes.iter().flat_map(|axis| &axis.drive.linearized().modelled) {
        if !taken.contains(&what.as_str()) {
            taken.push(what);
        }
    }
    let mut parts = Vec::new();
    if !taken.is_empty() {
        parts.push(format!("With {}", taken.join(", ")));
    }
    if axes.iter().any(|axis| !axis.drive.linearized().neglected.is_empty()) {
        parts.push("Nonlinear effects are neglected".to_owned());
    }
    parts.join(". ")
}

/// From well below the lowest frequency that matters up to `π/Δt` \[rad/s\].
pub(super) fn frequencies(axes: &[Drawn<'_>]) -> Range {
    let mut range = Range::EMPTY;
    for axis in axes {
        let nyquist = axis.drive.nyquist_rad_s();
        // Room beside the last point.
        range.include(1.08 * nyquist);
        range.include(nyquist / 200.0);
        let marked = axis.phase_crossovers.iter().map(|(omega, _)| *omega);
        for omega in marked.chain(axis.crossovers.iter().copied()) {
            range.include((omega / 4.0).max(nyquist * 1e-7));
        }
    }
    range.opened(1e-9)
}

/// Frequencies evenly spaced in their logarithm.
pub(super) fn spaced(range: Range) -> impl Iterator<Item = f64> {
    (0..=POINTS).map(move |i| range.low * libm::pow(range.high / range.low, f64::from(i) / f64::from(POINTS)))
}

/// Margins in few words, for a legend.
fn margins_text(margins: &Margins) -> String {
    if !margins.stable {
        return "unstable".to_owned();
    }
    format!(
        "Ms {}, gain × {} to {}, phase {}°, delay {} ms",
        significant(margins.peak_sensitivity, 4),
        significant(margins.gain_down, 4),
        significant(margins.gain_up, 4),
        significant(margins.phase_margin_deg, 4),
        significant(1e3 * margins.delay_margin_s, 3)
    )
}

/// A legend entry an axis, with its margins.
pub(super) fn entries(axes: &[Drawn<'_>]) -> Vec<Entry> {
    let entry =
        |axis: &Drawn<'_>| Entry::line(axis.line_style(), format!("{}: {}", axis.name, margins_text(&axis.margins)));
    axes.iter().map(entry).collect()
}
