//! The filter over a recording with known stances.

use core::ops::Range;

use super::lead::{Stand, go_back};
use super::plan::Plan;
use super::swing::{Mark, Swing, Swings, turn_of};
use super::walker::Walker;
use super::{HALF_LEVEL_S, HALF_WINDOW_S};
use crate::error::Error;
use crate::navigation::covariance::{Errors, STATES};
use crate::navigation::filter::{Inertial, NavigationFilter, Observer};

/// The filter during a pass over a recording.
#[derive(Debug, Clone)]
pub struct Walk<'a> {
    plan: &'a Plan,
    level: bool,
    walker: Walker,
    /// Indices of the next stance and the next static interval.
    stance: usize,
    rest: usize,
    swings: Swings,
    found: Vec<Swing>,
}

/// State after each sample.
#[derive(Debug)]
pub struct Trodden<'a> {
    /// Position relative to the start, m: ahead along the sensor's first axis, right and down.
    pub position: &'a mut [[f64; 3]],
    /// Velocity in these axes, m/s.
    pub velocity: &'a mut [[f64; 3]],
    /// Quaternion from the sensor's axes to these axes, scalar first.
    pub quaternion: &'a mut [[f64; 4]],
    /// Bias of the gyro, rad/s.
    pub gyro_bias: &'a mut [[f64; 3]],
    /// Bias of the accelerometer, m/s².
    pub accel_bias: &'a mut [[f64; 3]],
    /// Standard deviations at the last step of the covariance.
    pub sigma: &'a mut [Errors],
}

impl<'a> Walk<'a> {
    /// Begins at the plan's first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if its time is not a number.
    pub fn begin<W: Observer>(
        plan: &'a Plan,
        level: bool,
        time: f64,
        observer: &mut W,
    ) -> Result<Self, Error> {
        let (k, _) = plan.begin;
        let first = [plan.gyro[k], plan.accel[k]];
        observer.sample(k);
        let walker = Walker::begin(&plan.beginning, time, first, observer)?;
        let stance = plan.stances.iter().take_while(|stance| stance.lowest < k).count();
        let mut swings = Swings::new();
        if plan.stances.get(stance).is_some_and(|stance| stance.lowest == k) {
            swings.node(k as u64, Some(mark(plan, &walker, k)), [0.0; 2]);
        }
        let rest = usize::from(plan.rested);
        Ok(Self { plan, level, walker, stance, rest, swings, found: Vec::new() })
    }

    /// The known swings; all of them after the end of the recording.
    pub fn swings(&mut self) -> &[Swing] {
        self.found.extend(self.swings.finish());
        &self.found
    }

    /// Number of times that a wrong level was corrected.
    pub fn relevelled(&self) -> u64 {
        self.walker.relevelled
    }

    /// Number of nodes in stances that were rejected to date.
    pub fn rejections(&self) -> u64 {
        self.walker.rejections
    }

    /// Processes a piece of the recording; `given` are its rates and forces, with missing values.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a time is not later than the previous time.
    pub fn run<W: Observer>(
        &mut self,
        time: &[f64],
        given: [&[[f64; 3]]; 2],
        piece: Range<usize>,
        trodden: &mut Trodden<'_>,
        observer: &mut W,
    ) -> Result<(), Error> {
        let (begin, first) = self.plan.begin;
        for k in piece {
            observer.sample(k);
            if k < begin {
                trodden.put_unknown(k, &self.walker);
                continue;
            }
            if k == begin {
                self.go_back(&time[first..=begin], first, trodden);
            } else {
                self.step(time, given, k, observer)?;
            }
            trodden.put(k, &self.walker);
        }
        Ok(())
    }

