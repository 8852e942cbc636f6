//! Recordings: one MCAP file a run, written as it happens and read as a stream.
//!
//! | topic | schema | when |
//! |---|---|---|
//! | `/servo` | `servosim.Servo` ([`Servo`]) | once a control period; `sequence` is its number `k` |
//! | | `servosim.Servo3` ([`Servo`], then [`Third`]) | the same of a run with three axes; can be read as a `servosim.Servo` |
//! | `/drives` | `servosim.Drives` ([`Drives`]) | the drive signals, with the detailed drive model: a message before each of `/servo`, of the same `sequence` and time |
//! | | `servosim.Drives3` ([`Drives`], then [`ThirdDrive`]) | the same with three axes |
//! | `/scene` | `foxglove.SceneUpdate` | the desired path at `t = 0`, then the actual path and the magnified error in pieces |
//! | `/log` | `foxglove.Log` | first and last line, and every [`Event`](crate::limits::Event) between (saturations thinned) |
//!
//! `log_time = publish_time = k Δt` in whole nanoseconds from zero, never decreasing over the file. The scenario is attached
//! as `scenario.toml`, the summary as `summary.json`; metadata `servosim.run` holds name, scenario hash, seed, version and
//! units, `servosim.plan` what was planned. Lengths in `/scene` are millimetres: one unit of a viewer (which calls it a
//! metre) is 1 mm. Nothing depends on the time of day: the same run gives the same bytes.
//!
//! [`Recorder`] writes, [`Recording`] reads, [`csv`] exports.

pub mod csv;
mod error;
mod fields;
mod foxglove;
mod log;
mod messages;
mod place;
mod reader;
mod recorder;
mod scene;
mod schema;

pub use error::{ReadError, RecordingError};
pub use messages::{AxisSignals, DriveSignals, Drives, Nearest, PathSignals, Sample, Servo, Third, ThirdDrive};
pub use reader::{AttachmentInfo, LogLevel, LogLine, Recording, TopicInfo};
pub use recorder::{Recorder, RecordingMetadata, Saved};

const SERVO_TOPIC: &str = "/servo";
const DRIVES_TOPIC: &str = "/drives";
const SCENE_TOPIC: &str = "/scene";
const LOG_TOPIC: &str = "/log";
const RUN_METADATA: &str = "servosim.run";
const PLAN_METADATA: &str = "servosim.plan";
const SCENARIO_NAME: &str = "scenario.toml";
const SUMMARY_NAME: &str = "summary.json";
