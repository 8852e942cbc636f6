//! NC programs through the interpolator and the closed loop.

use std::f64::consts::PI;
use std::fmt::Write as _;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{Motion, Profile};
use servosim::interpolator::Setpoint;
use servosim::limits::Limits;
use servosim::machining::{
    Machine, MotionFault, MotionReader, ProgramError, ProgramPeriod, ProgramRun, ProgramStatistics,
};
use servosim::nc::{Action, Arc, Block, Dialect, NcError, Nurbs, Plane, Program, Reader, Reading, Writing};
use servosim::path::{Cursor, Helix, Line, Path};
use servosim::recording::{Recorder, Recording, RecordingMetadata, csv};
use servosim::report::{RunData, RunMetadata};
use servosim::scenario::Scenario;
use servosim::servo::LoopSettings;
use servosim::simulation::{Ending, Event, Observer, ObserverError, Period, Place, Simulation};
use servosim::summary::SummaryObserver;

fn machine() -> Machine {
    let [x, y] = Scenario::builtin("alpha").unwrap().axes;
    Machine {
        axes: [x, y, x],
        settings: LoopSettings::default(),
        rapid_mm_s: 200.0,
        accel_mm_s2: 2000.0,
        jerk_mm_s3: 50_000.0,
        lateral_accel_mm_s2: 1000.0,
        corner_velocity_step_mm_s: 5.0,
        junction_accel_step_mm_s2: 50.0,
    }
}

fn read(text: &str) -> impl Iterator<Item = Result<Block, NcError>> + '_ {
    read_from([0.0; 3], text)
}

/// With the tool at a known place before.
fn read_from(start_mm: [f64; 3], text: &str) -> impl Iterator<Item = Result<Block, NcError>> + '_ {
    let reading = Reading { start_mm: Some(start_mm), dialect: Some(Dialect::Siemens), ..Reading::default() };
    Reader::new(text.as_bytes(), "part.nc", reading)
}

fn run(text: &str, machine: &Machine) -> Vec<ProgramPeriod> {
    ProgramRun::new(read(text), machine).unwrap().collect::<Result<_, _>>().unwrap()
}

fn blocks(blocks: &[Block]) -> impl Iterator<Item = Result<Block, NcError>> + '_ {
    blocks.iter().cloned().map(Ok)
}

fn linear(line: usize, start_mm: [f64; 3], end_mm: [f64; 3]) -> Block {
    Block { line, start_mm, end_mm, feed_mm_min: Some(6000.0), action: Action::Linear }
}

/// The same run through [`Simulation`].
fn simulated(path: &dyn Path<3>, feed_mm_s: f64, machine: &Machine) -> Vec<Period<3>> {
    let profile = Profile::JerkLimited { accel_mm_s2: machine.accel_mm_s2, jerk_mm_s3: machine.jerk_mm_s3 };
    let motion = Motion::plan(path.length_mm(), feed_mm_s, profile).unwrap();
    Simulation::new(path, &motion, machine.axes, machine.settings).unwrap().collect()
}

fn assert_same(program: &[ProgramPeriod], simulation: &[Period<3>]) {
    assert_eq!(program.len(), simulation.len());
    for (ProgramPeriod { period, .. }, other) in program.iter().zip(simulation) {
        assert_eq!((period.k, period.time_s), (other.k, other.time_s));
        let (a, b) = (&period.setpoint, &other.setpoint);
        let what = || format!("{period:?}\n{other:?}");
        assert!((a.position_mm - b.position_mm).norm() < 1e-9, "{}", what());
        assert!((a.velocity_mm_s - b.velocity_mm_s).norm() < 1e-7, "{}", what());
        assert!((period.actual_mm - other.actual_mm).norm() < 1e-9, "{}", what());
        assert!((period.contour_error_um - other.contour_error_um).abs() < 1e-4, "{}", what());
        assert!((period.nearest_s_mm - other.nearest_s_mm).abs() < 1e-6, "{}", what());
    }
}

#[test]
fn validates_a_straight_program_against_the_simulation() {
    let machine = machine();
    let line = Line::new(Vector3::zeros(), Vector3::new(30.0, -20.0, 7.0)).unwrap();
    assert_same(&run("G1 X0 Y0 Z0 F3000\nX30 Y-20 Z7\n", &machine), &simulated(&line, 50.0, &machine));
}

