//! Autoregressive models of every order in one pass over the record.

mod burg;
mod centre;
mod factor;
mod fit;
mod kernel;
mod least_squares;
mod products;
mod reflections;
mod refusal;
mod rows;
mod yule_walker;

use centre::Centre;

pub use fit::Fit;
pub use refusal::Refusal;

/// A part of the variance that is no more than the rounding of its sum.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// How an autoregression is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// Least squares over all samples with enough others before them (the covariance method).
    LeastSquares,
    /// Burg's method.
    Burg,
    /// Yule-Walker, with biased autocovariances.
    YuleWalker,
}

impl Estimator {
    /// Every estimator by its name.
    pub const NAMES: [(Self, &'static str); 3] = [
        (Self::LeastSquares, "least-squares"),
        (Self::Burg, "burg"),
        (Self::YuleWalker, "yule-walker"),
    ];

    /// The estimator of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, known)| *known == name).map(|(estimator, _)| *estimator)
    }

    /// The model of one order, with a constant or without.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the record does not determine it.
    pub fn fit(self, record: &[f64], order: usize, constant: bool) -> Result<Fit, Refusal> {
        if self == Self::LeastSquares {
            return least_squares::fit(record, order, constant);
        }
        let centre = mean(record, constant);
        let (models, n) = self.models(record, order, constant, centre)?;
        Ok(models.fit(n, constant).with_level(centre.level()))
    }

    /// Variances of the residuals of orders 0..=order, and the number of residuals they share.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the record does not determine the highest order.
    pub fn variances(
        self,
        record: &[f64],
        order: usize,
        constant: bool,
    ) -> Result<(Vec<f64>, usize), Refusal> {
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
    ) -> Result<(reflections::Reflections, usize), Refusal> {
        let models = match self {
            Self::Burg => burg::models,
            _ => yule_walker::models,
        };
        let (models, n) = models(record, order, constant, centre)?;
        match models.last_variance() > ROUNDING * models.first_variance() {
            true => Ok((models, n)),
            false => Err(Refusal::Noiseless { order }),
        }
    }
}

fn mean(record: &[f64], constant: bool) -> Centre {
    if constant { Centre::mean(record) } else { Centre::default() }
}
