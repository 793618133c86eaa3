//! Standard deviation of a heading that a magnetometer holds: fields of rooms and iron of the body do
//! not average out as white noise does.

use nalgebra::{ComplexField, Matrix3, Matrix6, RowVector3, Vector3, Vector6};
use serde::{Deserialize, Serialize};
use wide::{f64x2, f64x4};

use super::{DEGREE, square};
use crate::attitude::sample::FIELD_MIN;
use crate::math::Symmetric;
use crate::math::sound::{are_within, is_size};

/// Deviation that is always left, rad, and that at the start.
const LEFT: f64 = 0.5 * DEGREE;
const FIRST: f64 = 3.0 * DEGREE;
/// Seconds of the mean innovation whose square says how wrong places are.
const PLACE: f64 = 5.0;
/// Of a heading that nothing is known of, rad².
const MOST: f64 = 10.0;
/// Largest tangent of a dip.
const STEEPEST: f64 = 10.0;
/// Variance of a tilt of which nothing is known, rad²: it cannot be further off than half a turn.
const ANY_TILT: f64 = core::f64::consts::PI * core::f64::consts::PI;
/// Of the field's strength: what iron may be, how the earth's field and the iron walk, 1/√s, the
/// noise of an axis, √s, and how well iron can be known.
const IRON: f64 = 0.4;
const WALKS: [f64; 2] = [0.003, 0.0005];
const NOISE: f64 = 0.2;
const IRON_LEAST: f64 = 0.01;
/// A field this many times as strong as the first is no body's, and no estimate is.
const STRONGEST: f64 = 100.0;

/// Six numbers in registers: the compiler's own packing is off for this library.
struct Lanes(f64x4, f64x2);

impl Lanes {
    #[inline(always)]
    fn of(x: &[f64; 6]) -> Self {
        Self(f64x4::from([x[0], x[1], x[2], x[3]]), f64x2::from([x[4], x[5]]))
    }

    #[inline(always)]
    fn add(&mut self, other: &Self, times: f64) {
        self.0 += other.0 * f64x4::splat(times);
        self.1 += other.1 * f64x2::splat(times);
    }

    #[inline(always)]
    fn numbers(&self) -> [f64; 6] {
        let ([a, b, c, d], [e, f]) = (self.0.to_array(), self.1.to_array());
        [a, b, c, d, e, f]
    }
}

/// The field as the earth's, in the frame that the gyro holds, and that of iron on the body, in the
/// axes of the sensor: both in the unit of the first field's strength.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Iron {
    strength: f64,
    state: Vector6<f64>,
    covariance: Matrix6<f64>,
}

impl Default for Iron {
    fn default() -> Self {
        let variances = Vector6::new(1.0, 1.0, 1.0, IRON * IRON, IRON * IRON, IRON * IRON);
        let covariance = Matrix6::from_diagonal(&variances);
        Self { strength: 0.0, state: Vector6::zeros(), covariance }
    }
}

impl Iron {
    /// Takes a field after so many seconds, and how much its variance is larger than usual.
    fn observe(&mut self, field: &Vector3<f64>, rotation: &Matrix3<f64>, span: f64, doubt: f64) {
        if self.strength == 0.0 {
            self.strength = field.norm().max(FIELD_MIN);
        }
        let seen = field * (1.0 / self.strength);
        if seen.norm_squared() > STRONGEST * STRONGEST {
            return;
        }
        for i in 0..6 {
            let variance = &mut self.covariance[(i, i)];
            *variance +=
                (span * square(WALKS[usize::from(i > 2)])).min((MOST - *variance).max(0.0));
        }
        let noise = NOISE * NOISE / span * doubt;
        for i in 0..3 {
            self.correct(i, &rotation.row(i).into_owned(), seen[i], noise);
        }
    }

    /// By a component of the field: that of the earth and of the turned iron.
    fn correct(&mut self, i: usize, row: &RowVector3<f64>, seen: f64, noise: f64) {
        let p = &mut self.covariance.data.0;
        let mut column = Lanes::of(&p[i]);
        for (turned, share) in p[3..].iter().zip(row.iter()) {
            column.add(&Lanes::of(turned), *share);
        }
        let column = column.numbers();
        let own = |v: &[f64; 6]| v[i] + row[0] * v[3] + row[1] * v[4] + row[2] * v[5];
        let scale = 1.0 / (own(&column) + noise);
        let weight = (seen - own(&self.state.data.0[0])) * scale;
        let root = ComplexField::sqrt(scale);
        let roots = column.map(|x| x * root);
        let packed = Lanes::of(&roots);
        for (own, root) in p.iter_mut().zip(roots) {
            let mut rest = Lanes::of(own);
            rest.add(&packed, -root);
            *own = rest.numbers();
        }
        for (own, column) in self.state.iter_mut().zip(column) {
            *own = (*own + column * weight).clamp(-STRONGEST, STRONGEST);
        }
    }

