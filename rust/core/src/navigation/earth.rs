//! The Earth of WGS84 at one place: gravity, radii, rates.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

/// Equatorial radius, m.
const RADIUS: f64 = 6_378_137.0;
/// First eccentricity squared.
const ECCENTRICITY: f64 = 6.694_379_990_141_3e-3;
/// Rotation, rad/s.
const RATE: f64 = 7.292_115e-5;
/// Normal gravity at the equator and at the poles, m/s².
const GRAVITY: [f64; 2] = [9.780_325_335_9, 9.832_184_937_8];
/// Polar over equatorial radius: √(1 - e²).
const POLAR: f64 = 0.996_647_189_335_258_2;

/// Largest latitude, rad: beyond ±89.5° north is no useful direction.
pub(crate) const MAX_LATITUDE: f64 = 1.562_069_680_534_925;
/// Largest height and depth, m.
pub(crate) const MAX_HEIGHT: f64 = 1e6;

/// Values of the Earth at a place for the mechanisation; computed again at each step of the
/// covariance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LocalEarth {
    /// Gravity, positive down, m/s².
    pub gravity: f64,
    /// Rotation of the Earth, rad/s.
    pub earth: Vector3<f64>,
    /// Change of latitude per metre north, rad/m.
    pub north: f64,
    /// Change of longitude per metre east, rad/m.
    pub east: f64,
    /// Inverse of the transverse radius plus height, 1/m; tangent of the latitude.
    across: f64,
    tangent: f64,
}

impl LocalEarth {
    /// The Earth at a latitude, rad, and a height, m.
    pub fn at(latitude: f64, height: f64) -> Self {
        let (sine, cosine) = (ComplexField::sin(latitude), ComplexField::cos(latitude));
        let w = 1.0 - ECCENTRICITY * sine * sine;
        let root = ComplexField::sqrt(w);
        let (meridian, across) = (RADIUS * (1.0 - ECCENTRICITY) / (w * root), RADIUS / root);
        Self {
            gravity: gravity(sine * sine, root, height),
            earth: Vector3::new(RATE * cosine, 0.0, -RATE * sine),
            north: 1.0 / (meridian + height),
            east: 1.0 / ((across + height) * cosine),
            across: 1.0 / (across + height),
            tangent: sine / cosine,
        }
    }

    /// A sphere without rotation, so large that a walk on it is a walk on a plane.
    pub(crate) fn plane(gravity: f64) -> Self {
        let (earth, scale) = (Vector3::zeros(), 1.0 / RADIUS);
        Self { gravity, earth, north: scale, east: scale, across: scale, tangent: 0.0 }
    }

    /// The Earth at another place; a plane has the same values everywhere.
    #[inline(always)]
    pub(crate) fn relocate(&self, latitude: f64, height: f64) -> Self {
        let revolutions = self.earth.x != 0.0 || self.earth.z != 0.0;
        if revolutions { Self::at(latitude, height) } else { *self }
    }

    /// Angular rate of the north, east, down frame by its motion, rad/s.
    #[inline(always)]
    pub fn transport(&self, velocity: &Vector3<f64>) -> Vector3<f64> {
        let about_north = velocity.y * self.across;
        Vector3::new(about_north, -velocity.x * self.north, -about_north * self.tangent)
    }

    /// True if these can be the values at a place not too near a pole.
    pub(crate) fn is_valid(&self) -> bool {
        (0.0..20.0).contains(&self.gravity)
            && self.earth.iter().all(|x| x.abs() <= RATE)
            && (1e-7..2e-7).contains(&self.north)
            && (1e-7..3e-5).contains(&self.east)
            && (1e-7..2e-7).contains(&self.across)
            && self.tangent.abs() < 200.0
    }
}

/// Gravity on and above the ellipsoid, m/s²; latitude in rad, height in m.
pub fn normal_gravity(latitude: f64, height: f64) -> f64 {
    let sine = ComplexField::sin(latitude);
    let square = sine * sine;
    gravity(square, ComplexField::sqrt(1.0 - ECCENTRICITY * square), height)
}

/// Somigliana's formula with the gradient of a sphere.
fn gravity(square: f64, root: f64, height: f64) -> f64 {
    let k = POLAR * GRAVITY[1] / GRAVITY[0] - 1.0;
    GRAVITY[0] * (1.0 + k * square) / root * (1.0 - 2.0 * height / RADIUS)
}

/// The angle in the range from -π to π.
pub(crate) fn wrap(angle: f64) -> f64 {
    use core::f64::consts::{PI, TAU};
    if (-PI..=PI).contains(&angle) {
        return angle;
    }
    let revolutions = ComplexField::round(angle / TAU);
    (angle - revolutions * TAU).clamp(-PI, PI)
}

#[cfg(test)]
mod tests {
    use super::{normal_gravity, wrap};

    #[test]
    fn gravity_is_that_of_the_tables() {
        let degrees = [(0.0, 0.0, 9.780_325_336), (45.0, 0.0, 9.806_197_769)];
        let more = [(90.0, 0.0, 9.832_184_938), (45.0, 1000.0, 9.803_122_828)];
        for (latitude, height, expected) in degrees.into_iter().chain(more) {
            let found = normal_gravity(f64::to_radians(latitude), height);
            assert!((found - expected).abs() < 2e-9, "{latitude} {height}: {found}");
        }
    }

    #[test]
    fn angles_wrap() {
        for revolutions in -3..=3 {
            let found = wrap(0.25 + f64::from(revolutions) * core::f64::consts::TAU);
            assert!((found - 0.25).abs() < 1e-14);
        }
        assert_eq!(wrap(-3.0), -3.0);
    }
}
