//! Least squares: each sample from those before it, over all that have enough before them.

use nalgebra::DMatrix;

use super::centre::Centre;
use super::factor::Factor;
use super::fit::{Fit, NearFit};
use super::products::LagProducts;
use super::refusal::{Refusal, check};
use super::rows::triangle;

/// Variances of the residuals of orders 0..=order over the same n samples, and n.
pub fn variances(
    record: &[f64],
    order: usize,
    constant: bool,
) -> Result<(Vec<f64>, usize), Refusal> {
    let centre = if constant { Centre::provisional(record) } else { Centre::default() };
    let (factor, n) = factor(record, order, constant, centre)?;
    Ok((factor.residual_sums().into_iter().map(|sum| sum / n as f64).collect(), n))
}

/// The model of one order.
pub fn fit(record: &[f64], order: usize, constant: bool) -> Result<Fit, Refusal> {
    let centre = if constant { Centre::provisional(record) } else { Centre::default() };
    let (factor, n) = factor(record, order, constant, centre)?;
    let (first, coefficients) = (usize::from(constant), factor.coefficients());
    let fit = NearFit {
        phi: coefficients.as_slice()[first..].to_vec(),
        constant: if constant { coefficients[0] } else { 0.0 },
        sigma2: factor.residual_sums()[order] / n as f64,
        root: constant_last(factor.inverse_root(), constant),
        n,
        condition: factor.condition(),
    };
    Ok(fit.with_level(centre.level()))
}

fn factor(
    record: &[f64],
    order: usize,
    constant: bool,
    centre: Centre,
) -> Result<(Factor, usize), Refusal> {
    let products = LagProducts::of(record, order, centre);
    check(record, order, products.n(), constant, products.energy())?;
    let factor = Factor::of_gram(products.gram(constant), constant)
        .unwrap_or_else(|| Factor::of_upper(triangle(record, order, centre, constant), constant));
    match (factor.is_noiseless(), factor.dependent_lag()) {
        (true, _) => Err(Refusal::Noiseless { order }),
        (_, Some(order)) => Err(Refusal::Dependent { order }),
        _ => Ok((factor, products.n())),
    }
}

/// Rows of which the first is the constant's, if it has one, with that or zeros last.
fn constant_last(rows: DMatrix<f64>, constant: bool) -> DMatrix<f64> {
    let (size, columns) = rows.shape();
    if !constant {
        return rows.insert_row(size, 0.0);
    }
    DMatrix::from_fn(size, columns, |i, j| rows[((i + 1) % size, j)])
}
