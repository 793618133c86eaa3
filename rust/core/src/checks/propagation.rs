//! A window's forces, rotated by the rates into a frame that does not turn.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::ticks::TICK;
use super::window::MEANS;
use crate::math::rotation::turned;

/// Triangular means of a window.
#[derive(Debug, Clone, Copy)]
pub(super) struct WindowMeans {
    /// Element `(i, j)` of matrix `c` is the mean of R_ij a_c.
    pub(super) tensors: [[Matrix3<f64>; 3]; MEANS],
    /// Mean of the integral of R from the middle of the window.
    pub(super) integrals: [Matrix3<f64>; MEANS],
}

#[derive(Debug, Clone, Copy)]
struct Sums {
    tensor: [Matrix3<f64>; 3],
    integral: Matrix3<f64>,
}

impl Sums {
    const ZERO: Self = Self {
        tensor: [Matrix3::from_array_storage(ZEROS); 3],
        integral: Matrix3::from_array_storage(ZEROS),
    };

    fn plus(&mut self, other: &Self, factor: f64) {
        for (own, other) in self.tensor.iter_mut().zip(&other.tensor) {
            *own += other * factor;
        }
        self.integral += other.integral * factor;
    }
}

const ZEROS: nalgebra::ArrayStorage<f64, 3, 3> = nalgebra::ArrayStorage([[0.0; 3]; 3]);

/// Propagates the rotation through the ticks with `factor rate - bias`, rad/s.
pub(super) fn propagate(
    rates: &[Vector3<f64>],
    forces: &[Vector3<f64>],
    factor: f64,
    bias: &Vector3<f64>,
) -> WindowMeans {
    let block = rates.len() / (MEANS + 1);
    let mut rotation = UnitQuaternion::identity();
    let (mut integral, mut middle) = (Matrix3::zeros(), Matrix3::zeros());
    let mut means = [Sums::ZERO; MEANS];
    for b in 0..=MEANS {
        let (mut flat, mut rise) = (Sums::ZERO, Sums::ZERO);
        if b == MEANS.div_ceil(2) {
            middle = integral;
        }
        for k in 0..block {
            let phi = (rates[b * block + k] * factor - bias) * (TICK / 2.0);
            rotation = turned(&rotation, &phi);
            let matrix = rotation.to_rotation_matrix().into_inner();
            let force = &forces[b * block + k];
            let now = Sums {
                tensor: [0, 1, 2].map(|c| matrix * force[c]),
                integral: integral + matrix * (TICK / 2.0),
            };
            flat.plus(&now, 1.0);
            rise.plus(&now, (k as f64 + 0.5) / block as f64);
            integral += matrix * TICK;
            rotation = turned(&rotation, &phi);
        }
        // A mean rises in one block and falls in the next.
        let part = 1.0 / block as f64;
        if b < MEANS {
            means[b].plus(&rise, part);
        }
        if b > 0 {
            means[b - 1].plus(&flat, part);
            means[b - 1].plus(&rise, -part);
        }
    }
    WindowMeans { tensors: means.map(|m| m.tensor), integrals: means.map(|m| m.integral - middle) }
}

/// Returns the triangular means of forces without any rotation.
pub(super) fn average_unrotated(forces: &[Vector3<f64>]) -> [Vector3<f64>; MEANS] {
    let block = forces.len() / (MEANS + 1);
    let weight =
        |k: usize| (k as f64 + 0.5).min((2 * block - k) as f64 - 0.5) / (block * block) as f64;
    core::array::from_fn(|m| {
        let part = &forces[m * block..(m + 2) * block];
        part.iter().enumerate().map(|(k, force)| force * weight(k)).sum()
    })
}

#[cfg(test)]
mod tests {
    use super::{average_unrotated, propagate};
    use nalgebra::{Rotation3, Vector3};

    #[test]
    fn a_force_is_constant_where_the_turn_is_undone() {
        let rate = Vector3::new(0.3, -0.5, 0.2);
        let rates = [rate * 2.0; 40];
        let up = Vector3::new(0.1, 0.2, 0.9);
        let at = |k: usize| Rotation3::new(rate * (-0.02 * (k as f64 + 0.5))) * up;
        let forces: Vec<_> = (0..40).map(at).collect();
        let found = propagate(&rates, &forces, 0.5, &Vector3::zeros());
        for tensor in &found.tensors {
            let force: Vector3<f64> = (0..3).map(|c| tensor[c].column(c).into_owned()).sum();
            // A few roundings.
            assert!((force - up).amax() < 1e-14);
        }
        let still = propagate(&rates, &forces, 0.0, &Vector3::zeros());
        for (tensor, plain) in still.tensors.iter().zip(average_unrotated(&forces)) {
            assert!((0..3).all(|c| (tensor[c][(c, c)] - plain[c]).abs() < 1e-14));
        }
        // The integral of 1 is the time from the middle: means at a quarter, the middle, ...
        let times = still.integrals.map(|integral| integral[(0, 0)]);
        assert!((times[0] + 0.2).abs() < 1e-12 && times[1].abs() < 1e-12);
    }
}
