#![doc = include_str!("../README.md")]
//!
//! # The house
//!
//! Data flows one way, and the modules stand in that order:
//!
//! ```text
//! scenario ─▶ path ─▶ feedrate ─▶ interpolator ─▶ servo ─▶ contour ─▶ recording, report
//!    ▲          ▲                                     simulation
//!   cli    toolpath, nc ─▶ machining ─────────────────────┘
//! ```
//!
//! | module | what lives there |
//! |---|---|
//! | [`lane`] | numbers side by side: what the hot loops are generic over |
//! | [`path`] | PH quintic splines, NURBS, lines, polylines, circles; length, point, tangent and curvature at arc length, nearest point |
//! | [`optimize`] | pattern search, Nelder-Mead, CMA-ES: a function in, the best point and the history out |
//! | [`feedrate`] | profiles, motion `s(t)` along a length |
//! | [`interpolator`] | path and motion to a stream of setpoints |
//! | [`servo`] | plant, PDFF controller, the axis loop, lock-up; the detailed drive model: effects, controllers, compensation |
//! | [`analysis`] | the sampled loop in closed form: margins, sensitivity, poles, bandwidth, step response |
//! | [`contour`] | contouring error against a path |
//! | [`simulation`] | pulls setpoints through the axes and hands each period to observers |
//! | [`limits`], [`summary`] | what a run is held to, and its metrics |
//! | [`recording`] | MCAP out and in, CSV |
//! | [`report`] | plots |
//! | [`nc`] | NC programs as a stream of blocks: read in every dialect, written in one |
//! | [`sweep`] | one scenario at many points: grids, samples, shards, tables |
//! | [`tuning`] | gains that make the contouring error small and keep stability margin, and whether to trust them |
//! | [`measure`] | what is measured on machines: circular test, frequency response by stepped sines, step and following error |
//! | [`learning`] | iterative learning: a correction of the commands over repeated runs |
//! | [`comparison`] | one scenario in many variants: effects one by one, controllers, sets of gains |
//! | [`scenario`] | the files as written (scenarios, parts) to checked values, with diagnostics |
//! | [`toolpath`] | from a surface to tool paths: cutters and where they rest, step-over, rings, B-splines with few control points, links |
//! | [`machining`] | where tool paths, programs and the loop meet: programs through the machine, the part that is left, its deviation |
//! | `cli` | the command line (feature `cli`): one file a subcommand |
//!
//! `path`, `feedrate` and `servo` are the ground floor and do not know each other; [`simulation`] is where they meet, and
//! everything after it observes it. Lengths are mm, times s, angles rad, voltages V, torques N m; a public name says its unit.

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
pub mod optimize;
pub mod path;
pub mod recording;
#[cfg(feature = "plots")]
pub mod report;
pub mod scenario;
pub mod servo;
pub mod simulation;
pub mod summary;
pub mod sweep;
pub mod toolpath;
pub mod tuning;
