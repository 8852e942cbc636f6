//! Where a scenario's text comes from: a file, the `scenarios` folder, or the program itself.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml::de::DeTable;
use toml_edit::DocumentMut;

use super::diagnostics::{Diagnostic, Problems, ScenarioError, brief, nearest};
use super::document_kind::{self, DocumentKind};
use super::file::RawScenario;
use super::overrides::{self, Override};
use super::part::{Folder, Part};
use super::part_file::RawPart;
use super::{Scenario, check, check_part, keys, repair, size_limits, toml_errors};

/// Names of the built-in scenarios.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    document_kind::SCENARIO.built_in.iter().map(|(name, _)| *name)
}

/// Names of the built-in parts.
pub fn builtin_part_names() -> impl Iterator<Item = &'static str> {
    document_kind::PART.built_in.iter().map(|(name, _)| *name)
}

/// The text of a scenario, with overrides, before it is checked.
#[derive(Debug, Clone)]
pub struct Document {
    /// Where it comes from, as a person knows it.
    origin: String,
    is_builtin: bool,
    /// Name of the scenario where the text gives none.
    default_name: String,
    text: String,
    overrides: Vec<Override>,
}

impl Document {
    /// A text given directly; `origin` is what messages call it, and its stem the scenario's default name.
    pub fn from_text(text: impl Into<String>, origin: impl Into<String>) -> Self {
        let (text, origin) = (text.into(), origin.into());
        let default_name = stem(Path::new(&origin));
        let text = text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text);
        Self { origin, is_builtin: false, default_name, text, overrides: Vec::new() }
    }

    /// The built-in scenario of this name, with or without `.toml`.
    pub fn builtin(name: &str) -> Option<Self> {
        let wanted = name.strip_suffix(".toml").unwrap_or(name);
        let mut all = DocumentKind::all().into_iter().flat_map(|form| form.built_in);
        let (name, text) = all.find(|(name, _)| *name == wanted)?;
        let mut document = Self::from_text(*text, format!("{name}.toml"));
        document.is_builtin = true;
        Some(document)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// It does not exist, is a folder, may not be read, is too long, or is not UTF-8 text.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ScenarioError> {
        let path = path.as_ref();
        Self::open(path).map_err(|error| unreadable(path, &error))?
    }

    /// Finds a scenario by name: a file of that path first, then one in the folder `scenarios`, then the built-in one;
    /// each also with `.toml` appended.
    ///
    /// # Errors
    /// There is none (the error says where it was looked for), or it cannot be read.
    pub fn find(name: &str) -> Result<Self, ScenarioError> {
        Self::find_as(&document_kind::SCENARIO, name)
    }

    /// As [`find`](Self::find), for a part: what is told where there is none speaks of parts.
    ///
    /// # Errors
    /// As [`find`](Self::find).
    pub fn find_part(name: &str) -> Result<Self, ScenarioError> {
        Self::find_as(&document_kind::PART, name)
    }

    fn find_as(form: &DocumentKind, name: &str) -> Result<Self, ScenarioError> {
        let mut places = Vec::new();
        for folder in [None, Some("scenarios")] {
            let plain = folder.map_or_else(|| PathBuf::from(name), |folder| Path::new(folder).join(name));
            let mut with_extension = plain.clone().into_os_string();
            with_extension.push(".toml");
            places.push(plain);
            if Path::new(name).extension().is_none_or(|extension| extension != "toml") {
                places.push(with_extension.into());
            }
        }
        let mut folder = None;
        if !name.is_empty() {
            for place in &places {
                match Self::open(place) {
                    Ok(found) => return found,
                    Err(error) if is_absent(&error) => {}
                    Err(error) if is_folder(place) => folder = folder.or(Some((place, error))),
                    Err(error) => return Err(unreadable(place, &error)),
                }
            }
        }
        if let Some(document) = Self::builtin(name) {
            return Ok(document);
        }
        Err(folder.map_or_else(|| not_found(form, name, &places), |(place, error)| unreadable(place, &error)))
    }

    /// The outer error is one of finding or opening the file, the inner one of its content.
    fn open(path: &Path) -> io::Result<Result<Self, ScenarioError>> {
        let file = File::open(path)?;
        if file.metadata()?.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        let mut bytes = Vec::new();
        file.take(size_limits::MAX_TEXT_BYTES as u64 + 1).read_to_end(&mut bytes)?;
        let origin = path.to_string_lossy().into_owned();
        let is_too_long = bytes.len() > size_limits::MAX_TEXT_BYTES;
        let text = match String::from_utf8(bytes) {
            Ok(text) if !is_too_long => text,
            Ok(text) => return Ok(Err(ScenarioError::new(origin, &*text, vec![size_limits::too_long(&text)]))),
            Err(error) => {
                let good = error.utf8_error().valid_up_to();
                let help = if matches!(error.as_bytes(), [0xff, 0xfe, ..] | [0xfe, 0xff, ..]) {
                    "this is UTF-16, as Windows writes it: save the file as UTF-8"
                } else {
                    "save the file as UTF-8; is it a scenario at all?"
                };
                let text = String::from_utf8_lossy(error.as_bytes());
                let problem = if is_too_long {
                    size_limits::too_long(&text)
                } else {
                    Diagnostic::new(format!("the file is not UTF-8 text: byte {} does not belong in it", good + 1))
                        .at(good..good + '\u{fffd}'.len_utf8())
                        .label("the first such byte")
                        .help(help)
                };
                return Ok(Err(ScenarioError::new(origin, text, vec![problem])));
            }
        };
        Ok(Ok(Self::from_text(text, origin)))
    }

    /// Where the text comes from: a file name, or that of a built-in scenario.
    pub fn origin(&self) -> &str {
        &self.origin
    }

    /// Whether this is a part (it has a surface) rather than a scenario.
    pub fn is_part(&self) -> bool {
        self.form().name == document_kind::PART.name
    }

    fn form(&self) -> &'static DocumentKind {
        DocumentKind::of(&self.text)
    }

    /// The text as it is now, overrides applied.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Replaces one value: `axes.x.pdff.kpp=120`. The key is a dotted TOML key, the value is TOML, or a bare word that is
    /// taken as a string. Comments stay, missing tables are made, and writing into one of `path`'s, `feedrate.profile`'s or
    /// a `plant`'s tables removes the other ones. The name of the table that is there may be left out:
    /// `axes.x.plant.gain_rad_s_v`.
    ///
    /// # Errors
    /// The text is not `KEY=VALUE`, or the document is not TOML.
    pub fn set(&mut self, key_value: &str) -> Result<(), ScenarioError> {
        let alone = |problem| ScenarioError::new("", "", vec![problem]);
        let mut new = Override::parse(key_value).map_err(alone)?;
        let mut document = self.editable()?;
        new.complete(self.form(), &document);
        new.apply(self.form(), &mut document).map_err(alone)?;
        self.text = document.to_string();
        self.overrides.push(new);
        Ok(())
    }

    /// The full dotted key of a value, whose key may leave out the name of the table that the document has chosen:
    /// `axes.x.plant.gain_rad_s_v` is `axes.x.plant.first_order.gain_rad_s_v`.
    ///
    /// # Errors
    /// A scenario has no such value (the error says which may be meant), or the document is not TOML.
    pub fn full_key(&self, key: &str) -> Result<String, ScenarioError> {
        let document = self.editable()?;
        let path: Vec<String> = key.trim().split('.').map(|part| part.trim().to_owned()).collect();
        match keys::full(self.form(), &path, &document) {
            Some(path) => Ok(path.join(".")),
            None => Err(ScenarioError::new("", "", vec![keys::unknown(self.form(), &path, &document)])),
        }
    }

    /// The number that the text gives for a full dotted key; none where it gives none.
    pub fn number(&self, full_key: &str) -> Option<f64> {
        let document = self.editable().ok()?;
        let item = full_key.split('.').try_fold(document.as_item(), |item, key| item.get(key))?;
        item.as_float().or_else(|| item.as_integer().map(|whole| whole as f64))
    }

    fn editable(&self) -> Result<DocumentMut, ScenarioError> {
        // The document's own problems come first: toml_edit would only tell them in other words.
        self.parse().map_err(|problem| self.error(vec![problem]))?;
        self.text
            .parse()
            .map_err(|error: toml_edit::TomlError| self.error(vec![Diagnostic::new(brief(error.message()))]))
    }

    /// Checks everything.
    ///
    /// # Errors
    /// The text is not TOML (the first such place), has keys that a scenario does not have or lacks some, or has values of a wrong type or
    /// out of range: all of them, in the order of the file.
    pub fn scenario(&self) -> Result<Scenario, ScenarioError> {
        if self.text.trim().is_empty() {
            let problem = Diagnostic::new("the scenario is empty")
                .help("`servosim new NAME` writes one to start from, `servosim schema` lists every key");
            return Err(self.error(vec![problem]));
        }
        if self.is_part() {
            let problem = Diagnostic::new("this is a part to be machined, not a scenario")
                .help("`servosim toolpath FILE` makes its tool path and its NC program");
            return Err(self.error(vec![problem]));
        }
        let (raw, problems) = self.raw::<RawScenario>()?;
        let folder = match self.folder() {
            // One of the program's own is seen from where the program was started.
            Folder::BuiltIn => Folder::At(PathBuf::new()),
            folder @ Folder::At(_) => folder,
        };
        self.checked(problems, check::scenario(&raw, &self.default_name, &self.text, &folder))
    }

    /// Checks everything of a part.
    ///
    /// # Errors
    /// As [`Document::scenario`]; a mesh that cannot be read; a boundary that is open or crosses itself.
    pub fn part(&self) -> Result<Part, ScenarioError> {
        if !self.is_part() {
            let problem = Diagnostic::new("this is no part to be machined: it has no surface")
                .help("add a table [surface.nurbs] or [surface.mesh]; `servosim run FILE` runs a scenario");
            return Err(self.error(vec![problem]));
        }
        let (raw, problems) = self.raw::<RawPart>()?;
        self.checked(problems, check_part::part(&raw, &self.default_name, &self.text, &self.folder()))
    }

    /// The text of a part, overrides applied, as it can stand in another folder: with a name of its own, and its mesh (if it has
    /// one) under the name `mesh_file`. The mesh's bytes come with it.
    ///
    /// # Errors
    /// The document is not TOML, or the mesh cannot be read.
    pub fn portable_part(&self, name: &str, mesh_file: &str) -> Result<(String, Option<Vec<u8>>), ScenarioError> {
        let mut document = self.editable()?;
        document["name"] = toml_edit::value(name);
        let mut mesh = None;
        let file = document.get("surface").and_then(|surface| surface.get("mesh")?.get("file")?.as_str());
        if let Some(file) = file.map(str::to_owned) {
            let mut bytes = Vec::new();
            self.folder().open(&file).and_then(|(mut reader, _)| reader.read_to_end(&mut bytes)).map_err(|error| {
                self.error(vec![Diagnostic::new(format!("the mesh `{}` cannot be read: {error}", brief(&file)))])
            })?;
            document["surface"]["mesh"]["file"] = toml_edit::value(mesh_file);
            mesh = Some(bytes);
        }
        Ok((document.to_string(), mesh))
    }

    /// What a file that exists is called in this text: the way to it from the folder that the text stands in.
    pub fn name_of(&self, file: &Path) -> String {
        self.folder().name_of(file).unwrap_or_else(|| file.to_string_lossy().into_owned())
    }

    /// Takes the table `learned` out: what was learned with other gains, or is not there to be read.
    ///
    /// # Errors
    /// The document is not TOML.
    pub fn forget_learned(&mut self) -> Result<(), ScenarioError> {
        let mut document = self.editable()?;
        if document.remove("learned").is_some() {
            self.text = document.to_string();
        }
        Ok(())
    }

    /// Where the files that the text names are looked for.
    fn folder(&self) -> Folder {
        if self.is_builtin {
            Folder::BuiltIn
        } else {
            Folder::At(Path::new(&self.origin).parent().map_or_else(PathBuf::new, Path::to_owned))
        }
    }

    fn parse(&self) -> Result<toml::Spanned<DeTable<'_>>, Diagnostic> {
        size_limits::check(&self.text)?;
        DeTable::parse(&self.text).map_err(|error| toml_errors::syntax(&error, &self.text))
    }

    /// The values as written, and what is wrong with the keys and types beside them.
    fn raw<T: DeserializeOwned>(&self) -> Result<(T, Problems), ScenarioError> {
        let one = |problem| self.error(vec![problem]);
        let (form, table) = (self.form(), self.parse().map_err(one)?);
        if let Some(problem) = toml_errors::array_for_table(form, table.get_ref()) {
            return Err(one(problem));
        }
        match repair::read(form, table, &self.text, form.built_in.first().map_or("", |(_, text)| text)) {
            Ok(raw) => Ok((raw, Vec::new())),
            Err((problems, Some(raw))) => Ok((raw, problems)),
            Err((problems, None)) => Err(self.error(repair::in_order(problems))),
        }
    }

    /// The checked values, if there was nothing wrong before either.
    fn checked<T>(&self, problems: Problems, checked: Result<T, Problems>) -> Result<T, ScenarioError> {
        match checked {
            Ok(checked) if problems.is_empty() => Ok(checked),
            checked => Err(self.error(repair::joined(problems, checked.err().unwrap_or_default()))),
        }
    }

    fn error(&self, mut problems: Vec<Diagnostic>) -> ScenarioError {
        overrides::blame(&self.overrides, &self.text, &mut problems);
        let origin = match (self.is_builtin, self.overrides.is_empty()) {
            (false, true) => self.origin.clone(),
            (true, true) => format!("{} (built in)", self.origin),
            (false, false) => format!("{} (after --set)", self.origin),
            (true, false) => format!("{} (built in, after --set)", self.origin),
        };
        ScenarioError::new(origin, &*self.text, problems)
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "scenario".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

fn is_absent(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

fn is_folder(path: &Path) -> bool {
    path.is_dir()
}

fn unreadable(path: &Path, error: &io::Error) -> ScenarioError {
    let shown = path.display().to_string();
    let problem = if is_folder(path) {
        Diagnostic::new("this is a folder, not a scenario file").help("give a file in it, such as FOLDER/alpha.toml")
    } else if error.kind() == io::ErrorKind::PermissionDenied {
        Diagnostic::new("the scenario may not be read: permission denied")
            .help(format!("allow it with `chmod u+r {}`, or copy the file", brief(&shown)))
    } else if is_absent(error) {
        return not_found(&document_kind::SCENARIO, &shown, &[path.to_owned()]);
    } else {
        Diagnostic::new(format!("the scenario cannot be read: {error}"))
    };
    ScenarioError::new(shown, "", vec![problem])
}

fn not_found(form: &DocumentKind, name: &str, places: &[PathBuf]) -> ScenarioError {
    let looked = places.iter().map(|place| format!("`{}`", brief(&place.display().to_string()))).collect::<Vec<_>>();
    let is_part = form.name == document_kind::PART.name;
    let built_in = || builtin_names().filter(|_| !is_part).chain(builtin_part_names());
    let mut problem = Diagnostic::new(format!("there is no {} `{}`", form.name, brief(name)));
    let candidates = scenario_files();
    let base = name.strip_suffix(".toml").unwrap_or(name);
    let mut names: Vec<&str> = built_in().collect();
    names.extend(candidates.iter().map(String::as_str));
    if let Some(known) = nearest(base, names) {
        problem = problem.help(format!("did you mean `{known}`?"));
    }
    problem =
        problem.note(format!("looked for {}, and among the built-in {}s", looked.join(", "), form.name)).help(format!(
            "built in: {}; `servosim new NAME{}` writes a new one",
            built_in().collect::<Vec<_>>().join(", "),
            if is_part { " --part" } else { "" }
        ));
    ScenarioError::new("", "", vec![problem])
}

/// Stems of the `.toml` files here and in `scenarios`, sorted.
fn scenario_files() -> Vec<String> {
    let mut names: Vec<String> = [".", "scenarios"]
        .into_iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| stem(&path))
        .collect();
    names.sort();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_permission_is_told_what_to_do() {
        let error = unreadable(Path::new("mine.toml"), &io::ErrorKind::PermissionDenied.into());
        let message = error.to_string();
        assert!(message.contains("permission denied") && message.contains("chmod u+r mine.toml"), "{message}");
    }
}
