//! The look-ahead planner: closed forms, limits on a fine grid, independence of the look-ahead.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{LookAhead, Motion, PathPiece, Profile, Span};

const SMOOTH: f64 = f64::INFINITY;

fn piece(length_mm: f64, feed_mm_s: f64) -> PathPiece {
    PathPiece { length_mm, feed_mm_s, limit_mm_s: SMOOTH, joint_mm_s: SMOOTH, pause_s: 0.0 }
}

fn plan(pieces: &[PathPiece], accel: f64, jerk: f64, most: Option<usize>) -> Vec<Span> {
    let mut planner = LookAhead::new(accel, jerk).unwrap();
    if let Some(most) = most {
        planner = planner.with_most_pieces(most);
    }
    let mut spans = Vec::new();
    for piece in pieces {
        planner.push(*piece).unwrap();
        spans.extend(planner.by_ref());
    }
    planner.finish();
    spans.extend(planner.by_ref());
    assert_eq!(planner.held(), 0);
    spans
}

fn time(spans: &[Span]) -> f64 {
    spans.iter().map(|span| span.pause_s() + span.total_s()).sum()
}

#[test]
fn validates_one_piece_against_the_motion_of_a_path() {
    for (length, feed) in [(100.0, 50.0), (1.0, 50.0), (0.001, 200.0), (3.0, 100.0)] {
        let profile = Profile::JerkLimited { accel_mm_s2: 2000.0, jerk_mm_s3: 30_000.0 };
        let motion = Motion::plan(length, feed, profile).unwrap();
        let spans = plan(&[piece(length, feed)], 2000.0, 30_000.0, None);
        let [span] = &spans[..] else { panic!("{} spans", spans.len()) };
        assert!((span.total_s() - motion.total_s()).abs() < 1e-14 * motion.total_s());
        for i in 0..=1000 {
            let t = motion.total_s() * f64::from(i) / 1000.0;
            let (here, there) = (span.at(t), motion.at(t));
            assert!((here.s_mm - there.s_mm).abs() <= 1e-12 * length, "{here:?} {there:?}");
            assert!((here.feed_mm_s - there.feed_mm_s).abs() <= 1e-10 * feed, "{here:?} {there:?}");
        }
    }
}

#[test]
fn validates_a_corner_in_closed_form() {
    // 60 mm at 100 mm/s, a corner at 20 mm/s, 60 mm more. From 0 to V: V/a + a/j; from V to c: (V - c)/a + a/j, a mean speed of (V + c)/2.
    let (a, j, v, c) = (1000.0, 20_000.0, 100.0, 20.0);
    let pieces = [piece(60.0, v), PathPiece { joint_mm_s: c, ..piece(60.0, v) }];
    let spans = plan(&pieces, a, j, None);
    assert_eq!(spans.len(), 2);
    assert_eq!(spans[0].end_mm_s(), c);
    let (up, down) = (v / a + a / j, (v - c) / a + a / j);
    let cruise = (60.0 - 0.5 * v * up - 0.5 * (v + c) * down) / v;
    let expected = 2.0 * (up + down + cruise);
    assert!((time(&spans) - expected).abs() < 1e-12, "{} {expected}", time(&spans));
}

#[test]
fn many_short_pieces_are_as_fast_as_one_long_one() {
    let whole = time(&plan(&[piece(500.0, 100.0)], 2000.0, 30_000.0, None));
    for count in [10_u32, 1000, 50_000] {
        let pieces = vec![piece(500.0 / f64::from(count), 100.0); count as usize];
        let spans = plan(&pieces, 2000.0, 30_000.0, None);
        assert!((time(&spans) - whole).abs() < 1e-9, "{count}: {} {whole}", time(&spans));
        assert!(spans.len() < 100, "{} spans", spans.len());
    }
}

#[test]
fn noisy_corners_cost_little() {
    // Joints of 50 to 55 mm/s every 0.1 mm: hardly slower than 50 mm/s, the ramps aside.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(90);
    let pieces: Vec<_> =
        (0..2000).map(|_| PathPiece { joint_mm_s: rng.random_range(50.0..55.0), ..piece(0.1, 100.0) }).collect();
    let spans = plan(&pieces, 2000.0, 30_000.0, None);
    assert!(time(&spans) < 200.0 / 49.9 + 50.0 / 2000.0 + 2000.0 / 30_000.0, "{}", time(&spans));
}

