//! Sweeps: where the points lie, what the metrics are, tables, pictures and the command line.

use std::fs;
use std::ops::Range;

use crate::common::folder::Folder;
use crate::common::sweep::{KPP, alpha, computed, grid, line, numbers, plan, refused, tables};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use predicates::prelude::*;
use predicates::str::contains;
use servosim::analysis::DriveLoop;
use servosim::report::{Format, SweepAxis, SweepCell, SweepPicture, SweepPlot};
use servosim::servo::effects::Delay;
use servosim::sweep::{Method, Metric, Plan, Session, Shard, Status, Sweep, SweepError, export};

#[test]
fn validates_grid_points_against_closed_forms() {
    let sweep =
        grid(&alpha(), &["axes.x.pdff.kpp=60:140:81", "axes.x.pdff.kpv=0.01:100:9:log", "feedrate.feed_mm_s=50,75"]);
    assert_eq!(sweep.count(), 81 * 9 * 2);
    for index in 0..sweep.count() {
        let [kpp, kpv, feed] = numbers(&sweep, index)[..] else { panic!() };
        let (i, j, k) = (index / 18, index / 2 % 9, index % 2);
        // Whole steps are exact; of the logarithm all but a few roundings are.
        assert_eq!(kpp, 60.0 + i as f64);
        let exact = 10_f64.powf(-2.0 + 0.5 * j as f64);
        assert!((kpv / exact - 1.0).abs() < 1e-14, "{kpv} instead of {exact}");
        assert_eq!(feed, if k == 0 { 50.0 } else { 75.0 });
    }
    // Both ends are exactly what was written, whatever the rounding between them.
    let sweep = grid(&alpha(), &["axes.x.pdff.kpp=0.1:0.7:8:log"]);
    assert_eq!((numbers(&sweep, 0)[0], numbers(&sweep, 7)[0]), (0.1, 0.7));
    // Relative to the scenario's own value, the key of the chosen table left out.
    let sweep = grid(&alpha(), &["axes.x.plant.gain_rad_s_v=±20%:3", "control.settling_s=+-0.05:2"]);
    assert_eq!(sweep.definition().variables[0].key, "axes.x.plant.first_order.gain_rad_s_v");
    let own = 83.0089;
    for (index, gain) in [(0, 0.8 * own), (2, own), (4, 1.2 * own)] {
        assert!((numbers(&sweep, index)[0] / gain - 1.0).abs() < 1e-15);
    }
    assert_eq!((numbers(&sweep, 0)[1], numbers(&sweep, 1)[1]), (0.1 - 0.05, 0.1 + 0.05));
}

#[test]
fn validates_latin_hypercubes_by_their_strata() {
    for (count, seed) in [(1, 0), (2, 1), (97, 2), (1000, 3)] {
        let vary = ["axes.x.pdff.kpp=0:1", "axes.x.pdff.kpv=1:3", "axes.y.pdff.kpp=0.001:1000:log"];
        let sweep = Sweep::new(&alpha(), &vary, &plan(Method::LatinHypercube, count, seed)).unwrap();
        for variable in 0..3 {
            let share = |value: f64| match variable {
                0 => value,
                1 => 0.5 * (value - 1.0),
                _ => (value.log10() + 3.0) / 6.0,
            };
            let mut strata: Vec<f64> =
                (0..count).map(|i| (share(numbers(&sweep, i)[variable]) * count as f64).floor()).collect();
            if count > 50 {
                assert!(!strata.is_sorted(), "the order is mixed");
            }
            strata.sort_by(f64::total_cmp);
            assert!(strata.iter().copied().eq((0..count).map(|i| i as f64)), "{count} {variable}");
        }
    }
}

/// Square of the L2 star discrepancy (Warnock 1972) of points in the unit cube.
fn discrepancy(points: &[Vec<f64>]) -> f64 {
    let (n, d) = (points.len() as f64, i32::try_from(points[0].len()).unwrap());
    let one: f64 = points.iter().map(|p| p.iter().map(|x| 0.5 * (1.0 - x * x)).product::<f64>()).sum();
    let pairs = points.iter().flat_map(|p| points.iter().map(move |q| (p, q)));
    let two: f64 = pairs.map(|(p, q)| p.iter().zip(q).map(|(x, y)| 1.0 - x.max(*y)).product::<f64>()).sum();
    3_f64.powi(-d) - 2.0 / n * one + two / (n * n)
}

