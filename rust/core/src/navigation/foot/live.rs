//! Live filter for a sensor on a foot; it is late by a window of the speed bound.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

use super::beginning::{AtRest, Beginning, is_gravity};
use super::recent::{MAX_HALF, Recent};
use super::still::{BLOCK_S, News, RestMean, Still};
use super::swing::{Mark, Swings, turn_of};
use super::walker::Walker;
use super::{
    GRAVITY, HALF_WINDOW_S, MAX_FIRST_REST_S, MAX_VALLEY_RATIO, MAX_VALLEY_SPEED_M_S, MIN_RATE_HZ,
    MIN_STANCE_INTERVAL_S, MIN_VALLEY_SPEED_M_S, STEP_S, may_stand, samples_in,
};
use crate::checkpoint::Checkpoint;
use crate::error::{Error, check_positive, require};
use crate::math::validity::{are_within, is_count, is_size, is_within};
use crate::navigation::covariance::{Errors, STATES};
use crate::navigation::filter::Inertial;
use crate::stream::Stream;

/// Time before a sample in which the lowest bound is searched, s.
const LOOK_BACK_S: f64 = 1.5;
/// Largest number of nodes in that time.
const ROW: usize = 16;
const ROWS: usize = 7;
const NODES: usize = ROW * ROWS;
/// Without a rest the filter begins in a minimum of this time, s. It has no output before the
/// minimum has ended: the bound is then this multiple of the minimum.
const START_WINDOW_S: f64 = 1.5;
const MIN_END_RATIO: f64 = 5.0;
/// Longest time for which clipped rates wait for their end, s, if the range is known.
const MAX_CLIPPED_S: f64 = 0.05;
/// Largest range of a gyro, rad/s.
const MAX_RANGE: f64 = 1e4;
/// Largest sample rate, Hz.
const MAX_RATE_HZ: f64 = 1200.0;
const MAX_BOUND: f64 = 1e9;

/// Parameters of a foot filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FootParams {
    /// Samples per second.
    pub rate: f64,
    /// True if the floor is level, except for steps.
    pub level: bool,
    /// Range of the gyro, rad/s, if known.
    pub gyro_range: Option<f64>,
}

/// Numbers of samples that follow from the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Lengths {
    dt: f64,
    /// Samples in half a window, between two nodes, and in a block of a rest.
    half: u64,
    /// Delay of the output behind the last sample, in samples.
    late: u64,
    every: u64,
    block: u32,
    /// Number of nodes in which the lowest bound is searched.
    nodes: u32,
}

/// The present stance, or the last one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Standing {
    /// Time since the last node at which the foot stood, s.
    gap: f64,
    lowest: f64,
    /// True if the height of this stance was tested.
    floored: bool,
    stood: bool,
    count: u64,
}

/// Position of a sensor on a foot, sample by sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FootFilter {
    params: FootParams,
    lengths: Lengths,
    samples: u64,
    recent: Recent,
    known: AtRest,
    walker: Option<Walker>,
    /// Bound at the output's sample, m/s; NaN before the first.
    bound: f64,
    /// Lowest bound of each of the last nodes, and of the present node.
    lows: [[f64; ROW]; ROWS],
    low: f64,
    /// Bound of the minimum in which the filter began, and a flag for the minimum's end.
    least: f64,
    begun: bool,
    still: Still,
    /// True if the filter began in a rest.
    rested: bool,
    /// A rest that has ended, for the next node.
    rest: Option<RestMean>,
    standing: Standing,
    /// Largest rate about an axis to date, rad/s.
    fastest: f64,
    swings: Swings,
}

impl Lengths {
    fn of(params: &FootParams) -> Self {
        let dt = 1.0 / params.rate;
        let every = samples_in(STEP_S, dt);
        let half = samples_in(HALF_WINDOW_S, dt) as u64;
        let waits = params.gyro_range.map_or(0, |_| samples_in(MAX_CLIPPED_S, dt) as u64);
        Self {
            dt,
            half,
            late: 2 * half + waits,
            every: every as u64,
            block: samples_in(BLOCK_S, dt) as u32,
            nodes: samples_in(LOOK_BACK_S, every as f64 * dt).min(NODES) as u32,
        }
    }
}

