//! The messages of a run: schema `servosim.Servo`, one a control period, and `servosim.Drives` beside it with the detailed drive model.

use super::schema::{Described, Draft, Files, fixed_message};

fixed_message! {
    "servosim/PathSignals.proto"
    /// Motion along the path, as commanded.
    pub struct PathSignals {
        /// Arc length \[mm\].
        1 => [double] s_mm: f64,
        /// Feedrate \[mm/s\].
        2 => [double] feed_mm_s: f64,
        /// Acceleration along the path \[mm/s²\].
        3 => [double] accel_mm_s2: f64,
        /// Jerk along the path \[mm/s³\].
        4 => [double] jerk_mm_s3: f64,
    }
}

fixed_message! {
    "servosim/AxisSignals.proto"
    /// Signals of one axis.
    pub struct AxisSignals {
        /// Position command \[mm\].
        1 => [double] command_mm: f64,
        /// Actual position \[mm\].
        2 => [double] actual_mm: f64,
        /// Velocity command of the position loop \[rad/s\].
        3 => [double] velocity_command_rad_s: f64,
        /// Actual velocity \[rad/s\].
        4 => [double] velocity_rad_s: f64,
        /// Torque command \[N m\].
        5 => [double] torque_nm: f64,
        /// Voltage, clamped \[V\].
        6 => [double] voltage_v: f64,
        /// Whether the clamp acted.
        7 => [bool] saturated: bool,
        /// The interpolator's velocity of this axis \[mm/s\].
        8 => [double] setpoint_velocity_mm_s: f64,
        /// The interpolator's acceleration of this axis \[mm/s²\].
        9 => [double] setpoint_accel_mm_s2: f64,
        /// The interpolator's jerk of this axis \[mm/s³\].
        10 => [double] setpoint_jerk_mm_s3: f64,
    }
}

fixed_message! {
    "servosim/Nearest.proto"
    /// The point of the desired path that is nearest to the tool.
    pub struct Nearest {
        /// X \[mm\].
        1 => [double] x_mm: f64,
        /// Y \[mm\].
        2 => [double] y_mm: f64,
        /// Its arc length \[mm\].
        3 => [double] s_mm: f64,
    }
}

fixed_message! {
    "servosim/Servo.proto"
    /// All signals of one control period. Fields may be added; none is renamed or renumbered.
    pub struct Servo {
        /// Time `k Δt` \[s\].
        1 => [double] time_s: f64,
        /// Motion along the path.
        2 => [message] path: PathSignals,
        /// The x axis.
        3 => [message] x: AxisSignals,
        /// The y axis.
        4 => [message] y: AxisSignals,
        /// Signed distance of the tool from the desired path, positive to the left of the direction of travel \[µm\].
        5 => [double] contour_error_um: f64,
        /// Distance of the tool from the setpoint \[µm\].
        6 => [double] tracking_error_um: f64,
        /// Where on the desired path the contouring error is measured from.
        7 => [message] nearest: Nearest,
    }
}

fixed_message! {
    "servosim/Third.proto"
    /// What a sample of a machine with three axes holds beside the signals of [`Servo`].
    pub struct Third {
        /// The z axis.
        8 => [message] z: AxisSignals,
        /// Z of the nearest point \[mm\].
        9 => [double] nearest_z_mm: f64,
        /// Line of the program, from 1; 0 where there is none.
        10 => [double] line: f64,
        /// Whether the block is rapid motion.
        11 => [bool] rapid: bool,
    }
}

fixed_message! {
    "servosim/DriveSignals.proto"
    /// The drive signals of one axis, beside its [`AxisSignals`].
    pub struct DriveSignals {
        /// Position as the controller was signals \[mm\].
        1 => [double] measured_mm: f64,
        /// Velocity as the controller was signals \[rad/s\].
        2 => [double] measured_rad_s: f64,
        /// Motor position, as travel of the table without backlash, twist and pitch error \[mm\].
        3 => [double] motor_mm: f64,
        /// Velocity of the table (of the screw, where it is rigid) \[mm/s\].
        4 => [double] table_mm_s: f64,
        /// Torque of the motor without ripple \[N m\].
        5 => [double] motor_torque_nm: f64,
        /// Torque ripple \[N m\].
        6 => [double] ripple_nm: f64,
        /// Friction at the motor shaft, positive where it pushes forward \[N m\]; without the plant's own viscous one.
        7 => [double] friction_nm: f64,
        /// Cutting force as a torque at the motor shaft \[N m\].
        8 => [double] force_nm: f64,
        /// Whether the table sticks.
        9 => [bool] stuck: bool,
        /// Whether the table floats in the backlash, between two masses.
        10 => [bool] in_gap: bool,
    }
}

fixed_message! {
    "servosim/Drives.proto"
    /// The drive signals of one control period. Fields may be added; none is renamed or renumbered.
    pub struct Drives {
        /// Time `k Δt` \[s\], that of the period's [`Servo`].
        1 => [double] time_s: f64,
        /// The x axis.
        2 => [message] x: DriveSignals,
        /// The y axis.
        3 => [message] y: DriveSignals,
    }
}

fixed_message! {
    "servosim/ThirdDrive.proto"
    /// What a machine with three axes adds to [`Drives`].
    pub struct ThirdDrive {
        /// The z axis.
        4 => [message] z: DriveSignals,
    }
}

