//! The viewers' own messages, field by field as foxglove publishes them: a viewer may fail on a schema that lacks one.
//!
//! `tests/independent_reader.py` compares them with foxglove's own descriptors.

use super::schema::{enumeration, message};

message! {
    "google/protobuf/timestamp.proto"
    pub(crate) struct Timestamp {
        1 => [int64] seconds: i64,
        2 => [int32] nanos: i32,
    }
}

message! {
    "google/protobuf/duration.proto"
    pub(crate) struct Duration {
        1 => [int64] seconds: i64,
        2 => [int32] nanos: i32,
    }
}

enumeration! {
    "Level"
    pub(crate) enum Level {
        Unknown = 0 "UNKNOWN",
        Debug = 1 "DEBUG",
        Info = 2 "INFO",
        Warning = 3 "WARNING",
        Error = 4 "ERROR",
        Fatal = 5 "FATAL",
    }
}

message! {
    "foxglove/Log.proto"
    pub(crate) struct Log with Level {
        1 => [message, required] timestamp: Timestamp,
        2 => [enumeration(Level)] level: i32,
        3 => [string] message: String,
        4 => [string] name: String,
        5 => [string] file: String,
        6 => [fixed32] line: u32,
    }
}

message! {
    "foxglove/Color.proto"
    #[derive(Copy)]
    pub(crate) struct Color {
        1 => [double] r: f64,
        2 => [double] g: f64,
        3 => [double] b: f64,
        4 => [double] a: f64,
    }
}

message! {
    "foxglove/Vector3.proto"
    #[derive(Copy)]
    pub(crate) struct Vector3 {
        1 => [double] x: f64,
        2 => [double] y: f64,
        3 => [double] z: f64,
    }
}

message! {
    "foxglove/Point3.proto"
    #[derive(Copy)]
    pub(crate) struct Point3 {
        1 => [double] x: f64,
        2 => [double] y: f64,
        3 => [double] z: f64,
    }
}

message! {
    "foxglove/Quaternion.proto"
    #[derive(Copy)]
    pub(crate) struct Quaternion {
        1 => [double] x: f64,
        2 => [double] y: f64,
        3 => [double] z: f64,
        4 => [double] w: f64,
    }
}

message! {
    "foxglove/Pose.proto"
    #[derive(Copy)]
    pub(crate) struct Pose {
        1 => [message, required] position: Vector3,
        2 => [message, required] orientation: Quaternion,
    }
}

message! {
    "foxglove/KeyValuePair.proto"
    pub(crate) struct KeyValuePair {
        1 => [string] key: String,
        2 => [string] value: String,
    }
}

message! {
    "foxglove/ArrowPrimitive.proto"
    pub(crate) struct ArrowPrimitive {
        1 => [message, required] pose: Pose,
        2 => [double] shaft_length: f64,
        3 => [double] shaft_diameter: f64,
        4 => [double] head_length: f64,
        5 => [double] head_diameter: f64,
        6 => [message, required] color: Color,
    }
}

message! {
    "foxglove/CubePrimitive.proto"
    pub(crate) struct CubePrimitive {
        1 => [message, required] pose: Pose,
        2 => [message, required] size: Vector3,
        3 => [message, required] color: Color,
    }
}

message! {
    "foxglove/SpherePrimitive.proto"
    pub(crate) struct SpherePrimitive {
        1 => [message, required] pose: Pose,
        2 => [message, required] size: Vector3,
        3 => [message, required] color: Color,
    }
}

message! {
    "foxglove/CylinderPrimitive.proto"
    pub(crate) struct CylinderPrimitive {
        1 => [message, required] pose: Pose,
        2 => [message, required] size: Vector3,
        3 => [double] bottom_scale: f64,
        4 => [double] top_scale: f64,
        5 => [message, required] color: Color,
    }
}

enumeration! {
    "Type"
    pub(crate) enum LineType {
        Strip = 0 "LINE_STRIP",
        Loop = 1 "LINE_LOOP",
        List = 2 "LINE_LIST",
    }
}

