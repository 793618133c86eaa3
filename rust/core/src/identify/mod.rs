//! Offline identification: from a whole record at rest to a drift model.
//!
//! A record is a slice in which a value that is not finite is missing; what lies between two
//! missing values is a *stretch*. Conditional estimators start anew at every stretch.

pub mod arma;
mod autoregression;
mod hampel;
mod products;
mod residuals;
mod reversals;
mod stretches;

pub use autoregression::{Estimator, Fit, Refusal};
pub use hampel::Hampel;
pub use products::{LaggedProducts, lagged_products};
pub use residuals::Arma;
pub use reversals::{Reversals, reversals};
pub use stretches::stretches;
