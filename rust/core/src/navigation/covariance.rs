//! The covariance of the errors: its growth over a step, and its reduction by a scalar measurement.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::filter::Observer;
use super::motion::cross_columns;
use crate::math::{Fours, OnRows, Pairs, Real, widest};

/// Number of errors: position, velocity, orientation, biases of gyro and accelerometer.
pub const STATES: usize = 15;

/// A row of the errors, with one more place to fill SIMD registers.
pub(crate) type Row = [f64; 16];

/// Smallest noise of a scalar, relative to its variance from the errors. With less noise, rounding
/// would make variances negative.
const MIN_NOISE: f64 = 1e-8;

/// Index of each error's first component.
pub(crate) const R: usize = 0;
pub(crate) const V: usize = 3;
pub(crate) const PHI: usize = 6;
pub(crate) const GYRO: usize = 9;
pub(crate) const ACCEL: usize = 12;

/// Innovation of a scalar after the earlier scalars, and its variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Innovation {
    pub value: f64,
    pub variance: f64,
}

impl Innovation {
    pub const NONE: Self = Self { value: f64::NAN, variance: f64::NAN };

    /// Normalised innovation squared: 1 on average.
    #[inline(always)]
    pub fn nis(&self) -> f64 {
        self.value * self.value * (1.0 / self.variance)
    }
}

/// A scalar that was used: its derivatives by errors and constants, its covariances with them, and
/// its innovation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scalar {
    pub(crate) h: Row,
    pub(crate) hw: Constants,
    pub(crate) gain: Row,
    pub(crate) own: Constants,
    pub(crate) new: Innovation,
}

/// Errors, estimated minus true; errors of biases are true minus estimated.
pub type Errors = [f64; STATES];

/// Covariance of the errors, symmetric to the bit. Each row has a sixteenth place, zero. The
/// covariance of estimated constants is part of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Covariance(pub(crate) [Row; STATES], pub(crate) Option<ConstantsCovariance>);

/// Number of constants that may be estimated with the errors: scale, yaw and pitch of wheels,
/// position of the antenna, reference of the barometer, and offset of the compass. Their errors are
/// true minus estimated.
pub const CONSTANTS: usize = 8;
/// Number of constants of a filter without barometer and compass: the first constants.
pub(crate) const CONSTANTS_WITHOUT_AIDS: usize = 6;

/// Index of the antenna's first component, and indices of the constants after it.
pub(crate) const ANTENNA: usize = 3;
pub(crate) const BAROMETER: usize = 6;
pub(crate) const COMPASS: usize = 7;

/// One number for each constant.
pub type Constants = [f64; CONSTANTS];

/// Covariance of the constants' errors: with the errors of the filter, one row each, and with each
/// other. Also their estimated errors from the scalars to date, not yet subtracted. A constant that
/// is not estimated has variance zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct ConstantsCovariance {
    pub cross: [Row; CONSTANTS],
    pub own: [Constants; CONSTANTS],
    pub found: Constants,
    /// True if the antenna is considered, not estimated: no scalar changes its position or its
    /// covariance (S. F. Schmidt, *Advances in Control Systems* 3, 1966).
    pub considers_antenna: bool,
    /// True if the constants of barometer and compass are used.
    pub aided: bool,
}

impl ConstantsCovariance {
    /// Covariance if all constants are known.
    pub const NONE: Self = Self {
        cross: [[0.0; 16]; CONSTANTS],
        own: [[0.0; CONSTANTS]; CONSTANTS],
        found: [0.0; CONSTANTS],
        considers_antenna: false,
        aided: false,
    };

    /// Sets the standard deviations of some constants, from the index `first` on.
    pub fn with<const N: usize>(mut self, first: usize, sigmas: [f64; N]) -> Self {
        for (k, sigma) in sigmas.into_iter().enumerate() {
            self.own[first + k][first + k] = sigma * sigma;
        }
        self
    }

    /// Standard deviation of a constant.
    pub fn sigma(&self, constant: usize) -> f64 {
        self.own[constant][constant].at_least(0.0).simd_sqrt()
    }

