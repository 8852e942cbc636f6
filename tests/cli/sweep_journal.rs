//! Sweeps that are killed, damaged, sharded and merged.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::common::folder::Folder;
use crate::common::sweep::{computed, grid, line, plan, tables};
use predicates::str::contains;
use servosim::sweep::{Journal, Method, Metric, Session, Shard, Start, Sweep, SweepError, export, merge};

/// A small sweep with an invalid point, its tables, and its journal as it is before it is removed.
fn small(folder: &Path) -> (Sweep, [Vec<u8>; 2], Vec<u8>) {
    // A few samples a run: this sweep is computed thousands of times.
    let mut document = line();
    document.set("control.period_s=0.02").unwrap();
    let sweep = grid(&document, &["axes.x.pdff.kpp=-1,60,97", "axes.y.pdff.kpp=80,97"]);
    computed(&sweep, folder, 2);
    let journal = fs::read(folder.join("line-sweep.journal")).unwrap();
    (sweep, tables(folder, "line"), journal)
}

#[test]
fn a_kill_at_any_byte_loses_nothing_and_changes_no_byte() {
    let whole = tempfile::tempdir().unwrap();
    let (sweep, tables_whole, journal) = small(whole.path());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("line-sweep.journal");
    // 6 points in blocks of 2, of 57 bytes a point and 20 a block.
    let block = 2 * 57 + 20;
    let header = journal.len() - 3 * block;
    for cut in 0..=journal.len() {
        fs::write(&path, &journal[..cut]).unwrap();
        let blocks = cut.saturating_sub(header) / block;
        let session = Session::open(&sweep, folder.path(), Shard::WHOLE, false, Some(2)).unwrap();
        let kept = 2 * blocks as u64;
        let start = if blocks == 0 { Start::New } else { Start::Resumed(kept) };
        assert_eq!((session.start(), session.done()), (start, kept), "cut at {cut}");
        let mut computed = Vec::new();
        let finished = session.compute(None, &mut |done| computed.push(done)).unwrap();
        assert_eq!(computed.len(), 3 - blocks, "nothing is computed twice");
        assert_eq!(fs::read(&path).unwrap(), journal, "cut at {cut}");
        // The tables follow from the journal; a few cuts show it.
        if cut % 97 == 0 || cut == journal.len() {
            export(&sweep, &[finished], folder.path(), Metric::MAX_CONTOUR_ERROR, None).unwrap();
            assert_eq!(tables(folder.path(), "line"), tables_whole, "cut at {cut}");
        }
    }
}

#[test]
fn damage_anywhere_is_found_and_told_with_the_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let (sweep, _, journal) = small(folder.path());
    let path = folder.path().join("line-sweep.journal");
    for at in 0..journal.len() {
        let mut damaged = journal.clone();
        damaged[at] ^= 1 << (at % 8);
        fs::write(&path, &damaged).unwrap();
        let error = Session::open(&sweep, folder.path(), Shard::WHOLE, false, None).unwrap_err();
        let message = error.to_string();
        assert!(message.contains("line-sweep.journal"), "byte {at}: {message}");
        assert!(Journal::open(&path).is_err(), "byte {at}");
        match at {
            0..17 => assert!(matches!(error, SweepError::Foreign { .. }), "byte {at}: {message}"),
            _ => assert!(
                matches!(error, SweepError::Damaged { .. }) && message.contains("--fresh"),
                "byte {at}: {message}"
            ),
        }
        assert_eq!(fs::read(&path).unwrap(), damaged, "a damaged journal is left as it is");
    }
    // The second of three blocks is named.
    let mut damaged = journal.clone();
    damaged[journal.len() - 134 - 50] ^= 1;
    fs::write(&path, &damaged).unwrap();
    let message = Session::open(&sweep, folder.path(), Shard::WHOLE, false, None).unwrap_err().to_string();
    assert!(message.contains("block 2 of 3"), "{message}");
    // Bytes that nobody wrote behind the end.
    fs::write(&path, [journal.as_slice(), b"x"].concat()).unwrap();
    assert!(
        Session::open(&sweep, folder.path(), Shard::WHOLE, false, None).unwrap_err().to_string().contains("follow")
    );
    // --fresh starts anew, but throws away nothing that is no journal.
    fs::write(&path, &damaged).unwrap();
    let session = Session::open(&sweep, folder.path(), Shard::WHOLE, true, Some(2)).unwrap();
    assert_eq!(session.start(), Start::New);
    session.compute(None, &mut |_| {}).unwrap();
    assert_eq!(fs::read(&path).unwrap(), journal);
    fs::write(&path, "my notes").unwrap();
    assert!(Session::open(&sweep, folder.path(), Shard::WHOLE, true, None).is_err());
    assert_eq!(fs::read(&path).unwrap(), b"my notes");
}

