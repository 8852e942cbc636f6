//! What a chart of a sweep shows. The drawing is that of `report`.

/// A variable along an axis.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SweepAxis {
    /// What it is.
    pub title: String,
    /// Whether its logarithm is evenly spaced.
    pub logarithmic: bool,
}

/// What a point, or a cell of points, shows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum SweepCell {
    /// Nothing: no point lies there.
    #[default]
    Empty,
    /// The metric.
    Metric(f64),
    /// The loop locked up.
    LockedUp,
    /// There is no metric: the point is no valid scenario, or its loop diverged.
    Missing,
}

impl SweepCell {
    /// The one of two that is worse news.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        let rank = |cell: &Self| match cell {
            Self::Empty => 0,
            Self::Metric(_) => 1,
            Self::LockedUp => 2,
            Self::Missing => 3,
        };
        match (self, other) {
            (Self::Metric(a), Self::Metric(b)) => Self::Metric(a.max(b)),
            (a, b) if rank(&b) > rank(&a) => b,
            (a, _) => a,
        }
    }
}

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum SweepPlot {
    /// The metric over two variables, cell by cell.
    Map {
        /// Across and up.
        axes: [SweepAxis; 2],
        /// Borders of the cells, rising.
        edges: [Vec<f64>; 2],
        /// Row after row, the lowest first.
        cells: Vec<SweepCell>,
        /// Whether several points share a cell.
        shared: bool,
        /// The scenario's own values.
        own: Option<[f64; 2]>,
        /// The best point and its metric.
        best: Option<([f64; 2], f64)>,
    },
    /// The metric at scattered values of two variables.
    Scatter {
        /// Across and up.
        axes: [SweepAxis; 2],
        /// The points.
        points: Vec<([f64; 2], SweepCell)>,
        /// The scenario's own values.
        own: Option<[f64; 2]>,
        /// The best point and its metric.
        best: Option<([f64; 2], f64)>,
    },
    /// The metric over one variable.
    Curve {
        /// Across.
        axis: SweepAxis,
        /// The points, in the order of the variable.
        points: Vec<(f64, SweepCell)>,
        /// The scenario's own value.
        own: Option<f64>,
        /// The best point and its metric.
        best: Option<(f64, f64)>,
    },
    /// How often the metric takes which value.
    Histogram {
        /// Sorted.
        values: Vec<f64>,
        /// Percent and value.
        percentiles: Vec<(u32, f64)>,
    },
}

/// A sweep to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPicture {
    /// Name of the scenario.
    pub name: String,
    /// How many points of what kind.
    pub caption: String,
    /// The metric, in words.
    pub metric: &'static str,
    /// Its unit; may be empty.
    pub unit: &'static str,
    /// What is varied.
    pub over: Vec<String>,
    /// What is drawn.
    pub plot: SweepPlot,
}
