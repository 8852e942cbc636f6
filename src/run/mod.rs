//! A run from what was asked for to what is left of it: recording, layout of the viewer, plots and metrics. What the command line, a page or
//! a wheel call.
//!
//! | request in | report out |
//! |---|---|
//! | [`RunRequest`]: folder, name, how to record, whether to draw | [`RunReport`]: summary, files, effects one by one, unstable loops |
//! | a [`Scenario`](crate::scenario::Scenario): [`run_scenario`] | the same |
//! | a [`Program`]: [`run_program`] | [`ProgramReport`]: the same, the program's blocks, the part as programmed and as cut |
//!
//! Nothing is printed here. A [`Watch`] sees every control period and hears of the stages; a raised flag ends a run in order.
//!
//! ```
//! use std::sync::atomic::AtomicBool;
//! use servosim::run::{RunRequest, Unwatched, run_scenario};
//! use servosim::scenario::Scenario;
//!
//! let folder = std::env::temp_dir().join("servosim-run-example");
//! let scenario = Scenario::builtin("alpha")?;
//! let report = run_scenario(&scenario, &RunRequest::new(&folder), &AtomicBool::new(false), &mut Unwatched)?;
//! assert!((report.summary.max_contour_error_um - 27.027).abs() < 1e-3 && report.passed());
//! assert!(report.recording.ends_with("alpha.mcap"));
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod files;
#[cfg(feature = "plots")]
pub mod pictures;
mod program;
#[cfg(feature = "plots")]
mod recorded;
mod request;
mod scenario;
mod threads;

pub use error::RunError;
pub use files::make_folder;
pub use program::{PartMaps, PartPair, Program, ProgramMetrics, ProgramReport, is_program, run_program};
#[cfg(feature = "plots")]
pub use recorded::recorded;
pub use request::{RunReport, RunRequest, Stage, Unwatched, Watch};
pub use scenario::{recording_bytes, run_scenario};
pub use threads::{has_threads, prepare_threads};
