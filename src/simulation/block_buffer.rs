//! Detailed drives, a block of samples ahead of the run.

use std::collections::VecDeque;

use super::axes::DetailedAxes;
use super::corrections::Corrections;
use crate::interpolator::{Interpolator, Setpoint};
use crate::servo::{AxisReference, AxisSignals, DriveSignals, step_side_by_side};

/// Most samples in a block: half a millisecond of work for a core that has to be woken for it, in memory that its cache holds.
const BLOCK: usize = 2048;

/// Signals of all axes at one sample.
pub(super) struct BlockSample<const A: usize> {
    pub(super) setpoint: Setpoint<A>,
    pub(super) axes: [AxisSignals; A],
    pub(super) drives: [DriveSignals; A],
}

/// A block of samples that the axes have gone through, and from which the run takes one after another. Axes that are coupled go one
/// sample at a time.
#[derive(Debug, Clone)]
pub(super) struct BlockBuffer<const A: usize> {
    /// The setpoints from the next sample on, as far as the axes look ahead.
    setpoints: VecDeque<Setpoint<A>>,
    references: [Vec<AxisReference>; A],
    outputs: [Vec<(AxisSignals, DriveSignals)>; A],
    /// How many samples of the block are taken.
    taken: usize,
}

impl<const A: usize> BlockBuffer<A> {
    pub(super) fn new() -> Self {
        Self {
            setpoints: VecDeque::new(),
            references: std::array::from_fn(|_| Vec::new()),
            outputs: std::array::from_fn(|_| Vec::new()),
            taken: 0,
        }
    }

    /// Sample `k`, the next one, of a run that has `left` of them.
    pub(super) fn take(
        &mut self,
        real: &mut DetailedAxes<A>,
        interpolator: &mut Interpolator<'_, A>,
        corrections: Option<&Corrections<A>>,
        k: u64,
        left: u64,
    ) -> BlockSample<A> {
        if self.taken >= self.references[0].len() {
            let most = if real.are_coupled() { 1 } else { BLOCK };
            let samples = usize::try_from(left).map_or(most, |left| left.min(most));
            self.run(real, interpolator, corrections, k, samples);
        }
        let at = self.taken;
        self.taken += 1;
        let setpoint = self.setpoints.pop_front().unwrap_or_else(|| interpolator.setpoint(k));
        let signals = |axis: usize| AxisSignals { command_mm: setpoint.position_mm[axis], ..self.outputs[axis][at].0 };
        BlockSample {
            setpoint,
            axes: std::array::from_fn(signals),
            drives: std::array::from_fn(|axis| self.outputs[axis][at].1),
        }
    }

    /// Takes the axes through `samples` samples from `k` on.
    fn run(
        &mut self,
        real: &mut DetailedAxes<A>,
        interpolator: &mut Interpolator<'_, A>,
        corrections: Option<&Corrections<A>>,
        k: u64,
        samples: usize,
    ) {
        let wanted = samples + real.ahead.iter().copied().max().unwrap_or(0);
        for at in self.setpoints.len()..wanted {
            self.setpoints.push_back(interpolator.setpoint(k + at as u64));
        }
        for axis in 0..A {
            let ahead = real.ahead[axis];
            let seen = self.setpoints.iter().zip(k..).skip(ahead).take(samples);
            self.references[axis].clear();
            self.references[axis].extend(seen.map(|(setpoint, k)| match corrections {
                None => real.reference(axis, setpoint),
                Some(corrections) => real.reference(axis, &corrections.of(setpoint, k)),
            }));
            self.outputs[axis].clear();
        }
        step_side_by_side(&mut real.axes, &self.references, &mut self.outputs, |axis, signals| {
            (signals, axis.drive_signals())
        });
        self.taken = 0;
    }
}
