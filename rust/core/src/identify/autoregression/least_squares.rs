//! Least squares: each sample from those before it, over all that have enough before them.

use nalgebra::DMatrix;

use super::centre::Centre;
use super::factor::Factor;
use super::fit::Fit;
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
    let sigma2 = factor.residual_sums()[order] / n as f64;
    let (coefficients, inverse) = (factor.coefficients(), factor.inverse());
    let first = usize::from(constant);
    let fit = Fit {
        phi: coefficients.as_slice()[first..].to_vec(),
        constant: if constant { coefficients[0] } else { 0.0 },
        sigma2,
        covariance: constant_last(&(inverse * sigma2), order),
        n,
        condition: factor.condition(),
    };
    Ok(fit.about(centre.level()))
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

/// A covariance whose first row is the constant's, if it has one, with that row last.
fn constant_last(covariance: &DMatrix<f64>, order: usize) -> DMatrix<f64> {
    let size = covariance.ncols();
    let from = |i: usize| if i < order { i + size - order } else { 0 };
    DMatrix::from_fn(order + 1, order + 1, |i, j| match i.max(j) == order && size == order {
        true => 0.0,
        false => covariance[(from(i), from(j))],
    })
}
