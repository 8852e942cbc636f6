//! What each plot shows.

pub(super) mod bode;
pub(super) mod circle;
pub(super) mod deviation;
pub(super) mod feedrate;
pub(super) mod learning;
pub(super) mod loads;
pub(super) mod loop_step;
mod magnified;
pub(super) mod named_run;
pub(super) mod nyquist;
pub(super) mod path;
pub(super) mod path_3d;
pub(super) mod response;
pub(super) mod rings;
pub(super) mod search;
pub(super) mod servo_loop;
pub(super) mod stepover;
pub(super) mod steps;
pub(super) mod sweep;
pub(super) mod time;
pub(super) mod tune;
pub(super) mod words;
