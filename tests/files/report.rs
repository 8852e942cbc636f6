//! Plots: what they show, that they stand any input, and that the same runs give the same bytes.

use std::collections::BTreeSet;
use std::fs;

use nalgebra::Vector2;
use servosim::feedrate::{AxisLimits, Motion, Profile, optimize_n_c};
use servosim::limits::{LimitCheck, Limits};
use servosim::optimize::Step;
use servosim::path::{Circle, Cursor, Line, Path};
use servosim::report::{
    AxisLoads, Format, MAX_BUCKETS, PlotKind, PlotSample, ReportError, RunData, RunMetadata, draw, write_all,
};
use servosim::servo::{AxisParameters, Drive, LoopSettings, Pdff, Plant};
use servosim::simulation::Simulation;

/// The axes of the letter alpha, their position gains scaled.
fn axes(scale: f64) -> [AxisParameters; 2] {
    [(83.0089, 0.19936, 1.19, 252.8), (50.4977, 0.15641, 1.53, 253.2)].map(|(gain, time_constant, kpv, kiv)| {
        AxisParameters {
            plant: Plant { gain_rad_s_v: gain, time_constant_s: time_constant },
            drive: Drive::default(),
            pdff: Pdff { kpp_rad_s_mm: 97.38 * scale, kpv_nm_s_rad: kpv, kiv_1_s: kiv, kpf_rad_mm: 0.8, kvf: 0.85 },
        }
    })
}

fn metadata(name: &str, path: &dyn Path<2>, feed_mm_s: f64) -> RunMetadata {
    let length = path.length_mm();
    let mut cursor = Cursor::default();
    RunMetadata {
        name: name.to_owned(),
        period_s: 1e-3,
        voltage_limit_v: [5.0; 3],
        limits: vec![
            LimitCheck { name: "contour_error_um".to_owned(), value: 13.1, limit: 30.0, kept: true },
            LimitCheck { name: "accel_mm_s2".to_owned(), value: 1777.7, limit: 2000.0, kept: true },
            LimitCheck { name: "jerk_mm_s3".to_owned(), value: 49127.0, limit: 50000.0, kept: true },
        ],
        desired_path_mm: (0..=400)
            .map(|i| path.point_mm(length * f64::from(i) / 400.0, &mut cursor))
            .map(|p| [p[0], p[1]])
            .collect(),
        closed: path.is_closed(),
        n_c: Some(8.12),
        n_c_search: Some(optimize_n_c(feed_mm_s, 0.1).unwrap().history),
        comparison: Some((
            "plain quintic".to_owned(),
            Motion::plan(length, feed_mm_s, Profile::Quintic { phase_s: 0.1 }).unwrap(),
        )),
        ..RunMetadata::default()
    }
}

fn simulated(name: &str, path: &dyn Path<2>, feed_mm_s: f64, profile: Profile, scale: f64) -> RunData {
    let motion = Motion::plan(path.length_mm(), feed_mm_s, profile).unwrap();
    let mut data = RunData::new(metadata(name, path, feed_mm_s));
    let simulation = Simulation::new(path, &motion, axes(scale), LoopSettings::default()).unwrap();
    simulation.run(&Limits::default(), None, &mut [&mut data]).unwrap();
    data
}

fn circle() -> Circle {
    Circle::new(Vector2::new(20.0, 10.0), 16.0, 0.7, false).unwrap()
}

const EXPONENTIAL: Profile = Profile::Exponential { phase_s: 0.1, n_c: 8.12 };

fn one() -> RunData {
    simulated("circle", &circle(), 100.0, EXPONENTIAL, 1.0)
}

/// A run that there is something to draw of in every plot.
fn with_everything(run: &mut RunData) {
    let limits = AxisLimits { velocity_mm_s: [100.0; 2], acceleration_mm_s2: [2e3, 1e3], jerk_mm_s3: [5e4, 1e9] };
    let motion = Motion::plan(circle().length_mm(), 100.0, EXPONENTIAL).unwrap();
    run.metadata_mut().three_axes = true;
    run.metadata_mut().axis_loads = Some(AxisLoads::of(&circle(), &motion, limits));
}

