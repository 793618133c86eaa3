//! A bank of four filters with different noise of the sensors; the filter with the likeliest errors
//! while coasting is shown.

use serde::{Deserialize, Serialize};

use super::aids::Aid;
use super::batch::Navigates;
use super::coasting::Coasting;
use super::event::Event;
use super::filter::{Inertial, NavigationFilter, Snapshot};
use super::fix::{Fix, Verdict};
use super::params::{NavigationParams, Start};
use crate::checkpoint::Checkpoint;
use crate::error::Error;
use crate::math::Elementary;
use crate::stream::Stream;

/// Number of filters.
const FILTERS: usize = 4;
/// Factors on the white noise of gyro and accelerometer of each filter.
pub const NOISE_FACTORS: [[f64; 2]; FILTERS] = [[1.0, 1.0], [3.0, 1.0], [1.0, 5.0], [3.0, 5.0]];
/// Smallest share of the other filters' comparisons for a filter that is shown.
const MIN_WEIGHT_SHARE: f64 = 0.5;

/// Four filters, each with a clone that coasts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NavigationBank {
    filters: [NavigationFilter; FILTERS],
    coasting: [Coasting; FILTERS],
    /// Index of the filter that is shown.
    shown: u8,
}

impl NavigationBank {
    /// A bank before its first sample; `params` are the parameters of its first filter.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a parameter is out of range.
    pub fn new(start: Start, params: NavigationParams) -> Result<Self, Error> {
        let mut filters = [NavigationFilter::new(start, params)?; FILTERS];
        for (filter, factors) in filters.iter_mut().zip(NOISE_FACTORS).skip(1) {
            *filter = NavigationFilter::new(start, scaled(&params, factors))?;
        }
        Ok(Self { filters, coasting: [Coasting::new(); FILTERS], shown: 0 })
    }

    /// Resets to the state before the first sample.
    pub fn reset(&mut self) {
        self.filters.iter_mut().for_each(NavigationFilter::reset);
        (self.coasting, self.shown) = ([Coasting::new(); FILTERS], 0);
    }

    /// Processes one sample of the sensors.
    ///
    /// # Errors
    /// As in [`NavigationFilter::update`].
    #[inline]
    pub fn update(&mut self, sample: &Inertial) -> Result<(), Error> {
        // The first filter refuses the same samples as all filters.
        for (filter, coasting) in self.filters.iter_mut().zip(&mut self.coasting) {
            filter.update_before(sample, coasting)?;
        }
        Ok(())
    }

    /// Processes a fix; the verdict belongs to the filter that is shown afterwards.
    ///
    /// # Errors
    /// As in [`NavigationFilter::update_gnss`].
    pub fn update_gnss(&mut self, fix: &Fix) -> Result<Verdict, Error> {
        let mut verdicts = [Verdict::Refused; FILTERS];
        for (i, filter) in self.filters.iter_mut().enumerate() {
            verdicts[i] = filter.update_gnss_before(fix, &mut self.coasting[i])?;
        }
        let weights = self.log_weights();
        for (i, weight) in weights.iter().enumerate() {
            if *weight > weights[usize::from(self.shown)] {
                self.shown = i as u8;
            }
        }
        Ok(verdicts[usize::from(self.shown)])
    }

    /// Processes the speed of the wheels; true if the shown filter will use it.
    ///
    /// # Errors
    /// As in [`NavigationFilter::update_wheels`].
    pub fn update_wheels(
        &mut self,
        time: f64,
        speed: f64,
        sigma: Option<f64>,
    ) -> Result<bool, Error> {
        let mut used = [false; FILTERS];
        for (used, filter) in used.iter_mut().zip(&mut self.filters) {
            *used = filter.update_wheels(time, speed, sigma)?;
        }
        Ok(used[usize::from(self.shown)])
    }

    /// Processes a reading of an aid; the verdict belongs to the shown filter.
    ///
    /// # Errors
    /// As in [`NavigationFilter::update_aid`].
    pub fn update_aid(&mut self, aid: &Aid) -> Result<Verdict, Error> {
        let mut verdicts = [Verdict::Refused; FILTERS];
        for (i, filter) in self.filters.iter_mut().enumerate() {
            verdicts[i] = filter.update_aid_before(aid, &mut self.coasting[i])?;
        }
        Ok(verdicts[usize::from(self.shown)])
    }

