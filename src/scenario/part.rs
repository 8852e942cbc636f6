//! A part to be machined, checked.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::part_limits::PartLimits;
use super::{Document, ScenarioError};
use crate::limits::Limits;
use crate::machining::{Blocks, Feeds, Machine};
use crate::nc::{Dialect, Reading};
use crate::servo::DriveModel;
use crate::servo::compensation::CrossCouplingGains;
use crate::toolpath::guide::Region;
use crate::toolpath::plan::{self, PlanError, ToolPath};
use crate::toolpath::{Cutter, DesignSurface};

/// Everything that a part needs: the surface, where and with what it is cut, the machine. The fields may be changed.
#[derive(Clone)]
pub struct Part {
    /// Name, also that of the output files.
    pub name: String,
    /// The design surface.
    pub surface: Arc<dyn DesignSurface>,
    /// Where the tool's axis may go.
    pub region: Region,
    /// The cutter.
    pub cutter: Cutter,
    /// How the tool path is made.
    pub options: plan::Options,
    /// Feeds of the program.
    pub feeds: Feeds,
    /// What the motions on the surface are written as.
    pub blocks: Blocks,
    /// Whose language the program is in.
    pub dialect: Dialect,
    /// Decimals of the program; none: the fewest that keep the tolerance.
    pub decimals: Option<u8>,
    /// The machine.
    pub machine: Machine,
    /// The controllers of its axes, what their drives do, and what is done about it.
    pub drives: [DriveModel; 3],
    /// Cross-coupled contour control, where there is one.
    pub cross_coupling: Option<CrossCouplingGains>,
    /// Side of a cell of the machining check \[mm\].
    pub cell_mm: f64,
    /// Limits that a run of the program is held to.
    pub limits: Limits,
    /// Limits that the machined part is held to.
    pub part_limits: PartLimits,
    /// The text that all this comes from, overrides applied.
    pub source: String,
}

impl Part {
    /// How its program is read: in its own dialect.
    pub fn reading(&self) -> Reading {
        Reading { dialect: Some(self.dialect), ..Reading::default() }
    }
}

impl fmt::Debug for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Part")
            .field("name", &self.name)
            .field("cutter", &self.cutter)
            .field("options", &self.options)
            .field("machine", &self.machine)
            .finish_non_exhaustive()
    }
}

impl Part {
    /// A part from a file.
    ///
    /// # Errors
    /// See [`Document::read`] and [`Document::part`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ScenarioError> {
        Document::read(path)?.part()
    }

    /// The tool path.
    ///
    /// # Errors
    /// Places where the cutter cannot rest, step-overs that are not possible: see [`plan::plan`].
    pub fn tool_path(&self) -> Result<ToolPath, PlanError> {
        plan::plan(&*self.surface, self.cutter, &self.region, &self.options)
    }
}

/// Where the files that a part or scenario names are looked for.
#[derive(Debug, Clone)]
pub(super) enum Folder {
    /// A folder.
    At(PathBuf),
    /// The program itself.
    BuiltIn,
}

impl Folder {
    /// What a file that exists is called in a text of this folder: the way to it from here, or its whole path where there is none.
    pub(super) fn name_of(&self, file: &Path) -> Option<String> {
        let folder = match self {
            Self::At(folder) if folder.as_os_str().is_empty() => Path::new("."),
            Self::At(folder) => folder,
            Self::BuiltIn => Path::new("."),
        };
        let (folder, file) = (folder.canonicalize().ok()?, file.canonicalize().ok()?);
        let common = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
        // Another disk, or all the way down and up again.
        if common <= 1 && folder.components().count() > 1 {
            return file.to_str().map(str::to_owned);
        }
        let up = folder.components().skip(common).map(|_| Some(".."));
        let down = file.components().skip(common).map(|part| part.as_os_str().to_str());
        Some(up.chain(down).collect::<Option<Vec<_>>>()?.join("/"))
    }

    /// A file to be read, and what messages call it.
    pub(super) fn open(&self, file: &str) -> io::Result<(Box<dyn Read>, String)> {
        match self {
            // No built-in part names a file.
            Self::BuiltIn => Err(io::ErrorKind::NotFound.into()),
            Self::At(folder) => {
                let path = folder.join(file);
                let opened = File::open(&path)?;
                if opened.metadata()?.is_dir() {
                    return Err(io::ErrorKind::IsADirectory.into());
                }
                Ok((Box::new(opened), path.display().to_string()))
            }
        }
    }
}
