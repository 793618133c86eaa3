//! A sensor on a foot: the only aid is that now and then it stands.
//!
//! The [`NavigationFilter`](super::NavigationFilter) over a plane that does not turn, with one more
//! aid: zero velocity in the valleys of a bound of the speed, whose noise is of the same bound. A
//! whole recording is looked at first: rates that a gyro clipped are restored, stances and rests are
//! found; then the filter runs over it.
//!
//! E. Foxlin, *IEEE Computer Graphics and Applications* 25(6), 2005. I. Skog, P. Händel, J.-O.
//! Nilsson, J. Rantakokko, *IEEE Trans. Biomedical Engineering* 57(11), 2010.

mod bound;
mod clip;
mod plan;
mod rests;
mod walk;

pub use clip::{Clipped, restore_clipped};
pub use plan::{Feet, Plan, Stance};
pub use rests::Rest;
pub use walk::{Trodden, Walk};

/// One degree, rad.
const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// Gravity of the plane, m/s².
const GRAVITY: f64 = 9.81;

/// The samples in so many seconds, one at least.
fn samples_in(seconds: f64, dt: f64) -> usize {
    let count = (seconds / dt).round_ties_even();
    if count >= 1.0 { count as usize } else { 1 }
}

/// Where something holds without a break: first and past the last.
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
