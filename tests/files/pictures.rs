//! Pictures of tool paths and of the part that they leave.

// Pictures take single precision.
#![allow(clippy::cast_possible_truncation)]

use std::f64::consts::TAU;
use std::fs;

use servosim::report::{
    DeviationPicture, DeviationSubplot, Format, MoveKind, PathMove, PathPicture, ReportError, StepoverPicture,
};
use servosim::toolpath::{StepoverComparison, stepover_row};

/// A patch of 80 × 80 mm with a hump.
fn height(x: f64, y: f64) -> f64 {
    8.0 * (-((x - 40.0).powi(2) + (y - 35.0).powi(2)) / 600.0).exp() + 0.05 * x
}

/// Nested squares with round corners, from the outside in, with a link between most and two moves through the air.
fn path() -> PathPicture {
    let mut moves: Vec<PathMove> = Vec::new();
    let mut last: Option<[f64; 3]> = None;
    for ring in 0..40_u32 {
        let half = 39.0 - 0.97 * f64::from(ring);
        let points: Vec<[f64; 3]> = (0..=400)
            .map(|i| TAU * f64::from(i) / 400.0)
            .map(|a| {
                let power = 0.45;
                let bend = |c: f64| c.signum() * c.abs().powf(power);
                (40.0 + half * bend(a.cos()), 40.0 + half * bend(a.sin()))
            })
            .map(|(x, y)| [x, y, height(x, y)])
            .collect();
        let start = points[0];
        match last {
            Some(end) if ring % 14 != 13 => moves.push(PathMove { kind: MoveKind::Link, points_mm: vec![end, start] }),
            Some(end) => moves.push(PathMove {
                kind: MoveKind::Rapid,
                points_mm: vec![end, [end[0], end[1], 20.0], [start[0], start[1], 20.0], start],
            }),
            None => moves.push(PathMove {
                kind: MoveKind::Rapid,
                points_mm: vec![[0.0, 0.0, 20.0], [start[0], start[1], 20.0], start],
            }),
        }
        last = points.last().copied();
        moves.push(PathMove { kind: MoveKind::Ring(ring), points_mm: points });
    }
    let end = last.unwrap();
    moves.push(PathMove { kind: MoveKind::Rapid, points_mm: vec![end, [end[0], end[1], 20.0]] });
    let border = vec![[0.0, 0.0], [80.0, 0.0], [80.0, 80.0], [0.0, 80.0]];
    PathPicture {
        name: "patch".to_owned(),
        caption: "40 rings, 7.2 m of feed moves, 3 rapid moves".to_owned(),
        moves,
        borders_mm: vec![border],
    }
}

/// Scallops up to 250 µm between rings 3 mm apart, a gouge, an uncut corner, nothing beside the part; `servo` adds a ripple.
fn deviations(side: usize, servo: f64) -> Vec<f32> {
    (0..side * side)
        .map(|i| [i % side, i / side].map(|k| 80.0 * (k as f64 + 0.5) / side as f64 - 40.0))
        .map(|[x, y]| {
            if x.hypot(y) > 52.0 {
                return f32::NAN;
            }
            if x > 33.0 && y < -30.0 {
                return f32::INFINITY;
            }
            let ring = x.abs().max(y.abs()) / 3.0;
            let arch = 2.0 * (ring - ring.floor()) - 1.0;
            let gouge = -12.0 * (-((x - 10.0).powi(2) + (y + 12.0).powi(2)) / 8.0).exp();
            (250.0 * arch * arch * (1.0 - 0.003 * x.hypot(y)) + gouge + servo * (0.9 * x).sin() * (1.7 * y).cos())
                as f32
        })
        .collect()
}

fn maps<'a>(nominal: &'a [f32], as_cut: &'a [f32], side: usize) -> DeviationPicture<'a> {
    let subplot = |title, values_um| DeviationSubplot {
        title,
        caption: "mean 80.1 µm, rms 110 µm, 98.7 % within the limits, 95 % below 224 µm",
        low_mm: [0.0, 0.0],
        cell_mm: 80.0 / side as f64,
        columns: side,
        values_um,
    };
    DeviationPicture {
        name: "patch",
        caption: "ball of radius 5 mm, cells of 0.1 mm; as cut: the axes' simulated places",
        maps: vec![subplot("nominal", nominal), subplot("as cut", as_cut)],
        gouge_limit_um: Some(10.0),
        excess_limit_um: Some(250.0),
    }
}