#[test]
fn validates_a_helix_program_against_the_simulation() {
    let machine = machine();
    let (start, end) = (Vector3::new(20.0, 0.0, 0.0), Vector3::new(0.0, 20.0, 6.0));
    let helix = Helix::new(start, end, Vector3::zeros(), [0, 1, 2], 1.5 * PI, true).unwrap();
    let read = || read_from(start.into(), "G2 X0 Y20 Z6 I-20 J0 F3000\n");
    let program: Vec<_> = ProgramRun::new(read(), &machine).unwrap().map(Result::unwrap).collect();
    assert_same(&program[..], &simulated(&helix, 50.0, &machine));
    let statistics = ProgramStatistics::of(read(), &machine).unwrap();
    assert!((statistics.length_mm - (1.5 * PI * 20.0).hypot(6.0)).abs() < 1e-11, "{statistics:?}");
}

#[test]
fn full_circles_run_in_every_plane() {
    for (text, axis) in [("G17 G2 I5", 2), ("G18 G3 I5", 1), ("G19 G3 J5", 0)] {
        let machine = machine();
        let text = format!("F1200\n{text}\nM30\n");
        let start = Vector3::new(1.0, 2.0, 3.0);
        let read = read_from(start.into(), &text);
        let periods: Vec<_> = ProgramRun::new(read, &machine).unwrap().map(Result::unwrap).collect();
        let last = periods.last().unwrap().period.setpoint;
        assert_eq!(last.position_mm, start);
        assert!((last.s_mm - 10.0 * PI).abs() < 1e-12);
        let furthest = periods.iter().map(|p| (p.period.setpoint.position_mm - start).norm()).fold(0.0, f64::max);
        assert!((furthest - 10.0).abs() < 1e-3, "{furthest}");
        assert!(periods.iter().all(|p| p.period.setpoint.position_mm[axis] == start[axis]));
    }
}

#[test]
fn corners_are_passed_as_fast_as_allowed_and_smooth_joints_at_full_feed() {
    let machine = machine();
    let corner = |text: &str| {
        let periods = run(text, &machine);
        let s = 50.0;
        let near = |p: &&ProgramPeriod| (p.period.setpoint.s_mm - s).abs() < 0.2;
        periods.iter().filter(near).map(|p| p.period.setpoint.feed_mm_s).fold(f64::INFINITY, f64::min)
    };
    // A quarter turn: the velocity jumps by √2 v ≤ 5 mm/s.
    let right = corner("G1 X0 Y0 Z0 F3000\nX50\nY50\n");
    assert!(right < 5.0 && right >= 5.0 / 2.0_f64.sqrt() - 1e-9, "{right}");
    // On from a line into its tangent arc.
    assert_eq!(corner("G1 X0 Y0 Z0 F1200\nX50\nG3 X100 Y50 I0 J50\n"), 20.0);
    // Straight on, in many blocks.
    let many: Vec<String> = (1..100).map(|i| format!("X{i}")).collect();
    assert_eq!(corner(&format!("G1 X0 Y0 Z0 F3000\n{}\n", many.join("\n"))), 50.0);
    // From rapid motion to the feed: a stop.
    assert!(corner("G0 X0 Y0 Z0\nX50\nG1 X100 F3000\n") < 10.0);
}

/// The part of a setpoint's acceleration across its path.
fn across(setpoint: &Setpoint<3>) -> Vector3<f64> {
    let tangent = setpoint.velocity_mm_s.try_normalize(1e-9).unwrap_or_default();
    setpoint.acceleration_mm_s2 - tangent * setpoint.acceleration_mm_s2.dot(&tangent)
}

