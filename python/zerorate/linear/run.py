"""Results of a linear Kalman filter on a record, filtered and smoothed."""

from dataclasses import dataclass

import numpy as np

from zerorate._native import smooth_linear
from zerorate.types import Booleans, Floats
from zerorate.views import Result


@dataclass(frozen=True)
class SmoothedRun(Result):
    """Smoothed state and covariance at each sample.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> kf = zr.LinearKalman([[1.0]], [[1.0]], [[1e-4]], [[0.25]])
    >>> run = kf.process(2.0 + 0.5 * np.random.default_rng(1).standard_normal(500))
    >>> smooth = run.smooth()
    >>> smooth.state.shape, bool(smooth.covariance[250, 0, 0] < run.covariance[250, 0, 0])
    ((500, 1), True)
    """

    state: Floats
    """States, shape (n, N), or (n, k, N) with k channels."""
    covariance: Floats
    """Covariances, shape (n, N, N), or (n, k, N, N) with k channels."""


class LinearRun(Result):
    """Result of ``LinearKalman.process``: the estimate after each sample of a record.

    With k channels, every array has an axis of length k after the axis of samples. Channels with
    the same covariance share a read-only view of it.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> kf = zr.LinearKalman([[1.0]], [[1.0]], [[1e-4]], [[0.25]])
    >>> run = kf.process(2.0 + 0.5 * np.random.default_rng(1).standard_normal(500))
    >>> run.state.shape, run.covariance.shape, int(run.missing.sum())
    ((500, 1), (500, 1, 1), 0)
    >>> bool(0.8 < np.nanmean(run.nis) < 1.2)  # the noise is as the model says
    True
    """

    def __init__(self, *, state: Floats, **arrays: Floats) -> None:
        self.state = state
        """States, shape (n, N)."""
        self._arrays = arrays

    @property
    def complete(self) -> bool:
        """True if the run kept the covariances and innovations."""
        return "covariance" in self._arrays

    def _require(self, name: str) -> Floats:
        if name not in self._arrays:
            raise ValueError("this run kept only the states: use process(..., keep='all')")
        return self._arrays[name]

    @property
    def covariance(self) -> Floats:
        """Covariances of the state, shape (n, N, N)."""
        return self._require("covariance")

    @property
    def innovation(self) -> Floats:
        """Innovation of each measurement, shape (n, m); NaN for missing measurements."""
        return self._require("innovation")

    @property
    def nis(self) -> Floats:
        """Normalised innovations squared, shape (n,).

        If the model is right, their mean is m, the number of measurements. NaN if all measurements
        of a sample are missing.
        """
        return self._require("nis")

    @property
    def log_likelihood(self) -> Floats:
        """Log-likelihood of each sample, shape (n,).

        Their sum is the log-likelihood of the record. A sample with all measurements missing has 0.
        """
        return self._require("log_likelihood")

    @property
    def missing(self) -> Booleans:
        """Mask of missing measurements, shape (n, m)."""
        return np.isnan(self.innovation)

    def smooth(self) -> SmoothedRun:
        """Return the smoothed states and covariances from the whole record.

        Raises
        ------
        ValueError
            If `complete` is False.

        References
        ----------
        H. E. Rauch, F. Tung, C. T. Striebel, *AIAA Journal* 3(8), 1445-1450, 1965.
        """
        state, covariance = self.state, self._require("covariance")
        is_single = state.ndim == 2
        # All channels share one matrix.
        shared = not is_single and covariance.strides[1] == 0
        joint = covariance[:, :1] if shared else covariance
        B, u = self._arrays.get("B"), self._arrays.get("u")
        smoothed, covariances = smooth_linear(
            state[:, None] if is_single else state,
            joint[:, None] if is_single else joint,
            self._require("F"),
            self._require("Q"),
            B,
            u[:, None] if u is not None and is_single else u,
        )
        if is_single:
            return SmoothedRun(smoothed[:, 0], covariances[:, 0])
        return SmoothedRun(smoothed, np.broadcast_to(covariances, covariance.shape))

    def __repr__(self) -> str:
        """Return the shape of the state."""
        return f"<LinearRun: state {self.state.shape}>"
