//! The filter that learns a magnetometer's hard iron while it runs.
//!
//! The gyro determines how a constant field must rotate in the sensor; a part that does not rotate
//! is iron. The method is the method for a record in [`magnet`](crate::calibrate::magnet), but
//! forward only. Four filters of hard iron and field begin at different seconds, and one path leads
//! through them. A hard iron is subtracted once the remaining scatter is small enough for a room.
//! Until then the result is bit-identical to the filter without learning.

mod choice;
mod learner;
mod sums;
mod ticks;

use nalgebra::{ComplexField, Quaternion, Vector3};
use serde::{Deserialize, Serialize};

use self::choice::{Choice, Taken};
use self::learner::{Learner, Present};
use self::ticks::Gathered;
#[cfg(feature = "std")]
use super::Around;
use super::auto::Ticked;
use super::compass::FieldCorrection;
use super::named::Named;
use super::stream::Tagged;
use super::{Auto, Estimator, Inertial, Knowledge, NamedOptions};
use crate::error::Error;
use crate::math::validity::are_within;

/// Smallest change of a hard iron, as a share of the field's size, that is a new shape of the
/// field.
const MIN_SHAPE_CHANGE: f64 = 0.1;
/// Largest heading change by a hard iron that is reversed, rad. Its square, which is not reversed,
/// is two degrees.
const MAX_REVERSED_TURN_RAD: f64 = 0.25;

/// Estimate of a magnetometer's hard iron, in the samples' unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearnedIron {
    /// Vector subtracted from each sample; zero for none.
    pub value: Vector3<f64>,
    /// Standard deviation of `value`, NaN before it is known.
    pub sigma: Vector3<f64>,
    /// Use of the magnetometer: "raw", "known", "kept" or "withheld".
    pub state: &'static str,
}

/// The filter with a magnetometer; it learns and subtracts the magnetometer's hard iron.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Learning {
    auto: Auto,
    correction: Option<FieldCorrection>,
    gathered: Gathered,
    learner: Learner,
    choice: Choice,
    /// Subtracted hard iron, in the samples' unit.
    iron: Option<Vector3<f64>>,
}

impl Learning {
    /// A filter before its first sample, with a calibration if there is one.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a number of the calibration is out of range.
    pub fn new(auto: Auto, correction: Option<FieldCorrection>) -> Result<Self, Error> {
        let correction = correction.map(FieldCorrection::validate).transpose()?;
        Ok(Self::with(auto, correction))
    }

    fn with(auto: Auto, correction: Option<FieldCorrection>) -> Self {
        Self {
            auto,
            correction,
            gathered: Gathered::default(),
            learner: Learner::default(),
            choice: Choice::default(),
            iron: None,
        }
    }

    /// The calibration.
    pub fn correction(&self) -> Option<&FieldCorrection> {
        self.correction.as_ref()
    }

    /// The estimate of the hard iron.
    pub fn iron(&self) -> LearnedIron {
        let variances = self.choice.iron.covariance.diagonal() * self.square_of_norm();
        let state = match self.choice.taken {
            Taken::Raw => "raw",
            Taken::Known => "known",
            Taken::Kept => "kept",
            Taken::Withheld => "withheld",
        };
        let sigma = match self.iron {
            None => Vector3::repeat(f64::NAN),
            Some(_) => variances.map(|x| ComplexField::sqrt(x.max(0.0))),
        };
        LearnedIron { value: self.iron.unwrap_or_default(), sigma, state }
    }

    fn square_of_norm(&self) -> f64 {
        self.learner.norm() * self.learner.norm()
    }

    /// The field for the filter, from a calibrated sample.
    #[inline(always)]
    fn left(&self, field: Vector3<f64>) -> Option<Vector3<f64>> {
        if self.choice.taken == Taken::Withheld {
            return None;
        }
        Some(match &self.iron {
            None => field,
            Some(iron) => field - iron,
        })
    }

    #[inline(never)]
    fn tick(&mut self, ticked: &Ticked) {
        if let Some(heading_correction) = &ticked.heading_correction {
            self.learner.correct_heading(heading_correction, &self.choice.iron.value);
        }
        // A constant reading contains no information on iron.
        let tick = self.gathered.end().filter(|_| !ticked.held);
        let before = (self.choice.taken, self.choice.iron.value);
        let Some(present) = self.learner.take(tick, ticked.seconds) else { return };
        self.choice.decide(&self.learner, present, 1.0);
        if matches!(self.choice.taken, Taken::Known | Taken::Kept) {
            self.take_off(&before.1);
            self.take_back(present);
        }
    }

