//! Errors of the estimate: their covariance from tick to tick, and scalar corrections.
//!
//! The heading is separate, since no other state depends on it. A magnetometer corrects the heading
//! and its covariances, and leaves all other states bit-identical.

use nalgebra::{ComplexField, SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};
use wide::f64x4;

use crate::math::Symmetric;

/// Number of states: tilt about the two level axes, bias, matrix row by row, velocity along the two
/// level axes.
pub const STATES: usize = 16;
pub const BIAS: usize = 2;
pub const MATRIX: usize = 5;
pub const VELOCITY: usize = 14;
/// Number of states of bias and matrix.
const GYRO_STATES: usize = 12;

/// Derivative of the rotation about one axis within a tick by the errors of bias and matrix.
pub type Drivers = SVector<f64, GYRO_STATES>;
pub type States = SVector<f64, STATES>;

/// Number of registers for a column. The compiler's own packing is off for this library.
const LANES: usize = STATES / 4;

#[inline(always)]
fn lanes(column: &[f64; STATES]) -> [f64x4; LANES] {
    core::array::from_fn(|k| f64x4::from([0, 1, 2, 3].map(|i| column[4 * k + i])))
}

#[inline(always)]
fn numbers(lanes: &[f64x4; LANES]) -> [f64; STATES] {
    let parts = lanes.map(f64x4::to_array);
    core::array::from_fn(|i| parts[i / 4][i % 4])
}

/// Largest variances of tilt, heading and velocity, rad² and (m/s)².
const MAX_TILT: f64 = 0.5;
const MAX_HEADING: f64 = 10.0;
const MAX_VELOCITY: f64 = 1e2;

/// Transition of errors over a tick, and noise added to each error.
#[derive(Debug, Clone, Copy)]
pub struct Transition {
    /// Derivatives of the rotations about east, north and up.
    pub drivers: [Drivers; 3],
    /// Derivative of the velocity by the tilt: seconds times the force along up.
    pub lift: f64,
    pub tilt_noise: f64,
    pub heading_noise: f64,
    pub bias_noise: f64,
    pub matrix_noise: f64,
    pub velocity_noise: f64,
    /// Largest variances of bias and matrix with noise: the noise does not widen them further. The
    /// matrix has a diagonal and an off-diagonal value.
    pub bias_cap: f64,
    pub matrix_caps: [f64; 2],
}

/// Corrections computed in a tick.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    pub states: States,
    pub heading: f64,
}

/// Covariance of the errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Covariance of the states, symmetric.
    covariance: SMatrix<f64, STATES, STATES>,
    /// Covariances of the heading with the states, and its variance.
    with_heading: States,
    heading: f64,
}

impl Errors {
    /// Independent errors with these variances.
    pub fn new(variances: &States, heading: f64) -> Self {
        let covariance = SMatrix::from_diagonal(variances);
        Self { covariance, with_heading: States::zeros(), heading }
    }

    pub fn variance(&self, i: usize) -> f64 {
        self.covariance[(i, i)]
    }

    pub fn heading(&self) -> f64 {
        self.heading
    }

    /// Variance of the bias along a direction.
    pub fn bias_along(&self, direction: &Vector3<f64>) -> f64 {
        (self.covariance.fixed_view::<3, 3>(BIAS, BIAS) * direction).dot(direction).max(0.0)
    }

    pub fn covariance(&self) -> &SMatrix<f64, STATES, STATES> {
        &self.covariance
    }

    /// Propagates the errors through a tick; returns the factor by which the heading was shrunk to
    /// its bound.
    #[inline(always)]
    pub fn predict(&mut self, by: &Transition) -> f64 {
        let driven = self.driven(&by.drivers);
        self.predict_heading(by, &driven[2]);
        self.turn_rows(by, &driven);
        self.turn_columns(by);
        self.add_noise(by);
        self.bound()
    }

    /// Covariances of all states with the rotation about each axis that bias and matrix cause.
    #[inline(always)]
    fn driven(&self, drivers: &[Drivers; 3]) -> [States; 3] {
        let mut sums = [[f64x4::ZERO; LANES]; 3];
        for c in 0..GYRO_STATES {
            let column = lanes(&self.covariance.data.0[BIAS + c]);
            for (sum, drivers) in sums.iter_mut().zip(drivers) {
                let driver = f64x4::splat(drivers[c]);
                for (sum, element) in sum.iter_mut().zip(column) {
                    *sum += element * driver;
                }
            }
        }
        sums.map(|sum| States::from(numbers(&sum)))
    }

