// The front page is the README. Of two definitions of a link the first counts: here the picture is part of the page, and links into the
// repository lead there from `target/doc/servosim`.
#![doc = concat!("[alpha-path]: data:image/svg+xml;base64,", include_str!("../docs/alpha-path.svg.base64"))]
//! [alpha-toml]: ../../../scenarios/alpha.toml
//! [tutorial]: ../../../docs/tutorial/first-run.md
//! [own-machine]: ../../../docs/tutorial/own-machine.md
//! [tuning]: ../../../docs/tutorial/tuning.md
//! [detailed-drive]: ../../../docs/tutorial/detailed-drive.md
//! [part]: ../../../docs/tutorial/part.md
//! [theory]: ../../../docs/theory/paths.md
//! [command-line]: ../../../docs/reference/command-line.md
//! [scenario-file]: ../../../docs/reference/scenario.md
//! [recordings]: ../../../docs/reference/recording.md
//! [glossary]: ../../../docs/glossary.md
//! [validation]: ../../../docs/validation.md
//! [architecture]: ../../../docs/development/architecture.md
//! [changelog]: ../../../CHANGELOG.md
//! [contributing]: ../../../CONTRIBUTING.md
//! [license]: ../../../LICENSE
//! [font-license]: ../../../src/report/fonts/LICENSE-DejaVu.txt
#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! Data flows one way, and every module knows only those before it:
//!
//! ```text
//! scenario ─▶ path ─▶ feedrate ─▶ interpolator ─▶ servo ─▶ contour ─▶ recording, report
//!    ▲          ▲                                     simulation
//!   cli    toolpath, nc ─▶ machining ─────────────────────┘
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`parameters`] | what a parameter is: key, unit, range, default, slider, help; names of the axes |
//! | [`lane`] | numbers side by side: what the hot loops are generic over |
//! | [`path`] | PH quintic splines, NURBS, lines, polylines, circles: arc length, point, tangent, curvature, nearest point |
//! | [`optimize`] | pattern search, Nelder-Mead, CMA-ES |
//! | [`feedrate`] | feedrate profiles, motion `s(t)` along a length, look-ahead, feed override |
//! | [`interpolator`] | path and motion to a stream of setpoints |
//! | [`servo`] | plant, controllers, axis loop, lock-up; the detailed drive model: effects and compensation |
//! | [`analysis`] | the sampled loop: margins, sensitivity, poles, bandwidth, step response |
//! | [`contour`] | contouring error against a path |
//! | [`simulation`] | pulls setpoints through the axes and hands each period to observers |
//! | [`limits`], [`summary`] | limits of a run, and its metrics |
//! | [`recording`] | MCAP out and in, CSV |
//! | [`report`] | plots |
//! | [`nc`] | NC programs as a stream of blocks, in three dialects |
//! | [`sweep`] | one scenario at many points: grids, samples, shards, tables |
//! | [`tuning`] | gains with a small contouring error and enough stability margin |
//! | [`measure`] | circular test, frequency response by stepped sines, step and following error |
//! | [`learning`] | iterative learning control |
//! | [`comparison`] | one scenario in many variants: effects one by one, controllers, sets of gains |
//! | [`scenario`] | scenario and part files to checked values, with diagnostics |
//! | [`toolpath`] | surface to tool path: drop cutter, step-over, rings, fitted B-splines, links |
//! | [`machining`] | programs through the machine, the part that is cut, its deviation |
//! | [`run`] | a scenario or a program from its file to recording, plots and metrics |
//! | `cli` | the command line (feature `cli`) |
//!
//! `path`, `feedrate` and `servo` do not know each other; [`simulation`] brings them together, and everything after it
//! observes it. Lengths are mm, times s, angles rad, voltages V, torques N m; every public name says its unit.

pub mod analysis;
#[cfg(feature = "cli")]
pub mod cli;
pub mod comparison;
pub mod contour;
mod diagnostics;
pub mod feedrate;
pub mod interpolator;
pub mod lane;
pub mod learning;
pub mod limits;
pub mod machining;
pub mod measure;
pub mod nc;
#[cfg(feature = "plots")]
mod numbers;
pub mod optimize;
pub mod parameters;
pub mod path;
pub mod recording;
#[cfg(feature = "plots")]
pub mod report;
pub mod run;
pub mod scenario;
pub mod servo;
pub mod simulation;
pub mod summary;
pub mod sweep;
pub mod toolpath;
pub mod tuning;
mod whole_file;
