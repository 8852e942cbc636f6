//! Where the interior knots go.

use super::spline::Spline;

/// Averaged parameters (The NURBS Book, equations 9.68 and 9.69): every interval holds points.
pub(super) fn averaged(degree: usize, count: usize, parameters: &[f64]) -> Vec<f64> {
    let step = parameters.len() as f64 / (count - degree) as f64;
    (1..count - degree)
        .map(|j| {
            let place = j as f64 * step;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within the list
            let i = place as usize;
            let share = place - i as f64;
            (1.0 - share) * parameters[i - 1] + share * parameters[i]
        })
        .collect()
}

/// A density of knots: constant on intervals, its integral at their ends.
#[derive(Debug, Clone)]
pub(super) struct Density {
    ends: Vec<f64>,
    integral: Vec<f64>,
}

impl Density {
    /// From a spline that fits well: the jumps of its highest derivative over half the intervals beside are the next derivative
    /// `C⁽ᵖ⁺¹⁾`, and the density is `|C⁽ᵖ⁺¹⁾|` to the power `1/(p+1)` (de Boor, "A Practical Guide to Splines", chapter 12).
    /// It is a mean over `smoothing` intervals on either side, and never below `floor` times its mean.
    pub(super) fn of<const D: usize>(spline: &Spline<D>, smoothing: usize, floor: f64) -> Self {
        let p = spline.degree;
        let mut d = spline.points.clone();
        // The control points of the p-th derivative: one for each interval.
        for order in 1..=p {
            d = (0..d.len() - 1)
                .map(|i| {
                    let gap = spline.knots[i + p + 1] - spline.knots[i + order];
                    (d[i + 1] - d[i]) * ((p + 1 - order) as f64 / gap)
                })
                .collect();
        }
        let ends: Vec<f64> = spline.knots[p..=spline.points.len()].to_vec();
        let gaps: Vec<f64> = ends.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // |jump| / distance between the middles, at the inner knots.
        let jumps: Vec<f64> =
            (1..d.len()).map(|i| (d[i] - d[i - 1]).norm() / (0.5 * (gaps[i] + gaps[i - 1]))).collect();
        let at = |i: usize| jumps[i.min(jumps.len() - 1)];
        let power = 1.0 / (p + 1) as f64;
        let mut density: Vec<f64> = (0..gaps.len())
            .map(|i| {
                let mean = if jumps.is_empty() { 1.0 } else { 0.5 * (at(i.max(1) - 1) + at(i)) };
                libm::pow(mean, power)
            })
            .collect();
        // The jumps are uneven where knots are.
        let raw = density.clone();
        for (i, x) in density.iter_mut().enumerate() {
            let around = &raw[i.saturating_sub(smoothing)..(i + smoothing + 1).min(raw.len())];
            *x = around.iter().sum::<f64>() / around.len() as f64;
        }
        let mean: f64 = density.iter().zip(&gaps).map(|(x, gap)| x * gap).sum();
        let mut integral = vec![0.0];
        let mut sum = 0.0;
        for (x, gap) in density.iter().zip(&gaps) {
            let x = x.max(floor * mean);
            sum += if x > 0.0 { x * gap } else { *gap };
            integral.push(sum);
        }
        Self { ends, integral }
    }

    /// Interior knots for `count` control points: equal shares of the integral.
    pub(super) fn knots(&self, degree: usize, count: usize) -> Vec<f64> {
        let whole = self.integral[self.integral.len() - 1];
        let mut i = 0;
        (1..count - degree)
            .map(|j| {
                let target = whole * j as f64 / (count - degree) as f64;
                while self.integral[i + 1] < target {
                    i += 1;
                }
                let share = (target - self.integral[i]) / (self.integral[i + 1] - self.integral[i]);
                self.ends[i] + share * (self.ends[i + 1] - self.ends[i])
            })
            .collect()
    }
}
