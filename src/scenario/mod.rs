//! Scenarios: everything that a run needs, in one TOML file.
//!
//! ```toml
//! [path.ph_spline]
//! control_points_mm = [[0, 0], [12, 18], [24, 27], [36, 9], [24, -9], [12, 0], [0, 18]]
//!
//! [feedrate]
//! feed_mm_s = 100
//!
//! [feedrate.profile.exponential]
//! phase_s = 0.1
//! n_c = 8.12
//!
//! [axes.x.plant.first_order]
//! gain_rad_s_v = 83.0089
//! time_constant_s = 0.19936
//!
//! [axes.x.pdff]
//! kpp = 97.38
//! kpv = 1.19
//! kiv = 252.8
//! kpf = 0.8
//! kvf = 0.85
//! # … and the same for axes.y
//! ```
//!
//! A [`Document`] is the text (a file, a built-in scenario, with or without overrides), a [`Scenario`] what it means. Problems
//! of a text are reported as [`Diagnostic`]s that point at the line and say what to do. Every key is described in
//! [`json_schema`].
//!
//! ```
//! use servosim::scenario::Scenario;
//!
//! let mut alpha = Scenario::builtin("alpha")?;
//! alpha.settings.settling_s = 0.2;
//! let summary = alpha.run(&mut [])?;
//! assert!(summary.max_contour_error_um < 30.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod check;
mod check_contour;
mod check_drive;
mod check_feed;
mod check_learned;
mod check_part;
mod check_path;
mod check_surface;
mod diagnostics;
mod document;
mod document_kind;
mod drive_file;
mod feed_profile;
mod file;
mod keys;
mod number_table;
mod numbers;
mod overrides;
mod part;
mod part_file;
mod part_limits;
mod part_program;
mod registry;
mod repair;
mod schema;
mod size_limits;
mod toml_errors;

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use nalgebra::Vector2;

pub use diagnostics::{Diagnostic, ScenarioError};
pub use document::{Document, builtin_names, builtin_part_names};
pub use feed_profile::FeedProfile;
pub use part::Part;
pub use part_limits::PartLimits;
pub use part_program::{PlannedProgram, ToolPathSummary};
pub use registry::{ScenarioParameter, scenario_parameters};
pub use size_limits::{MAX_ARRAY_ITEMS, MAX_TEXT_BYTES};

use crate::feedrate::{Motion, Profile};
use crate::limits::Limits;
use crate::optimize::Outcome;
use crate::path::Path;
use crate::servo::compensation::CrossCouplingGains;
use crate::servo::{AxisParameters, DriveModel, LoopSettings};
use crate::simulation::{Observer, ReferenceTrajectory, Simulation, SimulationError};
use crate::summary::{Summary, SummaryObserver};

/// Everything that a run needs, checked. The fields may be changed before a run; [`Scenario::simulation`] checks the
/// parameters of the loop again.
#[derive(Clone)]
pub struct Scenario {
    /// Name, also that of the output files.
    pub name: String,
    /// The desired path.
    pub path: Arc<dyn Path<2>>,
    /// Commanded feed \[mm/s\]; [`Motion::feed_mm_s`] is the one that is reached.
    pub feed_mm_s: f64,
    /// The motion along the path, planned from `feed_mm_s`, `profile` and the path, under the feed override.
    pub motion: Motion,
    /// How the feed is reached and left.
    pub profile: FeedProfile,
    /// The search that chose `n_c`, where the file says `n_c = "optimize"`.
    pub n_c_search: Option<Outcome>,
    /// The axes, X and Y.
    pub axes: [AxisParameters; 2],
    /// Their controllers, what their drives do, and what is done about it; by default nothing beside the model.
    pub drives: [DriveModel; 2],
    /// Cross-coupled contour control, where there is one.
    pub cross_coupling: Option<CrossCouplingGains>,
    /// Corrections of the position commands that were learned, sample by sample \[mm\], where there are some: what
    /// [`Simulation::with_corrections`] takes.
    pub corrections_mm: Option<Arc<[Vector2<f64>]>>,
    /// How the loop is sampled.
    pub settings: LoopSettings,
    /// Limits that a run is held to.
    pub limits: Limits,
    /// The text that all this comes from, overrides applied.
    pub source: String,
}

impl fmt::Debug for Scenario {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scenario")
            .field("name", &self.name)
            .field("length_mm", &self.path.length_mm())
            .field("feed_mm_s", &self.feed_mm_s)
            .field("profile", &self.profile)
            .field("axes", &self.axes)
            .field("drives", &self.drives)
            .field("cross_coupling", &self.cross_coupling)
            .field("corrections", &self.corrections_mm.as_ref().map(|corrections| corrections.len()))
            .field("settings", &self.settings)
            .field("limits", &self.limits)
            .finish_non_exhaustive()
    }
}

