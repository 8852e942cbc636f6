//! Shards of one sweep, joined.

use std::path::{Path, PathBuf};

use super::definition::Sweep;
use super::error::SweepError;
use super::journal::{Journal, Shard};

/// Opens the parts of a sweep, in any order, and checks that they are all of it: of one definition, complete, none missing and
/// none twice. Returns the sweep and its parts in order, ready for [`export`](super::export).
///
/// # Errors
/// A part cannot be read, is damaged or incomplete, belongs to another sweep, is missing, or is given twice.
pub fn merge(files: &[PathBuf]) -> Result<(Sweep, Vec<Journal>), SweepError> {
    let mut journals = files.iter().map(|file| Journal::open(file)).collect::<Result<Vec<_>, _>>()?;
    let Some(first) = journals.first() else {
        return Err(SweepError::request("there is nothing to join", "name the parts: output/alpha-sweep.*.part"));
    };
    let shown = |path: &Path| path.display().to_string();
    for other in &journals {
        if let Some(what) = other.definition().difference(first.definition()) {
            return Err(SweepError::unfit(
                format!(
                    "{} and {} are not of one sweep; what differs is {}",
                    shown(first.path()),
                    shown(other.path()),
                    what.replace(" there, ", " in the first, ").replace(" here", " in the second")
                ),
                "join parts that were computed with the same scenario, variables, method and seed",
            ));
        }
        if other.shard().of != first.shard().of {
            return Err(SweepError::unfit(
                format!(
                    "{} is shard {}/{} and {} is shard {}/{}: the sweep was divided in two ways, and the parts overlap",
                    shown(first.path()),
                    first.shard().index,
                    first.shard().of,
                    shown(other.path()),
                    other.shard().index,
                    other.shard().of
                ),
                "join the parts of one division",
            ));
        }
        if !other.is_complete() {
            return Err(SweepError::unfit(
                format!(
                    "{} is not complete: {} of {} points",
                    shown(other.path()),
                    other.done(),
                    other.header.points()
                ),
                format!(
                    "run its shard again, with --shard {}/{}: it continues from there",
                    other.shard().index,
                    other.shard().of
                ),
            ));
        }
    }
    let (of, definition) = (first.shard().of, first.definition().clone());
    journals.sort_by_key(Journal::shard);
    if let Some(pair) = journals.windows(2).find(|pair| pair[0].shard() == pair[1].shard()) {
        let Shard { index, of } = pair[0].shard();
        return Err(SweepError::unfit(
            format!("{} and {} are both shard {index}/{of}", shown(pair[0].path()), shown(pair[1].path())),
            "name every part once",
        ));
    }
    let is_there = |index: &u32| journals.iter().any(|journal| journal.shard().index == *index);
    let missing: Vec<String> =
        (1..=of).filter(|index| !is_there(index)).take(21).map(|i| format!("{i}/{of}")).collect();
    if !missing.is_empty() {
        let (shards, are) = if missing.len() == 1 { ("shard", "is") } else { ("shards", "are") };
        let more = if missing.len() > 20 { " and more" } else { "" };
        let listed = missing.iter().take(20).map(String::as_str).collect::<Vec<_>>().join(", ");
        return Err(SweepError::unfit(
            format!("{shards} {listed}{more} of the sweep {are} missing"),
            "compute what is missing with --shard, and name all parts: output/NAME-sweep.*.part",
        ));
    }
    Ok((Sweep::from_definition(definition)?, journals))
}
