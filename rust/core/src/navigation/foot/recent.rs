//! The last samples of a live sensor on a foot, and the speed bound at the middle sample.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

use super::beginning::AtRest;
use super::cubic::{Cubic, MAX_RATE_RATIO, density};
use super::ranges::{MAX_RUN_S, RUN_SHARE, Side};
use super::{FORCE_S, MAX_HELD_S, PIVOT_DISTANCE_M};
use crate::math::validity::{are_within, is_count, is_size};
use crate::navigation::filter::{MAX_SAMPLE, is_known};

/// Number of samples that are kept: two windows on each side of the output's sample, and samples
/// for which clipped rates wait.
const ROW: usize = 16;
const ROWS: usize = 12;
const SLOTS: u64 = (ROW * ROWS) as u64;
/// Largest number of samples in half a window.
pub(super) const MAX_HALF: u64 = 30;
/// Error of a clipped rate before its flanks are known, as a share of the range.
const UNKNOWN_RATE_SHARE: f64 = 0.2;
/// Bounds of a valid state: times, s, and squares and densities of possible samples.
const MAX_TIME_S: f64 = 4e9;
const MAX_SQUARE: f64 = 1e12;

/// One sample; a missing sample is replaced by the last one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Slot {
    pub gyro: Vector3<f64>,
    pub accel: Vector3<f64>,
    /// Mask of missing sensors.
    pub missing: [bool; 2],
    /// Error of a clipped rate: density of a white noise, rad²/s.
    pub variance: f64,
    /// Square of the force minus gravity.
    pushed: f64,
    /// True if the sample is missing for so long that it is unknown.
    lost: bool,
}

/// Present run of one axis at the range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Run {
    samples: u32,
    positive: bool,
    /// True if the run has ended and waits for the second sample after it.
    ended: bool,
}

/// The last samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Recent {
    slots: [[Slot; ROW]; ROWS],
    /// Number of samples since the two sensors were first known.
    count: u64,
    /// Last known rate and force, and time since, s.
    last: [Option<Vector3<f64>>; 2],
    ages: [f64; 2],
    runs: [Run; 3],
    /// Positive and negative side of each axis.
    sides: [[Side; 2]; 3],
    /// Number of restored samples.
    restored: u64,
}

impl Slot {
    const EMPTY: Self = Self {
        gyro: Vector3::new(0.0, 0.0, 0.0),
        accel: Vector3::new(0.0, 0.0, 0.0),
        missing: [false; 2],
        variance: 0.0,
        pushed: 0.0,
        lost: false,
    };

    fn is_valid(&self) -> bool {
        are_within(&self.gyro, MAX_RATE_RATIO * MAX_SAMPLE)
            && are_within(&self.accel, MAX_SAMPLE)
            && is_size(self.variance, MAX_SQUARE)
            && is_size(self.pushed, MAX_SQUARE)
    }
}

impl Run {
    const NONE: Self = Self { samples: 0, positive: false, ended: false };
}

impl Recent {
    pub fn new() -> Self {
        Self {
            slots: [[Slot::EMPTY; ROW]; ROWS],
            count: 0,
            last: [None; 2],
            ages: [0.0; 2],
            runs: [Run::NONE; 3],
            sides: [[Side::NONE; 2]; 3],
            restored: 0,
        }
    }

    pub fn slot(&self, k: u64) -> &Slot {
        let index = (k % SLOTS) as usize;
        &self.slots[index / ROW][index % ROW]
    }

    fn slot_mut(&mut self, k: u64) -> &mut Slot {
        let index = (k % SLOTS) as usize;
        &mut self.slots[index / ROW][index % ROW]
    }

    /// Adds a sample; returns true if the two sensors are or were known. `half` is half a window,
    /// `late` the delay of the output in samples.
    pub fn push(
        &mut self,
        given: [Vector3<f64>; 2],
        (dt, half, late): (f64, u64, u64),
        force: f64,
        range: Option<f64>,
    ) -> bool {
        let missing = given.map(|v| !is_known(&v));
        for i in 0..2 {
            if missing[i] {
                let age = self.ages[i] + dt;
                self.ages[i] = if age < MAX_TIME_S { age } else { MAX_TIME_S };
            } else {
                (self.last[i], self.ages[i]) = (Some(given[i]), 0.0);
            }
        }
        let [Some(gyro), Some(accel)] = self.last else { return false };
        let lost = self.ages.iter().any(|age| *age > MAX_HELD_S);
        let k = self.count;
        *self.slot_mut(k) = Slot { gyro, accel, missing, lost, ..Slot::EMPTY };
        self.count += 1;
        for axis in 0..3 {
            if range.is_none() && !missing[0] {
                self.look_at_side(axis, dt);
            }
            self.look_at_clip(axis, range, dt, late);
        }
        if k >= half {
            let middle = k - half;
            let sum: Vector3<f64> = self.window(middle, half).map(|i| self.slot(i).accel).sum();
            let size = sum.norm();
            let still = if size > 0.0 { sum * (force / size) } else { sum };
            self.slot_mut(middle).pushed = (self.slot(middle).accel - still).norm_squared();
        }
        true
    }

    /// Index of the sample whose bound is now known.
    pub fn ready(&self, late: u64) -> Option<u64> {
        self.count.checked_sub(late + 1)
    }

    fn window(&self, k: u64, half: u64) -> core::ops::RangeInclusive<u64> {
        k.saturating_sub(half)..=k + half
    }