#[test]
fn validates_sobol_discrepancy_below_that_of_chance() {
    let cube = ["axes.x.pdff.kpp=0:1", "axes.x.pdff.kpv=0:1", "axes.y.pdff.kpp=0:1", "axes.y.pdff.kpv=0:1"];
    let measured = |method, seed| {
        let sweep = Sweep::new(&alpha(), &cube, &plan(method, 256, seed)).unwrap();
        discrepancy(&(0..256).map(|i| numbers(&sweep, i)).collect::<Vec<_>>())
    };
    // Expected of random points: (2^-d - 3^-d)/n.
    let chance = (2_f64.powi(-4) - 3_f64.powi(-4)) / 256.0;
    let random = (0..10).map(|seed| measured(Method::MonteCarlo, seed)).sum::<f64>() / 10.0;
    assert!((0.5..2.0).contains(&(random / chance)), "{random} {chance}");
    for seed in 0..10 {
        let sobol = measured(Method::Sobol, seed);
        assert!(sobol < 0.15 * chance, "seed {seed}: {sobol} against {chance}");
    }
}

#[test]
fn validates_normal_samples_by_their_distribution() {
    for method in [Method::MonteCarlo, Method::LatinHypercube, Method::Sobol] {
        let n = 4096;
        let sweep = Sweep::new(&alpha(), &["axes.x.pdff.kpp=normal(100, 5)"], &plan(method, n, 11)).unwrap();
        let z: Vec<f64> = (0..n).map(|i| (numbers(&sweep, i)[0] - 100.0) / 5.0).collect();
        let mean = z.iter().sum::<f64>() / n as f64;
        let variance = z.iter().map(|z| z * z).sum::<f64>() / n as f64;
        // Four standard errors of independent samples; the others lie far within.
        assert!(mean.abs() < 4.0 / (n as f64).sqrt(), "{method}: mean {mean}");
        assert!((variance - 1.0).abs() < 4.0 * (2.0 / n as f64).sqrt(), "{method}: variance {variance}");
        let below = |x: f64| z.iter().filter(|z| **z < x).count() as f64 / n as f64;
        for (x, share) in [(-1.644_853_6, 0.05), (0.0, 0.5), (1.959_964, 0.975)] {
            assert!((below(x) - share).abs() < 0.03, "{method}: {x}");
        }
    }
}

#[test]
fn a_seed_chooses_the_points_and_nothing_else_does() {
    let vary = ["axes.x.pdff.kpp=±20%", "axes.x.pdff.kpv=normal(±5%)"];
    for method in [Method::MonteCarlo, Method::LatinHypercube, Method::Sobol] {
        let points = |seed| {
            let sweep = Sweep::new(&alpha(), &vary, &plan(method, 64, seed)).unwrap();
            (0..64).map(|i| numbers(&sweep, i)).collect::<Vec<_>>()
        };
        assert_eq!(points(5), points(5));
        assert!(points(5).iter().zip(points(6)).all(|(a, b)| *a != b), "{method}");
    }
    // The digits are the same on every machine: three hashes, a generator and libm stand behind them.
    let sweep = Sweep::new(&alpha(), &vary, &plan(Method::MonteCarlo, 3, 1)).unwrap();
    insta::assert_json_snapshot!(
        "regression_monte_carlo_points",
        (0..3).map(|i| numbers(&sweep, i)).collect::<Vec<_>>()
    );
}