    /// True if a constant is estimated.
    #[inline(always)]
    pub fn has(&self, constant: usize) -> bool {
        self.own[constant][constant] > 0.0
    }

    /// The part that remains if the errors restart.
    pub fn alone(&self) -> Self {
        Self { cross: [[0.0; 16]; CONSTANTS], found: [0.0; CONSTANTS], ..*self }
    }

    fn propagate(&mut self, transition: &Transition) {
        for (k, row) in self.cross.iter_mut().enumerate() {
            if self.own[k][k] == 0.0 {
                continue;
            }
            let mut errors = [0.0; STATES];
            errors.copy_from_slice(&row[..STATES]);
            row[..STATES].copy_from_slice(&transition.apply(&errors));
        }
    }

    /// Gains of a scalar with derivatives `h` by the errors and `hw` by the first N constants.
    pub fn gain<const N: usize>(&self, h: &Row, hw: &Constants) -> Constants {
        let mut gain = [0.0; CONSTANTS];
        for (k, gain) in gain.iter_mut().enumerate().take(N) {
            let of_errors = (0..STATES).map(|i| self.cross[k][i] * h[i]).sum::<f64>();
            *gain = of_errors + (0..N).map(|l| self.own[k][l] * hw[l]).sum::<f64>();
        }
        gain
    }
}

/// Transition of errors over a step: the blocks of Φ that are neither zero nor one, each row with
/// all its factors in sequence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// From velocity, orientation and biases; the position itself has factor one.
    position: [[f64; 12]; 3],
    /// From velocity, orientation and biases.
    velocity: [[f64; 12]; 3],
    /// From orientation and the bias of the gyro.
    attitude: [[f64; 6]; 3],
}

/// Means over a step of the quantities that its covariance depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Course {
    pub seconds: f64,
    pub attitude: Matrix3<f64>,
    pub velocity: Vector3<f64>,
    pub earth: Vector3<f64>,
    pub transport: Vector3<f64>,
    pub gravity: f64,
}

/// Variances that a step adds: white noise through the orientation, and random walks of the biases.
#[derive(Debug, Clone, Copy)]
pub struct Growth {
    phi: Matrix3<f64>,
    velocity_phi: Matrix3<f64>,
    velocity: Matrix3<f64>,
    gyro: Vector3<f64>,
    accel: Vector3<f64>,
}

impl Transition {
    /// I + FT + F²T²/2, and F³T³/6 from the bias of the gyro to the position.
    pub(crate) fn over(course: &Course) -> Self {
        let Course { seconds: t, attitude, velocity, earth, transport, gravity } = course;
        let (one, half) = (Matrix3::<f64>::identity(), 0.5 * t * t);
        let skew = |v: Vector3<f64>| v.cross_matrix();
        // v' = -(2Ω+ρ)×v - g×φ + …, φ' = -(Ω+ρ)×φ - …
        let (coriolis, turn) = (-(earth * 2.0 + transport), -(earth + transport));
        let fall = Vector3::new(0.0, 0.0, -gravity);
        let propagated = cross_columns(velocity, attitude);
        let fallen = cross_columns(&fall, attitude);
        let [from_v, by_v] = [skew(coriolis), skew(*velocity)];
        let r = [
            one * *t + from_v * half,
            by_v * *t + (skew(fall) + cross_columns(velocity, &skew(turn))) * half,
            fallen * (-half * t / 3.0),
            attitude * half,
        ];
        let v = [
            one + from_v * *t + cross_columns(&coriolis, &from_v) * half,
            skew(fall) * *t
                + (cross_columns(&coriolis, &skew(fall)) + cross_columns(&fall, &skew(turn)))
                    * half,
            propagated * *t + (cross_columns(&coriolis, &propagated) - fallen) * half,
            attitude * *t + cross_columns(&coriolis, attitude) * half,
        ];
        let phi = [
            one + skew(turn) * *t + cross_columns(&turn, &skew(turn)) * half,
            -(attitude * *t + cross_columns(&turn, attitude) * half),
        ];
        Self { position: hstack(&r), velocity: hstack(&v), attitude: hstack(&phi) }
    }

