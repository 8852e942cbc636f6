//! `servosim schema`: the JSON schema of scenario files.

use servosim::scenario::json_schema;

use super::{CliError, Outcome, output};

/// Prints the schema.
pub(crate) fn run() -> Result<Outcome, CliError> {
    output::print(&format!("{:#}\n", json_schema()))?;
    Ok(Outcome::Fine)
}
