//! The documentation: links lead somewhere, commands and keys exist, and what is quoted is what the program prints.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::folder::Folder;
use servosim::scenario::Document;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Every Markdown file that is read on its own, as path from the root and text.
fn pages() -> Vec<(String, String)> {
    let mut files = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| Path::new(ROOT).join(name)).to_vec();
    let mut folders = vec![Path::new(ROOT).join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "md") {
                files.push(path);
            }
        }
    }
    files.sort();
    let name = |path: &PathBuf| path.strip_prefix(ROOT).unwrap().to_string_lossy().replace('\\', "/");
    files.iter().map(|path| (name(path), fs::read_to_string(path).unwrap())).collect()
}

/// The text without code: no fenced blocks, no code spans.
fn prose(text: &str) -> Vec<(usize, String)> {
    let mut fenced = false;
    let mut lines = Vec::new();
    for (i, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if !fenced {
            let spans: Vec<&str> = line.split('`').collect();
            // An even number of parts: a span that is not closed, which is text.
            let open = spans.len().is_multiple_of(2);
            let outside = spans.iter().enumerate().filter(|(k, _)| k % 2 == 0 || open).map(|(_, part)| *part);
            lines.push((i + 1, outside.collect::<Vec<_>>().join("code")));
        }
    }
    lines
}

/// Fenced blocks of a language, with the number of their first line.
fn blocks(text: &str, language: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut block: Option<(String, usize, Vec<&str>)> = None;
    for (i, line) in text.lines().enumerate() {
        match (&mut block, line.strip_prefix("```")) {
            (None, Some(info)) => block = Some((info.trim().to_owned(), i + 2, Vec::new())),
            (Some((info, first, lines)), Some(_)) => {
                if info == language {
                    found.push((*first, lines.join("\n") + "\n"));
                }
                block = None;
            }
            (Some((_, _, lines)), None) => lines.push(line),
            (None, None) => {}
        }
    }
    assert!(block.is_none(), "a block is not closed");
    found
}

/// Anchors of a page's headings, as GitHub and mdBook make them.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut fenced = false;
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let mut anchors = BTreeSet::new();
    for line in text.lines() {
        fenced ^= line.starts_with("```");
        let heading = line.trim_start_matches('#');
        if fenced || heading.len() == line.len() || !heading.starts_with(' ') {
            continue;
        }
        let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        let slug: String = kept.flat_map(char::to_lowercase).map(|c| if c == ' ' { '-' } else { c }).collect();
        let count = counts.entry(slug.clone()).or_default();
        anchors.insert(if *count == 0 { slug } else { format!("{slug}-{count}") });
        *count += 1;
    }
    anchors
}

/// Link targets of a page: `[text](target)`, `[text][label]`, `[label]: target`.
fn links(text: &str) -> Result<Vec<(usize, String)>, String> {
    let lines = prose(text);
    let definition = |line: &str| {
        let (label, target) = line.strip_prefix('[')?.split_once("]: ")?;
        Some((label.to_owned(), target.trim().to_owned()))
    };
    let defined: BTreeMap<String, String> = lines.iter().filter_map(|(_, line)| definition(line)).collect();
    let mut found = Vec::new();
    for (number, line) in &lines {
        if let Some((_, target)) = definition(line) {
            found.push((*number, target));
            continue;
        }
        for (at, _) in line.match_indices("](") {
            let target = line[at + 2..].split(')').next().unwrap_or_default();
            found.push((*number, target.to_owned()));
        }
        for (at, _) in line.match_indices("][") {
            let label = line[at + 2..].split(']').next().unwrap_or_default();
            if !defined.contains_key(label) {
                return Err(format!("line {number}: no link [{label}] is defined"));
            }
        }
    }
    Ok(found)
}

