//! Getters of an object, a line each.

use pyo3::prelude::*;

/// Whatever Python takes.
pub type Object<'py> = Bound<'py, PyAny>;

/// Properties of a class: name, type and value. In it stand the object, the interpreter, and the object
/// as it is read.
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
