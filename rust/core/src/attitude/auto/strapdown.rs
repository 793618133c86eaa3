//! Integration of the rate, sample by sample, and sums over a tick's samples.

use nalgebra::{Matrix3, Quaternion, SVector, Vector3};
use serde::{Deserialize, Serialize};

use super::TICK;
use super::errors::Drivers;
use crate::attitude::sample::{Inertial, MAX_FIELD, MAX_FORCE, MAX_RATE};
use crate::math::rotation::exponential;
use crate::math::validity::{are_within, is_size};

/// Largest squared angle of a step, rad², for which sine and cosine are series.
const MAX_SERIES_ANGLE_SQUARED: f64 = 0.25;
/// Limits for a garbage sample. A step above this angle, rad, is tested: its change from the
/// previous step as a share, its acceleration, rad/s², and the distance of the next step from the
/// previous one as a share.
const LARGE_STEP_RAD: f64 = 0.05;
const MIN_CHANGE_SHARE: f64 = 0.75;
const MIN_ACCELERATION_RAD_S2: f64 = 500.0;
const MAX_RETURN_SHARE: f64 = 0.25;
/// Number of times per tick at which the coupling of gyro errors into the orientation is computed.
const LOOKS_PER_TICK: f64 = 4.0;
/// Largest count: samples may have no duration.
const MAX_COUNT: f64 = 9_007_199_254_740_992.0;

/// Orientation in a frame with a vertical z axis; only the gyro turns its heading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Strapdown {
    pub orientation: Quaternion<f64>,
    /// Rotation matrix of the orientation.
    pub rotation: Matrix3<f64>,
    /// A twelfth of the previous step: coning adds its cross product with the next step.
    before: Vector3<f64>,
    /// A step that may be found to be false at the next step.
    doubted: Option<Doubted>,
    /// Squared size from which a step is tested; any size after a doubted step.
    alert: f64,
}

/// A single step that no sensor's own filter passes: a garbage sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Doubted {
    /// The previous step, the rotation of this step, and its raw rate.
    before: Vector3<f64>,
    angle: Vector3<f64>,
    gyro: Vector3<f64>,
}

impl Default for Strapdown {
    fn default() -> Self {
        let (orientation, rotation) = (Quaternion::identity(), Matrix3::identity());
        Self {
            orientation,
            rotation,
            before: Vector3::zeros(),
            doubted: None,
            alert: LARGE_STEP_RAD * LARGE_STEP_RAD,
        }
    }
}

impl Strapdown {
    /// Rotation of a step in the sensor's axes, with coning.
    #[inline(always)]
    pub fn angle(&self, step: &Vector3<f64>) -> Vector3<f64> {
        step + self.before.cross(step)
    }

    /// Rotates by a step and its angle.
    #[inline(always)]
    pub fn turn(&mut self, step: &Vector3<f64>, angle: &Vector3<f64>) {
        self.before = step * (1.0 / 12.0);
        self.set(product(&self.orientation, &small_rotation(angle)));
    }

    /// True if a step with this angle, or the previous step, must be tested.
    #[inline(always)]
    pub fn doubts(&self, angle: &Vector3<f64>) -> bool {
        angle.norm_squared() > self.alert
    }

    /// Tests a step after the next one: a pulse of a single sample is no step. Returns the false
    /// rate that `gyro` replaces.
    #[cold]
    #[inline(never)]
    pub fn doubt(
        &mut self,
        step: &Vector3<f64>,
        gyro: &Vector3<f64>,
        dt: f64,
    ) -> Option<Vector3<f64>> {
        let mut wrong = None;
        if let Some(doubted) = self.doubted.take()
            && (step - doubted.before).norm_squared()
                <= MAX_RETURN_SHARE * MAX_RETURN_SHARE * doubted.angle.norm_squared()
        {
            let mean = (doubted.before + step) * 0.5;
            self.turn_by(&-doubted.angle);
            self.turn_by(&mean);
            self.before = mean * (1.0 / 12.0);
            wrong = Some(doubted.gyro);
        }
        self.alert = LARGE_STEP_RAD * LARGE_STEP_RAD;
        let before = self.before * 12.0;
        let (changed, angle) = ((step - before).norm_squared(), self.angle(step));
        let (by, fast) = (
            MIN_CHANGE_SHARE * MIN_CHANGE_SHARE * step.norm_squared(),
            MIN_ACCELERATION_RAD_S2 * dt * dt,
        );
        if step.norm_squared() > LARGE_STEP_RAD * LARGE_STEP_RAD
            && changed > by
            && changed > fast * fast
        {
            self.doubted = Some(Doubted { before, angle, gyro: *gyro });
            self.alert = -1.0;
        }
        wrong
    }

    fn turn_by(&mut self, angle: &Vector3<f64>) {
        self.orientation = product(&self.orientation, &small_rotation(angle));
    }