impl Scenario {
    /// A scenario from its text; `origin` is what messages call the text.
    ///
    /// # Errors
    /// See [`Document::scenario`].
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        Document::from_text(text, origin).scenario()
    }

    /// A scenario from a file.
    ///
    /// # Errors
    /// See [`Document::read`] and [`Document::scenario`].
    pub fn load(path: impl AsRef<std::path::Path>) -> Result<Self, ScenarioError> {
        Document::read(path)?.scenario()
    }

    /// A scenario that is part of the crate: `alpha`, `heart` or `star`.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn builtin(name: &str) -> Result<Self, ScenarioError> {
        let unknown = || {
            let known = builtin_names().collect::<Vec<_>>().join(", ");
            let problem = Diagnostic::new(format!("there is no built-in scenario `{}`", diagnostics::brief(name)));
            ScenarioError::new("", "", vec![problem.help(format!("built in: {known}"))])
        };
        Document::builtin(name).ok_or_else(unknown)?.scenario()
    }

    /// Exponent of the exponential profile.
    pub fn n_c(&self) -> Option<f64> {
        match self.profile {
            FeedProfile::Phases(Profile::Exponential { n_c, .. }) => Some(n_c),
            _ => None,
        }
    }

    /// The run as a stream of control periods, its commands corrected by what was learned.
    ///
    /// # Errors
    /// A parameter of the loop out of range, or too long a run.
    pub fn simulation(&self) -> Result<Simulation<'_, 2>, SimulationError> {
        self.simulation_of(self.axes)
    }

    /// The run with other models and gains of the axes; their drives stay as they are.
    ///
    /// # Errors
    /// As [`Scenario::simulation`].
    pub fn simulation_of(&self, axes: [AxisParameters; 2]) -> Result<Simulation<'_, 2>, SimulationError> {
        let coupling = self.cross_coupling.as_ref();
        let run = Simulation::with_drives(&*self.path, &self.motion, axes, &self.drives, coupling, self.settings)?;
        match &self.corrections_mm {
            Some(corrections) => run.with_corrections(corrections.clone()),
            None => Ok(run),
        }
    }

    /// Whether the axes are what their models say: plants of first order under PDFF controllers.
    pub fn is_model(&self) -> bool {
        self.cross_coupling.is_none() && self.drives.iter().all(DriveModel::is_model)
    }

    /// The same axes as their models have them, nothing done about what they are beside that.
    #[must_use]
    pub fn model(&self) -> Self {
        Self { drives: Default::default(), cross_coupling: None, corrections_mm: None, ..self.clone() }
    }

    /// Setpoints and path geometry for runs with other axes, many at once. What the scenario says of its axes is not in it, nor
    /// are learned corrections.
    ///
    /// # Errors
    /// See [`ReferenceTrajectory::new`].
    pub fn reference_trajectory(&self) -> Result<ReferenceTrajectory<'_, 2>, SimulationError> {
        ReferenceTrajectory::new(&*self.path, &self.motion, self.settings)
    }

    /// An observer that gathers the summary of a run of this scenario.
    pub fn summary_observer(&self) -> SummaryObserver<2> {
        let search = self.n_c_search.as_ref().map(|outcome| outcome.history.clone());
        SummaryObserver::new(self.name.as_str()).with_n_c(self.n_c(), search)
    }

    /// Runs the scenario through the observers and sums it up.
    ///
    /// # Errors
    /// Those of [`Scenario::simulation`] and [`Simulation::run`].
    pub fn run(&self, observers: &mut [&mut dyn Observer<2>]) -> Result<Summary, SimulationError> {
        self.run_until(None, observers)
    }

    /// As [`Scenario::run`], but ends early (with [`Summary::complete`] false) when `stop` is raised.
    ///
    /// # Errors
    /// As [`Scenario::run`].
    pub fn run_until(
        &self,
        stop: Option<&AtomicBool>,
        observers: &mut [&mut dyn Observer<2>],
    ) -> Result<Summary, SimulationError> {
        let mut summary = self.summary_observer();
        let mut all: Vec<&mut dyn Observer<2>> = Vec::with_capacity(observers.len() + 1);
        all.push(&mut summary);
        for observer in observers.iter_mut() {
            all.push(&mut **observer);
        }
        self.simulation()?.run(&self.limits, stop, &mut all)?;
        Ok(summary.summary())
    }
}

/// The JSON schema of a scenario file, for editors.
pub fn json_schema() -> serde_json::Value {
    document_kind::SCENARIO.schema().clone()
}

/// The JSON schema of a part file.
pub fn part_json_schema() -> serde_json::Value {
    document_kind::PART.schema().clone()
}