    /// Φ times the rows of a matrix, in place: each row of Φ uses only later rows, or its own row.
    #[inline(always)]
    fn times<F: Fours>(&self, fours: F, rows: &mut [Row; STATES]) {
        for (i, factors) in self.position.iter().enumerate() {
            let row = fours.sum(rows[i], factors, &rows[V..]);
            rows[i] = row;
        }
        let [a, b, c] = &self.velocity;
        // Not a closure, since it would be compiled without the caller's instruction set.
        let (none, from) = ([0.0; 16], &rows[V..]);
        let v = [fours.sum(none, a, from), fours.sum(none, b, from), fours.sum(none, c, from)];
        rows[V..PHI].copy_from_slice(&v);
        let [a, b, c] = &self.attitude;
        let from = &rows[PHI..];
        let phi = [fours.sum(none, a, from), fours.sum(none, b, from), fours.sum(none, c, from)];
        rows[PHI..GYRO].copy_from_slice(&phi);
    }

    /// Φᵀ times the rows of a matrix, in place.
    #[cfg(feature = "std")]
    #[inline(always)]
    pub(crate) fn transposed_times<F: Fours, const W: usize>(
        &self,
        fours: F,
        rows: &mut [[f64; W]],
    ) {
        let old: [[f64; W]; GYRO] = core::array::from_fn(|i| rows[i]);
        for k in 0..12 {
            // For velocity and orientation, the rows of the transition contain the unchanged part.
            let kept = if V + k < GYRO { [0.0; W] } else { rows[V + k] };
            let by = |rows: &[[f64; 12]; 3]| rows.map(|row| row[k]);
            let moved = fours.sum(kept, &by(&self.position), &old);
            rows[V + k] = fours.sum(moved, &by(&self.velocity), &old[V..]);
        }
        for k in 0..6 {
            let factors = self.attitude.map(|row| row[k]);
            rows[PHI + k] = fours.sum(rows[PHI + k], &factors, &old[PHI..]);
        }
    }

    /// Φ times a vector.
    pub fn apply(&self, x: &Errors) -> Errors {
        let mut y = *x;
        let sum = |factors: &[f64], from: usize| {
            factors.iter().zip(&x[from..]).map(|(f, x)| f * x).sum::<f64>()
        };
        for i in 0..3 {
            y[R + i] += sum(&self.position[i], V);
            y[V + i] = sum(&self.velocity[i], V);
            y[PHI + i] = sum(&self.attitude[i], PHI);
        }
        y
    }

    /// Φᵀ times a vector.
    pub fn apply_transposed(&self, x: &Errors) -> Errors {
        let mut y = *x;
        y[V..GYRO].fill(0.0);
        for i in 0..3 {
            for k in 0..12 {
                y[V + k] += self.position[i][k] * x[R + i] + self.velocity[i][k] * x[V + i];
            }
            for k in 0..6 {
                y[PHI + k] += self.attitude[i][k] * x[PHI + i];
            }
        }
        y
    }
}

/// Stacks blocks of three rows horizontally.
#[inline(always)]
fn hstack<const N: usize, const W: usize>(blocks: &[Matrix3<f64>; N]) -> [[f64; W]; 3] {
    let mut rows = [[0.0; W]; 3];
    for (b, block) in blocks.iter().enumerate() {
        for (i, row) in rows.iter_mut().enumerate() {
            for j in 0..3 {
                row[3 * b + j] = block[(i, j)];
            }
        }
    }
    rows
}

/// A row minus a gain times gains over a variance, with the same bits on the two sides of the
/// diagonal.
#[inline(always)]
fn lessen(row: &mut Row, own: f64, gain: &Row, inverse: f64) {
    let (own, inverse) = (Pairs.splat(own), Pairs.splat(inverse));
    for k in 0..4 {
        let less = Pairs.multiply(Pairs.multiply(own, Pairs.take(gain, k)), inverse);
        Pairs.put(Pairs.subtract(Pairs.take(row, k), less), row, k);
    }
}

