//! Offline identification for Python.

pub mod outliers;
pub mod products;
pub mod reversals;
