//! The lines on `/log`.

use super::foxglove::{Level, Log, Timestamp};
use crate::parameters::AXIS_NAMES;
use crate::simulation::{Event, Severity};
use crate::summary::Summary;

/// How many saturations of an axis are listed; a limit cycle makes thousands.
const LISTED_SATURATIONS: u64 = 20;

/// Keeps the log readable: lists the first saturations of each axis and counts the rest.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Thinning {
    saturations: [u64; 2],
}

impl Thinning {
    /// The line of an event, or none when it is only counted.
    pub(crate) fn line(&mut self, event: &Event) -> Option<String> {
        let count = |axis: usize| self.saturations.get(axis).copied().unwrap_or(0);
        match *event {
            Event::SaturationBegan { axis, .. } => {
                let began = count(axis) + 1;
                if let Some(saturations) = self.saturations.get_mut(axis) {
                    *saturations = began;
                }
                match began {
                    ..LISTED_SATURATIONS => Some(event.to_string()),
                    LISTED_SATURATIONS => Some(format!(
                        "{event} for the {LISTED_SATURATIONS}th time; further ones of this axis are only counted"
                    )),
                    _ => None,
                }
            }
            Event::SaturationEnded { axis, .. } if count(axis) > LISTED_SATURATIONS => None,
            _ => Some(event.to_string()),
        }
    }

    /// How often the axes saturated in all, where not every time was listed.
    pub(crate) fn counts(&self) -> impl Iterator<Item = String> + use<> {
        let saturations = self.saturations;
        AXIS_NAMES.into_iter().zip(saturations).filter(|(_, count)| *count > LISTED_SATURATIONS).map(|(axis, count)| {
            format!("axis {axis}: saturated {count} times in all, {} of them not listed", count - LISTED_SATURATIONS)
        })
    }
}

/// The last line: how the run went.
pub(crate) fn headline(summary: &Summary) -> String {
    let end = if summary.complete { "run complete" } else { "run cut short" };
    let verdict = if summary.locked_up {
        "; an axis locked up"
    } else if summary.limits.iter().any(|check| !check.kept) {
        "; a limit was passed"
    } else {
        ""
    };
    format!(
        "{end} after {} samples: contouring error at most {:.3} µm, at {:.3} s{verdict}",
        summary.samples, summary.max_contour_error_um, summary.max_contour_error_at_s
    )
}

/// The level that a severity has in a viewer.
pub(crate) fn level(severity: Severity) -> Level {
    match severity {
        Severity::Info => Level::Info,
        Severity::Warning => Level::Warning,
        Severity::Error => Level::Error,
    }
}

/// A line as a message.
pub(crate) fn log(time_ns: u64, level: Level, message: String) -> Log {
    Log {
        timestamp: Timestamp::from_nanos(time_ns),
        level: level.into(),
        message,
        name: "servosim".to_owned(),
        file: String::new(),
        line: 0,
    }
}