#[test]
fn links_of_the_documentation_lead_somewhere() {
    let mut wrong = Vec::new();
    for (name, text) in pages() {
        let here = Path::new(ROOT).join(&name);
        let links = links(&text).unwrap_or_else(|problem| panic!("{name}, {problem}"));
        for (line, target) in links {
            if ["http://", "https://", "mailto:"].iter().any(|scheme| target.starts_with(scheme)) {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let path = if file.is_empty() { here.clone() } else { here.parent().unwrap().join(file) };
            let has_anchor = || anchor.is_empty() || anchors(&fs::read_to_string(&path).unwrap()).contains(anchor);
            if target.is_empty() || file.starts_with('/') || !path.exists() || !has_anchor() {
                wrong.push(format!("{name}:{line}: {target}"));
            }
        }
    }
    assert!(wrong.is_empty(), "these links lead nowhere:\n{}", wrong.join("\n"));
}

/// Code spans of a page, outside of fenced blocks.
fn code_spans(text: &str) -> Vec<(usize, String)> {
    let mut fenced = false;
    let mut spans = Vec::new();
    for (i, line) in text.lines().enumerate() {
        fenced ^= line.trim_start().starts_with("```");
        if !fenced {
            spans.extend(line.split('`').skip(1).step_by(2).map(|span| (i + 1, span.to_owned())));
        }
    }
    spans
}

#[test]
fn files_that_the_documentation_names_exist() {
    let folders = ["src/", "tests/", "docs/", "benches/", "scenarios/", "examples/", ".ci/"];
    let mut wrong = Vec::new();
    for (name, text) in pages().into_iter().filter(|(name, _)| name != "CHANGELOG.md") {
        for (line, span) in code_spans(&text) {
            let is_file = folders.iter().any(|folder| span.starts_with(folder));
            // Patterns and placeholders are no files.
            if is_file && !span.contains(['*', 'N', '…', ' ']) && !Path::new(ROOT).join(&span).exists() {
                wrong.push(format!("{name}:{line}: {span}"));
            }
        }
    }
    assert!(wrong.is_empty(), "these files are not there:\n{}", wrong.join("\n"));
}

#[test]
fn the_glossary_names_code_that_exists() {
    let mut source = String::new();
    let mut folders = vec![Path::new(ROOT).join("src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                source.push_str(&fs::read_to_string(path).unwrap());
            }
        }
    }
    let words: BTreeSet<&str> = source.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect();
    let glossary = fs::read_to_string(Path::new(ROOT).join("docs/glossary.md")).unwrap();
    let mut wrong = Vec::new();
    let mut code = None;
    for line in glossary.lines().filter(|line| line.starts_with('|')) {
        let line = line.replace("\\|", "");
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        if let Some(column) = cells.iter().position(|cell| *cell == "code") {
            code = Some(column);
            continue;
        }
        let Some(cell) = code.and_then(|column| cells.get(column)) else { continue };
        for (_, span) in code_spans(cell) {
            let name = span.rsplit("::").next().unwrap_or_default();
            let is_file = Path::new(ROOT).join("src").join(&span).exists();
            if !is_file && !name.contains('…') && !words.contains(name) {
                wrong.push(format!("{}: {span}", cells[0]));
            }
        }
    }
    assert!(wrong.is_empty(), "the glossary names what is not in the code:\n{}", wrong.join("\n"));
}

#[test]
fn anchors_are_those_of_github() {
    let text = "# One `two_three`\n```\n# code\n```\n## What's new (0.1)?\n## One two_three\n## Ω and -1\n";
    let expected = ["one-two_three", "whats-new-01", "one-two_three-1", "ω-and--1"];
    assert_eq!(anchors(text), expected.map(str::to_owned).into());
}

#[test]
fn the_book_has_every_page_once() {
    let mut listed: Vec<String> = Vec::new();
    for (name, text) in pages() {
        if name == "docs/SUMMARY.md" {
            listed = links(&text).unwrap().into_iter().map(|(_, target)| format!("docs/{target}")).collect();
        }
    }
    listed.sort();
    let there: Vec<String> = pages()
        .into_iter()
        .map(|(name, _)| name)
        .filter(|name| name.starts_with("docs/") && !name.contains("SUMMARY"))
        .collect();
    assert_eq!(listed, there, "docs/SUMMARY.md against the files of docs/");
}

