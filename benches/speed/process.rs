//! `servosim run` as a process, from start to exit, beside `servosim --version` (starting the program alone).

use std::process::{Command, Stdio};

use crate::{fastest, seconds};

pub(crate) fn bench(quick: bool) {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |arguments: &[&str]| {
        let (time, status) = seconds(|| {
            Command::new(env!("CARGO_BIN_EXE_servosim"))
                .args(arguments)
                .current_dir(folder.path())
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .status()
                .expect("the program starts")
        });
        assert!(status.success(), "{arguments:?}");
        1e3 * time
    };
    let rounds = if quick { 1 } else { 40 };
    for (name, arguments, promised) in [
        ("servosim --version", vec!["--version"], ""),
        (
            "servosim run alpha.toml, no plots",
            vec!["run", "alpha.toml", "--plots", "none"],
            "  (promised: under 30 ms)",
        ),
        ("servosim run alpha.toml, SVG plots", vec!["run", "alpha.toml"], ""),
    ] {
        let time = fastest((0..rounds).map(|_| run(&arguments)));
        println!("{name:<36} {time:7.2} ms{promised}");
    }
}
