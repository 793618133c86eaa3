//! The filter over a recording whose stances are known.

use core::ops::Range;

use nalgebra::Vector3;

use super::plan::Plan;
use super::{DEGREE, GRAVITY};
use crate::error::Error;
use crate::navigation::covariance::{Covariance, Errors, GYRO, PHI, R, STATES, V};
use crate::navigation::earth::Place;
use crate::navigation::filter::{Inertial, NavigationFilter, Witness, quaternion};
use crate::navigation::motion::Motion;
use crate::navigation::params::{Adapt, Kind, NavigationParams, Start};

/// White noise of gyro and accelerometer, squares, rad²/s and m²/s³, and walks of their biases.
const GYRO_NOISE: f64 = 0.05 * DEGREE * 0.05 * DEGREE;
const ACCEL_NOISE: f64 = 0.03 * 0.03;
const GYRO_WALK: f64 = 1e-14;
const ACCEL_WALK: f64 = 1e-4;
/// Noise relative to rate and shock, squares: of scale, misalignment and bandwidth.
const OF_RATE: f64 = 0.001 * 0.001;
const OF_SHOCK: f64 = 0.015 * 0.015;
/// Deviations of where it begins, m, and of its heading, rad.
const HERE: f64 = 1e-5;
const HEADING: f64 = 1e-6;
/// Of a foot that stands, m/s, the bound above which it hardly does, and how long its roll lasts, s.
const STANDS: f64 = 0.003;
const HARDLY: f64 = 0.1;
const ROLL: f64 = 0.05;
/// The most that may be new of a stance, squared, of three.
const GATE: f64 = 100.0;
/// After so many seconds of rejections the filter is wrong: by this in level, rad².
const WRONG_AFTER: f64 = 0.15;
const WRONG_LEVEL: f64 = 1e-3;
/// The same floor, m, and its deviation, m.
const SAME_FLOOR: f64 = 0.1;
const FLOOR: f64 = 0.02;
/// How fast a foot goes while nothing is known of it, m/s.
const STRAYS: f64 = 2.0;

/// A sensor on a foot under way.
#[derive(Debug, Clone)]
pub struct Walk<'a> {
    plan: &'a Plan,
    level: bool,
    filter: NavigationFilter,
    /// Seconds of rejections in a row, and how many there were.
    rejected: f64,
    rejections: u64,
    floor: Option<f64>,
    /// The next stance and the next rest.
    stance: usize,
    rest: usize,
    extra: [f64; 2],
    lost: f64,
}

