//! Runs side by side, one a lane, through the loop of a single run.

use std::f64::consts::PI;

use nalgebra::SVector;
use pulp::{Arch, NullaryFnOnce, Simd, WithSimd};
use rayon::prelude::*;

use super::SimulationError;
use super::reference_trajectory::{ReferenceTrajectory, RunMetrics, Sample};
use crate::lane::{Kernel, Lane, Wide, vectorized};
use crate::path::nearest_in_window;
use crate::servo::{AxisLoop, AxisParameters, LockupWatch};

/// Vector registers that one number of a batch takes: with two, one hides the waiting of the other.
const REGISTERS: usize = 2;

/// More lanes than there are on any machine.
const MOST_LANES: usize = 64;

/// How many runs go side by side on this machine.
fn lanes() -> usize {
    struct Count;

    impl WithSimd for Count {
        type Output = usize;

        fn with_simd<S: Simd>(self, _: S) -> usize {
            Wide::<S, REGISTERS>::LANES
        }
    }

    Arch::new().dispatch(Count)
}

/// At most [`lanes`] runs.
struct Batch<'b, const A: usize> {
    trajectory: &'b ReferenceTrajectory<'b, A>,
    parameters: &'b [[AxisParameters; A]],
    /// Whether contouring errors are measured; else they are NaN.
    contour: bool,
    metrics: &'b mut [RunMetrics<A>],
}

impl<const A: usize> Batch<'_, A> {
    /// Fills in the metrics.
    fn run(self) {
        Arch::new().dispatch(self);
    }
}

impl<const A: usize> WithSimd for Batch<'_, A> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // The same code four times: the compiler leaves out of each what the others are for.
        match (self.trajectory.settings.one_sample_delay, self.contour) {
            (false, false) => self.run_on::<S, false, false>(simd),
            (false, true) => self.run_on::<S, false, true>(simd),
            (true, false) => self.run_on::<S, true, false>(simd),
            (true, true) => self.run_on::<S, true, true>(simd),
        }
    }
}

impl<const A: usize> ReferenceTrajectory<'_, A> {
    /// How many runs go side by side through one core; batches of a multiple of this waste nothing.
    pub fn lanes() -> usize {
        lanes()
    }

    /// Runs the loop once for every element of `parameters`; the metrics are in the same order.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn run(&self, parameters: &[[AxisParameters; A]]) -> Result<Vec<RunMetrics<A>>, SimulationError> {
        self.run_all(parameters, true)
    }

    /// As [`ReferenceTrajectory::run`] without measuring contouring errors, which are NaN in the metrics: twice as quick.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn run_loop(&self, parameters: &[[AxisParameters; A]]) -> Result<Vec<RunMetrics<A>>, SimulationError> {
        self.run_all(parameters, false)
    }

    fn run_all(
        &self,
        parameters: &[[AxisParameters; A]],
        contour: bool,
    ) -> Result<Vec<RunMetrics<A>>, SimulationError> {
        for axis in parameters.iter().flatten() {
            axis.check()?;
        }
        // Runs that are about as far behind go side by side: what the far ones need then costs the others nothing.
        let lags: Vec<f64> = parameters.iter().map(steady_lag_s).collect();
        let mut order: Vec<usize> = (0..parameters.len()).collect();
        order.par_sort_unstable_by(|&a, &b| lags[a].total_cmp(&lags[b]).then(a.cmp(&b)));
        let mut found = vec![RunMetrics::none(); parameters.len()];
        order.par_chunks(lanes()).zip(found.par_chunks_mut(lanes())).for_each(|(order, metrics)| {
            let parameters: Vec<_> = order.iter().map(|&i| parameters[i]).collect();
            Batch { trajectory: self, parameters: &parameters, contour, metrics }.run();
        });
        let mut metrics = found.clone();
        for (&i, found) in order.iter().zip(&found) {
            metrics[i] = *found;
        }
        Ok(metrics)
    }
}

