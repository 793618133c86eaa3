//! Search of stances and rests in a whole recording, before the filter runs.

use nalgebra::Vector3;

use super::beginning::{AtRest, Beginning, is_gravity};
use super::bound::bound;
use super::clip::{Clipped, restore_clipped};
use super::lead::{Stand, go_back};
use super::static_intervals::{StaticInterval, find};
use super::{
    GRAVITY, HALF_LEVEL_S, MAX_FIRST_REST_S, MAX_HELD_S, MAX_VALLEY_RATIO, MIN_RATE_HZ,
    MIN_STANCE_INTERVAL_S, MIN_VALLEY_SPEED_M_S, STEP_S, may_stand, samples_in,
};
use crate::error::{Error, require};
use crate::math::Real;
use crate::memory;
use crate::navigation::filter::MAX_SAMPLE;

/// Time around a sample in which the lowest bound is searched, s.
const NEIGHBOURHOOD_S: f64 = 0.7;

/// Without a rest the filter begins in a stance of this time, s.
const START_S: f64 = 3.0;
/// Longest time of backward integration before it, s.
const MAX_LEAD_S: f64 = 3.0;

/// Parameters of the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Feet {
    /// True if the floor is level, except for steps.
    pub level: bool,
    /// True if rates that the gyro clipped are restored.
    pub restore: bool,
}

/// Stance of the foot, in nodes of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stance {
    /// First sample and end (exclusive).
    pub samples: (usize, usize),
    /// Index of the lowest bound.
    pub lowest: usize,
}

/// A recording with known stances and rests.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Rates, rad/s, restored if they were clipped, and forces, m/s²; missing samples are replaced
    /// by the last ones.
    pub gyro: Vec<[f64; 3]>,
    /// See `gyro`.
    pub accel: Vec<[f64; 3]>,
    /// Error of restored rates: density of a white noise, rad²/s.
    pub variance: Vec<f64>,
    /// The speed bound, m/s.
    pub bound: Vec<f64>,
    /// Clipped runs.
    pub clipped: Vec<Clipped>,
    /// Static intervals in order, including an interval at the start.
    pub static_intervals: Vec<StaticInterval>,
    /// Possible stances, accepted by the filter or not.
    pub stances: Vec<Stance>,
    /// Sample at which the filter begins, and first known sample before it.
    pub begin: (usize, usize),
    /// True for each node in a stance.
    pub(super) stands: Vec<bool>,
    /// Mean time between samples, s.
    pub(super) dt: f64,
    /// Number of samples between two nodes.
    pub(super) every: usize,
    pub(super) beginning: Beginning,
    /// True if the first static interval is at the start.
    pub(super) rested: bool,
}

impl Plan {
    /// Number of samples between two nodes.
    pub fn every(&self) -> usize {
        self.every
    }

    /// Mean force within `half` seconds of a sample.
    pub(super) fn force(&self, k: usize, half: f64) -> Vector3<f64> {
        mean_about(&self.accel, k, samples_in(half, self.dt))
    }

