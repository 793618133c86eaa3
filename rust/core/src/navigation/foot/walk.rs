//! The filter over a recording whose stances are known.

use core::ops::Range;

use super::plan::Plan;
use super::walker::Walker;
use crate::error::Error;
use crate::navigation::covariance::{Errors, STATES};
use crate::navigation::filter::{Inertial, NavigationFilter, Observer};

/// A sensor on a foot under way over a recording.
#[derive(Debug, Clone)]
pub struct Walk<'a> {
    plan: &'a Plan,
    level: bool,
    walker: Walker,
    /// The next stance and the next rest.
    stance: usize,
    rest: usize,
}

/// State after each sample.
#[derive(Debug)]
pub struct Trodden<'a> {
    /// From where it began, m: ahead, right and down of where the sensor's first axis looked.
    pub position: &'a mut [[f64; 3]],
    /// m/s.
    pub velocity: &'a mut [[f64; 3]],
    /// From the sensor's axes to these; scalar first.
    pub quaternion: &'a mut [[f64; 4]],
    /// Rad/s.
    pub gyro_bias: &'a mut [[f64; 3]],
    /// m/s².
    pub accel_bias: &'a mut [[f64; 3]],
    /// Standard deviations at the last step of the covariance.
    pub sigma: &'a mut [Errors],
}

impl<'a> Walk<'a> {
    /// At the first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the time of the first sample is none.
    pub fn begin<W: Observer>(
        plan: &'a Plan,
        level: bool,
        time: f64,
        observer: &mut W,
    ) -> Result<Self, Error> {
        let first = [plan.gyro[0], plan.accel[0]];
        let walker = Walker::begin(&plan.beginning, time, first, observer)?;
        Ok(Self { plan, level, walker, stance: 0, rest: usize::from(plan.rested) })
    }

    /// Stances' nodes that were not believed to date.
    pub fn rejections(&self) -> u64 {
        self.walker.rejections
    }

    /// A piece of the recording; `given` are its rates and forces with what is missing.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a time is not later than that before.
    pub fn run<W: Observer>(
        &mut self,
        time: &[f64],
        given: [&[[f64; 3]]; 2],
        piece: Range<usize>,
        trodden: &mut Trodden<'_>,
        observer: &mut W,
    ) -> Result<(), Error> {
        for k in piece {
            observer.sample(k);
            if k > 0 {
                self.step(time, given, k, observer)?;
            }
            trodden.put(k, &self.walker);
        }
        Ok(())
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
        if k.is_multiple_of(self.plan.every) && self.walker.propagate(observer) {
            self.node(k, observer);
        }
        Ok(())
    }

    fn node<W: Observer>(&mut self, k: usize, observer: &mut W) {
        let seconds = self.plan.every as f64 * self.plan.dt;
        let mut found = [0.0; STATES];
        let stood = self.plan.stands[k / self.plan.every - 1]
            && self.walker.stand(self.plan.bound[k], seconds, &mut found);
        let floored = self.floor(k, &mut found);
        let rested = self.rest(k, &mut found);
        if stood || floored || rested {
            self.walker.apply(&found, observer);
        }
    }

    fn floor(&mut self, k: usize, found: &mut Errors) -> bool {
        let Some(stance) = self.plan.stances.get(self.stance) else { return false };
        if k < stance.lowest {
            return false;
        }
        self.stance += 1;
        self.level && self.walker.take_floor(found)
    }

    /// The bias that a rest tells, at its end.
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

impl Trodden<'_> {
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
