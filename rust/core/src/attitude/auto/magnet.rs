//! Whether the magnetic field is the one known: by its strength and its dip, as in the filter VQF
//! (D. Laidig, T. Seel, *Information Fusion* 91, 2023).

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

/// How far the strength of the field, as a share of it, and the dip may lie from those known: the
/// cosine of ten degrees.
const STRENGTH: f64 = 0.1;
const DIP: f64 = 0.984_807_753_012_208;
/// Seconds over which the field known follows.
const FOLLOWS: f64 = 20.0;
/// Seconds within the limits after which the field is trusted again.
const TRUSTED: f64 = 0.5;
/// Seconds of rotation above a rate, rad/s, in a field that stays the same, until it is the one
/// known: of any, and of the first.
const NEW: f64 = 20.0;
const FIRST: f64 = 5.0;
const TURNING: f64 = core::f64::consts::PI / 9.0;
/// Seconds for which a disturbed field is not used at all, and how much less it is then used.
const REJECTED: f64 = 60.0;
const DOUBTED: f64 = 4.0;
/// Times faster that the rejection is forgotten in a good field than it lasts.
const FORGOTTEN: f64 = 2.0;

/// Strength and dip of a field: its level part, which is not negative, the one down, and both.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Shape {
    level: f64,
    down: f64,
    strength: f64,
}

impl Shape {
    fn of(field: &Vector3<f64>) -> Self {
        let level = (field.x * field.x + field.y * field.y).sqrt();
        Self { level, down: -field.z, strength: field.norm() }
    }

    fn is_near(&self, other: &Self) -> bool {
        let along = self.level * other.level + self.down * other.down;
        (self.strength - other.strength).abs() < STRENGTH * other.strength
            && along > DIP * self.strength * other.strength
    }

    fn follow(&mut self, other: &Self, weight: f64) {
        self.level += weight * (other.level - self.level);
        self.down += weight * (other.down - self.down);
        self.strength += weight * (other.strength - self.strength);
    }

    fn is_sound(&self) -> bool {
        (0.0..=1e10).contains(&self.strength)
            && (0.0..=1e10).contains(&self.level)
            && self.down.abs() <= 1e10
    }
}

/// The field known, and one that may take its place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Magnet {
    known: Option<Shape>,
    candidate: Shape,
    /// Seconds of rotation in the candidate's field.
    turned: f64,
    /// Seconds within the limits of the field known.
    undisturbed: f64,
    /// Seconds of rejection that are used up.
    rejected: f64,
    trusted: bool,
}

impl Default for Magnet {
    fn default() -> Self {
        let candidate = Shape::default();
        let (turned, undisturbed) = (0.0, 0.0);
        Self { known: None, candidate, turned, undisturbed, rejected: REJECTED, trusted: false }
    }
}

impl Magnet {
    /// Whether a field is known, and the present one is not it.
    pub fn is_disturbed(&self) -> bool {
        self.known.is_some() && !self.trusted
    }

    /// Takes the mean field of so many seconds, and the rate, rad/s; returns by how much the
    /// variance of its direction is larger than usual, or None where it must not be used.
    pub fn observe(&mut self, field: &Vector3<f64>, seconds: f64, rate: f64) -> Option<f64> {
        let seen = Shape::of(field);
        self.compare(&seen, seconds);
        self.consider(&seen, seconds, rate);
        if self.trusted {
            self.rejected = (self.rejected - FORGOTTEN * seconds).max(0.0);
            return Some(1.0);
        }
        if self.rejected < REJECTED {
            self.rejected += seconds;
            return None;
        }
        Some(DOUBTED)
    }

    fn compare(&mut self, seen: &Shape, seconds: f64) {
        let Some(known) = &mut self.known else { return };
        if !seen.is_near(known) {
            (self.undisturbed, self.trusted) = (0.0, false);
            return;
        }
        self.undisturbed += seconds;
        if self.undisturbed >= TRUSTED {
            self.trusted = true;
            known.follow(seen, (seconds / FOLLOWS).min(1.0));
        }
    }

    /// A field that stays the same while the sensor turns is the earth's, or the room's.
    fn consider(&mut self, seen: &Shape, seconds: f64, rate: f64) {
        if !seen.is_near(&self.candidate) {
            (self.candidate, self.turned) = (*seen, 0.0);
            return;
        }
        if rate > TURNING {
            self.turned += seconds;
        }
        self.candidate.follow(seen, (seconds / FOLLOWS).min(1.0));
        let needed = if self.known.is_some() { NEW } else { FIRST };
        if !self.trusted && self.turned >= needed {
            self.known = Some(self.candidate);
            (self.trusted, self.undisturbed) = (true, TRUSTED);
        }
    }

    pub fn is_sound(&self) -> bool {
        let times = [self.turned, self.undisturbed, self.rejected];
        self.known.is_none_or(|known| known.is_sound())
            && self.candidate.is_sound()
            && times.iter().all(|x| (0.0..1e18).contains(x))
    }
}
