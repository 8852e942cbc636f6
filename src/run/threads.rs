//! Threads of the system, or none.

use std::sync::{OnceLock, mpsc};
use std::thread;

use rayon::ThreadPoolBuilder;

/// Makes runs go on where the system gives no threads (`RLIMIT_NPROC`, a container's limit): on as many as there are, at least on this one.
/// To be called once, before anything is computed, by a program; libraries that share a process with others leave it to them.
///
/// Results do not depend on the number of threads.
pub fn prepare_threads() {
    let wanted = wanted();
    let given = given(wanted);
    if given < wanted {
        let builder = ThreadPoolBuilder::new().num_threads(given.max(1));
        let builder = if given == 0 { builder.use_current_thread() } else { builder };
        // It fails where there is a pool already: then there were threads.
        let _ = builder.build_global();
    }
    let _ = GIVEN.set(given);
}

static GIVEN: OnceLock<usize> = OnceLock::new();

/// Whether there is a thread beside this one, as far as [`prepare_threads`] has looked.
pub fn has_threads() -> bool {
    GIVEN.get().is_none_or(|given| *given > 0)
}

/// How many threads the computation wants.
fn wanted() -> usize {
    let set = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.parse().ok()).filter(|threads| *threads > 0);
    set.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from))
}

/// How many of them there are, all at a time.
fn given(wanted: usize) -> usize {
    let mut threads = Vec::with_capacity(wanted);
    for _ in 0..wanted {
        // It waits until the other end of its channel is dropped.
        let (hold, held) = mpsc::channel::<()>();
        match thread::Builder::new().spawn(move || held.recv().is_ok()) {
            Ok(handle) => threads.push((hold, handle)),
            Err(_) => break,
        }
    }
    let count = threads.len();
    for (hold, handle) in threads {
        drop(hold);
        // It has nothing to fail at.
        let _ = handle.join();
    }
    count
}