#[test]
fn a_feed_that_can_be_reached_is_kept_exactly() {
    // A corner only a little below the feed does not slow what is before and behind it.
    let pieces = [piece(100.0, 100.0), PathPiece { joint_mm_s: 97.0, ..piece(100.0, 100.0) }];
    let spans = plan(&pieces, 2000.0, 30_000.0, None);
    assert_eq!(spans.len(), 2);
    for span in &spans {
        assert_eq!(span.peaks().feed_mm_s, 100.0);
        assert_eq!(span.at(0.5 * span.total_s()).feed_mm_s, 100.0);
    }
}

/// Random pieces: short and long, slow and fast, smooth joints, corners and stops, in moods that last a while.
fn random(rng: &mut Xoshiro256PlusPlus) -> Vec<PathPiece> {
    let mut pieces = Vec::new();
    while pieces.len() < 60 {
        let size = rng.random_range(-3.0..1.5);
        let feed = 10.0_f64.powf(rng.random_range(0.0..2.3));
        let corners = rng.random_range(0..4);
        for _ in 0..rng.random_range(1..30) {
            pieces.push(PathPiece {
                length_mm: 10.0_f64.powf(size + rng.random_range(-0.5..0.5)),
                feed_mm_s: feed,
                limit_mm_s: if rng.random_range(0..3) == 0 { feed * rng.random_range(0.3..1.2) } else { SMOOTH },
                joint_mm_s: match corners {
                    0 => SMOOTH,
                    1 => feed * rng.random_range(0.5..0.55),
                    2 => feed * rng.random_range(0.01..2.0),
                    _ => [0.0, SMOOTH, 0.1 * feed][rng.random_range(0..3)],
                },
                pause_s: if rng.random_range(0..40) == 0 { rng.random_range(0.0..0.5) } else { 0.0 },
            });
        }
    }
    pieces
}

#[test]
fn validates_limits_continuity_and_length_on_random_pieces() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(91);
    for case in 0..400 {
        let pieces = random(&mut rng);
        let accel = 10.0_f64.powf(rng.random_range(2.0..4.0));
        let jerk = accel * 10.0_f64.powf(rng.random_range(0.5..2.5));
        let spans = plan(&pieces, accel, jerk, None);
        let length: f64 = pieces.iter().map(|p| p.length_mm).sum();
        let covered: f64 = spans.iter().map(Span::length_mm).sum();
        assert!((length - covered).abs() < 1e-12 * length, "case {case}: {length} {covered}");
        assert_eq!((spans[0].start_mm_s(), spans[spans.len() - 1].end_mm_s()), (0.0, 0.0), "case {case}");

        // Where each piece begins, and the limits there.
        let mut ends = Vec::new();
        let mut at = 0.0;
        for piece in &pieces {
            at += piece.length_mm;
            ends.push(at);
        }
        let mut base = 0.0;
        let mut before = 0.0;
        for span in &spans {
            assert_eq!(span.start_mm_s(), before, "case {case}: the feed jumps");
            before = span.end_mm_s();
            if span.pause_s() > 0.0 {
                assert_eq!(span.start_mm_s(), 0.0);
            }
            let steps = 200;
            let dt = span.total_s() / f64::from(steps);
            let mut last = span.at(0.0);
            assert_eq!(last.s_mm, 0.0);
            for i in 1..=steps {
                let now = span.at(dt * f64::from(i));
                let what = || format!("case {case} span {span:?} step {i}: {last:?} {now:?}");
                assert!(now.accel_mm_s2.abs() <= accel * (1.0 + 1e-9), "{}", what());
                assert!(now.jerk_mm_s3.abs() <= jerk * (1.0 + 1e-9), "{}", what());
                assert!(
                    (now.accel_mm_s2 - last.accel_mm_s2).abs() <= jerk * dt * (1.0 + 1e-9) + 1e-9 * accel,
                    "{}",
                    what()
                );
                assert!((now.feed_mm_s - last.feed_mm_s).abs() <= accel * dt + 1e-9, "{}", what());
                let moved = now.s_mm - last.s_mm;
                let (low, high) = (last.feed_mm_s.min(now.feed_mm_s), last.feed_mm_s.max(now.feed_mm_s));
                let slack = 1e-9 * span.length_mm() + accel * dt * dt + 1e-11;
                assert!(moved >= low * dt - slack && moved <= high * dt + slack, "{}", what());
                // The piece here, and the joint that was passed.
                let s = base + now.s_mm;
                let i = ends.partition_point(|&end| end <= s - 1e-9 * length).min(pieces.len() - 1);
                let mut limit = pieces[i].feed_mm_s.min(pieces[i].limit_mm_s);
                if let Some(next) = pieces.get(i + 1)
                    && s + 1e-9 * length >= ends[i]
                {
                    limit = limit.max(next.feed_mm_s.min(next.limit_mm_s));
                }
                assert!(now.feed_mm_s <= limit * (1.0 + 1e-9), "limit {limit}: {}", what());
                last = now;
            }
            assert_eq!(span.at(span.total_s()).s_mm, span.length_mm());
            base += span.length_mm();
        }
        // Joints: the speed where a piece begins.
        let speed_at = |s: f64| {
            let mut base = 0.0;
            for span in &spans {
                if s < base + span.length_mm() - 1e-9 * length {
                    let (mut low, mut high) = (0.0, span.total_s());
                    for _ in 0..60 {
                        let middle = 0.5 * (low + high);
                        if span.at(middle).s_mm < s - base { low = middle } else { high = middle }
                    }
                    return span.at(high).feed_mm_s;
                }
                base += span.length_mm();
            }
            0.0
        };
        for (i, piece) in pieces.iter().enumerate().skip(1) {
            if piece.joint_mm_s.is_finite() {
                let speed = speed_at(ends[i - 1]);
                // As well as the place is known: v² changes by 2 a s.
                let blur = (2.0 * accel * 1e-9 * length).sqrt();
                assert!(speed <= piece.joint_mm_s + blur + 1e-9, "case {case} piece {i}: {speed} {piece:?}");
            }
        }
    }
}

