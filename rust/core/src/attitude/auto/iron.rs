//! Separation of the field: the earth's field in the gyro's frame, iron that turns with the body,
//! and the drift of the frame about the vertical.
//!
//! A wrong heading alone does not distinguish iron from a drift. But the effect of iron depends on
//! the body's direction, and the effect of a drift on time. The two are estimated together, with
//! their common uncertainty.

use nalgebra::{ComplexField, Matrix3, RowVector3, SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};
use wide::f64x4;

use super::{BIAS_LIMIT, BIAS_SIGMA, DEGREE, square};
use crate::attitude::sample::MIN_FIELD;
use crate::math::Symmetric;
use crate::math::validity::is_size;

/// Number of states: the earth's field, iron, and the drift of the frame.
const STATES: usize = 7;
const EARTH: usize = 0;
const IRON: usize = 3;
const DRIFT: usize = 6;
/// Rows of a column in registers: the compiler's own packing is off for this library.
const ROWS: usize = 8;
/// Values relative to the field's strength: largest iron, random walks of the earth's field and the
/// iron, 1/√s, noise of an axis, √s, and smallest standard deviation of the iron.
const MAX_IRON: f64 = 0.4;
const WALKS: [f64; 2] = [0.003, 0.0005];
const NOISE: f64 = 0.2;
const MIN_IRON: f64 = 0.01;
/// Random walk of a possible drift, rad/s/√s. A jump by a degree per second exceeds the noise above
/// within half a minute, before the heading is lost.
pub const FRAME_DRIFT_WALK: f64 = 0.05 * DEGREE;
/// Smallest change of a component, beyond three standard deviations, that neither a place nor a
/// rotation causes within a tick: three times the tenth by which a known field may differ. And time
/// after which the change is permanent, s.
const MIN_COMPONENT_CHANGE: f64 = 0.3;
const MIN_CHANGE_S: f64 = 30.0;
/// Largest ratio of a field or an estimate to the first field.
const MAX_FIELD_RATIO: f64 = 100.0;
/// Variance of an unknown field, and largest variance of the noise.
const MAX_VARIANCE: f64 = 10.0;

/// A column of the covariance; its last row is zero.
#[derive(Clone, Copy)]
struct Lanes(f64x4, f64x4);

impl Lanes {
    #[inline(always)]
    fn of(x: &[f64; ROWS]) -> Self {
        Self(f64x4::from([x[0], x[1], x[2], x[3]]), f64x4::from([x[4], x[5], x[6], x[7]]))
    }

    #[inline(always)]
    fn add(&mut self, other: &Self, times: f64) {
        let times = f64x4::splat(times);
        self.0 += other.0 * times;
        self.1 += other.1 * times;
    }

    #[inline(always)]
    fn times(&self, times: f64) -> Self {
        let times = f64x4::splat(times);
        Self(self.0 * times, self.1 * times)
    }

    #[inline(always)]
    fn numbers(&self) -> [f64; ROWS] {
        let ([a, b, c, d], [e, f, g, h]) = (self.0.to_array(), self.1.to_array());
        [a, b, c, d, e, f, g, h]
    }
}

/// The drift of the frame about the vertical, rad/s, and its variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turning {
    pub rate: f64,
    pub variance: f64,
}

/// The earth's field in the frame that the gyro holds, and iron on the body in the sensor's axes,
/// in units of the first field's strength. Then the drift, rad/s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Iron {
    strength: f64,
    state: SVector<f64, STATES>,
    covariance: SMatrix<f64, ROWS, STATES>,
    /// Time for which all fields were different, s.
    apart: f64,
}

impl Default for Iron {
    fn default() -> Self {
        let iron = MAX_IRON * MAX_IRON;
        let variances = [1.0, 1.0, 1.0, iron, iron, iron, square(BIAS_SIGMA)];
        let covariance = SMatrix::from_fn(|i, j| if i == j { variances[j] } else { 0.0 });
        Self { strength: 0.0, state: SVector::zeros(), covariance, apart: 0.0 }
    }
}

impl Iron {
    /// Processes a field after this time, s, with the factor of its variance and the random walk of
    /// the drift.
    pub fn observe(
        &mut self,
        field: &Vector3<f64>,
        rotation: &Matrix3<f64>,
        span: f64,
        doubt: f64,
        walk: f64,
    ) {
        if self.strength == 0.0 {
            self.strength = field.norm().max(MIN_FIELD);
        }
        self.turn(span);
        self.walk(span, walk);
        let seen = field * (1.0 / self.strength);
        if seen.norm_squared() > MAX_FIELD_RATIO * MAX_FIELD_RATIO {
            return;
        }
        let noise = NOISE * NOISE / span * doubt;
        let mut fits = true;
        for i in 0..3 {
            fits &= self.correct(i, &rotation.row(i).into_owned(), seen[i], noise);
        }
        self.test_fit(fits, span);
        let limits = SVector::<f64, STATES>::from_fn(|i, _| most(i));
        self.state = self.state.zip_map(&limits, |x, most| x.clamp(-most, most));
    }

