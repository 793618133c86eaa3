//! Detection of magnetic disturbance from strength and dip of the field, as in the filter VQF (D.
//! Laidig, T. Seel, *Information Fusion* 91, 2023).

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

/// Largest change of the field's strength, as a share, and of its dip: the cosine of ten degrees.
const MAX_STRENGTH_CHANGE: f64 = 0.1;
const MIN_DIP_COSINE: f64 = 0.984_807_753_012_208;
/// Time constant of the known field, s.
const FIELD_TIME_CONSTANT_S: f64 = 20.0;
/// Seconds within the limits after which the field is trusted again.
const MIN_TRUSTED_S: f64 = 0.5;
/// Time of rotation above a rate, rad/s, in a constant field until it is the known field, s: for
/// any field, and for the first.
const NEW_FIELD_TURN_S: f64 = 20.0;
const FIRST_FIELD_TURN_S: f64 = 5.0;
const MIN_TURN_RATE_RAD_S: f64 = core::f64::consts::PI / 9.0;
/// Time after which a field of constant shape is trusted if no field is known, s.
const MIN_UNCHANGED_S: f64 = 30.0;
/// Longest time for which a disturbed field is not used, s, and factor of its noise afterwards.
const MAX_REJECTION_S: f64 = 60.0;
const DOUBTED_NOISE_FACTOR: f64 = 4.0;
/// Ratio of the rates at which rejection time is recovered in a good field and used.
const REJECTION_DECAY: f64 = 2.0;

/// Largest ratio of a sample's strength to the previous one, and number of samples in a row that
/// agree on another strength until it is accepted: for any field, and for the first.
const MAX_STRENGTH_RATIO: f64 = 2.0;
const MIN_AGREEING_SAMPLES: u8 = 3;
const MIN_FIRST_AGREEING_SAMPLES: u8 = 2;

/// Detects spikes of the field, far stronger or weaker than the previous samples. A magnet
/// approaches over several samples, or stays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Spikes {
    /// Squared strength of the last accepted sample; zero before the first.
    usual: f64,
    /// Squared strength of the last spike, and number of samples in a row that agree with it.
    other: f64,
    count: u8,
}

impl Spikes {
    /// Squared strength of the last accepted sample.
    pub fn last(&self) -> f64 {
        self.usual
    }

    /// Processes a sample; returns true if it is accepted.
    #[inline(always)]
    pub fn pass(&mut self, field: &Vector3<f64>) -> bool {
        let square = field.norm_squared();
        if !is_near(square, self.usual) {
            return self.doubt(square);
        }
        (self.usual, self.count) = (square, 0);
        true
    }

    #[cold]
    #[inline(never)]
    fn doubt(&mut self, square: f64) -> bool {
        self.count = if is_near(square, self.other) { self.count + 1 } else { 1 };
        self.other = square;
        let enough =
            if self.usual > 0.0 { MIN_AGREEING_SAMPLES } else { MIN_FIRST_AGREEING_SAMPLES };
        if self.count < enough {
            return false;
        }
        (self.usual, self.count) = (square, 0);
        true
    }

    pub fn is_valid(&self) -> bool {
        let size = |square: f64| (0.0..=1e20).contains(&square);
        size(self.usual) && size(self.other) && self.count < MIN_AGREEING_SAMPLES
    }
}

/// Angle of rotation, rad, with a constant value after which the value is held; and time after
/// which the magnetometer is stuck, s.
const HELD_ANGLE_RAD: f64 = 0.05;
const STUCK_S: f64 = 2.0;
const MAX_TURN_RAD: f64 = 1e9;

/// Detects a magnetometer with a constant value while the body turns; a held value is not used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// Squared strength of the last tick's last sample, and rotation of the body since it is
    /// constant, rad.
    square: f64,
    turn: Vector3<f64>,
    /// Time for which the value has been constant, s.
    seconds: f64,
}

impl Default for Held {
    fn default() -> Self {
        Self { square: 0.0, turn: Vector3::zeros(), seconds: 0.0 }
    }
}

impl Held {
    /// Processes a tick with a field: the squared strength of its last sample, and the body's
    /// rotation. Returns true if the field has changed.
    pub fn observe(&mut self, square: f64, turned: &Vector3<f64>, span: f64) -> bool {
        let same = core::mem::replace(&mut self.square, square) == square;
        self.turn = if same {
            (self.turn + turned).map(|x| x.clamp(-MAX_TURN_RAD, MAX_TURN_RAD))
        } else {
            Vector3::zeros()
        };
        let news = self.turn.norm_squared() <= HELD_ANGLE_RAD * HELD_ANGLE_RAD;
        self.seconds = if news { 0.0 } else { self.seconds + span };
        news
    }

    /// True if the last tick's field was held.
    pub fn is_held(&self) -> bool {
        self.seconds > 0.0
    }

    /// True if the magnetometer is stuck.
    pub fn is_stuck(&self) -> bool {
        self.seconds >= STUCK_S * (1.0 - 1e-9)
    }