#[test]
fn the_front_page_of_the_crate_is_the_readme_with_its_picture() {
    // The picture as the documentation of the crate contains it.
    let picture = fs::read(Path::new(ROOT).join("docs/alpha-path.svg")).unwrap();
    let encoded = fs::read_to_string(Path::new(ROOT).join("docs/alpha-path.svg.base64")).unwrap();
    let same = base64(&picture) == encoded.trim_end();
    assert!(same, "the picture has changed: base64 -w0 docs/alpha-path.svg > docs/alpha-path.svg.base64");
    // Links of the README, redefined in the documentation of the crate.
    let readme = fs::read_to_string(Path::new(ROOT).join("README.md")).unwrap();
    let crate_root = fs::read_to_string(Path::new(ROOT).join("src/lib.rs")).unwrap();
    for line in readme.lines().filter(|line| line.starts_with('[') && line.contains("]: ")) {
        let (label, target) = line.split_once("]: ").unwrap();
        let redefined = format!("//! {label}]: ../../../{target}");
        assert!(label == "[alpha-path" || crate_root.contains(&redefined), "src/lib.rs lacks `{redefined}`");
    }
    // The two commands that everything begins with.
    let commands = blocks(&readme, "sh").remove(0).1;
    let commands: Vec<&str> = commands.lines().map(|line| line.split("  ").next().unwrap()).collect();
    assert_eq!(commands, ["cargo run --release -- run alpha.toml", "cargo test"]);
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let bits = (0..3).fold(0_u32, |bits, i| (bits << 8) | u32::from(chunk.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let digit = DIGITS[((bits >> (18 - 6 * i)) & 63) as usize];
            text.push(if i > chunk.len() { '=' } else { digit.into() });
        }
    }
    text
}

#[test]
fn what_the_documentation_quotes_of_a_run_is_what_it_prints() {
    let folder = Folder::new();
    let printed = folder.servosim("run alpha.toml --plots none").output().unwrap();
    let printed = String::from_utf8(printed.stdout).unwrap();
    let printed: BTreeSet<&str> = printed.lines().collect();
    let mut quoted = 0;
    for (name, text) in pages() {
        for (first, block) in blocks(&text, "text").into_iter().filter(|(_, block)| block.starts_with("alpha\n")) {
            quoted += 1;
            for line in block.lines().filter(|line| line.trim() != "...") {
                assert!(
                    printed.contains(line),
                    "{name}, block at line {first}: `run alpha.toml` does not print `{line}`"
                );
            }
        }
    }
    assert!(quoted >= 2, "README and tutorial quote it");
}

#[test]
fn scenarios_of_the_documentation_are_read() {
    let (scenario, part) = (servosim::scenario::json_schema(), servosim::scenario::part_json_schema());
    for (name, text) in pages() {
        for (first, block) in blocks(&text, "toml") {
            let place = format!("{name}, line {first}");
            let table: toml::Table = block.parse().unwrap_or_else(|error| panic!("{place}: {error}"));
            if ["path", "feedrate", "axes"].iter().all(|key| table.contains_key(*key)) {
                servosim::scenario::Scenario::from_toml(&block, &place)
                    .unwrap_or_else(|error| panic!("{place}: {error}"));
            }
            // Of what is no whole scenario at least the keys are known.
            let unknown = unknown_key(&table, &scenario).and_then(|key| unknown_key(&table, &part).map(|_| key));
            assert_eq!(unknown, None, "{place}: an unknown key");
        }
    }
}

/// A key of a table that a JSON schema does not have.
fn unknown_key(table: &toml::Table, schema: &serde_json::Value) -> Option<String> {
    table.iter().find_map(|(key, value)| {
        let Some(inner) = property(schema, key) else { return Some(key.clone()) };
        let tables = match value {
            toml::Value::Table(table) => vec![table],
            toml::Value::Array(items) => items.iter().filter_map(toml::Value::as_table).collect(),
            _ => Vec::new(),
        };
        tables.into_iter().find_map(|table| unknown_key(table, inner)).map(|rest| format!("{key}.{rest}"))
    })
}