/// What the text elements of an SVG say; on the way that it is well-formed XML without a number that is none.
fn texts(svg: &[u8]) -> Vec<String> {
    let svg = std::str::from_utf8(svg).unwrap();
    assert!(svg.starts_with("<svg width=\"1200\" height=\"800\" ") && svg.contains(" viewBox=\"0 0 12000 8000\""));
    let mut reader = quick_xml::Reader::from_str(svg);
    let mut said = Vec::new();
    let mut depth = 0;
    loop {
        match reader.read_event().unwrap() {
            quick_xml::events::Event::Start(tag) => {
                depth += 1;
                check(&tag);
            }
            quick_xml::events::Event::Empty(tag) => check(&tag),
            quick_xml::events::Event::End(_) => depth -= 1,
            quick_xml::events::Event::Text(text) => {
                let text: &str = &text;
                if !text.trim().is_empty() {
                    said.push(text.trim().to_owned());
                }
            }
            quick_xml::events::Event::Eof => break,
            _ => {}
        }
    }
    assert_eq!(depth, 0);
    said
}

fn check(tag: &quick_xml::events::BytesStart<'_>) {
    for attribute in tag.attributes() {
        let attribute = attribute.unwrap();
        if attribute.key.as_ref() != "href" {
            let value = attribute.value;
            assert!(!value.contains("NaN") && !value.contains("inf"), "{value}");
        }
    }
}

#[track_caller]
fn assert_says(said: &[String], wanted: &[&str]) {
    for wanted in wanted {
        assert!(said.iter().any(|text| text == wanted), "`{wanted}` is not among {said:#?}");
    }
}

/// A comparison of step-overs as it is drawn; rows that are not possible are left out.
fn stepovers(compared: &StepoverComparison) -> StepoverPicture<'static> {
    let cases = compared.curvature_radii_mm.iter().flat_map(|r| compared.scallops_mm.iter().map(move |h| (*h, *r)));
    StepoverPicture {
        caption: "caption",
        curves: compared.curves(),
        rows: cases.filter_map(|(h, r)| stepover_row(compared.radius_mm, h, r).ok()).collect(),
        range_mm: compared.range_mm,
    }
}

/// The pictures, for a person to look at: `PICTURES=folder cargo test --test files pictures`.
#[test]
fn pictures_of_a_patch() {
    let (nominal, as_cut) = (deviations(800, 0.0), deviations(800, 9.0));
    let maps = maps(&nominal, &as_cut, 800);
    let folder = tempfile::tempdir().unwrap();
    let target = std::env::var_os("PICTURES").map_or_else(|| folder.path().to_owned(), Into::into);
    for format in [Format::Svg, Format::Png] {
        let mut files = maps.write(&target, "patch", format).unwrap();
        files.extend(path().write(&target, "patch", format).unwrap());
        files.extend(stepovers(&StepoverComparison::default()).write(&target, "patch", format).unwrap());
        let names = ["deviation", "rings", "path3d", "stepover"];
        let wanted = names.map(|name| target.join(format!("patch-{name}.{}", format.extension())));
        assert_eq!(files, wanted);
        for file in files {
            let size = fs::metadata(&file).unwrap().len();
            let most = if format == Format::Svg { 1_000_000 } else { 3_000_000 };
            assert!((5_000..most).contains(&size), "{}: {size} bytes", file.display());
        }
    }
}

#[test]
fn maps_say_their_extremes_limits_and_units() {
    let (nominal, as_cut) = (deviations(100, 0.0), deviations(100, 9.0));
    let said = texts(&maps(&nominal, &as_cut, 100).draw(Format::Svg).unwrap());
    assert_says(&said, &["patch: deviation from the design surface", "nominal", "as cut", "x [mm]", "y [mm]", "uncut"]);
    assert_says(&said, &["largest excess", "deepest gouge", "limit −10", "limit 250"]);
    assert!(said.iter().any(|text| text.contains("deviation [µm]")), "{said:#?}");
    let worst = |values: &[f32]| values.iter().copied().filter(|value| value.is_finite()).fold(0.0, f32::max);
    for values in [&nominal, &as_cut] {
        // Four digits.
        let largest = format!("+{:.1}", worst(values));
        let wanted = format!("{} µm", largest.trim_end_matches(".0"));
        assert_says(&said, &[&wanted]);
    }
    assert!(said.iter().filter(|text| text.starts_with('−') && text.ends_with(" µm")).count() == 2, "{said:#?}");
}

