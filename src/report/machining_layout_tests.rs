//! That the pictures of tool paths are laid out as a person would: nothing off the figure, no text on another.

use super::curve::Frame;
use super::figure::{Figure, HEIGHT_PX, WIDTH_PX};
use super::marks::{Mark, TextFormat};
use super::part_data::{DeviationPicture, DeviationSubplot, MoveKind, PathMove, PathPicture, StepoverPicture};
use super::plots::{deviation, path_3d, rings, stepover};
use crate::toolpath::StepoverComparison;

fn figures() -> Vec<(String, Figure)> {
    let compared = StepoverComparison::default();
    let rows = compared.rows().unwrap();
    let picture = StepoverPicture { caption: "caption", curves: compared.curves(), rows, range_mm: compared.range_mm };
    let mut figures = vec![("stepover".to_owned(), stepover::figure(&picture))];
    for columns in [1, 20, 100, 2000] {
        for size in [1e-4, 1.0, 30.0, 1e6] {
            for maps in [1, 2] {
                let values: Vec<f32> = (0..2000_u16).map(|i| (f32::from(i) * 0.1).sin() * size).collect();
                let subplot = DeviationSubplot {
                    title: "as cut, with a title that is long",
                    caption: "caption that are long as well, over the cells of a map, and said in one line of text below it",
                    low_mm: [-1e3 * f64::from(size), 7.0],
                    cell_mm: 0.1,
                    columns,
                    values_um: &values,
                };
                for limit in [None, Some(10.0), Some(0.95 * f64::from(size))] {
                    let picture = DeviationPicture {
                        name: "part",
                        caption: "caption",
                        maps: vec![subplot; maps],
                        gouge_limit_um: limit,
                        excess_limit_um: limit.map(|limit| 2.0 * limit),
                    };
                    let name = format!("{maps} maps of {columns} columns, ±{size} µm, limit {limit:?}");
                    figures.push((name, deviation::figure(&picture)));
                }
            }
        }
    }
    for size in [
        [80.0, 80.0, 8.0],
        [1.0, 300.0, 0.0],
        [300.0, 1.0, 1.0],
        [1e-3, 1e-3, 1e-3],
        [1e4, 2e4, 3e4],
        [5.0, 5.0, 200.0],
    ] {
        let points_mm: Vec<[f64; 3]> = (0..200_u8)
            .map(|i| f64::from(i) * 0.05)
            .map(|a| [size[0] * a.cos(), size[1] * a.sin() - 500.0, size[2] * (3.0 * a).sin()])
            .collect();
        let part = |kind| PathMove { kind, points_mm: points_mm.clone() };
        let picture = PathPicture {
            name: "part".to_owned(),
            caption: "caption".to_owned(),
            moves: vec![part(MoveKind::Rapid), part(MoveKind::Ring(0)), part(MoveKind::Link), part(MoveKind::Ring(3))],
            borders_mm: vec![],
        };
        figures.push((format!("rings {size:?}"), rings::figure(&picture)));
        figures.push((format!("3d {size:?}"), path_3d::figure(&picture)));
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
                Mark::Image(image) => {
                    vec![(image.frame.left, image.frame.top), (image.frame.right, image.frame.bottom)]
                }
                Mark::TextFormat(text) => {
                    texts.push(text);
                    continue;
                }
            };
            if points.iter().any(|&(x, y)| !(0.0..=WIDTH_PX).contains(&x) || !(0.0..=HEIGHT_PX).contains(&y)) {
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
