//! Yule-Walker: the autoregressions whose first autocovariances are those of the record.

use super::centre::Centre;
use super::products::LagProducts;
use super::reflections::Reflections;
use super::refusal::{Refusal, check};

/// Models of all orders up to `order`, and the number of samples.
///
/// Autocovariances are sums over all pairs in a stretch by the number of samples: they belong to a
/// stationary process.
pub fn models(
    record: &[f64],
    order: usize,
    constant: bool,
    centre: Centre,
) -> Result<(Reflections, usize), Refusal> {
    let products = LagProducts::of(record, order, centre);
    let n = products.present();
    check(record, order, products.n().min(1) * n, constant, products.energy())?;
    let covariances: Vec<f64> = products.over_all_pairs().iter().map(|s| s / n as f64).collect();
    Ok((levinson(&covariances), n))
}

/// Levinson's and Durbin's recursion.
fn levinson(covariances: &[f64]) -> Reflections {
    let mut models = Reflections::new(covariances[0]);
    for order in 1..covariances.len() {
        let forecast = models.last().iter().zip(covariances[1..order].iter().rev());
        let explained: f64 = forecast.map(|(phi, covariance)| phi * covariance).sum();
        models.extend((covariances[order] - explained) / models.last_variance());
    }
    models
}
