//! A whole record: samples and fixes in the order of their times, and the state after each.

use core::ops::Range;

use super::aids::Aid;
use super::covariance::Errors;
use super::filter::{Inertial, NavigationFilter, Observer};
use super::fix::{Fix, Verdict};
use super::odometer::Rolling;
use crate::error::Error;

/// A record of n samples and m fixes.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// Times of the samples, s: (n,).
    pub time: &'a [f64],
    /// Rates, rad/s, or angles: (n,).
    pub gyro: &'a [[f64; 3]],
    /// Specific forces, m/s², or velocities: (n,).
    pub accel: &'a [[f64; 3]],
    /// True if the body is known to rest: (n,); empty means never.
    pub rest: &'a [bool],
    /// Wheel speeds in the order of their times; each is processed after the first sample that is
    /// not earlier.
    pub wheels: &'a [Rolling],
    /// Readings of aids, in the same order, processed after the wheels.
    pub aids: &'a [Aid],
    /// Fixes, in the same order, processed after the aids.
    pub fixes: &'a [Fix],
}

/// Indices of the first wheel speed, reading and fix that are not yet processed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Next {
    wheels: usize,
    aids: usize,
    fixes: usize,
}

/// State after each sample, and verdict on each fix.
#[derive(Debug)]
pub struct Known<'a> {
    /// Position, as in [`Snapshot`](super::Snapshot).
    pub position: &'a mut [[f64; 3]],
    /// Velocity north, east, down, m/s.
    pub velocity: &'a mut [[f64; 3]],
    /// Quaternion, scalar first.
    pub quaternion: &'a mut [[f64; 4]],
    /// Bias of the gyro, rad/s.
    pub gyro_bias: &'a mut [[f64; 3]],
    /// Bias of the accelerometer, m/s².
    pub accel_bias: &'a mut [[f64; 3]],
    /// Standard deviations of the errors.
    pub sigma: &'a mut [Errors],
    /// Number of the [`Status`](super::Status).
    pub status: &'a mut [u8],
    /// Number of the [`Verdict`]; unchanged for a fix after the last sample.
    pub verdict: &'a mut [u8],
    /// Normalised innovations squared of position and velocity; NaN if the fix was refused, has no
    /// such value, or began the track.
    pub nis: &'a mut [[f64; 2]],
    /// Innovations of north, east and down of a position and of a velocity, each after the
    /// corrections by the earlier ones; NaN as for `nis`.
    pub innovation: &'a mut [[f64; 6]],
    /// Standard deviation of `innovation`.
    pub innovation_sigma: &'a mut [[f64; 6]],
    /// Time of the sample after which the fix was processed, s.
    pub taken: &'a mut [f64],
    /// Bits of the usable outputs, in the order of [`OUTPUTS`](super::OUTPUTS).
    pub usable: &'a mut [u8],
    /// Verdict on each reading of an aid, as for a fix.
    pub aid_verdict: &'a mut [u8],
    /// Normalised innovation squared of each reading.
    pub aid_nis: &'a mut [f64],
    /// Time of the sample after which the reading was processed, s.
    pub aid_taken: &'a mut [f64],
}

/// A filter, or a bank that shows one filter.
pub trait Navigates {
    /// Processes the sample with this number.
    ///
    /// # Errors
    /// As in [`NavigationFilter::update`].
    fn take_sample(&mut self, number: usize, sample: &Inertial) -> Result<(), Error>;
    /// Processes the speed of the wheels; true if it will be used.
    ///
    /// # Errors
    /// As in [`NavigationFilter::update_wheels`].
    fn take_speed(&mut self, time: f64, speed: f64, sigma: Option<f64>) -> Result<bool, Error>;
    /// Processes a reading of an aid.
    ///
    /// # Errors
    /// As in [`NavigationFilter::update_aid`].
    fn take_aid(&mut self, aid: &Aid) -> Result<Verdict, Error>;
    /// Processes a fix.
    ///
    /// # Errors
    /// As in [`NavigationFilter::update_gnss`].
    fn take_fix(&mut self, fix: &Fix) -> Result<Verdict, Error>;
    /// The filter that is shown.
    fn filter(&self) -> &NavigationFilter;
}

/// A filter with an observer.
#[derive(Debug)]
pub struct Observed<'a, W> {
    /// The filter.
    pub filter: &'a mut NavigationFilter,
    /// The observer.
    pub observer: &'a mut W,
}

impl Navigates for NavigationFilter {
    #[inline(always)]
    fn take_sample(&mut self, _number: usize, sample: &Inertial) -> Result<(), Error> {
        self.update(sample)
    }

    #[inline(always)]
    fn take_speed(&mut self, time: f64, speed: f64, sigma: Option<f64>) -> Result<bool, Error> {
        self.update_wheels(time, speed, sigma)
    }

