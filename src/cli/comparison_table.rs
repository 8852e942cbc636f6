//! A comparison as a table for people.

use std::fmt::Write as _;

use crate::comparison::{Cell, Comparison};

use super::output::{printable, significant};

/// The table for people, ending in a newline.
pub(crate) fn table(comparison: &Comparison) -> String {
    let mut out = format!("{}\n\n", printable(&comparison.scenario));
    errors(&mut out, comparison);
    out
}

/// Largest contouring errors, line by line, and how far each is from the model's.
pub(crate) fn errors(out: &mut String, comparison: &Comparison) {
    let cell = |cell: &Option<Cell>| match cell {
        None => "diverged".to_owned(),
        Some(cell) if cell.locked_up => format!("{} locked", significant(cell.max_contour_error_um, 4)),
        Some(cell) => significant(cell.max_contour_error_um, 4),
    };
    let apart = |cell: &Option<Cell>| {
        cell.and_then(|cell| cell.from_model_um).map_or_else(String::new, |apart| significant(apart, 3))
    };
    // Where the model is all there is, there is nothing to be told from it.
    let tells = comparison.lines.len() > 1;
    let head = "max contouring error";
    let mut rows = vec![(head, comparison.columns.iter().map(|name| (printable(name), "Δ".to_owned())).collect())];
    for (i, row) in comparison.lines.iter().enumerate() {
        let cells: Vec<(String, String)> =
            row.runs.iter().map(|run| (cell(run), if i > 0 { apart(run) } else { String::new() })).collect();
        rows.push((row.drives.as_str(), cells));
    }
    let width = |pick: &dyn Fn(&(String, String)) -> usize, k: usize| {
        rows.iter().filter_map(|(_, cells): &(&str, Vec<(String, String)>)| cells.get(k)).map(pick).max().unwrap_or(0)
    };
    let widths: Vec<(usize, usize)> = (0..comparison.columns.len())
        .map(|k| (width(&|(error, _)| error.chars().count(), k), width(&|(_, apart)| apart.chars().count(), k)))
        .collect();
    for (label, cells) in &rows {
        let mut line = format!("  {label:<20}");
        for ((error, apart), (left, right)) in cells.iter().zip(&widths) {
            // Writing to a string does not fail.
            let _ = write!(line, "  {error:>left$}");
            if tells {
                let _ = write!(line, "  {apart:>right$}");
            }
        }
        line.push_str(if *label == head { "  µm" } else { "" });
        let _ = writeln!(out, "{}", line.trim_end());
    }
    if tells {
        out.push_str(
            "\n  Δ: largest difference of the contouring error from the model's at the same time. An effect or a compensation may lower the\n  \
             largest error where it works against the loop's own lag or lead, and raise it elsewhere: Δ is what it adds.\n",
        );
    }
}
