//! A sensor on a foot, aided only by zero velocities in stances.
//!
//! The [`NavigationFilter`](super::NavigationFilter) over a plane that does not turn, with one more
//! aid: zero velocity in the valleys of a bound of the speed, whose noise is of the same bound. Of
//! a whole recording ([`Walk`]) the valleys are seen from both sides, and rates that a gyro clipped
//! are found; live ([`FootFilter`]) from behind, a window of the bound late.
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
/// Of a force that is gravity's, m/s².
const MAX_GRAVITY_ERROR_M_S2: f64 = 0.3;
/// Between two steps of the covariance, s.
const STEP_S: f64 = 0.02;
/// Half a window of the bound, s.
const HALF_WINDOW_S: f64 = 0.025;
/// Half a window of the force that levels, s.
#[cfg(feature = "std")]
const HALF_LEVEL_S: f64 = 0.05;
/// From the pivot to the sensor, m, and for how long a force lasts, s.
const PIVOT_DISTANCE_M: f64 = 0.1;
const FORCE_S: f64 = 0.0175;
/// A valley: how far above the lowest bound round about, and above which speed, none is a stance,
/// m/s.
const MAX_VALLEY_RATIO: f64 = 2.0;
const MIN_VALLEY_SPEED_M_S: f64 = 0.01;
const MAX_VALLEY_SPEED_M_S: f64 = 0.5;
/// Two stances less than this apart, s, are one.
const MIN_STANCE_INTERVAL_S: f64 = 0.15;
/// The first rest begins within so many seconds.
const MAX_FIRST_REST_S: f64 = 1.5;
/// A missing sample is the last one for so long, s.
const MAX_HELD_S: f64 = 0.1;
/// Fewest samples per second.
const MIN_RATE_HZ: f64 = 1.0 / 0.021;

/// The samples in so many seconds, one at least; halves to even.
fn samples_in(seconds: f64, dt: f64) -> usize {
    let count = seconds / dt;
    let whole = count as usize;
    let part = count - whole as f64;
    let up = part > 0.5 || (part == 0.5 && !whole.is_multiple_of(2));
    (whole + usize::from(up)).max(1)
}

/// True if the foot may stand where the bound is so, with the lowest one round about.
fn may_stand(bound: f64, low: f64) -> bool {
    bound < MAX_VALLEY_RATIO * if low > MIN_VALLEY_SPEED_M_S { low } else { MIN_VALLEY_SPEED_M_S }
        && bound < MAX_VALLEY_SPEED_M_S
}

/// Runs in which something holds without a break: first and past the last.
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