#[test]
fn validates_the_feed_at_a_junction_of_line_and_arc_in_closed_form() {
    // The acceleration jumps by v²/r, by j Δt at most: v = √(j Δt r).
    let machine = machine();
    let (radius, period_s) = (20.0, machine.settings.period_s);
    let step = machine.jerk_mm_s3 * period_s;
    assert_eq!(machine.junction_accel_step_mm_s2, step);
    let text = "G1 X0 Y0 Z0 F6000\nX50\nG3 X70 Y20 I0 J20\nG1 Y70\n";
    let expected = (step * radius).sqrt();
    let periods = run(text, &machine);
    for joint in [50.0, 50.0 + 0.5 * PI * radius] {
        let near = periods.iter().map(|p| &p.period.setpoint).filter(|setpoint| (setpoint.s_mm - joint).abs() < 0.1);
        let feed = near.map(|setpoint| setpoint.feed_mm_s).fold(f64::INFINITY, f64::min);
        // Passed between two setpoints, from an acceleration of 0 on.
        let late = 0.5 * machine.jerk_mm_s3 * period_s * period_s;
        assert!((expected - 1e-9..expected + late).contains(&feed), "{joint}: {feed} {expected}");
    }
    // What a machine sees: the acceleration across the path from setpoint to setpoint.
    let change = |periods: &[ProgramPeriod]| {
        let changes = periods.windows(2).map(|pair| {
            let [a, b] = [&pair[0].period.setpoint, &pair[1].period.setpoint];
            // 3 v a/r is what a changing feed adds on the arc.
            let feed_change =
                3.0 * a.feed_mm_s.max(b.feed_mm_s) * a.accel_mm_s2.abs().max(b.accel_mm_s2.abs()) / radius;
            (across(b).norm() - across(a).norm()).abs() - feed_change * period_s
        });
        changes.fold(0.0, f64::max)
    };
    assert!(change(&periods) <= step * (1.0 + 1e-9), "{}", change(&periods));
    for p in &periods {
        assert!(p.period.setpoint.jerk_mm_s3.abs() <= machine.jerk_mm_s3 * (1.0 + 1e-9));
    }
    // With a step that never counts it is 100 mm/s, and a jump of 500 mm/s². That is what the limit costs here.
    let loose = Machine { junction_accel_step_mm_s2: 1e9, ..machine };
    assert!((change(&run(text, &loose)) - 500.0).abs() < 1.0, "{}", change(&run(text, &loose)));
    let time = |machine: &Machine| ProgramStatistics::of(read(text), machine).unwrap().time_s;
    let cost = time(&machine) - time(&loose);
    // Two junctions at 32 instead of 100 mm/s.
    assert!((0.09..0.11).contains(&cost), "{cost}");
}

#[test]
fn the_acceleration_steps_no_further_inside_a_curve() {
    // A quadratic B-spline: its curvature jumps at every knot. Then the same on in a plane across.
    let machine = machine();
    let points = [[0., 0.], [20., 0.], [30., 15.], [50., 10.], [60., -10.], [90., 0.]];
    let curve = |turned: bool| Nurbs {
        degree: 2,
        knots: vec![0., 0., 0., 1., 2., 3., 4., 4., 4.],
        weights: vec![1.0; 6],
        control_points_mm: points.map(|[x, y]| if turned { [x + 90.0, 0.0, y] } else { [x, y, 0.0] }).to_vec(),
    };
    let block = |start_mm, end_mm, curve| Block {
        line: 1,
        start_mm,
        end_mm,
        feed_mm_min: Some(6000.0),
        action: Action::Nurbs(curve),
    };
    let all =
        [block([0.0; 3], [90.0, 0.0, 0.0], curve(false)), block([90.0, 0.0, 0.0], [180.0, 0.0, 0.0], curve(true))];
    let change = |machine: &Machine| {
        let periods: Vec<_> = ProgramRun::new(blocks(&all), machine).unwrap().map(Result::unwrap).collect();
        let changes = periods.windows(2).map(|pair| {
            let [a, b] = [&pair[0].period.setpoint, &pair[1].period.setpoint];
            let jerk = a.jerk_vector_mm_s3.norm().max(b.jerk_vector_mm_s3.norm());
            (b.acceleration_mm_s2 - a.acceleration_mm_s2).norm() - 1.05 * jerk * machine.settings.period_s
        });
        changes.fold(0.0, f64::max)
    };
    let step = machine.junction_accel_step_mm_s2;
    assert!(change(&machine) <= step, "{}", change(&machine));
    let loose = change(&Machine { junction_accel_step_mm_s2: 1e9, ..machine });
    assert!(loose > 5.0 * step, "{loose}");
}

#[test]
fn velocity_steps_of_setpoints_are_bounded_at_corners() {
    let machine = machine();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(93);
    let mut text = "G1 X0 Y0 Z0 F6000\n".to_owned();
    for _ in 0..100 {
        let mut c = || rng.random_range(-3.0..3.0);
        writeln!(text, "X{:.3} Y{:.3} Z{:.3}", c(), c(), c()).unwrap();
    }
    let periods = run(&text, &machine);
    for pair in periods.windows(2) {
        let jump = (pair[1].period.setpoint.velocity_mm_s - pair[0].period.setpoint.velocity_mm_s).norm();
        let most = machine.corner_velocity_step_mm_s + machine.accel_mm_s2 * machine.settings.period_s;
        assert!(jump <= most * (1.0 + 1e-9), "{jump} {most} {pair:?}");
    }
}