impl Growth {
    /// Growth over half a step: white noise of gyro and accelerometer, N², and random walks of
    /// their biases, K².
    pub(crate) fn over_half(
        course: &Course,
        white: [&Vector3<f64>; 2],
        walk: [&Vector3<f64>; 2],
    ) -> Self {
        let half = 0.5 * course.seconds;
        let through = |n: &Vector3<f64>| {
            let scaled = course.attitude * Matrix3::from_diagonal(&(n * half));
            scaled * course.attitude.transpose()
        };
        let phi = through(white[0]);
        let velocity_phi = -cross_columns(&course.velocity, &phi);
        // [v×] W [v×]ᵀ = -([v×] ([v×] W)ᵀ)ᵀ; the two factors are symmetric.
        let propagated = cross_columns(&course.velocity, &velocity_phi.transpose()) * -1.0;
        let velocity = through(white[1]) + propagated;
        Self { phi, velocity_phi, velocity, gyro: walk[0] * half, accel: walk[1] * half }
    }

    /// Adds variances of an unmeasured rotation and velocity change.
    pub(crate) fn add_unknown(&mut self, course: &Course, phi: f64, velocity: f64) {
        let v = course.velocity.cross_matrix();
        self.phi += Matrix3::from_diagonal_element(phi);
        self.velocity_phi -= v * phi;
        self.velocity += Matrix3::from_diagonal_element(velocity) - v * v * phi;
    }
}

impl Covariance {
    /// Covariance of independent errors with these variances.
    pub(crate) fn of(variances: &Errors) -> Self {
        let mut rows = [[0.0; 16]; STATES];
        for (i, variance) in variances.iter().enumerate() {
            rows[i][i] = *variance;
        }
        Self(rows, None)
    }

