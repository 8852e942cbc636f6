//! `servosim new`: writes a commented scenario or part to start from.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::scenario::{Document, json_schema, part_json_schema};
use crate::whole_file;
use clap::Args;

use super::output::{print, printable};
use super::{CliError, Outcome};

/// What is written; `{file}` stands for the file's name.
const STARTER: &str = include_str!("starter.toml");

/// The built-in part that a new one is a copy of.
const PART: &str = "patch";

/// Arguments of `servosim new`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim new bracket        writes bracket.toml, and servosim.schema.json for editors
  servosim new lid --part     writes lid.toml, a part to be machined")]
pub(crate) struct NewArgs {
    /// Name of the scenario; the file is NAME.toml
    name: String,
    /// A part to be machined, for `servosim toolpath`, instead of a scenario
    #[arg(long)]
    part: bool,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
}

/// Writes the file.
pub(crate) fn run(args: &NewArgs) -> Result<Outcome, CliError> {
    let path = file_of(&args.name)?;
    let shown = printable(&path.display().to_string());
    let argument = as_argument(&shown);
    let in_comment = argument.replace('\n', "\u{fffd}");
    let (text, command) = if args.part {
        (part_text(&path, &in_comment), "toolpath")
    } else {
        (STARTER.replace("{file}", &in_comment), "run")
    };
    let (schema_name, schema): (_, fn() -> serde_json::Value) =
        if args.part { ("servosim.part.schema.json", part_json_schema) } else { ("servosim.schema.json", json_schema) };
    // What editors with a TOML language server (taplo, Even Better TOML) complete and check keys with.
    let text = format!("#:schema ./{schema_name}\n{text}");
    match write(&path, &text, args.force) {
        Ok(()) => {
            let beside = path.with_file_name(schema_name);
            let written = if beside.exists() { String::new() } else { write_schema(&beside, schema)? };
            print(&format!("wrote {shown}{written}; next: servosim {command} {argument}\n"))?;
            Ok(Outcome::Fine)
        }
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(CliError::Usage(format!(
            "{shown} exists already and is not changed\nhelp: choose another name, or replace the file with --force"
        ))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Err(CliError::Usage(format!("the folder of {shown} does not exist\nhelp: make it first with mkdir")))
        }
        Err(source) => Err(CliError::Write { path, source }),
    }
}

/// Writes the schema beside the file, and says so. One that is there is left as it is.
fn write_schema(path: &Path, schema: fn() -> serde_json::Value) -> Result<String, CliError> {
    whole_file::write(path, format!("{:#}\n", schema()).as_bytes())
        .map_err(|source| CliError::Write { path: path.to_owned(), source })?;
    Ok(format!(" and {}, which editors read", printable(&path.display().to_string())))
}

/// The built-in part, its name and file replaced where the text says what to type.
fn part_text(path: &Path, file: &str) -> String {
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let program = as_argument(&format!("output/{stem}.nc"));
    let builtin = Document::builtin(PART).map_or_else(String::new, |document| document.text().to_owned());
    builtin
        .replacen(&format!("# {PART}: "), "# A part to start from: ", 1)
        .replace(&format!("{PART}.toml"), file)
        .replace(&format!("output/{PART}.nc"), &program)
}

/// Writes all of the file or none: what `replace` replaces is there until then.
fn write(path: &Path, text: &str, replace: bool) -> io::Result<()> {
    let create = |path: &Path| {
        let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
        file.write_all(text.as_bytes()).inspect_err(|_| {
            // The failure that is told of is the one of writing.
            let _ = fs::remove_file(path);
        })
    };
    if !replace {
        return create(path);
    }
    if fs::metadata(path).is_ok_and(|meta| !meta.is_file()) {
        return Err(io::Error::other("it is no file"));
    }
    whole_file::write(path, text.as_bytes())
}

/// A file's name as a shell takes it.
fn as_argument(file: &str) -> String {
    let file = if file.starts_with('-') { format!("./{file}") } else { file.to_owned() };
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '/' | '.' | '_' | '-' | '+' | ':' | ',');
    if file.chars().all(is_plain) || cfg!(windows) { file } else { format!("'{}'", file.replace('\'', r"'\''")) }
}

/// The file of a scenario's name, `.toml` appended where it is missing.
fn file_of(name: &str) -> Result<PathBuf, CliError> {
    let is_bad = |file: &str| {
        let stem = file.strip_suffix(".toml").unwrap_or(file).trim();
        stem.is_empty() || stem == "." || stem == ".." || file.chars().any(char::is_control)
    };
    let last = Path::new(name).file_name().map(|file| file.to_string_lossy().into_owned());
    match last {
        Some(file) if !is_bad(&file) && !name.ends_with(['/', '\\']) => {
            let suffix =
                if Path::new(name).extension().is_some_and(|extension| extension == "toml") { "" } else { ".toml" };
            Ok(PathBuf::from(format!("{name}{suffix}")))
        }
        _ => Err(CliError::Usage(format!(
            "`{}` is no name for a scenario\nhelp: give a name such as bracket, or a path such as parts/bracket",
            printable(name).replace('\n', " ")
        ))),
    }
}
