//! That figures are laid out as a person would: nothing off the figure, no text on another.

use std::sync::OnceLock;

use super::curve::Frame;
use super::figure::{Figure, HEIGHT_PX, WIDTH_PX};
use super::marks::{Mark, TextFormat};
use super::{PlotKind, PlotSample, RunData, RunMetadata, runs};
use crate::feedrate::{Motion, Profile, optimize_n_c};
use crate::limits::LimitCheck;
use crate::optimize::Step;

fn search() -> &'static [Step] {
    static SEARCH: OnceLock<Vec<Step>> = OnceLock::new();
    SEARCH.get_or_init(|| optimize_n_c(100.0, 0.1).map(|outcome| outcome.history).unwrap_or_default())
}

/// A run whose signals have these sizes.
fn run(name: &str, samples: u32, duration_s: f64, size: f64) -> RunData {
    let limit = |name: &str, limit| LimitCheck { name: name.to_owned(), value: limit, limit, kept: true };
    let motion = Motion::plan(100.0, 100.0, Profile::Quintic { phase_s: 0.1 }).ok();
    let mut data = RunData::new(RunMetadata {
        name: name.to_owned(),
        period_s: 1e-3,
        three_axes: size >= 1.0,
        voltage_limit_v: [5.0, 10.0 * size, 5.0],
        limits: vec![
            limit("contour_error_um", 30.0 * size),
            limit("accel_mm_s2", 2000.0),
            limit("jerk_mm_s3", 50000.0 * size),
        ],
        desired_path_mm: (0..100).map(f64::from).map(|i| [(0.06 * i).cos() * size, (0.12 * i).sin() * 50.0]).collect(),
        nodal_points_mm: vec![[size, 0.0]],
        closed: true,
        n_c_search: Some(search().to_vec()),
        comparison: motion.map(|motion| ("plain quintic".to_owned(), motion)),
        ..RunMetadata::default()
    });
    for k in 0..samples {
        let share = f64::from(k) / f64::from(samples);
        let wave = (20.0 * share).sin();
        data.push(&PlotSample {
            time_s: duration_s * share,
            s_mm: 100.0 * share,
            feed_mm_s: 100.0 * (10.0 * share).min(1.0),
            accel_mm_s2: 1900.0 * wave,
            jerk_mm_s3: 49000.0 * size * wave,
            command_mm: [size * share, wave, 0.5 * wave],
            actual_mm: [size * share + 0.02 * size, wave, 0.5 * wave],
            nearest_mm: [size * share, wave, 0.5 * wave],
            voltage_v: [4.5 * wave, -9.0 * size * wave, wave],
            contour_error_um: 29.0 * size * wave,
            tracking_error_um: 100.0,
            rapid: k % 100 < 20,
        });
    }
    data
}

fn cases() -> Vec<Vec<RunData>> {
    let mut cases = Vec::new();
    for size in [1e-9, 1e-3, 1.0, 40.0, 1e6, 1e12, 1e90] {
        for (samples, duration_s) in [(0, 0.0), (1, 0.0), (2, 1e-3), (1000, 1.2), (1000, 36_000.0), (1000, 1e-6)] {
            cases.push(vec![run("alpha", samples, duration_s, size)]);
        }
    }
    for count in [2, 3, 7, 40] {
        let name =
            |i| format!("{} number {i}", if i % 3 == 0 { "a run with a rather long name, tuned" } else { "run" });
        cases.push((0..count).map(|i| run(&name(i), 300, 1.0 + f64::from(i) * 0.1, 1.0 + f64::from(i))).collect());
    }
    let mut warned = run("locked", 500, 1.0, 3.0);
    warned.metadata_mut().warning = Some("axis x locked up: saturated since 0.2 s and not recovering ".repeat(5));
    cases.push(vec![warned.clone()]);
    cases.push(vec![warned.clone(), warned]);
    cases
}

/// Every plot of every case, drawn once.
fn each(check: impl Fn(&str, &Figure)) {
    static FIGURES: OnceLock<Vec<(String, Figure)>> = OnceLock::new();
    let figures = FIGURES.get_or_init(|| {
        let mut figures = Vec::new();
        for (i, data) in cases().iter().enumerate() {
            let draw = |kind| (format!("case {i}, {kind:?} of {} runs", data.len()), runs::figure(data, kind));
            figures.extend(PlotKind::ALL.map(draw));
        }
        figures
    });
    for (name, figure) in figures {
        check(name, figure);
    }
}

fn texts(figure: &Figure) -> Vec<&TextFormat> {
    figure.marks.iter().filter_map(|mark| if let Mark::TextFormat(text) = mark { Some(text) } else { None }).collect()
}

#[test]
fn no_text_lies_on_another_or_leaves_the_figure() {
    let page = Frame { left: 4.0, top: 4.0, right: WIDTH_PX - 4.0, bottom: HEIGHT_PX - 4.0 };
    each(|name, figure| {
        let texts = texts(figure);
        assert!(texts.len() > 5, "{name}");
        for (i, a) in texts.iter().enumerate() {
            assert!(a.frame().is_within(&page), "{name}: `{}` leaves the figure: {:?}", a.text, a.frame());
            for b in &texts[..i] {
                assert!(!a.frame().overlaps(&b.frame()), "{name}: `{}` lies on `{}`", a.text, b.text);
            }
        }
    });
}

#[test]
fn every_mark_lies_on_the_figure() {
    each(|name, figure| {
        for mark in &figure.marks {
            let points = match mark {
                Mark::Line { points, .. } | Mark::Area { points, .. } => points.clone(),
                Mark::Dot { at, .. } => vec![*at],
                Mark::Image(image) => {
                    vec![(image.frame.left, image.frame.top), (image.frame.right, image.frame.bottom)]
                }
                Mark::TextFormat(_) => continue,
            };
            for (x, y) in points {
                let on = (-0.01..=WIDTH_PX + 0.01).contains(&x) && (-0.01..=HEIGHT_PX + 0.01).contains(&y);
                assert!(on, "{name}: ({x}, {y})");
            }
        }
    });
}

#[test]
fn every_axis_has_at_least_two_ticks_and_no_label_twice_in_a_row() {
    each(|name, figure| {
        let texts = texts(figure);
        // Labels below a subplot share their height.
        for a in &texts {
            let row: Vec<&str> = texts
                .iter()
                .filter(|b| b.at.1 == a.at.1 && b.em_px == a.em_px && b.anchor == a.anchor && !b.upwards)
                .map(|b| b.text.as_str())
                .collect();
            let equal = row.windows(2).any(|pair| pair[0] == pair[1] && pair[0].parse::<f64>().is_ok());
            assert!(!equal, "{name}: {row:?}");
        }
        let titles = texts.iter().filter(|text| text.upwards).count();
        // In space the titles of the axes stand level.
        assert!(name.contains("Space") || titles > 0 && texts.len() >= 4 * titles, "{name}");
    });
}