    /// Learns the field again if it has not fitted for too long.
    fn test_fit(&mut self, fits: bool, span: f64) {
        self.apart = if fits { 0.0 } else { self.apart + span };
        if self.apart >= MIN_CHANGE_S {
            self.forget();
        }
    }

    /// Forgets field and iron, which will change; keeps the drift of the frame.
    pub fn forget(&mut self) {
        self.apart = 0.0;
        self.lose_earth();
        for i in IRON..DRIFT {
            self.restart(i, MAX_IRON * MAX_IRON);
        }
    }

    /// Rotates the earth's field in a frame that drifts.
    fn turn(&mut self, span: f64) {
        let sine = span * self.state[DRIFT];
        let cosine = 1.0 - 0.5 * sine * sine;
        let (x, y) = (self.state[EARTH], self.state[EARTH + 1]);
        let (by_x, by_y) = (-span * y, span * x);
        (self.state[EARTH], self.state[EARTH + 1]) = (cosine * x - sine * y, cosine * y + sine * x);
        let p = &mut self.covariance.data.0;
        let (first, second, drift) = (Lanes::of(&p[0]), Lanes::of(&p[1]), Lanes::of(&p[DRIFT]));
        let turned = |own: &Lanes, other: &Lanes, sine: f64, by_drift: f64| {
            let mut column = own.times(cosine);
            column.add(other, sine);
            column.add(&drift, by_drift);
            column.numbers()
        };
        let one = turned(&first, &second, -sine, by_x);
        let other = turned(&second, &first, sine, by_y);
        for j in 2..STATES {
            (p[j][0], p[j][1]) = (one[j], other[j]);
        }
        (p[0], p[1]) = (one, other);
        p[0][0] = cosine * one[0] - sine * one[1] + by_x * one[DRIFT];
        p[1][1] = cosine * other[1] + sine * other[0] + by_y * other[DRIFT];
        let both = cosine * one[1] + sine * one[0] + by_y * one[DRIFT];
        (p[0][1], p[1][0]) = (both, both);
    }

    fn walk(&mut self, span: f64, walk: f64) {
        for i in 0..STATES {
            let (walk, most) = match i {
                EARTH..IRON => (WALKS[0], MAX_VARIANCE),
                IRON..DRIFT => (WALKS[1], MAX_VARIANCE),
                _ => (walk, square(BIAS_SIGMA)),
            };
            let variance = &mut self.covariance[(i, i)];
            *variance += (span * square(walk)).min((most - *variance).max(0.0));
        }
    }

    /// Corrects by a component of the field: the sum of the earth's field and the rotated iron.
    /// False if it is too far from the expected value, as with a nearby magnet.
    fn correct(&mut self, i: usize, row: &RowVector3<f64>, seen: f64, noise: f64) -> bool {
        let p = &mut self.covariance.data.0;
        let mut column = Lanes::of(&p[i]);
        for (turned, share) in p[IRON..DRIFT].iter().zip(row.iter()) {
            column.add(&Lanes::of(turned), *share);
        }
        let column = column.numbers();
        let own = |v: &[f64]| v[i] + row[0] * v[3] + row[1] * v[4] + row[2] * v[5];
        let (unsure, apart) = (own(&column), seen - own(&self.state.data.0[0]));
        if square(apart) > square(MIN_COMPONENT_CHANGE) + 9.0 * unsure {
            return false;
        }
        let scale = 1.0 / (unsure + noise);
        let weight = apart * scale;
        // The root of the scale on two sides keeps the covariance exactly symmetric.
        let root = ComplexField::sqrt(scale);
        let packed = Lanes::of(&column).times(root);
        for (own, root) in p.iter_mut().zip(packed.numbers()) {
            let mut rest = Lanes::of(own);
            rest.add(&packed, -root);
            *own = rest.numbers();
        }
        for (own, column) in self.state.iter_mut().zip(column) {
            *own += column * weight;
        }
        true
    }

    /// Drift of the frame.
    pub fn turning(&self) -> Turning {
        Turning { rate: self.state[DRIFT], variance: self.covariance[(DRIFT, DRIFT)].max(0.0) }
    }

    /// Adds this variance to the drift.
    pub fn widen(&mut self, variance: f64) {
        self.covariance[(DRIFT, DRIFT)] += variance;
    }