#[test]
fn the_journal_of_another_sweep_is_refused_with_what_differs() {
    let folder = tempfile::tempdir().unwrap();
    let vary = ["axes.x.pdff.kpp=60:140", "axes.x.pdff.kpv=1:2"];
    let first = Sweep::new(&line(), &vary, &plan(Method::Sobol, 8, 1)).unwrap();
    Session::open(&first, folder.path(), Shard::WHOLE, false, None).unwrap().compute(None, &mut |_| {}).unwrap();
    let mut other = line();
    other.set("axes.y.pdff.kiv=251").unwrap();
    for (document, vary, plan, what) in [
        (line(), vary, plan(Method::Sobol, 8, 2), "the seed: 1 there, 2 here"),
        (line(), vary, plan(Method::Sobol, 16, 1), "the number of points: 8 there, 16 here"),
        (line(), vary, plan(Method::MonteCarlo, 8, 1), "the method: sobol there, monte-carlo here"),
        (line(), [vary[0], "axes.y.pdff.kpv=1:2"], plan(Method::Sobol, 8, 1), "the variables: axes.x.pdff.kpp, axes.x"),
        (line(), [vary[0], "axes.x.pdff.kpv=1:2.5"], plan(Method::Sobol, 8, 1), "the values of axes.x.pdff.kpv"),
        (other, vary, plan(Method::Sobol, 8, 1), "the scenario's text: `kiv = 50` there, `kiv = 251` here"),
    ] {
        let sweep = Sweep::new(&document, &vary, &plan).unwrap();
        let error = Session::open(&sweep, folder.path(), Shard::WHOLE, false, None).unwrap_err().to_string();
        assert!(
            error.contains("another sweep") && error.contains(what) && error.contains("--fresh"),
            "{what}: {error}"
        );
    }
}

#[test]
fn two_sessions_do_not_share_a_journal() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = grid(&line(), &["axes.x.pdff.kpp=60:140:8"]);
    let _first = Session::open(&sweep, folder.path(), Shard::WHOLE, false, None).unwrap();
    let error = Session::open(&sweep, folder.path(), Shard::WHOLE, true, None).unwrap_err().to_string();
    assert!(error.contains("being written by another sweep"), "{error}");
}

fn shards(sweep: &Sweep, folder: &Path, of: u32) -> Vec<PathBuf> {
    (1..=of)
        .map(|index| {
            let session = Session::open(sweep, folder, Shard { index, of }, false, Some(3)).unwrap();
            session.compute(None, &mut |_| {}).unwrap().path().to_owned()
        })
        .collect()
}

