//! A part's TOML file as it is written: every value with its place in the text.

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;
use toml::Spanned;

use super::file::{RawAxis, RawControl, schema_of};
use super::number_table::NumberTable;
use super::numbers::{RawPoint, RawPoint3};
use super::part_limits::FileLimits;
use super::schema::describe_all;
use crate::machining::{Feeds, Machine};
use crate::parameters::AXIS_NAMES;

/// A part to be machined on three axes: a surface, a cutter, how the tool path is made, and the machine that cuts it.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "servosim part")]
pub(super) struct RawPart {
    /// Name of the part in summaries and file names. Default: the file's name without its extension.
    #[schemars(with = "Option<String>", length(min = 1, max = 100))]
    pub(super) name: Option<Spanned<String>>,
    /// The design surface: exactly one of `nurbs` and `mesh`.
    #[schemars(with = "RawSurface")]
    pub(super) surface: Spanned<RawSurface>,
    /// Where the tool axis may go, seen from above: exactly one of `polygon`, `circle`, `nurbs` and `contour`. Default: the edge of
    /// the surface.
    #[schemars(with = "Option<RawContour>")]
    pub(super) boundary: Option<Spanned<RawContour>>,
    /// Areas inside the boundary that the tool axis avoids, each given like the boundary.
    #[serde(default)]
    #[schemars(with = "Vec<RawContour>")]
    pub(super) islands: Vec<Spanned<RawContour>>,
    /// The cutter: exactly one of `ball`, `flat` and `bull_nose`.
    #[schemars(with = "RawCutter")]
    pub(super) cutter: Spanned<RawCutter>,
    /// How the tool path is planned.
    pub(super) toolpath: RawToolpath,
    /// Feeds.
    pub(super) feed: NumberTable<Feeds>,
    /// The NC program.
    #[serde(default)]
    pub(super) program: RawProgram,
    /// Limits of the machine's motion.
    pub(super) machine: NumberTable<Machine>,
    /// How the servo loops are sampled.
    #[serde(default)]
    pub(super) control: RawControl,
    /// The three axes.
    pub(super) axes: RawAxes3,
    /// The machining check.
    #[serde(default)]
    pub(super) check: RawCheck,
    /// Limits of the part.
    #[serde(default)]
    pub(super) limits: NumberTable<FileLimits>,
}

/// The design surface.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawSurface {
    /// A NURBS surface.
    Nurbs(RawNurbsSurface),
    /// A triangle mesh.
    Mesh(RawMesh),
}

/// A NURBS surface.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawNurbsSurface {
    /// Degrees along u and v. Default: [3, 3].
    #[schemars(with = "Option<[u8; 2]>")]
    pub(super) degree: Option<Spanned<[i64; 2]>>,
    /// Rows of control points [x, y, z] in mm: u grows from row to row, v along a row.
    #[schemars(with = "Vec<Vec<[f64; 3]>>")]
    pub(super) control_points_mm: Spanned<Vec<Spanned<Vec<RawPoint3>>>>,
    /// Weights, row by row. Default: 1 each.
    #[schemars(with = "Option<Vec<Vec<f64>>>")]
    pub(super) weights: Option<Spanned<Vec<Vec<f64>>>>,
    /// Knots along u: as many as rows plus degree plus one. Default: uniform, the first and last repeated.
    #[schemars(with = "Option<Vec<f64>>")]
    pub(super) knots_u: Option<Spanned<Vec<f64>>>,
    /// Knots along v. Default: uniform, the first and last repeated.
    #[schemars(with = "Option<Vec<f64>>")]
    pub(super) knots_v: Option<Spanned<Vec<f64>>>,
}

/// A triangle mesh.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawMesh {
    /// STL file (binary or ASCII, in mm), relative to the folder of this file.
    #[schemars(with = "String")]
    pub(super) file: Spanned<String>,
}

/// A closed curve seen from above.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawContour {
    /// Straight lines from point to point and back to the first.
    Polygon(RawPolygon),
    /// A circle.
    Circle(RawBoundaryCircle),
    /// A closed NURBS curve.
    Nurbs(RawNurbsCurve),
    /// Lines, arcs and curves, joined end to end.
    Contour(RawPieces),
}

/// Straight lines from point to point and back to the first.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPolygon {
    /// The corners, each once.
    #[schemars(with = "Vec<[f64; 2]>")]
    pub(super) points_mm: Spanned<Vec<RawPoint>>,
}

/// A circle.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawBoundaryCircle {
    /// Centre.
    #[schemars(with = "[f64; 2]")]
    pub(super) centre_mm: RawPoint,
    /// Radius.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) radius_mm: Spanned<f64>,
}

/// A NURBS curve in plan.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawNurbsCurve {
    /// Degree. Default: 3.
    #[schemars(with = "Option<u8>")]
    pub(super) degree: Option<Spanned<i64>>,
    /// Control points [x, y] in mm; the last is the first where the curve alone is the contour.
    #[schemars(with = "Vec<[f64; 2]>")]
    pub(super) control_points_mm: Spanned<Vec<RawPoint>>,
    /// Weights. Default: 1 each.
    #[schemars(with = "Option<Vec<f64>>")]
    pub(super) weights: Option<Spanned<Vec<f64>>>,
    /// Knots. Default: uniform, the first and last repeated.
    #[schemars(with = "Option<Vec<f64>>")]
    pub(super) knots: Option<Spanned<Vec<f64>>>,
}

/// Lines, arcs and curves, joined end to end.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPieces {
    /// Where the first piece starts.
    #[schemars(with = "[f64; 2]")]
    pub(super) start_mm: RawPoint,
    /// The pieces; the last one ends at the start.
    #[schemars(with = "Vec<RawPiece>")]
    pub(super) pieces: Spanned<Vec<Spanned<RawPiece>>>,
}

