"""Drift filters that start with an identified model."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np

from zerorate._native import DriftFilter
from zerorate.identification.polynomials import at_one, autocovariance, is_stationary
from zerorate.noise.least_squares import solve
from zerorate.types import Floats

if TYPE_CHECKING:
    from zerorate._native import _Start
    from zerorate.identification.arma_model import ArmaModel

Method = Literal["kf", "akf", "fading", "robust"]
Parts = dict[str, Floats | float]

_MAX_ORDER: Final = 3

# Share of the variance of phi(B) z below which a variance is rounding.
_ROUNDING_SHARE: Final = 1e-9


class NoiseSplit(NamedTuple):
    """AR(p) drift driven by noise of variance g, and white measurement noise of variance R."""

    g: float
    R: float


def make_filter(
    model: "ArmaModel",
    rate: float,
    method: Method = "fading",
    adapt_for: float | None = 0.0,
    measurement_noise: float | None = None,
    process_noise: float | None = None,
    offset: float | None = None,
    scale: float | None = None,
    **options: Any,  # noqa: ANN401
) -> DriftFilter:
    """Return a drift filter of one signal that starts with this model, ready at once.

    The model is split into an AR(p) drift and white noise of variance R on the samples. White noise
    of variance g drives the drift. The split is exact if possible (ARMA(1, 1) with phi > 0 >
    theta); otherwise g and R have maximum likelihood. With "kf" the filter is optimal from the
    first sample. In ten minutes of a simulated ARMA(1, 1), its error is within 0.1 % of a Kalman
    filter's error with the true model. A filter that starts without a model has three times this
    error.

    A model without a white part, such as any AR(p), would return the samples unchanged. R is then
    the model's Allan variance at the shortest averaging time, gamma_0 - gamma_1. Fu and Han's
    recursion converges to this value. If the model's spectrum does not rise towards low
    frequencies, the model has no drift (g = 0). The estimate of "kf" is then the mean of the model.

    Like every `DriftFilter` it returns the compensated rate, or the estimate with
    ``output="estimate"``. The property `estimate` always has the estimate.

    Parameters
    ----------
    rate : float
        Sampling rate, Hz.
    method : {"kf", "akf", "fading", "robust"}
        Method, as in `DriftFilter` but without "auto", which learns its own start. Default
        "fading". Adaptive R and the weight of the process noise continue as if `startup` seconds
        had passed.
    adapt_for : float or None
        Time for which the filter continues to learn the coefficients, s. The filter continues as if
        it had processed the model's record. None: no limit. Default: 0, constant coefficients. A
        model from `ArmaModel.of` has no errors, so its coefficients stay constant.
    measurement_noise : float, optional
        Variance R, in the squared unit of the record. Default: the model's R.
    process_noise : float, optional
        Variance g of the noise that drives the drift, in the squared unit of the record. Default:
        the model's g.
    offset : float, optional
        Mean of the signal. Default: the mean of the model or, if it has none, of its record.
    scale : float, optional
        Standard deviation of the signal. Default: the standard deviation of the record or, if it is
        unknown, of the model.
    **options
        Further arguments of `DriftFilter`: `output`, `motion`, `fading`, `forgetting_factor`,
        `noise`, `startup`, `process_noise_memory`.

    Raises
    ------
    ValueError
        If p or q is above 3. If a number is out of range. If `offset` or `scale` is neither given
        nor known from the model.

    Examples
    --------
    >>> from zerorate.identification import ArmaModel
    >>> f = ArmaModel.of([0.99], [-0.9], sigma2=4.0).to_filter(rate=100.0, method="kf")
    >>> f.ready, round(f.measurement_noise, 3)
    (True, 3.636)
    """
    order = _common_order([model])
    start = _start_parts(model, order, measurement_noise, process_noise, offset, scale)
    return _build_filter(start, order, rate, method, adapt_for, None, options)


def to_filter(
    models: "Sequence[ArmaModel]",
    rate: float,
    method: Method = "fading",
    adapt_for: float | None = 0.0,
    **options: Any,  # noqa: ANN401
) -> DriftFilter:
    """Return a drift filter of several axes; each axis starts with its own model.

    Parameters
    ----------
    models : sequence of ArmaModel
        One model per axis. The filter has the largest order of all models. Missing coefficients of
        a model are zero and stay zero.
    rate, method, adapt_for, **options
        As for `ArmaModel.to_filter`. `channels` is the number of models.

    Raises
    ------
    ValueError
        If there is no model. As in `ArmaModel.to_filter`.

    Examples
    --------
    >>> from zerorate.identification import ArmaModel, to_filter
    >>> models = [ArmaModel.of([0.99], [-0.9]), ArmaModel.of([0.9], [])]
    >>> to_filter(models, rate=100.0).estimate
    array([0., 0.])
    """
    if not models:
        raise ValueError("to_filter needs at least one model, got none")
    order = _common_order(models)
    own = {name: options.pop(name, None) for name in _MODEL_OPTIONS}
    starts = [_start_parts(model, order, **own) for model in models]
    stacked: Parts = {name: np.stack([np.asarray(s[name]) for s in starts]) for name in starts[0]}
    return _build_filter(stacked, order, rate, method, adapt_for, len(models), options)


_MODEL_OPTIONS: Final = ("measurement_noise", "process_noise", "offset", "scale")


def _build_filter(
    start: Parts,
    order: tuple[int, int],
    rate: float,
    method: Method,
    adapt_for: float | None,
    channels: int | None,
    options: dict[str, Any],
) -> DriftFilter:
    filter_state: _Start = start  # type: ignore[assignment]
    return DriftFilter.started(
        filter_state,
        rate=rate,
        order=order,
        method=method,
        adapt_for=adapt_for,
        channels=channels,
        **options,
    )


def _common_order(models: "Sequence[ArmaModel]") -> tuple[int, int]:
    """Return the largest orders of all models; the filter's p is at least 1."""
    p, q = (max(model.order[i] for model in models) for i in (0, 1))
    if max(p, q) > _MAX_ORDER:
        raise ValueError(f"a filter has orders up to (3, 3), the model has ({p}, {q})")
    return max(p, 1), q


