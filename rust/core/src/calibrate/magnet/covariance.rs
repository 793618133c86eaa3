//! Standard errors of hard and soft iron: they are limited by differences between places, not by
//! noise.

use nalgebra::{DMatrix, Vector3};

use super::fit::{Fit, IRON_SIGMA, RIDGE, Ticks};
use super::normal::{Element, Normal, Sums};

/// Duration of a tick, s.
const TICK: f64 = 0.1;
/// Time of one independent observation, s, and largest number of observations in a group.
const OBSERVATION_S: f64 = 10.0;
const MAX_OBSERVATIONS: f64 = 4.0;
const MIN_OBSERVATIONS: f64 = 0.5;
/// Smallest scatter of a field of size 1.
const MIN_SCATTER: f64 = 0.01;

/// Prior standard deviations of the soft iron's elements.
pub type Doubt<'a> = &'a [f64];

/// Covariance of all elements of the soft iron, then of the hard irons of all groups.
///
/// `fit` has one number for each of the elements, zero for an element that was not fitted.
pub fn covariance(
    ticks: &Ticks<'_>,
    fit: &Fit,
    elements: &[Element],
    doubt: Doubt<'_>,
) -> Option<DMatrix<f64>> {
    let (soft, groups) = (elements.len(), ticks.groups());
    let size = soft + 3 * groups;
    let mut information = DMatrix::zeros(size, size);
    for k in 0..size {
        let sigma = doubt.get(k).copied().unwrap_or(IRON_SIGMA);
        information[(k, k)] = 1.0 / (sigma * sigma);
    }
    let limit = fit.scatter.max(MIN_SCATTER);
    for group in 0..groups {
        let (part, count) = of_group(ticks, fit, elements, group)?;
        if count == 0 {
            continue;
        }
        let length = count as f64;
        let observations =
            (length * TICK / OBSERVATION_S).clamp(MIN_OBSERVATIONS, MAX_OBSERVATIONS);
        let scale = observations / length / (limit * limit);
        let index = |k: usize| if k < soft { k } else { k + 3 * group };
        for i in 0..soft + 3 {
            for j in 0..soft + 3 {
                let both = 0.5 * (part[(i, j)] + part[(j, i)]);
                information[(index(i), index(j))] += both * scale;
            }
        }
    }
    information.try_inverse()
}

/// Information of one group on the elements and on its hard iron, with unknown fields, for a noise
/// of 1.
fn of_group(
    ticks: &Ticks<'_>,
    fit: &Fit,
    elements: &[Element],
    group: usize,
) -> Option<(DMatrix<f64>, usize)> {
    let variance = (fit.scatter * fit.scatter).max(1e-10);
    let sum = fit.elements.iter().zip(elements).map(|(x, element)| element * *x);
    let matrix = Element::identity() + sum.sum::<Element>();
    let stretches: Vec<_> =
        ticks.stretches().filter(|stretch| ticks.group[stretch.start] == group).collect();
    // Windows with ticks of the group, in order: successive windows are neighbours.
    let mut windows: Vec<usize> = stretches.iter().map(|one| ticks.window[one.start]).collect();
    windows.dedup();
    let mut normal = Normal::new(windows.len(), elements.len(), 1, variance);
    let mut count = 0;
    for stretch in stretches {
        let window = ticks.window[stretch.start];
        let index = windows.partition_point(|w| *w < window);
        let (field, mut sums) = (fit.fields[window], Sums::default());
        count += stretch.len();
        for k in stretch {
            let back = ticks.back(k);
            let (a, s) = (matrix * back, back * field);
            sums.add(fit.weights[k], &a, &s, &Vector3::zeros(), true);
        }
        normal.add(index, 0, &sums, elements);
    }
    let fields = vec![Vector3::zeros(); windows.len()];
    normal.smooth(&fields, RIDGE);
    Some((normal.eliminate()?.rest.own, count))
}
