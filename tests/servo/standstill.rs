//! Standstill: a command at rest is constant to the bit, and compensations that take the sign of a velocity rest with it.

use crate::common::drive::helped;
use servosim::scenario::Document;
use servosim::servo::compensation::{BacklashCompensation, Compensation, FrictionFeedforward, STANDSTILL_MM_S};
use servosim::servo::effects::Effects;
use servosim::servo::{AxisReference, AxisSignals};
use servosim::simulation::Period;

fn run(name: &str, set: &[&str]) -> Vec<Period<2>> {
    let mut document = Document::builtin(name).unwrap();
    for set in set {
        document.set(set).unwrap();
    }
    document.scenario().unwrap().simulation().unwrap().collect()
}

const HOLD: &str = "feedrate.override=[{at_s=0.4,percent=0},{at_s=0.8,percent=100}]";

/// Counts the periods at rest, each of which has to have the position of the one before if that is at rest, too.
fn resting(periods: &[Period<2>]) -> usize {
    let mut resting = 0;
    for pair in periods.windows(2) {
        let [before, here] = [&pair[0].setpoint, &pair[1].setpoint];
        if before.feed_mm_s == 0.0 && here.feed_mm_s == 0.0 && before.s_mm == here.s_mm {
            let bits = |setpoint: &servosim::interpolator::Setpoint<2>| setpoint.position_mm.map(f64::to_bits);
            assert_eq!(bits(before), bits(here), "at {} s", here.time_s);
            assert_eq!(pair[0].axes.map(|a| a.command_mm.to_bits()), pair[1].axes.map(|a| a.command_mm.to_bits()));
            resting += 1;
        }
    }
    resting
}

#[test]
fn commands_at_rest_are_constant_to_the_bit() {
    for (name, set) in [
        ("alpha-real", &[][..]),
        ("alpha-real", &[HOLD][..]),
        ("alpha-real", &["feedrate.override=[{at_s=0,percent=0},{at_s=0.1,percent=100}]"][..]),
        ("heart", &[HOLD][..]),
        ("star", &[HOLD][..]),
        // An axis that looks ahead and shifts its commands.
        ("alpha-real", &[HOLD, "axes.y.compensation.zero_phase=true"][..]),
    ] {
        assert!(resting(&run(name, set)) > 90, "{name} {set:?}");
    }
    // The ideal model solves for the end again: its recordings are a reference to the bit.
    let periods = run("alpha", &[HOLD]);
    assert!(resting(&periods[..1500]) > 200);
}

#[test]
fn validates_where_compensated_drives_come_to_rest() {
    // Metrics of commands that stay on the end of the path, handed to the drives one by one.
    let periods = run("alpha-real", &[]);
    let [.., before, last] = &periods[..] else { panic!("no periods") };
    let off = (last.actual_mm - last.setpoint.position_mm) * 1e3;
    println!("rests {off:?} µm off");
    assert!((off.x + 3.3).abs() < 0.1 && (off.y - 4.4).abs() < 0.1, "{off:?} µm");
    assert_eq!(before.actual_mm, last.actual_mm, "the table sticks");
}

#[test]
fn signs_have_a_dead_band() {
    let backlash = BacklashCompensation { gap_um: 8.0, time_constant_s: 0.0 };
    let friction = FrictionFeedforward { coulomb_nm: 0.1, smoothing_mm_s: 1e-9 };
    let compensation = Compensation { backlash: Some(backlash), friction: Some(friction), ..Compensation::default() };
    let position = 18.0_f64;
    let rests = |flips: bool| -> Vec<AxisSignals> {
        let mut axis = helped(&Effects::default(), &compensation, position);
        let approach = (0..100).map(|k| position - 1e-3 * f64::from(100 - k));
        let rest = (0..2000).map(|k| if flips && k % 2 == 1 { position.next_down() } else { position });
        approach
            .chain(rest)
            .map(|position_mm| axis.step(&AxisReference { position_mm, ..AxisReference::default() }))
            .collect()
    };
    let (constant, flipping) = (rests(false), rests(true));
    let [.., last] = &constant[..] else { panic!("no samples") };
    // It came from below: half the gap beyond its command.
    assert!((last.actual_mm - position - 4e-3).abs() < 1e-9, "{last:?}");
    for (a, b) in constant.iter().zip(&flipping) {
        assert!((a.actual_mm - b.actual_mm).abs() < 1e-11 && (a.torque_nm - b.torque_nm).abs() < 1e-9, "{a:?} {b:?}");
    }

    // As wide as it is said to be.
    let creeps = |mm_s: f64| {
        let mut axis = helped(&Effects::default(), &compensation, 0.0);
        let signals = (0..100_u32).map(|k| axis.step(&AxisReference::at_rest(mm_s * 1e-3 * f64::from(k))));
        signals.last().map_or(0.0, |signals| signals.actual_mm)
    };
    assert!(creeps(-1.01 * STANDSTILL_MM_S) < -3e-3 && creeps(-0.99 * STANDSTILL_MM_S).abs() < 1e-6);
}
