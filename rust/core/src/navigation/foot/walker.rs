//! The navigation filter with aids from a foot: zero velocity, height of the floor, and gyro bias.

use nalgebra::{ComplexField, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::beginning::{Beginning, valley_level};
use super::{DEGREE, GRAVITY};
use crate::checkpoint::Checkpoint;
use crate::error::Error;
use crate::math::validity::{is_count, is_size, is_within};
use crate::navigation::covariance::{Covariance, Errors, GYRO, PHI, R, STATES, V};
use crate::navigation::earth::LocalEarth;
use crate::navigation::filter::{Inertial, NavigationFilter, Observer, Sums, quaternion};
use crate::navigation::motion::{Motion, rotation};
use crate::navigation::params::{Adapt, AidParams, Kind, NavigationParams, Start};
use crate::navigation::usable::LIMITS;

/// Squared white noise of gyro, rad²/s, and accelerometer, m²/s³, and random walks of their biases.
const GYRO_NOISE: f64 = 0.05 * DEGREE * 0.05 * DEGREE;
const ACCEL_NOISE: f64 = 0.03 * 0.03;
const GYRO_WALK: f64 = 1e-14;
const ACCEL_WALK: f64 = 1e-4;
/// Squared noise relative to rate and shock: scale, misalignment and bandwidth.
const RATE_NOISE: f64 = 0.001 * 0.001;
const SHOCK_NOISE: f64 = 0.015 * 0.015;
/// Standard deviation of the initial position, m.
const POSITION_SIGMA_M: f64 = 1e-5;
/// Standard deviation of a standing foot's velocity, m/s; bound above which it hardly stands; and
/// duration of its roll, s.
const STANCE_SIGMA_M_S: f64 = 0.003;
const MAX_STANCE_SPEED_M_S: f64 = 0.1;
const ROLL_S: f64 = 0.05;
/// Largest normalised innovation squared of a stance, of three degrees of freedom.
const MAX_STANCE_NIS: f64 = 100.0;
/// Time of rejections after which the filter is wrong, s, and variance that is added to its level,
/// rad².
const MAX_REJECTION_S: f64 = 0.15;
const WRONG_LEVEL_VARIANCE_RAD2: f64 = 1e-3;
/// Largest interval between two such failures, s, after which the level is wrong and follows from
/// the force.
const MAX_WRONG_LEVEL_S: f64 = 20.0;
/// Variance of an unknown heading, rad².
const UNKNOWN_HEADING_VARIANCE_RAD2: f64 = core::f64::consts::PI * core::f64::consts::PI / 3.0;
/// Largest step between stances on the same floor, m, and its standard deviation, m.
const MAX_FLOOR_STEP_M: f64 = 0.1;
const FLOOR_SIGMA_M: f64 = 0.02;
/// Standard deviation of a foot's velocity while it is unknown, m/s.
const UNKNOWN_SPEED_M_S: f64 = 2.0;
/// Bounds of a valid state: heights, m, and times, s.
const MAX_HEIGHT_M: f64 = 3e6;
const MAX_TIME_S: f64 = 4e9;

/// Filter of a sensor on a foot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Walker {
    pub filter: NavigationFilter,
    /// Time of rejections in a row, s, and number of rejections.
    rejected: f64,
    pub rejections: u64,
    floor: Option<f64>,
    /// Additional noise since the last node, rad² and m²/s².
    extra: [f64; 2],
    /// Time at which the filter was lost, s; NaN if it never was.
    lost: f64,
    /// Time of the last failure, s, NaN without one; and number of times the level was corrected.
    wrong: f64,
    pub relevelled: u64,
    /// Vertical velocity at the last stance before its correction, m/s, and its standard deviation.
    pub sink: [f64; 2],
}

/// Variance of a zero velocity, m²/s², for stances `seconds` apart.
pub(super) fn stance_noise(bound: f64, seconds: f64) -> f64 {
    let part = bound / MAX_STANCE_SPEED_M_S;
    let independent = if ROLL_S > seconds { ROLL_S / seconds } else { 1.0 };
    (STANCE_SIGMA_M_S * STANCE_SIGMA_M_S + bound * bound * (1.0 + part * part)) * independent
}

