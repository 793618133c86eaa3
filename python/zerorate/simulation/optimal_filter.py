"""Kalman filter with the true model of a gyro: the linear filter with the smallest error."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from zerorate.simulation.models import Block, GyroModel
from zerorate.types import Floats


@dataclass(frozen=True, eq=False)
class System:
    """Model x+ = F x + w, z = H x + v. The first state, the level, has no prior.

    Attributes
    ----------
    F, Q : ndarray, shape (m, m)
        Transition matrix, and covariance of w.
    H : ndarray, shape (m,)
        Row from the state to a sample.
    R : float
        Variance of v: white noise, plus step^2/12 for rounding.
    drift : ndarray, shape (m,)
        Row from the state to the drift.
    P : ndarray, shape (m - 1, m - 1)
        Covariance at the first sample of the states after the level.
    """

    F: Floats
    Q: Floats
    H: Floats
    R: float
    drift: Floats
    P: Floats


def system(model: GyroModel, rate: float) -> System:
    """Return the system of a model at a sampling rate, Hz.

    Turn-on bias and random walk share one state, the level.

    Raises
    ------
    ValueError
        If the model has neither white noise nor rounding, or a resonance is above half the rate.
    """
    R = model.angle_random_walk**2 * rate + model.resolution**2 / 12.0
    if R == 0.0:
        raise ValueError(f"the optimum of {model.name!r} needs white noise or rounding above 0")
    drifts = [part.block(rate) for part in model.drift]
    blocks = drifts + [part.block(rate) for part in model.disturbances]
    H = np.concatenate([[1.0], *(block.H for block in blocks)])
    counted = 1 + sum(block.H.size for block in drifts)
    return System(
        F=_diagonal([np.ones((1, 1)), *(block.F for block in blocks)]),
        Q=_diagonal([_walk(model, rate), *(block.Q for block in blocks)]),
        H=H,
        R=R,
        drift=np.where(np.arange(H.size) < counted, H, 0.0),
        P=_priors(blocks),
    )


def _walk(model: GyroModel, rate: float) -> Floats:
    return np.full((1, 1), model.rate_random_walk**2 / rate)


def _priors(blocks: Iterable[Block]) -> Floats:
    return _diagonal([block.P for block in blocks])


def _diagonal(blocks: Iterable[Floats]) -> Floats:
    """Return a matrix with the blocks on its diagonal and zeros elsewhere."""
    listed = list(blocks)
    full = np.zeros((sum(map(len, listed)),) * 2)
    begin = 0
    for block in listed:
        end = begin + len(block)
        full[begin:end, begin:end] = block
        begin = end
    return full


@dataclass(frozen=True, eq=False)
class Optimum:
    """Gains of a Kalman filter over time. They do not depend on the data.

    Attributes
    ----------
    system : System
        Model of the filter.
    gains : ndarray, shape (n, m)
        Gains from each innovation to the m states.
    variance : ndarray, shape (n,)
        Variance of the drift error after each sample, (deg/s)^2.
    innovation_variance : ndarray, shape (n,)
        Variance of each innovation, (deg/s)^2. It is infinite for the first sample, as the level
        has no prior.
    """

    system: System
    gains: Floats
    variance: Floats
    innovation_variance: Floats

    def filtered(self, signal: Floats) -> tuple[Floats, Floats]:
        """Return drift and innovations for n samples of k gyros, each of shape (n, k), deg/s."""
        known = self.system
        x = np.zeros((known.H.size, signal.shape[1]))
        drift, innovation = np.empty_like(signal), np.empty_like(signal)
        for k, (z, gain) in enumerate(zip(signal, self.gains, strict=True)):
            innovation[k] = z - known.H @ x
            x += np.multiply.outer(gain, innovation[k])
            drift[k] = known.drift @ x
            x = known.F @ x
        return drift, innovation


def optimum(model: GyroModel, rate: float, n: int) -> Optimum:
    """Return the Kalman filter of a model for n samples.

    Parameters
    ----------
    model : GyroModel
        Model of the gyro. The filter treats rounding as white noise of variance step^2/12. This is
        nearly optimal, because the noise is at least as large as a step.
    rate : float
        Sampling rate, Hz.
    n : int
        Number of samples.

    Returns
    -------
    Optimum
        Gains and error variance. The level has no prior, so the first sample sets it. This is the
        exact limit for increasingly wide priors.

    Raises
    ------
    ValueError
        If the model has neither white noise nor rounding, or has a resonance above half the rate.

    Examples
    --------
    >>> from zerorate.simulation.models import MODELS
    >>> optimum(MODELS[0], 100.0, 4).gains[:, 0].round(3).tolist()
    [1.0, 0.5, 0.333, 0.25]
    """
    known = system(model, rate)
    gains, variance, innovation_variance = np.empty((n, known.H.size)), np.empty(n), np.empty(n)
    gains[0], P, innovation_variance[0] = (
        np.eye(1, known.H.size)[0],
        _first_covariance(known),
        math.inf,
    )
    variance[0] = known.drift @ P @ known.drift
    for k in range(1, n):
        P = known.F @ P @ known.F.T + known.Q
        PH = P @ known.H
        innovation_variance[k] = S = float(PH @ known.H) + known.R
        gains[k] = PH / S
        # Subtract an outer square, so that rounding keeps the matrix symmetric.
        root = PH / math.sqrt(S)
        P -= np.multiply.outer(root, root)
        variance[k] = known.drift @ P @ known.drift
    return Optimum(known, gains, variance, innovation_variance)


def _first_covariance(known: System) -> Floats:
    """Return the covariance after the level is set to the first sample minus the other outputs."""
    outputs = known.H[1:]
    shared = known.P @ outputs
    P = np.empty_like(known.F)
    P[0, 0] = outputs @ shared + known.R
    P[0, 1:] = P[1:, 0] = -shared
    P[1:, 1:] = known.P
    return P
