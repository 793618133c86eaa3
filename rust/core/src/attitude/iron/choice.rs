//! Choice of the hard iron to subtract: the present span's, a remembered one, or none. The field
//! may also be withheld.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::learner::{Learner, Present, Start};
use super::sums::{apart, known_part, root};
use crate::math::validity::{are_within, is_size};

/// Time, s, after which a span determines its hard iron, and number of directions that must be
/// known.
const MIN_SPAN_S: f64 = 5.0;
const MIN_DIRECTIONS: usize = 2;
/// Largest share of the scatter that remains with a hard iron: at its first use, while in use, and
/// by its size in standard deviations from zero. A room leaves a tenth of the field, no room a
/// quarter.
const MAX_FIRST_SCATTER: f64 = 0.40;
const MAX_USED_SCATTER: f64 = 0.60;
const IRON_SIZES: [f64; 2] = [0.10, 0.25];
const MAX_LARGE_SCATTER: f64 = 0.7;
const MIN_LARGE_DISTANCE: f64 = 25.0;
/// Largest squared distance of two estimates of the same hard iron.
const MAX_SAME_DISTANCE: f64 = 16.0;
/// Smallest ratio of scatters at which another hard iron replaces the present hard iron.
const MIN_SCATTER_RATIO: f64 = 1.1;
/// Largest distance of the field from the last known field, for an undecided span.
const MAX_FIELD_CHANGE: f64 = 0.15;
/// Weakest field; a weaker constant vector in the sensor is no field.
const NONE: f64 = 0.1;
/// Longest time for which the field is withheld, s.
const MAX_WITHHELD_S: f64 = 60.0;
/// Number of remembered hard irons.
const REMEMBERED_IRONS: usize = 5;
/// Largest element of a hard iron.
const MAX_IRON: f64 = 1e6;

/// Use of the magnetometer.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Taken {
    /// No hard iron is known: samples are used unchanged.
    #[default]
    Raw,
    /// The hard iron is known from the present motion and subtracted.
    Known,
    /// A remembered hard iron or none is subtracted, whichever continues the field.
    Kept,
    /// No hard iron explains the field, and the field is not used.
    Withheld,
}

/// A hard iron and its covariance, in units of the field's size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Iron {
    pub value: Vector3<f64>,
    pub covariance: Matrix3<f64>,
}

impl Iron {
    const NONE: Self = Self {
        value: Vector3::new(0.0, 0.0, 0.0),
        covariance: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    fn is_valid(&self) -> bool {
        are_within(&self.value, MAX_IRON) && are_within(&self.covariance, MAX_IRON)
    }
}

/// The choice and its data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    pub taken: Taken,
    pub iron: Iron,
    remembered: [Option<Iron>; REMEMBERED_IRONS],
    next: usize,
    /// Last known field, in the frame of the gyro.
    field: Option<Vector3<f64>>,
    withheld: f64,
}

impl Default for Choice {
    fn default() -> Self {
        Self {
            taken: Taken::Raw,
            iron: Iron::NONE,
            remembered: [None; REMEMBERED_IRONS],
            next: 0,
            field: None,
            withheld: 0.0,
        }
    }
}

impl Choice {
    /// Notes that the frame of the gyro has changed.
    pub fn interrupt(&mut self) {
        self.field = None;
    }

    /// Decides by the verdict on a second.
    pub fn decide(&mut self, learner: &Learner, present: Present, seconds: f64) {
        let start = match present {
            Present::Nothing => return,
            Present::Outlier => return self.withhold(seconds),
            Present::Of(index) => learner.start(index),
        };
        let Some(start) = start else { return };
        if start.age < MIN_SPAN_S {
            return self.keep(start, seconds);
        }
        let value = start.iron();
        let covariance = start.sums.covariance(&value, start.age);
        let (directions, value) = known_part(&value, &covariance);
        if directions < MIN_DIRECTIONS {
            return self.keep(start, seconds);
        }
        let iron = Iron { value, covariance };
        if !self.pays(start, &iron) {
            return self.least(start);
        }
        if start.sums.field(&value).norm() < NONE {
            self.taken = Taken::Withheld;
            return;
        }
        self.remember(&iron);
        (self.taken, self.iron, self.withheld) = (Taken::Known, iron, 0.0);
        self.field = Some(start.sums.field(&value));
    }

