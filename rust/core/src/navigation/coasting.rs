//! The clone of a filter that coasts without fixes, and the likelihood of its errors.
//!
//! Two values are kept: the difference of the clone from the filter, to first order, and the
//! clone's own covariance. They follow the steps of the filter, and each correction of the filter
//! adds to the difference. The clone's innovation is the filter's innovation plus the effect of the
//! difference. Its likelihood is Student's, scaled to the clone's covariance (K. L. Lange, R. J. A.
//! Little, J. M. G. Taylor, *J. American Statistical Association* 84, 1989).

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::covariance::{
    CONSTANTS, Constants, Covariance, Errors, Growth, PHI, Row, STATES, Transition,
};
use super::filter::{MAX_SIZES, Observer};
use super::motion::Motion;
use crate::math::validity::{is_size, is_within};
use crate::math::{Elementary, Fours, Pairs};

/// Times after which a clone is compared with the fixes, s.
const COASTS_S: [f64; LENGTHS] = [2.0, 5.0, 10.0];
const LENGTHS: usize = 3;
/// Longest time that a clone waits for a fix that is due, s, and tolerance of a sum of steps.
const MAX_WAIT_S: f64 = 1.5;
const TOLERANCE_S: f64 = 1e-6;
/// Standard deviation of the heading, rad, above which differences are not linear.
const MAX_HEADING_SIGMA_RAD: f64 = 0.15;
/// Degrees of freedom of the errors' distribution.
const STUDENT: f64 = 8.0;
/// Time constant with which likelihoods fade.
const FADING_S: f64 = 300.0;
/// Largest difference of a clone, SI.
const MAX_DIFFERENCE: f64 = 1e9;
/// Smallest determinant of a covariance of two values, SI: fixes of a tenth of a micrometre.
const MIN_DETERMINANT: f64 = 1e-28;
/// Bounds of a log likelihood, and of the sum of faded weights: six in ten seconds.
const MAX_LOG_LIKELIHOOD: f64 = 1e3;
const MAX_WEIGHT: f64 = 200.0;

/// A position or velocity that a filter uses, before it corrects the filter.
#[derive(Debug, Clone, Copy)]
pub struct TakenFix {
    /// Kind: 0 is a position, 1 a velocity.
    pub(crate) kind: usize,
    /// Time of the filter, s.
    pub(crate) time: f64,
    pub(crate) z: Vector3<f64>,
    /// Derivatives by the errors, and by the constants.
    pub(crate) rows: [Row; 3],
    pub(crate) constants: [Constants; 3],
    /// Variances of the measurement.
    pub(crate) noise: [f64; 3],
}

/// A clone that has left its filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Departed {
    covariance: Covariance,
    /// Errors of the clone minus the errors of the filter.
    errors: Errors,
    constants: Constants,
    /// Time since the clone's last fix, s.
    seconds: f64,
    /// Index of the next length for positions and velocities.
    next: [u8; 2],
}

/// Mean of faded log likelihoods.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Score {
    sum: f64,
    weight: f64,
    /// Time of the last likelihood, s; NaN before the first.
    time: f64,
}

/// Observer of a filter: one clone after another, and the likelihood of their errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Coasting {
    clone: Option<Departed>,
    /// True if a clone begins with the present correction.
    begins: bool,
    pub score: Score,
}

impl Coasting {
    pub fn new() -> Self {
        let score = Score { sum: 0.0, weight: 0.0, time: f64::NAN };
        Self { clone: None, begins: false, score }
    }

    fn stop(&mut self) {
        (self.clone, self.begins) = (None, false);
    }

    pub fn is_valid(&self) -> bool {
        self.clone.is_none_or(|clone| clone.is_valid()) && self.score.is_valid()
    }
}

impl Observer for Coasting {
    const TAKES_FIXES: bool = true;

    #[inline]
    fn record_growth(&mut self, transition: &Transition, growth: &Growth, seconds: f64) {
        if let Some(clone) = &mut self.clone {
            clone.propagate(transition, growth, seconds);
            if !clone.is_bounded() || clone.is_over() {
                self.clone = None;
            }
        }
    }

    fn record_fix(&mut self, fix: &TakenFix) {
        if let Some(clone) = &mut self.clone {
            if let Some(likelihood) = clone.compare(fix) {
                self.score.add(likelihood, fix.time);
            }
            self.begins = clone.is_over();
        } else {
            self.begins = true;
        }
    }

    fn record_constants(&mut self, constants: &Constants) {
        if let Some(clone) = &mut self.clone {
            clone.constants.iter_mut().zip(constants).for_each(|(all, more)| *all += more);
        }
    }

    fn record_correction(&mut self, found: &Errors, covariance: &Covariance, _: &Motion) {
        if core::mem::take(&mut self.begins) {
            let heading = covariance.at(PHI + 2, PHI + 2);
            let known = heading < MAX_HEADING_SIGMA_RAD * MAX_HEADING_SIGMA_RAD;
            self.clone = known.then(|| Departed::of(covariance));
        } else if let Some(clone) = &mut self.clone {
            clone.errors.iter_mut().zip(found).for_each(|(all, more)| *all += more);
            if !clone.is_bounded() {
                self.clone = None;
            }
        }
    }