    /// Element of a row and a column.
    #[inline(always)]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.0[row][column]
    }

    /// Φ(P + G)Φᵀ + G; G is the growth in half a step.
    pub(crate) fn propagate(&mut self, transition: &Transition, growth: &Growth) {
        widest(Propagation { covariance: self, transition, growth });
        if let Some(extra) = &mut self.1 {
            extra.propagate(transition);
        }
    }

    #[inline(always)]
    fn grow(&mut self, growth: &Growth) {
        let p = &mut self.0;
        for i in 0..3 {
            for j in 0..3 {
                p[PHI + i][PHI + j] += growth.phi[(i, j)];
                p[V + i][PHI + j] += growth.velocity_phi[(i, j)];
                p[PHI + j][V + i] += growth.velocity_phi[(i, j)];
                p[V + i][V + j] += growth.velocity[(i, j)];
            }
            p[GYRO + i][GYRO + i] += growth.gyro[i];
            p[ACCEL + i][ACCEL + i] += growth.accel[i];
        }
    }

    #[inline(always)]
    fn transpose(&mut self) {
        for i in 0..STATES {
            for j in 0..i {
                let upper = self.0[j][i];
                self.0[j][i] = self.0[i][j];
                self.0[i][j] = upper;
            }
        }
    }

    /// Mean of the upper and lower triangle.
    #[inline(always)]
    fn even_out(&mut self) {
        for i in 0..STATES {
            for j in 0..i {
                let mean = 0.5 * (self.0[i][j] + self.0[j][i]);
                self.0[i][j] = mean;
                self.0[j][i] = mean;
            }
        }
    }

    /// Corrects by a scalar with derivatives `h` by the errors, and its noise variance. `found` are
    /// the estimated errors from earlier scalars. Returns the innovation.
    #[inline]
    pub(crate) fn correct<W: Observer>(
        &mut self,
        h: &Row,
        z: f64,
        noise: f64,
        found: &mut Errors,
        observer: &mut W,
    ) -> Innovation {
        if self.1.is_some() {
            return self.correct_with_constants(h, &[0.0; CONSTANTS], z, noise, found, observer);
        }
        let gain = Pairs.sum([0.0; 16], h, &self.0);
        let (mut variance, mut innovation) = (0.0, z);
        for i in 0..STATES {
            variance += gain[i] * h[i];
            innovation -= found[i] * h[i];
        }
        variance += noise.at_least(MIN_NOISE * variance);
        let inverse = 1.0 / variance;
        for i in 0..STATES {
            found[i] += gain[i] * (innovation * inverse);
            lessen(&mut self.0[i], gain[i], &gain, inverse);
        }
        let new = Innovation { value: innovation, variance };
        let none = [0.0; CONSTANTS];
        observer.record_scalar(&Scalar { h: *h, hw: none, gain, own: none, new });
        new
    }

    /// Corrects by a scalar, but keeps the estimate of the gyro's bias, which is considered, not
    /// corrected (S. F. Schmidt, *Advances in Control Systems* 3, 1966).
    pub(crate) fn correct_considering(
        &mut self,
        h: &Row,
        z: f64,
        noise: f64,
        found: &mut Errors,
    ) -> Innovation {
        let rows = [0, 1, 2].map(|i| self.0[GYRO + i]);
        let kept = [0, 1, 2].map(|i| found[GYRO + i]);
        let new = self.correct(h, z, noise, found, &mut ());
        for i in 0..3 {
            self.0[GYRO + i][GYRO..ACCEL].copy_from_slice(&rows[i][GYRO..ACCEL]);
        }
        found[GYRO..ACCEL].copy_from_slice(&kept);
        new
    }

    /// Corrects by a scalar with derivatives `hw` by estimated constants.
    pub(crate) fn correct_with_constants<W: Observer>(
        &mut self,
        h: &Row,
        hw: &Constants,
        z: f64,
        noise: f64,
        found: &mut Errors,
        observer: &mut W,
    ) -> Innovation {
        let measured = (h, hw, z, noise);
        match &self.1 {
            None => Innovation::NONE,
            Some(extra) if extra.aided => {
                self.correct_with::<CONSTANTS, W>(measured, found, observer)
            }
            Some(_) => self.correct_with::<CONSTANTS_WITHOUT_AIDS, W>(measured, found, observer),
        }
    }

    /// Corrects by a scalar with derivatives by the first N constants.
    #[inline(never)]
    fn correct_with<const N: usize, W: Observer>(
        &mut self,
        (h, hw, z, noise): (&Row, &Constants, f64, f64),
        found: &mut Errors,
        observer: &mut W,
    ) -> Innovation {
        let Some(extra) = &mut self.1 else { return Innovation::NONE };
        let gain = Pairs.sum(Pairs.sum([0.0; 16], h, &self.0), &hw[..N], &extra.cross[..N]);
        let own = extra.gain::<N>(h, hw);
        let (mut variance, mut innovation) = (0.0, z);
        for i in 0..STATES {
            variance += gain[i] * h[i];
            innovation -= found[i] * h[i];
        }
        for k in 0..N {
            variance += own[k] * hw[k];
            innovation -= extra.found[k] * hw[k];
        }
        variance += noise.at_least(MIN_NOISE * variance);
        let inverse = 1.0 / variance;
        for i in 0..STATES {
            found[i] += gain[i] * (innovation * inverse);
            lessen(&mut self.0[i], gain[i], &gain, inverse);
        }
        let considers = extra.considers_antenna;
        let is_considered = |k: usize| considers && (ANTENNA..BAROMETER).contains(&k);
        for k in 0..N {
            lessen(&mut extra.cross[k], own[k], &gain, inverse);
            if !is_considered(k) {
                extra.found[k] += own[k] * (innovation * inverse);
            }
            for l in 0..N {
                if !(is_considered(k) && is_considered(l)) {
                    extra.own[k][l] -= (own[k] * own[l]) * inverse;
                }
            }
        }
        let new = Innovation { value: innovation, variance };
        // The smoother uses scalars with an optimal gain, and covariances otherwise.
        if !considers {
            observer.record_scalar(&Scalar { h: *h, hw: *hw, gain, own, new });
        }
        new
    }

    /// True if the antenna is considered, not estimated.
    pub(crate) fn considers_antenna(&self) -> bool {
        self.1.is_some_and(|extra| extra.considers_antenna)
    }

    /// Variance of a scalar without its noise.
    pub(crate) fn variance_with_constants(&self, h: &Row, hw: &Constants) -> f64 {
        let Some(extra) = &self.1 else { return 0.0 };
        let gain = Pairs.sum(Pairs.sum([0.0; 16], h, &self.0), hw, &extra.cross);
        let own = extra.gain::<CONSTANTS>(h, hw);
        (0..STATES).map(|i| gain[i] * h[i]).sum::<f64>()
            + (0..CONSTANTS).map(|k| own[k] * hw[k]).sum::<f64>()
    }

    /// Sets the errors of position and velocity that follow from the antenna's errors, at the fix
    /// at which the filter begins.
    #[cold]
    pub(crate) fn propagate_antenna(&mut self, rows: &[[f64; 3]; 6]) {
        let Some(extra) = &mut self.1 else { return };
        let through = |of: &[f64]| rows.map(|row| (0..3).map(|j| row[j] * of[ANTENNA + j]).sum());
        for k in 0..CONSTANTS {
            let moved: [f64; 6] = through(&extra.own[k]);
            extra.cross[k][..6].copy_from_slice(&moved);
        }
        for i in 0..6 {
            for j in 0..=i {
                let more: f64 = (0..3).map(|a| rows[i][a] * extra.cross[ANTENNA + a][j]).sum();
                self.0[i][j] += more;
                self.0[j][i] = self.0[i][j];
            }
        }
    }

    /// Covariance after a restart of the errors; the constants keep their covariance.
    pub(crate) fn with_variances(&self, variances: &Errors) -> Self {
        Self(Self::of(variances).0, self.1.map(|extra| extra.alone()))
    }

    /// Couples velocity and orientation. The velocity error is defined in the assumed frame: for a
    /// moving body it includes a part from the orientation.
    pub(crate) fn couple(&mut self, velocity: &Vector3<f64>) {
        let phi = Matrix3::from_fn(|i, j| self.at(PHI + i, PHI + j));
        let velocity_phi = -cross_columns(velocity, &phi);
        let propagated = -cross_columns(velocity, &velocity_phi.transpose());
        for i in 0..3 {
            for j in 0..3 {
                self.0[V + i][PHI + j] += velocity_phi[(i, j)];
                self.0[PHI + j][V + i] += velocity_phi[(i, j)];
                self.0[V + i][V + j] += 0.5 * (propagated[(i, j)] + propagated[(j, i)]);
            }
        }
        if let Some(extra) = self.1.as_mut().filter(|extra| extra.has(COMPASS)) {
            let row = &mut extra.cross[COMPASS];
            let moved = velocity.cross(&Vector3::new(row[PHI], row[PHI + 1], row[PHI + 2]));
            (0..3).for_each(|i| row[V + i] -= moved[i]);
        }
    }

    /// Couples the heading to the compass: the heading's error equals the error of the compass's
    /// offset.
    pub(crate) fn couple_heading(&mut self) {
        if let Some(extra) = &mut self.1 {
            extra.cross[COMPASS][PHI + 2] = -extra.own[COMPASS][COMPASS];
        }
    }

    /// Variance of a sum of some errors with factors `h`.
    pub(crate) fn variance<const N: usize>(&self, h: &Row, errors: [usize; N]) -> f64 {
        let of = |i: usize| errors.iter().map(|j| self.0[i][*j] * h[*j]).sum::<f64>() * h[i];
        errors.iter().map(|i| of(*i)).sum()
    }

    /// Adds to the variance of a constant that is estimated.
    pub(crate) fn widen_constant(&mut self, constant: usize, variance: f64) {
        if let Some(extra) = self.1.as_mut().filter(|extra| extra.has(constant)) {
            extra.own[constant][constant] += variance;
        }
    }

    /// Begins to estimate a constant of the aids, if its standard deviation is not zero.
    pub(crate) fn begin_constant(&mut self, constant: usize, sigma: f64) {
        if sigma > 0.0 {
            let extra = self.1.get_or_insert(ConstantsCovariance::NONE);
            *extra = extra.with(constant, [sigma]);
            extra.aided = true;
        }
    }

    /// Variance of a constant, zero if it is not estimated.
    pub(crate) fn constant_variance(&self, constant: usize) -> f64 {
        self.1.as_ref().map_or(0.0, |extra| extra.own[constant][constant])
    }

    /// True if a constant is estimated.
    pub(crate) fn has_constant(&self, constant: usize) -> bool {
        self.1.as_ref().is_some_and(|extra| extra.has(constant))
    }

    /// Adds to the variance of an error.
    pub(crate) fn widen(&mut self, error: usize, variance: f64) {
        self.0[error][error] += variance;
    }

    /// Sums of variances: of position, velocity and orientation.
    pub(crate) fn sizes(&self) -> [f64; 3] {
        [R, V, PHI].map(|i| self.at(i, i) + self.at(i + 1, i + 1) + self.at(i + 2, i + 2))
    }
}

