//! The messages of a run: schema `servosim.Servo`, one a control period.

use super::schema::message;

message! {
    "servosim/PathSignals.proto"
    /// Motion along the path, as commanded.
    #[derive(Copy)]
    pub struct PathSignals {
        /// Arc length \[mm\].
        1 => [double, required] s_mm: f64,
        /// Feedrate \[mm/s\].
        2 => [double, required] feed_mm_s: f64,
        /// Acceleration along the path \[mm/s²\].
        3 => [double, required] accel_mm_s2: f64,
        /// Jerk along the path \[mm/s³\].
        4 => [double, required] jerk_mm_s3: f64,
    }
}

message! {
    "servosim/AxisSignals.proto"
    /// Signals of one axis.
    #[derive(Copy)]
    pub struct AxisSignals {
        /// Position command \[mm\].
        1 => [double, required] command_mm: f64,
        /// Actual position \[mm\].
        2 => [double, required] actual_mm: f64,
        /// Velocity command of the position loop \[rad/s\].
        3 => [double, required] velocity_command_rad_s: f64,
        /// Actual velocity \[rad/s\].
        4 => [double, required] velocity_rad_s: f64,
        /// Torque command \[N m\].
        5 => [double, required] torque_nm: f64,
        /// Voltage, clamped \[V\].
        6 => [double, required] voltage_v: f64,
        /// Whether the clamp acted.
        7 => [bool, required] saturated: bool,
        /// The interpolator's velocity of this axis \[mm/s\].
        8 => [double, required] setpoint_velocity_mm_s: f64,
        /// The interpolator's acceleration of this axis \[mm/s²\].
        9 => [double, required] setpoint_accel_mm_s2: f64,
        /// The interpolator's jerk of this axis \[mm/s³\].
        10 => [double, required] setpoint_jerk_mm_s3: f64,
    }
}

message! {
    "servosim/Nearest.proto"
    /// The point of the desired path that is nearest to the tool.
    #[derive(Copy)]
    pub struct Nearest {
        /// X \[mm\].
        1 => [double, required] x_mm: f64,
        /// Y \[mm\].
        2 => [double, required] y_mm: f64,
        /// Its arc length \[mm\].
        3 => [double, required] s_mm: f64,
    }
}

message! {
    "servosim/Servo.proto"
    /// All signals of one control period. Fields may be added; none is renamed or renumbered.
    #[derive(Copy)]
    pub struct Servo {
        /// Time `k Δt` \[s\].
        1 => [double, required] time_s: f64,
        /// Motion along the path.
        2 => [message, required] path: PathSignals,
        /// The x axis.
        3 => [message, required] x: AxisSignals,
        /// The y axis.
        4 => [message, required] y: AxisSignals,
        /// Signed distance of the tool from the desired path, positive to the left of the direction of travel \[µm\].
        5 => [double, required] contour_error_um: f64,
        /// Distance of the tool from the setpoint \[µm\].
        6 => [double, required] tracking_error_um: f64,
        /// Where on the desired path the contouring error is measured from.
        7 => [message, required] nearest: Nearest,
    }
}