/// The schema of a key, whichever alternative has it.
fn property<'s>(schema: &'s serde_json::Value, key: &str) -> Option<&'s serde_json::Value> {
    let alternatives = ["oneOf", "anyOf", "allOf"].iter().filter_map(|name| schema.get(name)?.as_array()).flatten();
    let within = schema.get("properties").and_then(|properties| properties.get(key));
    within
        .or_else(|| schema.get("items").and_then(|items| property(items, key)))
        .or_else(|| alternatives.into_iter().find_map(|alternative| property(alternative, key)))
}

/// Words of a shell command; quotes and comments as the shell takes them.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), String::new(), None);
    for c in line.chars() {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (Some(open), _) if c == open => quote = None,
            (None, '#') if word.is_empty() => break,
            (None, ' ') => {
                if !word.is_empty() {
                    words.push(std::mem::take(&mut word));
                }
            }
            _ => word.push(c),
        }
    }
    if !word.is_empty() {
        words.push(word);
    }
    words
}

#[test]
fn commands_of_the_documentation_exist() {
    let folder = Folder::new();
    let mut helps: BTreeMap<String, String> = BTreeMap::new();
    for (name, text) in pages() {
        for (first, block) in blocks(&text, "sh") {
            for (i, line) in block.lines().enumerate() {
                let place = format!("{name}:{}: {line}", first + i);
                let line = words(line);
                for command in line.split(|word| ["&&", "|", ">"].contains(&word.as_str())) {
                    let arguments = match command.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
                        ["servosim", rest @ ..] | ["cargo", "run", "--release", "--", rest @ ..] => rest.to_vec(),
                        _ => continue,
                    };
                    checks(&folder, &mut helps, &arguments, &place);
                }
            }
        }
    }
    assert!(helps.len() >= 12, "{:?}", helps.keys());
}

/// One command: the subcommand and its options exist, the keys that it sets are known.
fn checks(folder: &Folder, helps: &mut BTreeMap<String, String>, arguments: &[&str], place: &str) {
    let kind = if arguments[0] == "measure" { 2 } else { 1 };
    let subcommand = arguments[..kind].join(" ");
    let help = helps.entry(subcommand.clone()).or_insert_with(|| {
        let output = folder.servosim(&format!("help {subcommand}")).output().unwrap();
        assert!(output.status.success(), "{place}: no such command");
        String::from_utf8(output.stdout).unwrap()
    });
    for option in arguments.iter().filter(|argument| argument.starts_with("--")) {
        let known = help.contains(&format!("{option} ")) || help.contains(&format!("{option}\n"));
        assert!(known, "{place}: no option {option}");
    }
    let builtin = |name: &str| Document::builtin(Path::new(name).file_stem()?.to_str()?);
    let is_part = arguments.iter().any(|argument| argument.contains(".nc") || argument.starts_with("patch"));
    let own = arguments[kind..].iter().find_map(|argument| builtin(argument));
    let mut document = own.or_else(|| builtin(if is_part { "patch" } else { "alpha" })).unwrap();
    for pair in arguments.windows(2) {
        match pair[0] {
            "--set" => document.set(pair[1]).unwrap_or_else(|error| panic!("{place}: {error}")),
            "--vary" => {
                let key = pair[1].split('=').next().unwrap();
                let full = key.replacen("x.k", "axes.x.pdff.k", usize::from(key.starts_with("x.k")));
                document.full_key(&full).unwrap_or_else(|error| panic!("{place}: {error}"));
            }
            _ => {}
        }
    }
    let read = if document.is_part() { document.part().err() } else { document.scenario().err() };
    assert!(read.is_none(), "{place}: {}", read.unwrap());
}