/// A piece of a contour.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawPiece {
    /// A straight line.
    Line(RawLinePiece),
    /// An arc.
    Arc(RawArcPiece),
    /// A NURBS curve, from its first control point to its last.
    Nurbs(RawNurbsCurve),
}

/// A straight line.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLinePiece {
    /// Where it ends.
    #[schemars(with = "[f64; 2]")]
    pub(super) end_mm: RawPoint,
}

/// An arc.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawArcPiece {
    /// Where it ends.
    #[schemars(with = "[f64; 2]")]
    pub(super) end_mm: RawPoint,
    /// Its centre.
    #[schemars(with = "[f64; 2]")]
    pub(super) centre_mm: RawPoint,
    /// Which way round, seen from above. Default: counterclockwise.
    #[serde(default)]
    pub(super) clockwise: bool,
}

/// The cutter.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawCutter {
    /// A ball-end cutter.
    Ball(RawRound),
    /// A flat-end cutter.
    Flat(RawRound),
    /// A bull-nose cutter: a flat end with rounded corners.
    BullNose(RawBullNose),
}

/// A cutter of one radius.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawRound {
    /// Radius.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) radius_mm: Spanned<f64>,
}

/// A flat end with rounded corners.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawBullNose {
    /// Radius.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) radius_mm: Spanned<f64>,
    /// Radius of the rounded corner.
    #[schemars(with = "f64", range(min = 0))]
    pub(super) corner_radius_mm: Spanned<f64>,
}

/// How the tool path is planned.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawToolpath {
    /// Largest height of the ridge that two neighbouring passes leave, in mm.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) scallop_mm: Spanned<f64>,
    /// Largest deviation of the path from the exact one, and of a gouge, in mm.
    #[schemars(with = "f64", extend("exclusiveMinimum" = 0))]
    pub(super) tolerance_mm: Spanned<f64>,
    /// Degree of the NURBS curves. Default: 3.
    #[schemars(with = "Option<u8>", range(min = 1, max = 9))]
    pub(super) degree: Option<Spanned<i64>>,
    /// How curves are fitted. Default: "free".
    pub(super) fit: Option<RawFit>,
    /// Step-over from ring to ring. Default: "measured".
    #[schemars(with = "Option<RawStepOver>")]
    pub(super) step_over: Option<Spanned<RawStepOver>>,
    /// How the rings are joined. Default: "discrete".
    pub(super) linking: Option<RawLinking>,
    /// In which order. Default: `"outside_in"`.
    pub(super) order: Option<RawOrder>,
    /// Height of rapid moves above the highest point, in mm. Default: 5.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) clearance_mm: Option<Spanned<f64>>,
    /// What happens where the cutter cannot reach: a concavity narrower than the cutter, an overhang. Default: "refuse".
    pub(super) unreachable: Option<RawUnreachable>,
}

/// How curves are fitted.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawFit {
    /// Free knots: the fewest control points.
    Free,
    /// Knots where the curve changes most: fast.
    Density,
    /// The paper's five stages.
    Paper,
    /// The textbook's averaged knots.
    Standard,
}

/// Step-over from ring to ring.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawStepOver {
    /// The ridge between two passes, measured on the surface: for every cutter.
    Measured,
    /// The exact formula, from the curvature below the ball.
    Exact,
    /// The fast formula, from the curvature below the ball.
    Fast,
}

/// How rings are joined.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawLinking {
    /// Closed rings, linked.
    Discrete,
    /// One helical path that slides from ring to ring.
    Continuous,
}

/// Order of machining.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawOrder {
    /// From the boundary inwards.
    OutsideIn,
    /// From the innermost rings outwards.
    InsideOut,
}

/// What happens where the cutter cannot reach.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawUnreachable {
    /// An error that says where.
    Refuse,
    /// Material is left there; the machining check shows how much.
    Leave,
}

/// The NC program.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawProgram {
    /// Dialect. Default: "siemens".
    pub(super) dialect: Option<RawDialect>,
    /// NURBS blocks, or straight blocks at the same tolerance. Default: "nurbs".
    pub(super) blocks: Option<RawBlocks>,
    /// Decimals of coordinates, knots and weights alike. Default: the fewest that move the path by no more than 0.001 mm.
    #[schemars(with = "Option<u8>", range(min = 0, max = 9))]
    pub(super) decimals: Option<Spanned<i64>>,
}

/// Dialect.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawDialect {
    /// Siemens 840D: BSPLINE.
    Siemens,
    /// Fanuc and Mitsubishi: G06.2.
    Fanuc,
    /// LinuxCNC: straight blocks; its NURBS are planar and have uniform knots.
    Linuxcnc,
}

/// Blocks of the program.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum RawBlocks {
    /// NURBS curves.
    Nurbs,
    /// Straight lines at the same tolerance.
    Straight,
}

/// The three axes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawAxes3 {
    /// The X axis.
    #[schemars(with = "RawAxis")]
    pub(super) x: Spanned<RawAxis>,
    /// The Y axis.
    #[schemars(with = "RawAxis")]
    pub(super) y: Spanned<RawAxis>,
    /// The Z axis.
    #[schemars(with = "RawAxis")]
    pub(super) z: Spanned<RawAxis>,
}

/// The machining check.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RawCheck {
    /// Size of a cell of the height field, in mm. Default: a fiftieth of the cutter radius.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub(super) cell_mm: Option<Spanned<f64>>,
}

/// The JSON schema of the file.
pub(super) fn make_schema() -> Value {
    let mut schema = schema_of::<RawPart>();
    describe_all(&mut schema, &AXIS_NAMES);
    schema
}