    /// Rotates by a rotation vector in the frame's axes; the result must be settled.
    #[inline(always)]
    pub fn correct(&mut self, angle: &Vector3<f64>) {
        self.orientation = small_rotation(angle) * self.orientation;
    }

    /// Sets an orientation, without earlier steps.
    pub fn restart(&mut self, orientation: Quaternion<f64>) {
        (self.before, self.doubted, self.alert) =
            (Vector3::zeros(), None, LARGE_STEP_RAD * LARGE_STEP_RAD);
        self.set(orientation);
    }

    /// Normalises the quaternion, and keeps it a rotation in spite of rounding.
    #[inline]
    pub fn settle(&mut self) {
        let near_one = 1.5 - 0.5 * self.orientation.norm_squared();
        self.set(self.orientation * near_one);
    }

    #[inline(always)]
    pub fn set(&mut self, orientation: Quaternion<f64>) {
        self.orientation = orientation;
        self.rotation = matrix(&orientation);
    }
}

impl Strapdown {
    pub fn is_valid(&self) -> bool {
        (self.orientation.norm_squared() - 1.0).abs() < 1e-6
            && self.rotation == matrix(&self.orientation)
            && are_within(&self.before, 1e4)
            && self.alert
                == if self.doubted.is_some() { -1.0 } else { LARGE_STEP_RAD * LARGE_STEP_RAD }
            && self.doubted.is_none_or(|one| one.is_valid())
    }
}

impl Doubted {
    fn is_valid(&self) -> bool {
        are_within(&self.before, 2e5)
            && are_within(&self.angle, 1e10)
            && are_within(&self.gyro, MAX_RATE)
    }
}

impl Sums {
    /// True if every sum is possible for its samples.
    pub fn is_valid(&self) -> bool {
        let (rates, forces) = (2.0 * MAX_RATE * self.samples, 2.0 * MAX_FORCE * self.forces);
        let sizes = [
            (self.elapsed, TICK),
            (self.unknown, self.elapsed),
            (self.samples, MAX_COUNT),
            (self.forces, self.samples),
            (self.fields, self.samples),
            (self.looks, self.samples),
            (self.next_look, 2.0),
            (self.gyro_squared, MAX_RATE * rates),
            (self.accel_squared, MAX_FORCE * forces),
        ];
        let counts = [self.samples, self.forces, self.fields, self.looks];
        sizes.iter().all(|(x, most)| is_size(*x, *most))
            && counts.iter().all(|x| *x == (*x as u64) as f64)
            && are_within(&self.gyro, rates)
            && are_within(&self.accel, forces)
            && are_within(&self.force, forces)
            && are_within(&self.field, 2.0 * MAX_FIELD * self.fields)
            && are_within(&self.rotation, 2.0 * self.looks)
            && self.products.iter().all(|product| are_within(product, 4.0 * MAX_RATE * self.looks))
    }
}

/// Rotation by a rotation vector. For angles that a sensor can have in one sample, cosine and sine
/// are series to the sixth order.
#[inline(always)]
pub fn small_rotation(angle: &Vector3<f64>) -> Quaternion<f64> {
    let square = angle.norm_squared();
    if square > MAX_SERIES_ANGLE_SQUARED {
        return exponential(angle).into_inner();
    }
    // The two halves of each series run in parallel: the chain of operations limits a sample's
    // time.
    let fourth = square * square;
    let scalar = (1.0 - square * (1.0 / 8.0)) + fourth * (1.0 / 384.0 - square * (1.0 / 46_080.0));
    let sine =
        (0.5 - square * (1.0 / 48.0)) + fourth * (1.0 / 3_840.0 - square * (1.0 / 645_120.0));
    Quaternion::from_parts(scalar, angle * sine)
}

/// The rotation `p` after `q`, summed in pairs.
#[inline(always)]
fn product(p: &Quaternion<f64>, q: &Quaternion<f64>) -> Quaternion<f64> {
    Quaternion::new(
        (p.w * q.w - p.i * q.i) - (p.j * q.j + p.k * q.k),
        (p.w * q.i + p.i * q.w) + (p.j * q.k - p.k * q.j),
        (p.w * q.j - p.i * q.k) + (p.j * q.w + p.k * q.i),
        (p.w * q.k + p.i * q.j) - (p.j * q.i - p.k * q.w),
    )
}

/// Rotation matrix of a quaternion.
#[inline(always)]
fn matrix(q: &Quaternion<f64>) -> Matrix3<f64> {
    let (w, x, y, z) = (q.w, q.i + q.i, q.j + q.j, q.k + q.k);
    let (wx, wy, wz) = (w * x, w * y, w * z);
    let (xx, xy, xz) = (q.i * x, q.i * y, q.i * z);
    let (yy, yz, zz) = (q.j * y, q.j * z, q.k * z);
    Matrix3::new(
        1.0 - (yy + zz),
        xy - wz,
        xz + wy,
        xy + wz,
        1.0 - (xx + zz),
        yz - wx,
        xz - wy,
        yz + wx,
        1.0 - (xx + yy),
    )
}

