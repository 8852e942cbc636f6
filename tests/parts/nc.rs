//! NC programs written and read back: the same curves, the same bytes, and rounding within what was announced.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::nc::{
    Action, Arc, Block, Decimals, Dialect, MAX_DECIMALS, Nurbs, NurbsFault, Plane, Program, WriteError, Writer,
    Writing, Written,
};

fn write(program: &Program, writing: Writing) -> (String, Written) {
    let mut out = Vec::new();
    let written = program.write(&mut out, writing).unwrap_or_else(|error| panic!("{error}\n{program:?}"));
    (String::from_utf8(out).unwrap(), written)
}

fn refusal(program: &Program, writing: Writing) -> String {
    program.write(Vec::new(), writing).unwrap_err().to_string()
}

fn read(text: &str) -> Program {
    Program::read(text, "written").unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn block(start_mm: [f64; 3], end_mm: [f64; 3], action: Action) -> Block {
    Block { line: 0, start_mm, end_mm, feed_mm_min: Some(1234.5), action }
}

fn of_curve(curve: Nurbs) -> Block {
    let points = &curve.control_points_mm;
    block(points[0], points[points.len() - 1], Action::Nurbs(curve))
}

fn program(blocks: impl IntoIterator<Item = Block>) -> Program {
    Program { blocks: blocks.into_iter().collect() }
}

/// A curve that the dialect can say: degree, weights and knots at random, its knots in any range.
fn random_curve(rng: &mut Xoshiro256PlusPlus, dialect: Dialect, from_mm: [f64; 3]) -> Nurbs {
    let degree = rng.random_range(dialect.degrees());
    let count = degree + 1 + rng.random_range(0..12);
    let scale = 10.0_f64.powf(rng.random_range(-1.0..2.0));
    let mut point = from_mm;
    let mut control_points_mm = vec![from_mm];
    while control_points_mm.len() < count {
        for axis in point.iter_mut().take(if dialect == Dialect::LinuxCnc { 2 } else { 3 }) {
            *axis += scale * rng.random_range(-1.0..1.0);
        }
        control_points_mm.push(point);
    }
    let rational: bool = rng.random();
    let weights = (0..count).map(|_| if rational { rng.random_range(0.2..3.0) } else { 1.0 }).collect();
    let (range, first) = (10.0_f64.powf(rng.random_range(-1.0..3.0)), rng.random_range(-5.0..5.0));
    let mut knots = vec![first; degree + 1];
    let mut last: f64 = first;
    for _ in 0..count - degree {
        // Sometimes a double knot, which a curve of degree 2 and more may have.
        let double = degree > 1 && knots.len() > degree + 1 && knots[knots.len() - 2] != last && rng.random_bool(0.1);
        if !double || dialect == Dialect::LinuxCnc {
            last += if dialect == Dialect::LinuxCnc { range } else { range * rng.random_range(0.05..1.0) };
        }
        knots.push(last);
    }
    if last == knots[knots.len() - 2] {
        last += range;
    }
    knots.truncate(count);
    knots.resize(count + degree + 1, last);
    let curve = Nurbs { degree, knots, weights, control_points_mm };
    curve.check().unwrap_or_else(|fault| panic!("{fault} {curve:?}"));
    curve
}

/// Point of a curve by the definition of its basis (Cox, de Boor), written without the crate.
fn point(curve: &Nurbs, u: f64) -> [f64; 3] {
    fn basis(knots: &[f64], i: usize, p: usize, u: f64, last: f64) -> f64 {
        if p == 0 {
            let inside = knots[i] <= u && u < knots[i + 1];
            let at_end = u == last && knots[i] < u && knots[i + 1] == last;
            return if inside || at_end { 1.0 } else { 0.0 };
        }
        let part = |a: f64, b: f64, n: f64| if b == 0.0 { 0.0 } else { a / b * n };
        part(u - knots[i], knots[i + p] - knots[i], basis(knots, i, p - 1, u, last))
            + part(knots[i + p + 1] - u, knots[i + p + 1] - knots[i + 1], basis(knots, i + 1, p - 1, u, last))
    }
    let last = curve.knots[curve.knots.len() - 1];
    let (mut sum, mut below) = ([0.0; 3], 0.0);
    for (i, (p, w)) in curve.control_points_mm.iter().zip(&curve.weights).enumerate() {
        let n = w * basis(&curve.knots, i, curve.degree, u, last);
        below += n;
        for axis in 0..3 {
            sum[axis] += n * p[axis];
        }
    }
    sum.map(|s| s / below)
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Largest distance of points at the same fraction of the same span, at many of them.
fn largest_distance(a: &Nurbs, b: &Nurbs) -> f64 {
    let mut most = 0.0_f64;
    for span in a.degree..a.control_points_mm.len() {
        for step in 0..=8 {
            let at = |curve: &Nurbs| {
                let (u, v) = (curve.knots[span], curve.knots[span + 1]);
                point(curve, if step == 8 { v } else { u + (v - u) * f64::from(step) / 8.0 })
            };
            most = most.max(distance(at(a), at(b)));
        }
    }
    most
}

fn curves(program: &Program) -> Vec<&Nurbs> {
    let curve = |block: &'_ Block| matches!(block.action, Action::Nurbs(_));
    program
        .blocks
        .iter()
        .filter(|block| curve(block))
        .map(|block| if let Action::Nurbs(curve) = &block.action { curve } else { unreachable!() })
        .collect()
}

/// Knots from 0 to 1.
fn unit(knots: &[f64]) -> Vec<f64> {
    let (first, last) = (knots[0], knots[knots.len() - 1]);
    knots.iter().map(|u| (u - first) / (last - first)).collect()
}

/// A chain of random curves of the dialect.
fn random_program(rng: &mut Xoshiro256PlusPlus, dialect: Dialect) -> Program {
    let mut place = [rng.random_range(-50.0..50.0), rng.random_range(-50.0..50.0), rng.random_range(-5.0..5.0)];
    let mut blocks = vec![block(place, place, Action::Rapid)];
    for _ in 0..rng.random_range(1..4) {
        let curve = of_curve(random_curve(rng, dialect, place));
        place = curve.end_mm;
        blocks.push(curve);
    }
    program(blocks)
}

/// With nine decimals: control points, weights, and knots up to the stated map, to 1e-9 mm (half of it is the rounding; knots
/// are compared as fractions of their range, which is a length of the polygon in millimetres).
#[test]
fn validates_that_every_dialect_is_read_back_to_the_same_curves() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(81);
    for case in 0..600 {
        let dialect = Dialect::ALL[case % 3];
        let before = random_program(&mut rng, dialect);
        let writing = Writing { decimals: Decimals::from(MAX_DECIMALS), tolerance_mm: 1e-3, ..Writing::new(dialect) };
        let (text, _) = write(&before, writing);
        let after = read(&text);
        let (before, after) = (curves(&before), curves(&after));
        assert_eq!(before.len(), after.len());
        for (b, a) in before.iter().zip(&after) {
            assert_eq!((b.degree, b.knots.len()), (a.degree, a.knots.len()));
            for (p, q) in b.control_points_mm.iter().zip(&a.control_points_mm) {
                assert!((0..3).all(|i| (p[i] - q[i]).abs() <= 1e-9), "{p:?} {q:?}\n{text}");
            }
            for (p, q) in b.weights.iter().zip(&a.weights) {
                assert!((p - q).abs() <= 1e-9, "{p} {q}\n{text}");
            }
            let length: f64 = b.control_points_mm.windows(2).map(|leg| distance(leg[0], leg[1])).sum();
            for (p, q) in unit(&b.knots).iter().zip(unit(&a.knots)) {
                assert!((p - q).abs() * length <= 3e-9, "{p} {q} {length}\n{text}");
            }
        }
    }
}

/// With few decimals the curve moves by no more than was announced, against a dense comparison by the basis itself.
#[test]
fn validates_that_rounding_stays_within_what_was_announced() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(82);
    let (mut tightest, mut written) = (0.0_f64, 0);
    for case in 0..600 {
        let dialect = Dialect::ALL[case % 3];
        let before = random_program(&mut rng, dialect);
        let decimals = Decimals {
            coordinate: rng.random_range(1..5),
            weight: rng.random_range(2..6),
            knot: rng.random_range(1..5),
        };
        let mut out = Vec::new();
        let writing = Writing { decimals, tolerance_mm: 1.0, ..Writing::new(dialect) };
        let mut writer = Writer::new(&mut out, writing).unwrap();
        let mut announced = Vec::new();
        if !before.blocks.iter().all(|block| match writer.write(block) {
            Ok(error_mm) => {
                announced.push(error_mm);
                true
            }
            Err(WriteError::Rounding { error_mm, .. }) => {
                assert!(error_mm > 1.0);
                false
            }
            Err(error) => panic!("{error}"),
        }) {
            continue;
        }
        let total = writer.finish().unwrap();
        assert_eq!(total.rounding_mm, announced.iter().copied().fold(0.0, f64::max));
        let after = read(std::str::from_utf8(&out).unwrap());
        for ((b, a), announced_mm) in curves(&before).iter().zip(curves(&after)).zip(&announced[1..]) {
            let moved_mm = largest_distance(b, a);
            // The evaluation itself is good to some 1e-12 mm.
            assert!(moved_mm <= announced_mm + 1e-10, "{moved_mm} {announced_mm}\n{b:?}\n{a:?}");
            tightest = tightest.max(moved_mm / announced_mm);
            written += 1;
        }
    }
    // The bound is one, and no empty one.
    assert!(written > 300, "{written}");
    assert!(tightest > 0.5, "{tightest}");
}