/// A step of the covariance of the errors.
struct Propagation<'a> {
    covariance: &'a mut Covariance,
    transition: &'a Transition,
    growth: &'a Growth,
}

impl OnRows for Propagation<'_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Fours>(self, fours: F) {
        let Self { covariance, transition, growth } = self;
        covariance.grow(growth);
        transition.times(fours, &mut covariance.0);
        covariance.transpose();
        transition.times(fours, &mut covariance.0);
        covariance.grow(growth);
        covariance.even_out();
    }
}

#[cfg(test)]
mod tests {
    use super::{Course, STATES, Transition};
    use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

    type Full = SMatrix<f64, STATES, STATES>;

    /// Matrix F of the differential equations.
    fn drive(course: &Course) -> Full {
        let mut f = Full::zeros();
        let skew = |v: Vector3<f64>| v.cross_matrix();
        let mut set = |i: usize, j: usize, m: Matrix3<f64>| {
            f.fixed_view_mut::<3, 3>(i, j).copy_from(&m);
        };
        let c = course.attitude;
        set(0, 3, Matrix3::identity());
        set(0, 6, skew(course.velocity));
        set(3, 3, -skew(course.earth * 2.0 + course.transport));
        set(3, 6, -skew(Vector3::new(0.0, 0.0, course.gravity)));
        set(3, 9, skew(course.velocity) * c);
        set(3, 12, c);
        set(6, 6, -skew(course.earth + course.transport));
        set(6, 9, -c);
        f
    }

