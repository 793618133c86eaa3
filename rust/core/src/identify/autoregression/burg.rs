//! Burg's method: reflection coefficients that leave least of the residuals forward and backward.

use super::centre::Centre;
use super::reflections::Reflections;
use super::refusal::{Refusal, check};
use crate::identify::stretches;

/// Sums kept apart, which lets them run on vectors.
const SUMS: usize = 8;

/// Models of all orders up to `order`, and the number of samples.
pub fn models(
    record: &[f64],
    order: usize,
    constant: bool,
    centre: Centre,
) -> Result<(Reflections, usize), Refusal> {
    let mut errors: Vec<Errors> = stretches(record).map(|z| Errors::new(z, centre)).collect();
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

/// The coefficient over all stretches, after which their residuals are those of the next order.
fn next_reflection(errors: &mut [Errors]) -> f64 {
    let (products, squares) = errors.iter_mut().fold((0.0, 0.0), |(products, squares), errors| {
        let (product, square) = errors.sums();
        (products + product, squares + square)
    });
    let reflection = 2.0 * products / squares;
    errors.iter_mut().for_each(|errors| errors.reflect(reflection));
    reflection
}

/// Residuals of a stretch, as many as have enough samples on both sides: forward from sample m on,
/// and backward one sample behind it.
struct Errors {
    forward: Vec<f64>,
    backward: Vec<f64>,
    /// The order.
    m: usize,
}

impl Errors {
    fn new(stretch: &[f64], centre: Centre) -> Self {
        let forward: Vec<f64> = stretch.iter().map(|z| centre.taken_off(*z)).collect();
        Self { backward: forward.clone(), forward, m: 0 }
    }

    /// Sums of the products of what is to be forecast from each other, and of the squares.
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

    /// Forward residuals, and backward ones of the sample before the first used by them.
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
