//! The NC program of a part, and the statistics of its tool path.

use serde::Serialize;

use super::Part;
use crate::limits::LimitCheck;
use crate::machining::{Blocks, PartMetrics, ProgramStatistics, program};
use crate::nc::{Action, Block, Decimals, Dialect, Program, WriteError, Writing, Written};
use crate::toolpath::plan::ToolPath;

/// A tool path as the text of an NC program.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedProgram {
    /// The program.
    pub text: String,
    /// What stands in it.
    pub written: Written,
    /// What would stand in it with straight blocks at the same tolerance.
    pub straight: Written,
    /// What a person should hear of.
    pub remarks: Vec<String>,
}

impl PlannedProgram {
    /// Writes the program of a part's tool path: in the part's dialect, with as many decimals as its tolerance needs.
    ///
    /// # Errors
    /// Rounding moves the path by more than is left of the tolerance; a coordinate or feed out of range.
    pub fn new(part: &Part, path: &ToolPath) -> Result<Self, WriteError> {
        let mut remarks = Vec::new();
        let mut blocks = part.blocks;
        if blocks == Blocks::Nurbs && part.dialect == Dialect::LinuxCnc {
            blocks = Blocks::Straight;
            remarks.push(
                "LinuxCNC has NURBS in a plane and with uniform knots only: the program is in straight blocks"
                    .to_owned(),
            );
        }
        let writing = Writing { tolerance_mm: path.statistics.rounding_mm, ..Writing::new(part.dialect) };
        let (text, written) = write(part, &program(path, &part.feeds, blocks), writing, part.decimals)?;
        let straight = match blocks {
            Blocks::Straight => written,
            Blocks::Nurbs => write(part, &program(path, &part.feeds, Blocks::Straight), writing, part.decimals)?.1,
        };
        Ok(Self { text, written, straight, remarks })
    }
}

/// A program's text, with a line on where it comes from.
fn write(
    part: &Part,
    program: &Program,
    writing: Writing,
    decimals: Option<u8>,
) -> Result<(String, Written), WriteError> {
    let decimals = match decimals {
        Some(decimals) => Decimals::from(decimals),
        None => Decimals::choose(&program.blocks, &writing)?,
    };
    let writing = Writing { decimals, ..writing };
    // Marks of comments and line ends are no part of one.
    let plain = |text: &str| text.chars().filter(|c| !c.is_control() && !"();".contains(*c)).collect::<String>();
    let comment = Block {
        line: 0,
        start_mm: program.blocks.first().map_or([0.0; 3], |block| block.start_mm),
        end_mm: program.blocks.first().map_or([0.0; 3], |block| block.start_mm),
        feed_mm_min: None,
        action: Action::Comment(format!(
            "{}: {}, scallop {} mm, tolerance {} mm",
            plain(&part.name),
            part.cutter,
            part.options.scallop_mm,
            part.options.tolerance_mm
        )),
    };
    let mut bytes = Vec::new();
    let mut all = Program { blocks: vec![comment] };
    all.blocks.extend(program.blocks.iter().cloned());
    let written = all.write(&mut bytes, writing)?;
    // What a writer writes is ASCII but for the comment.
    Ok((String::from_utf8_lossy(&bytes).into_owned(), written))
}

/// Metrics of a tool path and its program. Keys carry their units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToolPathSummary {
    /// Name of the part.
    pub part: String,
    /// Name of the program's file.
    pub program: String,
    /// Whose language it is in.
    pub dialect: String,
    /// Rings of the tool path.
    pub rings: usize,
    /// Least and largest distance in plan from one ring to the next.
    pub step_over_mm: [f64; 2],
    /// The path tolerance that is kept: at most a quarter of the scallop height.
    pub path_tolerance_mm: f64,
    /// Largest distance of a curve to the points that it was fitted to.
    pub fit_error_mm: f64,
    /// Upper bound of what rounding the program's numbers moves any point of the path.
    pub rounding_mm: f64,
    /// Lines of the program.
    pub lines: usize,
    /// NURBS curves in it.
    pub curves: usize,
    /// Their control points: one block each.
    pub control_points: usize,
    /// Straight blocks at the feed.
    pub straight_blocks: usize,
    /// Rapid blocks.
    pub rapid_blocks: usize,
    /// Lines of the program with straight blocks instead, at the same tolerance.
    pub straight_lines: usize,
    /// Length of the motions at the feed.
    pub feed_length_mm: f64,
    /// Times that the tool leaves the surface for another place.
    pub air_moves: usize,
    /// Length of the rapid motions.
    pub rapid_length_mm: f64,
    /// Length over feed: what the program would take without acceleration.
    pub estimated_time_s: f64,
    /// What it takes on the machine: acceleration, jerk, curves and corners.
    pub motion_time_s: f64,
    /// Largest change of direction between neighbouring turns of a helix.
    pub tangent_jump_rad: f64,
    /// The part as the program has it.
    pub nominal: PartMetrics,
    /// Limits of the part, held against it.
    pub limits: Vec<LimitCheck>,
}

impl ToolPathSummary {
    /// The metrics in one; the limits of the part are held against them.
    pub fn new(
        part: &Part,
        path: &ToolPath,
        program: &PlannedProgram,
        statistics: &ProgramStatistics,
        nominal: PartMetrics,
    ) -> Self {
        let (planned, written) = (&path.statistics, &program.written);
        let limits = nominal.check(
            ["nominal_scallop_um", "nominal_gouge_um"],
            part.part_limits.nominal_scallop_um,
            part.part_limits.nominal_gouge_um,
        );
        Self {
            part: part.name.clone(),
            program: format!("{}.nc", part.name),
            dialect: part.dialect.name().to_owned(),
            rings: planned.rings,
            step_over_mm: [planned.least_step_mm, planned.largest_step_mm],
            path_tolerance_mm: planned.path_tolerance_mm,
            fit_error_mm: planned.fit_error_mm,
            rounding_mm: written.rounding_mm,
            lines: written.lines,
            curves: written.curves,
            control_points: written.control_points,
            straight_blocks: written.straight,
            rapid_blocks: written.rapid,
            straight_lines: program.straight.lines,
            feed_length_mm: statistics.feed_length_mm,
            air_moves: planned.air_moves,
            rapid_length_mm: statistics.rapid_length_mm,
            estimated_time_s: statistics.feed_length_mm / (part.feeds.cut_mm_min / 60.0)
                + statistics.rapid_length_mm / part.machine.rapid_mm_s,
            motion_time_s: statistics.time_s,
            tangent_jump_rad: planned.tangent_jump_rad,
            nominal,
            limits,
        }
    }

    /// Whether every limit is kept.
    pub fn passed(&self) -> bool {
        self.limits.iter().all(|check| check.kept)
    }
}