    fn record_step(&mut self, _: &Transition, _: &Covariance, _: &Motion) {}

    fn mark_widened(&mut self) {
        self.stop();
    }

    fn mark_return(&mut self) {
        self.stop();
    }

    fn record_start(&mut self, _: &Covariance, _: &Motion) {
        self.stop();
    }
}

impl Departed {
    fn of(covariance: &Covariance) -> Self {
        let (errors, constants) = ([0.0; STATES], [0.0; CONSTANTS]);
        Self { covariance: *covariance, errors, constants, seconds: 0.0, next: [0; 2] }
    }

    fn propagate(&mut self, transition: &Transition, growth: &Growth, seconds: f64) {
        self.errors = transition.apply(&self.errors);
        self.covariance.propagate(transition, growth);
        self.seconds += seconds;
    }

    /// Log likelihood of the horizontal innovation of a fix that is due.
    fn compare(&mut self, fix: &TakenFix) -> Option<f64> {
        let next = self.next.get_mut(fix.kind)?;
        let due = *COASTS_S.get(usize::from(*next))?;
        if self.seconds < due - TOLERANCE_S {
            return None;
        }
        if self.seconds > due + MAX_WAIT_S {
            *next = LENGTHS as u8;
            return None;
        }
        *next += 1;
        self.log_likelihood(fix)
    }

    fn log_likelihood(&self, fix: &TakenFix) -> Option<f64> {
        let all = [0, 1].map(|i| (&fix.rows[i], &fix.constants[i]));
        let [(z, s), (y, t)] = [0, 1].map(|i| {
            let (h, hw) = all[i];
            let moved = sum(&self.errors, h) + sum(&self.constants, hw);
            let (gain, own) = self.gain(h, hw);
            let variances = all.map(|(h, hw)| sum(&gain, h) + sum(&own, hw));
            (fix.z[i] + moved, variances)
        });
        let (p, q, r) = (s[0] + fix.noise[0], t[1] + fix.noise[1], 0.5 * (s[1] + t[0]));
        let determinant = p * q - r * r;
        let nis = (z * z * q - 2.0 * z * y * r + y * y * p) / determinant;
        let tail = (STUDENT + 2.0) * (1.0 + nis / (STUDENT - 2.0)).logarithm();
        let found = -0.5 * (determinant.logarithm() + tail);
        let known = determinant > MIN_DETERMINANT && nis >= 0.0;
        (known && found.abs() <= MAX_LOG_LIKELIHOOD).then_some(found)
    }

    /// Covariances of the errors and of the constants with a scalar.
    fn gain(&self, h: &Row, hw: &Constants) -> (Row, Constants) {
        let gain = Pairs.sum([0.0; 16], h, &self.covariance.0);
        match &self.covariance.1 {
            None => (gain, [0.0; CONSTANTS]),
            Some(extra) => (Pairs.sum(gain, hw, &extra.cross), extra.gain::<CONSTANTS>(h, hw)),
        }
    }

    /// True if no later fix is compared.
    fn is_over(&self) -> bool {
        self.next.iter().all(|next| {
            let due = COASTS_S.get(usize::from(*next));
            due.is_none_or(|due| self.seconds > due + MAX_WAIT_S)
        })
    }

    fn is_bounded(&self) -> bool {
        let sizes = self.covariance.sizes();
        sizes.iter().zip(MAX_SIZES).all(|(size, most)| *size < most)
            && self.errors.iter().chain(&self.constants).all(|x| is_within(*x, MAX_DIFFERENCE))
    }

    fn is_valid(&self) -> bool {
        let lengths = |next: &u8| usize::from(*next) <= LENGTHS;
        self.covariance.is_valid()
            && self.is_bounded()
            && is_size(self.seconds, COASTS_S[LENGTHS - 1] + MAX_WAIT_S)
            && self.next.iter().all(lengths)
    }
}

fn sum(numbers: &[f64], factors: &[f64]) -> f64 {
    numbers.iter().zip(factors).map(|(number, factor)| number * factor).sum()
}

impl Score {
    fn add(&mut self, log_likelihood: f64, time: f64) {
        let kept = self.fading(time);
        self.sum = self.sum * kept + log_likelihood;
        self.weight = self.weight * kept + 1.0;
        self.time = time;
    }

    fn fading(&self, time: f64) -> f64 {
        // The time is NaN before the first likelihood.
        let seconds = if time > self.time { time - self.time } else { 0.0 };
        (-seconds / FADING_S).max(-80.0).exponential()
    }

    /// Number of likelihoods, faded to a time.
    pub fn weight(&self, time: f64) -> f64 {
        self.weight * self.fading(time)
    }

    /// Mean log likelihood; NaN before the first.
    pub fn mean(&self) -> f64 {
        self.sum / self.weight
    }