#[test]
fn the_feed_stays_constant_on_a_nurbs_and_curves_are_slowed_where_they_are_sharp() {
    let machine = machine();
    let points = [[0., 0.], [20., 40.], [60., 40.], [62., -40.], [64., 40.], [100., 40.], [160., 0.]];
    let curve = Nurbs {
        degree: 3,
        knots: vec![0., 0., 0., 0., 1., 2., 3., 4., 4., 4., 4.],
        weights: vec![1.0; 7],
        control_points_mm: points.map(|[x, y]| [x, y, 0.1 * x]).to_vec(),
    };
    let block = Block {
        line: 1,
        start_mm: [0.0; 3],
        end_mm: [160.0, 0.0, 16.0],
        feed_mm_min: Some(6000.0),
        action: Action::Nurbs(curve),
    };
    let all = [block];
    let periods: Vec<_> = ProgramRun::new(blocks(&all), &machine).unwrap().map(Result::unwrap).collect();
    let shape = MotionReader::new(blocks(&all)).next().unwrap().unwrap().shape;
    let mut cursor = Cursor::default();
    let constant =
        periods.iter().filter(|p| p.period.setpoint.accel_mm_s2 == 0.0 && p.period.setpoint.feed_mm_s > 99.0);
    let mut count = 0;
    for p in constant {
        assert!((p.period.setpoint.feed_mm_s - 100.0).abs() < 1e-4);
        assert!((p.period.setpoint.velocity_mm_s.norm() - 100.0).abs() < 1e-4);
        count += 1;
    }
    assert!(count > 100, "{count} samples at the programmed feed");
    let slowest = periods.iter().filter(|p| (60.0..180.0).contains(&p.period.setpoint.s_mm));
    assert!(slowest.map(|p| p.period.setpoint.feed_mm_s).fold(f64::INFINITY, f64::min) < 60.0);
    for p in &periods {
        let setpoint = &p.period.setpoint;
        let along = setpoint.velocity_mm_s.try_normalize(1e-9).map_or(0.0, |t| setpoint.acceleration_mm_s2.dot(&t));
        let across = (setpoint.acceleration_mm_s2.norm_squared() - along * along).max(0.0).sqrt();
        assert!(across <= machine.lateral_accel_mm_s2 * (1.0 + 1e-6), "{setpoint:?}");
        assert!(setpoint.accel_mm_s2.abs() <= machine.accel_mm_s2 * (1.0 + 1e-9));
        assert!(setpoint.jerk_mm_s3.abs() <= machine.jerk_mm_s3 * (1.0 + 1e-9));
        // At constant feed: v³ |k'|.
        let frame = shape.frame(setpoint.s_mm, &mut cursor);
        let jerk = setpoint.feed_mm_s.powi(3) * frame.curvature_rate_1_mm2.norm();
        assert!(jerk <= machine.jerk_mm_s3 * (1.0 + 1e-6), "{jerk} {setpoint:?}");
    }
}

#[test]
fn a_nurbs_program_is_the_same_run_in_every_dialect() {
    let machine = machine();
    let curve = Nurbs {
        degree: 3,
        knots: vec![0., 0., 0., 0., 30., 60., 90., 90., 90., 90.],
        weights: vec![1.0, 1.0, 1.5, 1.0, 1.0, 1.0],
        control_points_mm: vec![[0.; 3], [10., 20., 0.], [30., 25., 0.], [50., 0., 0.], [70., 5., 0.], [80., 20., 0.]],
    };
    let end_mm = [80.0, 20.0, 0.0];
    let feed_mm_min = Some(3000.0);
    let program = Program {
        blocks: vec![
            Block { line: 0, start_mm: [0.; 3], end_mm: [0.; 3], feed_mm_min: None, action: Action::Rapid },
            Block { line: 0, start_mm: [0.; 3], end_mm, feed_mm_min, action: Action::Nurbs(curve) },
            Block { line: 0, start_mm: end_mm, end_mm: [80., 40., 0.], feed_mm_min, action: Action::Linear },
        ],
    };
    let direct: Vec<_> = ProgramRun::new(blocks(&program.blocks), &machine).unwrap().collect::<Result<_, _>>().unwrap();
    for dialect in Dialect::ALL {
        let mut text = Vec::new();
        let writing = Writing { dialect, decimals: 9.into(), ..Writing::new(dialect) };
        program.write(&mut text, writing).unwrap();
        let text = String::from_utf8(text).unwrap();
        let back = run(&text, &machine);
        assert_eq!(back.len(), direct.len(), "{dialect:?}");
        for (a, b) in back.iter().zip(&direct) {
            let error = (a.period.setpoint.position_mm - b.period.setpoint.position_mm).norm();
            assert!(error < 1e-6, "{dialect:?}: {error} {a:?}");
        }
    }
}