/// By how much the slower axis lags behind a ramp, per speed: `|1/r_g - kpf|/kpp` \[s\].
fn steady_lag_s<const A: usize>(axes: &[AxisParameters; A]) -> f64 {
    let following_error = |axis: &AxisParameters| {
        (1.0 / axis.drive.transmission_mm_rad - axis.pdff.kpf_rad_mm).abs() / axis.pdff.kpp_rad_s_mm
    };
    axes.iter().map(following_error).fold(0.0, f64::max)
}

/// What is gathered of the runs, a number a lane.
struct Tally<L: Lane, const A: usize> {
    contour_max: L,
    contour_sum: L,
    tracking_max: L,
    tracking_sum: L,
    voltage: [L; A],
}

impl<const A: usize> Batch<'_, A> {
    #[inline(always)]
    fn run_on<S: Simd, const DELAY: bool, const CONTOUR: bool>(self, simd: S) {
        let ReferenceTrajectory { settings, start_mm, samples, .. } = self.trajectory;
        let zero = Wide::<S, REGISTERS>::splat(simd, 0.0);
        // Lanes that are left over repeat the last run.
        let last = self.parameters.len().saturating_sub(1);
        let all = |axis: usize| {
            (0..Wide::<S, REGISTERS>::LANES).filter_map(move |lane| Some(&self.parameters.get(lane.min(last))?[axis]))
        };
        let mut axes: [_; A] = std::array::from_fn(|axis| {
            AxisLoop::<Wide<S, REGISTERS>>::batch(simd, all(axis), settings, start_mm[axis])
        });
        let mut tally =
            Tally { contour_max: zero, contour_sum: zero, tracking_max: zero, tracking_sum: zero, voltage: [zero; A] };
        for sample in samples {
            let mut following_error = [zero; A];
            let mut square = zero;
            for axis in 0..A {
                let command = zero.all(sample.command[axis]);
                let control = axes[axis].period::<DELAY>(command, zero.all(sample.velocity[axis]));
                following_error[axis] = control.following_error;
                square = control.following_error.mul_add(control.following_error, square);
                tally.voltage[axis] = tally.voltage[axis].max_abs(control.voltage);
            }
            tally.tracking_max = tally.tracking_max.max(square);
            tally.tracking_sum = tally.tracking_sum + square;

            if !CONTOUR {
                continue;
            }
            let plain = zero.every(square.le(zero.all(sample.around.plain_square)));
            let contour = match &sample.around.own {
                Some(piece) if plain && A == 2 => piece.square(-following_error[0], -following_error[1]),
                _ => {
                    Around { trajectory: self.trajectory, sample, following_error, square, runs: self.parameters.len() }
                        .aside(simd)
                }
            };
            tally.contour_max = tally.contour_max.max(contour);
            tally.contour_sum = tally.contour_sum + contour;
        }
        self.metrics(&tally);
    }

    /// From sums of squares to metrics.
    fn metrics<S: Simd>(self, tally: &Tally<Wide<S, REGISTERS>, A>) {
        let count = self.trajectory.samples.len() as f64;
        let um = |square: f64| 1e3 * square.sqrt();
        for (lane, metrics) in self.metrics.iter_mut().enumerate() {
            let of = |wide: &Wide<S, REGISTERS>| wide.lanes().get(lane).copied().unwrap_or(f64::NAN);
            let peak_voltage_v: [f64; A] = std::array::from_fn(|axis| of(&tally.voltage[axis]));
            let saturation = match self.parameters.get(lane) {
                // The clamp may have acted: the run once more, watched.
                Some(axes)
                    if axes.iter().zip(peak_voltage_v).any(|(axis, peak)| peak >= axis.drive.voltage_limit_v) =>
                {
                    vectorized(Watched { trajectory: self.trajectory, parameters: axes })
                }
                _ => Saturation::default(),
            };
            *metrics = RunMetrics {
                max_contour_error_um: if self.contour { um(of(&tally.contour_max)) } else { f64::NAN },
                rms_contour_error_um: if self.contour { um(of(&tally.contour_sum) / count) } else { f64::NAN },
                max_tracking_error_um: um(of(&tally.tracking_max)),
                rms_tracking_error_um: um(of(&tally.tracking_sum) / count),
                peak_voltage_v,
                saturated_share: saturation.samples as f64 / count,
                locked_up: saturation.locked_up,
            };
        }
    }
}