/// Reading and writing again changes no byte.
#[test]
fn a_program_read_and_written_again_is_the_same_bytes() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(83);
    for case in 0..600 {
        let dialect = Dialect::ALL[case % 3];
        let mut before = random_program(&mut rng, dialect);
        add_everyday_blocks(&mut before, &mut rng);
        let decimals = Decimals { coordinate: rng.random_range(2..7), weight: 4, knot: rng.random_range(4..9) };
        let number_step = [None, Some(10)][rng.random_range(0..2)];
        let writing = Writing { decimals, tolerance_mm: 1e3, number_step, ..Writing::new(dialect) };
        let mut first = Vec::new();
        if let Err(error) = before.write(&mut first, writing) {
            // Two decimals may close a span or a small arc.
            assert!(matches!(error, WriteError::Rounding { .. }), "{error}");
            continue;
        }
        let first = String::from_utf8(first).unwrap();
        let again = read(&first);
        let (second, _) = write(&again, writing);
        assert_eq!(first, second);
        assert_eq!(read(&second), again);
    }
}

/// Lines, arcs, dwells, words and comments after the curves.
fn add_everyday_blocks(program: &mut Program, rng: &mut Xoshiro256PlusPlus) {
    let mut place = program.blocks.last().unwrap().end_mm;
    program.blocks.insert(0, block([0.0; 3], [0.0; 3], Action::Auxiliary("S12000 M3".to_owned())));
    program.blocks.insert(0, block([0.0; 3], [0.0; 3], Action::Comment("part (7)\n ball 10 ".to_owned())));
    for _ in 0..rng.random_range(0..12) {
        let mut to = [0, 1, 2].map(|axis| place[axis] + if rng.random() { rng.random_range(-9.0..9.0) } else { 0.0 });
        let action = match rng.random_range(0..6) {
            0 => Action::Rapid,
            1 => Action::Dwell { time_s: rng.random_range(0.0..5.0) },
            2 => Action::Comment("between".to_owned()),
            3 => {
                let plane = [Plane::Xy, Plane::Zx, Plane::Yz][rng.random_range(0..3)];
                let [a, b, _] = plane.axes();
                let (radius, from, sweep) =
                    (rng.random_range(1.0..20.0_f64), rng.random_range(-3.0..3.0_f64), rng.random_range(0.3..6.0_f64));
                let clockwise: bool = rng.random();
                let end = if clockwise { from - sweep } else { from + sweep };
                let mut centre_mm = place;
                centre_mm[a] -= radius * from.cos();
                centre_mm[b] -= radius * from.sin();
                to[a] = centre_mm[a] + radius * end.cos();
                to[b] = centre_mm[b] + radius * end.sin();
                if rng.random_bool(0.2) {
                    to = place;
                }
                Action::Arc(Arc { plane, clockwise, centre_mm })
            }
            _ => Action::Linear,
        };
        let moves = !matches!(action, Action::Dwell { .. } | Action::Comment(_));
        let next = if moves { to } else { place };
        program.blocks.push(Block { feed_mm_min: Some(rng.random_range(100.0..9000.0)), ..block(place, next, action) });
        place = next;
    }
}