#[test]
fn shards_join_to_the_bytes_of_the_whole() {
    let whole = tempfile::tempdir().unwrap();
    let vary = ["axes.x.pdff.kpp=normal(±5%)", "feedrate.feed_mm_s=20:60", "control.derivative=backward,exact"];
    let sweep = Sweep::new(&line(), &vary, &plan(Method::LatinHypercube, 23, 9)).unwrap();
    computed(&sweep, whole.path(), 5);
    for of in [2, 3, 7, 23] {
        let folder = tempfile::tempdir().unwrap();
        let mut parts = shards(&sweep, folder.path(), of);
        assert!(parts[0].ends_with(format!("line-sweep.1-of-{of}.part")));
        let ranges: Vec<Range<u64>> = (1..=of).map(|index| Shard { index, of }.range(23)).collect();
        assert!(ranges[0].start == 0 && ranges.last().unwrap().end == 23);
        assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start && !pair[0].is_empty()));
        parts.reverse();
        let (joined, journals) = merge(&parts).unwrap();
        export(&joined, &journals, folder.path(), Metric::MAX_CONTOUR_ERROR, None).unwrap();
        assert_eq!(tables(folder.path(), "line"), tables(whole.path(), "line"), "{of} shards");
        // A shard that is there already is not computed again.
        let session = Session::open(&sweep, folder.path(), Shard { index: 1, of }, false, None).unwrap();
        assert_eq!(session.start(), Start::Finished);
        session.compute(None, &mut |_| panic!("computed again")).unwrap();
        assert!(!folder.path().join(format!("line-sweep.1-of-{of}.journal")).exists());
    }
}

#[test]
fn parts_that_do_not_make_a_whole_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let sampled = |seed| Sweep::new(&line(), &["axes.x.pdff.kpp=60:140"], &plan(Method::Sobol, 12, seed)).unwrap();
    let at = |name: &str| folder.path().join(name);
    let four = shards(&sampled(1), &at("a"), 4);
    let three = shards(&sampled(1), &at("b"), 3);
    let other = shards(&sampled(2), &at("c"), 4);
    let refused = |parts: &[&PathBuf]| {
        merge(&parts.iter().map(|part| (*part).clone()).collect::<Vec<_>>()).unwrap_err().to_string()
    };
    for (parts, wanted) in [
        (vec![&four[0], &four[2]], "shards 2/4, 4/4 of the sweep are missing"),
        (vec![&four[0], &four[1], &four[2]], "shard 4/4 of the sweep is missing"),
        (vec![&four[0], &four[1], &four[2], &four[3], &four[1]], "are both shard 2/4"),
        (vec![&four[0], &three[1], &three[2]], "divided in two ways, and the parts overlap"),
        (vec![&four[0], &other[1], &four[2], &four[3]], "what differs is the seed: 1 in the first, 2 in the second"),
        (vec![], "nothing to join"),
        (vec![&at("none.part")], "cannot read"),
        (vec![&folder.path().to_owned()], "is a folder"),
    ] {
        let message = refused(&parts);
        assert!(message.contains(wanted), "{wanted}: {message}");
    }
    // Cut short, empty, damaged, of another kind.
    let bytes = fs::read(&four[1]).unwrap();
    let changed = |bytes: &[u8]| {
        fs::write(at("changed.part"), bytes).unwrap();
        refused(&[&four[0], &at("changed.part"), &four[2], &four[3]])
    };
    assert!(changed(&bytes[..bytes.len() - 1]).contains("is not complete: 0 of 3 points"));
    assert!(changed(b"").contains("ends before its first point"));
    assert!(changed(b"hello").contains("is not a journal"));
    let mut damaged = bytes.clone();
    *damaged.last_mut().unwrap() ^= 0x40;
    assert!(changed(&damaged).contains("block 1 of 1 is not what was written: its checksum does not fit"));
}

#[test]
fn tables_do_not_depend_on_blocks_or_cores() {
    let folder = Folder::new();
    folder.write("line.toml", line().text());
    let command = "sweep line.toml --vary axes.x.pdff.kpp=60:140:9 --vary feedrate.feed_mm_s=20:60:5 --quiet";
    let sweep = grid(&line(), &["axes.x.pdff.kpp=60:140:9", "feedrate.feed_mm_s=20:60:5"]);
    for threads in ["1", "3"] {
        folder.servosim(&format!("{command} --output t{threads}")).env("RAYON_NUM_THREADS", threads).assert().success();
    }
    let first = tables(&folder.path("t1"), "line");
    assert_eq!(first, tables(&folder.path("t3"), "line"));
    for block in [1, 7, 1000] {
        let out = folder.path(&format!("b{block}"));
        computed(&sweep, &out, block);
        assert_eq!(first, tables(&out, "line"), "blocks of {block}");
    }
}

