//! Offline identification: from a whole record at rest to a drift model.
//!
//! A record is a slice; a value that is not finite is missing. A *segment* is a run of samples
//! between two missing samples. Conditional estimators start again at every segment.

pub mod arma;
mod autoregression;
mod hampel;
mod lagged_products;
mod residuals;
mod reversals;

pub use autoregression::{Estimator, Fit, FitError};
pub use hampel::Hampel;
pub use lagged_products::{LaggedProducts, lagged_products};
pub use residuals::Arma;
pub use reversals::{Reversals, reversals};
