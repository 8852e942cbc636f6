//! From a part's file as written to checked values. Every value is checked, so that all problems are reported at once.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use toml::Spanned;

use super::check;
use super::diagnostics::Problems;
use super::diagnostics::{Diagnostic, brief};
use super::number_table::{NumberTable, number, out_of_range};
use super::part::{Folder, Part};
use super::part_file::{
    RawBlocks, RawCutter, RawDialect, RawFit, RawLinking, RawMesh, RawOrder, RawPart, RawStepOver, RawSurface,
    RawToolpath, RawUnreachable,
};
use super::part_limits::FileLimits;
use super::{check_contour, check_drive, check_surface};
use crate::machining::{Blocks, Feeds, Machine};
use crate::nc::{Dialect, MAX_DECIMALS};
use crate::parameters::{Bound, Parameter, Range as ValidRange};
use crate::path::NurbsSurface;
use crate::path::nurbs::MAX_DEGREE;
use crate::servo::{AxisParameters, LoopSettings};
use crate::toolpath::drop_cutter::{MeshSurface, NurbsDesign};
use crate::toolpath::fit::Method;
use crate::toolpath::mesh::{Mesh, MeshError};
use crate::toolpath::plan::{Form, Options, Order, StepForm};
use crate::toolpath::{Cutter, CutterError, DesignSurface};

/// Height of rapid moves above the highest point where the file gives none \[mm\].
const CLEARANCE_MM: f64 = 5.0;

/// Lengths that the tool path is made to: the work grows with their inverse, and no machine keeps less than ten nanometres.
const FINE_MM: ValidRange = ValidRange::closed(1e-5, 1e6);

const SCALLOP: Parameter =
    Parameter::new("toolpath.scallop_mm", "mm", FINE_MM, "Height of the ridge between two passes")
        .hint("give the height of the ridge in millimetres, such as 0.01");
const TOLERANCE: Parameter = Parameter::new("toolpath.tolerance_mm", "mm", FINE_MM, "Deviation of the path")
    .hint("give the path tolerance in millimetres, such as 0.01");
const CLEARANCE: Parameter =
    Parameter::new("toolpath.clearance_mm", "mm", ValidRange::above(0.0, 1e6), "Height of rapid moves")
        .hint("give the height above the highest point in millimetres");
const CELL: Parameter = Parameter::new("check.cell_mm", "mm", ValidRange::above(0.0, 1e6), "Size of a cell")
    .hint("give the size of a cell in millimetres, such as 0.1");
const DEGREES: ValidRange = ValidRange { low: Bound::Closed(1.0), high: Bound::Closed(MAX_DEGREE as f64), whole: true };
const DEGREE: Parameter =
    Parameter::new("toolpath.degree", "", DEGREES, "Degree of the curves").hint("3 (cubic) is usual");
const DECIMALS: Parameter =
    Parameter::new("program.decimals", "", ValidRange::whole(0, MAX_DECIMALS as u32), "Decimals of the program");

/// A whole number of a file within the range of its parameter.
fn whole(parameter: &Parameter, raw: &Spanned<i64>, problems: &mut Problems) -> usize {
    number(parameter, &Spanned::new(raw.span(), *raw.get_ref() as f64), problems);
    usize::try_from(*raw.get_ref()).unwrap_or_default()
}

fn cutter(raw: &Spanned<RawCutter>, problems: &mut Problems) -> Option<Cutter> {
    let (made, radius, corner) = match raw.get_ref() {
        RawCutter::Ball(ball) => (Cutter::ball(*ball.radius_mm.get_ref()), &ball.radius_mm, None),
        RawCutter::Flat(flat) => (Cutter::flat(*flat.radius_mm.get_ref()), &flat.radius_mm, None),
        RawCutter::BullNose(bull) => (
            Cutter::bull_nose(*bull.radius_mm.get_ref(), *bull.corner_radius_mm.get_ref()),
            &bull.radius_mm,
            Some(&bull.corner_radius_mm),
        ),
    };
    match made {
        Ok(cutter) => Some(cutter),
        Err(error) => {
            let place = match error {
                CutterError::BadCorner { .. } => corner.unwrap_or(radius),
                _ => radius,
            };
            problems.push(Diagnostic::new(error.to_string()).at(place.span()).help("give the radius in millimetres"));
            None
        }
    }
}