def _start_parts(
    model: "ArmaModel",
    order: tuple[int, int],
    measurement_noise: float | None,
    process_noise: float | None,
    offset: float | None,
    scale: float | None,
) -> Parts:
    if not model.sigma2 > 0.0:
        raise ValueError("a filter needs a model whose innovations have a variance above 0")
    offset = _model_offset(model) if offset is None else offset
    scale = _model_scale(model) if scale is None else scale
    parts = _split_noises(model, measurement_noise, process_noise)
    p, q = order
    coefficients = np.zeros(p + q + 1)
    indices = _coefficient_indices(model, p)
    coefficients[indices] = np.concatenate((model.phi, model.theta, [model.constant]))
    covariance = np.zeros((p + q + 1, p + q + 1))
    covariance[np.ix_(indices, indices)] = _coefficient_covariance(model, scale)
    state = np.zeros((p + 1, p + 1))
    state[:p, :p] = _drift_covariance(coefficients[:p], parts.g, scale)
    state[p, p] = model.sigma2 * _constant_variance(model)
    return {
        "offset": offset,
        "scale": scale,
        "coefficients": coefficients,
        "covariance": covariance,
        "measurement_noise": parts.R,
        "process_noise": parts.g,
        "state_covariance": state,
    }


def _coefficient_indices(model: "ArmaModel", p: int) -> list[int]:
    """Return the indices of [phi, theta, c] in a filter of orders (p, q)."""
    own_p, own_q = model.order
    return [*range(own_p), *range(p, p + own_q), -1]


def _split_noises(
    model: "ArmaModel", measurement_noise: float | None, process_noise: float | None
) -> NoiseSplit:
    if measurement_noise is not None and process_noise is not None:
        return NoiseSplit(process_noise, measurement_noise)
    parts = split_noise(model.phi, model.theta, model.sigma2, measurement_noise)
    return parts if process_noise is None else parts._replace(g=process_noise)


def _model_offset(model: "ArmaModel") -> float:
    if at_one(-model.phi):
        return model.mean
    return _require_finite("offset", model.record_mean)


def _model_scale(model: "ArmaModel") -> float:
    if math.isfinite(model.record_deviation) and model.record_deviation > 0.0:
        return model.record_deviation
    if not model.stationary:
        return _require_finite("scale", math.nan)
    return math.sqrt(float(model.autocovariance(0)[0]))


def _require_finite(name: str, value: float) -> float:
    if math.isfinite(value):
        return value
    raise ValueError(
        f"a model that is not stationary does not determine the {name} of a filter: give it"
    )


def _coefficient_covariance(model: "ArmaModel", scale: float) -> Floats:
    """Return the covariance of [phi, theta, c / scale] over the innovation variance.

    Samples are centred and scaled, so their regressors are orthogonal to the constant. Least
    squares starts with a prior of one sample, which gives P (1 + P)^-1.
    """
    P = np.zeros_like(model.covariance)
    P[:-1, :-1] = model.covariance[:-1, :-1] * (scale**2 / model.sigma2)
    P[-1, -1] = _constant_variance(model)
    values, vectors = np.linalg.eigh(P)
    values = np.maximum(values, 0.0)
    product = (vectors * (values / (1.0 + values))) @ vectors.T
    return np.asarray((product + product.T) / 2.0)


def _constant_variance(model: "ArmaModel") -> float:
    """Return the variance of the constant over the innovation variance, for centred samples."""
    if not model.n or not model.has_constant:
        return 0.0
    return at_one(model.theta) ** 2 / model.n


