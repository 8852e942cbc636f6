//! What is read from files and written into them: scenarios, recordings, plots and pictures.

#[path = "../common/mod.rs"]
mod common;

mod optional_pdff;
mod parameters;
mod pictures;
mod recording;
mod report;
mod scenario;
mod scenario_document;
