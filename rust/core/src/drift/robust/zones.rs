//! The three zones of the innovation: accepted, bounded and rejected samples.

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::math::{Limits, Real};

/// Radii of the zones.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Zones {
    /// As in the paper: an innovation is compared with the variance of all innovations to date, in
    /// the samples' unit, and with three quarters of it. A run of outliers never ends.
    Published,
    /// (κ, β): the outer radius is κ standard deviations of the accepted innovations, the inner
    /// radius β times this radius.
    Deviations(f64, f64),
}

/// β of the published radii; the source says only that it is between 0 and 1.
const BETA: f64 = 0.75;

/// The range of the zones, in words.
pub(in crate::drift) const ZONES_EXPECTED: &str =
    "'published' or (kappa, beta) with kappa above 0 and beta above 0 and at most 1";

/// Treatment of innovations that are too large.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RobustParams {
    /// Bounds of innovations that are too large.
    pub zones: Zones,
    /// α, the share of the gain that is applied to a sample of the outer zone.
    pub damping: f64,
    /// γ, the share of an innovation between the two radii that moves the prediction. With zero
    /// this innovation is limited to the inner radius instead.
    pub correction: f64,
}

impl Default for RobustParams {
    fn default() -> Self {
        Self { zones: Zones::Deviations(4.0, BETA), damping: 0.0, correction: 0.0 }
    }
}

impl RobustParams {
    /// The parameters, if each is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first parameter out of range.
    pub fn validate(self) -> Result<Self, Error> {
        if let Zones::Deviations(kappa, beta) = self.zones {
            require(kappa > 0.0 && kappa.is_finite(), "zones", ZONES_EXPECTED, kappa)?;
            require(beta > 0.0 && beta <= 1.0, "zones", ZONES_EXPECTED, beta)?;
        }
        check_share("damping", self.damping)?;
        check_share("correction", self.correction)?;
        Ok(self)
    }

    /// Share of `S K Kᵀ` by which a sample of the outer zone lowers the covariance: as in the
    /// paper, or in Joseph's form. Only Joseph's form is correct for a gain other than the Kalman
    /// gain.
    pub(super) fn fall(&self) -> f64 {
        match self.zones {
            Zones::Published => self.damping,
            Zones::Deviations(..) => self.damping * (2.0 - self.damping),
        }
    }
}

fn check_share(name: &'static str, share: f64) -> Result<(), Error> {
    require((0.0..=1.0).contains(&share), name, "from 0 to 1", share)
}

/// Duration, and smallest number, of outliers with one sign that are accepted as a step.
const EXIT_SECONDS: f64 = 0.03;
const EXIT_SAMPLES: f64 = 3.0;

/// Factor of that duration for outliers with any sign.
const EXIT_ANY_SIGN_FACTOR: i64 = 10;

/// Number of accepted innovations after which an innovation has the weight 1/e. The standard
/// deviation is then known to seven percent, and a motion or accepted outliers are forgotten within
/// seconds.
const TIME_CONSTANT_INNOVATIONS: f64 = 100.0;

/// Verdict on a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Verdict<T> {
    /// The sample is accepted.
    Taken,
    /// The sample is processed with this innovation instead of its own.
    Bounded(T),
    /// The prediction moves by this value, then the sample is accepted.
    Corrected(T),
    /// An outlier: remaining share of the gain, and of `S K Kᵀ` in the decrease of the covariance.
    Damped(T, T),
    /// The outliers are a step of the signal.
    Exit,
}