    /// Exponential by its series; elements of `m` are at most ten.
    fn exponential(m: &Full) -> Full {
        let (mut sum, mut term) = (Full::identity(), Full::identity());
        for k in 1..60 {
            term = term * m / f64::from(k);
            sum += term;
        }
        sum
    }

    #[test]
    fn a_step_is_the_matrix_exponential() {
        let course = |seconds| Course {
            seconds,
            attitude: super::super::motion::rotation(&Vector3::new(0.3, -0.2, 2.0)),
            velocity: Vector3::new(12.0, -7.0, 0.5),
            earth: Vector3::new(5e-5, 0.0, -5e-5),
            transport: Vector3::new(-1e-6, -2e-6, 1e-6),
            gravity: 9.8,
        };
        for (seconds, bound) in [(0.01, 1e-9), (0.1, 1e-6), (0.5, 1e-4)] {
            let course = course(seconds);
            let exact = exponential(&(drive(&course) * seconds));
            let transition = Transition::over(&course);
            for k in 0..STATES {
                let mut unit = [0.0; STATES];
                unit[k] = 1.0;
                let found = SVector::from(transition.apply(&unit));
                let error = (found - exact.column(k)).amax();
                assert!(error < bound, "{seconds} s, column {k}: {error}");
                let row = SVector::from(transition.apply_transposed(&unit));
                let error = (row - exact.row(k).transpose()).amax();
                assert!(error < bound, "{seconds} s, row {k}: {error}");
            }
        }
    }
}
