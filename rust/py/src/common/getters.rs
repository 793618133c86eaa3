//! Getters of an object, one line each.

use pyo3::prelude::*;

/// Any value that converts to Python.
pub type Object<'py> = Bound<'py, PyAny>;

/// Properties of a class: name, type and value. The value may use the object, the interpreter, and
/// the object borrowed for reading.
macro_rules! getters {
    (
        $class:ident, $slf:ident, $py:ident, $this:ident;
        $($(#[$doc:meta])* $name:ident: $type:ty = $value:expr;)*
    ) => {
        #[pyo3::pymethods]
        impl $class {
            $(
                $(#[$doc])*
                #[getter]
                #[allow(non_snake_case)]
                fn $name<'py>($slf: &pyo3::Bound<'py, Self>) -> pyo3::PyResult<$type> {
                    let ($py, $this) = ($slf.py(), $crate::common::streaming::reading($slf)?);
                    let _ = ($py, &$this);
                    Ok($value)
                }
            )*
        }
    };
}
pub(crate) use getters;
