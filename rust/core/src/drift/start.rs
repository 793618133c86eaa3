//! Start of a filter with a known model of the signal.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::math::{Limits, Real};
use crate::stream::{Field, Input, Number, Output, Shape};

/// Largest normalised sample expected in a record, in standard deviations: the maximum of a million
/// Gaussian samples.
pub(crate) const MAX_NORMALISED_SAMPLE: f64 = 5.0;

/// Largest share of a variance that is lost by rounding and by a text with ten digits.
const PIVOT_ROUNDING: f64 = 1e-9;

/// Model of a signal and its uncertainty, in the samples' unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct Start<T, const N: usize, const M: usize> {
    /// Mean of the signal.
    pub offset: T,
    /// Standard deviation of the signal.
    pub scale: T,
    /// `[φ, θ, c]`.
    pub coefficients: SVector<T, M>,
    /// Covariance of `[φ, θ, c/scale]` over the noise variance, for centred and scaled samples. It
    /// is limited to the initial covariance of [`Rls::new`](super::Rls::new).
    pub covariance: SMatrix<T, M, M>,
    /// Variance R of the measurement noise.
    pub measurement_noise: T,
    /// Variance of the process noise of the newest `y`, the element `G₀₀`.
    pub process_noise: T,
    /// Covariance of the state `[y_k, …, c]` before the first sample.
    pub state_covariance: SMatrix<T, N, N>,
}

impl<T, const N: usize, const M: usize> Start<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// The start, if each number is in its range. Offset and scale are limited to the range of the
    /// number type.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first number out of range.
    pub fn validate(self) -> Result<Self, Error> {
        require(self.offset.finite(), "offset", "finite", self.offset)?;
        let scale = self.scale;
        require(scale.finite() && scale > T::zero(), "scale", "a positive number", scale)?;
        for c in &self.coefficients {
            require(c.finite(), "coefficients", "finite", *c)?;
        }
        check_variance("measurement_noise", self.measurement_noise)?;
        check_variance("process_noise", self.process_noise)?;
        Factors::of("covariance", &self.covariance)?;
        Factors::of("state_covariance", &self.state_covariance)?;
        let offset = self.offset.within(T::MAX_RAW);
        let scale = scale.at_most(T::MAX_RAW).at_least(T::one() / T::MAX_RAW);
        Ok(Self { offset, scale, ..self })
    }

    /// `[φ, θ, c]` of the centred and scaled signal.
    pub(crate) fn normalised_coefficients(&self) -> SVector<T, M> {
        let rest = self.coefficients.iter().take(N - 1).fold(T::one(), |rest, phi| rest - *phi);
        let mut normalised = self.coefficients;
        normalised[M - 1] = (self.coefficients[M - 1] - rest * self.offset) / self.scale;
        normalised.map(|c| c.within(T::MAX_LEARNED))
    }

    /// A variance of the signal, converted to the centred and scaled signal.
    pub(crate) fn normalised_variance(&self, variance: T) -> T {
        let ratio = T::one() / self.scale;
        (variance * ratio * ratio).at_most(T::MAX_COVARIANCE)
    }

    /// Covariance of the state in variances of the signal, semidefinite to rounding.
    pub(crate) fn normalised_state_covariance(&self) -> Result<SMatrix<T, N, N>, Error> {
        let bound = T::MAX_COVARIANCE;
        let ratio = T::one() / self.scale;
        let normalised = self.state_covariance.map(|p| (p * ratio * ratio).within(bound));
        Ok(Factors::of("state_covariance", &normalised)?.product())
    }
}

// The matrices are symmetric: columns equal rows.
impl<T: Number, const N: usize, const M: usize> Input for Start<T, N, M> {
    const NUMBERS: usize = 4 + M + M * M + N * N;

    fn read(numbers: &[f64]) -> Self {
        let mut numbers = numbers.iter().map(|number| T::of(*number));
        let mut next = || numbers.next().unwrap_or(T::of(f64::NAN));
        Self {
            offset: next(),
            scale: next(),
            coefficients: SVector::from_fn(|_, _| next()),
            covariance: SMatrix::from_fn(|_, _| next()),
            measurement_noise: next(),
            process_noise: next(),
            state_covariance: SMatrix::from_fn(|_, _| next()),
        }
    }
}

