//! Drift of the heading from the magnetic field, after the gyro's bias has jumped along the
//! vertical. Gravity does not show this part of the bias.
//!
//! A magnetometer corrects only the heading. A bias error that neither a rest nor a tilt has shown
//! therefore stays. A drift is certain if a trusted field keeps the heading on one side for ten
//! seconds, or if it remains after errors of field and iron are considered. The heading is then
//! turned back at the rate of the drift. The other states do not change.

use nalgebra::ComplexField;
use serde::{Deserialize, Serialize};

use super::iron::{FRAME_DRIFT_WALK, Turning};
use super::{DEGREE, square};
use crate::math::validity::is_size;

/// Time of the mean innovation, s, and time after which a rest clears it.
const INNOVATION_MEAN_S: f64 = 10.0;
const REST_DECAY_S: f64 = 2.0;
/// Largest rate of a drift, rad/s. A drift makes the innovations a ramp, a field that passes by
/// makes a step.
const MAX_DRIFT_RAD_S: f64 = 2.0 * DEGREE;
/// Number of standard deviations from which a mean is a drift, and smallest standard deviation,
/// rad.
const MIN_MEAN_SIGMAS: f64 = 1.5;
const MIN_MEAN_SIGMA_RAD: f64 = 5.0 * DEGREE;
/// Number of standard deviations of the remaining drift, after field and iron, from which there is
/// a drift.
const MIN_DRIFT_SIGMAS: f64 = 2.0;
/// Random walk of a known drift, rad/s/√s: the walk of a gyro's bias.
const DRIFT_WALK: f64 = 0.01 * DEGREE;
/// Time of rotation at this rate, rad/s, for the average of the field's spread, and initial
/// standard deviation of its direction, rad.
const FIELD_SPREAD_S: f64 = 60.0;
const TURN_RATE_RAD_S: f64 = 20.0 * DEGREE;
const INITIAL_FIELD_SIGMA_RAD: f64 = 3.0 * DEGREE;

/// Spread of the field between places. Iron of a room or of the body shows in the field's
/// horizontal and vertical parts before it shows in its direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FieldSpread {
    level: f64,
    down: f64,
    /// Squared difference of the direction, rad².
    spread: f64,
    seen: bool,
}

impl Default for FieldSpread {
    fn default() -> Self {
        Self {
            level: 0.0,
            down: 0.0,
            spread: INITIAL_FIELD_SIGMA_RAD * INITIAL_FIELD_SIGMA_RAD,
            seen: false,
        }
    }
}

/// Weight in a mean over places of a tick at this rate.
pub fn spread_weight(rate: f64, span: f64) -> f64 {
    (span / FIELD_SPREAD_S * (rate / TURN_RATE_RAD_S).min(1.0)).min(1.0)
}

impl FieldSpread {
    /// Learns from the horizontal and the downward part of a field.
    pub fn observe(&mut self, level: f64, down: f64, weight: f64) {
        if !self.seen {
            (self.level, self.down, self.seen) = (level, down, true);
        }
        self.level += weight * (level - self.level);
        self.down += weight * (down - self.down);
        let apart = square(level - self.level) + square(down - self.down);
        let angle = (apart / (2.0 * self.level * self.level).max(f64::MIN_POSITIVE)).min(1.0);
        self.spread += weight * (angle - self.spread);
    }

    pub fn is_valid(&self) -> bool {
        is_size(self.level, 1e10) && self.down.abs() <= 1e10 && is_size(self.spread, 1.0)
    }
}

/// Drift of the heading, and the dependence of its error on the drift's error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeadingDrift {
    active: bool,
    /// Covariance of the heading with the drift, rad²/s, not positive.
    with_heading: f64,
    /// Part of the innovation that a drift can explain, its mean, rad, and the time since a drift
    /// began, s.
    lag: f64,
    mean: f64,
    since: f64,
    field_spread: FieldSpread,
}

impl Default for HeadingDrift {
    fn default() -> Self {
        let field_spread = FieldSpread::default();
        Self {
            active: false,
            with_heading: 0.0,
            lag: 0.0,
            mean: 0.0,
            since: INNOVATION_MEAN_S,
            field_spread,
        }
    }
}

/// Growth of the variances of heading and drift after a drift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    pub heading: f64,
    pub drift: f64,
}

impl HeadingDrift {
    /// Propagates a heading with this variance through a tick; returns its rotation and the growth
    /// of its variance.
    pub fn predict(&mut self, by: Turning, heading: f64, span: f64) -> (f64, f64) {
        self.since = (self.since + span).min(INNOVATION_MEAN_S);
        if !self.active {
            return (0.0, 0.0);
        }
        let grown = span * (span * by.variance - 2.0 * self.with_heading);
        self.with_heading -= span * by.variance;
        // Fields have made the drift more certain than this covariance.
        let most = ComplexField::sqrt((heading + grown).max(0.0) * by.variance);
        self.with_heading = self.with_heading.max(-most);
        (-span * by.rate, grown)
    }