/// A quarter circle, as each dialect writes it.
#[test]
fn regression_of_the_dialects() {
    let arc = Nurbs {
        degree: 2,
        knots: vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
        weights: vec![1.0, std::f64::consts::FRAC_1_SQRT_2, 1.0],
        control_points_mm: vec![[10.0, 0.0, -1.0], [10.0, 10.0, -1.0], [0.0, 10.0, -1.0]],
    };
    let program = program([
        block([0.0; 3], [0.0; 3], Action::Comment("quarter".to_owned())),
        block([0.0; 3], [0.0; 3], Action::Auxiliary("S12000 M3".to_owned())),
        block([0.0; 3], [10.0, 0.0, -1.0], Action::Rapid),
        of_curve(arc),
        block([0.0, 10.0, -1.0], [0.0, 5.0, -1.0], Action::Linear),
    ]);
    let text = |dialect| write(&program, Writing { tolerance_mm: 0.01, ..Writing::new(dialect) }).0;
    assert_eq!(
        text(Dialect::Siemens),
        "; quarter\nS12000 M3\nG90 G71 G17\nG0 X10.000 Y0.000 Z-1.000\nBSPLINE SD=2 F1234.5\nX10.000 Y0.000 Z-1.000 PL=0\n\
         X10.000 Y10.000 Z-1.000 PW=0.7071 PL=20.000\nX0.000 Y10.000 Z-1.000 PL=0\nG1\nY5.000\nM30\n"
    );
    assert_eq!(
        text(Dialect::Fanuc),
        "%\n(quarter)\nS12000 M3\nG90 G21 G17\nG00 X10.000 Y0.000 Z-1.000\nG06.2 P3 K0.000 X10.000 Y0.000 Z-1.000 F1234.5\n\
         K0.000 X10.000 Y10.000 Z-1.000 R0.7071\nK0.000 X0.000 Y10.000 Z-1.000\nK20.000\nK20.000\nK20.000\nG01 Y5.000\nM30\n%\n"
    );
    assert_eq!(
        text(Dialect::LinuxCnc),
        "%\n(quarter)\nS12000 M3\nG90 G21 G17\nG0 X10.000 Y0.000 Z-1.000\nG5.2 P1.0000 L3 F1234.5\nX10.000 Y10.000 P0.7071\n\
         X0.000 Y10.000 P1.0000\nG5.3\nG1 Y5.000\nM30\n%\n"
    );
}

