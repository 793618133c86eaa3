//! Check of units, signs and axes by motion: costs of hypotheses on a whole record.
//!
//! A hypothesis is a unit u and one of the 48 signed permutations P of the gyro's axes: the rate is
//! `u P (gyro - b)`. Gravity is constant after rotation by this rate into a frame that does not
//! turn. Accelerations average out in a *triangular* mean: it leaves a second difference of the
//! position, a plain mean leaves a difference of the velocity. With `P = s Q` and a rotation Q, the
//! orientation is `Q R(s ω) Qᵀ`. Two integrations per unit therefore test all 48 permutations, from
//! the tensor of `R_ij a_c` in each mean.
//!
//! Units are *ticks* of 0.02 s, rad/s, and the median size of the forces.

mod cost;
mod field;
mod fit;
mod gyro;
mod propagation;
mod ticks;
mod window;

pub use field::{FieldCosts, field_costs};
pub use fit::{Fit, Trust, fit};
pub use gyro::{GyroCosts, gyro_costs};
pub use ticks::{TICK, ticks};

use nalgebra::{Matrix3, Vector3};

/// Factors from a gyro's named unit to rad/s: correct, if it was in deg/s, and if deg/s was made of
/// rad/s.
pub const UNITS: [f64; 3] = [1.0, core::f64::consts::PI / 180.0, 180.0 / core::f64::consts::PI];

/// Number of signed permutations with determinant 1.
const ROTATIONS: usize = 24;

/// A signed permutation: row `c` has its `sign[c]` in column `axis_order[c]`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sense {
    axis_order: [usize; 3],
    sign: [f64; 3],
}

impl Sense {
    /// All rotations, the identity first, by orders of the columns, then by signs.
    fn rotations() -> [Self; ROTATIONS] {
        const ORDERS: [[usize; 3]; 6] =
            [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        // For each order half of the signs are a rotation.
        let at = |k: usize| {
            let axis_order = ORDERS[k / 4];
            let signs =
                (0..8).map(|bits: usize| [4, 2, 1].map(|b| if bits & b == 0 { 1.0 } else { -1.0 }));
            let all = signs.map(|sign| Self { axis_order, sign });
            all.filter(|sense| sense.matrix().determinant() > 0.0).nth(k % 4)
        };
        core::array::from_fn(|k| at(k).expect("four of the eight signs"))
    }

    fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| if j == self.axis_order[i] { self.sign[i] } else { 0.0 })
    }

    /// Σ_jc M_ijc Q_cj of the tensor whose element `(i, j)` of matrix `c` is M_ijc.
    #[inline(always)]
    fn of(&self, tensor: &[Matrix3<f64>; 3]) -> Vector3<f64> {
        let [x, y, z] = [0, 1, 2].map(|c| tensor[c].column(self.axis_order[c]) * self.sign[c]);
        x + y + z
    }
}

#[cfg(test)]
mod tests {
    use super::Sense;

    #[test]
    fn senses_are_the_rotations_of_a_cube() {
        let all = Sense::rotations();
        for (k, sense) in all.iter().enumerate() {
            assert_eq!(sense.matrix().determinant(), 1.0);
            assert!(all[..k].iter().all(|other| other != sense));
        }
        assert_eq!(all[0].matrix(), nalgebra::Matrix3::identity());
    }
}