impl<T: Number, const N: usize, const M: usize> Output for Start<T, N, M> {
    const FIELDS: &'static [Field] = &[
        Field { name: "offset", shape: Shape::Number },
        Field { name: "scale", shape: Shape::Number },
        Field { name: "coefficients", shape: Shape::Vector(M) },
        Field { name: "covariance", shape: Shape::Matrix(M) },
        Field { name: "measurement_noise", shape: Shape::Number },
        Field { name: "process_noise", shape: Shape::Number },
        Field { name: "state_covariance", shape: Shape::Matrix(N) },
    ];

    fn write(self, numbers: &mut [f64], _: &mut [bool]) {
        let values = [self.offset, self.scale]
            .into_iter()
            .chain(self.coefficients.iter().copied())
            .chain(self.covariance.iter().copied())
            .chain([self.measurement_noise, self.process_noise])
            .chain(self.state_covariance.iter().copied());
        for (slot, value) in numbers.iter_mut().zip(values) {
            *slot = value.into();
        }
    }
}

/// Factors `U D Uᵀ` with a unit upper triangle.
#[derive(Debug)]
pub(crate) struct Factors<T, const K: usize> {
    pub unit_upper: SMatrix<T, K, K>,
    pub diagonal: SVector<T, K>,
}

impl<T, const K: usize> Factors<T, K>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// The factors of a symmetric positive semidefinite matrix (Bierman 1977, III.4).
    ///
    /// # Errors
    /// [`Error::Parameter`] with this name for any other matrix.
    pub fn of(name: &'static str, matrix: &SMatrix<T, K, K>) -> Result<Self, Error> {
        let mut rest = *matrix;
        let mut factors = Self { unit_upper: SMatrix::identity(), diagonal: SVector::zeros() };
        // Amount by which rounding may make each pivot negative.
        let mut lost = matrix.diagonal() * T::of(PIVOT_ROUNDING).at_least(T::ROUNDING);
        for j in (0..K).rev() {
            check_column(name, matrix, j)?;
            let variance = matrix[(j, j)];
            let pivot = rest[(j, j)];
            require(pivot >= -lost[j], name, "symmetric positive semidefinite", pivot)?;
            // A direction without variance, except for rounding, is exactly known.
            if pivot > T::ROUNDING * T::of(K as f64) * variance {
                factors.eliminate(name, &mut rest, j)?;
                // The rounding error of a small pivot affects the other pivots strongly.
                let own = lost[j];
                for i in 0..j {
                    let u = factors.unit_upper[(i, j)];
                    lost[i] += u * u * own;
                }
            }
        }
        Ok(factors)
    }

    /// Removes column `j` from the remaining matrix.
    fn eliminate(
        &mut self,
        name: &'static str,
        rest: &mut SMatrix<T, K, K>,
        j: usize,
    ) -> Result<(), Error> {
        let column = rest.column(j).into_owned();
        self.diagonal[j] = column[j];
        for i in 0..j {
            let u = column[i] / column[j];
            require(u.simd_abs() <= T::MAX_INPUT, name, "of comparable variances", u)?;
            self.unit_upper[(i, j)] = u;
            for h in 0..=i {
                rest[(h, i)] -= self.unit_upper[(h, j)] * column[i];
            }
        }
        Ok(())
    }

    /// The matrix with these factors.
    pub fn product(&self) -> SMatrix<T, K, K> {
        SMatrix::from_fn(|i, j| {
            let columns = self.unit_upper.column_iter().zip(self.diagonal.iter());
            columns.fold(T::zero(), |sum, (u, d)| sum + u[i] * *d * u[j])
        })
    }
}

/// Checks that column `j` down to the diagonal is finite and equals its row.
fn check_column<T, const K: usize>(
    name: &'static str,
    matrix: &SMatrix<T, K, K>,
    j: usize,
) -> Result<(), Error>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    for i in 0..=j {
        let element = matrix[(i, j)];
        require(element.finite(), name, "finite", element)?;
        require(element == matrix[(j, i)], name, "symmetric positive semidefinite", element)?;
    }
    Ok(())
}

fn check_variance<T>(name: &'static str, value: T) -> Result<(), Error>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    require(value.finite() && value >= T::zero(), name, "zero or a positive number", value)
}

fn require<T: Limits>(
    holds: bool,
    name: &'static str,
    expected: &'static str,
    value: T,
) -> Result<(), Error> {
    let value = value.to_subset().unwrap_or(f64::NAN);
    if holds { Ok(()) } else { Err(Error::Parameter { name, expected, value }) }
}