    /// What iron makes of a heading that has followed the field by these shares of its axes, and the
    /// variance of that.
    fn of_heading(&self, shares: &Vector3<f64>) -> (f64, f64) {
        let shares = shares * self.strength;
        let iron = self.state.fixed_rows::<3>(3);
        let variance = (self.covariance.fixed_view::<3, 3>(3, 3) * shares).dot(&shares);
        let most = IRON_LEAST * IRON_LEAST * shares.norm_squared();
        (shares.dot(&iron), variance.max(0.0).min(most))
    }

    fn is_sound(&self) -> bool {
        let p = &self.covariance;
        let first = self.strength == 0.0 || self.strength >= FIELD_MIN;
        is_size(self.strength, 1e10)
            && first
            && are_within(&self.state, STRONGEST)
            && *p == p.transpose()
            && Symmetric::<f64, 6>::from_upper(|i, j| p[(i, j)]).is_covariance(1e3)
    }
}

/// What is seen of the field when it corrects the heading.
#[derive(Debug, Clone, Copy)]
pub struct Correction {
    pub gain: f64,
    pub noise: f64,
    /// Angle from north, rad.
    pub innovation: f64,
    /// Level and vertical part of the field.
    pub level: f64,
    pub down: f64,
    /// Variance of the tilt about one axis, rad².
    pub tilt: f64,
    /// East in the axes of the sensor.
    pub east: Vector3<f64>,
    /// Share of a mean over places.
    pub places: f64,
    pub span: f64,
}

/// What the variance of the heading is made of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// The share of white noise of the field in the filter's variance, and what is left of it that
    /// no field has shown, rad².
    white: f64,
    own: f64,
    /// The filter's variance when a field was last used, rad².
    known: f64,
    /// The heading's deviation by a tilt that mixes the field's dip into it, rad.
    tilted: f64,
    /// Mean innovation over a place, rad, and its mean square over places.
    mean: f64,
    places: f64,
    iron: Iron,
    /// What a field of the sensor's axes does to the heading, 1 over the field's unit.
    shares: Vector3<f64>,
}

impl Deviation {
    /// Of a heading of this variance.
    pub fn new(heading: f64) -> Self {
        Self {
            white: 0.0,
            own: heading,
            known: heading,
            tilted: 0.0,
            mean: 0.0,
            places: FIRST * FIRST,
            iron: Iron::default(),
            shares: Vector3::zeros(),
        }
    }

    /// The share that no field has shown, of a heading that has this variance now.
    fn since_field(&self, heading: f64) -> f64 {
        (self.own + heading - self.known).max(0.0)
    }

    /// Takes a field, used or not.
    pub fn observe(
        &mut self,
        field: &Vector3<f64>,
        rotation: &Matrix3<f64>,
        span: f64,
        doubt: f64,
    ) {
        self.iron.observe(field, rotation, span, doubt);
    }

    /// Takes a correction of the heading, and its variance before and after.
    pub fn correct(&mut self, by: &Correction, before: f64, after: f64) {
        let (gain, rest) = (by.gain, 1.0 - by.gain);
        self.white = rest * rest * self.white + gain * gain * by.noise;
        let slope = (by.down.abs() / by.level).min(STEEPEST);
        self.tilted += gain * (slope * ComplexField::sqrt(by.tilt.min(ANY_TILT)) - self.tilted);
        self.mean += (by.span / PLACE).min(1.0) * (by.innovation - self.mean);
        self.places += by.places * (self.mean * self.mean - self.places);
        self.own = (rest * rest * self.since_field(before))
            .min((after - self.white).max(0.0))
            .min(self.places + LEFT * LEFT);
        self.known = after;
        let east = by.east * (1.0 / by.level.max(1e-6 * self.iron.strength));
        self.shares += (east - self.shares) * gain;
    }

    /// Forgets what the heading was made of: it has this variance now.
    pub fn restart(&mut self, heading: f64) {
        let Self { places, iron, .. } = *self;
        *self = Self { places, iron, ..Self::new(heading) };
    }

    /// The variance of the heading, of which the filter says this one.
    pub fn variance(&self, heading: f64) -> f64 {
        let (iron, unsure) = self.iron.of_heading(&self.shares);
        let seen = LEFT * LEFT + self.tilted * self.tilted + iron * iron + unsure;
        (self.since_field(heading).max(self.places) + seen).min(MOST)
    }

    /// Variance that a field of this covariance, in the sensor's axes, has given the heading.
    pub fn by_field(&self, covariance: &Matrix3<f64>) -> f64 {
        (covariance * self.shares).dot(&self.shares).max(0.0)
    }

    pub fn is_sound(&self) -> bool {
        let sizes = [
            (self.white, 1e3),
            (self.own, 1e3),
            (self.known, 1e3),
            (self.tilted, 1e2),
            (self.places, 16.0),
        ];
        sizes.iter().all(|(x, most)| is_size(*x, *most))
            && self.mean.abs() <= 4.0
            && self.iron.is_sound()
            && self.is_shared_soundly()
    }

    /// Before the first field nothing has a share.
    fn is_shared_soundly(&self) -> bool {
        match self.iron.strength {
            0.0 => self.shares == Vector3::zeros(),
            strength => are_within(&(self.shares * strength), 1e7),
        }
    }
}
