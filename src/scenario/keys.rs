//! The keys that a scenario may have, by their full dotted names and by shorter ones.

use toml_edit::{DocumentMut, Item};

use super::diagnostics::{Diagnostic, brief, nearest};
use super::document_kind::DocumentKind;

/// Tables that have had another name: the present one, the former one.
const FORMER_NAMES: [(&str, &str); 1] = [("compensation", "remedies")];

/// The name under which a file has the table `key`: a former one where the file still uses it.
pub(super) fn as_written(key: &str, has: impl Fn(&str) -> bool) -> &str {
    let former = FORMER_NAMES.iter().find(|(now, former)| *now == key && !has(now) && has(former));
    former.map_or(key, |(_, former)| former)
}

/// The path with present names of tables for former ones.
fn with_present_names(path: &[String]) -> Vec<String> {
    let present = |key: &String| {
        FORMER_NAMES.iter().find(|(_, former)| former == key).map_or_else(|| key.clone(), |(now, _)| (*now).to_owned())
    };
    path.iter().map(present).collect()
}

/// The path of a value without the name of the chosen table, and how many parts stand before that name.
fn without_choice<'a>(form: &DocumentKind, leaf: &'a [String]) -> Option<(Vec<&'a str>, usize)> {
    let way =
        form.choices.iter().find(|way| leaf.len() > way.len() + 1 && leaf.iter().zip(**way).all(|(a, b)| a == b))?;
    let short = leaf.iter().enumerate().filter(|(i, _)| *i != way.len()).map(|(_, key)| key.as_str()).collect();
    Some((short, way.len()))
}

fn has_table(document: &DocumentMut, path: &[String]) -> bool {
    path.iter().try_fold(document.as_item(), |item, key| item.get(key)).is_some_and(Item::is_table_like)
}

/// The full path of a value whose path may leave out the table that the document has chosen:
/// `axes.x.plant.gain_rad_s_v` is `axes.x.plant.first_order.gain_rad_s_v`. A gain has a short name, `x.kpp`, that of the tables
/// of `servosim tune`. None where there is no such value.
pub(super) fn full(form: &DocumentKind, path: &[String], document: &DocumentMut) -> Option<Vec<String>> {
    let path = &with_present_names(path)[..];
    if form.leaves().iter().any(|leaf| leaf == path) {
        return Some(path.to_vec());
    }
    if let [axis, gain] = path
        && let Some(leaf) = form.leaves().iter().find(|leaf| leaf.iter().eq(["axes", axis, "pdff", gain]))
    {
        return Some(leaf.clone());
    }
    let meant = form.leaves().iter().find(|leaf| {
        without_choice(form, leaf).is_some_and(|(short, at)| {
            short.iter().eq(path.iter()) && leaf.get(..=at).is_some_and(|table| has_table(document, table))
        })
    })?;
    Some(meant.clone())
}

/// What is wrong with a path that [`full`] does not know.
pub(super) fn unknown(form: &DocumentKind, path: &[String], document: &DocumentMut) -> Diagnostic {
    let name = path.join(".");
    let problem = Diagnostic::new(format!("a {} has no value `{}`", form.name, brief(&name)));
    let elsewhere =
        form.leaves().iter().find(|leaf| without_choice(form, leaf).is_some_and(|(short, _)| short.iter().eq(path)));
    if let Some(leaf) = elsewhere {
        return problem
            .note(format!("`{}` is one, but the {} has chosen another table there", leaf.join("."), form.name))
            .help("name the table in full to choose it, and give the rest of its values too");
    }
    if form.leaves().iter().any(|leaf| leaf.starts_with(path)) || has_table(document, path) {
        return problem.note("it is a table").help(format!("name one value of it: `{}.…`", brief(&name)));
    }
    let full = form.leaves().iter().map(|leaf| leaf.join("."));
    let short = form.leaves().iter().filter_map(|leaf| Some(without_choice(form, leaf)?.0.join(".")));
    let names: Vec<String> = full.chain(short).collect();
    // A last part that fits exactly says more than a long common beginning.
    let last = path.last().map(String::as_str).unwrap_or_default();
    let homes: Vec<&str> = names.iter().map(String::as_str).filter(|n| n.rsplit('.').next() == Some(last)).collect();
    let known = match homes.as_slice() {
        [] => nearest(&name, names.iter().map(String::as_str)),
        [one] => Some(*one),
        [first, ..] => nearest(&name, homes.iter().copied()).or(Some(*first)),
    };
    let problem = match known {
        Some(known) => problem.help(format!("did you mean `{known}`?")),
        None => problem,
    };
    problem.help(format!("`{}` lists every key", form.schema_command))
}

#[cfg(test)]
mod tests {
    use super::super::document_kind::SCENARIO;
    use super::*;

    fn path(key: &str) -> Vec<String> {
        key.split('.').map(str::to_owned).collect()
    }

    #[test]
    fn the_chosen_table_may_be_left_out() {
        let alpha: DocumentMut = include_str!("../../scenarios/alpha.toml").parse().unwrap();
        for (short, long) in [
            ("axes.x.plant.gain_rad_s_v", Some("axes.x.plant.first_order.gain_rad_s_v")),
            ("axes.y.plant.time_constant_s", Some("axes.y.plant.first_order.time_constant_s")),
            ("feedrate.profile.phase_s", Some("feedrate.profile.exponential.phase_s")),
            ("path.closed", Some("path.ph_spline.closed")),
            ("axes.x.pdff.kpp", Some("axes.x.pdff.kpp")),
            ("feedrate.profile.quintic.phase_s", Some("feedrate.profile.quintic.phase_s")),
            ("control.period_s", Some("control.period_s")),
            ("name", Some("name")),
            ("axes.x.compensation.zero_phase", Some("axes.x.compensation.zero_phase")),
            ("axes.x.remedies.zero_phase", Some("axes.x.compensation.zero_phase")),
            ("axes.x.plant.mass_kg", None),
            ("axes.x.plant", None),
            ("axes.x.pdff.kp", None),
        ] {
            assert_eq!(full(&SCENARIO, &path(short), &alpha), long.map(path), "{short}");
        }
    }

    #[test]
    fn an_unknown_key_is_told_what_was_meant() {
        let alpha: DocumentMut = include_str!("../../scenarios/alpha.toml").parse().unwrap();
        let help = |key: &str| format!("{:?}", unknown(&SCENARIO, &path(key), &alpha));
        assert!(help("axes.x.pdff.kp").contains("did you mean `axes.x.pdff.kpp`"), "{}", help("axes.x.pdff.kp"));
        assert!(help("x.pdff.kpp").contains("did you mean `axes.x.pdff.kpp`"), "{}", help("x.pdff.kpp"));
        assert!(help("feed_mm_s").contains("did you mean `feedrate.feed_mm_s`"), "{}", help("feed_mm_s"));
        assert!(help("axes.x.plant.mass_kg").contains("another table"));
        assert!(help("axes.x.plant").contains("it is a table"));
    }
}