fn svg(runs: &[RunData], kind: PlotKind) -> String {
    String::from_utf8(draw(runs, kind, Format::Svg).unwrap()).unwrap()
}

/// What the text elements of an SVG say. Checks on the way that the document is well-formed: tags closed in their order,
/// attributes quoted, no stray `<` or `&`, no number that is none.
fn texts(svg: &str) -> Vec<String> {
    let (mut open, mut said, mut rest) = (Vec::new(), Vec::new(), svg);
    while let Some(start) = rest.find('<') {
        let text = &rest[..start];
        assert!(!text.contains('>'), "{text}");
        if open.last() == Some(&"text") && !text.trim().is_empty() {
            said.push(unescaped(text.trim()));
        } else {
            assert!(text.trim().is_empty(), "text outside of a text element: {text}");
        }
        let end = rest[start..].find('>').expect("a tag has no end") + start;
        let tag = &rest[start + 1..end];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else {
            let name = tag.split([' ', '/']).next().unwrap();
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            for (i, part) in tag.split('"').enumerate() {
                let outside = i % 2 == 0;
                assert!(!outside || part.trim_matches([' ', '/']).ends_with('=') || !part.contains('='), "{tag}");
                unescaped(part);
            }
            assert!(!tag.contains("NaN") && !tag.contains("inf"), "{tag}");
            if !tag.ends_with('/') {
                open.push(name);
            }
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty() && rest.trim().is_empty());
    assert!(svg.starts_with("<svg width=\"1200\" height=\"800\" ") && svg.contains(" viewBox=\"0 0 12000 8000\""));
    said
}

fn unescaped(text: &str) -> String {
    assert!(text.chars().all(|c| !c.is_control() || c == '\n'), "control character in {text:?}");
    let mut out = String::new();
    for (i, part) in text.split('&').enumerate() {
        if i == 0 {
            out.push_str(part);
            continue;
        }
        let (entity, after) = part.split_once(';').expect("a stray &");
        out.push(match entity {
            "lt" => '<',
            "gt" => '>',
            "amp" => '&',
            "quot" => '"',
            "apos" => '\'',
            _ => panic!("unknown entity {entity}"),
        });
        out.push_str(after);
    }
    out
}

#[track_caller]
fn assert_says(said: &[String], wanted: &[&str]) {
    for wanted in wanted {
        assert!(said.iter().any(|text| text == wanted), "`{wanted}` is not among {said:#?}");
    }
}

#[test]
fn axes_limits_and_curves_are_labelled_with_units() {
    let runs = [one()];
    let said = texts(&svg(&runs, PlotKind::Contour));
    assert_says(
        &said,
        &["circle: contouring error", "contouring error [µm]", "time [s]", "limit +30 µm", "limit −30 µm"],
    );
    // The circle's error is 13.142 µm with these gains; the marker and the line below the title say so.
    assert_says(&said, &["max 13.14 µm"]);
    assert!(said.iter().any(|t| t.starts_with("Max 13.14 µm at ") && t.ends_with("limit 30 µm kept")), "{said:#?}");

    let said = texts(&svg(&runs, PlotKind::Path));
    assert_says(&said, &["x [mm]", "y [mm]", "desired path", "actual path", "error × 100", "start"]);

    let said = texts(&svg(&runs, PlotKind::Feedrate));
    assert_says(&said, &["feed [mm/s]", "acceleration [mm/s²]", "jerk [mm/s³]", "time [s]", "circle", "plain quintic"]);
    assert_says(&said, &["limit ±2000 mm/s²", "limit ±50\u{a0}000 mm/s³", "acceleration phase"]);
    assert!(said.iter().any(|t| t.contains("jerk 49\u{a0}127 mm/s³ (−14.9 % against plain quintic: 57\u{a0}735)")));

    let said = texts(&svg(&runs, PlotKind::Voltage));
    assert_says(&said, &["X voltage [V]", "Y voltage [V]", "time [s]", "saturation ±5 V"]);

    let said = texts(&svg(&runs, PlotKind::Search));
    assert_says(&said, &["peak jerk [mm/s³]", "best n_c", "mesh size", "evaluations", "iteration", "10⁻⁶"]);
    assert!(said.iter().any(|t| t.starts_with("Best n_c = 8.35")), "{said:#?}");
}

#[test]
fn two_runs_share_the_plots_and_equal_names_are_told_apart() {
    let other = simulated("circle", &circle(), 100.0, Profile::JerkLimited { accel_mm_s2: 2e3, jerk_mm_s3: 5e4 }, 1.4);
    let mut runs = [one(), other];
    runs.iter_mut().for_each(with_everything);
    for kind in PlotKind::ALL {
        let document = svg(&runs, kind);
        let said = texts(&document);
        assert!(said.iter().any(|t| t.starts_with("circle (2)")), "{kind:?}: {said:#?}");
        assert!(document.contains("#0072B2") && document.contains("#D55E00"), "a colour a run: {kind:?}");
    }
    assert_says(&texts(&svg(&runs, PlotKind::Path)), &["circle: error × 100", "circle (2): error × 100"]);
}

#[test]
fn a_name_that_is_taken_is_not_given_again() {
    let named = |name: &str| RunData::new(RunMetadata { name: name.to_owned(), ..RunMetadata::default() });
    let runs = [named("a (2)"), named("a"), named("a"), named(""), named("")];
    let said = texts(&svg(&runs, PlotKind::Feedrate));
    let entries: BTreeSet<&str> =
        said.iter().filter_map(|t| t.split_once(" (peak jerk")).map(|(name, _)| name).collect();
    assert_eq!(entries, BTreeSet::from(["a (2)", "a", "a (3)", "run", "run (2)"]));
}

#[test]
fn names_and_warnings_may_hold_any_character() {
    let mut data = one();
    with_everything(&mut data);
    data.metadata_mut().name = "<b>&\"'\u{1b}\0 x\u{fffe} 日本 \u{202e}".to_owned() + &"long ".repeat(200);
    data.metadata_mut().warning = Some("locked up: a < b & c".to_owned());
    data.metadata_mut().comparison.as_mut().unwrap().0 = "]]>\u{7}".to_owned();
    for runs in [vec![data.clone()], vec![data.clone(), data.clone(), data]] {
        for kind in PlotKind::ALL {
            let said = texts(&svg(&runs, kind));
            assert!(said.iter().any(|t| t.to_lowercase().contains("locked up: a < b & c")), "{said:#?}");
        }
    }
}

#[test]
fn the_same_runs_give_the_same_bytes() {
    let (mut first, mut second) = (one(), one());
    with_everything(&mut first);
    with_everything(&mut second);
    for kind in PlotKind::ALL {
        let draw = |data: &RunData| draw(std::slice::from_ref(data), kind, Format::Svg).unwrap();
        assert!(draw(&first) == draw(&second), "{kind:?}");
    }
    let png = |data: &RunData| draw(std::slice::from_ref(data), PlotKind::Path, Format::Png).unwrap();
    assert!(png(&first) == png(&second));
}

#[test]
fn a_png_is_one_and_shows_the_curves() {
    let bytes = draw(&[one()], PlotKind::Contour, Format::Png).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    let mut reader = png::Decoder::new(bytes.as_slice()).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height, info.color_type), (2400, 1600, png::ColorType::Rgb));
    let count = |colour: [u8; 3]| pixels.chunks_exact(3).filter(|pixel| **pixel == colour).count();
    assert!(count([255; 3]) > 3_000_000, "the ground is white");
    assert!(count([0, 114, 178]) > 3000, "the curve is blue: {}", count([0, 114, 178]));
    assert!(count([34; 3]) > 1000, "text is dark: {}", count([34; 3]));
}