#[test]
fn validates_figures_against_single_runs() {
    // Parameters of the axes, which are written straight into the loop; values that make a new scenario; both together; a
    // plant from its mechanics, of which the drive is a part.
    let mut mechanics = alpha();
    mechanics.set("axes.x.plant.mechanics={mass_kg=20, inertia_kg_m2=1e-4, viscous_friction_nm_s_rad=0.0086}").unwrap();
    for (document, vary) in [
        (alpha(), vec!["axes.x.pdff.kpp=60:140:3", "axes.y.pdff.kvf=0.7,1", "axes.x.drive.voltage_limit_v=1,5"]),
        (alpha(), vec!["axes.y.plant.gain_rad_s_v=±20%:2", "axes.x.plant.time_constant_s=±20%:2"]),
        (alpha(), vec!["feedrate.feed_mm_s=50,120", "control.derivative=\"backward\",exact"]),
        (alpha(), vec!["axes.x.pdff.kpp=80,90", "feedrate.profile.quintic.phase_s=0.1,0.2", "axes.y.pdff.kpp=90,100"]),
        (mechanics, vec!["axes.x.drive.torque_to_voltage_v_nm=±10%:2", "axes.x.plant.mass_kg=10,30"]),
    ] {
        let sweep = grid(&document, &vary);
        let rows = sweep.evaluate(0..sweep.count(), None).unwrap();
        for index in 0..sweep.count() {
            let mut single = document.clone();
            for (variable, value) in sweep.definition().variables.iter().zip(sweep.values(index)) {
                single.set(&format!("{}={value}", variable.key)).unwrap();
            }
            let summary = single.scenario().unwrap().run(&mut []).unwrap();
            let place = usize::try_from(index).unwrap();
            // The batch measures the contouring error within 1 nm.
            for (name, value) in [
                ("max_contour_error_um", summary.max_contour_error_um),
                ("rms_contour_error_um", summary.rms_contour_error_um),
                ("max_tracking_error_um", summary.max_tracking_error_um),
                ("rms_tracking_error_um", summary.rms_tracking_error_um),
                ("peak_voltage_x_v", summary.axes[0].peak_voltage_v),
                ("peak_voltage_y_v", summary.axes[1].peak_voltage_v),
                ("saturated_share", summary.saturated_share),
            ] {
                let ours = rows.metric(place, name);
                let tolerance = if name.contains("contour") { 1e-3 } else { 1e-9 * value.max(1.0) };
                assert!((ours - value).abs() <= tolerance, "{vary:?} {index} {name}: {ours}, {value}");
            }
            let status = match (summary.locked_up, summary.saturated_share > 0.0) {
                (true, _) => Status::LockedUp,
                (false, true) => Status::Saturated,
                (false, false) => Status::Ok,
            };
            assert_eq!(rows.status[place], status, "{vary:?} {index}");
        }
    }
}

#[test]
fn margins_are_those_of_the_analysis() {
    let folder = tempfile::tempdir().unwrap();
    // The smallest velocity gain leaves no stable loop.
    let vary = ["axes.x.pdff.kpv=0.001,0.05,0.4,1", "axes.y.pdff.kpp=-1,97"];
    let sweep = Sweep::new(&line(), &vary, &Plan { margins: true, ..Plan::default() }).unwrap();
    let rows = sweep.evaluate(0..8, None).unwrap();
    let scenario = sweep.scenario();
    let mut unstable = 0;
    for place in 0..8 {
        let mut axes = scenario.axes;
        axes[0].pdff.kpv_nm_s_rad = numbers(&sweep, place as u64)[0];
        let expected = axes.map(|axis| servosim::analysis::margins(&axis, &scenario.settings));
        for (axis, margins) in ["x", "y"].into_iter().zip(expected) {
            unstable += u32::from(!margins.stable);
            for (name, value) in [
                (format!("peak_sensitivity_{axis}"), margins.peak_sensitivity),
                (format!("gain_down_{axis}"), margins.gain_down),
                (format!("gain_up_{axis}"), margins.gain_up),
                (format!("phase_margin_{axis}_deg"), margins.phase_margin_deg),
                (format!("delay_margin_{axis}_s"), margins.delay_margin_s),
            ] {
                let ours = rows.metric(place, &name);
                let fits = if place % 2 == 0 { ours.is_nan() } else { ours == value };
                assert!(fits, "{place} {name}: {ours}, {value}");
            }
        }
    }
    assert!(unstable > 0, "an infinite peak sensitivity is among them");
    // They pass through the journal into the tables, an infinite one too; and the best of a margin is the largest.
    let session = Session::open(&sweep, folder.path(), Shard::WHOLE, false, Some(3)).unwrap();
    let journals = [session.compute(None, &mut |_| {}).unwrap()];
    let metric = Metric::find("delay_margin_x_s").unwrap();
    let best = export(&sweep, &journals, folder.path(), metric, None).unwrap().outcome.best.unwrap();
    let largest = (0..8).map(|place| rows.metric(place, metric.name())).fold(0.0, f64::max);
    assert_eq!(best.metrics[15], largest);
    let csv = String::from_utf8(tables(folder.path(), "line")[0].clone()).unwrap();
    assert!(
        csv.lines().next().unwrap().ends_with("delay_margin_x_s,delay_margin_y_s") && csv.contains(",inf,"),
        "{csv}"
    );
    // A sweep without them has no such column.
    let without = grid(&line(), &vary);
    let error = export(&without, &journals, folder.path(), metric, None).unwrap_err().to_string();
    assert!(error.contains("without margins"), "{error}");
}