    #[inline(always)]
    fn take_aid(&mut self, aid: &Aid) -> Result<Verdict, Error> {
        self.update_aid(aid)
    }

    #[inline(always)]
    fn take_fix(&mut self, fix: &Fix) -> Result<Verdict, Error> {
        self.update_gnss(fix)
    }

    #[inline(always)]
    fn filter(&self) -> &Self {
        self
    }
}

impl<W: Observer> Navigates for Observed<'_, W> {
    #[inline(always)]
    fn take_sample(&mut self, number: usize, sample: &Inertial) -> Result<(), Error> {
        self.observer.sample(number);
        self.filter.update_before(sample, self.observer)
    }

    #[inline(always)]
    fn take_speed(&mut self, time: f64, speed: f64, sigma: Option<f64>) -> Result<bool, Error> {
        self.filter.update_wheels(time, speed, sigma)
    }

    #[inline(always)]
    fn take_aid(&mut self, aid: &Aid) -> Result<Verdict, Error> {
        self.filter.update_aid_before(aid, self.observer)
    }

    #[inline(always)]
    fn take_fix(&mut self, fix: &Fix) -> Result<Verdict, Error> {
        self.filter.update_gnss_before(fix, self.observer)
    }

    #[inline(always)]
    fn filter(&self) -> &NavigationFilter {
        self.filter
    }
}

impl Batch<'_> {
    /// Processes a piece of the samples, and the wheel speeds, readings and fixes that are due,
    /// from `next` on.
    ///
    /// # Errors
    /// As in [`NavigationFilter::update`], [`NavigationFilter::update_aid`] and
    /// [`NavigationFilter::update_gnss`].
    pub fn run<N: Navigates>(
        &self,
        navigator: &mut N,
        piece: Range<usize>,
        next: &mut Next,
        known: &mut Known<'_>,
    ) -> Result<(), Error> {
        for k in piece {
            let rest = self.rest.get(k).copied().unwrap_or(false);
            let (time, gyro, accel) = (self.time[k], self.gyro[k], self.accel[k]);
            navigator.take_sample(k, &Inertial { time, gyro, accel, rest })?;
            while let Some(rolling) = self.wheels.get(next.wheels).filter(|one| one.time <= time) {
                let sigma = Some(rolling.sigma).filter(|sigma| !sigma.is_nan());
                navigator.take_speed(rolling.time, rolling.speed, sigma)?;
                next.wheels += 1;
            }
            while let Some(aid) = self.aids.get(next.aids).filter(|aid| aid.time <= time) {
                let verdict = navigator.take_aid(aid)?;
                known.record_aid(next.aids, aid, verdict, navigator.filter());
                next.aids += 1;
            }
            while let Some(fix) = self.fixes.get(next.fixes).filter(|fix| fix.time <= time) {
                let verdict = navigator.take_fix(fix)?;
                known.record_verdict(next.fixes, fix, verdict, navigator.filter());
                next.fixes += 1;
            }
            known.put(k, navigator.filter());
        }
        Ok(())
    }
}

impl Known<'_> {
    #[inline(always)]
    fn put(&mut self, k: usize, filter: &NavigationFilter) {
        let now = filter.snapshot();
        self.position[k] = now.position;
        self.velocity[k] = now.velocity;
        self.quaternion[k] = now.quaternion;
        self.gyro_bias[k] = now.gyro_bias;
        self.accel_bias[k] = now.accel_bias;
        self.sigma[k] = now.sigma;
        self.status[k] = now.status as u8;
        self.usable[k] = now.usable;
    }

    fn record_aid(&mut self, k: usize, aid: &Aid, verdict: Verdict, filter: &NavigationFilter) {
        self.aid_verdict[k] = verdict as u8;
        self.aid_taken[k] = filter.time();
        if verdict != Verdict::Refused {
            self.aid_nis[k] = filter.aids()[aid.sensor()].nis;
        }
    }

    fn record_verdict(&mut self, k: usize, fix: &Fix, verdict: Verdict, filter: &NavigationFilter) {
        self.verdict[k] = verdict as u8;
        self.taken[k] = filter.time();
        if verdict != Verdict::Refused {
            // A height or a vertical velocity may be missing.
            let present =
                [&fix.position, &fix.velocity].map(|x| x[..2].iter().all(|x| !x.is_nan()));
            let (nis, new) = (filter.nis(), filter.innovations());
            for (kind, _) in present.iter().enumerate().filter(|(_, present)| **present) {
                self.nis[k][kind] = nis[kind];
                let part = 3 * kind..3 * kind + 3;
                self.innovation[k][part.clone()].copy_from_slice(&new[0][part.clone()]);
                self.innovation_sigma[k][part.clone()].copy_from_slice(&new[1][part]);
            }
        }
    }
}
