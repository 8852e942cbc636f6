//! The C programs that the loops are held against.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// `benches/speed/NAME.c`, compiled beside the bench's own binary; none where there is no compiler.
pub(crate) fn compile(name: &str, flags: &[&str]) -> Option<PathBuf> {
    let source = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("benches/speed/{name}.c"));
    let program = std::env::current_exe().ok()?.with_extension(format!("{name}{}.out", flags.concat()));
    let done = Command::new("cc")
        .args(["-O3", "-march=native", "-o"])
        .arg(&program)
        .args(flags)
        .arg(&source)
        .arg("-lm")
        .status()
        .is_ok_and(|status| status.success());
    done.then_some(program)
}

/// Runs a program with `passes` and `input`; the two numbers that it prints.
pub(crate) fn run(program: &PathBuf, passes: usize, input: &[u8]) -> (f64, f64) {
    let mut child = Command::new(program)
        .arg(passes.to_string())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the C program was just compiled");
    child.stdin.take().expect("piped").write_all(input).expect("the C program reads its input");
    let output = child.wait_with_output().expect("the C program ends");
    let text = String::from_utf8_lossy(&output.stdout);
    let mut numbers = text.split_whitespace().map(|n| n.parse().expect("two numbers"));
    (numbers.next().expect("a time"), numbers.next().expect("a sum"))
}