#[test]
fn dwells_rest_and_every_period_knows_its_block() {
    let machine = machine();
    let text = "G0 X0 Y0 Z0\nG0 X10\nG4 F0.5\nG1 X20 F3000\nG4 F0.25\nM30\n";
    let read = || read(text);
    let statistics = ProgramStatistics::of(read(), &machine).unwrap();
    assert_eq!(
        (statistics.blocks.dwell, statistics.blocks.rapid, statistics.blocks.linear, statistics.blocks.other),
        (2, 2, 1, 1)
    );
    assert_eq!(statistics.dwell_s, 0.75);
    assert!((statistics.rapid_length_mm - 10.0).abs() < 1e-12 && (statistics.feed_length_mm - 10.0).abs() < 1e-12);
    assert_eq!((statistics.lowest_mm, statistics.highest_mm), ([0.0; 3], [20.0, 0.0, 0.0]));
    let periods: Vec<_> = ProgramRun::new(read(), &machine).unwrap().map(Result::unwrap).collect();
    assert_eq!(periods.len() as u64, statistics.samples);
    let resting = periods.iter().filter(|p| p.period.setpoint.position_mm.x == 10.0).count() as f64;
    assert!((resting * machine.settings.period_s - 0.5).abs() < 0.01, "{resting}");
    for p in &periods {
        let x = p.period.setpoint.position_mm.x;
        let expected = if x < 10.0 { (2, true) } else { (4, false) };
        assert_eq!((p.place.line, p.place.rapid), expected, "x {x}");
    }
}

#[test]
fn commands_in_dwells_and_after_the_end_are_constant_to_the_bit() {
    let curve = |x: [f64; 4]| {
        let [a, b, c, d] = x;
        format!("G06.2 P4 K0 X{a} Y0\nK0 X{b} Y5.3\nK0 X{c} Y-4.7\nK0 X{d} Y0\nK7\nK7\nK7\nK7\n")
    };
    let (first, second) = (curve([0.0, 3.1, 7.7, 11.9]), curve([11.9, 14.3, 18.1, 23.7]));
    let text = format!("G0 X0 Y0 Z0\nG4 F0.1\nF3000\n{first}G4 F0.25\n{second}G4 F0.2\nM30\n");
    let reading = || Reading { start_mm: Some([0.0; 3]), dialect: Some(Dialect::Siemens), ..Reading::default() };
    let periods: Vec<_> = ProgramRun::new(Reader::new(text.as_bytes(), "part.nc", reading()), &machine())
        .unwrap()
        .map(Result::unwrap)
        .collect();
    let mut resting = 0;
    for pair in periods.windows(2) {
        let [before, here] = [&pair[0].period.setpoint, &pair[1].period.setpoint];
        if before.feed_mm_s == 0.0 && here.feed_mm_s == 0.0 && before.s_mm == here.s_mm {
            let bits = [before, here].map(|setpoint| setpoint.position_mm.map(f64::to_bits));
            assert_eq!(bits[0], bits[1], "at {} s", here.time_s);
            resting += 1;
        }
    }
    // Dwells of 0.1, 0.25 and 0.2 s, and 0.1 s of settling.
    assert!(resting > 640, "{resting}");
}

/// Notes what it is told.
#[derive(Default)]
struct Told {
    places: Vec<(u64, Place)>,
    events: Vec<Event>,
    periods: u64,
}

impl Observer<3> for Told {
    fn place(&mut self, place: &Place) -> Result<(), ObserverError> {
        self.places.push((self.periods, *place));
        Ok(())
    }

    fn period(&mut self, _: &Period<3>) -> Result<(), ObserverError> {
        self.periods += 1;
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), ObserverError> {
        self.events.push(event.clone());
        Ok(())
    }
}

