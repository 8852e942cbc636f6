//! What plots show of runs, loops, measurements and paths that are out of the ordinary: an outlier, a lock-up, an unstable loop, a long
//! run, a move that is not there, a character without a glyph.

use super::convergence::Convergence;
use super::curve::Frame;
use super::data::{PlotSample, RunData, RunMetadata};
use super::figure::Figure;
use super::loops::drawn;
use super::marks::{Anchor, Mark, TextFormat};
use super::part_data::{DeviationPicture, DeviationSubplot, MoveKind, PathMove, PathPicture};
use super::plot_kind::PlotKind;
use super::plots::{bode, deviation, loop_step, nyquist, path_3d, response, rings, tune};
use super::runs;
use super::style::{Colour, RUN_COLOURS};
use crate::analysis::{DriveLoop, Linearized};
use crate::measure::{AxisResponse, Response, ResponsePoint};
use crate::optimize::Step;
use crate::scenario::Scenario;
use crate::sweep::{SweepPicture, SweepPlot};

fn texts(figure: &Figure) -> Vec<&str> {
    let text =
        |mark| if let &Mark::TextFormat(TextFormat { ref text, .. }) = mark { Some(text.as_str()) } else { None };
    figure.marks.iter().filter_map(text).collect()
}

fn says(figure: &Figure, wanted: &str) -> bool {
    texts(figure).iter().any(|text| text.contains(wanted))
}

/// Numbers beside the axes, those of the side where `side`.
fn ticks(figure: &Figure, side: bool) -> Vec<f64> {
    let wanted = if side { Anchor::Right } else { Anchor::Middle };
    let number = |text: &TextFormat| text.text.replace('−', "-").parse::<f64>().ok();
    let tick = |mark: &Mark| match mark {
        Mark::TextFormat(text) if text.anchor == wanted && !text.upwards => number(text),
        _ => None,
    };
    figure.marks.iter().filter_map(tick).collect()
}

fn lines(figure: &Figure, colour: Colour) -> impl Iterator<Item = &Vec<(f64, f64)>> {
    figure.marks.iter().filter_map(move |mark| match mark {
        Mark::Line { points, colour: own, .. } if *own == colour => Some(points),
        _ => None,
    })
}

#[test]
fn regression_one_point_far_below_does_not_flatten_a_response() {
    let point = |k: u32| ResponsePoint {
        frequency_hz: 1.1_f64.powf(f64::from(k)),
        magnitude_db: if k == 50 { -48.0 } else { 0.2 * f64::from(k % 30) },
        phase_deg: if k == 50 { 158.0 } else { -3.0 * f64::from(k) },
        model_db: Some(0.0),
        model_deg: Some(-3.0 * f64::from(k)),
        amplitude_um: 1.0,
        saturated: false,
    };
    let axis = AxisResponse {
        axis: "y".to_owned(),
        bandwidth_hz: None,
        bandwidth_last_hz: None,
        model_bandwidth_last_hz: None,
        model_bandwidth_hz: None,
        peak_db: 0.0,
        peak_hz: 1.0,
        model_deviation_db: None,
        model_deviation_deg: None,
        warnings: Vec::new(),
        points: (0..60).map(point).collect(),
        linearized: Linearized::default(),
        model_curve: Vec::new(),
    };
    let measured = Response { scenario: "a".to_owned(), period_s: 1e-3, axes: vec![axis], warnings: Vec::new() };
    let figure = response::figure(&measured);
    // -48 dB are told of, and do not set the scale.
    assert!(says(&figure, "Y: −48 dB at"), "{:?}", texts(&figure));
    assert!(
        !ticks(&figure, true).contains(&-40.0) && ticks(&figure, true).contains(&-2.0),
        "{:?}",
        ticks(&figure, true)
    );
    // 158° beside a model at -150° are -202°.
    assert!(!ticks(&figure, true).iter().any(|tick| *tick >= 50.0) && ticks(&figure, true).contains(&-200.0));
    assert!(!says(&figure, "saturated"));
}

