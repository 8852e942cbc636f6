//! The program as a user types it, and what it is built from: sweeps, tuning, learning.

#[path = "../common/mod.rs"]
mod common;

mod analyze;
mod cli;
mod docs;
mod drive_recording;
mod drive_scenario;
mod learned;
mod measure_cli;
mod output;
mod part;
mod suite;
mod sweep;
mod sweep_journal;
mod tuning;
