//! Frames of the earth, and angles of an orientation in them.

use core::f64::consts::{FRAC_1_SQRT_2, TAU};

use nalgebra::{ComplexField, Quaternion, RealField, Vector3};
use serde::{Deserialize, Serialize};

/// Axes of the earth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Frame {
    /// East, north, up.
    #[default]
    Enu,
    /// North, east, down.
    Ned,
    /// North, west, up.
    Nwu,
}

impl Frame {
    /// The rotation from east, north, up to these axes.
    pub fn from_enu(self) -> Quaternion<f64> {
        let half = FRAC_1_SQRT_2;
        match self {
            Self::Enu => Quaternion::new(1.0, 0.0, 0.0, 0.0),
            // Half a turn about the line between east and north.
            Self::Ned => Quaternion::new(0.0, half, half, 0.0),
            // A quarter of a turn about up, clockwise.
            Self::Nwu => Quaternion::new(half, 0.0, 0.0, -half),
        }
    }
}

impl Frame {
    /// An orientation in east, north, up, seen from these axes, the scalar first.
    #[inline(always)]
    pub(super) fn components(self, enu: &Quaternion<f64>) -> [f64; 4] {
        let (w, x, y, z, half) = (enu.w, enu.i, enu.j, enu.k, FRAC_1_SQRT_2);
        match self {
            Self::Enu => [w, x, y, z],
            Self::Ned => [-half * (x + y), half * (w + z), half * (w - z), half * (y - x)],
            Self::Nwu => [half * (w + z), half * (x + y), half * (y - x), half * (z - w)],
        }
    }
}

/// Roll, pitch and yaw of an orientation: turned by yaw about z, then by pitch about the new y,
/// then by roll about the new x. At a pitch of a right angle roll is zero.
pub(super) fn euler(q: &Quaternion<f64>) -> [f64; 3] {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    let sine = (2.0 * (w * y - x * z)).clamp(-1.0, 1.0);
    // Where the cosine of pitch is a rounding, only the sum of both other angles is known.
    if sine.abs() > 1.0 - 1e-12 {
        let yaw = RealField::atan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (x * x + z * z));
        return [0.0, sine.asin(), yaw];
    }
    let roll = RealField::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y));
    let yaw = RealField::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    [roll, ComplexField::asin(sine), yaw]
}

/// The direction of the sensor's x axis over ground from north, clockwise, 0 to 2π: of an
/// orientation in east, north, up.
pub(super) fn heading(q: &Quaternion<f64>) -> f64 {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    let (east, north) = (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z));
    let angle = RealField::atan2(east, north);
    if angle < 0.0 { angle + TAU } else { angle }
}

/// Up in the axes of the sensor: of an orientation in east, north, up.
#[inline(always)]
pub(super) fn up(q: &Quaternion<f64>) -> Vector3<f64> {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    Vector3::new(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
}
