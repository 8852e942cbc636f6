//! What points come to: their status, and their metrics.

use serde::{Deserialize, Serialize};

/// What became of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// It ran, and no axis saturated.
    Ok,
    /// An axis saturated and recovered.
    Saturated,
    /// An axis locked up: its metrics are those of a loop that is lost.
    LockedUp,
    /// A signal grew beyond all numbers: there are no metrics.
    Diverged,
    /// The values make no valid scenario: there are no metrics.
    Invalid,
}

impl Status {
    /// All of them, in the order of their codes in a journal.
    pub const ALL: [Self; 5] = [Self::Ok, Self::Saturated, Self::LockedUp, Self::Diverged, Self::Invalid];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Saturated => "saturated",
            Self::LockedUp => "locked_up",
            Self::Diverged => "diverged",
            Self::Invalid => "invalid",
        }
    }

    /// Whether the loop did its work: it has metrics, and they are those of a loop that follows.
    pub fn is_sound(self) -> bool {
        matches!(self, Self::Ok | Self::Saturated)
    }
}

/// A metric of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metric(usize);

/// Name, words and unit of every metric, and whether more of it is better: those of the run, then the margins.
pub(super) const METRICS: [(&str, &str, &str, bool); 17] = [
    ("max_contour_error_um", "max contouring error", "µm", false),
    ("rms_contour_error_um", "rms contouring error", "µm", false),
    ("max_tracking_error_um", "max tracking error", "µm", false),
    ("rms_tracking_error_um", "rms tracking error", "µm", false),
    ("peak_voltage_x_v", "peak voltage of X", "V", false),
    ("peak_voltage_y_v", "peak voltage of Y", "V", false),
    ("saturated_share", "share of saturated samples", "", false),
    ("peak_sensitivity_x", "peak sensitivity Ms of X", "", false),
    ("peak_sensitivity_y", "peak sensitivity Ms of Y", "", false),
    ("gain_down_x", "lower end of the gain margin of X", "", false),
    ("gain_down_y", "lower end of the gain margin of Y", "", false),
    ("gain_up_x", "upper end of the gain margin of X", "", true),
    ("gain_up_y", "upper end of the gain margin of Y", "", true),
    ("phase_margin_x_deg", "phase margin of X", "°", true),
    ("phase_margin_y_deg", "phase margin of Y", "°", true),
    ("delay_margin_x_s", "delay margin of X", "s", true),
    ("delay_margin_y_s", "delay margin of Y", "s", true),
];

/// How many of them are of the run.
pub(super) const OF_THE_RUN: usize = 7;

impl Metric {
    /// Largest contouring error, either side \[µm\].
    pub const MAX_CONTOUR_ERROR: Self = Self(0);

    /// Those of the run, and with `margins` those of the loops, in the order of the tables' columns.
    pub fn all(margins: bool) -> impl Iterator<Item = Self> {
        (0..if margins { METRICS.len() } else { OF_THE_RUN }).map(Self)
    }

    /// The metric of this name.
    pub fn find(name: &str) -> Option<Self> {
        Self::all(true).find(|metric| metric.name() == name)
    }

    fn metadata(self) -> (&'static str, &'static str, &'static str, bool) {
        METRICS.get(self.0).copied().unwrap_or(METRICS[0])
    }

    /// Name of its column, with its unit.
    pub fn name(self) -> &'static str {
        self.metadata().0
    }

    /// What it is, in words.
    pub fn title(self) -> &'static str {
        self.metadata().1
    }

    /// Its unit; empty for a share.
    pub fn unit(self) -> &'static str {
        self.metadata().2
    }

    /// Whether more of it is better.
    pub fn is_better_large(self) -> bool {
        self.metadata().3
    }

    /// Whether it is a margin of a loop ([`crate::analysis::Margins`]) rather than a metric of the run.
    pub fn is_margin(self) -> bool {
        self.0 >= OF_THE_RUN
    }

    /// Its place among all metrics.
    pub(super) fn place(self) -> usize {
        self.0
    }
}

/// Status and metrics of points in a row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Rows {
    /// One a point.
    pub status: Vec<Status>,
    /// Metrics of a point.
    pub width: usize,
    /// All metrics of the first point, of the second, …; NaN where there are none. A margin may be infinite.
    pub metrics: Vec<f64>,
}

impl Rows {
    /// How many points.
    pub fn len(&self) -> usize {
        self.status.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.status.is_empty()
    }

    /// All metrics of the point at `place`.
    pub fn metrics_of(&self, place: usize) -> &[f64] {
        self.metrics.get(place * self.width..(place + 1) * self.width).unwrap_or_default()
    }

    /// One metric of the point at `place`; NaN where there is none of this name.
    pub fn metric(&self, place: usize, name: &str) -> f64 {
        Metric::find(name).and_then(|metric| self.metrics_of(place).get(metric.0).copied()).unwrap_or(f64::NAN)
    }
}