    /// Propagates the heading; it needs the covariance before the tick.
    #[inline(always)]
    fn predict_heading(&mut self, by: &Transition, driven: &States) {
        let drivers = &by.drivers[2];
        let mut moved = self.with_heading + driven;
        for c in 0..GYRO_STATES {
            self.heading += drivers[c] * (self.with_heading[BIAS + c] + moved[BIAS + c]);
        }
        for c in 0..GYRO_STATES {
            moved[0] += by.drivers[0][c] * moved[BIAS + c];
            moved[1] += by.drivers[1][c] * moved[BIAS + c];
        }
        moved[VELOCITY] += by.lift * moved[1];
        moved[VELOCITY + 1] -= by.lift * moved[0];
        self.with_heading = moved;
        self.heading += by.heading_noise;
    }

    /// F P in the columns of P, which is symmetric: the columns of P are its rows.
    #[inline(always)]
    fn turn_rows(&mut self, by: &Transition, [east, north, _]: &[States; 3]) {
        let p = &mut self.covariance.data.0;
        for i in 0..STATES {
            p[0][i] += east[i];
            p[1][i] += north[i];
        }
        for i in 0..STATES {
            p[VELOCITY][i] += by.lift * p[1][i];
            p[VELOCITY + 1][i] -= by.lift * p[0][i];
        }
    }

    /// (F P) Fᵀ: elements of bias and matrix stay, their covariances with other states are
    /// mirrored, other covariances are computed.
    #[inline(always)]
    fn turn_columns(&mut self, by: &Transition) {
        const REST: [usize; 4] = [0, 1, VELOCITY, VELOCITY + 1];
        let p = &mut self.covariance.data.0;
        for r in REST {
            let row = &mut p[r];
            for c in 0..GYRO_STATES {
                row[0] += by.drivers[0][c] * row[BIAS + c];
                row[1] += by.drivers[1][c] * row[BIAS + c];
            }
            row[VELOCITY] += by.lift * row[1];
            row[VELOCITY + 1] -= by.lift * row[0];
        }
        for r in REST {
            for i in BIAS..VELOCITY {
                p[i][r] = p[r][i];
            }
        }
        for (n, r) in REST.into_iter().enumerate() {
            for s in REST.into_iter().skip(n + 1) {
                p[s][r] = p[r][s];
            }
        }
    }

    #[inline(always)]
    fn add_noise(&mut self, by: &Transition) {
        let p = &mut self.covariance.data.0;
        let mut add = |i: usize, noise: f64, cap: f64| {
            p[i][i] += noise.min((cap - p[i][i]).max(0.0));
        };
        for i in 0..2 {
            add(i, by.tilt_noise, f64::INFINITY);
            add(VELOCITY + i, by.velocity_noise, f64::INFINITY);
        }
        for i in 0..3 {
            add(BIAS + i, by.bias_noise, by.bias_cap);
        }
        for i in 0..9 {
            add(MATRIX + i, by.matrix_noise, by.matrix_caps[usize::from(i % 4 != 0)]);
        }
    }

    /// Limits variances that have no meaning any more, as a whole row and column; returns the
    /// factor for the heading.
    #[inline(always)]
    fn bound(&mut self) -> f64 {
        let bounds = [MAX_TILT, MAX_TILT, MAX_VELOCITY, MAX_VELOCITY];
        for (i, bound) in [0, 1, VELOCITY, VELOCITY + 1].into_iter().zip(bounds) {
            if self.variance(i) > bound {
                self.shrink(i, ComplexField::sqrt(bound / self.variance(i)));
            }
        }
        if self.heading <= MAX_HEADING {
            return 1.0;
        }
        let factor = ComplexField::sqrt(MAX_HEADING / self.heading);
        self.with_heading *= factor;
        self.heading = MAX_HEADING;
        factor
    }

    #[cold]
    fn shrink(&mut self, i: usize, factor: f64) {
        for j in 0..STATES {
            self.covariance[(i, j)] *= factor;
            self.covariance[(j, i)] *= factor;
        }
        self.with_heading[i] *= factor;
    }