/// Of a drive that is more than its model, margins and stability are those of the detailed drive model.
#[test]
fn margins_of_a_drive_as_it_is_are_those_of_its_analysis() {
    let mut document = alpha();
    document.set("axes.x.effects.delay.samples=0.5").unwrap();
    document.set("axes.x.effects.backlash.gap_um=1").unwrap();
    let vary = ["axes.x.pdff.kpv=0.4,1.19,4", "axes.x.effects.delay.samples=0.2,0.9"];
    let sweep = Sweep::new(&document, &vary, &Plan { margins: true, ..Plan::default() }).unwrap();
    let rows = sweep.evaluate(0..6, None).unwrap();
    let mut stable = Vec::new();
    for place in 0..6 {
        let values = numbers(&sweep, place as u64);
        let mut scenario = sweep.scenario().clone();
        scenario.axes[0].pdff.kpv_nm_s_rad = values[0];
        scenario.drives[0].effects.delay = Some(Delay { samples: values[1] });
        let own: Vec<_> = (0..2)
            .map(|i| DriveLoop::new(&scenario.axes[i], &scenario.drives[i], &scenario.settings).unwrap().margins())
            .collect();
        for (axis, margins) in ["x", "y"].into_iter().zip(&own) {
            for (name, value) in [
                (format!("peak_sensitivity_{axis}"), margins.peak_sensitivity),
                (format!("gain_up_{axis}"), margins.gain_up),
                (format!("phase_margin_{axis}_deg"), margins.phase_margin_deg),
                (format!("delay_margin_{axis}_s"), margins.delay_margin_s),
            ] {
                assert_eq!(rows.metric(place, &name).to_bits(), value.to_bits(), "{place} {name}");
            }
        }
        // The other axis is its model.
        let model = servosim::analysis::margins(&scenario.axes[1], &scenario.settings);
        assert_eq!(rows.metric(place, "peak_sensitivity_y"), model.peak_sensitivity);
        assert_eq!(sweep.is_stable(place as u64), own.iter().all(|margins| margins.stable));
        stable.push(own[0].stable);
    }
    // The ideal model is stable with the gain in the middle, and would call its delay margin one.
    assert!(stable.contains(&true) && stable.contains(&false), "{stable:?}");
    assert!(rows.metric(2, "delay_margin_x_s") > rows.metric(3, "delay_margin_x_s") + 0.5e-3);
}

/// kpp = 100 with kpv = 0.25 has poles at 1.001, which do not grow much in a second: its error is the smallest of all.
#[test]
fn regression_the_best_point_has_stable_loops() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = grid(&alpha(), &["x.kpp=100", "x.kpv=0.25129227,1.19"]);
    assert_eq!((sweep.is_stable(0), sweep.is_stable(1)), (false, true));
    let rows = sweep.evaluate(0..2, None).unwrap();
    assert_eq!(rows.status, [Status::Ok; 2]);
    assert!(rows.metric(0, "max_contour_error_um") < rows.metric(1, "max_contour_error_um"));
    assert_eq!(computed(&sweep, folder.path(), 2).outcome.best.unwrap().index, 1);
}