/// What was known after each sample.
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
    pub fn begin<W: Witness>(
        plan: &'a Plan,
        level: bool,
        time: f64,
        witness: &mut W,
    ) -> Result<Self, Error> {
        let from = &plan.beginning;
        let start = Start {
            quaternion: quaternion(&from.attitude),
            heading_known: true,
            course: false,
            time,
            latitude: 0.0,
            gyro_bias: from.gyro_bias.into(),
            accel_bias: from.accel_bias.into(),
            level_sigma: from.level,
            heading_sigma: HEADING,
            gyro_bias_sigma: from.gyro,
            accel_bias_sigma: from.accel,
        };
        let params = NavigationParams {
            gyro_noise: [GYRO_NOISE; 3],
            accel_noise: [ACCEL_NOISE; 3],
            gyro_walk: [GYRO_WALK; 3],
            accel_walk: [ACCEL_WALK; 3],
            antenna: [0.0; 3],
            antenna_sigma: 0.0,
            wheels: None,
            gate: GATE,
            adapt: Adapt::Fixed,
            // The nodes are counted here, in samples.
            covariance_step: 1.0,
            kind: Kind::Rate,
        };
        let mut filter = NavigationFilter::new(start, params)?;
        let (gyro, accel) = (plan.gyro[0], plan.accel[0]);
        filter.update(&Inertial { time, gyro, accel, rest: false })?;
        filter.motion.attitude = from.attitude;
        filter.motion.place = Place::plane(GRAVITY);
        let of = |first: usize| match first {
            R => HERE,
            V => from.velocity,
            PHI => from.level,
            GYRO => from.gyro,
            _ => from.accel,
        };
        let mut variances: Errors = core::array::from_fn(|i| of(i - i % 3) * of(i - i % 3));
        variances[PHI + 2] = HEADING * HEADING;
        filter.begin_on_plane(&variances, witness);
        let rest = usize::from(plan.rested);
        Ok(Self {
            plan,
            level,
            filter,
            rejected: 0.0,
            rejections: 0,
            floor: None,
            stance: 0,
            rest,
            extra: [0.0; 2],
            lost: f64::NAN,
        })
    }

    /// Stances' nodes that were not believed so far.
    pub fn rejections(&self) -> u64 {
        self.rejections
    }

    /// A piece of the recording; `given` are its rates and forces with what is missing.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a time is not later than that before.
    pub fn run<W: Witness>(
        &mut self,
        time: &[f64],
        given: [&[[f64; 3]]; 2],
        piece: Range<usize>,
        trodden: &mut Trodden<'_>,
        witness: &mut W,
    ) -> Result<(), Error> {
        for k in piece {
            witness.sample(k);
            if k > 0 {
                self.step(time, given, k, witness)?;
            }
            trodden.put(k, &self.filter);
        }
        Ok(())
    }

    fn step<W: Witness>(
        &mut self,
        time: &[f64],
        [gyro, accel]: [&[[f64; 3]]; 2],
        k: usize,
        witness: &mut W,
    ) -> Result<(), Error> {
        let missing = [gyro, accel].map(|of| of[k].iter().any(|x| !x.is_finite()));
        let of = |missing: bool, known: [f64; 3]| if missing { [f64::NAN; 3] } else { known };
        let (gyro, accel) = (of(missing[0], self.plan.gyro[k]), of(missing[1], self.plan.accel[k]));
        let was = self.filter.navigating;
        self.filter
            .update_before(&Inertial { time: time[k], gyro, accel, rest: false }, witness)?;
        if was && !self.filter.navigating {
            self.lost = time[k - 1];
        }
        if !self.filter.navigating && missing == [false; 2] {
            self.resume(time[k], witness);
        }
        self.grow(k, time[k] - time[k - 1]);
        if k.is_multiple_of(self.plan.every) {
            self.node(k, witness);
        }
        Ok(())
    }

    /// Noise relative to rate and shock, and that of restored rates.
    #[inline(always)]
    fn grow(&mut self, k: usize, dt: f64) {
        let rate = self.filter.sensors.gyro - self.filter.gyro_bias;
        let shock = self.filter.sensors.accel.norm() - GRAVITY;
        self.extra[0] += (OF_RATE * rate.norm_squared() + self.plan.variance[k]) * dt;
        self.extra[1] += OF_SHOCK * shock * shock * dt;
    }

    /// After a gap: where it was, as far as it may have gone.
    #[cold]
    fn resume<W: Witness>(&mut self, time: f64, witness: &mut W) {
        let far = STRAYS * (time - self.lost).max(0.0) + HERE;
        let filter = &mut self.filter;
        let motion = &filter.motion;
        let mut anew = Motion::new(motion.attitude, 0.0, 0.0, 0.0);
        (anew.latitude, anew.longitude, anew.height) =
            (motion.latitude, motion.longitude, motion.height);
        anew.place = Place::plane(GRAVITY);
        filter.motion = anew;
        let mut variances: Errors = core::array::from_fn(|i| filter.covariance.at(i, i));
        for i in 0..3 {
            variances[R + i] = far * far;
            variances[V + i] = STRAYS * STRAYS;
        }
        filter.begin_on_plane(&variances, witness);
        (self.rejected, self.floor) = (0.0, None);
    }

    fn node<W: Witness>(&mut self, k: usize, witness: &mut W) {
        let extra = core::mem::take(&mut self.extra);
        self.filter.propagate_with(extra, witness);
        if !self.filter.navigating {
            return;
        }
        let mut found = [0.0; STATES];
        let stood = self.plan.stands[k / self.plan.every - 1] && self.stand(k, &mut found);
        let floored = self.floor(k, &mut found);
        let rested = self.rest(k, &mut found);
        if stood || floored || rested {
            self.filter.apply(&found, witness);
        }
    }

    /// Zero velocity, if it can be.
    fn stand(&mut self, k: usize, found: &mut Errors) -> bool {
        let seconds = self.plan.every as f64 * self.plan.dt;
        let bound = self.plan.bound[k];
        let part = bound / HARDLY;
        let noise =
            (STANDS * STANDS + bound * bound * (1.0 + part * part)) * (ROLL / seconds).max(1.0);
        let before = self.filter.covariance;
        if self.filter.take_standing(noise, found) <= GATE {
            self.rejected = 0.0;
            return true;
        }
        (self.filter.covariance, *found) = (before, [0.0; STATES]);
        self.rejected += seconds;
        self.rejections += 1;
        if self.rejected <= WRONG_AFTER {
            return false;
        }
        self.rejected = 0.0;
        let square = self.filter.motion.velocity.norm_squared();
        for i in 0..3 {
            self.filter.covariance.widen(V + i, square);
            self.filter.covariance.widen(R + i, 0.25 * square);
        }
        self.filter.covariance.widen(PHI, WRONG_LEVEL);
        self.filter.covariance.widen(PHI + 1, WRONG_LEVEL);
        self.filter.take_standing(noise, found);
        true
    }

    /// The height of the floor so far, once a stance.
    fn floor(&mut self, k: usize, found: &mut Errors) -> bool {
        let Some(stance) = self.plan.stances.get(self.stance) else { return false };
        if k < stance.lowest {
            return false;
        }
        self.stance += 1;
        if !self.level {
            return false;
        }
        let down = -self.filter.motion.height;
        let here = down - found[R + 2];
        let floor = self.floor.filter(|floor| (here - floor).abs() < SAME_FLOOR);
        let Some(floor) = floor else {
            self.floor = Some(here);
            return false;
        };
        let mut h = [0.0; 16];
        h[R + 2] = 1.0;
        self.filter.covariance.correct(&h, down - floor, FLOOR * FLOOR, found);
        true
    }

    /// The bias that a rest tells, at its end.
    fn rest(&mut self, k: usize, found: &mut Errors) -> bool {
        let Some(rest) = self.plan.rests.get(self.rest) else { return false };
        if k + self.plan.every < rest.until && k + self.plan.every < self.plan.gyro.len() {
            return false;
        }
        self.rest += 1;
        let z: Vector3<f64> = rest.rate - self.filter.gyro_bias;
        for i in 0..3 {
            let mut h = [0.0; 16];
            h[GYRO + i] = 1.0;
            self.filter.covariance.correct(&h, z[i], rest.sigma * rest.sigma, found);
        }
        true
    }
}

