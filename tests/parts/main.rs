//! Parts: from a surface to tool paths and NC programs, and what the machine leaves of the stock.

#[path = "../common/mod.rs"]
mod common;

mod drop_cutter;
mod guide;
mod guide_forms;
mod machining;
mod nc;
mod nc_reader;
mod nc_streams;
mod planning;
mod removal;