    /// Searches a recording of n samples: times, s, increasing; rates, rad/s, and forces, m/s², NaN
    /// if missing.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the recording is shorter than a second or no sample is known;
    /// [`Error::Memory`] if there is no memory.
    pub fn of(
        time: &[f64],
        gyro: &[[f64; 3]],
        accel: &[[f64; 3]],
        feet: &Feet,
    ) -> Result<Self, Error> {
        let n = time.len().min(gyro.len()).min(accel.len());
        let seconds = if n > 1 { time[n - 1] - time[0] } else { 0.0 };
        require(seconds >= 1.0, "time", "over a second or more", seconds)?;
        let dt = seconds / (n - 1) as f64;
        require(1.0 / dt >= MIN_RATE_HZ, "time", "of 48 samples a second or more", 1.0 / dt)?;
        let (mut gyro, lost) = fill_gaps(time, gyro)?;
        let (accel, missed) = fill_gaps(time, accel)?;
        let mut variance = memory::filled(0.0, n)?;
        let clipped =
            if feet.restore { restore_clipped(&mut gyro, dt, &mut variance)? } else { Vec::new() };
        let unbiased = AtRest { gyro_bias: Vector3::zeros(), force: usual_force(&accel, dt)? };
        let is_lost = |k: usize| lost[k] || missed[k];
        let known = |mut bound: Vec<f64>| {
            (0..n).filter(|k| is_lost(*k)).for_each(|k| bound[k] = f64::INFINITY);
            bound
        };
        let mut bound_ = known(bound(&gyro, &accel, dt, &unbiased)?);
        let mut static_intervals = find(&bound_, &gyro, dt, 0)?;
        let first = static_intervals
            .first()
            .copied()
            .filter(|rest| rest.samples.0 as f64 * dt < MAX_FIRST_REST_S);
        let mut rested = None;
        if let Some(rest) = first {
            let force = mean(&accel[rest.samples.0..rest.samples.1]);
            let beginning = Beginning::at_rest(&force, &rest.rate, rest.sigma);
            rested = Some(beginning);
            let force = force_of(mean(&accel[rest.samples.0..rest.samples.1]).norm(), &unbiased);
            let at_rest = AtRest { gyro_bias: beginning.gyro_bias, force };
            bound_ = known(bound(&gyro, &accel, dt, &at_rest)?);
            static_intervals = find(&bound_, &gyro, dt, rest.samples.1)?;
            memory::reserve(&mut static_intervals, 1)?;
            static_intervals.insert(0, rest);
        }
        let every = samples_in(STEP_S, dt);
        let stands = standing(&bound_, every, samples_in(NEIGHBOURHOOD_S, dt))?;
        let stances = join_stances(&stands, &bound_, every, dt)?;
        let (begin, beginning) = match rested {
            Some(beginning) => ((0, 0), beginning),
            None => in_valley(time, [&gyro, &accel], &bound_, &stances, (dt, every)),
        };
        Ok(Self {
            gyro,
            accel,
            variance,
            bound: bound_,
            clipped,
            static_intervals,
            stances,
            begin,
            stands,
            dt,
            every,
            beginning,
            rested: first.is_some(),
        })
    }
}

/// The samples, with missing samples replaced by the last known sample, and before it by the first.
/// The mask marks replacements older than a tenth of a second.
fn fill_gaps(time: &[f64], given: &[[f64; 3]]) -> Result<(Vec<[f64; 3]>, Vec<bool>), Error> {
    let is_known = |v: &[f64; 3]| v.iter().all(|x| x.abs() <= MAX_SAMPLE);
    let first = given.iter().position(is_known);
    require(first.is_some(), "gyro and accel", "arrays with a finite sample each", f64::NAN)?;
    let first = first.unwrap_or(0);
    let (mut values, mut lost) = (memory::room(given.len())?, memory::room(given.len())?);
    let mut last = first;
    for k in 0..given.len().min(time.len()) {
        if is_known(&given[k]) {
            last = k;
        }
        values.push(given[last]);
        lost.push((time[k] - time[last]).abs() > MAX_HELD_S);
    }
    Ok((values, lost))
}

/// Median size of the force in the first half second, if it can be gravity.
fn usual_force(accel: &[[f64; 3]], dt: f64) -> Result<f64, Error> {
    let count = samples_in(0.5, dt).min(accel.len());
    let mut median = Vector3::zeros();
    for axis in 0..3 {
        let mut values = memory::room(count)?;
        values.extend(accel[..count].iter().map(|force| force[axis]));
        values.sort_unstable_by(f64::total_cmp);
        median[axis] = 0.5 * (values[count / 2] + values[(count - 1) / 2]);
    }
    let size = median.norm();
    Ok(if is_gravity(size) { size } else { GRAVITY })
}

fn force_of(size: f64, unbiased: &AtRest) -> f64 {
    if is_gravity(size) { size } else { unbiased.force }
}

