//! Offline identification for Python.

pub mod arma;
pub mod autoregression;
pub mod outliers;
pub mod products;
pub mod residuals;
pub mod reversals;