    /// Corrects by measurements of single states, one after the other: the state's index, the
    /// innovation, and the noise variance.
    #[inline(always)]
    pub fn correct<const N: usize>(
        &mut self,
        first: usize,
        innovations: [f64; N],
        noise: f64,
        found: &mut Found,
    ) {
        let mut gains = [[0.0; STATES]; N];
        for n in 0..N {
            let mut column = self.covariance.data.0[first + n];
            for gain in &gains[..n] {
                for i in 0..STATES {
                    column[i] -= gain[i] * gain[first + n];
                }
            }
            let scale = 1.0 / (column[first + n] + noise);
            let weight = (innovations[n] - found.states[first + n]) * scale;
            let along = self.with_heading[first + n];
            // The root of the scale on two sides keeps the covariance exactly symmetric.
            let root = ComplexField::sqrt(scale);
            for i in 0..STATES {
                found.states[i] += column[i] * weight;
                self.with_heading[i] -= column[i] * (along * scale);
                gains[n][i] = column[i] * root;
            }
            found.heading += along * weight;
            self.heading -= along * along * scale;
        }
        self.reduce(&gains);
    }

    /// Corrects by a measurement of the bias along one direction.
    pub fn correct_bias_along(
        &mut self,
        direction: &Vector3<f64>,
        innovation: f64,
        noise: f64,
        found: &mut Found,
    ) {
        let along = |v: &States| (0..3).map(|i| direction[i] * v[BIAS + i]).sum::<f64>();
        let column = States::from_fn(|i, _| along(&self.covariance.column(i).into_owned()));
        let scale = 1.0 / (along(&column) + noise);
        let weight = (innovation - along(&found.states)) * scale;
        let of_heading = along(&self.with_heading);
        let root = ComplexField::sqrt(scale);
        found.states += column * weight;
        found.heading += of_heading * weight;
        self.with_heading -= column * (of_heading * scale);
        self.heading -= of_heading * of_heading * scale;
        self.reduce(&[(column * root).into()]);
    }

    /// Subtracts the outer product of each gain from the covariance.
    #[inline(always)]
    fn reduce<const N: usize>(&mut self, gains: &[[f64; STATES]; N]) {
        let mut packed = [[f64x4::ZERO; LANES]; N];
        for (packed, gain) in packed.iter_mut().zip(gains) {
            *packed = lanes(gain);
        }
        for (j, column) in self.covariance.data.0.iter_mut().enumerate() {
            let mut rest = lanes(column);
            for (packed, gain) in packed.iter().zip(gains) {
                let gain = f64x4::splat(gain[j]);
                for (rest, packed) in rest.iter_mut().zip(packed) {
                    *rest -= *packed * gain;
                }
            }
            *column = numbers(&rest);
        }
    }

    /// Corrects only the heading, with a stated gain and this noise; other states do not change.
    pub fn correct_heading(&mut self, gain: f64, noise: f64) {
        let rest = 1.0 - gain;
        self.with_heading *= rest;
        self.heading = rest * rest * self.heading + gain * gain * noise;
    }

    /// Makes the states `i` independent of all others, with this variance.
    pub fn restart(&mut self, states: &[usize], variance: f64) {
        for i in states {
            for j in 0..STATES {
                self.covariance[(*i, j)] = 0.0;
                self.covariance[(j, *i)] = 0.0;
            }
            self.with_heading[*i] = 0.0;
            self.covariance[(*i, *i)] = variance;
        }
    }

    /// Sets the covariance of two states.
    pub fn couple(&mut self, i: usize, j: usize, covariance: f64) {
        self.covariance[(i, j)] = covariance;
        self.covariance[(j, i)] = covariance;
    }

    /// Sets the variance of the tilt to at least this mean over the two level axes, in any
    /// direction.
    pub fn widen_tilt(&mut self, variance: f64) {
        let more = (variance - 0.5 * (self.variance(0) + self.variance(1))).max(0.0);
        for i in 0..2 {
            self.covariance[(i, i)] += more;
        }
        self.bound();
    }

    /// Adds to the variance of the bias about level axes, which is the part that a tilt shows.
    pub fn widen_level_bias(&mut self, variance: f64, up: &Vector3<f64>) {
        // Rounding of the length of `up` must not reduce a variance.
        let whole = up.norm_squared();
        for i in 0..3 {
            for j in 0..3 {
                let level = if i == j { whole } else { 0.0 } - up[i] * up[j];
                self.covariance[(BIAS + i, BIAS + j)] += variance * level;
            }
        }
    }

    /// Adds to the variance of the bias along a direction, if the addition is positive.
    pub fn widen_bias_along(&mut self, direction: &Vector3<f64>, variance: f64) {
        let variance = variance.max(0.0);
        for i in 0..3 {
            for j in 0..3 {
                self.covariance[(BIAS + i, BIAS + j)] += variance * (direction[i] * direction[j]);
            }
        }
    }

