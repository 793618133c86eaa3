//! Joint fit of hard irons, elements of soft iron and the field, by Gauss-Newton steps.

use nalgebra::{Matrix3, Vector3};

use super::normal::{Element, Normal, Sums};
use crate::work::pause;

/// Prior standard deviations of a hard iron and of an element of the soft iron.
pub(super) const IRON_SIGMA: f64 = 1.0;
const SOFT_IRON_SIGMA: f64 = 0.2;
const ROUNDS: usize = 8;
/// Largest step at which the iteration ends.
const MAX_LAST_STEP: f64 = 1e-7;
/// Median of the squared length of a normal vector with three elements, divided by three.
const NORMAL_MEDIAN_SQUARE: f64 = 0.79;
/// Number of standard deviations beyond which a tick has less weight.
const MAX_SIGMAS: f64 = 2.5;
/// Regularisation of undetermined unknowns.
pub(super) const RIDGE: f64 = 1e-9;

/// Ticks of a fit.
#[derive(Debug, Clone, Copy)]
pub struct Ticks<'a> {
    /// Rows of B.
    pub rotation: &'a [[f64; 9]],
    /// Mean field y.
    pub field: &'a [[f64; 3]],
    /// Mean rotated field e.
    pub turned: &'a [[f64; 3]],
    /// Index of each tick's hard iron.
    pub group: &'a [usize],
    /// Index of each tick's field: from 0 on, never decreasing.
    pub window: &'a [usize],
}

impl Ticks<'_> {
    /// Number of hard irons.
    pub fn groups(&self) -> usize {
        self.group.iter().max().map_or(0, |last| last + 1)
    }

    /// Number of fields.
    pub fn windows(&self) -> usize {
        self.window.last().map_or(0, |last| last + 1)
    }

    /// Transpose of B.
    #[inline(always)]
    pub(super) fn back(&self, k: usize) -> Matrix3<f64> {
        Matrix3::from_column_slice(&self.rotation[k])
    }

    /// Ranges of successive ticks with one window and one group.
    pub(super) fn stretches(&self) -> impl Iterator<Item = core::ops::Range<usize>> + '_ {
        let mut first = 0;
        core::iter::from_fn(move || {
            let start = first;
            let of = |k: usize| (self.window[k], self.group[k]);
            if start == self.window.len() {
                return None;
            }
            while first < self.window.len() && of(first) == of(start) {
                first += 1;
            }
            Some(start..first)
        })
    }
}

/// Result of a fit, and the weight of each tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Hard iron of each group.
    pub iron: Vec<Vector3<f64>>,
    /// Fitted elements of the soft iron.
    pub elements: Vec<f64>,
    /// Field of each window.
    pub fields: Vec<Vector3<f64>>,
    /// Weights of the ticks, at most 1.
    pub weights: Vec<f64>,
    /// RMS residual of an axis.
    pub scatter: f64,
}

impl Fit {
    fn start(ticks: &Ticks<'_>, soft: usize) -> Self {
        let middle = Vector3::from_fn(|i, _| {
            median(&mut ticks.turned.iter().map(|e| e[i]).collect::<Vec<f64>>())
        });
        Self {
            iron: vec![Vector3::zeros(); ticks.groups()],
            elements: vec![0.0; soft],
            fields: vec![middle; ticks.windows()],
            weights: vec![1.0; ticks.field.len()],
            scatter: 0.0,
        }
    }

    fn matrix(&self, elements: &[Element]) -> Matrix3<f64> {
        let sum = self.elements.iter().zip(elements).map(|(x, element)| element * *x);
        Matrix3::identity() + sum.sum::<Matrix3<f64>>()
    }