/// A sample of a plausible run, every signal different.
fn sample(k: u64) -> PlotSample {
    let t = k as f64 * 1e-3;
    PlotSample {
        time_s: t,
        s_mm: 10.0 * t,
        feed_mm_s: 10.0 + (3.0 * t).sin(),
        accel_mm_s2: 3.0 * (3.0 * t).cos(),
        jerk_mm_s3: -9.0 * (3.0 * t).sin(),
        command_mm: [t.cos(), t.sin(), 0.0],
        actual_mm: [1.01 * t.cos(), 1.02 * t.sin(), 0.0],
        nearest_mm: [1.001 * t.cos(), 1.002 * t.sin(), 0.0],
        voltage_v: [(5.0 * t).sin(), (7.0 * t).cos(), (9.0 * t).cos()],
        contour_error_um: (11.0 * t).sin(),
        tracking_error_um: 2.0 + (13.0 * t).sin(),
        rapid: false,
    }
}

#[test]
fn up_to_the_capacity_every_sample_is_kept() {
    let mut data = RunData::new(RunMetadata::default());
    let samples: Vec<PlotSample> = (0..MAX_BUCKETS as u64).map(sample).collect();
    for s in &samples {
        data.push(s);
    }
    assert!(data.samples() == samples);
}

/// Writes one signal of a sample.
type Setter = fn(&mut PlotSample, f64);
/// Reads it.
type Getter = fn(&PlotSample) -> f64;