impl FootFilter {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a parameter is out of range.
    pub fn new(params: FootParams) -> Result<Self, Error> {
        let (rate, expected) = (params.rate, "from 48 to 1200 samples a second");
        require((MIN_RATE_HZ..=MAX_RATE_HZ).contains(&rate), "rate", expected, rate)?;
        if let Some(range) = params.gyro_range {
            check_positive("gyro_range", "a positive number of rad/s", range)?;
            require(range <= MAX_RANGE, "gyro_range", "at most 10000 rad/s", range)?;
        }
        let lengths = Lengths::of(&params);
        debug_assert!(lengths.half <= MAX_HALF, "two windows fit in what is kept");
        Ok(Self {
            params,
            lengths,
            samples: 0,
            recent: Recent::new(),
            known: AtRest { gyro_bias: Vector3::zeros(), force: GRAVITY },
            walker: None,
            bound: f64::NAN,
            lows: [[f64::INFINITY; ROW]; ROWS],
            low: f64::INFINITY,
            least: f64::INFINITY,
            begun: false,
            still: Still::new(),
            rested: false,
            rest: None,
            standing: Standing {
                gap: MIN_STANCE_INTERVAL_S,
                lowest: 0.0,
                floored: false,
                stood: false,
                count: 0,
            },
            fastest: 0.0,
            swings: Swings::new(),
        })
    }

    fn advance(&mut self, k: u64) {
        self.bound = self.recent.bound(k, self.lengths.half, &self.known);
        self.low = if self.bound < self.low { self.bound } else { self.low };
        for rate in self.recent.slot(k).gyro.iter().map(|rate| rate.abs()) {
            self.fastest = if rate > self.fastest { rate } else { self.fastest };
        }
        if self.begins(k) {
            let force = self.recent.force(k, 2 * self.lengths.half);
            let seconds = self.lengths.every as f64 * self.lengths.dt;
            self.begin(k, &Beginning::in_valley(&force, self.bound, seconds));
        } else {
            self.step(k);
        }
        self.find_static_intervals(k);
        if k.is_multiple_of(self.lengths.every) {
            self.node(k);
        }
    }

    fn seconds(&self, samples: u64) -> f64 {
        samples as f64 * self.lengths.dt
    }

    /// True if the filter begins at this sample. Nothing is known yet; or the foot moves less than
    /// at all samples before the first minimum's end; or it moves much less than in that minimum.
    fn begins(&mut self, k: u64) -> bool {
        if self.rested || self.bound == f64::INFINITY {
            return false;
        }
        let early = self.seconds(k) < START_WINDOW_S;
        let valley =
            if self.bound > MIN_VALLEY_SPEED_M_S { self.bound } else { MIN_VALLEY_SPEED_M_S };
        let deeper = match self.begun {
            true => self.least > MAX_VALLEY_RATIO * valley,
            false => self.bound < self.least,
        };
        if (early && deeper) || self.walker.is_none() {
            self.least = self.bound;
            return true;
        }
        let least =
            if self.least > MIN_VALLEY_SPEED_M_S { self.least } else { MIN_VALLEY_SPEED_M_S };
        let ended = self.bound > MIN_END_RATIO * least && self.least < MAX_VALLEY_SPEED_M_S;
        self.begun |= ended || !early;
        false
    }

    fn begin(&mut self, k: u64, from: &Beginning) {
        let slot = self.recent.slot(k);
        let first = [slot.gyro.into(), slot.accel.into()];
        self.walker = Walker::begin(from, self.seconds(k), first, &mut ()).ok();
        self.swings.lose();
    }

    #[inline(always)]
    fn step(&mut self, k: u64) {
        let (slot, time) = (self.recent.slot(k), self.seconds(k));
        let of = |v: Vector3<f64>, missing: bool| if missing { [f64::NAN; 3] } else { v.into() };
        let sample = Inertial {
            time,
            gyro: of(slot.gyro, slot.missing[0]),
            accel: of(slot.accel, slot.missing[1]),
            rest: false,
        };
        if let Some(walker) = &mut self.walker {
            // Times follow from counts and increase.
            let _ = walker.step(&sample, slot.variance, &mut ());
        }
        self.swings.add(self.lengths.dt, turn_of(&self.recent.slot(k).gyro), self.bound);
    }

    fn find_static_intervals(&mut self, k: u64) {
        let Lengths { block, dt, .. } = self.lengths;
        let slot = self.recent.slot(k);
        let at_start =
            self.still.since().is_some_and(|since| self.seconds(since) < MAX_FIRST_REST_S);
        match self.still.look(k, self.bound, [slot.gyro, slot.accel], (block, dt)) {
            News::Better(found_rest) if at_start => {
                let from =
                    Beginning::at_rest(&found_rest.force, &found_rest.rate, found_rest.sigma);
                let size = found_rest.force.norm();
                let force = if is_gravity(size) { size } else { self.known.force };
                self.known = AtRest { gyro_bias: from.gyro_bias, force };
                (self.rested, self.begun) = (true, true);
                self.begin(k, &from);
            }
            News::Ended(found_rest) if !at_start => self.rest = Some(found_rest),
            _ => {}
        }
    }