/// Squared distances where the setpoint's own piece is not good for every lane; of the first `runs` lanes, that is: the
/// others are nobody's.
struct Around<'b, S: Simd, const A: usize> {
    trajectory: &'b ReferenceTrajectory<'b, A>,
    sample: &'b Sample<A>,
    following_error: [Wide<S, REGISTERS>; A],
    square: Wide<S, REGISTERS>,
    runs: usize,
}

impl<S: Simd, const A: usize> Around<'_, S, A> {
    /// Out of the way of the usual case, but for the same instructions.
    #[cold]
    #[inline(never)]
    fn aside(self, simd: S) -> Wide<S, REGISTERS> {
        simd.vectorize(self)
    }
}

impl<S: Simd, const A: usize> NullaryFnOnce for Around<'_, S, A> {
    type Output = Wide<S, REGISTERS>;

    #[inline(always)]
    fn call(self) -> Wide<S, REGISTERS> {
        let Self { trajectory, sample, following_error, square, runs } = self;
        let mut contour = square;
        let mut found = square.ne(square);
        if A == 2
            && let Some(own) = &sample.around.own
        {
            // A lane gets the same number whatever the others need: what is good alone comes first.
            contour = own.square(-following_error[0], -following_error[1]);
            found = square.le(square.all(sample.around.plain_square));
            for piece in std::iter::once(own).chain(&sample.around.others) {
                let local = piece.checked(-following_error[0], -following_error[1], square);
                contour = contour.or_else(found, local.square);
                found = square.or(found, local.valid);
            }
        }
        if square.every(found) {
            return contour;
        }
        let flags = square.all(1.0).or_else(found, square.all(0.0));
        let (flags, known) = (flags.lanes(), contour.lanes());
        let mut lanes = [0.0; MOST_LANES];
        for (lane, exact) in lanes.iter_mut().enumerate().take(runs) {
            *exact = if flags.get(lane) == Some(&1.0) {
                known.get(lane).copied().unwrap_or(f64::NAN)
            } else {
                trajectory.exact_square(
                    sample,
                    &following_error
                        .map(|following_error| following_error.lanes().get(lane).copied().unwrap_or(f64::NAN)),
                )
            };
        }
        square.packed(lanes.into_iter())
    }
}

impl<const A: usize> ReferenceTrajectory<'_, A> {
    /// The squared contouring error \[mm²\] where the tool is behind the setpoint by `following_error`, as
    /// [`ContourMeter`](crate::contour::ContourMeter) measures it.
    #[inline(never)]
    fn exact_square(&self, sample: &Sample<A>, following_error: &[f64; A]) -> f64 {
        let following_error = SVector::from(*following_error);
        let actual_mm = SVector::from(sample.command) + self.start_mm - following_error;
        let reach = PI * following_error.norm() + 1e-6;
        let distance_mm =
            nearest_in_window(self.path, &actual_mm, sample.s_mm, reach, &mut sample.cursor.clone()).distance_mm;
        distance_mm * distance_mm
    }
}

/// A run on its own, watched.
struct Watched<'b, const A: usize> {
    trajectory: &'b ReferenceTrajectory<'b, A>,
    parameters: &'b [AxisParameters; A],
}

impl<const A: usize> Kernel for Watched<'_, A> {
    type Output = Saturation;

    #[inline(always)]
    fn run(self) -> Saturation {
        if self.trajectory.settings.one_sample_delay { self.run_on::<true>() } else { self.run_on::<false>() }
    }
}