/// The surface: as the cutter sees it, and as a NURBS surface where it is one. With a `cutter` places that it cannot reach are a
/// problem (at `place`).
fn surface(
    raw: &Spanned<RawSurface>,
    folder: &Folder,
    cutter: Option<Cutter>,
    place: Range<usize>,
    problems: &mut Problems,
) -> Option<(Arc<dyn DesignSurface>, Option<NurbsSurface>)> {
    match raw.get_ref() {
        RawSurface::Nurbs(raw) => {
            let made = check_surface::nurbs_surface(raw).and_then(|surface| {
                let design = NurbsDesign::new(&surface)
                    .map_err(|error| Diagnostic::new(error.to_string()).at(raw.control_points_mm.span()))?;
                if let Some(cutter) = cutter
                    && let Err(fault) = design.check(&cutter)
                {
                    return Err(Diagnostic::new(fault.to_string()).at(place.clone()).help(
                        "toolpath.unreachable = \"leave\" cuts what can be reached; the machining check shows what stays",
                    ));
                }
                Ok((Arc::new(design) as Arc<dyn DesignSurface>, Some(surface)))
            });
            made.map_err(|problem| problems.push(problem)).ok()
        }
        RawSurface::Mesh(raw) => match mesh(raw, folder) {
            Ok(mesh) => Some((Arc::new(MeshSurface::new(&mesh)), None)),
            Err(problem) => {
                problems.push(problem);
                None
            }
        },
    }
}

fn mesh(raw: &RawMesh, folder: &Folder) -> Result<Mesh, Diagnostic> {
    let file = raw.file.get_ref();
    let at = |problem: Diagnostic| problem.at(raw.file.span());
    let (reader, origin) = folder.open(file).map_err(|error| {
        let problem = Diagnostic::new(format!("the mesh `{}` cannot be read: {error}", brief(file)));
        at(match error.kind() {
            io::ErrorKind::NotFound => problem.help("the file is looked for in the folder of this one"),
            io::ErrorKind::IsADirectory => problem.help("give an STL file"),
            _ => problem,
        })
    })?;
    Mesh::from_stl(reader, &origin).map_err(|error| {
        let problem = Diagnostic::new(error.to_string());
        at(match error {
            MeshError::NoStl { .. } => problem.help("binary and ASCII STL files are read"),
            _ => problem,
        })
    })
}

fn options(raw: &RawToolpath, cutter: Option<Cutter>, problems: &mut Problems) -> Options {
    let scallop_mm = number(&SCALLOP, &raw.scallop_mm, problems);
    let tolerance_mm = number(&TOLERANCE, &raw.tolerance_mm, problems);
    if let Some(cutter) = cutter
        && !(scallop_mm < cutter.radius_mm())
    {
        problems.push(
            Diagnostic::new(format!(
                "a scallop height of {scallop_mm} mm is not possible with a cutter of radius {} mm",
                cutter.radius_mm()
            ))
            .at(raw.scallop_mm.span())
            .help("it must be below the cutter radius; a hundredth of it is usual"),
        );
    }
    let mut options = Options::new(scallop_mm, tolerance_mm);
    if let Some(given) = &raw.degree {
        options.degree = whole(&DEGREE, given, problems);
    }
    match raw.fit {
        Some(RawFit::Free) => options.fit = Method::Free,
        Some(RawFit::Density) => options.fit = Method::Density,
        Some(RawFit::Paper) => options.fit = Method::Paper,
        Some(RawFit::Standard) => options.fit = Method::Standard,
        None => {}
    }
    if let Some(given) = &raw.step_over {
        options.step = match given.get_ref() {
            RawStepOver::Measured => StepForm::Measured,
            RawStepOver::Exact => StepForm::Exact,
            RawStepOver::Fast => StepForm::Fast,
        };
        if options.step != StepForm::Measured && cutter.is_some_and(|cutter| !cutter.is_ball()) {
            problems.push(
                Diagnostic::new("the step-over formulas hold for a ball-end cutter only")
                    .at(given.span())
                    .help("take step_over = \"measured\" for this one"),
            );
        }
    }
    options.form = match raw.linking {
        Some(RawLinking::Continuous) => Form::Continuous,
        Some(RawLinking::Discrete) | None => Form::Discrete,
    };
    options.order = match raw.order {
        Some(RawOrder::InsideOut) => Order::InsideOut,
        Some(RawOrder::OutsideIn) | None => Order::OutsideIn,
    };
    options.clearance_mm = raw.clearance_mm.as_ref().map_or(CLEARANCE_MM, |given| number(&CLEARANCE, given, problems));
    options
}

fn machine(
    raw: &NumberTable<Machine>,
    axes: [AxisParameters; 3],
    settings: LoopSettings,
    problems: &mut Problems,
) -> Machine {
    let mut machine = Machine {
        axes,
        settings,
        rapid_mm_s: 0.0,
        accel_mm_s2: 0.0,
        jerk_mm_s3: 0.0,
        lateral_accel_mm_s2: 0.0,
        corner_velocity_step_mm_s: 0.0,
        junction_accel_step_mm_s2: 0.0,
    };
    raw.fill(&mut machine, |error, span| problems.push(out_of_range("", error, span, "")));
    machine.lateral_accel_mm_s2 = machine.accel_mm_s2;
    if raw.span("junction_accel_step_mm_s2").is_none() {
        // The jerk limit over one period; of values that are refused anyway, what is in range.
        machine.junction_accel_step_mm_s2 = (machine.jerk_mm_s3 * settings.period_s).clamp(1e-6, 1e9);
    }
    machine
}