    fn node(&mut self, k: u64) {
        let Lengths { every, dt, nodes, .. } = self.lengths;
        let seconds = every as f64 * dt;
        let index = ((k / every) % u64::from(nodes)) as usize;
        self.lows[index / ROW][index % ROW] = self.low;
        self.low = f64::INFINITY;
        let lower = |low: f64, x: &f64| if *x < low { *x } else { low };
        let low = self.lows.iter().flatten().fold(f64::INFINITY, lower);
        let may = may_stand(self.bound, low);
        let floors = self.note(may, seconds);
        self.standing.stood = false;
        let rest = self.rest.take();
        let Some(walker) = self.walker.as_mut() else { return };
        if !walker.propagate(&mut ()) {
            self.swings.lose();
            return;
        }
        let mut found: Errors = [0.0; STATES];
        let (recent, half) = (&self.recent, self.lengths.half);
        let level = || recent.force(k, 2 * half);
        let stood = may && walker.stand(self.bound, seconds, level, &mut found, &mut ());
        let floored = floors && walker.take_floor(&mut found);
        if let Some(found_rest) = &rest {
            walker.take_rest(&found_rest.rate, found_rest.sigma, &mut found);
        }
        if stood || floored || rest.is_some() {
            walker.apply(&found, &mut ());
        }
        self.standing.stood = stood;
        if !walker.filter.navigating {
            self.swings.lose();
            return;
        }
        let attitude = &walker.filter.motion.attitude;
        let mark = || Mark::at(self.bound, attitude, &recent.force(k, half), walker.position());
        self.swings.node(k, may.then(mark), walker.sink);
    }

    /// Notes a node and whether the foot stands. Returns true if the height of this stance is to be
    /// tested: once, after its lowest bound.
    fn note(&mut self, stands: bool, seconds: f64) -> bool {
        let standing = &mut self.standing;
        if !stands {
            standing.gap = if standing.gap < MIN_STANCE_INTERVAL_S {
                standing.gap + seconds
            } else {
                MIN_STANCE_INTERVAL_S
            };
            return false;
        }
        if standing.gap >= MIN_STANCE_INTERVAL_S {
            standing.count += 1;
            (standing.lowest, standing.floored) = (self.bound, false);
        }
        standing.gap = 0.0;
        let past = self.bound > standing.lowest && !standing.floored;
        standing.floored |= past;
        if self.bound < standing.lowest {
            standing.lowest = self.bound;
        }
        past && self.params.level
    }

    /// Parameters of the filter.
    pub fn params(&self) -> &FootParams {
        &self.params
    }

    /// Delay of the output behind the last sample, s.
    pub fn delay(&self) -> f64 {
        self.seconds(self.lengths.late)
    }

    /// Position: ahead, left and up of the start, m; NaN if it is unknown.
    #[inline]
    pub fn position(&self) -> [f64; 3] {
        self.reported().map_or([f64::NAN; 3], |walker| flipped(walker.position()))
    }

    /// The filter, once the minimum in which it began has ended.
    fn reported(&self) -> Option<&Walker> {
        self.walker.as_ref().filter(|_| self.begun)
    }

    /// Velocity: ahead, left and up, m/s; NaN if it is unknown.
    pub fn velocity(&self) -> [f64; 3] {
        self.reported().map_or([f64::NAN; 3], |walker| flipped(walker.filter.snapshot().velocity))
    }

    /// Quaternion from the sensor's axes to ahead, left, up, scalar first.
    pub fn quaternion(&self) -> [f64; 4] {
        let Some(walker) = &self.walker else { return [1.0, 0.0, 0.0, 0.0] };
        let [w, x, y, z] = walker.filter.snapshot().quaternion;
        [-x, w, -z, y]
    }

    /// Bias of the gyro, rad/s.
    pub fn gyro_bias(&self) -> [f64; 3] {
        self.walker.as_ref().map_or([0.0; 3], |walker| walker.filter.gyro_bias.into())
    }

    /// Bias of the accelerometer, m/s².
    pub fn accel_bias(&self) -> [f64; 3] {
        self.walker.as_ref().map_or([0.0; 3], |walker| walker.filter.accel_bias.into())
    }

    /// Standard deviations of position, velocity, orientation and biases; NaN where unknown.
    pub fn sigma(&self) -> Errors {
        let Some(walker) = self.reported() else { return [f64::NAN; STATES] };
        let mut sigma = walker.filter.sigma;
        // On a level floor stances also correct the height.
        if self.params.level {
            return sigma;
        }
        let climb = self.swings.climb_variance(self.recent.has_clipped());
        sigma[2] = ComplexField::sqrt(sigma[2] * sigma[2] + climb);
        sigma
    }