#[test]
fn decimals_are_chosen_for_a_tolerance() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(84);
    for case in 0..150 {
        let dialect = Dialect::ALL[case % 3];
        let before = random_program(&mut rng, dialect);
        let tolerance_mm = 10.0_f64.powf(rng.random_range(-6.0..-2.0));
        let asked = Writing { tolerance_mm, ..Writing::new(dialect) };
        let decimals = Decimals::choose(&before.blocks, &asked).unwrap();
        let (text, written) = write(&before, Writing { decimals, ..asked });
        assert!(written.rounding_mm <= tolerance_mm);
        let after = read(&text);
        for (b, a) in curves(&before).iter().zip(curves(&after)) {
            assert!(largest_distance(b, a) <= tolerance_mm + 1e-10);
        }
    }
    let before = random_program(&mut rng, Dialect::Fanuc);
    let impossible = Writing { tolerance_mm: 1e-12, ..Writing::new(Dialect::Fanuc) };
    assert!(matches!(Decimals::choose(&before.blocks, &impossible), Err(WriteError::Rounding { .. })));
}

/// Lines, curves and totals.
#[test]
fn what_was_written_is_counted() {
    let start = [0.0; 3];
    let line = |a: f64, b: f64| block([a, 0.0, 0.0], [b, 0.0, 0.0], Action::Linear);
    let (text, written) = write(&program([line(0.0, 1.0), line(1.0, 2.0)]), Writing::new(Dialect::Fanuc));
    // A first motion at the feed gets a rapid one to its start.
    assert_eq!(text, "%\nG90 G21 G17\nG00 X0.000 Y0.000 Z0.000\nG01 X1.000 F1234.5\nX2.000\nM30\n%\n");
    assert_eq!(written, Written { blocks: 2, lines: 7, straight: 2, ..Written::default() });
    let numbered = Writing { number_step: Some(10), ..Writing::new(Dialect::Siemens) };
    let name = block(start, start, Action::Auxiliary("O0007".to_owned()));
    assert_eq!(write(&program([name]), numbered).0, "O0007\nN10 M30\n");
}