def _drift_covariance(phi: Floats, g: float, scale: float) -> Floats:
    """Return the covariance of [y_k ... y_(k-p+1)]: stationary, or diagonal."""
    p = phi.size
    if not is_stationary(phi):
        return np.eye(p) * scale**2
    gamma = autocovariance(phi, np.zeros(0), g, p - 1)
    return np.asarray(gamma[np.abs(np.subtract.outer(np.arange(p), np.arange(p)))])


def split_noise(
    phi: Floats, theta: Floats, sigma2: float, measurement_noise: float | None = None
) -> NoiseSplit:
    """Return the drift and white noise with the best approximation of the process by their sum.

    w = phi(B) z has the autocovariance of theta(B) a. The split models it as the sum of white noise
    g and phi(B) v: gamma_w(j) = g [j = 0] + R sum_i phi'_i phi'_(i+j), phi' = [1, -phi]. An exact
    solution is used if it exists (ARMA(1, 1): R = -theta sigma2 / phi). Otherwise the non-negative
    g and R have maximum likelihood. Least squares of gamma_w would be wrong: Fu and Han's ARMA(2,
    1) has no drift in its spectrum, but would get a drift of four times the variance of the
    process.

    A model without an autoregression has no drift: its whole variance is R. For a model without a
    white part, R is the Allan variance at tau0, gamma_0 - gamma_1. The recursion of Fu & Han
    (2019), equation 18, converges to it. A stated `measurement_noise` replaces R.
    """
    if not np.any(phi):
        white = float(sigma2 * (1.0 + theta @ theta))
        return NoiseSplit(0.0, white if measurement_noise is None else measurement_noise)
    auto, moving = np.concatenate(([1.0], -phi)), np.concatenate(([1.0], theta))
    unit_split = _split_exactly(auto, moving) or _fit_split(auto, moving)
    if measurement_noise is not None:
        return NoiseSplit(unit_split.g * sigma2, measurement_noise)
    if unit_split.R > _ROUNDING_SHARE:
        return NoiseSplit(unit_split.g * sigma2, unit_split.R * sigma2)
    return NoiseSplit(unit_split.g * sigma2, _first_difference(phi, theta, sigma2))


def _split_exactly(auto: Floats, moving: Floats) -> NoiseSplit | None:
    lags = max(auto.size, moving.size)
    ma_products = _autocorrelate(moving, lags)
    basis = np.column_stack((np.eye(lags)[0], _autocorrelate(auto, lags)))
    solution = np.linalg.lstsq(basis, ma_products, rcond=None)[0]
    if np.any(np.abs(basis @ solution - ma_products) > _ROUNDING_SHARE * ma_products[0]) or np.any(
        solution < 0.0
    ):
        return None
    return NoiseSplit(*solution.tolist())


def _autocorrelate(coefficients: Floats, lags: int) -> Floats:
    full = np.correlate(coefficients, coefficients, "full")[coefficients.size - 1 :]
    return np.concatenate((full, np.zeros(lags)))[:lags]


def _fit_split(auto: Floats, moving: Floats) -> NoiseSplit:
    """Return the g and R with the largest Whittle likelihood of g + R |phi|^2 for |theta|^2.

    The maximum is a least-squares fit with each frequency weighted by the fit itself.
    """
    frequencies = np.union1d(np.linspace(0.0, np.pi, 4097)[1:], np.geomspace(1e-7, np.pi, 401))
    density = np.gradient(frequencies)
    data, white = _power_response(moving, frequencies), _power_response(auto, frequencies)
    basis = np.column_stack((np.ones_like(white), white))
    start = np.full_like(density, np.mean(data) ** 2) / density
    return NoiseSplit(
        *solve(basis, data, start, lambda s: (basis @ s) ** 2 / density).strengths.tolist()
    )


def _power_response(coefficients: Floats, frequencies: Floats) -> Floats:
    return np.asarray(np.abs(np.polyval(coefficients[::-1], np.exp(-1j * frequencies))) ** 2)


def _first_difference(phi: Floats, theta: Floats, sigma2: float) -> float:
    """Return half the variance of z_k - z_(k-1), which is finite for a random walk."""
    if not at_one(-phi):
        # phi(B) = (1 - B) rest(B), so the difference has the polynomial rest in place of phi.
        rest = -np.cumsum(np.concatenate(([1.0], -phi)))[1:-1]
        return 0.5 * float(autocovariance(rest, theta, sigma2, 0)[0])
    if not is_stationary(phi):
        raise ValueError(
            "an explosive model has no variance of differences: give measurement_noise"
        )
    gamma = autocovariance(phi, theta, sigma2, 1)
    return float(gamma[0] - gamma[1])