/// The message of a machine with three axes: the fields of the message for two under the same numbers, so that it can be read as one,
/// then those of what the third axis adds. On the wire it is the one behind the other.
macro_rules! of_three_axes {
    ($file:literal $name:ident = $two:ident, $third:ident) => {
        pub(crate) enum $name {}

        impl Described for $name {
            const FILE: &'static str = $file;
            const NAME: &'static str = stringify!($name);

            fn fields(files: &mut Files, draft: &mut Draft) {
                $two::fields(files, draft);
                $third::fields(files, draft);
            }
        }

        impl $name {
            const LENGTH: usize = $two::LENGTH + $third::LENGTH;

            /// The encoded message, which always has the same length.
            #[inline]
            pub(crate) fn to_bytes(two: &$two, third: &$third) -> [u8; Self::LENGTH] {
                let mut bytes = [0; Self::LENGTH];
                let behind = two.put_fields(&mut bytes, 0);
                third.put_fields(&mut bytes, behind);
                bytes
            }
        }
    };
}

of_three_axes!("servosim/Servo3.proto" Servo3 = Servo, Third);
of_three_axes!("servosim/Drives3.proto" Drives3 = Drives, ThirdDrive);

/// A control period as a recording holds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The signals of every machine.
    pub servo: Servo,
    /// What a machine with three axes adds to them.
    pub third: Option<Third>,
    /// The drive signals, with the detailed drive model.
    pub drives: Option<Drives>,
    /// What a machine with three axes adds to that.
    pub third_drive: Option<ThirdDrive>,
}

// The fast encoding writes the length of an inner message in one byte.
const _: () = assert!(PathSignals::LENGTH < 128 && AxisSignals::LENGTH < 128 && Nearest::LENGTH < 128);
const _: () = assert!(DriveSignals::LENGTH < 128);

macro_rules! of_two_axes {
    ($($name:ident),+) => {$(
        impl $name {
            /// The encoded message, which always has the same length.
            #[inline]
            pub(crate) fn to_bytes(self) -> [u8; Self::LENGTH] {
                let mut bytes = [0; Self::LENGTH];
                self.put_fields(&mut bytes, 0);
                bytes
            }
        }
    )+};
}

of_two_axes!(Servo, Drives);

#[cfg(test)]
mod tests {
    use prost::Message;

    use super::*;

    #[test]
    fn validates_fast_encoding_against_prost() {
        let axis = |base: f64, saturated| AxisSignals {
            command_mm: base,
            actual_mm: -base,
            velocity_command_rad_s: 0.0,
            velocity_rad_s: -0.0,
            torque_nm: f64::NAN,
            voltage_v: f64::INFINITY,
            saturated,
            setpoint_velocity_mm_s: base * 3.0,
            setpoint_accel_mm_s2: base / 7.0,
            setpoint_jerk_mm_s3: f64::MIN_POSITIVE,
        };
        let servo = Servo {
            time_s: 0.125,
            path: PathSignals { s_mm: 1.0, feed_mm_s: 2.0, accel_mm_s2: 3.0, jerk_mm_s3: 4.0 },
            x: axis(5.5, true),
            y: axis(-6.25, false),
            contour_error_um: 7.0,
            tracking_error_um: 8.0,
            nearest: Nearest { x_mm: 9.0, y_mm: 10.0, s_mm: 11.0 },
        };
        for servo in [servo, Servo::default()] {
            assert_eq!(servo.to_bytes()[..], servo.encode_to_vec());
            let third = Third { z: axis(3.5, true), nearest_z_mm: 12.0, line: 13.0, rapid: true };
            let bytes = Servo3::to_bytes(&servo, &third);
            assert_eq!(bytes[..], [servo.encode_to_vec(), third.encode_to_vec()].concat());
            assert_eq!(Servo::decode(&bytes[..]).unwrap().to_bytes(), servo.to_bytes(), "read as two axes");
            assert_eq!(Third::decode(&bytes[..]).unwrap().encode_to_vec(), third.encode_to_vec(), "and as the third");
        }
        let drive = |base: f64, stuck| DriveSignals {
            measured_mm: base,
            measured_rad_s: -0.0,
            motor_mm: base / 3.0,
            table_mm_s: f64::NEG_INFINITY,
            motor_torque_nm: -base,
            ripple_nm: f64::NAN,
            friction_nm: 0.0,
            force_nm: f64::MIN_POSITIVE,
            stuck,
            in_gap: !stuck,
        };
        for drives in [Drives { time_s: 0.25, x: drive(1.5, true), y: drive(-7.0, false) }, Drives::default()] {
            assert_eq!(drives.to_bytes()[..], drives.encode_to_vec());
            let third = ThirdDrive { z: drive(11.0, true) };
            let bytes = Drives3::to_bytes(&drives, &third);
            assert_eq!(bytes[..], [drives.encode_to_vec(), third.encode_to_vec()].concat());
            assert_eq!(Drives::decode(&bytes[..]).unwrap().to_bytes(), drives.to_bytes(), "read as two axes");
            assert_eq!(ThirdDrive::decode(&bytes[..]).unwrap().encode_to_vec(), third.encode_to_vec(), "the third");
        }
    }
}