message! {
    "foxglove/LinePrimitive.proto"
    pub(crate) struct LinePrimitive with LineType {
        1 => [enumeration(LineType)] r#type: i32,
        2 => [message, required] pose: Pose,
        3 => [double] thickness: f64,
        4 => [bool] scale_invariant: bool,
        5 => [message, repeated] points: Vec<Point3>,
        6 => [message, required] color: Color,
        7 => [message, repeated] colors: Vec<Color>,
        8 => [fixed32, repeated] indices: Vec<u32>,
    }
}

message! {
    "foxglove/TriangleListPrimitive.proto"
    pub(crate) struct TriangleListPrimitive {
        1 => [message, required] pose: Pose,
        2 => [message, repeated] points: Vec<Point3>,
        3 => [message, required] color: Color,
        4 => [message, repeated] colors: Vec<Color>,
        5 => [fixed32, repeated] indices: Vec<u32>,
    }
}

message! {
    "foxglove/TextPrimitive.proto"
    pub(crate) struct TextPrimitive {
        1 => [message, required] pose: Pose,
        2 => [bool] billboard: bool,
        3 => [double] font_size: f64,
        4 => [bool] scale_invariant: bool,
        5 => [message, required] color: Color,
        6 => [string] text: String,
    }
}

message! {
    "foxglove/ModelPrimitive.proto"
    pub(crate) struct ModelPrimitive {
        1 => [message, required] pose: Pose,
        2 => [message, required] scale: Vector3,
        3 => [message, required] color: Color,
        4 => [bool] override_color: bool,
        5 => [string] url: String,
        6 => [string] media_type: String,
        7 => [bytes] data: Vec<u8>,
    }
}

message! {
    "foxglove/SceneEntity.proto"
    pub(crate) struct SceneEntity {
        1 => [message, required] timestamp: Timestamp,
        2 => [string] frame_id: String,
        3 => [string] id: String,
        4 => [message, required] lifetime: Duration,
        5 => [bool] frame_locked: bool,
        6 => [message, repeated] metadata: Vec<KeyValuePair>,
        7 => [message, repeated] arrows: Vec<ArrowPrimitive>,
        8 => [message, repeated] cubes: Vec<CubePrimitive>,
        9 => [message, repeated] spheres: Vec<SpherePrimitive>,
        10 => [message, repeated] cylinders: Vec<CylinderPrimitive>,
        11 => [message, repeated] lines: Vec<LinePrimitive>,
        12 => [message, repeated] triangles: Vec<TriangleListPrimitive>,
        13 => [message, repeated] texts: Vec<TextPrimitive>,
        14 => [message, repeated] models: Vec<ModelPrimitive>,
    }
}

enumeration! {
    "Type"
    pub(crate) enum DeletionType {
        MatchingId = 0 "MATCHING_ID",
        All = 1 "ALL",
    }
}

message! {
    "foxglove/SceneEntityDeletion.proto"
    pub(crate) struct SceneEntityDeletion with DeletionType {
        1 => [message, required] timestamp: Timestamp,
        2 => [enumeration(DeletionType)] r#type: i32,
        3 => [string] id: String,
    }
}

message! {
    "foxglove/SceneUpdate.proto"
    pub(crate) struct SceneUpdate {
        1 => [message, repeated] deletions: Vec<SceneEntityDeletion>,
        2 => [message, repeated] entities: Vec<SceneEntity>,
    }
}

impl Timestamp {
    /// A time of the run as its messages carry it.
    pub(crate) fn from_nanos(time_ns: u64) -> Self {
        let seconds = i64::try_from(time_ns / 1_000_000_000).unwrap_or(i64::MAX);
        let nanos = i32::try_from(time_ns % 1_000_000_000).unwrap_or(0);
        Self { seconds, nanos }
    }
}

impl Pose {
    /// At `x`, `y`, not turned.
    pub(crate) fn at(x: f64, y: f64) -> Self {
        Self { position: Vector3 { x, y, z: 0.0 }, orientation: Quaternion { w: 1.0, ..Quaternion::default() } }
    }
}
