//! Arguments of a drift filter, between Python and the core.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use zerorate_core::{AutoParams, Conduct, Method, Params};

use super::any::{Order, order_error};
use crate::allan;

/// Everything that makes a filter: of a published method, or the one that tunes itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Settings {
    Published { order: (usize, usize), params: Params, conduct: Conduct },
    Auto(AutoParams),
}

/// Arguments as Python gives them.
#[derive(Debug)]
pub struct Arguments<'a> {
    pub order: Order,
    pub method: &'a str,
    pub motion: Option<&'a str>,
    pub output: &'a str,
    pub params: Params,
}

impl Settings {
    /// The settings that the arguments ask for.
    pub fn read(given: Arguments<'_>) -> PyResult<Self> {
        let method = method(given.method)?;
        let order = checked(given.order)?;
        let conduct = Conduct {
            hold: hold(given.motion)?.unwrap_or(method.is_none()),
            compensated: compensated(given.output)?,
        };
        let Params { rate, startup, scale, .. } = given.params;
        let Some(method) = method else {
            return Ok(Self::Auto(AutoParams { rate, startup, scale, conduct }));
        };
        let params = Params { method, ..given.params };
        Ok(Self::Published { order, params, conduct })
    }

    pub fn rate(&self) -> f64 {
        match self {
            Self::Published { params, .. } => params.rate,
            Self::Auto(params) => params.rate,
        }
    }

    /// Orders of the ARMA model; the random walk of the filter that tunes itself has none.
    pub fn order(&self) -> Option<(usize, usize)> {
        match self {
            Self::Published { order, .. } => Some(*order),
            Self::Auto(_) => None,
        }
    }

    /// Size of the state and of the coefficients.
    pub fn sizes(&self) -> (usize, usize) {
        self.order().map_or((1, 1), |(p, q)| (p + 1, p + q + 1))
    }

    pub fn method(&self) -> &'static str {
        match self {
            Self::Auto(_) => "auto",
            Self::Published { params, .. } => match params.method {
                Method::Kf => "kf",
                Method::Akf => "akf",
                Method::Fading => "fading",
            },
        }
    }

    pub fn conduct(&self) -> Conduct {
        match self {
            Self::Published { conduct, .. } => *conduct,
            Self::Auto(params) => params.conduct,
        }
    }

    /// Every argument that makes such a filter anew, in the order of the signature.
    pub fn write<'py>(
        &self,
        py: Python<'py>,
        channels: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let arguments = PyDict::new(py);
        arguments.set_item("rate", self.rate())?;
        if let Self::Published { order, params, .. } = self {
            arguments.set_item("order", *order)?;
            arguments.set_item("method", self.method())?;
            write_model(&arguments, params)?;
        } else {
            arguments.set_item("method", self.method())?;
        }
        arguments.set_item("channels", channels)?;
        write_conduct(&arguments, self.conduct())?;
        let (startup, scale) = match self {
            Self::Auto(params) => (params.startup, params.scale),
            Self::Published { params, .. } => {
                write_noise(&arguments, params)?;
                (params.startup, params.scale)
            }
        };
        arguments.set_item("startup", startup)?;
        arguments.set_item("scale", scale)?;
        Ok(arguments)
    }
}

fn write_model(arguments: &Bound<'_, PyDict>, params: &Params) -> PyResult<()> {
    arguments.set_item("fading", params.fading)?;
    arguments.set_item("adapt_for", params.adapt_for)?;
    arguments.set_item("forgetting_factor", params.forgetting_factor)
}

fn write_conduct(arguments: &Bound<'_, PyDict>, conduct: Conduct) -> PyResult<()> {
    arguments.set_item("motion", if conduct.hold { "hold" } else { "ignore" })?;
    arguments.set_item("output", if conduct.compensated { "compensated" } else { "estimate" })
}

fn write_noise(arguments: &Bound<'_, PyDict>, params: &Params) -> PyResult<()> {
    arguments.set_item("process_noise", params.process_noise)?;
    arguments.set_item("process_noise_memory", params.process_noise_memory)?;
    arguments.set_item("noise", allan::name(params.noise))
}

/// A published method, or None for the one that tunes itself.
fn method(name: &str) -> PyResult<Option<Method>> {
    match name {
        "auto" => Ok(None),
        "kf" => Ok(Some(Method::Kf)),
        "akf" => Ok(Some(Method::Akf)),
        "fading" => Ok(Some(Method::Fading)),
        _ => Err(PyValueError::new_err(format!(
            "method must be 'kf', 'akf', 'fading' or 'auto', got '{name}'"
        ))),
    }
}

fn checked(Order((p, q)): Order) -> PyResult<(usize, usize)> {
    match (p, q) {
        (1..=3, 0..=3) => Ok((p as usize, q as usize)),
        _ => Err(order_error((p, q))),
    }
}

fn hold(motion: Option<&str>) -> PyResult<Option<bool>> {
    match motion {
        None => Ok(None),
        Some("hold") => Ok(Some(true)),
        Some("ignore") => Ok(Some(false)),
        Some(other) => {
            Err(PyValueError::new_err(format!("motion must be 'hold' or 'ignore', got '{other}'")))
        }
    }
}

fn compensated(output: &str) -> PyResult<bool> {
    match output {
        "estimate" => Ok(false),
        "compensated" => Ok(true),
        other => Err(PyValueError::new_err(format!(
            "output must be 'estimate' or 'compensated', got '{other}'"
        ))),
    }
}
