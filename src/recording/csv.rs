//! `/servo`, and `/drives` where there is one, as comma-separated values: one line a control period, full double precision.

use std::io::{self, Write};
use std::mem;

use super::messages::{Drives, Sample, Servo, Third, ThirdDrive};

/// Names the columns and says how each is written: `group.field` becomes the column `group_field`.
macro_rules! columns {
    (
        $(#[$meta:meta])* $names:ident;
        $row:ident, $message:ident: $type:ty;
        $($group:ident $(. $field:ident)?),*
    ) => {
        $(#[$meta])*
        pub const $names: &[&str] = &[$(concat!(stringify!($group) $(, "_", stringify!($field))?)),*];

        fn $row(out: &mut dyn Write, $message: &$type, mut before: &'static str) -> io::Result<()> {
            $(write!(out, "{}{}", mem::replace(&mut before, ","), Cell::from($message.$group $(.$field)?).0)?;)*
            Ok(())
        }
    };
}

/// A value as CSV holds it.
struct Cell(f64);

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self(value)
    }
}

impl From<bool> for Cell {
    fn from(flag: bool) -> Self {
        Self(f64::from(flag))
    }
}

columns! {
    /// The names of the columns, with their units.
    COLUMNS;
    write_servo, servo: Servo;
    time_s,
    path.s_mm, path.feed_mm_s, path.accel_mm_s2, path.jerk_mm_s3,
    x.command_mm, x.actual_mm, x.velocity_command_rad_s, x.velocity_rad_s, x.torque_nm, x.voltage_v, x.saturated,
    x.setpoint_velocity_mm_s, x.setpoint_accel_mm_s2, x.setpoint_jerk_mm_s3,
    y.command_mm, y.actual_mm, y.velocity_command_rad_s, y.velocity_rad_s, y.torque_nm, y.voltage_v, y.saturated,
    y.setpoint_velocity_mm_s, y.setpoint_accel_mm_s2, y.setpoint_jerk_mm_s3,
    contour_error_um, tracking_error_um,
    nearest.x_mm, nearest.y_mm, nearest.s_mm
}

columns! {
    /// The names of the columns that follow for a machine with three axes.
    THIRD_COLUMNS;
    write_third, third: Third;
    z.command_mm, z.actual_mm, z.velocity_command_rad_s, z.velocity_rad_s, z.torque_nm, z.voltage_v, z.saturated,
    z.setpoint_velocity_mm_s, z.setpoint_accel_mm_s2, z.setpoint_jerk_mm_s3,
    nearest_z_mm, line, rapid
}

columns! {
    /// The names of the columns that follow where the drives are more than their model; with three axes, after [`THIRD_COLUMNS`].
    DRIVE_COLUMNS;
    write_drives, drives: Drives;
    x.measured_mm, x.measured_rad_s, x.motor_mm, x.table_mm_s, x.motor_torque_nm, x.ripple_nm, x.friction_nm, x.force_nm,
    x.stuck, x.in_gap,
    y.measured_mm, y.measured_rad_s, y.motor_mm, y.table_mm_s, y.motor_torque_nm, y.ripple_nm, y.friction_nm, y.force_nm,
    y.stuck, y.in_gap
}

columns! {
    /// The names of the columns that follow [`DRIVE_COLUMNS`] for a machine with three axes.
    THIRD_DRIVE_COLUMNS;
    write_third_drive, third: ThirdDrive;
    z.measured_mm, z.measured_rad_s, z.motor_mm, z.table_mm_s, z.motor_torque_nm, z.ripple_nm, z.friction_nm, z.force_nm,
    z.stuck, z.in_gap
}

/// Writes the line with the names of the columns of a machine with this many axes, whose drives tell more than their model or do not.
///
/// # Errors
/// Those of `out`.
pub fn write_header(out: &mut dyn Write, axes: usize, drives: bool) -> io::Result<()> {
    let third = axes > 2;
    let groups =
        [(COLUMNS, true), (THIRD_COLUMNS, third), (DRIVE_COLUMNS, drives), (THIRD_DRIVE_COLUMNS, drives && third)];
    let names: Vec<&str> = groups.iter().filter(|(_, there)| *there).flat_map(|(names, _)| *names).copied().collect();
    writeln!(out, "{}", names.join(","))
}

/// Writes the values of one control period, and the end of the line. Numbers read back as the same double; a flag is 0 or 1.
///
/// # Errors
/// Those of `out`.
pub fn write_row(out: &mut dyn Write, sample: &Sample) -> io::Result<()> {
    write_servo(out, &sample.servo, "")?;
    if let Some(third) = &sample.third {
        write_third(out, third, ",")?;
    }
    if let Some(drives) = &sample.drives {
        write_drives(out, drives, ",")?;
    }
    if let Some(third) = &sample.third_drive {
        write_third_drive(out, third, ",")?;
    }
    writeln!(out)
}

#[cfg(test)]
mod tests {
    use prost::Message;
    use prost_types::FileDescriptorSet;

    use super::{COLUMNS, DRIVE_COLUMNS, THIRD_COLUMNS, THIRD_DRIVE_COLUMNS};
    use crate::recording::messages::{Drives, Drives3, Servo, Servo3};
    use crate::recording::schema::Described;

    fn leaves(set: &FileDescriptorSet, name: &str, prefix: &str) -> Vec<String> {
        let messages = set.file.iter().flat_map(|file| file.message_type.iter().map(move |m| (file.package(), m)));
        let (_, message) =
            messages.into_iter().find(|(package, m)| format!(".{package}.{}", m.name()) == name).unwrap();
        let names = message.field.iter().map(|field| match field.type_name() {
            "" => vec![format!("{prefix}{}", field.name())],
            inner => leaves(set, inner, &format!("{prefix}{}_", field.name())),
        });
        names.flatten().collect()
    }

    #[test]
    fn validates_columns_against_the_schema() {
        let set = FileDescriptorSet::decode(&Servo::schema()[..]).unwrap();
        assert_eq!(COLUMNS, leaves(&set, ".servosim.Servo", ""));
        let set = FileDescriptorSet::decode(&Servo3::schema()[..]).unwrap();
        assert_eq!([COLUMNS, THIRD_COLUMNS].concat(), leaves(&set, ".servosim.Servo3", ""));
        // The time is that of the line.
        let set = FileDescriptorSet::decode(&Drives::schema()[..]).unwrap();
        assert_eq!([&["time_s"], DRIVE_COLUMNS].concat(), leaves(&set, ".servosim.Drives", ""));
        let set = FileDescriptorSet::decode(&Drives3::schema()[..]).unwrap();
        assert_eq!([&["time_s"], DRIVE_COLUMNS, THIRD_DRIVE_COLUMNS].concat(), leaves(&set, ".servosim.Drives3", ""));
        // No two columns have one name.
        let mut names = [COLUMNS, THIRD_COLUMNS, DRIVE_COLUMNS, THIRD_DRIVE_COLUMNS].concat();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