impl Walker {
    /// Begins at a sample, rad/s and m/s².
    ///
    /// # Errors
    /// [`Error::Parameter`] if the time is not a number.
    pub fn begin<W: Observer>(
        from: &Beginning,
        time: f64,
        [gyro, accel]: [[f64; 3]; 2],
        observer: &mut W,
    ) -> Result<Self, Error> {
        let start = Start {
            quaternion: quaternion(&from.attitude),
            heading_known: true,
            course: false,
            time,
            latitude: 0.0,
            gyro_bias: from.gyro_bias.into(),
            accel_bias: from.accel_bias.into(),
            level_sigma: from.level,
            heading_sigma: from.heading,
            gyro_bias_sigma: from.gyro,
            accel_bias_sigma: from.accel,
        };
        let params = NavigationParams {
            gyro_noise: [GYRO_NOISE; 3],
            accel_noise: [ACCEL_NOISE; 3],
            gyro_walk: [GYRO_WALK; 3],
            accel_walk: [ACCEL_WALK; 3],
            gyro_vibration: 0.0,
            antenna: [0.0; 3],
            antenna_sigma: [0.0; 3],
            consider_antenna: false,
            wheels: None,
            gate: MAX_STANCE_NIS,
            adapt: Adapt::Fixed,
            // The nodes are counted elsewhere, in samples.
            covariance_step: 1.0,
            kind: Kind::Rate,
            aids: AidParams::default(),
            limits: LIMITS,
        };
        let mut filter = NavigationFilter::new(start, params)?;
        filter.update(&Inertial { time, gyro, accel, rest: false })?;
        filter.motion.attitude = from.attitude;
        filter.motion.local_earth = LocalEarth::plane(GRAVITY);
        let of = |first: usize| match first {
            R => POSITION_SIGMA_M,
            V => from.velocity,
            PHI => from.level,
            GYRO => from.gyro,
            _ => from.accel,
        };
        let mut variances: Errors = core::array::from_fn(|i| of(i - i % 3) * of(i - i % 3));
        variances[PHI + 2] = from.heading * from.heading;
        filter.begin_on_plane(&variances, observer);
        Ok(Self {
            filter,
            rejected: 0.0,
            rejections: 0,
            floor: None,
            extra: [0.0; 2],
            lost: f64::NAN,
            wrong: f64::NAN,
            relevelled: 0,
            sink: [0.0; 2],
        })
    }

    /// Processes one sample, NaN if missing; the gyro has this additional noise, rad²/s.
    ///
    /// # Errors
    /// [`Error::Parameter`] if its time is not later than the previous time.
    #[inline(always)]
    pub fn step<W: Observer>(
        &mut self,
        sample: &Inertial,
        variance: f64,
        observer: &mut W,
    ) -> Result<(), Error> {
        let (was, before) = (self.filter.navigating, self.filter.sensors.time);
        self.filter.update_before(sample, observer)?;
        if was && !self.filter.navigating {
            self.lost = before;
        }
        let known = |of: &[f64; 3]| of.iter().all(|x| x.is_finite());
        if !self.filter.navigating && known(&sample.gyro) && known(&sample.accel) {
            self.resume(sample.time, observer);
        }
        let dt = sample.time - before;
        // Noise relative to rate and shock, and noise of restored rates.
        let rate = self.filter.sensors.gyro - self.filter.gyro_bias;
        let shock = self.filter.sensors.accel.norm() - GRAVITY;
        self.extra[0] += (RATE_NOISE * rate.norm_squared() + variance) * dt;
        self.extra[1] += SHOCK_NOISE * shock * shock * dt;
        Ok(())
    }

