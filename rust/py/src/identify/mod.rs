//! Offline identification for Python.
