"""Trace of a drift filter: its state after each sample."""

from dataclasses import dataclass

from zerorate.types import Booleans, Floats
from zerorate.views import Result

__all__ = ["Trace"]


@dataclass(frozen=True, eq=False, repr=False)
class Trace(Result):
    """State of a filter after each of n samples; k channels add a second axis to every array.

    The model has the order (p, q). For "auto", the state is only the drift, and p and q are 0.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> z = 0.3 + 0.05 * np.random.default_rng(1).standard_normal(2000)
    >>> trace = zr.DriftFilter(rate=100.0).trace(z)
    >>> trace, bool(abs(trace.bias[-1] - 0.3) < 3.0 * trace.bias_sigma[-1])
    (Trace of 2000 samples, True)
    """

    estimate: Floats
    """Estimate of the filter, shape (n,), in the unit of the samples; for "auto" the bias."""
    innovation: Floats
    """Sample minus prediction, shape (n,); zero if the sample is missing."""
    innovation_variance: Floats
    """Variance S expected for the innovation, shape (n,)."""
    gain: Floats
    """Kalman gain, shape (n, p + 1); zero if the sample is missing."""
    measurement_noise: Floats
    """Variance R of the measurement noise, shape (n,)."""
    process_noise: Floats
    """Covariance G of the process noise, shape (n, p + 1, p + 1)."""
    coefficients: Floats
    """ARMA model [φ…, θ…, c], shape (n, p + q + 1)."""
    covariance: Floats
    """Covariance P of the state, shape (n, p + 1, p + 1)."""
    missing: Booleans
    """True if the sample was not finite; shape (n,)."""
    guarded: Booleans
    """True if the process noise was limited, or if "robust" found an outlier; shape (n,)."""
    bias: Floats
    """Bias learned at rest and held in motion, shape (n,), in the unit of the samples."""
    bias_sigma: Floats
    """Standard deviation of the bias, computed by the filter, shape (n,)."""
    at_rest: Booleans
    """True if the filter learned; shape (n,); always True with ``motion="ignore"``."""
    saturated: Booleans
    """True if the sample was at or beyond ``limit``; shape (n,)."""
    stuck: Booleans
    """True if the sensor repeated a value for longer than chance explains; shape (n,)."""

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.estimate)

    def __repr__(self) -> str:
        """Return the number of samples."""
        return f"Trace of {len(self)} samples"
