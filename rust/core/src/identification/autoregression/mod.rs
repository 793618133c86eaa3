//! Autoregressive models of every order in one pass over the record.

mod kernel;
mod least_squares;
mod normal_equations;
mod reflections;

use nalgebra::DMatrix;

use crate::math::segments::segments;
use crate::work;
use normal_equations::Centre;

pub(super) use reflections::{Reflections, step_up};

/// Share of a variance that may be the rounding of its sum.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Number of matrices that a fit has at a time.
const MATRICES: usize = 8;

/// Estimator of an autoregression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// Least squares over all samples with enough earlier samples (the covariance method).
    LeastSquares,
    /// Burg's method.
    Burg,
    /// Yule-Walker, with biased autocovariances.
    YuleWalker,
}

impl Estimator {
    /// Every estimator with its name.
    pub const NAMES: [(Self, &'static str); 3] = [
        (Self::LeastSquares, "least-squares"),
        (Self::Burg, "burg"),
        (Self::YuleWalker, "yule-walker"),
    ];

    /// Estimator with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, known)| *known == name).map(|(estimator, _)| *estimator)
    }

    /// Fits the model of one order, with or without a constant.
    ///
    /// # Errors
    ///
    /// [`FitError`] if the record does not determine the model.
    pub fn fit(self, record: &[f64], order: usize, constant: bool) -> Result<Fit, FitError> {
        check_size(record, order)?;
        if self == Self::LeastSquares {
            return least_squares::fit(record, order, constant);
        }
        let centre = mean(record, constant);
        let (models, n) = self.models(record, order, constant, centre)?;
        Ok(models.fit(n, constant).with_level(centre.level()))
    }

    /// Residual variances of orders 0..=order, and the number of residuals that they share.
    ///
    /// # Errors
    ///
    /// [`FitError`] if the record does not determine the highest order.
    pub fn variances(
        self,
        record: &[f64],
        order: usize,
        constant: bool,
    ) -> Result<(Vec<f64>, usize), FitError> {
        check_size(record, order)?;
        if self == Self::LeastSquares {
            return least_squares::variances(record, order, constant);
        }
        let (models, n) = self.models(record, order, constant, mean(record, constant))?;
        Ok((models.variances(), n))
    }

    fn models(
        self,
        record: &[f64],
        order: usize,
        constant: bool,
        centre: Centre,
    ) -> Result<(Reflections, usize), FitError> {
        let models = match self {
            Self::Burg => reflections::burg,
            _ => reflections::yule_walker,
        };
        let (models, n) = models(record, order, constant, centre)?;
        match models.last_variance() > ROUNDING * models.first_variance() {
            true => Ok((models, n)),
            false => Err(FitError::Noiseless { order }),
        }
    }
}

/// Refuses an order before memory of its size is allocated.
fn check_size(record: &[f64], order: usize) -> Result<(), FitError> {
    if order >= record.len() {
        return Err(why_unfit(record, order, 0, 1));
    }
    // Matrices of the normal equations, their triangle and its inverse.
    work::need::<f64>((order + 2).saturating_mul(order + 2).saturating_mul(MATRICES));
    Ok(())
}

fn mean(record: &[f64], constant: bool) -> Centre {
    if constant { Centre::mean(record) } else { Centre::default() }
}

/// The model z_k = sum_i phi_i z_(k-i) + a_k + constant of a record.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Coefficients.
    pub phi: Vec<f64>,
    /// Constant, 0 if it was not fitted.
    pub constant: f64,
    /// Variance of a_k.
    pub sigma2: f64,
    /// Covariance of the estimates of phi and, last, the constant; zero for a constant that was not
    /// fitted.
    pub covariance: DMatrix<f64>,
    /// Number of residuals.
    pub n: usize,
    /// Condition number of the normal equations without the mean, scaled to a unit diagonal.
    pub condition: f64,
}

/// Fit of a record relative to a level.
pub(super) struct NearFit {
    phi: Vec<f64>,
    constant: f64,
    sigma2: f64,
    /// Root of the covariance of phi and, last, the constant: covariance = sigma2 root rootᵀ.
    root: DMatrix<f64>,
    n: usize,
    condition: f64,
}

impl NearFit {
    /// Fit of the record itself.
    fn with_level(self, level: f64) -> Fit {
        let Self { phi, sigma2, mut root, n, condition, .. } = self;
        let constant = self.constant + level * (1.0 - phi.iter().sum::<f64>());
        // The root keeps the digits that a difference of variances would lose.
        let with_phi = root.rows(0, phi.len()).row_sum() * level;
        root.row_mut(phi.len()).zip_apply(&with_phi, |own, share| *own -= share);
        let covariance = &root * root.transpose() * sigma2;
        Fit { phi, constant, sigma2, covariance, n, condition }
    }
}

/// Reason why a model of this order cannot be fitted to a record.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Every sample is missing.
    #[error("z holds no finite sample")]
    Empty,
    /// All samples are equal.
    #[error("an autoregression needs samples that differ, all {count} are {value}")]
    Equal {
        /// Number of samples.
        count: usize,
        /// Value of the samples.
        value: f64,
    },
    /// No segment between missing samples is longer than the order.
    #[error(
        "an autoregression of order {order} needs more than {order} samples in a row, \
         z has at most {longest}"
    )]
    Segments {
        /// The order.
        order: usize,
        /// Length of the longest segment.
        longest: usize,
    },
    /// There are no more residuals than parameters.
    #[error("an autoregression of order {order} needs at least {least} residuals, z gives {n}")]
    Residuals {
        /// The order.
        order: usize,
        /// Number of samples needed.
        least: usize,
        /// Number of samples.
        n: usize,
    },
    /// A sample is determined by earlier samples, to rounding.
    #[error("z follows an autoregression of order {order} without any noise to estimate")]
    Noiseless {
        /// The order.
        order: usize,
    },
    /// Samples at some lags are determined by samples at other lags.
    #[error("the samples of z at lags 1 to {order} are linearly dependent, take a lower order")]
    Dependent {
        /// Longest lag.
        order: usize,
    },
    /// Squares overflow or underflow.
    #[error("the samples of z are too large or too small to be squared, give them in another unit")]
    Unit,
}

/// Sum of squares below which the residual sum may have lost digits to underflow.
const MIN_ENERGY: f64 = 1e-260;

/// True if a model can be fitted to a record of `n` residuals and a sum of squares `energy`.
fn check(
    record: &[f64],
    order: usize,
    n: usize,
    constant: bool,
    energy: f64,
) -> Result<(), FitError> {
    let least = order + usize::from(constant) + 1;
    if n >= least && energy.is_finite() && energy > MIN_ENERGY {
        return Ok(());
    }
    Err(why_unfit(record, order, n, least))
}

fn why_unfit(record: &[f64], order: usize, n: usize, least: usize) -> FitError {
    let mut present = record.iter().filter(|z| z.is_finite());
    let Some(first) = present.next() else { return FitError::Empty };
    let longest = segments(record).map(<[f64]>::len).max().unwrap_or(0);
    if longest <= order {
        return FitError::Segments { order, longest };
    }
    if n < least {
        return FitError::Residuals { order, least, n };
    }
    match present.all(|z| z == first) {
        true => FitError::Equal {
            count: record.iter().filter(|z| z.is_finite()).count(),
            value: *first,
        },
        false => FitError::Unit,
    }
}
