//! That the pictures of measurements are laid out as a person would: nothing off the figure, no text on another.

use super::curve::Frame;
use super::figure::{Figure, HEIGHT_PX, WIDTH_PX};
use super::marks::{Mark, TextFormat};
use super::plots::{circle, learning, response, steps};
use crate::learning::{LearnRun, Learned};
use crate::measure::{
    AxisResponse, AxisSteps, CircleTest, Direction, Radial, RampMetrics, Response, ResponsePoint, Sampled, Spike,
    StepMetrics, Steps,
};

fn test(size: f64, samples: u32) -> CircleTest {
    let direction = |clockwise: bool| {
        let trace: Vec<Radial> = (0..samples)
            .map(|k| 360.0 * f64::from(k) / f64::from(samples))
            .map(|a| Radial { angle_deg: a, deviation_um: size * (1.0 + (2.0 * a.to_radians()).sin()) })
            .collect();
        let spikes = [0, 1, 2, 3].map(|q| Spike {
            axis: ["x", "y"][q % 2],
            at_deg: 90.0 * q as f64,
            height_um: size,
            after_deg: 2.0,
            tip_deg: 90.0 * q as f64 + 2.0,
            tip_um: 2.0 * size,
            clear: q != 1,
        });
        Direction {
            clockwise,
            circular_deviation_um: size,
            circular_deviation_least_squares_um: size,
            centre_um: [0.0; 2],
            radius_um: size,
            radial_max_um: size,
            radial_max_at_deg: 0.0,
            radial_min_um: -size,
            radial_min_at_deg: 0.0,
            lost_motion_um: [size; 2],
            ripple_um: 0.1 * size,
            spikes,
            trace,
        }
    };
    CircleTest {
        scenario: "a scenario with a name that goes on and on and on, longer than any figure is wide ".repeat(3),
        radius_mm: 50.0,
        feed_mm_s: 100.0,
        turns: 1,
        directions: [direction(false), direction(true)],
        bidirectional_deviation_um: size,
        bidirectional_deviation_least_squares_um: size,
        mean_radial_deviation_um: size,
        hysteresis_um: size,
        hysteresis_at_deg: 90.0,
        locked_up: false,
        warnings: vec!["saturated in 3 samples".to_owned(); 2],
    }
}

fn responses(size: f64, count: u32) -> Response {
    let points: Vec<ResponsePoint> = (0..count)
        .map(|k| ResponsePoint {
            frequency_hz: size * 1.1_f64.powi(k.try_into().unwrap_or(0)),
            magnitude_db: 2.0 - f64::from(k),
            phase_deg: -5.0 * f64::from(k),
            model_db: Some(2.0 - f64::from(k)),
            model_deg: (k % 2 == 0).then_some(-5.0 * f64::from(k)),
            amplitude_um: 1.0,
            saturated: k % 3 == 0,
        })
        .collect();
    let axis = |name: &str| AxisResponse {
        axis: name.to_owned(),
        bandwidth_hz: Some(3.0 * size),
        bandwidth_last_hz: Some(3.0 * size),
        model_bandwidth_hz: None,
        model_bandwidth_last_hz: None,
        peak_db: 2.0,
        peak_hz: size,
        model_deviation_db: Some(1e-5),
        model_deviation_deg: Some(1e-4),
        warnings: vec!["saturated".to_owned()],
        points: points.clone(),
        linearized: crate::analysis::Linearized::default(),
        model_curve: points.iter().map(|point| [point.frequency_hz, point.magnitude_db, point.phase_deg]).collect(),
    };
    Response { scenario: "alpha".to_owned(), period_s: 1e-3, axes: vec![axis("x"), axis("y")], warnings: Vec::new() }
}

fn ramps(size: f64, count: u32, settles: bool) -> Steps {
    let samples: Vec<Sampled> = (0..count)
        .map(f64::from)
        .map(|k| Sampled { time_s: 1e-3 * k, command_um: size, actual_um: size * (1.0 - 1.3 * (-0.05 * k).exp()) })
        .collect();
    let settling_s = settles.then_some(0.03);
    let axis = |name: &str| AxisSteps {
        axis: name.to_owned(),
        stable: true,
        step: StepMetrics {
            rise_s: None,
            overshoot_percent: 10.0,
            settling_s,
            rest_um: 0.0,
            saturated_samples: 1,
            locked_up: false,
        },
        ramp: RampMetrics {
            feed_mm_s: 100.0,
            length_mm: 60.0,
            kv_1_s: None,
            following_error_um: size,
            model_following_error_um: None,
            ripple_um: 0.0,
            largest_error_um: size,
            settling_s,
            rest_um: 0.0,
            saturated_samples: 0,
            locked_up: false,
        },
        step_samples: samples.clone(),
        ramp_samples: samples.clone(),
    };
    let axes = vec![axis("x"), axis("y")];
    Steps { scenario: "alpha".to_owned(), step_um: size, window_um: 0.1 * size, axes, warnings: vec![] }
}

