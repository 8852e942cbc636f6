//! What plots of sweeps share: title, legend entries, markers.

use super::super::super::axis::{Axis, Range, significant};
use super::super::super::curve::Px;
use super::super::super::figure::Figure;
use super::super::super::font;
use super::super::super::style::{Colour, INK, VERMILLION, WHITE};
use super::super::super::subplot::{Entry, Heading, Symbol, TITLE_EM, x_axis};
use super::super::words::{capital, printable};
use crate::sweep::{SweepCell, SweepPicture};

/// Cells of loops that locked up, and of points without a metric: no colour of the scale.
pub(super) const LOCKED: Colour = (128, 128, 128);
pub(super) const MISSING: Colour = (222, 222, 222);

/// The scenario's own point, and the best one.
pub(super) const OWN: Colour = INK;
pub(super) const BEST: Colour = VERMILLION;

pub(super) fn heading(picture: &SweepPicture) -> Heading {
    let over = match picture.over.as_slice() {
        [] => String::new(),
        [one] => format!(" over {one}"),
        [one, two] => format!(" over {one} and {two}"),
        more => format!(" over {} values", more.len()),
    };
    let name = font::shortened(&printable(&picture.name), TITLE_EM, 500.0);
    Heading {
        title: format!("{name}: {}{over}", picture.metric),
        subtitle: capital(&picture.caption),
        ..Heading::default()
    }
}

/// A value of the metric with its unit.
pub(super) fn with_unit(picture: &SweepPicture, value: f64) -> String {
    format!("{} {}", significant(value, 4), picture.unit).trim_end().to_owned()
}

/// Legend entries for what has no metric.
pub(super) fn missing_entries(cells: impl Iterator<Item = SweepCell>) -> Vec<Entry> {
    let (mut locked, mut missing) = (false, false);
    for cell in cells {
        locked |= cell == SweepCell::LockedUp;
        missing |= cell == SweepCell::Missing;
    }
    let entry = |colour, text: &str| Entry { symbol: Symbol::Area(colour), text: text.to_owned() };
    let mut entries = Vec::new();
    entries.extend(locked.then(|| entry(LOCKED, "locked up")));
    entries.extend(missing.then(|| entry(MISSING, "no metric (invalid, diverged)")));
    entries
}

pub(super) fn ring_entry(colour: Colour, text: String) -> Entry {
    Entry { symbol: Symbol::Ring(colour), text }
}

/// A ring that can be seen on every colour.
pub(super) fn marker(figure: &mut Figure, at: Px, colour: Colour) {
    figure.dot(at, 7.0, WHITE);
    figure.ring(at, 6.0, 2.2, colour);
}

/// An axis across that ends where its values do.
pub(super) fn across(range: Range, width_px: f64, logarithmic: bool) -> Axis {
    if logarithmic { Axis::logarithmic_within(range, width_px, 90.0) } else { x_axis(range, width_px, false) }
}
