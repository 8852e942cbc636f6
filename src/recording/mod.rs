//! Recordings: one MCAP file a run, written as it happens and read as a stream.
//!
//! | topic | schema | when |
//! |---|---|---|
//! | `/servo` | `servosim.Servo` ([`Servo`]) | once a control period; `sequence` is its number `k` |
//! | | `servosim.Servo3` ([`Servo`], then [`Third`]) | the same of a run with three axes; can be read as a `servosim.Servo` |
//! | `/drives` | `servosim.Drives` ([`Drives`]) | the drive signals, with the detailed drive model: a message before each of `/servo`, of the same `sequence` and time |
//! | | `servosim.Drives3` ([`Drives`], then [`ThirdDrive`]) | the same with three axes |
//! | `/path` | `foxglove.SceneUpdate` | the desired path, once, at `t = 0` |
//! | `/trace` | `foxglove.SceneUpdate` | the actual path and the magnified error from the beginning, about ten times in a run |
//! | `/scene` | `foxglove.SceneUpdate` | the same since the last message of `/trace` |
//! | `/log` | `foxglove.Log` | first and last line, and every [`Event`](crate::simulation::Event) between (saturations thinned) |
//!
//! `log_time = publish_time = k Δt` in whole nanoseconds from zero, never decreasing over the file. The scenario is attached
//! as `scenario.toml`, the summary as `summary.json`; metadata `servosim.run` holds name, scenario hash, seed, version and
//! units, `servosim.plan` what was planned. Lengths in `/path`, `/trace` and `/scene` are millimetres: one unit of a viewer (which calls it a
//! metre) is 1 mm. Nothing depends on the time of day: the same run gives the same bytes.
//!
//! [`Recorder`] writes, [`Recording`] reads, [`csv`] exports.

pub mod csv;
mod error;
mod fields;
mod foxglove;
mod layout;
mod log;
mod messages;
mod place;
mod reader;
mod recorder;
mod scene;
mod schema;
#[cfg(test)]
mod viewer_tests;

pub use error::{ReadError, RecordingError};
pub use messages::{AxisSignals, DriveSignals, Drives, Nearest, PathSignals, Sample, Servo, Third, ThirdDrive};
pub use reader::{AttachmentInfo, LogLevel, LogLine, Recording, TopicInfo};
pub use recorder::{Compression, Recorder, RecordingMetadata, RecordingOptions, Saved};

const SERVO_TOPIC: &str = "/servo";
const DRIVES_TOPIC: &str = "/drives";
const PATH_TOPIC: &str = "/path";
const TRACE_TOPIC: &str = "/trace";
const SCENE_TOPIC: &str = "/scene";
const LOG_TOPIC: &str = "/log";
const RUN_METADATA: &str = "servosim.run";
const PLAN_METADATA: &str = "servosim.plan";
const SCENARIO_NAME: &str = "scenario.toml";
const SUMMARY_NAME: &str = "summary.json";
