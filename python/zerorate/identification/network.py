"""Small neural network as the state equation of a gyro's noise, compared with an AR model."""

from __future__ import annotations

import operator
from dataclasses import dataclass, field, replace
from typing import Final, Literal, SupportsIndex

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.identification.arma_model import ArmaModel
from zerorate.identification.autoregression import fit_ar
from zerorate.noise.records import as_record, mark_gaps
from zerorate.types import Floats

NetworkVerdict = Literal["gain", "no gain", "oscillates"]

MAX_HIDDEN: Final = 8
MAX_INPUTS: Final = 64
MAX_TRAINING_SAMPLES: Final = 20_000
SAMPLES_PER_WEIGHT: Final = 50
"""Smallest number of samples per weight: with fewer, a gain is chance."""

MIN_GAIN: Final = 0.01
MAX_LIMIT_CYCLE: Final = 0.01
FREE_RUN_STEPS: Final = 3000
"""Number of steps of a free run; its last third shows the steady behaviour."""

MAX_ROUNDS: Final = 200
COST_TOLERANCE: Final = 1e-10
MAX_DAMPING: Final = 1e12


@dataclass(frozen=True, eq=False)
class NetworkModel:
    """Network of tanh units with a linear output; it predicts a sample from those before it.

    ``z_k = mean + scale (output @ tanh(weights @ x + biases) + offset) + a_k``, with ``x = (past -
    mean) / scale``. ``past`` has the last samples, newest first.

    Attributes
    ----------
    weights : ndarray, shape (hidden, inputs)
        Weights from the inputs to the units.
    biases, output : ndarray, shape (hidden,)
        Biases of the units, and weights from the units to the output.
    offset : float
        Offset of the output.
    mean, scale : float
        Mean and standard deviation of the training samples, in their unit.
    n, held_out : int
        Number of training steps, and number of later test steps.
    rmse, ar_rmse : float
        RMS error of one-step predictions in the test, in the unit of the record. ``rmse`` is for
        the network, ``ar_rmse`` for an autoregression with the same inputs and training samples.
    limit_cycle : float
        Standard deviation of the network's output when it runs on its own predictions, divided by
        the standard deviation of the record. 0 if the network does not oscillate.
    ar : ArmaModel
        Autoregression with the same inputs.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.identification import fit_network
    >>> z = np.random.default_rng(1).standard_normal(2000)
    >>> model = fit_network(z, inputs=2, hidden=3)
    >>> model.weights.shape, model.predict(z).shape, model.verdict
    ((3, 2), (2000,), 'no gain')
    """

    weights: Floats = field(repr=False)
    biases: Floats = field(repr=False)
    output: Floats = field(repr=False)
    offset: float = field(repr=False)
    mean: float
    scale: float
    n: int
    held_out: int
    rmse: float
    ar_rmse: float
    limit_cycle: float
    ar: ArmaModel = field(repr=False)

    @property
    def inputs(self) -> int:
        """Number of past samples used in a step."""
        return int(self.weights.shape[1])

    @property
    def hidden(self) -> int:
        """Number of tanh units."""
        return int(self.weights.shape[0])

    @property
    def gain_over_ar(self) -> float:
        """Reduction of the error relative to the AR model: 0.01 is one per cent."""
        return 1.0 - self.rmse / self.ar_rmse

    @property
    def verdict(self) -> NetworkVerdict:
        """Verdict on the network: "gain", "no gain" or "oscillates".

        "oscillates": `limit_cycle` exceeds 0.01. "no gain": `gain_over_ar` is below 0.01.
        """
        if self.limit_cycle > MAX_LIMIT_CYCLE:
            return "oscillates"
        return "gain" if self.gain_over_ar >= MIN_GAIN else "no gain"

    def step(self, past: npt.ArrayLike) -> Floats:
        """Return the next value, shape (…,), from past values, shape (…, inputs), newest first."""
        x = self._scale_inputs(past)
        units = np.tanh(x @ self.weights.T + self.biases)
        return self.mean + self.scale * (units @ self.output + self.offset)

    def gradient(self, past: npt.ArrayLike) -> Floats:
        """Return the derivatives of the next value by each input, in the shape of `past`.

        These derivatives are the first row of the transition matrix of an extended Kalman filter.
        """
        slopes = 1.0 - np.tanh(self._scale_inputs(past) @ self.weights.T + self.biases) ** 2
        return (slopes * self.output) @ self.weights

    def predict(self, z: npt.ArrayLike) -> Floats:
        """Return the prediction of each sample, shape (n,); NaN if an input is missing."""
        record = mark_gaps(as_record(z))
        predicted = np.full(record.size, np.nan)
        if record.size > self.inputs:
            predicted[self.inputs :] = self.step(_past_windows(record, self.inputs))
        return predicted

    def _scale_inputs(self, past: npt.ArrayLike) -> Floats:
        values = np.asarray(past, dtype=float)
        if values.shape[-1:] != (self.inputs,):
            raise ArgumentError("past", f"must have shape (…, {self.inputs}), got {values.shape}")
        return (values - self.mean) / self.scale


