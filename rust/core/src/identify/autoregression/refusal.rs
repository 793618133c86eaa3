//! Why a record cannot be fitted.

use crate::identify::stretches;

/// What is wrong with a record, or with the order asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// Every sample is missing.
    #[error("z holds no finite sample")]
    Empty,
    /// All samples are the same.
    #[error("an autoregression needs samples that differ, all {count} are {value}")]
    Equal {
        /// How many there are.
        count: usize,
        /// Their value.
        value: f64,
    },
    /// No stretch between missing samples is longer than the order.
    #[error(
        "an autoregression of order {order} needs more than {order} samples in a row, \
         z has at most {longest}"
    )]
    Stretches {
        /// The order.
        order: usize,
        /// Length of the longest stretch.
        longest: usize,
    },
    /// There are not more residuals than parameters.
    #[error("an autoregression of order {order} needs at least {least} residuals, z gives {n}")]
    Residuals {
        /// The order.
        order: usize,
        /// How many it needs.
        least: usize,
        /// How many there are.
        n: usize,
    },
    /// A sample follows from those before it, up to rounding.
    #[error("z follows an autoregression of order {order} without any noise to estimate")]
    Noiseless {
        /// The order.
        order: usize,
    },
    /// Samples of some lags follow from those of the others.
    #[error("the samples of z at lags 1 to {order} are linearly dependent, take a lower order")]
    Dependent {
        /// The longest lag.
        order: usize,
    },
    /// Squares overflow or vanish.
    #[error("the samples of z are too large or too small to be squared, give them in another unit")]
    Unit,
}

/// Below this, what is left of a sum of squares may have lost digits to underflow.
const LEAST_ENERGY: f64 = 1e-260;

/// Refuses a record of `n` residuals and a sum of squares `energy` that no model can be fitted to.
pub fn check(
    record: &[f64],
    order: usize,
    n: usize,
    constant: bool,
    energy: f64,
) -> Result<(), Refusal> {
    let least = order + usize::from(constant) + 1;
    if n >= least && energy.is_finite() && energy > LEAST_ENERGY {
        return Ok(());
    }
    Err(reason(record, order, n, least))
}

fn reason(record: &[f64], order: usize, n: usize, least: usize) -> Refusal {
    let mut present = record.iter().filter(|z| z.is_finite());
    let Some(first) = present.next() else { return Refusal::Empty };
    let longest = stretches(record).map(<[f64]>::len).max().unwrap_or(0);
    if longest <= order {
        return Refusal::Stretches { order, longest };
    }
    if n < least {
        return Refusal::Residuals { order, least, n };
    }
    match present.all(|z| z == first) {
        true => {
            Refusal::Equal { count: record.iter().filter(|z| z.is_finite()).count(), value: *first }
        }
        false => Refusal::Unit,
    }
}
