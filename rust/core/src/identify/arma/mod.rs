//! ARMA(p, q) models by conditional least squares and by the exact Gaussian likelihood.
//!
//! `z_k = φ_1 z_{k-1} + … + φ_p z_{k-p} + a_k + θ_1 a_{k-1} + … + θ_q a_{k-q} + c`. Searches move
//! in the inverse hyperbolic tangents of partial autocorrelations, where every point is an
//! invertible (and, for the likelihood, a stationary) model.

mod columns;
mod conditional;
mod descent;
mod estimate;
mod exact;
mod gaussian;
mod hessian;
mod kalman;
mod lattice;
mod maximum;
mod model;
mod normal;
mod partial;
mod products;
mod recursion;
mod regression;
mod series;
mod starts;
mod sweep;

pub use estimate::{Estimate, Method, fit};
pub use gaussian::{Likelihood, likelihood};
pub use lattice::{Cell, grid};
pub use series::Series;

/// The highest order that a polynomial may have.
pub const MAX_ORDER: usize = 8;