const SIGNALS: [(&str, Setter, Getter); 18] = [
    ("s", |s, v| s.s_mm = v, |s| s.s_mm),
    ("feed", |s, v| s.feed_mm_s = v, |s| s.feed_mm_s),
    ("accel", |s, v| s.accel_mm_s2 = v, |s| s.accel_mm_s2),
    ("jerk", |s, v| s.jerk_mm_s3 = v, |s| s.jerk_mm_s3),
    ("command x", |s, v| s.command_mm[0] = v, |s| s.command_mm[0]),
    ("command y", |s, v| s.command_mm[1] = v, |s| s.command_mm[1]),
    ("actual x", |s, v| s.actual_mm[0] = v, |s| s.actual_mm[0]),
    ("actual y", |s, v| s.actual_mm[1] = v, |s| s.actual_mm[1]),
    ("nearest x", |s, v| s.nearest_mm[0] = v, |s| s.nearest_mm[0]),
    ("nearest y", |s, v| s.nearest_mm[1] = v, |s| s.nearest_mm[1]),
    ("voltage x", |s, v| s.voltage_v[0] = v, |s| s.voltage_v[0]),
    ("voltage y", |s, v| s.voltage_v[1] = v, |s| s.voltage_v[1]),
    ("contour", |s, v| s.contour_error_um = v, |s| s.contour_error_um),
    ("tracking", |s, v| s.tracking_error_um = v, |s| s.tracking_error_um),
    ("voltage z", |s, v| s.voltage_v[2] = v, |s| s.voltage_v[2]),
    ("command z", |s, v| s.command_mm[2] = v, |s| s.command_mm[2]),
    ("actual z", |s, v| s.actual_mm[2] = v, |s| s.actual_mm[2]),
    ("nearest z", |s, v| s.nearest_mm[2] = v, |s| s.nearest_mm[2]),
];

#[test]
fn no_peak_of_any_signal_is_lost_in_merging() {
    // Long enough for four rounds of merging; a peak and, right after it, a dip for every signal, far apart from the next.
    let count = 100_003_u64;
    let mut data = RunData::new(RunMetadata::default());
    for k in 0..count {
        let mut s = sample(k);
        for (i, (_, set, _)) in SIGNALS.iter().enumerate() {
            let at = 5_000 + 5_200 * i as u64;
            match k.checked_sub(at) {
                Some(0) => set(&mut s, 1e6 + i as f64),
                Some(1) => set(&mut s, -1e6 - i as f64),
                _ => {}
            }
        }
        data.push(&s);
    }
    let kept = data.samples();
    assert!(kept.len() < 15 * MAX_BUCKETS, "{}", kept.len());
    assert!(kept.is_sorted_by(|a, b| a.time_s < b.time_s), "in the order of time, each once");
    assert_eq!((kept.first(), kept.last()), (Some(&sample(0)), Some(&sample(count - 1))));
    for (i, (name, _, get)) in SIGNALS.iter().enumerate() {
        let high = kept.iter().position(|s| get(s) == 1e6 + i as f64);
        let low = kept.iter().position(|s| get(s) == -1e6 - i as f64);
        assert!(high.is_some() && low.is_some() && high < low, "{name}: {high:?} {low:?}");
    }
    // And it arrives in the plot.
    assert_says(&texts(&svg(&[data], PlotKind::Contour)), &["max 1\u{a0}000\u{a0}012 µm"]);
}