fn mean(forces: &[[f64; 3]]) -> Vector3<f64> {
    forces.iter().map(|force| Vector3::from(*force)).sum::<Vector3<f64>>() / forces.len() as f64
}

/// Beginning without a rest: the sample at which the filter begins, the first known sample before
/// it, and the initial state.
fn in_valley(
    time: &[f64],
    [gyro, accel]: [&[[f64; 3]]; 2],
    bound: &[f64],
    stances: &[Stance],
    (dt, every): (f64, usize),
) -> ((usize, usize), Beginning) {
    let within = |stance: &&Stance| time[stance.lowest] - time[0] < START_S;
    let low = stances.iter().filter(within).fold(f64::INFINITY, |low, s| low.min(bound[s.lowest]));
    let most = MAX_VALLEY_RATIO * low.max(MIN_VALLEY_SPEED_M_S);
    let stance = stances.iter().find(|stance| bound[stance.lowest] < most);
    let (begin, first) = match stance {
        Some(stance) => {
            let early = |k: &usize| time[stance.lowest] - time[*k] > MAX_LEAD_S;
            (stance.lowest, (0..stance.lowest).take_while(early).count())
        }
        // The foot never stands: only the slowest sample is known.
        None => (0, 0),
    };
    let window = samples_in(1.0, dt).min(bound.len());
    let least = || (0..window).min_by(|i, j| bound[*i].total_cmp(&bound[*j])).unwrap_or(0);
    let level = if stance.is_some() { begin } else { least() };
    let force = mean_about(accel, level, samples_in(HALF_LEVEL_S, dt));
    let mut beginning = Beginning::in_valley(&force, bound[level], every as f64 * dt);
    let stand = Stand {
        attitude: beginning.attitude,
        gyro_bias: beginning.gyro_bias,
        accel_bias: beginning.accel_bias,
    };
    let lead = first..begin + 1;
    let mut earliest = None;
    let given = [&gyro[lead.clone()], &accel[lead.clone()]];
    go_back(&time[lead], given, &stand, |_, _, _, turn| earliest = Some(turn));
    if let Some(turn) = earliest {
        beginning.head_from(turn, time[begin] - time[first]);
    }
    ((begin, first), beginning)
}

/// Mean of the forces around a sample.
fn mean_about(accel: &[[f64; 3]], k: usize, half: usize) -> Vector3<f64> {
    mean(&accel[k.saturating_sub(half)..(k + half + 1).min(accel.len())])
}

/// True for each node at which the foot may stand.
fn standing(bound: &[f64], every: usize, round: usize) -> Result<Vec<bool>, Error> {
    let n = bound.len();
    let mut found = memory::room(n / every)?;
    for k in (every..n).step_by(every) {
        let window = &bound[k.saturating_sub(round)..(k + round + 1).min(n)];
        let low = window.iter().fold(f64::INFINITY, |low, x| low.at_most(*x));
        found.push(may_stand(bound[k], low));
    }
    Ok(found)
}

/// Joins nodes at which the foot stands to stances, if they are close.
fn join_stances(
    stands: &[bool],
    bound: &[f64],
    every: usize,
    dt: f64,
) -> Result<Vec<Stance>, Error> {
    let mut found: Vec<Stance> = Vec::new();
    for k in (0..stands.len()).filter(|i| stands[*i]).map(|i| (i + 1) * every) {
        let joins =
            |stance: &Stance| ((k + 1 - stance.samples.1) as f64) * dt < MIN_STANCE_INTERVAL_S;
        match found.last_mut().filter(|last| joins(last)) {
            Some(last) => {
                last.samples.1 = k + 1;
                if bound[k] < bound[last.lowest] {
                    last.lowest = k;
                }
            }
            None => {
                memory::reserve(&mut found, 1)?;
                found.push(Stance { samples: (k, k + 1), lowest: k });
            }
        }
    }
    Ok(found)
}
