//! `servosim stepover`: the step-over formulas beside each other.

use std::fmt::Write as _;

use crate::report::StepoverPicture;
use crate::toolpath::{StepoverComparison, StepoverRow};
use clap::Args;
use serde::Serialize;

use super::output::{OutputArgs, make_folder, percent, short, significant, wrote};
use super::{CliError, Outcome};

/// Most scallop heights that a plot can tell apart, and most curvature radii that it can mark.
const MOST: [usize; 2] = [6, 24];

/// Arguments of `servosim stepover`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim stepover                          the paper's table and plot
  servosim stepover --radius 3 --scallop 0.005,0.02 --curvature 40,-12,inf

A ball-end cutter of radius r leaves ridges of height h between passes at a distance w, on a surface of \
curvature radius R:
  flat    w = 2 √(2 r h - h²)
  exact   w = |R| √(4 (R+r)² (R+h)² - (R² + 2 R r + (R+h)²)²) / (|R+r| |R+h|)
  fast    w = √(8 h r R / (R + r))
R is positive where the surface is convex, negative where it is concave, inf
where it is flat. All lengths are mm.")]
pub(crate) struct StepoverArgs {
    /// Radius r of the ball-end cutter [mm]
    #[arg(long, value_name = "MM", default_value = "5", allow_negative_numbers = true)]
    radius: f64,
    /// Scallop heights h [mm]
    #[arg(long, value_name = "MM,…", default_value = "0.01,0.1", value_delimiter = ',', allow_hyphen_values = true)]
    scallop: Vec<f64>,
    /// Curvature radii R of the table [mm]: convex positive, concave negative, flat inf
    #[arg(
        long,
        value_name = "MM,…",
        default_value = "10,4,-9,-10,-11",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    curvature: Vec<f64>,
    /// Curvature radii that the plot shows, without sign [mm]
    #[arg(long, value_name = "LOW:HIGH", default_value = "2:100", value_parser = range, allow_hyphen_values = true)]
    range: [f64; 2],
    #[command(flatten)]
    out: OutputArgs,
}

fn range(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once(':').and_then(|(low, high)| Some([low.trim().parse().ok()?, high.trim().parse().ok()?]));
    match ends {
        Some([low, high]) if low >= 1e-6 && high <= 1e9 && high >= 1.001 * low => Ok([low, high]),
        _ => Err("write it as LOW:HIGH, 0 < LOW < HIGH, such as 2:100".to_owned()),
    }
}

/// What `--format json` prints. A flat surface has no curvature radius.
#[derive(Debug, Serialize)]
struct Comparison {
    cutter_radius_mm: f64,
    rows: Vec<StepoverRow>,
}

/// Compares them.
pub(crate) fn run(args: &StepoverArgs) -> Result<Outcome, CliError> {
    for (given, most, what) in
        [(args.scallop.len(), MOST[0], "scallop heights"), (args.curvature.len(), MOST[1], "curvature radii")]
    {
        if given > most {
            return Err(CliError::Usage(format!("{given} {what} are too many for one plot: at most {most}")));
        }
    }
    let compared = StepoverComparison {
        radius_mm: args.radius,
        scallops_mm: args.scallop.clone(),
        curvature_radii_mm: args.curvature.clone(),
        range_mm: args.range,
    };
    let rows = compared.rows().map_err(|error| CliError::Usage(format!("no step-over: {error}")))?;
    let comparison = Comparison { cutter_radius_mm: args.radius, rows };
    args.out.print.show(&comparison, || table(&comparison))?;
    if let Some(format) = args.out.plots.format() {
        make_folder(&args.out.folder)?;
        let caption = caption(&compared);
        let picture = StepoverPicture {
            caption: &caption,
            curves: compared.curves(),
            rows: comparison.rows,
            range_mm: compared.sound_range_mm(),
        };
        let stem = format!("ball-{}mm", short(args.radius, 4));
        args.out.print.note(&wrote(&picture.write(&args.out.folder, &stem, format)?));
    }
    Ok(Outcome::Fine)
}

/// What the plot shows, in one line.
fn caption(compared: &StepoverComparison) -> String {
    let points = if *compared == StepoverComparison::default() { "the paper's table" } else { "those of the table" };
    let radius = short(compared.radius_mm, 3);
    format!(
        "(v − w)/w of the fast form v = √(8 h r R/(R + r)), w exact, without sign; cutter radius r = {radius} mm; the points are {points}"
    )
}

fn table(comparison: &Comparison) -> String {
    let mut out = format!("step-over of a ball of radius {} mm [mm]\n\n", short(comparison.cutter_radius_mm, 6));
    let columns = ["curvature", "scallop", "exact", "fast", "off by", "flat", "off by"];
    let mut line = |cells: [String; 7]| {
        let [curvature, rest @ ..] = cells;
        let _ = write!(out, "  {curvature:>16}");
        for cell in rest {
            let _ = write!(out, "  {cell:>9}");
        }
        out.push('\n');
    };
    line(columns.map(str::to_owned));
    for row in &comparison.rows {
        let curvature = match row.curvature_radius_mm {
            radius if radius.is_infinite() => "flat".to_owned(),
            radius => format!("{} {}", if radius > 0.0 { "convex" } else { "concave" }, short(radius, 6)),
        };
        line([
            curvature,
            short(row.scallop_mm, 4),
            significant(row.exact_mm, 5),
            significant(row.fast_mm, 5),
            off(row.error_percent),
            significant(row.flat_mm, 5),
            off(row.flat_error_percent),
        ]);
    }
    out.push('\n');
    out
}

/// Three digits of a small share, one decimal of a large one.
fn off(share: f64) -> String {
    if (1e-3..10.0).contains(&share) { format!("{} %", significant(share, 4)) } else { format!("{} %", percent(share)) }
}