/// The checked part, or all its problems. `default_name` is its name where the file gives none.
pub(super) fn part(raw: &RawPart, default_name: &str, source: &str, folder: &Folder) -> Result<Part, Problems> {
    let mut problems = Vec::new();
    let name = check::name(raw.name.as_ref(), default_name, &mut problems);
    let cutter = cutter(&raw.cutter, &mut problems);
    let mut options = options(&raw.toolpath, cutter, &mut problems);
    let mut feeds = Feeds { cut_mm_min: 0.0, plunge_mm_min: 0.0 };
    raw.feed.fill(&mut feeds, |error, span| problems.push(out_of_range("", error, span, "")));
    if raw.feed.span("plunge_mm_min").is_none() {
        feeds.plunge_mm_min = feeds.cut_mm_min / 3.0;
    }
    let decimals = raw.program.decimals.as_ref().map(|given| {
        let decimals = whole(&DECIMALS, given, &mut problems);
        u8::try_from(decimals).unwrap_or(MAX_DECIMALS)
    });
    let dialect = match raw.program.dialect {
        Some(RawDialect::Fanuc) => Dialect::Fanuc,
        Some(RawDialect::Linuxcnc) => Dialect::LinuxCnc,
        Some(RawDialect::Siemens) | None => Dialect::Siemens,
    };
    let blocks = match raw.program.blocks {
        Some(RawBlocks::Straight) => Blocks::Straight,
        Some(RawBlocks::Nurbs) | None => Blocks::Nurbs,
    };
    if blocks == Blocks::Nurbs && !dialect.degrees().contains(&options.degree) {
        let (least, most) = (dialect.degrees().start().to_owned(), dialect.degrees().end().to_owned());
        let problem = Diagnostic::new(format!("{} has no curves of degree {}", dialect.name(), options.degree))
            .help(format!("it has those of degree {least} to {most}"));
        let place = raw.toolpath.degree.as_ref().map(Spanned::span);
        problems.push(place.map_or(problem.clone(), |span| problem.at(span)));
        options.degree = most;
    }
    let settings = check::control(&raw.control, &mut problems);
    let axes = [("x", &raw.axes.x), ("y", &raw.axes.y), ("z", &raw.axes.z)]
        .map(|(name, raw)| check::axis(name, raw, &mut problems));
    let raw_axes = [("x", &raw.axes.x), ("y", &raw.axes.y), ("z", &raw.axes.z)];
    let drives = std::array::from_fn(|i| {
        let (name, raw) = (raw_axes[i].0, raw_axes[i].1.get_ref());
        if let Some(zero_phase) = &raw.compensation.zero_phase
            && *zero_phase.get_ref()
        {
            problems.push(
                Diagnostic::new(format!("axis {name}: zero-phase tracking is there for scenarios, not for programs"))
                    .at(zero_phase.span())
                    .help("a program's setpoints are not known in advance; remove `zero_phase`"),
            );
        }
        check_drive::drive((name, i as u64), raw, &axes[i], &settings, &mut problems)
    });
    let coupling = raw.control.cross_coupling.as_ref();
    let cross_coupling = coupling.and_then(|raw| check_drive::cross_coupling(raw, &mut problems));
    let machine = machine(&raw.machine, axes, settings, &mut problems);
    let mut limits = FileLimits::default();
    raw.limits.fill(&mut limits, |error, span| problems.push(out_of_range("", error, span, "")));
    let cell_mm = raw.check.cell_mm.as_ref().map_or_else(
        || cutter.map_or(1.0, |cutter| cutter.radius_mm()) / 50.0,
        |given| number(&CELL, given, &mut problems),
    );
    // What takes time comes last: not where something else is wrong already.
    if !problems.is_empty() {
        return Err(problems);
    }
    let whole = matches!(raw.toolpath.unreachable, Some(RawUnreachable::Refuse) | None);
    let surface = surface(&raw.surface, folder, cutter.filter(|_| whole), raw.cutter.span(), &mut problems);
    let nurbs = surface.as_ref().and_then(|(_, nurbs)| nurbs.as_ref());
    let place = raw.surface.span();
    let region = if surface.is_some() || raw.boundary.is_some() {
        check_contour::region(raw.boundary.as_ref(), &raw.islands, nurbs, place, &mut problems)
    } else {
        None
    };
    let (Some(cutter), Some((surface, _)), Some(region), true) = (cutter, surface, region, problems.is_empty()) else {
        return Err(problems);
    };
    Ok(Part {
        name,
        surface,
        region,
        cutter,
        options,
        feeds,
        blocks,
        dialect,
        decimals,
        machine,
        drives,
        cross_coupling,
        cell_mm,
        limits: limits.run,
        part_limits: limits.part,
        source: source.to_owned(),
    })
}