/// The pixels of a PNG: width, and red, green, blue.
fn pixels(png: &[u8]) -> (usize, Vec<[u8; 3]>) {
    let mut reader = png::Decoder::new(png).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (info.width as usize, bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
}

#[test]
fn the_worst_cell_of_a_block_is_kept() {
    // One cell of 4 million stands out, up or down: its colour is the end of the scale.
    for (worst, colour) in [(90.0_f32, [8, 48, 107]), (-90.0, [110, 38, 2]), (f32::INFINITY, [128, 128, 128])] {
        let mut values = vec![1.0_f32; 2000 * 2000];
        values[1_234_567] = worst;
        let map = DeviationSubplot {
            title: "",
            caption: "",
            low_mm: [0.0; 2],
            cell_mm: 0.01,
            columns: 2000,
            values_um: &values,
        };
        let with = |values_um| DeviationPicture {
            name: "",
            caption: "",
            maps: vec![DeviationSubplot { values_um, ..map }],
            gouge_limit_um: None,
            excess_limit_um: None,
        };
        let picture = with(&values);
        let (width, found) = pixels(&picture.draw(Format::Png).unwrap());
        // Inside the map: left of the bar, below the legend. The ring that marks an extreme may lie on it.
        let inside = |at: usize| at % width < 1700 && at / width > 300 && at / width < 1400;
        let marked = worst.is_finite();
        let count = found.iter().enumerate().filter(|(at, pixel)| inside(*at) && **pixel == colour).count();
        assert!(count > 0 || marked, "{worst}");
        // In the SVG the picture is an image of at most 560 squares a side, its worst square among them.
        let svg = String::from_utf8(picture.draw(Format::Svg).unwrap()).unwrap();
        let data = svg.split("data:image/png;base64,").nth(1).unwrap().split('"').next().unwrap();
        let (width, squares) = pixels_of_palette(&from_base64(data));
        assert!(width == 500 && squares.iter().filter(|pixel| **pixel == colour).count() == 1, "{worst} {width}");
        let block = squares.iter().position(|pixel| *pixel == colour).unwrap();
        assert_eq!([block % 500, 499 - block / 500], [1_234_567 % 2000 / 4, 1_234_567 / 2000 / 4]);
    }
}

fn pixels_of_palette(png: &[u8]) -> (usize, Vec<[u8; 3]>) {
    let mut decoder = png::Decoder::new(png);
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (info.width as usize, bytes[..info.buffer_size()].chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
}

fn from_base64(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => panic!("no digit: {c}"),
    };
    let mut out = Vec::new();
    for four in text.as_bytes().chunks(4) {
        let kept = four.iter().take_while(|c| **c != b'=').count();
        let bits = four[..kept].iter().fold(0_u32, |bits, c| bits << 6 | u32::from(digit(*c))) << (6 * (4 - kept));
        out.extend(&bits.to_be_bytes()[1..kept]);
    }
    out
}

#[test]
fn paths_say_what_their_lines_are() {
    let said = texts(&path().draw_rings(Format::Svg).unwrap());
    assert_says(
        &said,
        &["patch: tool path in plan", "x [mm]", "y [mm]", "border of the region", "rapid moves", "start", "end"],
    );
    assert_says(&said, &["from ring to ring, cutting", "depth of the ring", "30"]);
    let said = texts(&path().draw_3d(Format::Svg).unwrap());
    assert_says(
        &said,
        &["patch: tool path in three dimensions", "x [mm]", "y [mm]", "z [mm]", "height z [mm]", "rapid moves"],
    );
}

#[test]
fn validates_the_papers_table_of_step_overs() {
    let rows = StepoverComparison::default().rows().unwrap();
    let errors: Vec<String> = rows
        .iter()
        .map(|row| format!("{} {} {:.4}", row.scallop_mm, row.curvature_radius_mm, row.error_percent))
        .collect();
    // 0.108, 1.088, 0.210 and 2.10 %; 0.024 … 0.029 and 0.24 … 0.29 %: as the specification has them.
    assert_eq!(rows.len(), 10, "{errors:#?}");
    for (row, wanted) in rows.iter().zip([0.108, 1.088, 0.210, 2.10, 0.0292, 0.293, 0.0250, 0.251, 0.0235, 0.236]) {
        assert!((row.error_percent / wanted - 1.0).abs() < 0.02, "{row:?} instead of {wanted}");
        assert!((row.fast_mm / row.exact_mm - 1.0).abs() * 100.0 - row.error_percent < 1e-9);
    }
    assert!(stepover_row(5.0, 0.1, -4.0).is_err() && stepover_row(5.0, f64::NAN, 4.0).is_err());
    let said = texts(&stepovers(&StepoverComparison::default()).draw(Format::Svg).unwrap());
    assert_says(
        &said,
        &[
            "R = 10: 0.108 %",
            "R = 10: 1.09 %",
            "R = 4: 0.21 %",
            "R = 4: 2.1 %",
            "R = −11 … −9: 0.0235 … 0.0292 %",
            "concave, h = 0.1 mm",
        ],
    );
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let values = deviations(150, 3.0);
    let picture = maps(&values, &values, 150);
    for format in [Format::Svg, Format::Png] {
        assert!(picture.draw(format).unwrap() == picture.draw(format).unwrap());
        let picture = stepovers(&StepoverComparison::default());
        assert!(picture.draw(format).unwrap() == picture.draw(format).unwrap());
    }
    assert!(path().draw_3d(Format::Svg).unwrap() == path().draw_3d(Format::Svg).unwrap());
    assert!(path().draw_rings(Format::Png).unwrap() == path().draw_rings(Format::Png).unwrap());
}

#[test]
fn no_input_breaks_a_picture() {
    let bad = [f64::NAN, f64::INFINITY, -1e300, 1e300, 1e9, 1e-300, 0.0, -5.0];
    let odd: Vec<f32> = vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1e-30, 0.0];
    for value in bad {
        for columns in [0, 1, 2, 6, 7, usize::MAX] {
            for values_um in [&odd[..], &odd[..1], &odd[4..], &[]] {
                let map = DeviationSubplot {
                    title: "<&>\u{0}",
                    caption: "\u{1}&",
                    low_mm: [value, 1.0],
                    cell_mm: value,
                    columns,
                    values_um,
                };
                let map = if columns == 2 { DeviationSubplot { low_mm: [0.0, 1.0], cell_mm: 1.0, ..map } } else { map };
                let picture = DeviationPicture {
                    name: "a<b>&\"\u{1b}",
                    caption: "",
                    maps: vec![map; columns.min(3)],
                    gouge_limit_um: Some(value),
                    excess_limit_um: Some(value),
                };
                texts(&picture.draw(Format::Svg).unwrap());
            }
        }
        for other in bad {
            let line = |kind, points_mm| PathMove { kind, points_mm };
            let picture = PathPicture {
                name: "\u{7}".to_owned(),
                caption: "<".to_owned(),
                moves: vec![
                    line(MoveKind::Ring(u32::MAX), vec![[value, other, 0.0], [0.0, value, other]]),
                    line(MoveKind::Rapid, vec![[other; 3]]),
                    line(MoveKind::Link, vec![]),
                ],
                borders_mm: vec![vec![[value, other]], vec![]],
            };
            texts(&picture.draw_rings(Format::Svg).unwrap());
            texts(&picture.draw_3d(Format::Svg).unwrap());
        }
    }
    let picture = PathPicture::default();
    texts(&picture.draw_rings(Format::Svg).unwrap());
    texts(&picture.draw_3d(Format::Svg).unwrap());
    let error = picture.write(std::path::Path::new("/tmp"), "a/b", Format::Svg).unwrap_err();
    assert!(matches!(error, ReportError::Stem { .. }));
}