#[test]
fn what_cannot_be_written_is_named() {
    let curve = |degree, knots: &[f64], weights: &[f64], z: f64| {
        let control_points_mm = (0..weights.len()).map(|i| [i as f64, (i * i) as f64, if i == 2 { z } else { 0.0 }]);
        let control_points_mm = control_points_mm.collect();
        program([of_curve(Nurbs { degree, knots: knots.to_vec(), weights: weights.to_vec(), control_points_mm })])
    };
    let ones = [1.0; 4];
    let quadratic = [0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0];
    let uneven = [0.0, 0.0, 0.0, 1.0, 3.0, 3.0, 3.0];
    let still = |action| program([block([0.0; 3], [0.0; 3], action)]);
    let words = |text: &str| still(Action::Auxiliary(text.to_owned()));
    let line = |to: f64| block([0.0; 3], [to, 0.0, 0.0], Action::Linear);
    for (dialect, program, says) in [
        (Dialect::LinuxCnc, curve(2, &uneven, &ones, 0.0), "not uniform"),
        (Dialect::LinuxCnc, curve(2, &quadratic, &ones, 1.0), "control point 2"),
        (Dialect::LinuxCnc, curve(1, &[0.0, 0.0, 1.0, 1.0], &[1.0; 2], 0.0), "degree 1"),
        (Dialect::Siemens, curve(1, &[0.0, 0.0, 1.0, 1.0], &[1.0; 2], 0.0), "takes 2 to 3"),
        (Dialect::Siemens, curve(2, &quadratic, &[1.0, 3.5, 1.0, 1.0], 0.0), "at most 3"),
        (Dialect::Fanuc, curve(2, &quadratic, &[1.0, 0.0, 1.0, 1.0], 0.0), "not above 0"),
        (Dialect::Fanuc, curve(2, &[0.0, 0.0, 0.0, 2.0, 1.0, 1.0, 1.0], &ones, 0.0), "must not decrease"),
        (Dialect::Fanuc, curve(2, &[0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0], &ones, 0.0), "first 3 knots"),
        (Dialect::Fanuc, curve(2, &quadratic[1..], &ones, 0.0), "6 knots where 7"),
        (Dialect::Fanuc, curve(2, &quadratic, &[1.0, 1e-5, 1.0, 1.0], 0.0), "rounding"),
        (Dialect::Fanuc, program([line(f64::NAN)]), "NaN"),
        (Dialect::Fanuc, program([line(1e9)]), "within"),
        (Dialect::Fanuc, program([line(1.0), line(2.0)]), "where the tool is"),
        (Dialect::Fanuc, program([Block { feed_mm_min: None, ..line(1.0) }]), "feed is not given"),
        (Dialect::Fanuc, program([Block { feed_mm_min: Some(0.0), ..line(1.0) }]), "feed is 0"),
        (Dialect::Fanuc, words("G1 X5"), "is not known to move nothing"),
        (Dialect::Fanuc, words("M3\nG0 X5"), "is not known"),
        (Dialect::Fanuc, words("M30 M3"), "order"),
        (Dialect::Fanuc, words("m3"), "order"),
        (Dialect::Fanuc, words("M3 (on)"), "is not known"),
        (Dialect::Fanuc, words("%"), "is not known"),
        (Dialect::Fanuc, still(Action::Dwell { time_s: -1.0 }), "dwell"),
        (Dialect::Fanuc, still(Action::Comment("x".repeat(40_000))), "too long"),
    ] {
        let error = refusal(&program, Writing { tolerance_mm: 1.0, ..Writing::new(dialect) });
        assert!(error.contains(says), "{says}: {error}");
    }
    let mut ended = words("M30");
    ended.blocks.push(line(1.0));
    assert!(refusal(&ended, Writing::new(Dialect::Siemens)).contains("follows the end"));
    let off = Arc { plane: Plane::Xy, clockwise: true, centre_mm: [4.0, 0.0, 0.0] };
    let arc = program([block([0.0; 3], [10.0, 0.0, 0.0], Action::Arc(off))]);
    assert!(refusal(&arc, Writing::new(Dialect::Siemens)).contains("its centre"));
}

