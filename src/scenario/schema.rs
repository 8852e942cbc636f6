//! The JSON schema of a file as a tree: choices on the way, and what the parameters say of their keys.

use serde_json::Value;

use super::number_table::describe;
use crate::feedrate::{FEED, Profile};
use crate::parameters::{Entry, Parameter, Parameters};
use crate::servo::{LoopSettings, axis_parameters};

/// The alternatives of a node, where it has some.
pub(super) fn choices(node: &Value) -> impl Iterator<Item = &Value> {
    ["oneOf", "anyOf"].into_iter().filter_map(|key| node.get(key)?.as_array()).flatten()
}

fn of<T>(entries: &'static [Entry<T>]) -> impl Iterator<Item = (String, &'static Parameter)> {
    entries.iter().map(|entry| (entry.parameter.key.to_owned(), &entry.parameter))
}

/// Writes what is known of the parameters into the schema of a file with these axes, where a table is not all numbers. (Those that are
/// describe themselves.)
pub(super) fn describe_all(schema: &mut Value, axes: &[&str]) {
    let of_axes = axes.iter().flat_map(|name| {
        axis_parameters().iter().map(move |known| (format!("axes.{name}.{}", known.parameter.key), known.parameter))
    });
    let others = of(Profile::ENTRIES).chain(of(LoopSettings::ENTRIES)).chain([(FEED.key.to_owned(), &FEED)]);
    for (key, parameter) in of_axes.chain(others) {
        let path: Vec<&str> = key.split('.').collect();
        if let Some(Value::Object(node)) = node_mut(schema, &path) {
            describe(parameter, node);
        }
    }
}

/// The schema's node of a key, through the choices on the way.
fn node_mut<'a>(node: &'a mut Value, path: &[&str]) -> Option<&'a mut Value> {
    let Some((first, rest)) = path.split_first() else { return Some(node) };
    if node.get("properties").and_then(|keys| keys.get(first)).is_some() {
        return node_mut(node.get_mut("properties")?.get_mut(first)?, rest);
    }
    // Which choice leads there is asked first: of several only one may be borrowed.
    for key in ["oneOf", "anyOf"] {
        let found = node.get(key).and_then(Value::as_array).and_then(|all| all.iter().position(|it| leads(it, path)));
        if let Some(index) = found {
            return node_mut(node.get_mut(key)?.get_mut(index)?, path);
        }
    }
    None
}

fn leads(node: &Value, path: &[&str]) -> bool {
    let Some((first, rest)) = path.split_first() else { return true };
    match node.get("properties").and_then(|keys| keys.get(first)) {
        Some(next) => leads(next, rest),
        None => choices(node).any(|choice| leads(choice, path)),
    }
}