    /// Logarithms of the weights: half the sum of the faded likelihoods, since coasts of different
    /// lengths share their errors, plus a prior on the logarithms of the factors. A filter has no
    /// weight if it was compared with fewer fixes than others, or does not navigate while others
    /// do.
    pub fn log_weights(&self) -> [f64; FILTERS] {
        let time = self.filters[0].time();
        let compared = self.coasting.map(|one| one.score.weight(time));
        let most = compared.iter().fold(0.0_f64, |most, one| most.max(*one));
        let navigates = self.filters.map(|filter| filter.navigating);
        core::array::from_fn(|i| {
            let few = compared[i] < MIN_WEIGHT_SHARE * most;
            if few || (!navigates[i] && navigates.contains(&true)) {
                return f64::NEG_INFINITY;
            }
            let prior = NOISE_FACTORS[i].map(|factor| {
                let theta = 2.0 * factor.logarithm();
                theta * theta / 8.0
            });
            let likelihood = if most > 0.0 { most * self.coasting[i].score.mean() } else { 0.0 };
            0.5 * likelihood - prior[0] - prior[1]
        })
    }

    /// Weights, with sum one.
    pub fn weights(&self) -> [f64; FILTERS] {
        let logs = self.log_weights();
        let most = logs.iter().fold(f64::NEG_INFINITY, |most, one| most.max(*one));
        let relative =
            logs.map(|one| if one > most - 80.0 { (one - most).exponential() } else { 0.0 });
        let sum: f64 = relative.iter().sum();
        relative.map(|one| one / sum)
    }

    /// Factors on the white noise of gyro and accelerometer in the filter that is shown.
    pub fn noise_factors(&self) -> [f64; 2] {
        NOISE_FACTORS[usize::from(self.shown)]
    }
}

impl Navigates for NavigationBank {
    #[inline]
    fn take_sample(&mut self, _number: usize, sample: &Inertial) -> Result<(), Error> {
        self.update(sample)
    }

    #[inline]
    fn take_speed(&mut self, time: f64, speed: f64, sigma: Option<f64>) -> Result<bool, Error> {
        self.update_wheels(time, speed, sigma)
    }

    #[inline]
    fn take_aid(&mut self, aid: &Aid) -> Result<Verdict, Error> {
        self.update_aid(aid)
    }

    #[inline]
    fn take_fix(&mut self, fix: &Fix) -> Result<Verdict, Error> {
        self.update_gnss(fix)
    }

    #[inline]
    fn filter(&self) -> &NavigationFilter {
        &self.filters[usize::from(self.shown)]
    }
}

impl Stream for NavigationBank {
    type Input = Event;
    type Output = Snapshot;

    #[inline]
    fn update(&mut self, event: Event) -> Snapshot {
        let _refused = match event {
            Event::Sample(sample) => Self::update(self, &sample).is_err(),
            Event::Fix(fix) => self.update_gnss(&fix).is_err(),
            Event::Aid(aid) => self.update_aid(&aid).is_err(),
        };
        self.filter().snapshot()
    }

    fn reset(&mut self) {
        Self::reset(self);
    }
}

impl Checkpoint for NavigationBank {
    const TAG: &'static str = "navigation-bank";
    const VERSION: u16 = 1;

    fn is_valid(&self) -> bool {
        let [first, ..] = &self.filters;
        let goes_along = |filter: &NavigationFilter, factors: [f64; 2]| {
            filter.params == scaled(&first.params, factors)
                && filter.start == first.start
                && filter.sensors.samples == first.sensors.samples
                && filter.sensors.time.to_bits() == first.sensors.time.to_bits()
        };
        usize::from(self.shown) < FILTERS
            && self.filters.iter().all(Checkpoint::is_valid)
            && self.coasting.iter().all(Coasting::is_valid)
            && self.filters.iter().zip(NOISE_FACTORS).all(|(one, factors)| goes_along(one, factors))
    }
}

/// The parameters with the white noise of gyro and accelerometer multiplied by two factors.
fn scaled(params: &NavigationParams, [gyro, accel]: [f64; 2]) -> NavigationParams {
    let times = |noise: [f64; 3], factor: f64| noise.map(|x| x * (factor * factor));
    NavigationParams {
        gyro_noise: times(params.gyro_noise, gyro),
        accel_noise: times(params.accel_noise, accel),
        ..*params
    }
}
