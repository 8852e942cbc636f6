//! Evolution strategy with covariance matrix adaptation.

use std::ops::ControlFlow;

use super::bounds::Bounds;
use super::eigen::{Matrix, symmetric, unit};
use super::outcome::Log;
use super::{Outcome, Random, Step, Value};

/// CMA-ES, `(μ/μ_w, λ)` with rank-one and rank-μ update and cumulative step-size adaptation.
///
/// Draws `λ = 4 + ⌊3 ln n⌋` points around a mean, moves the mean towards the better half, and learns the covariance along
/// which progress was made. Only the order of the values matters. A point outside of the bounds is drawn again, up to ten
/// times, and then clipped to them. Source: N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv:1604.00772,
/// figure 6 and table 1 (non-negative weights).
#[derive(Debug, Clone, PartialEq)]
pub struct CmaEs {
    /// Lower bounds; empty for none.
    pub lower: Vec<f64>,
    /// Upper bounds; empty for none.
    pub upper: Vec<f64>,
    /// Standard deviation of the first points along every coordinate.
    pub initial_sigma: f64,
    /// The search has converged when the largest standard deviation is below this.
    pub sigma_tolerance: f64,
    /// It gives up after about this many evaluations (a generation that has begun is finished).
    pub max_evaluations: usize,
    /// Points a generation; none for the default.
    pub population: Option<usize>,
    /// Seed of the random numbers: the same seed gives the same search.
    pub seed: u64,
}

impl Default for CmaEs {
    /// No bounds, standard deviation 0.5 → 1e-6, 100 000 evaluations, default population, seed 1.
    fn default() -> Self {
        Self {
            lower: Vec::new(),
            upper: Vec::new(),
            initial_sigma: 0.5,
            sigma_tolerance: 1e-6,
            max_evaluations: 100_000,
            population: None,
            seed: 1,
        }
    }
}

/// Strategy parameters, named as in the source.
struct Strategy {
    lambda: usize,
    weights: Vec<f64>,
    mu_eff: f64,
    c_sigma: f64,
    d_sigma: f64,
    c_c: f64,
    c_1: f64,
    c_mu: f64,
    /// Expectation of the length of a standard normal vector.
    chi_n: f64,
}

impl Strategy {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 3 ln n is small and not negative
    fn new(dimension: usize, population: Option<usize>) -> Self {
        let n = dimension.max(1) as f64;
        let lambda = population.unwrap_or(4 + (3.0 * libm::log(n)) as usize).max(4);
        let mu = lambda / 2;
        let raw: Vec<f64> = (1..=mu).map(|i| libm::log(0.5 * (lambda as f64 + 1.0)) - libm::log(i as f64)).collect();
        let sum: f64 = raw.iter().sum();
        let weights: Vec<f64> = raw.iter().map(|w| w / sum).collect();
        let mu_eff = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let c_1 = 2.0 / ((n + 1.3) * (n + 1.3) + mu_eff);
        Self {
            lambda,
            mu_eff,
            c_sigma,
            d_sigma: 1.0 + 2.0 * (((mu_eff - 1.0) / (n + 1.0)).max(0.0).sqrt() - 1.0).max(0.0) + c_sigma,
            c_c: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            c_1,
            c_mu: (1.0 - c_1).min(2.0 * (mu_eff - 2.0 + 1.0 / mu_eff) / ((n + 2.0) * (n + 2.0) + mu_eff)),
            chi_n: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
            weights,
        }
    }
}

/// The distribution that points are drawn from.
struct Distribution {
    mean: Vec<f64>,
    sigma: f64,
    covariance: Matrix,
    /// Eigenvectors (columns) and the roots of the eigenvalues of the covariance.
    axes: Matrix,
    lengths: Vec<f64>,
    path_sigma: Vec<f64>,
    path_c: Vec<f64>,
}

/// A point that was drawn: how far from the mean (in units of sigma), where, and its value.
struct Draw {
    step: Vec<f64>,
    point: Vec<f64>,
    value: Value,
}

impl CmaEs {
    /// Minimises `objective` from `start`. A NaN counts as worse than any number.
    pub fn minimize<V: Into<Value>>(&self, start: &[f64], objective: impl FnMut(&[f64]) -> V) -> Outcome {
        self.minimize_until(start, objective, |_| ControlFlow::Continue(()))
    }

    /// As [`CmaEs::minimize`]; `watch` sees every generation and may end the search.
    pub fn minimize_until<V: Into<Value>>(
        &self,
        start: &[f64],
        mut objective: impl FnMut(&[f64]) -> V,
        mut watch: impl FnMut(&Step) -> ControlFlow<()>,
    ) -> Outcome {
        let bounds = Bounds { lower: &self.lower, upper: &self.upper };
        let mut point = bounds.clipped(start);
        let n = point.len();
        let strategy = Strategy::new(n, self.population);
        let mut random = Random::new(self.seed);
        let mut cloud = Distribution::new(&point, self.initial_sigma);
        let mut best: Value = objective(&point).into();
        let mut evaluations = 1;
        let mut log = Log::new(&mut watch);
        log.push(&point, best, cloud.extent(), evaluations);
        while n > 0 && evaluations < self.max_evaluations && !log.is_stopped() {
            if !(cloud.extent() > self.sigma_tolerance) {
                return log.finish(true);
            }
            let mut draws: Vec<Draw> = (0..strategy.lambda)
                .map(|_| {
                    let (step, point) = cloud.draw(&bounds, &mut random);
                    let value = objective(&point).into();
                    Draw { step, point, value }
                })
                .collect();
            evaluations += strategy.lambda;
            draws.sort_by(|a, b| a.value.order(&b.value));
            if let Some(first) = draws.first()
                && first.value.is_better_than(&best)
            {
                (point, best) = (first.point.clone(), first.value);
            }
            let generation = log.len();
            cloud.learn(&strategy, &draws, generation);
            log.push(&point, best, cloud.extent(), evaluations);
            if !cloud.is_sound() {
                break;
            }
        }
        log.finish(n == 0 || !(cloud.extent() > self.sigma_tolerance))
    }
}

