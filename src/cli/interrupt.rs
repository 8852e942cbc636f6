//! Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use super::output::note;

/// Two signals closer together than this are one.
const TWICE: Duration = Duration::from_millis(300);

/// A flag that Ctrl-C raises, so that a run (a search) ends soon and in order; a second Ctrl-C ends the program at once.
pub(crate) fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    // Without a handler Ctrl-C just ends the program, which is no reason not to run.
    let first = OnceLock::new();
    let _ = ctrlc::set_handler(move || {
        // `timeout` and schedulers send one signal to the process and at once another to its group: that is one wish.
        let since = first.get_or_init(Instant::now).elapsed();
        if raised.swap(true, Ordering::Relaxed) && since > TWICE {
            std::process::exit(1);
        }
    });
    flag
}

/// Ctrl-C ends the program at once, with a word: for what leaves nothing half done.
pub(crate) fn end_when_interrupted(word: &'static str) {
    // Without a handler Ctrl-C just ends the program.
    let _ = ctrlc::set_handler(move || {
        note(word);
        std::process::exit(1);
    });
}
