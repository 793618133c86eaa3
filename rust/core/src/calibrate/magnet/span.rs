//! Kalman filter of one span: constant hard iron, and field with a random walk.

use serde::{Deserialize, Serialize};

use crate::math::Real;
use crate::math::validity::{is_size, is_within};

/// Cost of another span, in addition to the evidence of its prior.
pub const SPAN_COST: f64 = 24.0;
/// Largest additional cost, relative to the best span, of an open span.
pub const MAX_EXTRA_COST: f64 = 64.0;
/// Cost of an outlier tick: with a standard deviation of 0.35 per axis, 3 (ln 0.35² + 1). And the
/// longest outlier, s.
pub const OUTLIER_COST: f64 = -3.298_932_746_992_067;
pub const MAX_OUTLIER_S: usize = 60;

/// Index of an element of a symmetric matrix in its six numbers.
const SYMMETRIC_INDEX: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// Normalised innovation squared above which a tick has less weight.
const MAX_FULL_NIS: f64 = 9.0;

/// Largest number in a filter; fields have a size of about 1.
const MAX_NUMBER: f64 = 1e6;

/// Count of a span's numbers: hard iron, field, and their covariance.
pub const NUMBERS: usize = 27;

/// Hard iron b and field h, measured by `e = B b + h + v`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Span<T> {
    iron: [T; 3],
    field: [T; 3],
    /// Covariances of the iron, of iron (rows) with field, and of the field.
    irons: [T; 6],
    across: [[T; 3]; 3],
    fields: [T; 6],
}

/// Cost of a tick: determinant of its innovation's covariance, of which the logarithm is used, and
/// the term of the innovation's size.
#[derive(Debug, Clone, Copy)]
pub struct Cost<T> {
    pub determinant: T,
    pub misfit: T,
}

/// A tick for a span: e, B, growth of the field's variance since the previous tick, and variance of
/// an axis.
#[derive(Debug, Clone, Copy)]
pub struct Seen<T> {
    pub turned: [T; 3],
    pub rotation: [[T; 3]; 3],
    pub walked: T,
    pub noise: T,
}

impl<T: Real> Seen<T> {
    /// The same tick in every lane.
    #[inline(always)]
    pub fn of(turned: &[f64; 3], rotation: &[f64; 9], walked: f64, noise: f64) -> Self {
        let mut seen = Self {
            turned: [T::zero(); 3],
            rotation: [[T::zero(); 3]; 3],
            walked: T::of(walked),
            noise: T::of(noise),
        };
        for i in 0..3 {
            seen.turned[i] = T::of(turned[i]);
            for j in 0..3 {
                seen.rotation[i][j] = T::of(rotation[3 * i + j]);
            }
        }
        seen
    }
}

impl Span<f64> {
    /// Initial state: only the approximate field is known.
    pub fn new(field: [f64; 3]) -> Self {
        let one = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0];
        Self { iron: [0.0; 3], field, irons: one, across: [[0.0; 3]; 3], fields: one }
    }

    /// Present estimate of the hard iron.
    pub fn iron(&self) -> [f64; 3] {
        self.iron
    }

    /// True if a running filter can have every number.
    pub fn is_valid(&self) -> bool {
        let row = self.row();
        let variances = SYMMETRIC_INDEX.iter().enumerate().map(|(i, at)| at[i]);
        row.iter().all(|x| is_within(*x, MAX_NUMBER))
            && variances
                .into_iter()
                .all(|i| is_size(self.irons[i], MAX_NUMBER) && is_size(self.fields[i], MAX_NUMBER))
    }
}

impl AsRef<Self> for Span<f64> {
    #[inline(always)]
    fn as_ref(&self) -> &Self {
        self
    }
}

impl AsMut<Self> for Span<f64> {
    #[inline(always)]
    fn as_mut(&mut self) -> &mut Self {
        self
    }
}

impl<T: Real> Span<T> {
    /// Span from its numbers in a row.
    #[cfg(feature = "std")]
    #[inline(always)]
    pub fn of(row: &[T; NUMBERS]) -> Self {
        let z = T::zero();
        let mut span = Self {
            iron: [z; 3],
            field: [z; 3],
            irons: [z; 6],
            across: [[z; 3]; 3],
            fields: [z; 6],
        };
        for i in 0..3 {
            (span.iron[i], span.field[i]) = (row[i], row[3 + i]);
            for j in 0..3 {
                span.across[i][j] = row[12 + 3 * i + j];
            }
        }
        for k in 0..6 {
            (span.irons[k], span.fields[k]) = (row[6 + k], row[21 + k]);
        }
        span
    }

    /// Numbers of the span in a row.
    #[inline(always)]
    pub fn row(&self) -> [T; NUMBERS] {
        let mut row = [T::zero(); NUMBERS];
        for i in 0..3 {
            (row[i], row[3 + i]) = (self.iron[i], self.field[i]);
            for j in 0..3 {
                row[12 + 3 * i + j] = self.across[i][j];
            }
        }
        for k in 0..6 {
            (row[6 + k], row[21 + k]) = (self.irons[k], self.fields[k]);
        }
        row
    }

