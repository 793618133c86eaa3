//! Swings of a foot. They turn fast. They begin and end in stances with a low bound, the same tilt,
//! and no force but gravity.

use nalgebra::{ComplexField, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{DEGREE, MIN_STANCE_INTERVAL_S};
use crate::math::validity::{are_within, is_size};

/// Limits of a foot's swing: rate, rad/s; ratio of the stances' bound to the swing's bound; angle
/// between the verticals of the two stances, and between force and vertical, rad; distance, m.
const MIN_TURN_RAD_S: f64 = 100.0 * DEGREE;
const MAX_DEPTH: f64 = 0.2;
const MAX_TILT_RAD: f64 = 20.0 * DEGREE;
const MAX_LEAN_RAD: f64 = 45.0 * DEGREE;
const MIN_WAY_M: f64 = 0.1;
/// Quantile of the bound in a swing to which the stances' bound is compared.
const SWING_QUANTILE: f64 = 0.9;
/// Number of swings in the share of time.
const WINDOW: usize = 6;
/// Largest ratio of a sum of vertical-velocity innovations to the sum of their sizes, if they are
/// random.
const MAX_RANDOM_SHARE: f64 = 0.2;
/// Number of bins: eight per octave, from 2^-10 m/s on.
const BINS: usize = 128;
const FIRST_BIN: u64 = (1023 - 10) << 3;
const BIN_SHIFT: u32 = 49;
/// Bounds of a valid state.
const MAX_SECONDS: f64 = 4e9;
const MAX_BOUND: f64 = 1e9;
const MAX_RATE: f64 = 1e5;
const MAX_DISTANCE_M: f64 = 1e9;

/// The point of a stance with the least motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Mark {
    /// Speed bound, m/s.
    pub bound: f64,
    /// Unit vector down, in the sensor's axes.
    pub down: Vector3<f64>,
    /// Angle between the mean force and the vertical, rad.
    pub lean: f64,
    /// Position, m.
    pub position: Vector3<f64>,
}

/// A swing between two stances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// Last node of the stance before, and first node of the stance after.
    pub samples: (usize, usize),
    /// Duration, s.
    pub seconds: f64,
    /// Largest rate, rad/s.
    pub turn: f64,
    /// Larger bound of the two stances over the bound of the swing.
    pub depth: f64,
    /// Angle between the verticals of the two stances in the sensor's axes, rad.
    pub tilt: f64,
    /// Larger angle between mean force and vertical in the two stances, rad.
    pub lean: f64,
    /// Distance between the two stances, m.
    pub way: f64,
    /// Vertical velocity that the next stance removes, m/s, and its standard deviation.
    pub sink: [f64; 2],
}

/// Rates and bounds of the present swing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Motion {
    samples: (u64, u64),
    seconds: f64,
    turn: f64,
    bounds: [[u32; 16]; BINS / 16],
}

/// A swing that has ended, before the end of its next stance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Pending {
    motion: Motion,
    before: Mark,
    sink: [f64; 2],
}

/// Swings while nodes arrive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Swings {
    motion: Motion,
    /// The present stance, or the last one.
    mark: Option<Mark>,
    pending: Option<Pending>,
    /// Durations of the last swings, s; negative if it is not a foot's swing.
    last: [f64; WINDOW],
    count: u64,
    /// Sums of the height that stances remove, m, and of its standard deviation.
    climb: [f64; 2],
}

impl Mark {
    pub fn at(
        bound: f64,
        attitude: &Matrix3<f64>,
        force: &Vector3<f64>,
        position: [f64; 3],
    ) -> Self {
        let down = attitude.row(2).transpose();
        Self { bound, down, lean: angle(&-force, &down), position: position.into() }
    }

    fn is_valid(&self) -> bool {
        (is_size(self.bound, MAX_BOUND) || self.bound == f64::INFINITY)
            && are_within(&self.down, 2.0)
            && is_size(self.lean, 4.0)
            && are_within(&self.position, MAX_DISTANCE_M)
    }
}

impl Swing {
    /// True if the swing passes all five tests.
    pub fn is_of_a_foot(&self) -> bool {
        self.turn > MIN_TURN_RAD_S
            && self.depth < MAX_DEPTH
            && self.tilt < MAX_TILT_RAD
            && self.lean < MAX_LEAN_RAD
            && self.way > MIN_WAY_M
    }
}

impl Motion {
    const NONE: Self =
        Self { samples: (0, 0), seconds: 0.0, turn: 0.0, bounds: [[0; 16]; BINS / 16] };

    fn add(&mut self, dt: f64, turn: f64, bound: f64) {
        self.seconds += dt;
        self.turn = if turn > self.turn { turn } else { self.turn };
        let index = (bound.to_bits() >> BIN_SHIFT).saturating_sub(FIRST_BIN) as usize;
        let index = if index < BINS { index } else { BINS - 1 };
        let bin = &mut self.bounds[index / 16][index % 16];
        *bin = bin.saturating_add(1);
    }

    /// Bound in m/s below which this share of the samples lies.
    fn quantile(&self) -> f64 {
        let all: u64 = self.bounds.iter().flatten().map(|count| u64::from(*count)).sum();
        let (wanted, mut below) = (SWING_QUANTILE * all as f64, 0.0);
        let edge = |index: usize| f64::from_bits((FIRST_BIN + index as u64) << BIN_SHIFT);
        for (index, count) in self.bounds.iter().flatten().enumerate() {
            let count = f64::from(*count);
            if below + count >= wanted && count > 0.0 {
                let (low, high) = (edge(index), edge(index + 1));
                return low + (high - low) * (wanted - below) / count;
            }
            below += count;
        }
        0.0
    }
}

