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
    /// Rotation from east, north, up to these axes.
    pub fn from_enu(self) -> Quaternion<f64> {
        let half = FRAC_1_SQRT_2;
        match self {
            Self::Enu => Quaternion::new(1.0, 0.0, 0.0, 0.0),
            // Half a turn about the line between east and north. Of the two quaternions, this one
            // gives 1 and not -1 for a level sensor.
            Self::Ned => Quaternion::new(0.0, -half, -half, 0.0),
            // A quarter of a turn about up, clockwise.
            Self::Nwu => Quaternion::new(half, 0.0, 0.0, -half),
        }
    }
}

impl Frame {
    /// Components of an orientation in east, north, up, relative to these axes, scalar first.
    #[inline(always)]
    pub(super) fn components(self, enu: &Quaternion<f64>) -> [f64; 4] {
        let (w, x, y, z, half) = (enu.w, enu.i, enu.j, enu.k, FRAC_1_SQRT_2);
        match self {
            Self::Enu => [w, x, y, z],
            Self::Ned => [half * (x + y), -half * (w + z), half * (z - w), half * (x - y)],
            Self::Nwu => [half * (w + z), half * (x + y), half * (y - x), half * (z - w)],
        }
    }
}

/// Roll, pitch and yaw of an orientation: a rotation by yaw about z, then by pitch about the new y,
/// then by roll about the new x. Roll is zero if pitch is a right angle.
pub(super) fn euler(q: &Quaternion<f64>) -> [f64; 3] {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    let sine = (2.0 * (w * y - x * z)).clamp(-1.0, 1.0);
    // If the cosine of pitch is only rounding, only the sum of roll and yaw is known.
    if sine.abs() > 1.0 - 1e-12 {
        let yaw = RealField::atan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (x * x + z * z));
        return [0.0, ComplexField::asin(sine), yaw];
    }
    let roll = RealField::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y));
    let yaw = RealField::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    [roll, ComplexField::asin(sine), yaw]
}

/// Direction of the sensor's x axis over ground, clockwise from north, 0 to 2π, for an orientation
/// in east, north, up.
pub(super) fn heading(q: &Quaternion<f64>) -> f64 {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    let (east, north) = (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z));
    let angle = RealField::atan2(east, north);
    let clockwise = if angle < 0.0 { angle + TAU } else { angle };
    // An angle west of north by less than rounding must not become a whole turn.
    if clockwise < TAU { clockwise } else { 0.0 }
}

/// Unit vector up in the sensor's axes, for an orientation in east, north, up.
#[inline(always)]
pub(super) fn up(q: &Quaternion<f64>) -> Vector3<f64> {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    Vector3::new(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
}

#[cfg(test)]
mod tests {
    use super::{Frame, euler, heading, up};
    use core::f64::consts::{FRAC_PI_2, PI};
    use nalgebra::{Quaternion, UnitQuaternion, Vector3};
    use proptest::prelude::*;

    const FRAMES: [Frame; 3] = [Frame::Enu, Frame::Ned, Frame::Nwu];

    fn rotations() -> impl Strategy<Value = UnitQuaternion<f64>> {
        let number = || -1.0..1.0_f64;
        (number(), number(), number(), number())
            .prop_filter("not all zero", |(w, x, y, z)| w * w + x * x + y * y + z * z > 0.01)
            .prop_map(|(w, x, y, z)| UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)))
    }

    /// East, north and up in the frame's axes.
    fn axes(frame: Frame) -> [Vector3<f64>; 3] {
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        match frame {
            Frame::Enu => [x, y, z],
            Frame::Ned => [y, x, -z],
            Frame::Nwu => [-y, x, z],
        }
    }

    #[test]
    fn each_frame_names_the_same_directions() {
        for frame in FRAMES {
            let turn = UnitQuaternion::from_quaternion(frame.from_enu());
            for (enu, there) in axes(Frame::Enu).iter().zip(axes(frame)) {
                assert!((turn * enu - there).amax() < 1e-15, "{frame:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn components_are_those_of_the_turned_orientation(q in rotations()) {
            for frame in FRAMES {
                let [w, x, y, z] = frame.components(&q);
                let product = frame.from_enu() * q.quaternion();
                prop_assert!((product - Quaternion::new(w, x, y, z)).norm() < 1e-15);
            }
        }

        #[test]
        fn yaw_then_pitch_then_roll(roll in -PI..PI, pitch in -1.57..1.57_f64, yaw in -PI..PI) {
            let q = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw)
                * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), pitch)
                * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), roll);
            // Near a pitch of a right angle, roll and yaw lose digits: the factor is one over the
            // cosine of pitch.
            for (got, expected) in euler(&q).into_iter().zip([roll, pitch, yaw]) {
                prop_assert!((got - expected).sin().abs() < 1e-11, "{got} {expected}");
            }
        }

        #[test]
        fn up_is_the_vertical_seen_by_the_sensor(q in rotations()) {
            prop_assert!((up(&q) - q.inverse() * Vector3::z()).amax() < 1e-15);
        }

        #[test]
        fn heading_is_an_azimuth(q in rotations()) {
            let x = q * Vector3::x();
            let angle = heading(&q);
            prop_assert!((0.0..2.0 * PI).contains(&angle));
            let level = x.xy().norm();
            prop_assert!((level * angle.sin() - x.x).abs() < 1e-12);
            prop_assert!((level * angle.cos() - x.y).abs() < 1e-12);
        }
    }

    #[test]
    fn north_is_zero_from_either_side() {
        let q = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2 + 1e-17);
        for q in [
            *q,
            *q * Quaternion::new(1.0, 0.0, 0.0, 1e-17),
            *q * Quaternion::new(1.0, 0.0, 0.0, 4e-16),
        ] {
            assert!(heading(&q) < 1e-15 || (heading(&q) - 2.0 * PI).abs() < 1e-14);
            assert!((0.0..2.0 * PI).contains(&heading(&q)));
        }
    }

    #[test]
    fn straight_up_only_the_sum_of_roll_and_yaw_is_known() {
        for (pitch, yaw) in [(FRAC_PI_2, 0.7), (-FRAC_PI_2, -2.0)] {
            let q = UnitQuaternion::from_euler_angles(0.0, pitch, yaw);
            let [roll, found, heading] = euler(&q);
            assert_eq!(roll, 0.0);
            assert!((found - pitch).abs() < 1e-7 && (heading - yaw).abs() < 1e-12);
        }
    }
}
