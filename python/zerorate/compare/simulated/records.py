"""Records of simulated gyros."""

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from zerorate.compare.simulated.models import DeviceModel
from zerorate.noise import series

__all__ = ["record", "records"]

Floats = npt.NDArray[np.float64]


def records(model: DeviceModel, rate: float, n: int, seeds: Iterable[int]) -> tuple[Floats, Floats]:
    """Return output and true drift of several gyros of one model, shape (n, seeds), deg/s."""
    pairs = [record(model, rate, n, seed) for seed in seeds]
    signals, truths = zip(*pairs, strict=True)
    return np.column_stack(signals), np.column_stack(truths)


def record(model: DeviceModel, rate: float, n: int, seed: int) -> tuple[Floats, Floats]:
    """Simulate one gyro at rest and return its output with the drift in it.

    Parameters
    ----------
    model : DeviceModel
        Its noises.
    rate : float
        Samples per second, Hz.
    n : int
        Number of samples.
    seed : int
        Not negative. Every model, seed and part of a model draws from its own stream.

    Returns
    -------
    signal, truth : ndarray, shape (n,)
        Output, and its drift with the turn-on bias, deg/s.

    Raises
    ------
    ValueError
        If the model has a resonance above half the rate.

    Examples
    --------
    >>> from zerorate.compare.simulated import MODELS
    >>> signal, truth = record(MODELS[0], 100.0, 6000, seed=1)
    >>> round(float((signal - truth).std()), 2), float(np.ptp(truth))
    (0.1, 0.0)
    """
    streams = _streams(model, seed)
    truth = np.full(n, model.turn_on_bias * next(streams).standard_normal())
    white = next(streams).standard_normal(n)
    step = model.rate_random_walk / np.sqrt(rate)
    truth += step * series.walk(next(streams).standard_normal(n))
    for part in model.drift:
        truth += part.series(n, rate, next(streams))
    signal = truth + model.angle_random_walk * np.sqrt(rate) * white
    for part in model.disturbances:
        signal += part.series(n, rate, next(streams))
    return _rounded(signal, model.resolution), truth


def _streams(model: DeviceModel, seed: int) -> Iterator[np.random.Generator]:
    name = int.from_bytes(model.name.encode())
    count = 3 + len(model.drift) + len(model.disturbances)
    return map(np.random.default_rng, np.random.SeedSequence([seed, name]).spawn(count))


def _rounded(signal: Floats, step: float) -> Floats:
    return np.round(signal / step) * step if step > 0.0 else signal
