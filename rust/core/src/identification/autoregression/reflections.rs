//! Autoregressions of every order from their reflection coefficients: Yule-Walker and Burg.

use nalgebra::DMatrix;

use super::normal_equations::{Centre, NormalEquations};
use super::{FitError, NearFit, check};
use crate::math::segments::segments;
use crate::work;

/// Models of orders 0, 1, …; each extends the previous model.
#[derive(Debug, Clone)]
pub struct Reflections {
    /// Coefficients of each order.
    phi: Vec<Vec<f64>>,
    /// Variance of the residuals of each order.
    variances: Vec<f64>,
}

impl Reflections {
    /// Order 0: the residuals are the samples, with this variance.
    pub fn new(variance: f64) -> Self {
        Self { phi: vec![Vec::new()], variances: vec![variance] }
    }

    /// Adds the next order with its last coefficient.
    pub fn extend(&mut self, last: f64) {
        let mut phi = self.last().to_vec();
        step_up(&mut phi, last);
        self.variances.push(self.last_variance() * (1.0 - last * last));
        self.phi.push(phi);
    }

    /// Last coefficient of the next order, from these autocovariances (Levinson and Durbin).
    pub fn levinson(&self, covariances: &[f64]) -> f64 {
        let order = self.phi.len();
        let forecast = self.last().iter().zip(covariances[1..order].iter().rev());
        let explained: f64 = forecast.map(|(phi, covariance)| phi * covariance).sum();
        (covariances[order] - explained) / self.last_variance()
    }

    /// Coefficients of the highest order.
    pub fn last(&self) -> &[f64] {
        self.phi.last().map_or(&[], Vec::as_slice)
    }

    /// Variance of the highest order.
    pub fn last_variance(&self) -> f64 {
        self.variances.last().copied().unwrap_or(0.0)
    }

    /// Variance of order 0.
    pub fn first_variance(&self) -> f64 {
        self.variances[0]
    }

    /// Variances of all orders.
    pub fn variances(self) -> Vec<f64> {
        self.variances
    }

    /// The highest order as a fit to `n` samples with mean 0; with a constant the mean was
    /// subtracted.
    pub fn fit(&self, n: usize, constant: bool) -> NearFit {
        let (phi, sigma2) = (self.last().to_vec(), self.last_variance());
        let (order, precision_root) = (phi.len(), self.precision_root());
        let scale = (n as f64).sqrt().recip();
        let mut root = (&precision_root * scale).insert_row(order, 0.0).insert_column(order, 0.0);
        root[(order, order)] = if constant { scale } else { 0.0 };
        NearFit { phi, constant: 0.0, sigma2, root, n, condition: condition(&precision_root) }
    }

    /// Root of the inverse covariance of neighbouring samples, as many as the highest order: the
    /// inverse is the root times its transpose. Residuals of orders 0, 1, … are uncorrelated.
    fn precision_root(&self) -> DMatrix<f64> {
        let order = self.last().len();
        let mut root = DMatrix::zeros(order, order);
        for k in 0..order {
            let weight = self.variances[k].sqrt().recip();
            root[(k, k)] = weight;
            self.phi[k]
                .iter()
                .enumerate()
                .for_each(|(i, phi)| root[(k - 1 - i, k)] = -phi * weight);
        }
        root
    }
}

/// Condition number of a matrix with equal diagonal elements; `root` is the root of its inverse.
fn condition(root: &DMatrix<f64>) -> f64 {
    if root.is_empty() {
        return 1.0;
    }
    let values = root.singular_values();
    (values.max() / values.min()).powi(2)
}

/// Converts an autoregression to the next order, with its last coefficient `r`.
pub fn step_up(phi: &mut Vec<f64>, r: f64) {
    let before = phi.clone();
    phi.iter_mut().zip(before.iter().rev()).for_each(|(phi, mirrored)| *phi -= r * mirrored);
    phi.push(r);
}

/// Yule-Walker models of all orders up to `order`, with the record's first autocovariances, and the
/// number of samples.
///
/// An autocovariance is the sum over all pairs in a segment, divided by the number of samples: it
/// belongs to a stationary process.
pub fn yule_walker(
    record: &[f64],
    order: usize,
    constant: bool,
    centre: Centre,
) -> Result<(Reflections, usize), FitError> {
    let sums = NormalEquations::of(record, order, centre);
    let n = sums.present();
    check(record, order, sums.n().min(1) * n, constant, sums.energy())?;
    let covariances: Vec<f64> = sums.over_all_pairs().iter().map(|s| s / n as f64).collect();
    let mut models = Reflections::new(covariances[0]);
    for _ in 0..order {
        models.extend(models.levinson(&covariances));
    }
    Ok((models, n))
}

/// Number of separate sums, which lets them run on vectors.
const SUMS: usize = 8;

/// Burg's models of all orders up to `order`, with the smallest forward and backward residuals, and
/// the number of samples.
pub fn burg(
    record: &[f64],
    order: usize,
    constant: bool,
    centre: Centre,
) -> Result<(Reflections, usize), FitError> {
    let mut errors = work::collect(segments(record).map(|z| Errors::new(z, centre)));
    let n: usize = errors.iter().map(|errors| errors.forward.len()).sum();
    let energy = errors.iter().map(|errors| dot(&errors.forward, &errors.forward)).sum();
    let any = errors.iter().any(|errors| errors.forward.len() > order);
    check(record, order, usize::from(any) * n, constant, energy)?;
    let mut models = Reflections::new(energy / n as f64);
    for _ in 0..order {
        models.extend(next_reflection(&mut errors));
    }
    Ok((models, n))
}

/// Coefficient over all segments; the residuals then belong to the next order.
fn next_reflection(errors: &mut [Errors]) -> f64 {
    let (products, squares) = errors.iter_mut().fold((0.0, 0.0), |(products, squares), errors| {
        work::pause();
        let (product, square) = errors.sums();
        (products + product, squares + square)
    });
    let reflection = 2.0 * products / squares;
    errors.iter_mut().for_each(|errors| errors.reflect(reflection));
    reflection
}

/// Residuals of a segment for samples with enough neighbours on the two sides: forward from sample
/// m on, and backward one sample earlier.
struct Errors {
    forward: Vec<f64>,
    backward: Vec<f64>,
    /// The order.
    m: usize,
}

impl Errors {
    fn new(segment: &[f64], centre: Centre) -> Self {
        let forward = work::collect(segment.iter().map(|z| centre.subtract_centre(*z)));
        Self { backward: work::collect(forward.iter().copied()), forward, m: 0 }
    }

    /// Sums of the products of the two kinds of residuals, and of their squares.
    fn sums(&mut self) -> (f64, f64) {
        let (forward, backward) = self.pairs();
        (dot(forward, backward), dot(forward, forward) + dot(backward, backward))
    }

    fn reflect(&mut self, reflection: f64) {
        let (forward, backward) = self.pairs();
        for (f, b) in forward.iter_mut().zip(backward) {
            (*f, *b) = (*f - reflection * *b, *b - reflection * *f);
        }
        self.m += 1;
    }

    /// Forward residuals, and backward residuals of the sample before the first sample that they
    /// use.
    fn pairs(&mut self) -> (&mut [f64], &mut [f64]) {
        let count = self.forward.len().saturating_sub(self.m + 1);
        let start = self.forward.len() - count;
        (&mut self.forward[start..], &mut self.backward[..count])
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<SUMS>();
    let (b, b_rest) = b.as_chunks::<SUMS>();
    let mut sums = [0.0; SUMS];
    for (a, b) in a.iter().zip(b) {
        for k in 0..SUMS {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}
