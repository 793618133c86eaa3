//! A sensor on a foot, aided only by zero velocities in stances.
//!
//! This is the [`NavigationFilter`](super::NavigationFilter) over a plane without rotation, with
//! one more aid: zero velocity in the minima of a speed bound. The bound also gives the noise of
//! the zero velocity. For a whole recording ([`Walk`]) the minima are searched on their two sides,
//! and clipped rates are found. The live form ([`FootFilter`]) knows only earlier samples, and is
//! late by a window of the bound.
//!
//! E. Foxlin, *IEEE Computer Graphics and Applications* 25(6), 2005. I. Skog, P. Händel, J.-O.
//! Nilsson, J. Rantakokko, *IEEE Trans. Biomedical Engineering* 57(11), 2010.

mod beginning;
#[cfg(feature = "std")]
mod bound;
#[cfg(feature = "std")]
mod clip;
mod cubic;
mod lead;
mod live;
#[cfg(feature = "std")]
mod plan;
mod ranges;
mod recent;
#[cfg(feature = "std")]
mod static_intervals;
mod still;
mod swing;
#[cfg(feature = "std")]
mod walk;
mod walker;

#[cfg(feature = "std")]
pub use clip::{Clipped, restore_clipped};
pub use lead::{Stand, go_back};
pub use live::{FootFilter, FootParams};
#[cfg(feature = "std")]
pub use plan::{Feet, Plan, Stance};
#[cfg(feature = "std")]
pub use static_intervals::StaticInterval;
pub use swing::Swing;
#[cfg(feature = "std")]
pub use walk::{Trodden, Walk};

/// One degree, rad.
const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// Gravity of the plane, m/s².
const GRAVITY: f64 = 9.81;
/// Largest difference of a force from gravity, m/s².
const MAX_GRAVITY_ERROR_M_S2: f64 = 0.3;
/// Time between two steps of the covariance, s.
const STEP_S: f64 = 0.02;
/// Half a window of the bound, s.
const HALF_WINDOW_S: f64 = 0.025;
/// Half a window of the force for levelling, s.
#[cfg(feature = "std")]
const HALF_LEVEL_S: f64 = 0.05;
/// Distance from the pivot to the sensor, m, and duration of a force, s.
const PIVOT_DISTANCE_M: f64 = 0.1;
const FORCE_S: f64 = 0.0175;
/// Limits of a minimum that is a stance: ratio to the lowest bound nearby, and speed, m/s.
const MAX_VALLEY_RATIO: f64 = 2.0;
const MIN_VALLEY_SPEED_M_S: f64 = 0.01;
const MAX_VALLEY_SPEED_M_S: f64 = 0.5;
/// Smallest interval between two stances, s; closer stances are one stance.
const MIN_STANCE_INTERVAL_S: f64 = 0.15;
/// Latest begin of the first rest, s.
const MAX_FIRST_REST_S: f64 = 1.5;
/// Longest time for which the last sample replaces missing samples, s.
const MAX_HELD_S: f64 = 0.1;
/// Smallest sample rate, Hz.
const MIN_RATE_HZ: f64 = 1.0 / 0.021;

/// Number of samples in this time, at least one; halves are rounded to even.
fn samples_in(seconds: f64, dt: f64) -> usize {
    let count = seconds / dt;
    let whole = count as usize;
    let part = count - whole as f64;
    let up = part > 0.5 || (part == 0.5 && !whole.is_multiple_of(2));
    (whole + usize::from(up)).max(1)
}

/// True if the foot may stand at this bound, with the lowest bound nearby.
fn may_stand(bound: f64, low: f64) -> bool {
    bound < MAX_VALLEY_RATIO * if low > MIN_VALLEY_SPEED_M_S { low } else { MIN_VALLEY_SPEED_M_S }
        && bound < MAX_VALLEY_SPEED_M_S
}

/// Runs without a break in which a condition is true: first index and end (exclusive).
#[cfg(feature = "std")]
fn runs(n: usize, holds: impl Fn(usize) -> bool) -> impl Iterator<Item = (usize, usize)> {
    let mut k = 0;
    core::iter::from_fn(move || {
        while k < n && !holds(k) {
            k += 1;
        }
        let first = k;
        while k < n && holds(k) {
            k += 1;
        }
        (first < k).then_some((first, k))
    })
}
