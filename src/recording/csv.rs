//! `/servo` as comma-separated values: one line a control period, full double precision.

use std::io::{self, Write};

use super::messages::Servo;

/// Names the columns and says how each is written: `group.field` becomes the column `group_field`.
macro_rules! columns {
    ($servo:ident, $out:ident: $first:ident $(, $group:ident $(. $field:ident)?)*) => {
        /// The names of the columns, with their units.
        pub const COLUMNS: &[&str] =
            &[stringify!($first) $(, concat!(stringify!($group) $(, "_", stringify!($field))?))*];

        /// Writes the values of one control period, and the end of the line. Numbers read back as the same double; a flag
        /// is 0 or 1.
        ///
        /// # Errors
        /// Those of `out`.
        pub fn write_row($out: &mut dyn Write, $servo: &Servo) -> io::Result<()> {
            write!($out, "{}", $servo.$first)?;
            $(write!($out, ",{}", Cell::from($servo.$group $(.$field)?).0)?;)*
            writeln!($out)
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
    servo, out:
    time_s,
    path.s_mm, path.feed_mm_s, path.accel_mm_s2, path.jerk_mm_s3,
    x.command_mm, x.actual_mm, x.velocity_command_rad_s, x.velocity_rad_s, x.torque_nm, x.voltage_v, x.saturated,
    x.setpoint_velocity_mm_s, x.setpoint_accel_mm_s2, x.setpoint_jerk_mm_s3,
    y.command_mm, y.actual_mm, y.velocity_command_rad_s, y.velocity_rad_s, y.torque_nm, y.voltage_v, y.saturated,
    y.setpoint_velocity_mm_s, y.setpoint_accel_mm_s2, y.setpoint_jerk_mm_s3,
    contour_error_um, tracking_error_um,
    nearest.x_mm, nearest.y_mm, nearest.s_mm
}

/// Writes the line with the names of the columns.
///
/// # Errors
/// Those of `out`.
pub fn write_header(out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "{}", COLUMNS.join(","))
}

#[cfg(test)]
mod tests {
    use prost::Message;
    use prost_types::FileDescriptorSet;

    use super::COLUMNS;
    use crate::recording::messages::Servo;
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
    }
}
