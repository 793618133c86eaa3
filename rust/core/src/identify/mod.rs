//! Offline identification: from a whole record at rest to a drift model.
//!
//! A record is a slice in which a value that is not finite is missing; what lies between two
//! missing values is a *stretch*. Conditional estimators start anew at every stretch.

pub mod arma;
mod stretches;

pub use stretches::stretches;