    /// Tests an innovation: the heading's variance, whether the field can be trusted in motion, and
    /// the drift that remains after field and iron.
    pub fn test(
        &mut self,
        innovation: f64,
        heading: f64,
        believed: bool,
        by: Turning,
        span: f64,
    ) -> Option<Found> {
        let most = MAX_DRIFT_RAD_S * span;
        self.lag += (innovation - self.lag).clamp(-most, most);
        let seen = if believed { self.lag } else { 0.0 };
        self.mean += (span / INNOVATION_MEAN_S).min(1.0) * (seen - self.mean);
        if self.since < INNOVATION_MEAN_S * (1.0 - 1e-9) {
            return None;
        }
        let proven =
            !self.active && square(by.rate) > MIN_DRIFT_SIGMAS * MIN_DRIFT_SIGMAS * by.variance;
        let lags = believed && self.is_one_sided(heading, by.rate);
        if !(proven || lags) {
            return None;
        }
        let found = Found {
            heading: square(self.mean).max(square(self.lag)),
            drift: square(self.mean / INNOVATION_MEAN_S),
        };
        (self.active, self.mean, self.since) = (true, 0.0, 0.0);
        Some(found)
    }

    /// True if innovations lie on one side, further than anything but a drift explains, and if
    /// field and iron leave a drift in this direction.
    fn is_one_sided(&self, heading: f64, rate: f64) -> bool {
        let usual = heading
            .max(MIN_MEAN_SIGMA_RAD * MIN_MEAN_SIGMA_RAD)
            .max(4.0 * self.field_spread.spread);
        self.mean * self.lag > 0.0
            && self.mean * rate <= 0.0
            && self.mean * self.mean > MIN_MEAN_SIGMAS * MIN_MEAN_SIGMAS * usual
    }

    /// Notes that a field has corrected the heading with this gain.
    pub fn correct(&mut self, gain: f64) {
        self.with_heading *= 1.0 - gain;
    }

    /// Notes that the heading's standard deviation was multiplied by this factor at its bound.
    pub fn shrink(&mut self, by: f64) {
        self.with_heading *= by.min(1.0);
    }

    /// True if the heading is being turned back.
    pub fn is_active(&self) -> bool {
        self.active
    }

    /// Random walk of the drift.
    pub fn walk(&self) -> f64 {
        if self.active { DRIFT_WALK } else { FRAME_DRIFT_WALK }
    }

    /// At rest an innovation is no drift.
    pub fn rest(&mut self, span: f64) {
        let kept = (1.0 - span / REST_DECAY_S).max(0.0);
        (self.lag, self.mean) = (kept * self.lag, kept * self.mean);
    }

    /// Ends the drift: the bias of the gyro is known.
    pub fn end(&mut self) {
        (self.active, self.with_heading) = (false, 0.0);
    }

    pub fn field_spread(&mut self) -> &mut FieldSpread {
        &mut self.field_spread
    }

    pub fn is_valid(&self) -> bool {
        (self.with_heading == 0.0 || self.active)
            && is_size(-self.with_heading, 1e3)
            && self.lag.abs() <= 4.0
            && self.mean.abs() <= 4.0
            && is_size(self.since, INNOVATION_MEAN_S)
            && self.field_spread.is_valid()
    }
}

#[cfg(test)]
mod tests {
    use super::{DEGREE, HeadingDrift, square};
    use crate::attitude::auto::iron::Turning;

    const TICK: f64 = 0.1;
    const LAG: f64 = 20.0 * DEGREE;

    /// True if a lasting lag is a drift, for a certain heading, after half a minute. `rate` is the
    /// drift that remains after field and iron, rad/s.
    fn drifts(lag: f64, believed: bool, rate: f64, sigma: f64) -> bool {
        let (mut drift, by) = (HeadingDrift::default(), Turning { rate, variance: square(sigma) });
        (0..300).any(|_| drift.test(lag, 1e-3, believed, by, TICK).is_some())
    }

    #[test]
    fn a_field_on_one_side_is_a_drift_that_way() {
        assert!(drifts(-LAG, true, 0.1 * DEGREE, DEGREE));
        assert!(drifts(LAG, true, -0.1 * DEGREE, DEGREE));
        assert!(!drifts(5.0 * DEGREE, true, -0.1 * DEGREE, DEGREE));
        assert!(!drifts(LAG, false, -0.1 * DEGREE, DEGREE));
    }

    #[test]
    fn a_field_that_iron_explains_is_none() {
        assert!(!drifts(-LAG, true, -0.1 * DEGREE, DEGREE));
        assert!(!drifts(LAG, true, 0.1 * DEGREE, DEGREE));
    }

    #[test]
    fn a_drift_that_is_sure_needs_no_lag() {
        assert!(drifts(0.0, false, 0.5 * DEGREE, 0.24 * DEGREE));
        assert!(!drifts(0.0, false, 0.5 * DEGREE, 0.26 * DEGREE));
    }

    #[test]
    fn a_heading_that_drifts_is_turned_back() {
        let by = Turning { rate: DEGREE, variance: square(0.2 * DEGREE) };
        let mut drift = HeadingDrift::default();
        assert_eq!(drift.predict(by, 1e-3, TICK), (0.0, 0.0));
        drift.test(0.0, 1e-3, true, by, TICK).expect("a drift that is sure");
        let mut variance = 1e-3;
        for _ in 0..100 {
            let (turned, grown) = drift.predict(by, variance, TICK);
            assert!((turned + TICK * DEGREE).abs() < 1e-15);
            variance += grown;
        }
        // Ten seconds at an unknown rate make an unknown angle; other uncertainties are smaller.
        let angle = square(10.0 * 0.2 * DEGREE);
        assert!((variance - 1e-3 - angle).abs() < 1e-12, "{variance} {angle}");
        assert!(drift.is_valid());
        drift.end();
        assert_eq!(drift.predict(by, 1e-3, TICK), (0.0, 0.0));
    }
}