def fit_network(
    z: npt.ArrayLike, inputs: SupportsIndex = 5, hidden: SupportsIndex = 2, seed: int = 0
) -> NetworkModel:
    """Train a network to predict the next sample, and compare it with an AR model.

    The network is trained on the first half of the record, at most 20,000 samples. Later samples
    test it against an autoregression with the same number of inputs. A run on its own predictions
    shows if the network oscillates. On all tested gyros at rest, `gain_over_ar` is below one per
    cent. Read `verdict` first: a network with a gain may oscillate, and a filter with this network
    would then also oscillate.

    Parameters
    ----------
    z : array_like, shape (n,)
        Record of one axis at rest, any unit; values that are masked or not finite count as missing.
    inputs : int, default 5
        Number of past samples in a step, 1 to 64.
    hidden : int, default 2
        Number of tanh units, 1 to 8.
    seed : int, default 0
        Seed of the initial weights.

    Returns
    -------
    NetworkModel
        Network with `gain_over_ar`, `limit_cycle` and `verdict`.

    Raises
    ------
    TypeError
        If `z` does not hold real numbers, or `inputs` or `hidden` is not a whole number.
    ValueError
        If `z` is not one axis, is constant, or has fewer than 50 training samples per weight. If
        the squares of the samples overflow. If a number is out of range.

    Notes
    -----
    Levenberg-Marquardt: K. Levenberg, Quarterly of Applied Mathematics 2, 1944; D. W. Marquardt,
    Journal of the Society for Industrial and Applied Mathematics 11, 1963. Weights do not depend on
    the unit. Training on 20,000 samples takes 0.3 to 3 s.

    Examples
    --------
    >>> import numpy as np
    >>> z = np.random.default_rng(1).standard_normal(8000)
    >>> found = fit_network(z)
    >>> found.verdict, found.n, found.held_out
    ('no gain', 3995, 3995)
    """
    inputs = _check_range("inputs", inputs, MAX_INPUTS)
    hidden = _check_range("hidden", hidden, MAX_HIDDEN)
    weights = hidden * (inputs + 2) + 1
    record = mark_gaps(
        as_record(z, 2 * SAMPLES_PER_WEIGHT * weights, f"a network of {weights} weights")
    )
    part = min(MAX_TRAINING_SAMPLES, record.size // 2)
    x, y = _training_pairs(record[:part], inputs)
    past, then = _training_pairs(record[part:], inputs)
    _check_enough(y.size, then.size, weights)
    ar = fit_ar(record[:part], inputs)
    mean, scale = float(np.nanmean(record[:part])), float(np.nanstd(record[:part]))
    x, y = (x - mean) / scale, (y - mean) / scale
    start = _initial_weights(inputs, hidden, x, y, np.random.default_rng(seed))
    w, b, v, c = _unpack_weights(_train(start, x, y, inputs, hidden), inputs, hidden)
    model = NetworkModel(w, b, v, c, mean, scale, y.size, then.size, 0.0, 0.0, 0.0, ar)
    return replace(
        model,
        rmse=_rms(then - model.step(past)),
        ar_rmse=_rms(then - (past @ ar.phi + ar.constant)),
        limit_cycle=_limit_cycle(model, x[-1]),
    )


def _check_range(name: str, value: SupportsIndex, maximum: int) -> int:
    whole = operator.index(value)
    if not 1 <= whole <= maximum:
        raise ArgumentError(name, f"must be from 1 to {maximum}, got {whole}")
    return whole


def _check_enough(training_count: int, test_count: int, weights: int) -> None:
    if training_count < SAMPLES_PER_WEIGHT * weights:
        raise ValueError(
            f"a network of {weights} weights needs {SAMPLES_PER_WEIGHT * weights} samples "
            f"for training, {SAMPLES_PER_WEIGHT} a weight, each with all its inputs; the first "
            f"half of z has {training_count}"
        )
    if test_count == 0:
        raise ValueError("the second half of z has no step without a missing sample for the test")


def _past_windows(record: Floats, inputs: int) -> Floats:
    """Return the past samples of each sample after the first ones, newest first."""
    windows = np.lib.stride_tricks.sliding_window_view(record[:-1], inputs)
    return windows[:, ::-1]


def _training_pairs(record: Floats, inputs: int) -> tuple[Floats, Floats]:
    """Return the past samples and the next sample of every step without a missing sample."""
    past, then = _past_windows(record, inputs), record[inputs:]
    there = np.isfinite(then) & np.isfinite(past).all(axis=1)
    return np.ascontiguousarray(past[there]), then[there]


def _unpack_weights(
    theta: Floats, inputs: int, hidden: int
) -> tuple[Floats, Floats, Floats, float]:
    """Split one vector into weights, biases, output and offset."""
    w, b, v, c = np.split(theta, np.cumsum([hidden * inputs, hidden, hidden]))
    return w.reshape(hidden, inputs), b, v, float(c[0])


def _initial_weights(
    inputs: int, hidden: int, x: Floats, y: Floats, rng: np.random.Generator
) -> Floats:
    """Return small random weights, which saturate no unit, with the best output."""
    w = rng.standard_normal((hidden, inputs)) / np.sqrt(inputs)
    b = 0.5 * rng.standard_normal(hidden)
    units = np.column_stack([np.tanh(x @ w.T + b), np.ones(y.size)])
    return np.concatenate([w.ravel(), b, np.linalg.lstsq(units, y, rcond=None)[0]])


def _train(theta: Floats, x: Floats, y: Floats, inputs: int, hidden: int) -> Floats:
    """Return the weights with the smallest sum of squares (Levenberg-Marquardt)."""
    damping, cost = 1e-3, _cost(theta, x, y, inputs, hidden)
    for _ in range(MAX_ROUNDS):
        normal, slope = _normal_equations(theta, x, y, inputs, hidden)
        before = cost
        while damping < MAX_DAMPING:
            # Marquardt's scaling gives each weight its own scale.
            damped = normal + damping * np.diag(np.diag(normal) + 1e-12)
            candidate = theta + np.linalg.solve(damped, slope)
            candidate_cost = _cost(candidate, x, y, inputs, hidden)
            if candidate_cost < cost:
                theta, cost, damping = candidate, candidate_cost, max(damping / 10.0, 1e-12)
                break
            damping *= 10.0
        if before - cost <= COST_TOLERANCE * before:
            break
    return theta


def _cost(theta: Floats, x: Floats, y: Floats, inputs: int, hidden: int) -> float:
    w, b, v, c = _unpack_weights(theta, inputs, hidden)
    return float(np.sum((y - np.tanh(x @ w.T + b) @ v - c) ** 2))


def _normal_equations(
    theta: Floats, x: Floats, y: Floats, inputs: int, hidden: int
) -> tuple[Floats, Floats]:
    w, b, v, c = _unpack_weights(theta, inputs, hidden)
    units = np.tanh(x @ w.T + b)
    slopes = (1.0 - units**2) * v
    products = slopes[:, :, np.newaxis] * x[:, np.newaxis, :]
    jacobian = np.hstack([products.reshape(y.size, -1), slopes, units, np.ones((y.size, 1))])
    return jacobian.T @ jacobian, jacobian.T @ (y - units @ v - c)


def _rms(error: Floats) -> float:
    return float(np.sqrt(np.mean(error**2)))


def _limit_cycle(model: NetworkModel, past: Floats) -> float:
    """Return the standard deviation of the last third of a free run, over the record's."""
    x, path = past.copy(), np.empty(FREE_RUN_STEPS)
    for k in range(FREE_RUN_STEPS):
        path[k] = np.tanh(model.weights @ x + model.biases) @ model.output + model.offset
        x = np.concatenate([path[k : k + 1], x[:-1]])
    return float(np.std(path[2 * FREE_RUN_STEPS // 3 :]))
