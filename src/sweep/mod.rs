//! Sweeps: one scenario at many points, on a grid or sampled, with the metrics of every run.
//!
//! A [`Sweep`] is a scenario, what is varied in it and how: it says where its points are and computes the metrics of any
//! range of them. Point `i` is a function of the definition and `i` alone, so that a part of a sweep needs no other part.
//! [`Session`] computes a sweep (or one shard of it) into a journal that survives a kill; [`export`] writes what journals
//! hold as Parquet and CSV, in the same bytes however the sweep was divided.
//!
//! ```
//! use servosim::scenario::Document;
//! use servosim::sweep::{Plan, Sweep};
//!
//! let alpha = Document::builtin("alpha").ok_or("no alpha")?;
//! let sweep = Sweep::new(&alpha, &["axes.x.pdff.kpp=90:110:3", "feedrate.feed_mm_s=50,100"], &Plan::default())?;
//! assert_eq!(sweep.count(), 6);
//! assert_eq!(sweep.values(1)[1].number(), Some(100.0));
//! let rows = sweep.evaluate(0..sweep.count(), None).ok_or("stopped")?;
//! assert!(rows.metric(0, "max_contour_error_um") < rows.metric(1, "max_contour_error_um"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cache;
mod chart;
mod definition;
mod error;
mod evaluate;
mod export;
mod hash;
mod journal;
mod metric;
mod outcome;
#[cfg(feature = "parquet")]
mod parquet_table;
mod picture;
mod sampling;
mod session;
mod shards;
mod sobol;
mod variable;

pub use chart::{SweepAxis, SweepCell, SweepPicture, SweepPlot};
pub use definition::{Definition, Method, Plan, Sweep};
pub use error::SweepError;
pub use export::{Exported, export};
pub use journal::{Journal, Shard};
pub use metric::{Metric, Rows, Status};
pub use outcome::{Best, Outcome, PERCENTILES};
pub use session::{Session, Start};
pub use shards::merge;
pub use variable::{Value, Values, Variable};

/// Most points of a sweep: a journal of 6 GB and tables of some 30 GB; percentiles and plots need 2 GB of memory.
pub const MAX_POINTS: u64 = 100_000_000;

/// Most variables of a sweep.
pub const MAX_VARIABLES: usize = 64;