    /// True if the scatter with a hard iron is small enough for a magnetic field in a room.
    fn pays(&self, start: &Start, iron: &Iron) -> bool {
        let raw = root(start.sums.variance(&Vector3::zeros()));
        let left = root(start.sums.variance(&iron.value));
        let usual = if self.taken == Taken::Known { MAX_USED_SCATTER } else { MAX_FIRST_SCATTER };
        let share = (iron.value.norm() - IRON_SIZES[0]) / (IRON_SIZES[1] - IRON_SIZES[0]);
        let large =
            MAX_FIRST_SCATTER + (MAX_LARGE_SCATTER - MAX_FIRST_SCATTER) * share.clamp(0.0, 1.0);
        left < usual * raw
            || left < large * raw && apart(&iron.value, &iron.covariance) > MIN_LARGE_DISTANCE
    }

    fn remember(&mut self, iron: &Iron) {
        let same = |one: &Iron| {
            apart(&(one.value - iron.value), &(one.covariance + iron.covariance))
                < MAX_SAME_DISTANCE
        };
        for known in self.remembered.iter_mut().flatten() {
            if same(known) {
                if iron.covariance.trace() < 1.5 * known.covariance.trace() {
                    *known = *iron;
                }
                return;
            }
        }
        self.remembered[self.next] = Some(*iron);
        self.next = (self.next + 1) % REMEMBERED_IRONS;
    }

    fn is_learned(&self) -> bool {
        self.remembered.iter().any(Option::is_some)
    }

    /// The cheapest of none and the remembered hard irons, with its cost; the one in use comes
    /// first.
    fn cheapest(&self, cost: impl Fn(&Vector3<f64>) -> f64, stays: f64) -> (Iron, f64) {
        let (mut found, mut least) = (self.iron, cost(&self.iron.value) / stays);
        for one in self.remembered.iter().flatten().chain([&Iron::NONE]) {
            let its = cost(&one.value);
            if its < least {
                (found, least) = (*one, its);
            }
        }
        (found, least)
    }

    /// Handles a span that determines its hard iron, if the scatter remains too large.
    fn least(&mut self, start: &Start) {
        if !self.is_learned() {
            self.taken = Taken::Raw;
            return;
        }
        let (found, _) = self.cheapest(|iron| root(start.sums.variance(iron)), MIN_SCATTER_RATIO);
        (self.taken, self.iron, self.withheld) = (Taken::Kept, found, 0.0);
        self.field = Some(start.sums.field(&found.value));
    }

    /// Handles an undecided span: uses the hard iron that continues the field.
    fn keep(&mut self, start: &Start, seconds: f64) {
        if !self.is_learned() {
            self.taken = Taken::Raw;
            return;
        }
        let Some(field) = self.field else {
            self.taken = Taken::Kept;
            return;
        };
        let (found, apart) = self.cheapest(|iron| (start.sums.field(iron) - field).norm(), 1.0);
        if apart > MAX_FIELD_CHANGE {
            return self.withhold(seconds);
        }
        (self.taken, self.iron, self.withheld) = (Taken::Kept, found, 0.0);
    }

    fn withhold(&mut self, seconds: f64) {
        if !self.is_learned() {
            self.taken = Taken::Raw;
            return;
        }
        self.withheld = (self.withheld + seconds).min(MAX_WITHHELD_S);
        self.taken = if self.withheld < MAX_WITHHELD_S { Taken::Withheld } else { Taken::Kept };
    }

    pub fn is_valid(&self) -> bool {
        self.iron.is_valid()
            && self.remembered.iter().flatten().all(Iron::is_valid)
            && self.next < REMEMBERED_IRONS
            && self.field.is_none_or(|field| are_within(&field, MAX_IRON))
            && is_size(self.withheld, MAX_WITHHELD_S)
    }
}