    /// Subtracts another hard iron from now on.
    fn take_off(&mut self, before: &Vector3<f64>) {
        let value = self.choice.iron.value;
        self.iron = Some(value * self.learner.norm());
        if (value - before).norm() > MIN_SHAPE_CHANGE {
            self.auto.forget_field();
        }
    }

    /// Corrects the heading as if this hard iron had been subtracted since the span began.
    fn take_back(&mut self, present: Present) {
        let Present::Of(index) = present else { return };
        let Some(start) = self.learner.start(index) else { return };
        let turned = start.turn_by_iron(&self.choice.iron.value);
        if turned.abs() > MAX_REVERSED_TURN_RAD {
            self.auto.find_heading();
            self.learner.forget_heading();
        } else if turned != 0.0 {
            self.auto.turn_heading(-turned);
            self.learner.turn(-turned);
        }
    }

    fn interrupt(&mut self) {
        self.gathered.interrupt();
        self.learner.interrupt();
        self.choice.interrupt();
    }
}

impl Estimator for Learning {
    #[inline(always)]
    fn step(&mut self, sample: &Inertial) {
        let field = match &self.correction {
            None => sample.mag,
            Some(correction) => sample.mag.as_ref().map(|mag| correction.of(mag)),
        };
        let mag = field.and_then(|field| self.left(field));
        let ticked = self.auto.follow(&Inertial { mag, ..*sample });
        if let Some(field) = &field {
            self.gathered.add(field, self.auto.held());
        }
        if let Some(ticked) = ticked {
            self.tick(&ticked);
        }
    }

    fn gap(&mut self, seconds: f64) {
        self.auto.gap(seconds);
        self.interrupt();
    }

    #[inline(always)]
    fn orientation(&self) -> Quaternion<f64> {
        self.auto.orientation()
    }

    fn knowledge(&self) -> Knowledge {
        let mut known = self.auto.knowledge();
        if self.iron.is_some() {
            let by_iron =
                self.auto.heading_by(&self.choice.iron.covariance) * self.square_of_norm();
            let own = known.heading_sigma * known.heading_sigma;
            known.heading_sigma = ComplexField::sqrt(own + by_iron.min(10.0));
        }
        known
    }

    fn align(&mut self, orientation: Quaternion<f64>, tilt_sigma: f64, heading_sigma: f64) {
        self.auto.align(orientation, tilt_sigma, heading_sigma);
        self.interrupt();
    }

    fn reset(&mut self) {
        self.auto.reset();
        *self = Self::with(self.auto, self.correction);
    }

    fn power_on(&mut self) {
        self.auto.power_on();
        *self = Self::with(self.auto, self.correction);
    }

    fn is_valid(&self) -> bool {
        let iron = self.iron.is_none_or(|iron| are_within(&iron, 1e16));
        self.correction.is_none_or(|one| one.validate().is_ok())
            && self.auto.is_valid()
            && self.gathered.is_valid()
            && self.learner.is_valid()
            && self.choice.is_valid()
            && iron
    }

    fn is_like(&self, other: &Self) -> bool {
        self.correction == other.correction && self.auto.is_like(&other.auto)
    }
}

impl Tagged for Learning {
    const TAG: &'static str = "attitude-iron";
    const VERSION: u16 = 4;
}

impl Named for Learning {
    const METHOD: &'static str = Auto::METHOD;

    fn options(&self) -> NamedOptions {
        Named::options(&self.auto)
    }

    fn is_calibrated(&self) -> bool {
        self.auto.is_calibrated()
    }

    fn bias_limit(&self) -> Option<f64> {
        self.auto.bias_limit()
    }

    fn correction(&self) -> Option<&FieldCorrection> {
        self.correction.as_ref()
    }

    fn iron(&self) -> Option<LearnedIron> {
        Some(Self::iron(self))
    }
}

#[cfg(feature = "std")]
impl Around for Learning {
    fn auto(&self) -> &Auto {
        &self.auto
    }

    fn field(&self, mag: [f64; 3]) -> [f64; 3] {
        let field = Vector3::from(mag);
        let field = self.correction.map_or(field, |correction| correction.of(&field));
        self.left(field).unwrap_or(Vector3::repeat(f64::NAN)).into()
    }
}
