//! A bound of a foot's speed: the speed of a foot that stands on a pivot near the sensor.

use nalgebra::Vector3;

use super::beginning::AtRest;
use super::{FORCE_S, HALF_WINDOW_S, PIVOT_DISTANCE_M, samples_in};
use crate::error::Error;
use crate::memory;

/// The bound at each sample, m/s.
pub(super) fn bound(
    gyro: &[[f64; 3]],
    accel: &[[f64; 3]],
    dt: f64,
    known: &AtRest,
) -> Result<Vec<f64>, Error> {
    let (n, half) = (gyro.len(), samples_in(HALF_WINDOW_S, dt));
    let window = |k: usize| k.saturating_sub(half)..(k + half + 1).min(n);
    let mut pushed = memory::room(n)?;
    for k in 0..n {
        let sum = window(k).map(|i| Vector3::from(accel[i])).sum::<Vector3<f64>>();
        let size = sum.norm();
        let still = if size > 0.0 { sum * (known.force / size) } else { sum };
        pushed.push((Vector3::from(accel[k]) - still).norm_squared());
    }
    let turned = |i: usize| (Vector3::from(gyro[i]) - known.gyro_bias).norm_squared();
    let mut found = memory::room(n)?;
    for k in 0..n {
        let rotations: f64 = window(k).map(turned).sum();
        let pushes: f64 = window(k).map(|i| pushed[i]).sum();
        let square = PIVOT_DISTANCE_M * PIVOT_DISTANCE_M * rotations + FORCE_S * FORCE_S * pushes;
        found.push((square / window(k).len() as f64).sqrt());
    }
    Ok(found)
}