    /// Share of the last six swings' time that looks like a foot's motion; NaN before six swings.
    pub fn foot_share(&self) -> f64 {
        self.swings.share()
    }

    /// Number of times that a wrong level was corrected.
    pub fn relevelled(&self) -> u64 {
        self.walker.as_ref().map_or(0, |walker| walker.relevelled)
    }

    /// True if the foot stood at the last node.
    pub fn is_standing(&self) -> bool {
        self.standing.stood
    }

    /// True if the foot has stood for half a second and the gyro's bias can be estimated.
    pub fn is_at_rest(&self) -> bool {
        self.still.is_resting()
    }

    /// Speed bound, m/s; NaN before it is known.
    pub fn bound(&self) -> f64 {
        self.bound
    }

    /// Number of stances to date.
    pub fn stances(&self) -> u64 {
        self.standing.count
    }

    /// Largest rate about an axis to date, rad/s; a foot exceeds 1.75.
    pub fn fastest(&self) -> f64 {
        self.fastest
    }

    /// Number of rejected zero velocities since the start.
    pub fn rejections(&self) -> u64 {
        self.walker.as_ref().map_or(0, |walker| walker.rejections)
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples
    }
}

/// Converts from ahead, right, down to ahead, left, up.
fn flipped([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, -y, -z]
}

impl Stream for FootFilter {
    type Input = [f64; 6];
    type Output = [f64; 3];

    /// Processes a sample of gyro and accelerometer, rad/s and m/s²; returns the position.
    #[inline]
    fn update(&mut self, [p, q, r, x, y, z]: [f64; 6]) -> [f64; 3] {
        self.samples += 1;
        let Lengths { dt, half, late, .. } = self.lengths;
        let given = [Vector3::new(p, q, r), Vector3::new(x, y, z)];
        let range = self.params.gyro_range;
        if self.recent.push(given, (dt, half, late), self.known.force, range)
            && let Some(k) = self.recent.ready(late)
        {
            self.advance(k);
        }
        self.position()
    }

    fn reset(&mut self) {
        if let Ok(fresh) = Self::new(self.params) {
            *self = fresh;
        }
    }
}

impl Checkpoint for FootFilter {
    const TAG: &'static str = "foot";
    const VERSION: u16 = 3;

    fn is_valid(&self) -> bool {
        let bound = |x: f64| is_size(x, MAX_BOUND) || x == f64::INFINITY;
        Self::new(self.params).is_ok_and(|fresh| {
            self.lengths == fresh.lengths
                && is_count(self.samples)
                && self.recent.count() <= self.samples
                && self.recent.is_valid()
                && are_within(&self.known.gyro_bias, 10.0)
                && is_within(self.known.force - GRAVITY, 1.0)
                && self.walker.as_ref().is_none_or(Walker::is_valid)
                && (self.bound.is_nan() || bound(self.bound))
                && self.lows.iter().flatten().all(|x| bound(*x))
                && bound(self.low)
                && bound(self.least)
                && self.still.is_valid(self.lengths.block)
                && self.rest.as_ref().is_none_or(RestMean::is_valid)
                && is_size(self.standing.gap, 2.0 * MIN_STANCE_INTERVAL_S)
                && is_size(self.standing.lowest, MAX_BOUND)
                && is_count(self.standing.count)
                && is_size(self.fastest, 2.0 * MAX_RANGE)
                && self.swings.is_valid()
        })
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.params.rate, self.samples) == (other.params.rate, other.samples)
    }
}

#[cfg(test)]
mod tests {
    use super::{FootFilter, FootParams};
    use crate::stream::Stream;

    #[test]
    fn at_rest_it_stays_and_learns_the_bias() {
        let params = FootParams { rate: 200.0, level: true, gyro_range: None };
        let mut foot = FootFilter::new(params).unwrap();
        assert_eq!(foot.delay(), 0.05);
        assert!(foot.update([0.01, -0.02, 0.03, 0.0, 0.0, 9.8])[0].is_nan());
        for _ in 0..2000 {
            foot.update([0.01, -0.02, 0.03, 0.0, 0.0, 9.8]);
        }
        assert!(foot.is_at_rest() && foot.is_standing());
        assert!(foot.position().iter().all(|x| x.abs() < 1e-3));
        assert!((foot.gyro_bias()[2] - 0.03).abs() < 1e-4);
        foot.update([f64::NAN; 6]);
        assert_eq!(foot.samples_seen(), 2002);
    }

    #[test]
    fn rates_are_refused() {
        for rate in [0.0, 40.0, 1300.0, f64::NAN] {
            let params = FootParams { rate, level: false, gyro_range: None };
            assert!(FootFilter::new(params).is_err());
        }
    }
}