#[test]
fn points_do_not_depend_on_the_range_they_are_computed_in() {
    let vary = ["axes.x.pdff.kpp=20:200", "feedrate.feed_mm_s=20,50,60", "axes.y.pdff.kpv=-0.2:2"];
    let sweep = Sweep::new(&line(), &vary, &plan(Method::Sobol, 200, 3)).unwrap();
    let all = sweep.evaluate(0..200, None).unwrap();
    assert!(all.status.contains(&Status::Invalid) && all.status.contains(&Status::Ok));
    let bits = |metrics: &[f64]| metrics.iter().map(|metric| metric.to_bits()).collect::<Vec<_>>();
    let ranges: [Range<u64>; 4] = [0..1, 7..60, 60..137, 199..500];
    for range in ranges {
        let some = sweep.evaluate(range.clone(), None).unwrap();
        assert_eq!(some.len() as u64, range.end.min(200) - range.start);
        for place in 0..some.len() {
            let index = place + usize::try_from(range.start).unwrap();
            assert_eq!(some.status[place], all.status[index]);
            assert_eq!(bits(some.metrics_of(place)), bits(all.metrics_of(index)));
        }
    }
}

#[test]
fn a_point_that_makes_no_scenario_is_a_row() {
    let sweep = grid(&line(), &["axes.x.pdff.kpp=-1,97", "feedrate.feed_mm_s=0,50"]);
    let folder = tempfile::tempdir().unwrap();
    let outcome = computed(&sweep, folder.path(), 2).outcome;
    assert_eq!((outcome.ok, outcome.invalid, outcome.best.unwrap().index), (1, 3, 3));
    let csv = String::from_utf8(tables(folder.path(), "line")[0].clone()).unwrap();
    assert!(csv.contains("\n1,-1,50,invalid,,,,,,,\n"), "{csv}");
    assert!(sweep.why_invalid(1).unwrap().contains("kpp = -1"));
    assert!(sweep.why_invalid(2).unwrap().contains("feed_mm_s"));
    assert_eq!(sweep.why_invalid(3), None);

    let sweep = grid(&line(), &["axes.x.pdff.kpp=-2,-1"]);
    let session = Session::open(&sweep, folder.path(), Shard::WHOLE, true, None).unwrap();
    let journal = session.compute(None, &mut |_| {}).unwrap();
    let error = export(&sweep, &[journal], folder.path(), Metric::MAX_CONTOUR_ERROR, None).unwrap_err().to_string();
    assert!(error.contains("none of the 2 points can be run") && error.contains("kpp = -2"), "{error}");
}

#[test]
fn too_many_points_are_refused_with_their_number() {
    let counted = |counts: &[&str]| {
        let keys = ["axes.x.pdff.kpp", "axes.x.pdff.kpv", "axes.x.pdff.kiv", "axes.y.pdff.kpp", "axes.y.pdff.kpv"];
        let vary: Vec<String> = keys.iter().zip(counts).map(|(key, count)| format!("{key}=1:2:{count}")).collect();
        refused(&vary.iter().map(String::as_str).collect::<Vec<_>>(), &Plan::default())
    };
    assert!(counted(&["1000000", "1000000"]).contains("the sweep has 1000000000000 points; at most 100000000"));
    assert!(counted(&["100000001"]).contains("has 100000001 points"));
    // Beyond 64 and 128 bits, and a count that is beyond 64 bits by itself.
    assert!(counted(&["10000000000", "10000000000"]).contains("has 100000000000000000000 points"));
    assert!(counted(&["10000000000"; 5]).contains("has 100000000000000000000000000000000000000000000000000 points"));
    assert!(counted(&["123456789012345678901234567890"]).contains("has 123456789012345678901234567890 points"));
    assert!(
        refused(&["axes.x.pdff.kpp=1:2"], &plan(Method::Sobol, 1_000_000_000_000, 0))
            .contains("has 1000000000000 points")
    );
}