/// A run along X whose contouring error swings with this size.
fn run(name: &str, size_um: f64, locked_up: bool) -> RunData {
    let mut data = RunData::new(RunMetadata {
        name: name.to_owned(),
        period_s: 1e-3,
        desired_path_mm: vec![[0.0, 0.0], [100.0, 0.0]],
        locked_up,
        ..RunMetadata::default()
    });
    for k in 0..1000_u32 {
        let x = 0.1 * f64::from(k);
        let error = size_um * (0.1 * x).sin();
        data.push(&PlotSample {
            time_s: 1e-3 * f64::from(k),
            command_mm: [x, 0.0, 0.0],
            actual_mm: [x, 1e-3 * error, 0.0],
            nearest_mm: [x, 0.0, 0.0],
            contour_error_um: error,
            ..PlotSample::default()
        });
    }
    data
}

#[test]
fn regression_a_locked_up_run_does_not_cover_a_comparison() {
    let runs = [run("held", 30.0, false), run("lost", 2e5, true)];
    let contour = runs::figure(&runs, PlotKind::Contour);
    assert!(ticks(&contour, true).iter().all(|tick| tick.abs() <= 60.0), "{:?}", ticks(&contour, true));
    assert!(says(&contour, "lost (max") && says(&contour, "; locked up, off scale"), "{:?}", texts(&contour));
    assert!(says(&contour, "lost: locked up"), "{:?}", texts(&contour));
    // The one that holds is as high as alone.
    let height = |figure: &Figure| {
        let ys = || lines(figure, RUN_COLOURS[0]).filter(|points| points.len() > 20).flatten().map(|p| p.1);
        ys().fold(0.0, f64::max) - ys().fold(f64::MAX, f64::min)
    };
    let alone = runs::figure(&runs[..1], PlotKind::Contour);
    assert!(height(&contour) > 0.9 * height(&alone), "{} of {}", height(&contour), height(&alone));

    let path = runs::figure(&runs, PlotKind::Path);
    assert!(says(&path, "held: error × 100") && says(&path, "lost: actual path; locked up, off scale"));
    assert!(ticks(&path, true).iter().all(|tick| tick.abs() <= 50.0), "{:?}", ticks(&path, true));
    // Alone, and beside its like, it sets the scale.
    for runs in [&runs[1..], &[runs[1].clone(), run("too", 1e5, true)]] {
        let figure = runs::figure(runs, PlotKind::Contour);
        assert!(says(&figure, "10³") && !says(&figure, "off scale"), "{:?}", texts(&figure));
    }
}

/// The loops of alpha, the integral gain of X this many times as large.
fn loops(times: f64) -> Vec<DriveLoop> {
    let mut scenario = Scenario::builtin("alpha").unwrap();
    scenario.axes[0].pdff.kiv_1_s *= times;
    [0, 1].map(|i| DriveLoop::new(&scenario.axes[i], &scenario.drives[i], &scenario.settings).unwrap()).into()
}

#[test]
fn regression_the_neighbourhood_of_minus_one_fills_the_nyquist_plot() {
    for times in [0.01, 0.5, 1.0, 2.0, 3.0, 100.0] {
        let loops = loops(times);
        let figure = nyquist::figure("alpha", &drawn(&loops));
        let (x, y) = (ticks(&figure, false), ticks(&figure, true));
        for wanted in [-1.5, -1.0, -0.5, 0.0] {
            assert!(x.contains(&wanted), "{times}: {x:?}");
        }
        assert!(x.iter().all(|x| (-3.6..=1.5).contains(x)), "{times}: {x:?}");
        assert!(y.contains(&-1.0) && y.contains(&1.0), "{times}: {y:?}");
        assert!(texts(&figure).contains(&"−1"), "{times}");
    }
    let figure = nyquist::figure("alpha", &drawn(&loops(100.0)));
    assert!(says(&figure, "X: unstable, curve outside of this window"), "{:?}", texts(&figure));
}