const PART: &str = "G0 X0 Y0 Z5\nG1 Z0 F600\nX20 F3000\nG3 X20 Y20 I0 J10\nG1 X0\nY0\nG0 Z5\nM30\n";

#[test]
fn observers_see_a_program_as_any_run() {
    let machine = machine();
    let statistics = ProgramStatistics::of(read(PART), &machine).unwrap();
    let limits = Limits { contour_error_um: Some(0.5), ..Limits::default() };
    let mut told = Told::default();
    let mut summary = SummaryObserver::<3>::new("part");
    let mut data = RunData::new(RunMetadata::default());
    let mut recorder = Recorder::new(Vec::new(), RecordingMetadata::new("part", "")).unwrap();
    let program = ProgramRun::new(read(PART), &machine).unwrap();
    let ending =
        program.run(&statistics, &limits, None, &mut [&mut told, &mut summary, &mut data, &mut recorder]).unwrap();
    assert_eq!(ending, Ending::Complete);
    assert_eq!(told.periods, statistics.samples);
    let lines: Vec<_> = told.places.iter().map(|(_, place)| (place.line, place.rapid)).collect();
    assert_eq!(lines, [(1, true), (2, false), (3, false), (4, false), (5, false), (6, false), (7, true)]);
    assert!(told.events.iter().any(|event| matches!(event, Event::LimitPassed { name: "contour_error_um", .. })));
    let summary = summary.summary();
    assert!(summary.complete && summary.axes.len() == 3 && summary.axes[2].axis == "z");
    assert!((summary.path_length_mm - statistics.length_mm).abs() < 1e-12);
    assert!(summary.axes.iter().all(|axis| axis.peak_voltage_v > 0.1));
    assert!(data.metadata().three_axes && data.samples().iter().any(|sample| sample.voltage_v[2].abs() > 0.1));

    let bytes = recorder.finish(&summary).unwrap().writer;
    let mut samples = 0;
    let mut table = Vec::new();
    csv::write_header(&mut table, 3, false).unwrap();
    let mut heights = Vec::new();
    let recording = Recording::read_from("part", std::io::Cursor::new(&bytes), |sample| {
        samples += 1;
        let third = sample.third.unwrap();
        heights.push([third.z.actual_mm, third.nearest_z_mm, third.z.voltage_v, third.line, f64::from(third.rapid)]);
        csv::write_row(&mut table, sample)
    })
    .unwrap();
    assert_eq!(recording.axes, 3);
    // Every number of the third axis stands in the table, and what was observed is what was recorded.
    let table = String::from_utf8(table).unwrap();
    let names: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    assert_eq!(names, [csv::COLUMNS, csv::THIRD_COLUMNS].concat());
    let columns = ["z_actual_mm", "nearest_z_mm", "z_voltage_v", "line", "rapid"]
        .map(|name| names.iter().position(|other| *other == name).unwrap());
    assert_eq!(table.lines().count(), heights.len() + 1);
    for (line, wanted) in table.lines().skip(1).zip(&heights) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(cells.len(), names.len());
        assert_eq!(columns.map(|column| cells[column].to_bits()), wanted.map(f64::to_bits));
    }
    assert!(heights.iter().any(|[z, ..]| *z > 4.9) && heights.iter().any(|[z, ..]| *z < 0.1));
    assert!(heights.first().unwrap()[3..] == [1.0, 1.0] && heights.iter().any(|of| of[3..] == [4.0, 0.0]));
    let seen = data.samples();
    assert!(
        seen.len() == heights.len()
            && seen
                .iter()
                .zip(&heights)
                .all(|(s, of)| { [s.actual_mm[2], s.nearest_mm[2], s.voltage_v[2], of[3], f64::from(s.rapid)] == *of })
    );
    assert_eq!(samples, statistics.samples);
    assert!(recording.plan.contains_key("voltage_limit_z_v"));
    assert!(recording.topics.iter().any(|topic| topic.schema == "servosim.Servo3"));

    let stop = std::sync::atomic::AtomicBool::new(true);
    let program = ProgramRun::new(read(PART), &machine).unwrap();
    assert_eq!(program.run(&statistics, &limits, Some(&stop), &mut []).unwrap(), Ending::Interrupted);
}