impl Distribution {
    fn new(mean: &[f64], sigma: f64) -> Self {
        let n = mean.len();
        Self {
            mean: mean.to_vec(),
            sigma,
            covariance: unit(n),
            axes: unit(n),
            lengths: vec![1.0; n],
            path_sigma: vec![0.0; n],
            path_c: vec![0.0; n],
        }
    }

    /// Largest standard deviation.
    fn extent(&self) -> f64 {
        self.sigma * self.lengths.iter().copied().fold(0.0, f64::max)
    }

    /// Whether numbers can still tell its axes apart.
    fn is_sound(&self) -> bool {
        let (short, long) = self.lengths.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &l| (a.min(l), b.max(l)));
        self.sigma.is_finite() && long <= 1e7 * short
    }

    /// A random step and point; within the bounds, by trying again and at last by clipping.
    fn draw(&self, bounds: &Bounds<'_>, random: &mut Random) -> (Vec<f64>, Vec<f64>) {
        let n = self.mean.len();
        let mut point = Vec::new();
        for _ in 0..10 {
            let z: Vec<f64> = self.lengths.iter().map(|length| length * random.normal()).collect();
            point = (0..n)
                .map(|i| self.mean[i] + self.sigma * self.axes[i].iter().zip(&z).map(|(b, z)| b * z).sum::<f64>())
                .collect();
            if bounds.hold(&point) {
                break;
            }
        }
        let point = bounds.clipped(&point);
        let step = point.iter().zip(&self.mean).map(|(p, m)| (p - m) / self.sigma).collect();
        (step, point)
    }

    /// Moves and reshapes the distribution; `draws` come best first.
    fn learn(&mut self, strategy: &Strategy, draws: &[Draw], generation: usize) {
        let Strategy { mu_eff, c_sigma, d_sigma, c_c, c_1, c_mu, chi_n, .. } = *strategy;
        let n = self.mean.len();
        let chosen = || strategy.weights.iter().zip(draws);
        let step: Vec<f64> = (0..n).map(|i| chosen().map(|(w, draw)| w * draw.step[i]).sum()).collect();
        for (mean, step) in self.mean.iter_mut().zip(&step) {
            *mean += self.sigma * step;
        }
        // C^(-1/2) step, along the axes and back.
        let along: Vec<f64> = (0..n)
            .map(|k| (0..n).map(|i| self.axes[i][k] * step[i]).sum::<f64>() / self.lengths[k].max(f64::MIN_POSITIVE))
            .collect();
        let gain = (c_sigma * (2.0 - c_sigma) * mu_eff).sqrt();
        for i in 0..n {
            let white: f64 = (0..n).map(|k| self.axes[i][k] * along[k]).sum();
            self.path_sigma[i] = (1.0 - c_sigma) * self.path_sigma[i] + gain * white;
        }
        let length = self.path_sigma.iter().map(|p| p * p).sum::<f64>().sqrt();
        // The path is short at first, and held back while it is too long: h_σ.
        let settled = (1.0 - libm::pow(1.0 - c_sigma, 2.0 * generation as f64)).sqrt();
        let is_steady = length / settled < (1.4 + 2.0 / (n as f64 + 1.0)) * chi_n;
        let gain = if is_steady { (c_c * (2.0 - c_c) * mu_eff).sqrt() } else { 0.0 };
        for (path, step) in self.path_c.iter_mut().zip(&step) {
            *path = (1.0 - c_c) * *path + gain * step;
        }
        let lost = if is_steady { 0.0 } else { c_c * (2.0 - c_c) };
        let kept = 1.0 + c_1 * lost - c_1 - c_mu;
        for i in 0..n {
            for j in 0..=i {
                let rank_mu: f64 = chosen().map(|(w, draw)| w * draw.step[i] * draw.step[j]).sum();
                let value = kept * self.covariance[i][j] + c_1 * self.path_c[i] * self.path_c[j] + c_mu * rank_mu;
                self.covariance[i][j] = value;
                self.covariance[j][i] = value;
            }
        }
        // At most by a factor of e a generation, as the source advises.
        self.sigma *= libm::exp(((c_sigma / d_sigma) * (length / chi_n - 1.0)).min(1.0));
        let (values, axes) = symmetric(&self.covariance);
        self.lengths = values.iter().map(|value| value.max(0.0).sqrt()).collect();
        self.axes = axes;
    }
}
