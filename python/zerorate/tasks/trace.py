"""Trace of a drift filter: its state after each sample."""

from dataclasses import dataclass

from zerorate.types import Booleans, Floats
from zerorate.views import Result

__all__ = ["Trace"]


@dataclass(frozen=True, eq=False, repr=False)
class Trace(Result):
    """State of a filter after each of n samples; with k channels every array has a second axis k.

    For "auto" the state is only the drift, so p + 1 and p + q + 1 below are 1.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> z = 0.3 + 0.05 * np.random.default_rng(1).standard_normal(2000)
    >>> trace = zr.DriftFilter(rate=100.0).trace(z)
    >>> trace, bool(abs(trace.bias[-1] - 0.3) < 3.0 * trace.bias_sigma[-1])
    (Trace of 2000 samples, True)
    """

    estimate: Floats
    """Estimate of the filter, in the unit of the samples; of "auto" the bias: (n,)."""
    innovation: Floats
    """Sample minus prediction; zero where the sample is missing: (n,)."""
    innovation_variance: Floats
    """Variance S that the filter expected of the innovation: (n,)."""
    gain: Floats
    """Kalman gain; zero where the sample is missing: (n, p + 1)."""
    measurement_noise: Floats
    """Variance R: (n,)."""
    process_noise: Floats
    """Covariance G: (n, p + 1, p + 1)."""
    coefficients: Floats
    """Model [φ…, θ…, c]: (n, p + q + 1)."""
    covariance: Floats
    """State covariance P: (n, p + 1, p + 1)."""
    missing: Booleans
    """The sample was not finite: (n,)."""
    guarded: Booleans
    """True if the process noise was limited, or "robust" treated the sample as an outlier: (n,)."""
    bias: Floats
    """Bias learned at rest and held in motion, in the unit of the samples: (n,)."""
    bias_sigma: Floats
    """Its standard deviation as the filter sees it: (n,)."""
    at_rest: Booleans
    """The filter learned; always true with ``motion="ignore"``: (n,)."""
    saturated: Booleans
    """The sample was at or beyond ``limit``: (n,)."""
    stuck: Booleans
    """The sensor gives the same sample for longer than chance does: (n,)."""

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.estimate)

    def __repr__(self) -> str:
        """Return the number of samples."""
        return f"Trace of {len(self)} samples"