#[test]
fn a_long_program_is_a_stream() {
    let machine = machine();
    // 100 000 blocks of 0.05 mm on a wave; read as they are needed.
    let count = 100_000;
    let point = |i: usize| {
        let x = 0.05 * i as f64;
        [x, 2.0 * (0.1 * x).sin(), 0.0]
    };
    let source = || (0..count).map(move |i| Ok(linear(i + 1, point(i), point(i + 1))));
    let statistics = ProgramStatistics::of(source(), &machine).unwrap();
    assert_eq!(statistics.blocks.linear, count as u64);
    assert!(statistics.points_mm.len() <= servosim::machining::MAX_DRAWN_POINTS);
    let last = statistics.points_mm.last().unwrap();
    assert!((last - Vector3::from(point(count))).norm() < 1e-12);
    let mut program = ProgramRun::new(source(), &machine).unwrap();
    let mut most = 0;
    let mut samples = 0;
    // Some of it is enough here: the whole takes a minute of the machine's time.
    while let Some(period) = program.next() {
        let period = period.unwrap();
        most = most.max(program.held());
        samples += 1;
        assert!(period.period.contour_error_um.abs() < 100.0, "{period:?}");
        if samples == 5000 {
            break;
        }
    }
    assert!(most < 2000, "{most} motions in memory");
}

#[test]
fn the_contouring_error_is_that_of_the_whole_path() {
    // Against a brute-force search over all the path near the setpoint.
    let mut machine = machine();
    machine.corner_velocity_step_mm_s = 60.0;
    let text = "G1 X0 Y0 Z0 F6000\nX3\nY3\nG2 X6 Y0 I3 J0\nG1 X8 Z2\nX9\nX9.1\nY0.1\nX9.2 Y3\n";
    let shapes: Vec<_> = MotionReader::new(read(text)).map(|motion| motion.unwrap().shape).collect();
    for p in run(text, &machine) {
        let period = &p.period;
        let reach = PI * 1e-3 * period.tracking_error_um + 1e-6;
        let (mut base, mut best) = (0.0, f64::INFINITY);
        for shape in &shapes {
            let length = shape.length_mm();
            let (low, high) = (period.setpoint.s_mm - reach - base, period.setpoint.s_mm + reach - base);
            if low <= length && high >= 0.0 {
                let (low, high) = (low.max(0.0), high.min(length));
                for i in 0..=400 {
                    let s = low + (high - low) * f64::from(i) / 400.0;
                    best = best.min((shape.point_mm(s, &mut Cursor::default()) - period.actual_mm).norm());
                }
            }
            base += length;
        }
        let error = 1e-3 * period.contour_error_um.abs();
        assert!(error <= best + 1e-9 && error >= best - 0.02 * reach, "{error} {best} {p:?}");
    }
}

fn fault(all: &[Block]) -> ProgramError {
    let machine = machine();
    let error = ProgramStatistics::of(blocks(all), &machine).unwrap_err();
    let run = ProgramRun::new(blocks(all), &machine).and_then(|mut run| run.find_map(Result::err).map_or(Ok(()), Err));
    assert_eq!(run.unwrap_err().to_string(), error.to_string(), "both passes say the same");
    error
}

