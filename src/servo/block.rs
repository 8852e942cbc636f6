//! Axes through their samples: one alone, or a block of samples with every axis on a core of its own.

use std::sync::OnceLock;

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::axis::AxisSignals;
use super::reference::{Axis, AxisReference};
use crate::lane::{Kernel, narrow};

/// Shorter blocks are not worth another core's waking up.
const WORTH: usize = 64;

/// Threads that have nothing but axes to do: who waits for them never waits for something else. None where there is one core, or
/// where no threads are to be had.
fn cores() -> Option<&'static ThreadPool> {
    static POOL: OnceLock<Option<ThreadPool>> = OnceLock::new();
    let pool = || ThreadPoolBuilder::new().build().ok().filter(|pool| pool.current_num_threads() > 1);
    POOL.get_or_init(pool).as_ref()
}

/// One axis through its references.
struct Steps<'b, X, T, F> {
    axis: &'b mut X,
    references: &'b [AxisReference],
    outputs: &'b mut Vec<T>,
    output: &'b F,
}

impl<X: Axis, T, F: Fn(&X, AxisSignals) -> T> Kernel for Steps<'_, X, T, F> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        // Here, not beside the other axes': cores that write into one cache line wait for each other.
        let mut outputs = std::mem::take(self.outputs);
        for reference in self.references {
            let signals = self.axis.step(reference);
            outputs.push((self.output)(self.axis, signals));
        }
        *self.outputs = outputs;
    }
}

/// One sample of one axis.
struct Step<'b, X> {
    axis: &'b mut X,
    reference: &'b AxisReference,
}

impl<X: Axis> Kernel for Step<'_, X> {
    type Output = AxisSignals;

    #[inline(always)]
    fn run(self) -> AxisSignals {
        self.axis.step(self.reference)
    }
}

/// [`Axis::step`], with the instructions that this machine has for it.
pub(crate) fn step_alone(axis: &mut impl Axis, reference: &AxisReference) -> AxisSignals {
    narrow(Step { axis, reference })
}

/// Takes every axis through its references, one a control period, and keeps what `output` makes of each sample at the end of `outputs`.
///
/// The axes are independent of each other, and go side by side where there are cores; the outcome does not depend on it. (On a thread of
/// rayon's they go one after another: what called from there has other work for the cores.) Where `outputs` has room nothing is allocated
/// but what hands an axis to another core.
pub fn step_side_by_side<X, T, F, const A: usize>(
    axes: &mut [X; A],
    references: &[Vec<AxisReference>; A],
    outputs: &mut [Vec<T>; A],
    output: F,
) where
    X: Axis + Send,
    T: Send,
    F: Fn(&X, AxisSignals) -> T + Sync,
{
    let output = &output;
    let work = axes.iter_mut().zip(references).zip(outputs);
    let mut work = work.map(|((axis, references), outputs)| Steps { axis, references, outputs, output });
    let worth =
        references.iter().any(|references| references.len() >= WORTH) && rayon::current_thread_index().is_none();
    let Some(cores) = worth.then(cores).flatten() else { return work.for_each(narrow) };
    cores.in_place_scope(|scope| {
        let own = work.next();
        for steps in work {
            scope.spawn(move |_| narrow(steps));
        }
        own.into_iter().for_each(narrow);
    });
}