#[test]
fn what_makes_no_sense_is_refused_with_what_to_write() {
    let long = "axes.x.pdff.kpp=".to_owned() + &["1"; 9].join(",");
    for (vary, wanted) in [
        ("axes.x.pdff.kpp=140:60:3", "the lower one comes first: 60:140:3"),
        ("axes.x.pdff.kpp=60:60:3", "both bounds are the same"),
        ("axes.x.pdff.kpp=60:140:0", "a count of 0"),
        ("axes.x.pdff.kpp=60:140:1", "a count of 1"),
        ("axes.x.pdff.kpp=60:140:-3", "`-3` is not a count"),
        ("axes.x.pdff.kpp=60:140:8.5", "`8.5` is not a count"),
        ("axes.x.pdff.kpp=60:140:8:lin", "`lin` is not known here"),
        ("axes.x.pdff.kpp=0:140:8:log", "must be positive"),
        ("axes.x.pdff.kpp=nan:140:3", "`nan` is not a finite number"),
        ("axes.x.pdff.kpp=60:inf:3", "`inf` is not a finite number"),
        ("axes.x.pdff.kpp=60,nan", "`nan` is not a finite number"),
        ("axes.x.pdff.kpp=-1e308:1e308:3", "too wide"),
        ("axes.x.pdff.kpp=60,,70", "a value of the list is missing"),
        (&long, "in the list twice"),
        ("axes.x.pdff.kpp=60,abc", "must be a number"),
        ("axes.x.pdff.kpp=", "no values are given"),
        ("axes.x.pdff.kpp", "there is no `=`"),
        ("axes.x.pdff.kpp=±0%", "must be positive"),
        ("axes.x.pdff.kpp=±-5", "must be positive"),
        ("axes.x.pdff.kpp=±x%", "`x` is not a finite number"),
        ("control.delay_samples=±10%", "the scenario's own value is 0"),
        ("limits.voltage_v=±10%", "gives no number for limits.voltage_v"),
        ("axes.x.pdff.kpp=normal(97)", "needs a mean and a standard deviation"),
        ("axes.x.pdff.kpp=normal(97, 0)", "standard deviation must be positive"),
        ("axes.x.pdff.kp=60:140:3", "did you mean `axes.x.pdff.kpp`?"),
        ("kpp=60:140:3", "did you mean `axes.x.pdff.kpp`?"),
        ("axes.x.plant.mass_kg=1:2:3", "the scenario has chosen another table"),
        ("axes.x.pdff=1:2:3", "it is a table"),
        ("axes.x.pdff.kpp=60:140", "say how many points with --samples 1000"),
    ] {
        let message = refused(&[vary], &Plan::default());
        assert!(message.contains(wanted), "{vary}: {message}");
    }
    let both = ["axes.x.pdff.kpp=60:140:3", "axes.x.pdff.kpp=1,2"];
    assert!(refused(&both, &Plan::default()).contains("varied twice"));
    assert!(refused(&[], &Plan::default()).contains("nothing is varied"));
    let one = ["axes.x.pdff.kpp=60:140"];
    assert!(refused(&one, &plan(Method::Sobol, 0, 0)).contains("0 samples"));
    assert!(refused(&one, &plan(Method::Grid, 9, 0)).contains("omit --samples"));
    let grid = Plan { method: Some(Method::Grid), ..Plan::default() };
    assert!(refused(&one, &grid).contains("a grid needs counted values, and axes.x.pdff.kpp has a range"));
    // A scenario that is itself wrong is told of first.
    let mut wrong = alpha();
    wrong.set("axes.x.pdff.kpp=-1").unwrap();
    let error = Sweep::new(&wrong, &["axes.x.pdff.kpv=1:2:3"], &Plan::default()).unwrap_err();
    assert!(matches!(error, SweepError::Scenario(_)), "{error}");
}