    /// Adds to the variance of the heading, if the addition is positive.
    pub fn widen_heading(&mut self, variance: f64) {
        self.heading += variance.max(0.0);
    }

    /// Adds to the variances of tilt and heading; returns the factor by which the heading was
    /// shrunk to its bound.
    pub fn blur(&mut self, tilt: f64, heading: f64) -> f64 {
        self.covariance[(0, 0)] += tilt;
        self.covariance[(1, 1)] += tilt;
        self.heading += heading;
        self.bound()
    }

    /// Makes the heading independent of all other states, with this variance.
    pub fn restart_heading(&mut self, variance: f64) {
        self.with_heading = States::zeros();
        self.heading = variance;
    }
}

impl Errors {
    /// True if this is a valid covariance.
    pub fn is_valid(&self) -> bool {
        let all = Symmetric::<f64, { STATES + 1 }>::from_upper(|i, j| match (i, j) {
            (0..STATES, 0..STATES) => self.covariance[(i, j)],
            (_, STATES) if i < STATES => self.with_heading[i],
            _ => self.heading,
        });
        self.covariance == self.covariance.transpose() && all.is_covariance(1e3)
    }

    /// Takes over only the estimate of the matrix.
    pub fn keep_matrix(&mut self, other: &Self) {
        for i in MATRIX..VELOCITY {
            for j in MATRIX..VELOCITY {
                self.covariance[(i, j)] = other.covariance[(i, j)];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        BIAS, Drivers, Errors, Found, GYRO_STATES, MATRIX, STATES, States, Transition, VELOCITY,
    };
    use nalgebra::{SMatrix, SVector};
    use proptest::prelude::*;

    /// The heading comes last.
    const ALL: usize = STATES + 1;
    type All = SMatrix<f64, ALL, ALL>;

    fn whole(errors: &Errors) -> All {
        All::from_fn(|i, j| match (i, j) {
            (STATES, STATES) => errors.heading,
            (STATES, k) | (k, STATES) => errors.with_heading[k],
            index => errors.covariance[index],
        })
    }

    fn parts(p: &All) -> Errors {
        let with_heading = States::from_fn(|i, _| p[(i, STATES)]);
        let covariance = p.fixed_view::<STATES, STATES>(0, 0).into_owned();
        Errors { covariance, with_heading, heading: p[(STATES, STATES)] }
    }

    fn sizes() -> States {
        States::from_fn(|i, _| match i {
            0..BIAS => 0.05,
            BIAS..MATRIX => 4e-3,
            MATRIX..VELOCITY => 2e-3,
            _ => 0.3,
        })
    }

    prop_compose! {
        /// Errors that all depend on each other, of usual sizes, below every bound.
        fn covariances()(numbers in prop::collection::vec(-1.0..1.0_f64, ALL * ALL)) -> All {
            let root = All::from_row_slice(&numbers) / (ALL as f64).sqrt();
            let sizes = SVector::<f64, ALL>::from_fn(|i, _| sizes().get(i).copied().unwrap_or(0.2));
            let product = root * root.transpose();
            All::from_fn(|i, j| sizes[i] * sizes[j] * (product[(i, j)] + product[(j, i)]) / 2.0)
        }
    }

    prop_compose! {
        fn transitions()(
            numbers in prop::collection::vec(-0.5..0.5_f64, 3 * GYRO_STATES),
            lift in -2.0..2.0_f64,
            noise in prop::array::uniform5(0.0..1e-4_f64),
        ) -> Transition {
            Transition {
                drivers: [0, 1, 2].map(|i| Drivers::from_column_slice(&numbers[GYRO_STATES * i..][..GYRO_STATES])),
                lift,
                tilt_noise: noise[0],
                heading_noise: noise[1],
                bias_noise: noise[2],
                matrix_noise: noise[3],
                velocity_noise: noise[4],
                bias_cap: 1.0,
                matrix_caps: [1.0; 2],
            }
        }
    }

    /// φ += A (b, S), then v += h (φ_y, -φ_x).
    fn transition(by: &Transition) -> All {
        let (mut turned, mut lifted) = (All::identity(), All::identity());
        for (i, drivers) in [0, 1, STATES].into_iter().zip(&by.drivers) {
            turned.fixed_view_mut::<1, GYRO_STATES>(i, BIAS).copy_from(&drivers.transpose());
        }
        (lifted[(VELOCITY, 1)], lifted[(VELOCITY + 1, 0)]) = (by.lift, -by.lift);
        lifted * turned
    }

    fn noise(by: &Transition) -> All {
        All::from_diagonal(&SVector::from_fn(|i, _| match i {
            0..BIAS => by.tilt_noise,
            BIAS..MATRIX => by.bias_noise,
            MATRIX..VELOCITY => by.matrix_noise,
            VELOCITY..STATES => by.velocity_noise,
            _ => by.heading_noise,
        }))
    }

    /// Correction and covariance in Joseph's form, by a measurement of one state.
    fn measured(i: usize, innovation: f64, noise: f64, x: &mut SVector<f64, ALL>, p: &All) -> All {
        let gain = p.column(i) / (p[(i, i)] + noise);
        *x += gain * (innovation - x[i]);
        let mut rest = All::identity();
        for j in 0..ALL {
            rest[(j, i)] -= gain[j];
        }
        rest * p * rest.transpose() + gain * gain.transpose() * noise
    }

    /// Compares with a tolerance for elements that are sums of terms of very different size.
    fn assert_equal(got: &Errors, expected: &All) -> Result<(), TestCaseError> {
        let got = whole(got);
        for i in 0..ALL {
            for j in 0..ALL {
                let size = (expected[(i, i)] * expected[(j, j)]).sqrt();
                prop_assert!((got[(i, j)] - expected[(i, j)]).abs() <= 1e-12 * size, "{i} {j}");
            }
        }
        prop_assert_eq!(got, got.transpose());
        Ok(())
    }

    proptest! {
        #[test]
        fn a_prediction_is_the_product_of_matrices(p in covariances(), by in transitions()) {
            let (mut errors, f) = (parts(&p), transition(&by));
            errors.predict(&by);
            assert_equal(&errors, &(f * p * f.transpose() + noise(&by)))?;
        }

        #[test]
        fn corrections_are_those_of_joseph(
            p in covariances(),
            innovations in prop::array::uniform3(-1.0..1.0_f64),
            noise in 1e-3..1.0_f64,
        ) {
            // The noise is similar to the state's variance: far less would lose digits in any form.
            for (first, noise) in [(BIAS, noise * 1e-4), (VELOCITY - 1, noise)] {
                let (mut errors, mut expected) = (parts(&p), p);
                let mut found = Found { states: States::zeros(), heading: 0.0 };
                let mut x = SVector::zeros();
                errors.correct(first, innovations, noise, &mut found);
                for (k, innovation) in innovations.into_iter().enumerate() {
                    expected = measured(first + k, innovation, noise, &mut x, &expected);
                }
                assert_equal(&errors, &expected)?;
                for i in 0..STATES {
                    prop_assert!((found.states[i] - x[i]).abs() <= 1e-10 * x.amax());
                }
                prop_assert!((found.heading - x[STATES]).abs() <= 1e-10 * x.amax());
            }
        }

        #[test]
        fn the_heading_alone_learns_from_a_field(p in covariances(), noise in 1e-3..1.0_f64) {
            let mut errors = parts(&p);
            let gain = errors.heading() / (errors.heading() + noise);
            errors.correct_heading(gain, noise);
            let mut rest = All::identity();
            rest[(STATES, STATES)] -= gain;
            let mut expected = rest * p * rest.transpose();
            expected[(STATES, STATES)] += gain * gain * noise;
            assert_equal(&errors, &expected)?;
            prop_assert_eq!(errors.covariance, parts(&p).covariance);
        }

        #[test]
        fn bounds_and_caps_leave_a_covariance(p in covariances(), by in transitions()) {
            let mut errors = parts(&(p * 1e2));
            let by = Transition { bias_cap: 1e-4, matrix_caps: [1e-5; 2], ..by };
            let before = errors;
            errors.predict(&by);
            prop_assert!(errors.is_valid());
            // Noise raises a variance up to its cap; a larger variance stays.
            for i in BIAS..VELOCITY {
                let cap = if i < MATRIX { by.bias_cap } else { by.matrix_caps[0] };
                let most = before.variance(i).max(cap);
                prop_assert!(errors.variance(i) <= most * (1.0 + 1e-12));
            }
            errors.blur(1.0, 20.0);
            prop_assert!(errors.is_valid());
            // To the rounding of a root and its square.
            prop_assert!(errors.variance(0) <= 0.5 + 1e-15 && errors.heading() <= 10.0);
        }
    }
}
