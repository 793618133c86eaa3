//! A gyro's bias and its temperature slope, learned at rest and held in motion.
//!
//! Samples form ticks of a quarter second, and a [`RestDetector`] detects motion in them. Each tick
//! at rest corrects Kalman filters with the state [bias, slope] and H = [1, T - T0]. There is one
//! filter for each strength of the bias's random walk; they are weighed by their likelihoods.

mod thermometer;
mod walks;

use serde::{Deserialize, Serialize};

use self::thermometer::Thermometer;
use self::walks::{MAX_LEVEL, MAX_SLOPE, Mixture, Walks};
use crate::error::{Error, check_not_negative, require};
use crate::math::validity::{is_count, is_size, is_within};
use crate::math::{Limits, Real};
use crate::rest::{Event, RestDetector, RestLimits, Tick};
use crate::stream::Stream;
use crate::stream::checkpoint::Checkpoint;

/// Largest standard deviation of the samples.
const MAX_SCALE: f64 = 1e150;

/// Prior standard deviation of an unknown slope: one standard deviation of a sample per kelvin.
const SLOPE_SIGMA: f64 = 1.0;

/// Span of the mean bias with a stated standard deviation, s.
const STATED_SECONDS: f64 = 10.0;

/// Parameters; x is the samples' unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TemperatureParams {
    /// Samples per second.
    pub rate: f64,
    /// Temperature of the bias state, degC.
    pub reference: f64,
    /// Prior of the slope before any sample, x/K.
    pub slope: Option<f64>,
    /// Standard deviation of `slope`, x/K; the default for a stated slope is 0.
    pub slope_sigma: Option<f64>,
    /// Random walk of the bias, x/√s; `None`: it is learned.
    pub walk: Option<f64>,
    /// Limits of rest.
    pub limits: RestLimits,
}

impl Default for TemperatureParams {
    fn default() -> Self {
        Self {
            rate: 100.0,
            reference: 25.0,
            slope: None,
            slope_sigma: None,
            walk: None,
            limits: RestLimits::default(),
        }
    }
}

impl TemperatureParams {
    fn validate(self) -> Result<Self, Error> {
        let finite = |name, value: f64| require(value.is_finite(), name, "a finite number", value);
        let size = |name, value| check_not_negative(name, "zero or a positive number", value);
        finite("reference", self.reference)?;
        self.slope.map_or(Ok(()), |slope| finite("slope", slope))?;
        self.slope_sigma.map_or(Ok(()), |sigma| size("slope_sigma", sigma))?;
        self.walk.map_or(Ok(()), |walk| size("walk", walk))?;
        Ok(self)
    }

    /// Prior standard deviation of the slope, if it is known.
    fn known_slope_sigma(&self) -> Option<f64> {
        self.slope_sigma.or(self.slope.map(|_| 0.0))
    }
}

/// Bias at the present temperature, and its slope, of one axis.
///
/// A sample is a rate and a temperature in degC; NaN is missing. The output is the bias after the
/// last tick, zero before the first rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TemperatureFilter {
    params: TemperatureParams,
    detector: RestDetector<f64>,
    thermometer: Thermometer,
    samples_seen: u64,
    /// Largest sample to date: a bound of the bias while nothing else is known.
    reach: f64,
    at_rest: bool,
    /// True if a rest has begun.
    begun: bool,
    /// Mean and standard deviation of the samples in the first tick at rest: origin and unit of all
    /// states.
    offset: f64,
    scale: f64,
    walks: Walks,
    bias: f64,
}

impl TemperatureFilter {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range.
    pub fn new(params: TemperatureParams) -> Result<Self, Error> {
        let params = params.validate()?;
        let detector = RestDetector::new(params.rate, params.limits)?;
        Ok(Self {
            params,
            detector,
            thermometer: Thermometer::new(),
            samples_seen: 0,
            reach: 0.0,
            at_rest: false,
            begun: false,
            offset: 0.0,
            scale: 0.0,
            walks: Walks::none(),
            bias: 0.0,
        })
    }

    /// Parameters of the filter.
    pub fn params(&self) -> &TemperatureParams {
        &self.params
    }

    /// The bias at the last temperature; zero before the first rest.
    pub fn bias(&self) -> f64 {
        self.bias
    }

    /// Standard deviation of the mean bias over the next ten seconds at the present temperature.
    /// Before the first rest it is the largest sample. While a rest may be motion, it is at least
    /// the bias.
    pub fn bias_sigma(&self) -> f64 {
        if self.scale == 0.0 {
            return if self.begun { 0.0 } else { self.reach };
        }
        let ticks = STATED_SECONDS * (self.params.rate / self.tick_length());
        let ahead = self.walks.ahead(self.kelvin(), self.known_step(), self.tick_length(), ticks);
        let sigma = self.scale * ahead.sigma;
        if self.detector.is_provisional() { sigma.max(self.bias.abs()) } else { sigma }
    }

    /// Change of the bias per kelvin.
    pub fn slope(&self) -> f64 {
        match self.scale == 0.0 {
            true => self.params.slope.unwrap_or(0.0),
            false => self.scale * self.walks.slope().mean,
        }
    }