#[test]
fn regression_labels_lie_where_nothing_is_drawn() {
    let loops = loops(1.0);
    let drawn = drawn(&loops);
    for (name, figure) in [
        ("nyquist", nyquist::figure("alpha", &drawn)),
        ("bode", bode::figure("alpha", &drawn)),
        ("step", loop_step::figure("alpha", &drawn)),
    ] {
        let is_label = |text: &&TextFormat| text.text.starts_with("X: ") || text.text.starts_with("Y: ");
        let labels: Vec<&TextFormat> = figure
            .marks
            .iter()
            .filter_map(|mark| if let Mark::TextFormat(text) = mark { Some(text) } else { None })
            // Not the legend's.
            .filter(|text| is_label(text) && text.em_px < 13.0)
            .collect();
        assert!(name == "step" || labels.len() >= 4, "{name}: {labels:?}");
        for colour in &RUN_COLOURS[..2] {
            for points in lines(&figure, *colour) {
                for label in &labels {
                    let Frame { left, top, right, bottom } = label.frame();
                    let inner = Frame { left, top: top + 2.0, right, bottom: bottom - 2.0 };
                    let hit = points.windows(2).any(|p| inner.clip(p[0], p[1]).is_some());
                    assert!(!hit, "{name}: a curve runs through `{}`", label.text);
                }
            }
        }
    }
}

#[test]
fn regression_an_unstable_step_response_diverges_and_does_not_cycle() {
    let loops = loops(200.0);
    let figure = loop_step::figure("alpha", &drawn(&loops));
    assert!(says(&figure, "X: unstable"));
    let said = texts(&figure).iter().filter(|text| text.starts_with("diverges, leaves the plot after")).count();
    assert_eq!(said, 2, "{:?}", texts(&figure));
    // It leaves once and does not come back: the way out is short beside the settling of Y.
    let farthest = lines(&figure, RUN_COLOURS[0]).flatten().map(|p| p.0).fold(0.0, f64::max);
    assert!(farthest < 400.0, "{farthest}");
    assert!(says(&figure, "settled in"));
}

#[test]
fn regression_percentiles_do_not_read_alike() {
    let values: Vec<f64> = (0..1000).map(|i| 27.026 + 1e-6 * f64::from(i)).collect();
    let percentiles = [(5, values[50]), (50, values[500]), (95, values[950]), (99, values[990])].to_vec();
    let picture = SweepPicture {
        name: "alpha".to_owned(),
        caption: "1000 random points".to_owned(),
        metric: "max contouring error",
        unit: "µm",
        over: vec!["kpp".to_owned()],
        plot: SweepPlot::Histogram { values, percentiles },
    };
    let figure = super::plots::sweep::histogram::figure(&picture);
    for wanted in ["5 %: 27.02605 µm", "50 %: 27.0265 µm", "95 %: 27.02695 µm", "99 %: 27.02699 µm"] {
        assert!(says(&figure, wanted), "{wanted}: {:?}", texts(&figure));
    }
}

#[test]
fn regression_the_legend_of_a_tuning_names_every_start() {
    let step = |evaluations: usize, objective: f64, violation: f64| Step {
        evaluations,
        objective,
        violation,
        iteration: evaluations,
        point: vec![1.0],
        mesh: 1.0,
    };
    let starts: Vec<Vec<Step>> =
        (1..=4).map(|i| vec![step(1, 100.0 * f64::from(i), 0.0), step(40, 30.0 + f64::from(i), 0.0)]).collect();
    let outside = vec![step(1, 50.0, 0.3)];
    let mut searches: Vec<(Option<usize>, &[Step])> =
        starts[..3].iter().enumerate().map(|(i, steps)| (Some(i), steps.as_slice())).collect();
    searches.push((Some(3), &outside));
    searches.push((None, &starts[3]));
    let convergence = Convergence { name: "alpha", subtitle: "", unit: "µm", searches };
    let figure = tune::figure(&convergence);
    for wanted in [
        "start 1, the scenario's own gains: 31 µm",
        "start 2: 32 µm",
        "start 3: 33 µm",
        "start 4: keeps not every constraint",
        "polish of the best: 34 µm",
    ] {
        assert!(says(&figure, wanted), "{wanted}: {:?}", texts(&figure));
    }
}