    /// Sets the drift of the frame to zero with this variance, after a rest.
    pub fn rest(&mut self, variance: f64) {
        self.restart(DRIFT, variance);
    }

    /// Loses the direction of the earth's field, since the frame has changed.
    pub fn lose_earth(&mut self) {
        for i in EARTH..IRON {
            self.restart(i, 1.0);
        }
    }

    /// Notes a rotation of the frame about the vertical by an angle of this variance.
    pub fn blur(&mut self, variance: f64) {
        let level = square(self.state[EARTH]) + square(self.state[EARTH + 1]);
        for i in EARTH..EARTH + 2 {
            let own = &mut self.covariance[(i, i)];
            *own += (variance * level).min((MAX_VARIANCE - *own).max(0.0));
        }
    }

    /// Sets a state to zero with this variance.
    fn restart(&mut self, i: usize, variance: f64) {
        for j in 0..STATES {
            self.covariance[(i, j)] = 0.0;
            self.covariance[(j, i)] = 0.0;
        }
        self.state[i] = 0.0;
        self.covariance[(i, i)] = variance;
    }

    /// Notes that the gyro's bias about the vertical has changed by a rate: the frame drifts less
    /// by it.
    pub fn learned(&mut self, rate: f64) {
        self.state[DRIFT] = (self.state[DRIFT] - rate).clamp(-BIAS_LIMIT, BIAS_LIMIT);
    }

    /// Heading error from iron, and its variance, for a heading that has followed the field with
    /// these shares of its axes.
    pub fn of_heading(&self, shares: &Vector3<f64>) -> (f64, f64) {
        let shares = shares * self.strength;
        let iron = self.state.fixed_rows::<3>(IRON);
        let variance = (self.covariance.fixed_view::<3, 3>(IRON, IRON) * shares).dot(&shares);
        let most = MIN_IRON * MIN_IRON * shares.norm_squared();
        (shares.dot(&iron), variance.max(0.0).min(most))
    }

    /// Strength of the first field; zero before it.
    pub fn strength(&self) -> f64 {
        self.strength
    }

    pub fn is_valid(&self) -> bool {
        let (p, first) = (&self.covariance, self.strength == 0.0 || self.strength >= MIN_FIELD);
        let square = p.fixed_rows::<STATES>(0);
        is_size(self.strength, 1e10)
            && first
            && is_size(self.apart, MIN_CHANGE_S)
            && (0..STATES).all(|i| self.state[i].abs() <= most(i))
            && square == square.transpose()
            && p.row(ROWS - 1).iter().all(|x| *x == 0.0)
            && Symmetric::<f64, STATES>::from_upper(|i, j| p[(i, j)]).is_covariance(1e3)
    }
}

/// Largest size of a state.
fn most(i: usize) -> f64 {
    if i == DRIFT { BIAS_LIMIT } else { MAX_FIELD_RATIO }
}