    /// Writes the residual of each tick to `left`, and sets the ticks' weights by its size. Returns
    /// the variance of an axis.
    fn weigh(
        &mut self,
        ticks: &Ticks<'_>,
        elements: &[Element],
        left: &mut [Vector3<f64>],
        squares: &mut Vec<f64>,
    ) -> f64 {
        let matrix = self.matrix(elements);
        squares.clear();
        for (k, left) in left.iter_mut().enumerate() {
            let seen = ticks.back(k) * self.fields[ticks.window[k]];
            *left = Vector3::from(ticks.field[k]) - matrix * seen - self.iron[ticks.group[k]];
            squares.push(left.norm_squared());
        }
        let variance = (median(squares) / 3.0 / NORMAL_MEDIAN_SQUARE).max(1e-10);
        for (weight, left) in self.weights.iter_mut().zip(left.iter()) {
            let size = left.norm_squared().max(1e-30);
            *weight = (MAX_SIGMAS * (variance / size).sqrt()).min(1.0);
        }
        variance
    }

    /// Makes one step of all unknowns; returns the largest change.
    fn step(
        &mut self,
        ticks: &Ticks<'_>,
        elements: &[Element],
        left: &[Vector3<f64>],
        variance: f64,
    ) -> Option<f64> {
        let (soft, groups) = (elements.len(), self.iron.len());
        let matrix = self.matrix(elements);
        let mut normal = Normal::new(self.fields.len(), soft, groups, 1.0);
        for stretch in ticks.stretches() {
            let (window, group) = (ticks.window[stretch.start], ticks.group[stretch.start]);
            let (field, mut sums) = (self.fields[window], Sums::default());
            for k in stretch {
                let back = ticks.back(k);
                let weight = self.weights[k] / variance;
                sums.add(weight, &(matrix * back), &(back * field), &left[k], soft > 0);
            }
            normal.add(window, group, &sums, elements);
        }
        normal.smooth(&self.fields, RIDGE);
        for k in 0..soft + 3 * groups {
            let (now, sigma) = match k.checked_sub(soft) {
                None => (self.elements[k], SOFT_IRON_SIGMA),
                Some(i) => (self.iron[i / 3][i % 3], IRON_SIGMA),
            };
            normal.own[(k, k)] += 1.0 / (sigma * sigma) + RIDGE;
            normal.own_right[k] -= now / (sigma * sigma);
        }
        let (rest, fields) = normal.eliminate()?.solve()?;
        for (field, step) in self.fields.iter_mut().zip(&fields) {
            *field += step;
        }
        for k in 0..soft {
            self.elements[k] += rest[k];
        }
        for k in 0..3 * groups {
            self.iron[k / 3][k % 3] += rest[soft + k];
        }
        Some(fields.iter().map(Vector3::amax).fold(rest.amax(), f64::max))
    }
}

/// Fits hard irons, elements of the soft iron and fields to the ticks; outliers have less weight.
/// `None` if numbers are too large.
pub fn fit(ticks: &Ticks<'_>, elements: &[Element]) -> Option<Fit> {
    let mut found = Fit::start(ticks, elements.len());
    let n = ticks.field.len();
    let (mut left, mut squares) = (vec![Vector3::zeros(); n], Vec::with_capacity(n));
    for _ in 0..ROUNDS {
        pause();
        let variance = found.weigh(ticks, elements, &mut left, &mut squares);
        if found.step(ticks, elements, &left, variance)? < MAX_LAST_STEP {
            break;
        }
    }
    let weights = found.weights.clone();
    found.weigh(ticks, elements, &mut left, &mut squares);
    found.weights = weights;
    let sum: f64 = left.iter().zip(&found.weights).map(|(v, w)| v.norm_squared() * w).sum();
    found.scatter = (sum / n as f64 / 3.0).sqrt();
    Some(found)
}

/// Median of the values, whose order changes; for an even count the mean of the middle two.
pub(super) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let half = values.len() / 2;
    let is_even = values.len().is_multiple_of(2);
    let (below, middle, _) = values.select_nth_unstable_by(half, f64::total_cmp);
    if !is_even {
        return *middle;
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    0.5 * (lower + *middle)
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn median_of_any_number() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&mut []).is_nan());
    }
}