#[test]
fn memory_is_bounded_whatever_the_signals() {
    // Noise in all signals is the worst: each has its extremes elsewhere.
    let mut data = RunData::new(RunMetadata::default());
    let mut state = 1_u64;
    for k in 0..300_000_u64 {
        let mut s = PlotSample { time_s: k as f64, ..PlotSample::default() };
        for (_, set, _) in &SIGNALS {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            set(&mut s, (state >> 33) as f64);
        }
        data.push(&s);
    }
    assert!(data.samples().len() <= 30 * MAX_BUCKETS, "{}", data.samples().len());
}

#[test]
fn samples_that_are_not_finite_are_skipped_and_the_reader_is_told() {
    let mut data = RunData::new(RunMetadata::default());
    for (_, set, _) in &SIGNALS {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200] {
            let mut s = sample(1);
            set(&mut s, bad);
            data.push(&s);
        }
    }
    data.push(&PlotSample { time_s: f64::NAN, ..sample(1) });
    data.push(&sample(2));
    assert_eq!((data.skipped(), data.samples().len()), (4 * 18 + 1, 1));
    let said = texts(&svg(&[data], PlotKind::Voltage));
    assert!(said.iter().any(|t| t.starts_with("73 samples not drawn")), "{said:#?}");
}

/// Runs that have broken plots before, somewhere.
fn awkward() -> Vec<(&'static str, RunData)> {
    let with = |metadata: RunMetadata, samples: &[PlotSample]| {
        let mut data = RunData::new(metadata);
        for s in samples {
            data.push(s);
        }
        data
    };
    let full = metadata("awkward", &circle(), 100.0);
    let many = |change: &dyn Fn(u64, &mut PlotSample)| -> Vec<PlotSample> {
        (0..500)
            .map(|k| {
                let mut s = sample(k);
                change(k, &mut s);
                s
            })
            .collect()
    };
    let scaled = |by: f64| {
        many(&|_, s| {
            for (_, set, get) in &SIGNALS {
                set(s, by * get(s));
            }
        })
    };
    let steps = |objective: f64, mesh: f64, point: Vec<f64>| {
        let step =
            |iteration| Step { iteration, point: point.clone(), objective, violation: 0.0, mesh, evaluations: 1 };
        RunMetadata { n_c_search: Some((0..2).map(step).collect()), ..RunMetadata::default() }
    };
    let limited = |limit: f64| {
        let names = ["contour_error_um", "accel_mm_s2", "jerk_mm_s3"];
        let limits = names.map(|name| LimitCheck { name: name.to_owned(), value: 1.0, limit, kept: false }).to_vec();
        RunMetadata { limits, voltage_limit_v: [limit; 3], period_s: limit, ..full.clone() }
    };
    let points = |p: [[f64; 2]; 2]| RunMetadata { desired_path_mm: p.to_vec(), closed: true, ..full.clone() };
    vec![
        ("nothing", with(RunMetadata::default(), &[])),
        ("no samples", with(full.clone(), &[])),
        ("one sample", with(full.clone(), &[sample(0)])),
        ("one sample without metadata", with(RunMetadata::default(), &[PlotSample::default()])),
        ("two samples", with(full.clone(), &[sample(0), sample(1)])),
        ("two samples at one time", with(full.clone(), &[sample(3), sample(3)])),
        ("time running backwards", with(full.clone(), &[sample(9), sample(5), sample(7)])),
        ("constant", with(full.clone(), &many(&|k, s| *s = PlotSample { time_s: k as f64, ..sample(70) }))),
        ("zero", with(full.clone(), &many(&|k, s| *s = PlotSample { time_s: k as f64, ..PlotSample::default() }))),
        ("all at time zero", with(full.clone(), &many(&|_, s| s.time_s = 0.0))),
        ("huge", with(full.clone(), &scaled(1e98))),
        ("tiny", with(full.clone(), &scaled(1e-98))),
        ("smallest", with(full.clone(), &scaled(f64::MIN_POSITIVE))),
        (
            "constant and large, with a trace of noise",
            with(
                full.clone(),
                &many(&|k, s| {
                    for (_, set, _) in &SIGNALS {
                        set(s, 1e9 + 1e-7 * k as f64);
                    }
                }),
            ),
        ),
        ("long after zero", with(full.clone(), &many(&|_, s| s.time_s += 1e9))),
        ("years", with(full.clone(), &many(&|k, s| s.time_s = 1e9 * k as f64))),
        (
            "locked up",
            with(
                full.clone(),
                &many(&|k, s| {
                    let side = if (k / 20) % 2 == 0 { 5.0 } else { -5.0 };
                    s.voltage_v = [side, -side, 0.0];
                    s.actual_mm = [1e4 * (k as f64 * 0.1).sin(), side, 0.0];
                    s.contour_error_um = 1e7 * (k as f64 * 0.1).sin();
                }),
            ),
        ),
        ("path along x", with(points([[0.0, 5.0], [300.0, 5.0]]), &many(&|_, s| s.nearest_mm[1] = 5.0))),
        ("path along y", with(points([[-3.0, 0.0], [-3.0, 1e6]]), &[])),
        ("path far away", with(points([[1e6, 1e6], [1e6 + 1e-3, 1e6]]), &[])),
        ("path of one place", with(points([[7.0, 7.0], [7.0, 7.0]]), &[])),
        ("path not finite", with(points([[f64::NAN, 0.0], [f64::INFINITY, 1.0]]), &[sample(0)])),
        ("limits of zero", with(limited(0.0), &many(&|_, _| ()))),
        ("negative limits", with(limited(-1.0), &many(&|_, _| ()))),
        ("limits not numbers", with(limited(f64::NAN), &many(&|_, _| ()))),
        ("no limits", with(limited(f64::INFINITY), &many(&|_, _| ()))),
        ("tiny limits", with(limited(1e-300), &many(&|_, _| ()))),
        ("huge limits", with(limited(1e99), &many(&|_, _| ()))),
        ("search of zeros", with(steps(0.0, 0.0, vec![]), &[])),
        ("search not finite", with(steps(f64::INFINITY, f64::NAN, vec![f64::NAN]), &[])),
        ("search with the smallest mesh", with(steps(1e-300, 5e-324, vec![1e300]), &[])),
    ]
}