impl<const A: usize> Watched<'_, A> {
    #[inline(always)]
    fn run_on<const DELAY: bool>(self) -> Saturation {
        let ReferenceTrajectory { settings, start_mm, samples, .. } = self.trajectory;
        let mut axes: [_; A] =
            std::array::from_fn(|axis| AxisLoop::new(&self.parameters[axis], settings, start_mm[axis]));
        let mut watches: [_; A] = std::array::from_fn(|_| LockupWatch::new(settings.period_s));
        let mut found = Saturation::default();
        for (k, sample) in samples.iter().enumerate() {
            let mut saturated = false;
            for axis in 0..A {
                let control = axes[axis].period::<DELAY>(sample.command[axis], sample.velocity[axis]);
                found.locked_up |= watches[axis]
                    .watch(k as u64, control.voltage, control.saturated, control.following_error)
                    .is_some();
                saturated |= control.saturated;
            }
            found.samples += u64::from(saturated);
        }
        found
    }
}

/// How a run saturates.
#[derive(Debug, Clone, Copy, Default)]
struct Saturation {
    /// Samples in which an axis is saturated.
    samples: u64,
    locked_up: bool,
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::feedrate::{Motion, Profile};
    use crate::path::{Path, PhSpline};
    use crate::servo::{Drive, LoopSettings, Pdff, Plant};

    /// Runs the batch with one kind of instructions, as many runs at a time as it has lanes.
    fn run_with<S: Simd>(
        simd: S,
        trajectory: &ReferenceTrajectory<'_, 2>,
        parameters: &[[AxisParameters; 2]],
    ) -> Vec<RunMetrics<2>> {
        let lanes = Wide::<S, REGISTERS>::LANES;
        let mut metrics = vec![RunMetrics::none(); parameters.len()];
        for (parameters, metrics) in parameters.chunks(lanes).zip(metrics.chunks_mut(lanes)) {
            simd.vectorize(Batch { trajectory, parameters, contour: true, metrics });
        }
        metrics
    }

    #[test]
    fn every_kind_of_instructions_gives_the_same_bits() {
        let control =
            [[0., 0.], [12., 18.], [24., 27.], [36., 9.], [24., -9.], [12., 0.], [0., 18.]].map(Vector2::from);
        let path = PhSpline::from_control_points(&control, false).unwrap();
        let motion = Motion::plan(path.length_mm(), 100.0, Profile::Quintic { phase_s: 0.1 }).unwrap();
        let trajectory = ReferenceTrajectory::new(&path, &motion, LoopSettings::default()).unwrap();
        // Some following_error far enough for the pieces around, some saturate, one locks up.
        let parameters: Vec<_> = (0..37)
            .map(|i| {
                let share = f64::from(i) / 36.0;
                [(83.0089, 0.19936, 1.19), (50.4977, 0.15641, 1.53)].map(|(gain, tau, kpv)| AxisParameters {
                    plant: Plant { gain_rad_s_v: gain * (0.15 + share), time_constant_s: tau },
                    drive: Drive { voltage_limit_v: 5.0 + share, ..Drive::default() },
                    pdff: Pdff {
                        kpp_rad_s_mm: 97.38,
                        kpv_nm_s_rad: kpv,
                        kiv_1_s: 253.0,
                        kpf_rad_mm: 0.2 + 0.8 * share,
                        kvf: 0.85,
                    },
                })
            })
            .collect();
        let scalar = run_with(pulp::Scalar::new(), &trajectory, &parameters);
        assert!(scalar.iter().any(|f| f.locked_up) && scalar.iter().any(|f| f.saturated_share == 0.0));
        assert_eq!(trajectory.run(&parameters).unwrap(), scalar, "the instructions of this machine");
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            if let Some(v3) = pulp::x86::V3::try_new() {
                assert_eq!(run_with(v3, &trajectory, &parameters), scalar, "AVX2");
            }
            if let Some(v4) = pulp::x86::V4::try_new() {
                assert_eq!(run_with(v4, &trajectory, &parameters), scalar, "AVX-512");
            }
        }
    }
}