    /// Continues after a gap: the same position, with a larger variance.
    #[cold]
    fn resume<W: Observer>(&mut self, time: f64, observer: &mut W) {
        let since = time - self.lost;
        let far = UNKNOWN_SPEED_M_S * if since > 0.0 { since } else { 0.0 } + POSITION_SIGMA_M;
        let filter = &mut self.filter;
        filter.stop_at(filter.motion.attitude);
        let mut variances: Errors = core::array::from_fn(|i| filter.covariance.at(i, i));
        for i in 0..3 {
            variances[R + i] = far * far;
            variances[V + i] = UNKNOWN_SPEED_M_S * UNKNOWN_SPEED_M_S;
        }
        filter.begin_on_plane(&variances, observer);
        (self.rejected, self.floor) = (0.0, None);
    }

    /// Propagate the covariance. Returns false if the position is unknown.
    #[inline(always)]
    pub fn propagate<W: Observer>(&mut self, observer: &mut W) -> bool {
        let extra = core::mem::take(&mut self.extra);
        let was = self.filter.navigating;
        self.filter.propagate_with(extra, observer);
        self.note_lost(was);
        self.filter.navigating
    }

    /// Subtracts estimated errors from the motion.
    #[inline(always)]
    pub fn apply<W: Observer>(&mut self, found: &Errors, observer: &mut W) {
        let was = self.filter.navigating;
        self.filter.apply(found, observer);
        self.note_lost(was);
    }

    /// A filter that is lost now was lost since the two sensors were last present.
    #[inline(always)]
    fn note_lost(&mut self, was: bool) {
        if was && !self.filter.navigating {
            let sensors = &self.filter.sensors;
            let [gyro, accel] = [sensors.gyro_age, sensors.accel_age];
            self.lost = sensors.time - if gyro > accel { gyro } else { accel };
        }
    }

    /// Corrects by zero velocity, if plausible, `seconds` after the previous node, with the mean
    /// force there.
    pub fn stand<W: Observer>(
        &mut self,
        bound: f64,
        seconds: f64,
        force: impl FnOnce() -> Vector3<f64>,
        found: &mut Errors,
        observer: &mut W,
    ) -> bool {
        let noise = stance_noise(bound, seconds);
        let before = self.filter.covariance;
        self.sink =
            [self.filter.motion.velocity.z, ComplexField::sqrt(before.at(V + 2, V + 2) + noise)];
        if self.filter.take_standing(noise, found) <= MAX_STANCE_NIS {
            self.rejected = 0.0;
            return true;
        }
        (self.filter.covariance, *found) = (before, [0.0; STATES]);
        self.rejected += seconds;
        self.rejections += 1;
        if self.rejected <= MAX_REJECTION_S {
            return false;
        }
        self.rejected = 0.0;
        let since = self.filter.sensors.time
            - core::mem::replace(&mut self.wrong, self.filter.sensors.time);
        if since < MAX_WRONG_LEVEL_S {
            self.relevel(&force(), since, (bound, noise), observer);
            return false;
        }
        let square = self.filter.motion.velocity.norm_squared();
        for i in 0..3 {
            self.filter.covariance.widen(V + i, square);
            self.filter.covariance.widen(R + i, 0.25 * square);
        }
        self.filter.covariance.widen(PHI, WRONG_LEVEL_VARIANCE_RAD2);
        self.filter.covariance.widen(PHI + 1, WRONG_LEVEL_VARIANCE_RAD2);
        self.filter.take_standing(noise, found);
        true
    }