#[test]
fn no_run_breaks_a_plot() {
    let runs = awkward();
    for (name, data) in &runs {
        let mut data = data.clone();
        with_everything(&mut data);
        let data = &data;
        for kind in PlotKind::ALL.into_iter().filter(|kind| kind.applies_to(std::slice::from_ref(data))) {
            let document = svg(std::slice::from_ref(data), kind);
            assert!(!texts(&document).is_empty(), "{name} {kind:?}");
            assert!(document.len() < 2_000_000, "{name} {kind:?}: {} bytes", document.len());
        }
    }
    // All of them over each other.
    let mut all: Vec<RunData> = runs.into_iter().map(|(_, data)| data).collect();
    with_everything(&mut all[0]);
    for kind in PlotKind::ALL {
        assert!(texts(&svg(&all, kind)).iter().any(|t| t.contains("of 31 runs")), "{kind:?}");
    }
    draw(&all, PlotKind::Path, Format::Png).unwrap();
}

#[test]
fn a_straight_line_is_drawn_at_equal_scale() {
    let line = Line::new(Vector2::new(0.0, 5.0), Vector2::new(300.0, 5.0)).unwrap();
    let said = texts(&svg(&[simulated("line", &line, 100.0, EXPONENTIAL, 1.0)], PlotKind::Path));
    assert_says(&said, &["0", "50", "300", "100", "−80"]);
}

