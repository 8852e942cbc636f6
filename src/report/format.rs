//! File formats of plots.

/// File format of a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Format {
    /// Vector graphics, 1200 × 800.
    #[default]
    Svg,
    /// Pixels, 2400 × 1600.
    Png,
}

impl Format {
    /// Ending of file names.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
        }
    }
}