/// Statistics of the innovations to date, for the class of the next innovation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Gate<T> {
    pub law: RobustParams,
    /// Number of outliers with one sign that are accepted as a step.
    pub exit: i64,
    /// Moments of the accepted innovations: E and V.
    pub taken: Moments<T>,
    /// Moments of the outliers since the last accepted innovation.
    pub outliers: Moments<T>,
    /// Number of last outliers with one sign; negative if the sign is negative.
    pub row: i64,
    /// True if the last sample was an outlier.
    pub outlier: bool,
    pub outlier_count: u64,
    pub exit_count: u64,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Gate<T> {
    /// State before the first innovation; the parameters are checked.
    pub fn new(law: RobustParams, rate: f64) -> Self {
        Self {
            law,
            exit: ((EXIT_SECONDS * rate).max(EXIT_SAMPLES) + 0.5) as i64,
            taken: Moments::none(),
            outliers: Moments::none(),
            row: 0,
            outlier: false,
            outlier_count: 0,
            exit_count: 0,
        }
    }

    /// Forgets all innovations, but keeps the counts.
    pub fn restart(&mut self) {
        self.taken = Moments::none();
        self.accept();
    }

    /// Classifies the innovation `e`. `S` is its expected variance, and `P` the prediction's share
    /// of `S`. `scale` converts to the samples' unit.
    #[inline(always)]
    pub fn classify(&mut self, e: T, P: T, S: T, scale: T) -> Verdict<T> {
        self.outlier = false;
        match self.law.zones {
            Zones::Published => self.classify_as_published(e, scale),
            Zones::Deviations(kappa, beta) => {
                self.classify_by_deviations(e, [P, S], T::of(kappa), T::of(beta))
            }
        }
    }

    #[inline(always)]
    fn classify_by_deviations(&mut self, e: T, [P, S]: [T; 2], kappa: T, beta: T) -> Verdict<T> {
        if self.taken.count == T::zero() {
            self.begin(S);
        }
        // An uncertainty of the filter, after a gap or a step, does not make an outlier.
        let outer = kappa * self.taken.variance.at_least(P).simd_sqrt();
        let inner = beta * outer;
        let distance = e.simd_abs() - self.taken.mean.simd_abs();
        if distance > outer {
            return self.refuse(e, S);
        }
        self.accept();
        let correction = T::of(self.law.correction);
        let (counted, verdict) = match distance > inner {
            false => (e, Verdict::Taken),
            true if correction > T::zero() => (e, Verdict::Corrected(correction * e)),
            true => (e.within(inner), Verdict::Bounded(e.within(inner))),
        };
        self.taken.observe(counted, T::of(TIME_CONSTANT_INNOVATIONS));
        verdict
    }

    /// Equations 7 to 9 of the source and its figure 1.
    #[inline(always)]
    fn classify_as_published(&mut self, e: T, scale: T) -> Verdict<T> {
        self.taken.observe(e, T::MAX);
        let outer = scale * self.taken.variance;
        let distance = e.simd_abs() - self.taken.mean.simd_abs();
        match (distance > outer, distance > T::of(BETA) * outer) {
            (true, _) => self.damp(),
            (false, true) => Verdict::Corrected(T::of(self.law.correction) * e),
            _ => Verdict::Taken,
        }
    }

    fn damp(&mut self) -> Verdict<T> {
        self.outlier = true;
        self.outlier_count += 1;
        Verdict::Damped(T::of(self.law.damping), T::of(self.law.fall()))
    }

    /// An outlier, or the last outlier of a step. After a step the innovations start again, with
    /// the outliers' variance if it exceeds the filter's expectation.
    fn refuse(&mut self, e: T, S: T) -> Verdict<T> {
        self.outliers.observe(e, T::MAX);
        let same_sign = (e > T::zero()) == (self.row > 0);
        self.row = match (same_sign, e > T::zero()) {
            (true, true) => self.row + 1,
            (true, false) => self.row - 1,
            (false, true) => 1,
            (false, false) => -1,
        };
        let all = T::of(self.exit.saturating_mul(EXIT_ANY_SIGN_FACTOR) as f64);
        if self.row.abs() < self.exit && self.outliers.count < all {
            return self.damp();
        }
        self.exit_count += 1;
        self.begin(S.at_least(self.outliers.variance));
        self.accept();
        Verdict::Exit
    }

    fn begin(&mut self, variance: T) {
        let variance = variance.at_most(Self::most());
        self.taken = Moments { count: T::of(self.exit as f64), mean: T::zero(), variance };
    }

    /// Ends a run of outliers.
    #[inline(always)]
    fn accept(&mut self) {
        self.outliers = Moments::none();
        self.row = 0;
    }

    /// Upper bound of all variances of innovations.
    pub fn most() -> T {
        let innovation = T::MAX_INPUT * T::of(16.0);
        innovation * innovation
    }
}

/// Recursive mean and variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Moments<T> {
    /// Number of samples in the moments.
    pub count: T,
    pub mean: T,
    pub variance: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Moments<T> {
    fn none() -> Self {
        Self { count: T::zero(), mean: T::zero(), variance: T::zero() }
    }

    /// Adds a value. All values have equal weight until their count reaches the time constant.
    #[inline(always)]
    fn observe(&mut self, e: T, memory: T) {
        self.count = (self.count + T::one()).at_most(memory);
        let weight = T::one() / self.count;
        let before = e - self.mean;
        self.mean += before * weight;
        self.variance += (before * (e - self.mean) - self.variance) * weight;
    }
}