impl Swings {
    pub fn new() -> Self {
        Self {
            motion: Motion::NONE,
            mark: None,
            pending: None,
            last: [0.0; WINDOW],
            count: 0,
            climb: [0.0; 2],
        }
    }

    /// Discards the present swing and stance: the position is unknown.
    pub fn lose(&mut self) {
        (self.mark, self.pending, self.motion) = (None, None, Motion::NONE);
    }

    /// Adds a sample to the present swing, if there is one.
    #[inline(always)]
    pub fn add(&mut self, dt: f64, turn: f64, bound: f64) {
        if self.mark.is_some() {
            self.motion.add(dt, turn, bound);
        }
    }

    /// Adds a node, its mark if the foot stands, and the new vertical velocity; returns the swing
    /// that is now complete.
    pub fn node(&mut self, k: u64, mark: Option<Mark>, sink: [f64; 2]) -> Option<Swing> {
        let swung = self.motion.seconds >= MIN_STANCE_INTERVAL_S;
        let Some(here) = mark else { return if swung { self.finish() } else { None } };
        let done = match self.mark {
            Some(before) if swung => {
                let done = self.finish();
                self.motion.samples.1 = k;
                self.pending = Some(Pending { motion: self.motion, before, sink });
                self.climb[0] += sink[0] * self.motion.seconds;
                self.climb[1] += sink[1] * self.motion.seconds;
                self.mark = None;
                done
            }
            _ => None,
        };
        self.motion = Motion { samples: (k, k), ..Motion::NONE };
        if self.mark.is_none_or(|mark| here.bound < mark.bound) {
            self.mark = Some(here);
        }
        done
    }

    /// The swing whose next stance has ended, or ended with the recording.
    pub fn finish(&mut self) -> Option<Swing> {
        let (pending, after) = (self.pending.take()?, self.mark?);
        let Pending { motion, before, sink } = pending;
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        let swing = Swing {
            samples: (motion.samples.0 as usize, motion.samples.1 as usize),
            seconds: motion.seconds,
            turn: motion.turn,
            depth: larger(before.bound, after.bound) / motion.quantile(),
            tilt: angle(&before.down, &after.down),
            lean: larger(before.lean, after.lean),
            way: (after.position - before.position).norm(),
            sink,
        };
        let sign = if swing.is_of_a_foot() { 1.0 } else { -1.0 };
        self.last[(self.count % WINDOW as u64) as usize] = sign * swing.seconds;
        self.count += 1;
        Some(swing)
    }

    /// Share of the last swings' time with a foot's motion; NaN before enough swings.
    pub fn share(&self) -> f64 {
        if self.count < WINDOW as u64 {
            return f64::NAN;
        }
        let of_foot: f64 = self.last.iter().filter(|s| **s > 0.0).sum();
        of_foot / self.last.iter().map(|s| s.abs()).sum::<f64>()
    }

    /// Variance of the height that stances have removed in the same direction, m².
    pub fn climb_variance(&self, clipped: bool) -> f64 {
        let [removed, sigma] = self.climb.map(|sum| 0.5 * sum);
        let counts = clipped || removed.abs() > MAX_RANDOM_SHARE * sigma;
        if counts { removed * removed } else { 0.0 }
    }

    pub fn is_valid(&self) -> bool {
        let motion = |motion: &Motion| {
            is_size(motion.seconds, MAX_SECONDS) && is_size(motion.turn, MAX_RATE)
        };
        motion(&self.motion)
            && self.mark.as_ref().is_none_or(Mark::is_valid)
            && self.pending.as_ref().is_none_or(|p| motion(&p.motion) && p.before.is_valid())
            && self.last.iter().all(|s| s.abs() <= MAX_SECONDS)
            && self.climb.iter().all(|x| x.is_finite())
    }
}

fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let (across, along) = (a.cross(b).norm(), a.dot(b));
    nalgebra::RealField::atan2(across, along)
}

/// Size of a rate, rad/s.
#[inline(always)]
pub(super) fn turn_of(rate: &Vector3<f64>) -> f64 {
    ComplexField::sqrt(rate.norm_squared())
}

#[cfg(test)]
mod tests {
    use super::{Mark, Matrix3, Motion, Swings, Vector3};

    #[test]
    fn a_quantile_is_that_of_the_samples() {
        let mut motion = Motion::NONE;
        for k in 0..1000 {
            motion.add(0.005, 1.0, 0.002 * f64::from(k));
        }
        assert!((motion.quantile() - 1.8).abs() < 0.02, "{}", motion.quantile());
    }

    /// Stances of 0.2 s and swings of 0.4 s; each step has this distance.
    fn share(bound: f64, way: f64) -> f64 {
        let mut swings = Swings::new();
        for stride in 0..8_u64 {
            for node in 0..30_u64 {
                let at = [way * stride as f64, 0.0, 0.0];
                let force = Vector3::new(0.0, 0.0, -9.81);
                let mark = (node < 10).then(|| Mark::at(bound, &Matrix3::identity(), &force, at));
                for _ in 0..4 {
                    swings.add(0.005, 7.0, 1.0);
                }
                swings.node(120 * stride + 4 * node, mark, [0.0, 0.01]);
            }
        }
        swings.share()
    }

    #[test]
    fn swings_of_a_foot_pass_and_shallow_or_short_ones_do_not() {
        assert_eq!(share(0.01, 1.0), 1.0);
        assert_eq!(share(0.4, 1.0), 0.0);
        assert_eq!(share(0.01, 0.02), 0.0);
        assert!(Swings::new().share().is_nan());
    }
}