    /// Begins again at the same position, standing. The force gives the level by the smallest
    /// rotation, whose size is the uncertainty of the heading.
    #[cold]
    fn relevel<W: Observer>(
        &mut self,
        force: &Vector3<f64>,
        since: f64,
        (bound, noise): (f64, f64),
        observer: &mut W,
    ) {
        let filter = &mut self.filter;
        let down = filter.motion.attitude * -force;
        let across = down.cross(&Vector3::z());
        let (sine, size) = (across.norm(), down.norm());
        if !(sine > 0.0 && size > 0.0) {
            return;
        }
        let angle = nalgebra::RealField::atan2(sine, down.z);
        filter.stop_at(rotation(&(across * (angle / sine))) * filter.motion.attitude);
        let mut variances: Errors = core::array::from_fn(|i| filter.covariance.at(i, i));
        let (far, level) = (UNKNOWN_SPEED_M_S * since, valley_level(bound));
        for i in 0..3 {
            variances[R + i] += far * far;
            variances[V + i] = noise;
            variances[PHI + i] = level * level;
        }
        let heading = filter.covariance.at(PHI + 2, PHI + 2) + angle * angle;
        variances[PHI + 2] = if heading < UNKNOWN_HEADING_VARIANCE_RAD2 {
            heading
        } else {
            UNKNOWN_HEADING_VARIANCE_RAD2
        };
        filter.begin_on_plane(&variances, observer);
        self.relevelled += 1;
        self.floor = None;
        self.wrong = f64::NAN;
    }

    /// Corrects by the height of the present floor, once per stance.
    pub fn take_floor(&mut self, found: &mut Errors) -> bool {
        let down = -self.filter.motion.height;
        let here = down - found[R + 2];
        let floor = self.floor.filter(|floor| (here - floor).abs() < MAX_FLOOR_STEP_M);
        let Some(floor) = floor else {
            self.floor = Some(here);
            return false;
        };
        let mut h = [0.0; 16];
        h[R + 2] = 1.0;
        self.filter.covariance.correct(
            &h,
            down - floor,
            FLOOR_SIGMA_M * FLOOR_SIGMA_M,
            found,
            &mut (),
        );
        true
    }

    /// Corrects by the gyro bias of a rest.
    pub fn take_rest(&mut self, rate: &Vector3<f64>, sigma: f64, found: &mut Errors) {
        let z = rate - self.filter.gyro_bias;
        for i in 0..3 {
            let mut h = [0.0; 16];
            h[GYRO + i] = 1.0;
            self.filter.covariance.correct(&h, z[i], sigma * sigma, found, &mut ());
        }
    }

    /// Position: ahead, right and down of the start, m; NaN if it is unknown.
    pub fn position(&self) -> [f64; 3] {
        match self.filter.navigating {
            true => self.filter.motion.offset_from([0.0; 3]).into(),
            false => [f64::NAN; 3],
        }
    }

    /// True if samples can have led to this state.
    pub fn is_valid(&self) -> bool {
        self.filter.is_valid()
            && is_size(self.rejected, 2.0 * MAX_REJECTION_S)
            && is_count(self.rejections)
            && self.floor.is_none_or(|floor| is_within(floor, MAX_HEIGHT_M))
            && self.extra.iter().all(|x| is_size(*x, 1e9))
            && [self.lost, self.wrong].iter().all(|t| t.is_nan() || is_within(*t, 2.0 * MAX_TIME_S))
            && is_count(self.relevelled)
            && self.sink.iter().all(|x| x.is_finite())
    }
}

impl NavigationFilter {
    /// Stops at the same position, with this attitude.
    fn stop_at(&mut self, attitude: Matrix3<f64>) {
        let motion = &self.motion;
        let mut stopped = Motion::new(attitude, 0.0, 0.0, 0.0);
        (stopped.latitude, stopped.longitude, stopped.height) =
            (motion.latitude, motion.longitude, motion.height);
        stopped.local_earth = LocalEarth::plane(GRAVITY);
        self.motion = stopped;
    }

    /// Begins at an unknown position on a plane, with these variances.
    fn begin_on_plane<W: Observer>(&mut self, variances: &Errors, observer: &mut W) {
        self.covariance = Covariance::of(variances);
        self.covariance.couple(&self.motion.velocity);
        self.navigating = true;
        self.heading_known = true;
        self.sums = Sums::new();
        self.refresh_sigma();
        observer.record_start(&self.covariance, &self.motion);
    }

    /// Corrects by zero velocity with this noise; the estimate of the gyro's bias does not change.
    /// Returns the normalised innovation squared.
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
