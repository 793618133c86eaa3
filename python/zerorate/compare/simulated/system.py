"""The linear system of a simulated gyro."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate.compare.simulated.models import DeviceModel
from zerorate.compare.simulated.parts import Block

__all__ = ["System", "system"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class System:
    """A model x+ = F x + w, z = H x + v whose first state, the level, has no prior.

    Attributes
    ----------
    F, Q : ndarray, shape (m, m)
        Transition, and covariance of w.
    H : ndarray, shape (m,)
        What a sample shows of the state.
    R : float
        Variance of v: white noise, and rounding by a step as white noise of step^2/12.
    drift : ndarray, shape (m,)
        What of the state is drift.
    P : ndarray, shape (m - 1, m - 1)
        Covariance of the states after the level at the first sample.
    """

    F: Floats
    Q: Floats
    H: Floats
    R: float
    drift: Floats
    P: Floats


def system(model: DeviceModel, rate: float) -> System:
    """Return the system of a model at a sampling rate in Hz.

    Turn-on bias and random walk are one state, the level.

    Raises
    ------
    ValueError
        If there is neither white noise nor rounding, or a resonance lies above half the rate.
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


def _walk(model: DeviceModel, rate: float) -> Floats:
    return np.full((1, 1), model.rate_random_walk**2 / rate)


def _priors(blocks: Iterable[Block]) -> Floats:
    return _diagonal([block.P for block in blocks])


def _diagonal(blocks: Iterable[Floats]) -> Floats:
    """Return the blocks along the diagonal of a matrix that is zero elsewhere."""
    listed = list(blocks)
    full = np.zeros((sum(map(len, listed)),) * 2)
    begin = 0
    for block in listed:
        end = begin + len(block)
        full[begin:end, begin:end] = block
        begin = end
    return full
