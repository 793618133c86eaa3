//! A filter that begins with a known model instead of a start-up.

use super::{DriftFilter, DriftLoop};
use crate::error::Error;
use crate::kalman::Belief;
use crate::params::Params;
use crate::real::{Limits, Real};
use crate::rls::Rls;
use crate::start::{PEAK, Start};
use crate::startup::Scaling;
use crate::symmetric::Symmetric;

impl<T, const N: usize, const M: usize> DriftLoop<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// A loop that knows what `start` says, as firmly as a start-up would have told it.
    fn started(params: &Params, start: &Start<T, N, M>) -> Result<Self, Error> {
        let mut inner = Self::new(params)?;
        let samples = params.startup_samples();
        inner.model = Rls::started(params.forgetting_factor, start)?;
        let R = start.normalised_variance(start.measurement_noise);
        inner.measurement_noise.believe(R, samples);
        let G = start.normalised_variance(start.process_noise).at_least(Self::floor());
        inner.process_noise = Symmetric::diagonal(Self::floor());
        inner.process_noise.set(0, 0, G);
        inner.belief = Self::started_belief(start)?;
        inner.last.variance = inner.belief.P.at(0, 0) + inner.measurement_noise.variance();
        inner.count += T::of(samples as f64);
        inner.peak = T::of(PEAK);
        Ok(inner)
    }

    /// Everything at the mean but the constant of the model, which is zero around the mean.
    fn started_belief(start: &Start<T, N, M>) -> Result<Belief<T, N>, Error> {
        let P = start.normalised_state_covariance()?;
        let mut belief = Belief::new(T::zero());
        belief.P = Symmetric::from_upper(|i, j| P[(i, j)]);
        belief.x[N - 1] = start.normalised_coefficients()[M - 1];
        Ok(belief)
    }
}

impl<T, const N: usize, const M: usize> DriftFilter<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// A filter that is ready at its first sample; R and the count of Sage-Husa stand as if the
    /// start-up that `params` name had been spent.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter or a number of the start out of range.
    pub fn started(params: Params, start: Start<T, N, M>) -> Result<Self, Error> {
        let start = start.checked()?;
        Ok(Self {
            inner: DriftLoop::started(&params, &start)?,
            scaling: Some(Scaling::new(start.offset, start.scale)),
            estimate: start.offset,
            start: Some(start),
            ..Self::new(params)?
        })
    }

    /// What it was started with, if it did not learn that itself.
    pub fn start(&self) -> Option<&Start<T, N, M>> {
        self.start.as_ref()
    }
}
