//! The two kinds of files: scenarios and parts. Diagnostics depend on which keys a file may have.

use std::sync::LazyLock;

use serde_json::Value;

use super::schema::choices;
use super::{file, part_file};

/// A kind of file.
#[derive(Debug)]
pub(super) struct DocumentKind {
    /// What it is called.
    pub(super) name: &'static str,
    /// What the commands that start one and list its keys are.
    pub(super) schema_command: &'static str,
    /// Keys that hold exactly one table out of several: writing into one replaces the other, and its name may be left out.
    pub(super) choices: &'static [&'static [&'static str]],
    /// Those that are part of the program: names and texts.
    pub(super) built_in: &'static [(&'static str, &'static str)],
    make_schema: fn() -> Value,
    schema: LazyLock<Value>,
    leaves: LazyLock<Vec<Vec<String>>>,
    tables: LazyLock<Vec<String>>,
}

/// Scenarios: a path in the plane, its feed, two axes.
pub(super) static SCENARIO: DocumentKind = DocumentKind {
    name: "scenario",
    schema_command: "servosim schema",
    choices: &[
        &["path"],
        &["feedrate", "profile"],
        &["axes", "x", "plant"],
        &["axes", "y", "plant"],
        &["axes", "x", "controller"],
        &["axes", "y", "controller"],
        &["axes", "x", "effects", "friction"],
        &["axes", "y", "effects", "friction"],
        &["axes", "x", "effects", "force"],
        &["axes", "y", "effects", "force"],
    ],
    built_in: &[
        ("alpha", include_str!("../../scenarios/alpha.toml")),
        ("alpha-real", include_str!("../../scenarios/alpha-real.toml")),
        ("heart", include_str!("../../scenarios/heart.toml")),
        ("star", include_str!("../../scenarios/star.toml")),
    ],
    make_schema: file::make_schema,
    schema: LazyLock::new(|| (SCENARIO.make_schema)()),
    leaves: LazyLock::new(|| leaves(SCENARIO.schema())),
    tables: LazyLock::new(|| tables(SCENARIO.schema())),
};

/// Parts: a surface to be machined, a cutter, a machine of three axes.
pub(super) static PART: DocumentKind = DocumentKind {
    name: "part",
    schema_command: "servosim schema --part",
    choices: &[
        &["surface"],
        &["boundary"],
        &["cutter"],
        &["axes", "x", "plant"],
        &["axes", "y", "plant"],
        &["axes", "z", "plant"],
        &["axes", "x", "controller"],
        &["axes", "y", "controller"],
        &["axes", "z", "controller"],
        &["axes", "x", "effects", "friction"],
        &["axes", "y", "effects", "friction"],
        &["axes", "z", "effects", "friction"],
        &["axes", "x", "effects", "force"],
        &["axes", "y", "effects", "force"],
        &["axes", "z", "effects", "force"],
    ],
    built_in: &[
        ("island", include_str!("../../scenarios/island.toml")),
        ("patch", include_str!("../../scenarios/patch.toml")),
    ],
    make_schema: part_file::make_schema,
    schema: LazyLock::new(|| (PART.make_schema)()),
    leaves: LazyLock::new(|| leaves(PART.schema())),
    tables: LazyLock::new(|| tables(PART.schema())),
};

impl DocumentKind {
    /// Both.
    pub(super) fn all() -> [&'static Self; 2] {
        [&SCENARIO, &PART]
    }

    /// The kind that a text is: one with a surface is a part. (What is neither is told of as a scenario.)
    pub(super) fn of(text: &str) -> &'static Self {
        let is_part = text.lines().any(|line| {
            let line = line.trim_start();
            let key = line.strip_prefix('[').unwrap_or(line).trim_start();
            key.strip_prefix("surface").is_some_and(|rest| rest.trim_start().starts_with(['.', ']', '=']))
        });
        if is_part { &PART } else { &SCENARIO }
    }

    /// The JSON schema of the file, made once.
    pub(super) fn schema(&self) -> &Value {
        &self.schema
    }

    /// The path of every value, in the order of the schema.
    pub(super) fn leaves(&self) -> &[Vec<String>] {
        &self.leaves
    }

    /// Whether a key of this name holds a table wherever it stands: an array there would be read as one by position, which
    /// nobody means.
    pub(super) fn is_table(&self, key: &str) -> bool {
        self.tables.iter().any(|name| name == key)
    }
}

/// Visits every key of a schema with its path.
fn walk<'a>(node: &'a Value, path: &mut Vec<String>, visit: &mut dyn FnMut(&[String], &'a Value)) {
    for (key, inner) in node.get("properties").and_then(Value::as_object).into_iter().flatten() {
        path.push(key.clone());
        visit(path, inner);
        walk(inner, path, visit);
        path.pop();
    }
    // (A choice that may be left out is a choice within a choice.)
    choices(node).for_each(|choice| walk(choice, path, visit));
}

fn has_keys(node: &Value) -> bool {
    node.get("properties").is_some() || choices(node).any(has_keys)
}

fn leaves(schema: &Value) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    walk(schema, &mut Vec::new(), &mut |path, node| {
        if !has_keys(node) {
            found.push(path.to_vec());
        }
    });
    found
}

fn tables(schema: &Value) -> Vec<String> {
    let (mut found, mut values) = (Vec::new(), Vec::new());
    walk(schema, &mut Vec::new(), &mut |path, node| {
        let Some(key) = path.last() else { return };
        let list = if has_keys(node) { &mut found } else { &mut values };
        if !list.contains(key) {
            list.push(key.clone());
        }
    });
    // A name that is also that of a value says nothing.
    found.retain(|key| !values.contains(key));
    found
}