    /// Speed bound at a sample that is ready, m/s.
    pub fn bound(&self, k: u64, half: u64, known: &AtRest) -> f64 {
        if self.slot(k).lost {
            return f64::INFINITY;
        }
        let turned = |i: u64| (self.slot(i).gyro - known.gyro_bias).norm_squared();
        let rotations: f64 = self.window(k, half).map(turned).sum();
        let pushes: f64 = self.window(k, half).map(|i| self.slot(i).pushed).sum();
        let square = PIVOT_DISTANCE_M * PIVOT_DISTANCE_M * rotations + FORCE_S * FORCE_S * pushes;
        let count = 1 + half + k.min(half);
        ComplexField::sqrt(square / count as f64)
    }

    /// Mean force of `half` samples on each side of a sample that is ready.
    pub fn force(&self, k: u64, half: u64) -> Vector3<f64> {
        let window = self.window(k, half);
        let count = 1 + half + k.min(half);
        window.map(|i| self.slot(i).accel).sum::<Vector3<f64>>() / count as f64
    }

    /// Updates the range of an axis by the last sample, if it is not stated.
    fn look_at_side(&mut self, axis: usize, dt: f64) {
        let k = self.count - 1;
        let x = self.slot(k).gyro[axis];
        let side = &mut self.sides[axis][usize::from(x < 0.0)];
        side.look(x.abs());
        if k < 2 {
            return;
        }
        // The second sample after a run.
        let last = self.slot(k - 2).gyro[axis];
        let (index, sign) = (usize::from(last < 0.0), if last < 0.0 { -1.0 } else { 1.0 });
        let of = |k: u64| sign * self.slot(k).gyro[axis];
        let side = &self.sides[axis][index];
        if !side.is_at_limit(of(k - 2)) || side.is_at_limit(of(k - 1)) {
            return;
        }
        let most = ((MAX_RUN_S / dt) as u64).min(SLOTS - 6);
        let samples = (0..most.min(k - 2)).take_while(|i| side.is_at_limit(of(k - 2 - i))).count();
        let first = k - 1 - samples as u64;
        if samples < 2 || samples as u64 >= most || first < 2 {
            return;
        }
        let cubic = Cubic::over(samples, [of(first - 2), of(first - 1)], [of(k - 1), of(k)]);
        let excess = (0..samples).map(|i| cubic.at(i) - of(first + i as u64)).sum();
        self.sides[axis][index].take(samples as f64, excess);
    }

    /// Updates a clipped run of an axis by the last sample.
    fn look_at_clip(&mut self, axis: usize, given: Option<f64>, dt: f64, late: u64) {
        let k = self.count - 1;
        let x = self.slot(k).gyro[axis];
        let [up, down] = self.sides[axis].map(|side| given.or_else(|| side.range(dt)));
        let range = |positive: bool| if positive { up } else { down };
        let run = self.runs[axis];
        if run.ended {
            if let Some(range) = range(run.positive) {
                self.restore(axis, range, dt, late);
            }
            self.runs[axis] = Run::NONE;
        }
        let run = self.runs[axis];
        let range = range(x > 0.0);
        let limit = range.map_or(f64::INFINITY, |range| RUN_SHARE * range);
        let (clipped, positive) = (x.abs() >= limit, x > 0.0);
        if let Some(range) = range
            && clipped
            && (run.samples == 0 || run.positive == positive)
        {
            let samples = if run.samples < u32::MAX { run.samples + 1 } else { run.samples };
            self.runs[axis] = Run { samples, positive, ended: false };
            let wrong = UNKNOWN_RATE_SHARE * range;
            let seconds = f64::from(samples) * dt;
            self.slot_mut(k).variance += wrong * wrong * if seconds < 1.0 { seconds } else { 1.0 };
        } else if !clipped && run.samples >= 2 {
            self.runs[axis].ended = true;
        } else {
            self.runs[axis] = Run::NONE;
        }
    }

    /// True if a rate was at the range to date.
    pub fn has_clipped(&self) -> bool {
        self.restored > 0
    }

    /// Restores the unused part of a run; the last sample is the second after it.
    fn restore(&mut self, axis: usize, range: f64, dt: f64, late: u64) {
        let run = self.runs[axis];
        let (n, end) = (u64::from(run.samples), self.count.saturating_sub(2));
        // True if the run and its flanks are no longer stored.
        if n + 6 > SLOTS || end < n + 2 {
            return;
        }
        self.restored += n;
        let (first, sign) = (end - n, if run.positive { 1.0 } else { -1.0 });
        let side = |k: u64| sign * self.slot(k).gyro[axis];
        let cubic =
            Cubic::over(n as usize, [side(first - 2), side(first - 1)], [side(end), side(end + 1)]);
        let beyond = |i: u64| cubic.at(i as usize) - side(first + i);
        let added = (0..n).map(beyond).sum::<f64>() / n as f64;
        let density = density(added, range, n as f64 * dt);
        // The sample reported at the previous sample has been used.
        let unused = (end + 1).saturating_sub(late);
        for k in first.max(unused)..end {
            let (given, fitted) =
                (side_of(self.slot(k), axis, sign), cubic.at((k - first) as usize));
            let most = MAX_RATE_RATIO * range;
            let more = if fitted > given { fitted } else { given };
            let slot = self.slot_mut(k);
            slot.gyro[axis] = sign * if more < most { more } else { most };
            slot.variance = density;
        }
    }

    pub fn is_valid(&self) -> bool {
        is_count(self.count)
            && self.slots.iter().flatten().all(Slot::is_valid)
            && self.last.iter().flatten().all(is_known)
            && self.ages.iter().all(|age| is_size(*age, MAX_TIME_S))
            && self.sides.iter().flatten().all(Side::is_valid)
            && is_count(self.restored)
    }

    /// Samples to date, missing ones included.
    pub fn count(&self) -> u64 {
        self.count
    }
}

fn side_of(slot: &Slot, axis: usize, sign: f64) -> f64 {
    sign * slot.gyro[axis]
}