/// Sums over the samples of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sums {
    /// Duration, s, and duration without a known rate, s.
    pub elapsed: f64,
    pub unknown: f64,
    /// Numbers of samples, and of samples with a force and with a field.
    pub samples: f64,
    pub forces: f64,
    pub fields: f64,
    /// Rate and force in the sensor's axes, and their squared lengths.
    pub gyro: Vector3<f64>,
    pub gyro_squared: f64,
    pub accel: Vector3<f64>,
    pub accel_squared: f64,
    /// Force and field in the frame's axes.
    pub force: Vector3<f64>,
    pub field: Vector3<f64>,
    looks: f64,
    next_look: f64,
    rotation: Matrix3<f64>,
    /// Sum k: the rotation times component k of the rate without bias.
    products: [Matrix3<f64>; 3],
}

impl Sums {
    /// Empty sums for a tick of this duration, s.
    pub fn new(tick: f64) -> Self {
        let (zero, none) = (Vector3::zeros(), Matrix3::zeros());
        Self {
            elapsed: 0.0,
            unknown: 0.0,
            samples: 0.0,
            forces: 0.0,
            fields: 0.0,
            gyro: zero,
            gyro_squared: 0.0,
            accel: zero,
            accel_squared: 0.0,
            force: zero,
            field: zero,
            looks: 0.0,
            next_look: 0.5 * tick / LOOKS_PER_TICK,
            rotation: none,
            products: [none; 3],
        }
    }

    /// Adds a sample, with its field if it is used. `rate` is without bias, `rotation` is the
    /// rotation after it.
    #[inline(always)]
    pub fn add(
        &mut self,
        sample: &Inertial,
        field: Option<&Vector3<f64>>,
        rate: &Vector3<f64>,
        rotation: &Matrix3<f64>,
        tick: f64,
    ) {
        self.elapsed += sample.dt;
        self.samples += 1.0;
        self.gyro += sample.gyro;
        self.gyro_squared += sample.gyro.norm_squared();
        if let Some(accel) = &sample.accel {
            self.forces += 1.0;
            self.accel += accel;
            self.accel_squared += accel.norm_squared();
            self.force += rotation * accel;
        }
        if let Some(field) = field {
            self.fields += 1.0;
            self.field += rotation * field;
        }
        self.unknown += sample.unknown;
        if self.elapsed >= self.next_look {
            self.look(rate, rotation, tick);
        }
    }

    /// Replaces a false rate in the sums by this rate.
    #[cold]
    #[inline(never)]
    pub fn replace(&mut self, wrong: &Vector3<f64>, gyro: &Vector3<f64>) {
        if self.samples > 0.0 {
            self.gyro += gyro - wrong;
            let squared = self.gyro_squared + (gyro.norm_squared() - wrong.norm_squared());
            self.gyro_squared = squared.max(0.0);
        }
    }

    #[inline(never)]
    fn look(&mut self, rate: &Vector3<f64>, rotation: &Matrix3<f64>, tick: f64) {
        self.looks += 1.0;
        self.next_look += tick / LOOKS_PER_TICK;
        self.rotation += rotation;
        for k in 0..3 {
            self.products[k] += rotation * rate[k];
        }
    }

    /// Derivative of the tick's rotation about axis `i` of the frame by the errors of bias and
    /// matrix.
    #[inline(always)]
    pub fn drivers(&self, i: usize) -> Drivers {
        let scale = if self.looks > 0.0 { self.elapsed / self.looks } else { 0.0 };
        SVector::from_fn(|n, _| match n {
            0..3 => -scale * self.rotation[(i, n)],
            _ => scale * self.products[(n - 3) % 3][(i, (n - 3) / 3)],
        })
    }

    /// Mean rotation.
    pub fn rotation(&self) -> Matrix3<f64> {
        self.rotation * (1.0 / self.looks.max(1.0))
    }

    /// Means of rate and force in the sensor's axes, and mean squared distances of the samples from
    /// the stated points; zero for missing forces.
    pub fn spread(&self, gyro: &Vector3<f64>, accel: &Vector3<f64>) -> (f64, f64) {
        let about = |count: f64, sum: &Vector3<f64>, squared: f64, point: &Vector3<f64>| match count
        {
            0.0 => 0.0,
            n => (squared - 2.0 * sum.dot(point)) / n + point.norm_squared(),
        };
        let of_gyro = about(self.samples, &self.gyro, self.gyro_squared, gyro);
        (of_gyro, about(self.forces, &self.accel, self.accel_squared, accel))
    }
}