#[test]
fn shards_and_merge_on_the_command_line() {
    let folder = Folder::new();
    folder.write("line.toml", line().text());
    let sweep = "sweep line.toml --vary axes.x.pdff.kpp=60:140:11";
    folder.servosim(&format!("{sweep} --output whole")).assert().success();
    for shard in ["1/2", "2/2"] {
        folder
            .servosim(&format!("{sweep} --shard {shard}"))
            .assert()
            .success()
            .stderr(contains("servosim merge output"));
    }
    folder.servosim("merge output/line-sweep.1-of-2.part").assert().code(2).stderr(contains("shard 2/2"));
    folder
        .servosim("merge output/line-sweep.2-of-2.part output/line-sweep.1-of-2.part")
        .assert()
        .success()
        .stdout(contains("line: 11 points"));
    assert_eq!(tables(&folder.path("output"), "line"), tables(&folder.path("whole"), "line"));
    let svg = |name: &str| fs::read(folder.path(name).join("line-sweep.svg")).unwrap();
    assert_eq!(svg("output"), svg("whole"));
}

#[cfg(unix)]
#[test]
fn killed_or_interrupted_the_same_command_goes_on() {
    use std::process::{Command, Stdio};
    let folder = Folder::new();
    // Long enough to be hit: some seconds of runs, many blocks.
    let sweep = "sweep alpha --set control.period_s=0.0002 --vary axes.x.pdff.kpp=60:140:240 --plots none";
    let journal = folder.path("output/alpha-sweep.journal");
    let length = || fs::metadata(&journal).map_or(0, |meta| meta.len());
    for (signal, code) in [("KILL", None), ("INT", Some(1))] {
        let before = length();
        let mut process = folder.process(sweep).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        // At least one more block than before (of 57 bytes a point, and more than the header's few kilobytes).
        let enough = before.max(6000) + 1000;
        for _ in 0..3000 {
            if length() > enough || process.try_wait().unwrap().is_some() {
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        Command::new("kill").args([format!("-{signal}"), process.id().to_string()]).status().unwrap();
        let output = process.wait_with_output().unwrap();
        assert_eq!(output.status.code(), code, "{signal}");
        assert!(length() > before, "{signal}: the journal stays");
        if code.is_some() {
            let told = String::from_utf8(output.stderr).unwrap();
            assert!(
                told.contains("interrupted after") && told.contains("the same command continues from there"),
                "{told}"
            );
        }
    }
    // What a killed process has left unfinished goes with the next one.
    let mut ended = Command::new("true").spawn().unwrap();
    ended.wait().unwrap();
    let left = format!("output/.alpha-sweep.csv.{}.part", ended.id());
    folder.write(&left, "half");
    folder.servosim(sweep).assert().success().stderr(contains("going on after"));
    assert!(!folder.path(&left).exists());
    folder.servosim(&format!("{sweep} --output whole")).assert().success();
    assert_eq!(tables(&folder.path("output"), "alpha"), tables(&folder.path("whole"), "alpha"));
    assert!(!journal.exists());
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_told_and_what_is_there_stays_usable() {
    use std::process::Command;
    let folder = Folder::new();
    folder.write("line.toml", line().text());
    let program = env!("CARGO_BIN_EXE_servosim");
    // A file may not grow beyond 8 blocks of 1 KiB, and the signal that would end the program is ignored.
    let limited = format!(
        "trap '' XFSZ; ulimit -f 8; exec {program} sweep line.toml --vary axes.x.pdff.kpp=60:140:1000 --plots none"
    );
    let output = Command::new("bash").args(["-c", &limited]).current_dir(folder.0.path()).output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("cannot write output/line-sweep.journal") && told.contains("of 1000 points"), "{told}");
    let kept = fs::metadata(folder.path("output/line-sweep.journal")).unwrap().len();
    assert!(kept <= 8 << 10);
    folder.servosim("sweep line.toml --vary axes.x.pdff.kpp=60:140:1000 --plots none").assert().success();
    assert_eq!(fs::read_dir(folder.path("output")).unwrap().count(), 2, "nothing else is left");
}
