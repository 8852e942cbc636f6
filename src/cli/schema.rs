//! `servosim schema`: the JSON schema of scenario and part files.

use crate::scenario::{json_schema, part_json_schema};
use clap::Args;

use super::{CliError, Outcome, output};

/// Arguments of `servosim schema`.
#[derive(Debug, Args)]
pub(crate) struct SchemaArgs {
    /// Schema of part files
    #[arg(long)]
    part: bool,
}

/// Prints the schema.
pub(crate) fn run(args: &SchemaArgs) -> Result<Outcome, CliError> {
    let schema = if args.part { part_json_schema() } else { json_schema() };
    output::print(&format!("{schema:#}\n"))?;
    Ok(Outcome::Fine)
}