    pub fn is_valid(&self) -> bool {
        (0.0..=1e20).contains(&self.square)
            && self.turn.iter().all(|x| x.abs() <= MAX_TURN_RAD)
            && (0.0..1e18).contains(&self.seconds)
    }
}

/// True if two strengths are equal, compared by their squares.
#[inline(always)]
fn is_near(one: f64, other: f64) -> bool {
    one <= MAX_STRENGTH_RATIO * MAX_STRENGTH_RATIO * other
        && other <= MAX_STRENGTH_RATIO * MAX_STRENGTH_RATIO * one
}

/// Strength and dip of a field: its horizontal part, which is not negative, its downward part, and
/// its size.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Shape {
    level: f64,
    down: f64,
    strength: f64,
}

impl Shape {
    fn of(field: &Vector3<f64>) -> Self {
        let level = ComplexField::sqrt(field.x * field.x + field.y * field.y);
        Self { level, down: -field.z, strength: field.norm() }
    }

    fn is_near(&self, other: &Self) -> bool {
        let along = self.level * other.level + self.down * other.down;
        (self.strength - other.strength).abs() < MAX_STRENGTH_CHANGE * other.strength
            && along > MIN_DIP_COSINE * self.strength * other.strength
    }

    fn follow(&mut self, other: &Self, weight: f64) {
        self.level += weight * (other.level - self.level);
        self.down += weight * (other.down - self.down);
        self.strength += weight * (other.strength - self.strength);
    }

    fn is_valid(&self) -> bool {
        (0.0..=1e10).contains(&self.strength)
            && (0.0..=1e10).contains(&self.level)
            && self.down.abs() <= 1e10
    }
}

/// The known field, and a candidate that may replace it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Magnet {
    known: Option<Shape>,
    candidate: Shape,
    /// Time of rotation in the candidate's field, s, and time for which its shape was constant, s.
    turned: f64,
    stayed: f64,
    /// Time within the limits of the known field, s.
    undisturbed: f64,
    /// Time of rejection that is used, s.
    rejected: f64,
    trusted: bool,
}

impl Default for Magnet {
    fn default() -> Self {
        let candidate = Shape::default();
        Self {
            known: None,
            candidate,
            turned: 0.0,
            stayed: 0.0,
            undisturbed: 0.0,
            rejected: MAX_REJECTION_S,
            trusted: false,
        }
    }
}

impl Magnet {
    /// True if a field is known and the present field differs from it.
    pub fn is_disturbed(&self) -> bool {
        self.known.is_some() && !self.trusted
    }

    /// True if the last field was not used, because it is not the known field.
    pub fn is_ignored(&self) -> bool {
        !self.trusted && self.rejected < MAX_REJECTION_S
    }

    /// True if its direction is evidence of a heading drift: it is the known field, or no field was
    /// ever known and it has been constant.
    pub fn is_believed(&self) -> bool {
        self.trusted || self.known.is_none() && self.stayed >= MIN_UNCHANGED_S
    }

    /// Processes the mean field of this time, s, and the rate, rad/s. Returns the factor of its
    /// direction's variance, or `None` if it must not be used.
    pub fn observe(&mut self, field: &Vector3<f64>, seconds: f64, rate: f64) -> Option<f64> {
        let seen = Shape::of(field);
        self.compare(&seen, seconds);
        self.consider(&seen, seconds, rate);
        if self.trusted {
            self.rejected = (self.rejected - REJECTION_DECAY * seconds).max(0.0);
            return Some(1.0);
        }
        if self.rejected < MAX_REJECTION_S {
            self.rejected += seconds;
            return None;
        }
        Some(DOUBTED_NOISE_FACTOR)
    }

    fn compare(&mut self, seen: &Shape, seconds: f64) {
        let Some(known) = &mut self.known else { return };
        if !seen.is_near(known) {
            (self.undisturbed, self.trusted) = (0.0, false);
            return;
        }
        self.undisturbed += seconds;
        if self.undisturbed >= MIN_TRUSTED_S {
            self.trusted = true;
            known.follow(seen, (seconds / FIELD_TIME_CONSTANT_S).min(1.0));
        }
    }

    /// Accepts a field that is constant while the sensor turns: the earth's field, or the room's.
    fn consider(&mut self, seen: &Shape, seconds: f64, rate: f64) {
        if !seen.is_near(&self.candidate) {
            (self.candidate, self.turned, self.stayed) = (*seen, 0.0, 0.0);
            return;
        }
        self.stayed = (self.stayed + seconds).min(MIN_UNCHANGED_S);
        if rate > MIN_TURN_RATE_RAD_S {
            self.turned += seconds;
        }
        self.candidate.follow(seen, (seconds / FIELD_TIME_CONSTANT_S).min(1.0));
        let needed = if self.known.is_some() { NEW_FIELD_TURN_S } else { FIRST_FIELD_TURN_S };
        if !self.trusted && self.turned >= needed {
            self.known = Some(self.candidate);
            (self.trusted, self.undisturbed) = (true, MIN_TRUSTED_S);
        }
    }