#[test]
fn results_do_not_depend_on_how_far_was_looked_ahead() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(92);
    for case in 0..200 {
        let mut pieces = random(&mut rng);
        let all = plan(&pieces, 1000.0, 20_000.0, None);
        // Spans that went out early are those of the whole program: what follows does not change them.
        let mut planner = LookAhead::new(1000.0, 20_000.0).unwrap();
        let mut early = Vec::new();
        let cut = rng.random_range(1..pieces.len());
        for piece in &pieces[..cut] {
            planner.push(*piece).unwrap();
            early.extend(planner.by_ref());
        }
        assert_eq!(early[..], all[..early.len()], "case {case}");
        pieces.truncate(cut);
        pieces.extend(random(&mut rng));
        let other = plan(&pieces, 1000.0, 20_000.0, None);
        assert_eq!(early[..], other[..early.len()], "case {case}");
        assert_eq!(plan(&pieces, 1000.0, 20_000.0, Some(100_000)), other);
    }
}

#[test]
fn memory_is_what_a_stop_takes() {
    let mut planner = LookAhead::new(1000.0, 20_000.0).unwrap();
    // A stop from 100 mm/s takes 7.5 mm: 75 pieces.
    let mut spans = 0;
    for i in 0..100_000 {
        planner.push(PathPiece { joint_mm_s: if i % 97 == 0 { 60.0 } else { SMOOTH }, ..piece(0.1, 100.0) }).unwrap();
        spans += planner.by_ref().count();
        assert!(planner.held() < 1000, "{} pieces at {i}", planner.held());
    }
    assert!(spans > 500);
    // However short the pieces are, no more than the most are held.
    let mut planner = LookAhead::new(1000.0, 20_000.0).unwrap().with_most_pieces(500);
    for _ in 0..100_000 {
        planner.push(piece(1e-6, 100.0)).unwrap();
        assert!(planner.held() <= 500);
        let _ = planner.by_ref().count();
    }
}

#[test]
fn bad_pieces_are_refused() {
    assert!(LookAhead::new(0.0, 1.0).is_err() && LookAhead::new(1.0, f64::NAN).is_err());
    let mut planner = LookAhead::new(1000.0, 20_000.0).unwrap();
    for bad in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        assert!(planner.push(piece(bad, 1.0)).is_err());
        assert!(planner.push(piece(1.0, bad)).is_err());
    }
    for bad in [f64::NAN, -1.0] {
        assert!(planner.push(PathPiece { limit_mm_s: bad, ..piece(1.0, 1.0) }).is_err());
        assert!(planner.push(PathPiece { joint_mm_s: bad, ..piece(1.0, 1.0) }).is_err());
        assert!(planner.push(PathPiece { pause_s: bad, ..piece(1.0, 1.0) }).is_err());
    }
    planner.finish();
    assert_eq!(planner.next(), None);
    // The extremes that are taken.
    let spans = plan(&[piece(1e9, 1e9), PathPiece { limit_mm_s: 1e-9, ..piece(1e-9, 1e9) }], 1e9, 1e-9, None);
    assert!(spans.iter().all(|span| span.total_s().is_finite()));
}