    /// Integrates backwards over the samples before the filter's beginning.
    fn go_back(&self, time: &[f64], first: usize, trodden: &mut Trodden<'_>) {
        let filter = &self.walker.filter;
        let stand = Stand {
            attitude: filter.motion.attitude,
            gyro_bias: filter.gyro_bias,
            accel_bias: filter.accel_bias,
        };
        let of = |values: &'a [[f64; 3]]| &values[first..first + time.len()];
        let given = [of(&self.plan.gyro), of(&self.plan.accel)];
        go_back(time, given, &stand, |k, position, velocity, turn| {
            trodden.position[first + k] = position;
            trodden.velocity[first + k] = velocity.into();
            trodden.quaternion[first + k] = turn;
        });
    }

    fn step<W: Observer>(
        &mut self,
        time: &[f64],
        [gyro, accel]: [&[[f64; 3]]; 2],
        k: usize,
        observer: &mut W,
    ) -> Result<(), Error> {
        let known = |given: &[f64; 3], planned: [f64; 3]| match given.iter().all(|x| x.is_finite())
        {
            true => planned,
            false => [f64::NAN; 3],
        };
        let sample = Inertial {
            time: time[k],
            gyro: known(&gyro[k], self.plan.gyro[k]),
            accel: known(&accel[k], self.plan.accel[k]),
            rest: false,
        };
        self.walker.step(&sample, self.plan.variance[k], observer)?;
        let turn = turn_of(&self.plan.gyro[k].into());
        self.swings.add(time[k] - time[k - 1], turn, self.plan.bound[k]);
        if k.is_multiple_of(self.plan.every) && self.walker.propagate(observer) {
            self.node(k, observer);
        }
        Ok(())
    }

    fn node<W: Observer>(&mut self, k: usize, observer: &mut W) {
        let seconds = self.plan.every as f64 * self.plan.dt;
        let mut found = [0.0; STATES];
        let stands = self.plan.stands[k / self.plan.every - 1];
        let force = || self.plan.force(k, HALF_LEVEL_S);
        let stood =
            stands && self.walker.stand(self.plan.bound[k], seconds, force, &mut found, observer);
        let floored = self.floor(k, &mut found);
        let rested = self.rest(k, &mut found);
        if stood || floored || rested {
            self.walker.apply(&found, observer);
        }
        if !self.walker.filter.navigating {
            self.swings.lose();
            return;
        }
        let mark = stands.then(|| mark(self.plan, &self.walker, k));
        let done = self.swings.node(k as u64, mark, self.walker.sink);
        self.found.extend(done);
    }

    fn floor(&mut self, k: usize, found: &mut Errors) -> bool {
        let Some(stance) = self.plan.stances.get(self.stance) else { return false };
        if k < stance.lowest {
            return false;
        }
        self.stance += 1;
        self.level && self.walker.take_floor(found)
    }

    /// Corrects by the bias of a static interval, at its end.
    fn rest(&mut self, k: usize, found: &mut Errors) -> bool {
        let Some(rest) = self.plan.static_intervals.get(self.rest) else { return false };
        if k + self.plan.every < rest.until && k + self.plan.every < self.plan.gyro.len() {
            return false;
        }
        self.rest += 1;
        self.walker.take_rest(&rest.rate, rest.sigma, found);
        true
    }
}

fn mark(plan: &Plan, walker: &Walker, k: usize) -> Mark {
    let attitude = &walker.filter.motion.attitude;
    Mark::at(plan.bound[k], attitude, &plan.force(k, HALF_WINDOW_S), walker.position())
}

impl Trodden<'_> {
    fn put_unknown(&mut self, k: usize, walker: &Walker) {
        self.put(k, walker);
        (self.position[k], self.velocity[k]) = ([f64::NAN; 3], [f64::NAN; 3]);
    }

    #[inline(always)]
    fn put(&mut self, k: usize, walker: &Walker) {
        let filter: &NavigationFilter = &walker.filter;
        let now = filter.snapshot();
        self.position[k] = walker.position();
        self.velocity[k] = now.velocity;
        self.quaternion[k] = now.quaternion;
        self.gyro_bias[k] = now.gyro_bias;
        self.accel_bias[k] = now.accel_bias;
        self.sigma[k] = now.sigma;
    }
}