    pub fn is_valid(&self) -> bool {
        let times = [self.turned, self.stayed, self.undisturbed, self.rejected];
        self.known.is_none_or(|known| known.is_valid())
            && self.candidate.is_valid()
            && times.iter().all(|x| (0.0..1e18).contains(x))
    }
}

#[cfg(test)]
mod tests {
    use super::{DOUBTED_NOISE_FACTOR, Magnet, Spikes};
    use nalgebra::Vector3;

    const TICK: f64 = 0.1;
    const TURNING: f64 = 1.0;

    fn earth() -> Vector3<f64> {
        Vector3::new(0.0, 20.0, -40.0)
    }

    /// Result for a field that lasts for this time, at its end.
    fn seen(magnet: &mut Magnet, field: Vector3<f64>, seconds: f64, rate: f64) -> Option<f64> {
        let ticks = (seconds / TICK).round() as usize;
        (0..ticks).map(|_| magnet.observe(&field, TICK, rate)).last().expect("some ticks")
    }

    fn knowing() -> Magnet {
        let mut magnet = Magnet::default();
        assert_eq!(seen(&mut magnet, earth(), 6.0, TURNING), Some(1.0));
        magnet
    }

    #[test]
    fn the_first_field_is_doubted_until_the_sensor_has_turned() {
        let mut magnet = Magnet::default();
        assert_eq!(seen(&mut magnet, earth(), 30.0, 0.1), Some(DOUBTED_NOISE_FACTOR));
        assert_eq!(seen(&mut magnet, earth(), 4.8, TURNING), Some(DOUBTED_NOISE_FACTOR));
        assert!(!magnet.is_disturbed());
        assert_eq!(seen(&mut magnet, earth(), 0.4, TURNING), Some(1.0));
    }

    #[test]
    fn a_spike_is_left_out_and_a_magnet_is_not() {
        fn passed<const N: usize>(strengths: [f64; N]) -> [bool; N] {
            let mut spikes = Spikes::default();
            strengths.map(|x| spikes.pass(&Vector3::new(0.0, x, 0.0)))
        }
        let (yes, no) = (true, false);
        assert_eq!(passed([800.0, 50.0, 51.0, 50.0]), [no, no, yes, yes]);
        assert_eq!(passed([50.0, 50.0, 800.0, 50.0, 1.0, 50.0]), [no, yes, no, yes, no, yes]);
        assert_eq!(passed([50.0, 50.0, 800.0, 800.0, 50.0]), [no, yes, no, no, yes]);
        assert_eq!(passed([50.0, 50.0, 800.0, 800.0, 800.0]), [no, yes, no, no, yes]);
        assert_eq!(passed([50.0, 50.0, 90.0, 170.0, 330.0]), [no, yes, yes, yes, yes]);
    }

    #[test]
    fn strength_and_dip_tell_a_magnet() {
        let turned = |degrees: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let e = earth();
            Vector3::new(0.0, cosine * e.y - sine * e.z, sine * e.y + cosine * e.z)
        };
        let north_elsewhere = Vector3::new(20.0, 0.0, -40.0);
        for near in [earth() * 1.09, earth() * 0.91, turned(9.0), turned(-9.0), north_elsewhere] {
            assert_eq!(knowing().observe(&near, TICK, 0.0), Some(1.0), "{near}");
        }
        for far in [earth() * 1.11, earth() * 0.89, turned(11.0), turned(-11.0), -earth()] {
            let mut magnet = knowing();
            assert_eq!(magnet.observe(&far, TICK, 0.0).is_some(), magnet.rejected >= 60.0, "{far}");
            assert!(magnet.is_disturbed());
        }
    }

    #[test]
    fn a_magnet_is_rejected_for_a_minute_and_then_doubted() {
        let mut magnet = knowing();
        // Rejection time used before the first field was known is recovered twice as fast.
        assert_eq!(seen(&mut magnet, earth(), 40.0, 0.0), Some(1.0));
        assert_eq!(seen(&mut magnet, earth() * 2.0, 59.5, 0.0), None);
        assert_eq!(seen(&mut magnet, earth() * 2.0, 1.0, 0.0), Some(DOUBTED_NOISE_FACTOR));
        // The known field is trusted again after half a second.
        assert_eq!(seen(&mut magnet, earth(), 0.4, 0.0), Some(DOUBTED_NOISE_FACTOR));
        assert_eq!(seen(&mut magnet, earth(), 0.3, 0.0), Some(1.0));
        assert!(!magnet.is_disturbed());
    }

    #[test]
    fn another_room_is_believed_after_twenty_seconds_of_turning() {
        let mut magnet = knowing();
        assert_eq!(seen(&mut magnet, earth(), 40.0, 0.0), Some(1.0));
        assert_eq!(seen(&mut magnet, earth() * 2.0, 19.5, TURNING), None);
        assert_eq!(seen(&mut magnet, earth() * 2.0, 1.0, TURNING), Some(1.0));
        // The old one is now the foreign one.
        assert_eq!(seen(&mut magnet, earth(), 0.1, TURNING), None);
    }
}
