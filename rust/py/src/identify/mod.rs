//! Offline identification for Python.

pub mod autoregression;
