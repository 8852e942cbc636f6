//! `servosim merge`: the shards of a sweep, joined to what the undivided sweep would have written.

use std::path::PathBuf;

use crate::sweep::merge;
use clap::Args;

use super::interrupt::stop_flag;
use super::output::make_folder;
use super::sweep::FinishArgs;
use super::{CliError, Outcome};

/// Arguments of `servosim merge`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example, the tasks of a job array and then the join:
  servosim sweep alpha --vary axes.x.pdff.kpp=60:140:1001 --shard 1/2
  servosim sweep alpha --vary axes.x.pdff.kpp=60:140:1001 --shard 2/2
  servosim merge output/alpha-sweep.*.part

The tables have the same bytes as those of the undivided sweep. The parts are not changed.")]
pub(crate) struct MergeArgs {
    /// The parts of a sweep, in any order: NAME-sweep.I-of-N.part
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    #[command(flatten)]
    finish: FinishArgs,
}

/// Joins the parts.
pub(crate) fn run(args: &MergeArgs) -> Result<Outcome, CliError> {
    let (sweep, journals) = merge(&args.parts)?;
    let stop = stop_flag();
    make_folder(args.finish.folder())?;
    args.finish.write(&sweep, &journals, &stop)
}