/// A block that is refused leaves nothing behind.
#[test]
fn a_refused_block_is_not_written_in_part() {
    let mut out = Vec::new();
    let mut writer = Writer::new(&mut out, Writing { tolerance_mm: 1e-6, ..Writing::new(Dialect::Fanuc) }).unwrap();
    writer.write(&block([0.0; 3], [1.0, 0.0, 0.0], Action::Rapid)).unwrap();
    let third = block([1.0, 0.0, 0.0], [1.0 / 3.0, 0.0, 0.0], Action::Linear);
    assert!(matches!(writer.write(&third), Err(WriteError::Rounding { index: 1, .. })));
    writer.write(&block([1.0, 0.0, 0.0], [2.0, 0.0, 0.0], Action::Linear)).unwrap();
    writer.finish().unwrap();
    assert_eq!(
        String::from_utf8(out).unwrap(),
        "%\nG90 G21 G17\nG00 X1.000 Y0.000 Z0.000\nG01 X2.000 F1234.5\nM30\n%\n"
    );
}

#[test]
fn a_writer_that_fails_is_reported() {
    #[derive(Debug)]
    struct Full;
    impl std::io::Write for Full {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::Error::other("no space left"))
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let error = Writer::new(Full, Writing::new(Dialect::Fanuc)).unwrap_err();
    assert_eq!(error.to_string(), "cannot write the program: no space left");
}

#[test]
fn knots_are_millimetres_of_chord_and_stay_so() {
    let mut curve = Nurbs {
        degree: 1,
        knots: vec![2.0, 2.0, 2.5, 3.0, 3.0],
        weights: vec![1.0; 3],
        control_points_mm: vec![[0.0; 3], [3.0, 4.0, 0.0], [3.0, 4.0, 5.0]],
    };
    assert_eq!(curve.rescaled(), [0.0, 0.0, 5.0, 10.0, 10.0]);
    curve.knots = vec![1.0, 1.0, 7.0, 10.5, 10.5];
    assert_eq!(curve.rescaled(), [0.0, 0.0, 6.0, 9.5, 9.5]);
    curve.knots.clear();
    assert!(curve.rescaled().is_empty());
}

#[test]
fn curves_that_are_none_are_told_apart() {
    let good = Nurbs {
        degree: 2,
        knots: vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
        weights: vec![1.0; 3],
        control_points_mm: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0; 3]],
    };
    assert_eq!(good.check(), Ok(()));
    let bad = |change: fn(&mut Nurbs)| {
        let mut curve = good.clone();
        change(&mut curve);
        curve.check().unwrap_err()
    };
    assert_eq!(bad(|c| c.degree = 0), NurbsFault::Degree { degree: 0 });
    assert_eq!(bad(|c| c.degree = 3), NurbsFault::TooFewPoints { given: 3, degree: 3 });
    assert_eq!(bad(|c| c.weights.truncate(2)), NurbsFault::Weights { weights: 2, points: 3 });
    assert_eq!(bad(|c| c.knots.truncate(5)), NurbsFault::Knots { given: 5, needed: 6 });
    assert!(matches!(bad(|c| c.knots[1] = f64::NAN), NurbsFault::Knot { index: 1, .. }));
    assert!(matches!(bad(|c| c.weights[1] = f64::NAN), NurbsFault::Weight { index: 1, .. }));
    assert!(matches!(bad(|c| c.control_points_mm[2][1] = 2e6), NurbsFault::Coordinate { index: 2, .. }));
    assert_eq!(bad(|c| c.knots.fill(1.0)), NurbsFault::NoExtent);
    assert_eq!(bad(|c| c.knots[3] = 0.0), NurbsFault::NotClamped { end: "last", count: 3 });
    let gap = Nurbs {
        degree: 1,
        knots: vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0],
        weights: vec![1.0; 4],
        control_points_mm: vec![[0.0; 3]; 4],
    };
    assert_eq!(gap.check(), Err(NurbsFault::Gap { index: 3, value: 1.0 }));
}