    fn is_valid(&self) -> bool {
        let Self { sum, weight, time } = *self;
        let begun = weight >= 1.0 && is_within(time, MAX_TIME);
        let sized = is_size(weight, MAX_WEIGHT) && is_within(sum, MAX_LOG_LIKELIHOOD * weight);
        sized && (begun || (weight == 0.0 && time.is_nan()))
    }
}

const MAX_TIME: f64 = 4e9;

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::covariance::{R, STATES};
    use super::super::{
        Adapt, AidParams, Fix, Inertial, Kind, LIMITS, NavigationFilter, NavigationParams, Start,
    };
    use super::Coasting;

    fn filter(antenna_sigma: f64) -> NavigationFilter {
        let start = Start {
            quaternion: [1.0, 0.0, 0.0, 0.0],
            heading_known: true,
            course: false,
            time: 0.0,
            latitude: 0.8,
            gyro_bias: [0.0; 3],
            accel_bias: [0.0; 3],
            level_sigma: 0.02,
            heading_sigma: 0.1,
            gyro_bias_sigma: 1e-3,
            accel_bias_sigma: 0.05,
        };
        let params = NavigationParams {
            gyro_noise: [1e-6; 3],
            accel_noise: [4e-4; 3],
            gyro_walk: [1e-10; 3],
            accel_walk: [2.5e-7; 3],
            gyro_vibration: 0.0,
            antenna: [0.0; 3],
            antenna_sigma: [antenna_sigma; 3],
            consider_antenna: false,
            wheels: None,
            gate: 50.0,
            adapt: Adapt::Fixed,
            covariance_step: 0.1,
            kind: Kind::Rate,
            aids: AidParams::default(),
            limits: LIMITS,
        };
        NavigationFilter::new(start, params).expect("parameters in their ranges")
    }

    /// A body that sways for some seconds, with a fix every half second, `noise` m off its filter,
    /// and copies of the filter without fixes. Calls `check` before the last fix of each clone.
    fn sway(
        antenna_sigma: f64,
        noise: f64,
        mut check: impl FnMut(&NavigationFilter, &NavigationFilter, &super::Departed),
    ) -> Coasting {
        let mut nav = filter(antenna_sigma);
        let (mut copy, mut coasting) = (nav, Coasting::new());
        for k in 0..3000_u32 {
            let time = 0.02 * f64::from(k);
            let sway = (0.7 * time).sin();
            let (gyro, accel) = ([0.05 * sway, 0.02, 0.1], [0.8 * sway, 0.3, -9.81]);
            let sample = Inertial { time, gyro, accel, rest: false };
            nav.update_before(&sample, &mut coasting).expect("in order");
            copy.update(&sample).expect("in order");
            if k % 25 > 0 {
                continue;
            }
            let known = nav.snapshot().position;
            let here = if known[0].is_nan() { [0.8, 0.1, 100.0] } else { known };
            let off = [13, 17, 11].map(|m| noise * (f64::from(k * 7919 % m) / f64::from(m) - 0.46));
            let fix = Fix {
                time,
                position: [here[0] + off[0] / 6.4e6, here[1] + off[1] / 4.5e6, here[2] + off[2]],
                velocity: [f64::NAN; 3],
                position_sigma: [0.5; 3],
                velocity_sigma: [0.1; 3],
            };
            let before = coasting.clone;
            if let Some(clone) = before.filter(|clone| clone.seconds > 9.99) {
                check(&nav, &copy, &clone);
            }
            nav.update_gnss_before(&fix, &mut coasting).expect("a fix");
            if coasting.clone.is_some_and(|clone| clone.seconds == 0.0) {
                copy = nav;
            }
        }
        coasting
    }

    #[test]
    fn a_clone_has_the_covariance_of_a_copy_without_fixes() {
        for antenna_sigma in [0.0, 0.1] {
            let mut clones = 0;
            sway(antenna_sigma, 0.0, |_, copy, clone| {
                clones += 1;
                assert!(clone.errors.iter().all(|x| x.abs() < 1e-9), "{:?}", clone.errors);
                for i in 0..STATES {
                    for j in 0..STATES {
                        let p = &copy.covariance;
                        let size = (p.at(i, i) * p.at(j, j)).sqrt();
                        let off = clone.covariance.at(i, j) - p.at(i, j);
                        assert!(off.abs() <= 1e-12 * size, "{i} {j}: {off:e} of {size:e}");
                    }
                }
            });
            assert!(clones > 3, "{clones}");
        }
    }

    #[test]
    fn a_clone_is_where_a_copy_without_fixes_is() {
        let (mut clones, mut squares) = (0, [0.0; 2]);
        let coasting = sway(0.0, 2.0, |nav, copy, clone| {
            let known = nav.snapshot().position;
            let apart = copy.motion.offset_from(known);
            let found = Vector3::new(clone.errors[R], clone.errors[R + 1], clone.errors[R + 2]);
            clones += 1;
            squares[0] += (found - apart).norm_squared();
            squares[1] += apart.norm_squared();
        });
        assert!(clones > 3, "{clones}");
        assert!(squares[0] < 0.05 * 0.05 * squares[1], "{squares:?}");
        assert!(coasting.is_valid() && coasting.score.weight > 10.0);
    }
}
