//! Offline identification for Python.

pub mod arma;