#[test]
fn parquet_reads_back_as_the_csv_says() {
    let folder = tempfile::tempdir().unwrap();
    let vary = ["axes.x.pdff.kpp=-20:200", "control.derivative=\"backward\",\"exact\"", "axes.y.pdff.kpv=1e-7:2:log"];
    let sweep = Sweep::new(&line(), &vary, &plan(Method::Sobol, 64, 4)).unwrap();
    let files = computed(&sweep, folder.path(), 64).files;
    let reader = SerializedFileReader::new(fs::File::open(&files[0]).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    assert_eq!(metadata.num_rows(), 64);
    let pairs = metadata.key_value_metadata().unwrap();
    assert_eq!(pairs.len(), 1);
    let definition: servosim::sweep::Definition = serde_json::from_str(pairs[0].value.as_ref().unwrap()).unwrap();
    assert_eq!(definition, *sweep.definition());
    let csv = fs::read_to_string(&files[1]).unwrap();
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(
        header,
        [
            "index",
            KPP,
            "control.derivative",
            "axes.y.pdff.kpv",
            "status",
            "max_contour_error_um",
            "rms_contour_error_um",
            "max_tracking_error_um",
            "rms_tracking_error_um",
            "peak_voltage_x_v",
            "peak_voltage_y_v",
            "saturated_share",
        ]
    );
    let mut rows = 0;
    for (row, line) in reader.get_row_iter(None).unwrap().zip(lines) {
        rows += 1;
        for (((name, field), column), text) in row.unwrap().get_column_iter().zip(&header).zip(line.split(',')) {
            assert_eq!(name, column);
            match field {
                Field::Null => assert_eq!(text, ""),
                // To the last bit.
                Field::Double(value) => assert_eq!(value.to_bits(), text.parse::<f64>().unwrap().to_bits()),
                Field::Long(value) => assert_eq!(value.to_string(), text),
                Field::Str(value) => assert_eq!(value, text),
                other => panic!("{other:?}"),
            }
        }
    }
    assert_eq!(rows, 64);
    assert!(csv.contains(",invalid,,,,,,,\n") && csv.contains(",exact,") && !csv.contains('"'));
}

#[test]
fn a_sweep_on_the_command_line_tells_what_came_of_it() {
    let folder = Folder::new();
    folder
        .servosim("sweep alpha --vary axes.x.pdff.kpp=60:140:5 --vary axes.x.pdff.kpv=0.1,1.19")
        .assert()
        .success()
        .stdout(contains("alpha: 10 points, grid").and(contains("best point:")).and(contains("99 %")))
        .stderr("wrote output/alpha-sweep.parquet, output/alpha-sweep.csv and output/alpha-sweep.svg\n");
    assert!(!folder.path("output/alpha-sweep.journal").exists());
    let svg = fs::read_to_string(folder.path("output/alpha-sweep.svg")).unwrap();
    for text in [
        "max contouring error over axes.x.pdff.kpp",
        "10 points on a grid",
        "best:",
        "the scenario (97.38, 1.19)",
        "axes.x.pdff.kpv [N m s/rad]",
    ] {
        assert!(svg.contains(text), "{text}");
    }
    // The same again, as JSON; another metric; one variable; Monte Carlo.
    let command =
        "sweep alpha --vary axes.x.pdff.kpp=60:140:5 --format json --quiet --plots none --metric peak_voltage_x_v";
    let output = folder.servosim(command).assert().success().stderr("").get_output().clone();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["points"], &json["figure"]), (&5.into(), &"peak_voltage_x_v".into()));
    assert_eq!(json["percentiles"].as_array().unwrap().len(), 5);
    folder.servosim("sweep alpha --vary axes.x.pdff.kpp=60:140:5 --quiet").assert().success().stdout("").stderr("");
    folder
        .servosim("sweep alpha --vary axes.x.plant.gain_rad_s_v=±20% --vary axes.x.pdff.kpp=normal(±2%) --samples 6")
        .assert()
        .success()
        .stdout(contains("6 points, monte-carlo"));
    assert!(fs::read_to_string(folder.path("output/alpha-sweep.svg")).unwrap().contains("6 random points"));

    for (arguments, wanted) in [
        ("--vary axes.x.pdff.kpp=1:2:1000000000000", "1000000000000 points"),
        ("--vary axes.x.pdff.kpp=2:1:3", "the wrong way round"),
        ("--vary axes.x.pdff.kp=1:2:3", "did you mean"),
        ("--vary axes.x.pdff.kpp=1:2:3 --figure speed", "known here: max_contour_error_um"),
        ("--vary axes.x.pdff.kpp=1:2:3 --shard 3/2", "from 1/N to N/N"),
        ("--vary axes.x.pdff.kpp=-2:-1:3", "none of the 3 points can be run"),
        ("--vary name=1,2", "the first: wrong type"),
        ("", "--vary"),
    ] {
        folder.servosim(&format!("sweep alpha {arguments}")).assert().code(2).stdout("").stderr(contains(wanted));
    }
    folder.servosim("merge none.part").assert().code(1).stderr(contains("cannot read none.part"));
}