#[test]
fn an_infinite_jerk_is_called_so() {
    let mut data = simulated("steps", &circle(), 20.0, Profile::Linear { phase_s: 0.1 }, 1.0);
    data.metadata_mut().peak_jerk_mm_s3 = Some(f64::INFINITY);
    let said = texts(&svg(&[data], PlotKind::Feedrate));
    assert!(said.iter().any(|t| t.contains("jerk ∞ mm/s³")), "{said:#?}");
}

#[test]
fn limits_far_above_the_curves_are_named_but_do_not_flatten_them() {
    let mut data = one();
    data.metadata_mut().limits[0].limit = 5000.0;
    data.metadata_mut().voltage_limit_v = [400.0; 3];
    assert_says(&texts(&svg(&[data.clone()], PlotKind::Contour)), &["limit ± 5000 µm (off scale)"]);
    assert_says(&texts(&svg(&[data], PlotKind::Voltage)), &["saturation ± 400 V (off scale)"]);
}

#[test]
fn write_all_names_the_files_and_leaves_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("new/folder");
    let mut data = one();
    let files = write_all(&[data.clone()], &target, "circle", Format::Svg).unwrap();
    let names = |kinds: &[&str]| kinds.iter().map(|kind| target.join(format!("circle-{kind}.svg"))).collect::<Vec<_>>();
    assert_eq!(files, names(&["path", "contour", "feedrate", "voltage", "search"]));
    assert_eq!(fs::read_dir(&target).unwrap().count(), 5, "no unfinished file is left");
    assert_eq!(fs::read(&files[0]).unwrap(), draw(&[data.clone()], PlotKind::Path, Format::Svg).unwrap());
    // Without a search there is no plot of it; existing files are replaced.
    data.metadata_mut().n_c_search = None;
    data.metadata_mut().name = "another".to_owned();
    let files = write_all(&[data], &target, "circle", Format::Svg).unwrap();
    assert_eq!(files, names(&["path", "contour", "feedrate", "voltage"]));
    assert!(fs::read_to_string(&files[0]).unwrap().contains("another"));
}

#[test]
fn what_cannot_be_written_is_named_and_nothing_is_left_behind() {
    let folder = tempfile::tempdir().unwrap();
    // A folder stands where a plot should go.
    fs::create_dir(folder.path().join("x-contour.svg")).unwrap();
    let error = write_all(&[one()], folder.path(), "x", Format::Svg).unwrap_err();
    assert!(error.to_string().contains("x-contour.svg"), "{error}");
    let left: BTreeSet<_> = fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().file_name()).collect();
    assert_eq!(left, ["x-contour.svg", "x-path.svg"].map(Into::into).into());
    // A file stands where the folder should be.
    let file = folder.path().join("x-path.svg");
    let error = write_all(&[one()], &file, "x", Format::Svg).unwrap_err();
    assert!(matches!(&error, ReportError::Write { file: named, .. } if *named == file), "{error}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_that_names_the_file() {
    // /dev/full takes nothing: the unfinished file is a link to it.
    let folder = tempfile::tempdir().unwrap();
    let unfinished = folder.path().join(format!(".x-path.svg.{}.part", std::process::id()));
    std::os::unix::fs::symlink("/dev/full", &unfinished).unwrap();
    let error = write_all(&[one()], folder.path(), "x", Format::Svg).unwrap_err();
    assert!(error.to_string().contains("x-path.svg: No space left on device"), "{error}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left behind");
}

#[test]
fn nothing_to_draw_is_said_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let error = write_all(&[], folder.path(), "x", Format::Svg).unwrap_err();
    assert_eq!(error.to_string(), "nothing to draw in a path plot: no run was given");
    let error = draw(&[RunData::new(RunMetadata::default())], PlotKind::Search, Format::Svg).unwrap_err();
    assert_eq!(error.to_string(), "nothing to draw in a search plot: no run has a pattern search");
    for stem in ["", "a/b", "..\\a", "a\0b"] {
        let error = write_all(&[one()], folder.path(), stem, Format::Svg).unwrap_err();
        assert!(matches!(error, ReportError::Stem { .. }), "{stem}: {error}");
    }
}
