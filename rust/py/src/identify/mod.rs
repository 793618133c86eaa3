//! Offline identification for Python.

pub mod residuals;