#[cfg(test)]
mod tests {
    use super::{DEGREE, DRIFT, EARTH, FRAME_DRIFT_WALK, IRON, Iron, STATES};
    use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3};
    use proptest::prelude::*;

    const TICK: f64 = 0.1;
    const FIELD: Vector3<f64> = Vector3::new(0.0, 20.0, -43.0);

    /// A car that drives straight for a quarter of a minute and turns by a right angle, for some
    /// minutes, with iron, seen from a frame that drifts, rad/s.
    fn driven(iron: &Vector3<f64>, drift: f64, minutes: usize) -> Iron {
        let mut found = Iron::default();
        let (mut heading, mut turned) = (0.0, 0.0);
        for k in 0..600 * minutes {
            heading += if k % 150 >= 110 { 22.5 * DEGREE * TICK } else { 0.0 };
            turned += drift * TICK;
            let frame = Rotation3::from_axis_angle(&Vector3::z_axis(), turned);
            let body = frame * Rotation3::from_axis_angle(&Vector3::z_axis(), heading);
            let field = frame * FIELD + body * iron;
            found.observe(&field, body.matrix(), TICK, 1.0, FRAME_DRIFT_WALK);
        }
        found
    }

    #[test]
    fn iron_is_no_drift() {
        let iron = Vector3::new(10.0, -10.0, 0.0);
        let found = driven(&iron, 0.0, 5);
        let seen = found.state.fixed_rows::<2>(IRON) * found.strength;
        assert!((seen - iron.xy()).norm() < 1.0, "{seen}");
        assert!(found.turning().rate.abs() < 0.02 * DEGREE, "{:?}", found.turning());
    }

    #[test]
    fn a_drift_is_no_iron() {
        let found = driven(&Vector3::zeros(), DEGREE, 5);
        let by = found.turning();
        assert!((by.rate - DEGREE).abs() < 0.02 * DEGREE, "{by:?}");
        assert!(by.rate > 2.0 * by.variance.sqrt(), "{by:?}");
        let iron = found.state.fixed_rows::<2>(IRON) * found.strength;
        assert!(iron.norm() < 1.0, "{iron}");
    }

    #[test]
    fn both_are_distinguished() {
        let iron = Vector3::new(10.0, -10.0, 0.0);
        let found = driven(&iron, -DEGREE, 5);
        assert!((found.turning().rate + DEGREE).abs() < 0.05 * DEGREE, "{:?}", found.turning());
        let seen = found.state.fixed_rows::<2>(IRON) * found.strength;
        assert!((seen - iron.xy()).norm() < 1.0, "{seen}");
    }

    #[test]
    fn what_passes_is_neither_and_what_stays_is_learned() {
        let mut found = driven(&Vector3::zeros(), 0.0, 5);
        let (before, stand) = (found, Matrix3::identity());
        let magnet = FIELD + Vector3::new(20.0, -25.0, 30.0);
        let seen = |found: &mut Iron, seconds: f64| {
            for _ in 0..(seconds / TICK).round() as usize {
                found.observe(&magnet, &stand, TICK, 1.0, FRAME_DRIFT_WALK);
            }
        };
        seen(&mut found, 4.0);
        assert!((found.state - before.state).amax() < 1e-3, "{}", found.state - before.state);
        seen(&mut found, 60.0);
        let all = found.state.fixed_rows::<3>(EARTH) + found.state.fixed_rows::<3>(IRON);
        assert!((all * found.strength - magnet).norm() < 2.0, "{all}");
        assert!(found.is_valid());
    }

    #[test]
    fn what_a_rest_says_stands_alone() {
        let mut found = driven(&Vector3::new(10.0, 0.0, 0.0), DEGREE, 1);
        found.rest(1e-8);
        assert_eq!((found.turning().rate, found.turning().variance), (0.0, 1e-8));
        assert!(found.is_valid());
        found.learned(-0.5 * DEGREE);
        assert_eq!(found.turning().rate, 0.5 * DEGREE);
    }

    /// A rotation vector and a field.
    fn seen() -> impl Strategy<Value = ([f64; 3], [f64; 3])> {
        (prop::array::uniform3(-3.0..3.0_f64), prop::array::uniform3(-90.0..90.0_f64))
    }

    proptest! {
        #[test]
        fn a_drift_turns_the_covariance_as_matrices_do(
            seen in prop::collection::vec(seen(), 5..60), span in 0.01..1.0_f64,
        ) {
            let mut found = Iron::default();
            for (angle, field) in &seen {
                let rotation = Rotation3::new(Vector3::from(*angle));
                found.observe(&Vector3::from(*field), rotation.matrix(), TICK, 1.0, FRAME_DRIFT_WALK);
                prop_assert!(found.is_valid());
            }
            let before = found;
            found.turn(span);
            let (x, y) = (before.state[EARTH], before.state[EARTH + 1]);
            let sine = span * before.state[DRIFT];
            let cosine = 1.0 - 0.5 * sine * sine;
            let mut f = SMatrix::<f64, STATES, STATES>::identity();
            (f[(0, 0)], f[(1, 1)]) = (cosine, cosine);
            (f[(0, 1)], f[(1, 0)]) = (-sine, sine);
            (f[(0, DRIFT)], f[(1, DRIFT)]) = (-span * y, span * x);
            let p = before.covariance.fixed_rows::<STATES>(0);
            let expected = f * p * f.transpose();
            let got = found.covariance.fixed_rows::<STATES>(0);
            prop_assert!((got - expected).amax() <= 1e-12 * expected.amax());
            prop_assert_eq!(found.state[EARTH], cosine * x - sine * y);
            prop_assert!(found.is_valid());
        }

        #[test]
        fn it_stays_valid_whatever_happens(
            seen in prop::collection::vec(seen(), 5..60), variance in 0.0..10.0_f64,
        ) {
            let mut found = Iron::default();
            for (k, (angle, field)) in seen.iter().enumerate() {
                let rotation: Matrix3<f64> = Rotation3::new(Vector3::from(*angle)).into_inner();
                let stronger = Vector3::from(*field) * (1.0 + k as f64);
                found.observe(&stronger, &rotation, TICK, 16.0, FRAME_DRIFT_WALK);
                match k % 5 {
                    0 => found.widen(variance),
                    1 => found.blur(variance),
                    2 => found.learned(variance),
                    3 => found.lose_earth(),
                    _ => found.rest(variance),
                }
                prop_assert!(found.is_valid());
            }
        }
    }
}