fn learned(size: f64, count: u32) -> Learned {
    let run = |run: u32| LearnRun {
        run,
        max_contour_error_um: size * 0.5_f64.powi(run.try_into().unwrap_or(0)),
        rms_contour_error_um: size,
        max_tracking_error_um: 3.0 * size,
        rms_tracking_error_um: size * 0.4_f64.powi(run.try_into().unwrap_or(0)),
        peak_voltage_v: 1.0,
        saturated_share: 0.0,
    };
    Learned {
        scenario: "alpha".to_owned(),
        gain: 0.8,
        cutoff_hz: 80.0,
        period_s: 1e-3,
        runs: (1..=count).map(run).collect(),
        best_run: count,
        diverged: (count == 3).then(|| "learning diverges: the gain is too high".to_owned()),
        locked_up: count == 3,
        continued: false,
        interrupted: false,
        warnings: Vec::new(),
        corrections_mm: (0..1000_u32)
            .map(|k| nalgebra::Vector2::new(size, -size) * (0.01 * f64::from(k)).sin())
            .collect(),
    }
}

fn figures() -> Vec<(String, Figure)> {
    let mut figures = Vec::new();
    for after in [30.0, 43.0, 45.0, 47.0] {
        // Tips beside the angles around the grid, on its edge.
        let mut circles = test(1.0, 5000);
        for spike in circles.directions.iter_mut().flat_map(|direction| &mut direction.spikes) {
            spike.tip_deg = spike.at_deg + after;
        }
        figures.push((format!("circle, tips {after}"), circle::figure(&circles)));
    }
    for size in [0.0, 1e-9, 1e-3, 1.0, 37.0, 1e6] {
        for samples in [0, 1, 2, 100, 5000] {
            figures.push((format!("circle {size} {samples}"), circle::figure(&test(size, samples))));
            let settles = samples % 2 == 0;
            figures.push((format!("steps {size} {samples}"), steps::figure(&ramps(size, samples, settles))));
        }
        for count in [1, 2, 3, 60, 200] {
            figures.push((format!("learning {size} {count}"), learning::figure(&learned(size, count))));
            let hz = size.max(1e-6);
            figures.push((format!("response {size} {count}"), response::figure(&responses(hz, count.min(100)))));
        }
    }
    figures
}

#[test]
fn no_text_lies_on_another_and_nothing_leaves_the_figure() {
    let page = Frame { left: 2.0, top: 2.0, right: WIDTH_PX - 2.0, bottom: HEIGHT_PX - 2.0 };
    let mut wrong = Vec::new();
    for (name, figure) in figures() {
        let mut texts: Vec<&TextFormat> = Vec::new();
        for mark in &figure.marks {
            let points = match mark {
                Mark::Line { points, .. } | Mark::Area { points, .. } => points.clone(),
                Mark::Dot { at, .. } => vec![*at],
                Mark::Image(image) => vec![(image.frame.left, image.frame.top)],
                Mark::TextFormat(text) => {
                    texts.push(text);
                    continue;
                }
            };
            if points
                .iter()
                .any(|&(x, y)| !(-0.01..=WIDTH_PX + 0.01).contains(&x) || !(-0.01..=HEIGHT_PX + 0.01).contains(&y))
            {
                wrong.push(format!("{name}: a mark leaves the figure: {:?}", points.first()));
            }
        }
        for (i, a) in texts.iter().enumerate() {
            if !a.frame().is_within(&page) {
                wrong.push(format!("{name}: `{}` leaves the figure", a.text));
            }
            for b in texts.iter().take(i).filter(|b| a.frame().overlaps(&b.frame())) {
                wrong.push(format!("{name}: `{}` lies on `{}`", a.text, b.text));
            }
        }
    }
    assert!(wrong.is_empty(), "{} faults:\n{}", wrong.len(), wrong.join("\n"));
}