    /// Processes a tick. An outlier gets a larger noise.
    #[inline(always)]
    pub fn step(&mut self, seen: &Seen<T>) -> Cost<T> {
        let turn = &seen.rotation;
        for k in 0..3 {
            self.fields[SYMMETRIC_INDEX[k][k]] += seen.walked;
        }
        let (of_iron, of_field) = self.gains(turn);
        let mut spread = [T::zero(); 6];
        let mut off = [T::zero(); 3];
        for i in 0..3 {
            off[i] = seen.turned[i] - self.field[i];
            for k in 0..3 {
                off[i] -= turn[i][k] * self.iron[k];
            }
            for j in i..3 {
                let mut sum = of_field[i][j];
                for k in 0..3 {
                    sum += turn[i][k] * of_iron[k][j];
                }
                spread[SYMMETRIC_INDEX[i][j]] = sum;
            }
            spread[SYMMETRIC_INDEX[i][i]] += seen.noise;
        }
        let (adjoint, determinant) = inverse(&spread);
        let size = quadratic(&adjoint, &off) / determinant;
        let nine = T::of(MAX_FULL_NIS);
        let far = (size.at_least(nine) / nine).simd_sqrt();
        let beyond = T::of(2.0 * MAX_FULL_NIS) * far - nine;
        let misfit = beyond.select(size.simd_ge(nine), size);
        let more = seen.noise * (far - T::one());
        for i in 0..3 {
            spread[SYMMETRIC_INDEX[i][i]] += more;
        }
        self.correct(&of_iron, &of_field, &spread, &off);
        Cost { determinant, misfit }
    }

    /// Covariances of iron and field with the measurement.
    #[inline(always)]
    fn gains(&self, turn: &[[T; 3]; 3]) -> ([[T; 3]; 3], [[T; 3]; 3]) {
        let (mut of_iron, mut of_field) = ([[T::zero(); 3]; 3], [[T::zero(); 3]; 3]);
        for i in 0..3 {
            for j in 0..3 {
                let (mut iron, mut field) = (self.across[i][j], self.fields[SYMMETRIC_INDEX[i][j]]);
                for k in 0..3 {
                    iron += self.irons[SYMMETRIC_INDEX[i][k]] * turn[j][k];
                    field += self.across[k][i] * turn[j][k];
                }
                (of_iron[i][j], of_field[i][j]) = (iron, field);
            }
        }
        (of_iron, of_field)
    }

    #[inline(always)]
    fn correct(
        &mut self,
        of_iron: &[[T; 3]; 3],
        of_field: &[[T; 3]; 3],
        spread: &[T; 6],
        off: &[T; 3],
    ) {
        let (adjoint, determinant) = inverse(spread);
        let scale = T::one() / determinant;
        let (mut iron, mut field) = ([[T::zero(); 3]; 3], [[T::zero(); 3]; 3]);
        for i in 0..3 {
            for j in 0..3 {
                let (mut first, mut second) = (T::zero(), T::zero());
                for k in 0..3 {
                    first += of_iron[i][k] * adjoint[SYMMETRIC_INDEX[k][j]];
                    second += of_field[i][k] * adjoint[SYMMETRIC_INDEX[k][j]];
                }
                (iron[i][j], field[i][j]) = (first * scale, second * scale);
            }
        }
        for i in 0..3 {
            for k in 0..3 {
                self.iron[i] += iron[i][k] * off[k];
                self.field[i] += field[i][k] * off[k];
            }
            for j in 0..3 {
                for k in 0..3 {
                    self.across[i][j] -= iron[i][k] * of_field[j][k];
                }
            }
            for j in i..3 {
                for k in 0..3 {
                    self.irons[SYMMETRIC_INDEX[i][j]] -= iron[i][k] * of_iron[j][k];
                    self.fields[SYMMETRIC_INDEX[i][j]] -= field[i][k] * of_field[j][k];
                }
            }
        }
    }
}

/// Adjugate of a symmetric matrix, and its determinant.
#[inline(always)]
fn inverse<T: Real>(m: &[T; 6]) -> ([T; 6], T) {
    let [a, b, c, d, e, f] = *m;
    let adjoint =
        [d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b];
    (adjoint, a * adjoint[0] + b * adjoint[1] + c * adjoint[2])
}

#[inline(always)]
fn quadratic<T: Real>(m: &[T; 6], v: &[T; 3]) -> T {
    let mut sum = T::zero();
    for i in 0..3 {
        let mut row = T::zero();
        for j in 0..3 {
            row += m[SYMMETRIC_INDEX[i][j]] * v[j];
        }
        sum += v[i] * row;
    }
    sum
}