#[test]
fn bad_programs_say_where() {
    let machine = machine();
    let text = "G1 X0 Y0 Z0 F3000\nX10\nX20 Q7\n";
    let error = ProgramStatistics::of(read(text), &machine).unwrap_err();
    let ProgramError::Read(NcError::Syntax(syntax)) = &error else { panic!("{error}") };
    assert_eq!((syntax.line(), syntax.column()), (3, 5), "{error}");
    assert!(matches!(
        ProgramRun::new(read(text), &machine).and_then(|mut run| run.find_map(Result::err).map_or(Ok(()), Err)),
        Err(ProgramError::Read(_))
    ));
    // No feed before the first motion at the feed.
    assert!(matches!(ProgramStatistics::of(read("G0 X0 Y0 Z0\nG1 X10\n"), &machine), Err(ProgramError::Read(_))));

    let (zero, x) = ([0.0; 3], [1.0, 0.0, 0.0]);
    let motion = |error| match error {
        ProgramError::Motion { line, fault } => (line, fault),
        other => panic!("{other}"),
    };
    for feed_mm_min in [None, Some(0.0), Some(-1.0), Some(f64::NAN), Some(1e300)] {
        let (line, fault) = motion(fault(&[Block { feed_mm_min, ..linear(7, zero, x) }]));
        assert!(line == 7 && matches!(fault, MotionFault::Feed { .. }), "{fault}");
    }
    for bad in [f64::NAN, f64::INFINITY, 1e7] {
        assert!(matches!(motion(fault(&[linear(1, zero, [0.0, bad, 0.0])])).1, MotionFault::Coordinate { .. }));
    }
    let gap = motion(fault(&[linear(1, zero, x), linear(2, [1.5, 0.0, 0.0], zero)]));
    assert!(gap.0 == 2 && matches!(gap.1, MotionFault::NotConnected { .. }));
    let dwell = |time_s| Block { action: Action::Dwell { time_s }, ..linear(3, x, x) };
    assert!(matches!(motion(fault(&[linear(1, zero, x), dwell(f64::NAN)])), (3, MotionFault::Dwell { .. })));
    let curve = |knots: Vec<f64>, weight: f64| {
        let control_points_mm = vec![zero, [0.5, 1.0, 0.0], x];
        let curve = Nurbs { degree: 2, knots, weights: vec![1.0, weight, 1.0], control_points_mm };
        Block { action: Action::Nurbs(curve), ..linear(4, zero, x) }
    };
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    assert!(matches!(motion(fault(&[curve(knots.clone(), f64::NAN)])), (4, MotionFault::Nurbs(_))));
    assert!(matches!(motion(fault(&[curve(vec![0.0; 5], 1.0)])), (4, MotionFault::Nurbs(_))));
    assert!(ProgramStatistics::of(blocks(&[curve(knots, 2.0)]), &machine).is_ok());
    let arc = |centre_mm| Block {
        action: Action::Arc(Arc { plane: Plane::Xy, clockwise: false, centre_mm }),
        ..linear(5, zero, x)
    };
    assert!(matches!(motion(fault(&[arc(zero)])), (5, MotionFault::Path(_))));
    assert!(matches!(motion(fault(&[arc([f64::NAN; 3])])), (5, _)));

    for (name, bad) in [
        ("rapid_mm_s", Machine { rapid_mm_s: 0.0, ..machine }),
        ("accel_mm_s2", Machine { accel_mm_s2: f64::NAN, ..machine }),
        ("jerk_mm_s3", Machine { jerk_mm_s3: -1.0, ..machine }),
        ("lateral_accel_mm_s2", Machine { lateral_accel_mm_s2: f64::INFINITY, ..machine }),
        ("junction_accel_step_mm_s2", Machine { junction_accel_step_mm_s2: 0.0, ..machine }),
        ("corner_velocity_step_mm_s", Machine { corner_velocity_step_mm_s: -1.0, ..machine }),
    ] {
        let error = ProgramStatistics::of(read(PART), &bad).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
        assert!(ProgramRun::new(read(PART), &bad).is_err());
    }
    let slow = Machine { settings: LoopSettings { period_s: 0.0, ..machine.settings }, ..machine };
    assert!(matches!(ProgramStatistics::of(read(PART), &slow), Err(ProgramError::Simulation(_))));
    // A dwell of eleven days in periods of 1 ms is more than a run may take.
    let long = [dwell(1e6), dwell(1e6)];
    assert!(ProgramStatistics::of(blocks(&long), &machine).is_err());
}

#[test]
fn programs_without_motion_rest() {
    let machine = machine();
    for text in ["", "M3 S100\n(nothing)\nM30\n", "G1 X0 Y0 Z0 F100\nX0\nX0 Y0\n", "G0 X0 Y0 Z0\nG4 F0.1\n"] {
        let read = || read(text);
        let statistics = ProgramStatistics::of(read(), &machine).unwrap();
        let periods: Vec<_> = ProgramRun::new(read(), &machine).unwrap().map(Result::unwrap).collect();
        assert_eq!(periods.len() as u64, statistics.samples, "{text}");
        assert_eq!(statistics.length_mm, 0.0);
        assert!(periods.iter().all(|p| p.period.contour_error_um == 0.0), "{text}");
    }
}

#[test]
fn blocks_of_no_length_change_nothing() {
    let machine = machine();
    let with = run("G1 X0 Y0 Z0 F3000\nX10\nX10\nX10.0000001\nX20\nX20\n", &machine);
    let without = run("G1 X0 Y0 Z0 F3000\nX10\nX20\n", &machine);
    assert_eq!(with.len(), without.len());
    for (a, b) in with.iter().zip(&without) {
        assert!((a.period.setpoint.position_mm - b.period.setpoint.position_mm).norm() < 1e-9);
    }
}