impl NavigationFilter {
    /// Somewhere on a plane, with these variances.
    fn begin_on_plane<W: Witness>(&mut self, variances: &Errors, witness: &mut W) {
        self.covariance = Covariance::of(variances);
        self.covariance.couple(&self.motion.velocity);
        self.navigating = true;
        self.heading_known = true;
        self.sums = crate::navigation::filter::Sums::new();
        self.refresh_sigma();
        witness.started(&self.covariance, &self.motion);
    }

    /// Takes the velocity for zero, with this noise; what is known of the gyro's bias stays. Returns
    /// what was new, normalised and squared.
    fn take_standing(&mut self, noise: f64, found: &mut Errors) -> f64 {
        let z = self.motion.velocity;
        let mut new = 0.0;
        for i in 0..3 {
            let mut h = [0.0; 16];
            h[V + i] = 1.0;
            new += self.covariance.correct_considering(&h, z[i], noise, found).nis();
        }
        new
    }
}

impl Trodden<'_> {
    #[inline(always)]
    fn put(&mut self, k: usize, filter: &NavigationFilter) {
        let now = filter.snapshot();
        let metres = filter.motion.offset_from([0.0; 3]);
        self.position[k] = if filter.navigating { metres.into() } else { [f64::NAN; 3] };
        self.velocity[k] = now.velocity;
        self.quaternion[k] = now.quaternion;
        self.gyro_bias[k] = now.gyro_bias;
        self.accel_bias[k] = now.accel_bias;
        self.sigma[k] = now.sigma;
    }
}