    /// Standard deviation of the slope; zero before it is known.
    pub fn slope_sigma(&self) -> f64 {
        match self.scale == 0.0 {
            true => self.params.known_slope_sigma().unwrap_or(0.0),
            false => self.scale * self.walks.slope().sigma,
        }
    }

    /// True if the gyro rests and the bias is being learned.
    pub fn at_rest(&self) -> bool {
        self.at_rest
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    fn level(&self) -> Mixture {
        self.walks.level(self.kelvin())
    }

    /// Temperature relative to the reference, zero before the first temperature.
    fn kelvin(&self) -> f64 {
        self.thermometer.kelvin().unwrap_or(0.0)
    }

    /// Assigns everything learned before the first temperature to that temperature.
    fn feel(&mut self) {
        let first = self.thermometer.kelvin().is_none();
        self.thermometer.end_tick();
        if first && self.scale > 0.0 {
            self.walks.shift(self.kelvin());
        }
    }

    fn take(&mut self, tick: &Tick<f64>) {
        let restarts = tick.event == Some(Event::Restart);
        match tick.event {
            Some(Event::Restart) if !self.detector.at_rest() => self.forget(),
            Some(event) => self.at_rest = event != Event::Motion,
            None => {}
        }
        if self.scale > 0.0 {
            self.walks.wait(self.known_step(), self.tick_length());
        }
        if !self.at_rest || tick.count == 0 {
            return;
        }
        let white = 1.0 / f64::from(tick.count);
        if self.scale == 0.0 {
            self.start(tick, white);
        } else if restarts {
            self.walks.begin(self.counted(tick.mean), white, self.kelvin());
        } else {
            self.walks.correct(self.counted(tick.mean), white, self.kelvin());
        }
    }

    /// Forgets everything learned.
    fn forget(&mut self) {
        (self.at_rest, self.begun) = (false, false);
        (self.offset, self.scale, self.walks) = (0.0, 0.0, Walks::none());
    }

    /// Sets offset and scale by the first tick at rest, or the first tick with differing samples.
    fn start(&mut self, tick: &Tick<f64>, white: f64) {
        (self.begun, self.offset) = (true, tick.mean);
        self.scale = tick.deviation.min(MAX_SCALE);
        if self.scale == 0.0 {
            return;
        }
        let sigma = self.params.known_slope_sigma();
        let spread = sigma.map_or(SLOPE_SIGMA, |sigma| (sigma / self.scale).min(MAX_SLOPE));
        let slope = self.params.slope.unwrap_or(0.0) / self.scale;
        self.walks = Walks::new(slope.within(MAX_SLOPE), spread);
        self.walks.begin(0.0, white, self.kelvin());
    }

    /// Rate relative to the first tick, in its samples' standard deviations.
    fn counted(&self, z: f64) -> f64 {
        ((z - self.offset) / self.scale).within(MAX_LEVEL)
    }

    /// Variance that a known random walk adds per tick, in units of the scale.
    fn known_step(&self) -> Option<f64> {
        let seconds = (self.tick_length() / self.params.rate).min(f64::MAX);
        let walk = (self.params.walk? / self.scale).min(MAX_LEVEL);
        Some(walk * walk * seconds)
    }

    fn tick_length(&self) -> f64 {
        f64::from(self.detector.tick_length())
    }

    fn answer(&self) -> f64 {
        match self.scale == 0.0 {
            true => self.offset,
            false => (self.offset + self.scale * self.level().mean).within(f64::MAX_RAW),
        }
    }
}

impl Stream for TemperatureFilter {
    type Input = [f64; 2];
    type Output = f64;

    #[inline]
    fn update(&mut self, [z, temperature]: [f64; 2]) -> f64 {
        self.samples_seen += 1;
        self.thermometer.observe(temperature - self.params.reference);
        if z.is_finite() {
            self.reach = self.reach.max(z.abs().min(f64::MAX_RAW));
        }
        if let Some(tick) = self.detector.observe(z) {
            self.feel();
            self.take(&tick);
            self.bias = self.answer();
        }
        self.bias
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }
}

impl Checkpoint for TemperatureFilter {
    const TAG: &'static str = "temperature";
    const VERSION: u16 = 2;

    fn is_valid(&self) -> bool {
        let most = f64::MAX_RAW * 32.0;
        Self::new(self.params).is_ok_and(|fresh| {
            self.detector.is_valid()
                && self.detector.is_like(&fresh.detector)
                && self.thermometer.is_valid(self.detector.tick_length())
                && is_count(self.samples_seen)
                && is_size(self.reach, f64::MAX_RAW)
                && is_within(self.offset, most)
                && is_size(self.scale, MAX_SCALE)
                && is_within(self.bias, most)
                && (self.begun || (self.offset, self.scale) == (0.0, 0.0))
                && match self.scale == 0.0 {
                    true => self.walks == Walks::none() && self.bias == self.offset,
                    false => self.walks.is_valid(),
                }
        })
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.params, self.samples_seen) == (other.params, other.samples_seen)
    }
}