#[test]
fn any_comparison_of_step_overs_can_be_drawn() {
    let picture = |radius_mm, scallops: &[f64], radii: &[f64], range_mm| {
        let (scallops_mm, curvature_radii_mm) = (scallops.to_vec(), radii.to_vec());
        let compared = StepoverComparison { radius_mm, scallops_mm, curvature_radii_mm, range_mm };
        texts(&stepovers(&compared).draw(Format::Svg).unwrap())
    };
    let said = picture(2.0, &[0.05], &[-3.0, -4.0, -20.0, 8.0, f64::INFINITY], [2.5, 50.0]);
    assert_says(&said, &["convex, h = 0.05 mm", "concave, h = 0.05 mm"]);
    for start in ["R = −4 … −3: ", "R = −20: ", "R = 8: "] {
        assert!(said.iter().any(|text| text.starts_with(start)), "{start}: {said:#?}");
    }
    let nothing = "Nothing to show: no curvature radius of this range has a step-over";
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e300, 1e-300] {
        picture(bad, &[bad, 0.1], &[bad, 10.0], [bad, 100.0]);
        picture(5.0, &[bad], &[bad], [1.0, bad]);
        picture(5.0, &[0.1, 0.1 + 1e-12], &[bad; 100], [10.0, 10.0]);
    }
    assert_says(&picture(5.0, &[], &[], [2.0, 100.0]), &[nothing]);
    assert_says(&picture(-5.0, &[0.1], &[], [2.0, 100.0]), &[nothing]);
}