#[test]
fn every_picture_can_be_drawn() {
    let axis = |logarithmic| SweepAxis { title: "a <key> & more".to_owned(), logarithmic };
    let (good, locked, missing) = (SweepCell::Metric(3.0), SweepCell::LockedUp, SweepCell::Missing);
    let huge = [SweepCell::Metric(1e300), SweepCell::Metric(1e-300), SweepCell::Metric(0.0), SweepCell::Metric(-2.0)];
    let map = |cells: [SweepCell; 4], logarithmic, own, best| SweepPlot::Map {
        axes: [axis(logarithmic), axis(false)],
        edges: [vec![0.5, 1.5, 2.5], vec![-1.0, 0.0, 1e-9]],
        cells: cells.to_vec(),
        shared: true,
        own,
        best,
    };
    let scatter = |points: Vec<([f64; 2], SweepCell)>| SweepPlot::Scatter {
        axes: [axis(true), axis(true)],
        points,
        own: Some([-5.0, 1e9]),
        best: None,
    };
    let curve = |points: Vec<(f64, SweepCell)>, logarithmic| SweepPlot::Curve {
        axis: axis(logarithmic),
        points,
        own: Some(2.0),
        best: None,
    };
    let histogram = |values: Vec<f64>| SweepPlot::Histogram {
        percentiles: values.first().map(|value| vec![(5, *value), (50, *value)]).unwrap_or_default(),
        values,
    };
    for (plot, wanted) in [
        (map([good, locked, missing, good], true, Some([1.0, 0.0]), Some(([2.0, 0.0], 3.0))), "locked up"),
        (map([missing; 4], false, Some([9.0, 9.0]), None), "outside"),
        (map(huge, false, None, None), "a cell shows the worst"),
        (map([SweepCell::Empty; 4], false, None, None), "over"),
        (scatter(vec![([1.0, 2.0], good), ([3.0, 2.0], locked)]), "locked up"),
        (scatter(vec![([1.0, 2.0], missing)]), "no metric"),
        (scatter(Vec::new()), "outside"),
        (curve(vec![(1.0, good), (2.0, missing), (3.0, good), (4.0, locked)], true), "locked up"),
        (curve(vec![(1.0, good)], false), "the scenario (2)"),
        (curve(huge.map(|cell| (1.0, cell)).to_vec(), false), "over"),
        (curve(Vec::new(), true), "over"),
        (histogram(vec![1.0, 2.0, 2.0, 700.0]), "largest 700"),
        (histogram(vec![5.0; 3]), "largest 5"),
        (histogram(vec![-1e300, 0.0, 1e300]), "largest"),
        (histogram(Vec::new()), "over"),
    ] {
        let picture = SweepPicture {
            name: "part \u{7} <1>".to_owned(),
            caption: "4 points".to_owned(),
            metric: "error",
            unit: "µm",
            over: vec!["a".to_owned()],
            plot,
        };
        let svg = String::from_utf8(picture.draw(Format::Svg).unwrap()).unwrap();
        assert!(svg.contains(wanted), "{wanted}: {:?}", picture.plot);
        assert!(!svg.contains("NaN") && !svg.contains("inf") && !svg.contains('\u{7}'), "{:?}", picture.plot);
        assert_eq!(picture.draw(Format::Svg).unwrap(), svg.into_bytes());
    }
}