#[test]
fn regression_a_long_run_is_no_solid_bar() {
    let mut data = RunData::new(RunMetadata { period_s: 1e-3, ..RunMetadata::default() });
    for k in 0..300_000_u32 {
        // 35 Hz for five minutes, and one spike.
        let time_s = 1e-3 * f64::from(k);
        let voltage = if k == 123_456 { 4.0 } else { 2.0 * (220.0 * time_s).sin() };
        data.push(&PlotSample { time_s, voltage_v: [voltage, 0.0, 0.0], ..PlotSample::default() });
    }
    let figure = runs::figure(&[data], PlotKind::Voltage);
    let (r, g, b) = RUN_COLOURS[0];
    let pale = [r, g, b].map(|c| 255 - (255 - c) / 4);
    let bands: Vec<_> = figure
        .marks
        .iter()
        .filter_map(|mark| match mark {
            Mark::Area { points, colour } if [colour.0, colour.1, colour.2] == pale => Some(points),
            _ => None,
        })
        .collect();
    assert_eq!(bands.len(), 1);
    let highest = bands[0].iter().map(|p| p.1).fold(f64::MAX, f64::min);
    // The strokes do not fill the band: the two borders are all there is.
    for points in lines(&figure, RUN_COLOURS[0]).filter(|points| points.len() > 2) {
        assert!(points.len() < 900, "{}", points.len());
        let travel: f64 = points.windows(2).map(|p| (p[1].1 - p[0].1).abs()).sum();
        assert!(travel < 3.0 * 700.0, "{travel} px up and down");
    }
    // The spike is in the picture.
    let usual = bands[0].get(10).map_or(0.0, |p| p.1);
    assert!(highest < usual - 30.0, "{highest} {usual}");
}

#[test]
fn regression_legends_list_only_the_moves_that_are_drawn() {
    let part = |kind, points_mm: &[[f64; 3]]| PathMove { kind, points_mm: points_mm.to_vec() };
    let ring = part(MoveKind::Ring(0), &[[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [9.0, 9.0, 1.0]]);
    let plunge = part(MoveKind::Rapid, &[[0.0, 0.0, 5.0], [0.0, 0.0, 0.0]]);
    let picture = |moves| PathPicture { moves, ..PathPicture::default() };
    let plunged = picture(vec![plunge, ring.clone()]);
    // From above a plunge is a point, from the side it is a line.
    assert!(!says(&rings::figure(&plunged), "rapid moves") && says(&path_3d::figure(&plunged), "rapid moves"));
    assert!(!says(&rings::figure(&plunged), "from ring to ring"));
    assert!(says(&rings::figure(&picture(vec![ring])), "start"));
    let nothing = picture(vec![part(MoveKind::Rapid, &[]), part(MoveKind::Link, &[[1.0; 3]])]);
    assert!(!says(&rings::figure(&nothing), "rapid moves") && !says(&rings::figure(&nothing), "from ring to ring"));
    assert!(!says(&rings::figure(&picture(Vec::new())), "start"));

    for (value, excess, gouge) in [(3.0, true, false), (-3.0, false, true), (0.0, false, false)] {
        let values = [value; 4];
        let map = DeviationSubplot {
            title: "as cut",
            caption: "",
            low_mm: [0.0; 2],
            cell_mm: 1.0,
            columns: 2,
            values_um: &values,
        };
        let (gouge_limit_um, excess_limit_um) = (None, None);
        let picture = DeviationPicture { name: "p", caption: "", maps: vec![map], gouge_limit_um, excess_limit_um };
        let figure = deviation::figure(&picture);
        assert_eq!((says(&figure, "largest excess"), says(&figure, "deepest gouge")), (excess, gouge), "{value}");
    }
    // Nor a run without samples.
    let empty = RunData::new(RunMetadata { desired_path_mm: vec![[0.0; 2], [1.0; 2]], ..RunMetadata::default() });
    assert!(!says(&runs::figure(&[empty], PlotKind::Path), "actual path"));
}

#[test]
fn regression_a_character_without_a_glyph_leaves_a_box_in_a_png() {
    let png = |text: &str, upwards| {
        let mut figure = Figure::default();
        let line = TextFormat::new((600.0, 400.0), text, 20.0, Anchor::Middle);
        figure.text(TextFormat { upwards, ..line });
        figure.png().unwrap()
    };
    for upwards in [false, true] {
        assert!(png("中", upwards) != png(" ", upwards) && png("中", upwards) != png("国", upwards));
        assert!(png("a🙂", upwards) != png("a", upwards));
        assert!(png("Škoda", upwards) != png("  koda", upwards));
    }
}
