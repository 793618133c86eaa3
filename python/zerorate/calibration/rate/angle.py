"""From rate to angle: integration of one axis or of three, with its standard deviation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias, cast, get_args

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.calibration.rate.angle_error import RateErrors, angle_sigma
from zerorate.calibration.rate.gaps import bridge
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.geometry import rotations
from zerorate.noise import FLICKER_FLOOR, NoiseModel
from zerorate.noise.coefficient import Coefficient
from zerorate.record import Log, LogError
from zerorate.record.missing import floats
from zerorate.record.named import rate_of, unit_of
from zerorate.record.names import UNKNOWN_UNIT
from zerorate.types import Booleans, Floats
from zerorate.units import convert, kind
from zerorate.views import OneArray, Result

IntegrationMethod: TypeAlias = Literal["backward-euler", "trapezoid", "coning"]

_IGNORED_TERMS = ("quantization", "rate_ramp", "markov", "sinusoid")


@dataclass(frozen=True, eq=False)
class Integrated(OneArray, Result):
    """Angle or orientation from an integrated rate.

    Attributes
    ----------
    angle : ndarray, shape (n,)
        For one axis: angle since the first sample, rad. For three axes: angle between the
        orientation and the first orientation, 0 to pi.
    quaternion : ndarray, shape (n, 4), or None
        For three axes: unit quaternions w, x, y, z. They rotate vectors from the body's axes at a
        sample to its axes at the first sample. None for one axis.
    sigma : ndarray, shape (n,) or (n, 3), or None
        Standard deviation of the angle, rad. For three axes: standard deviation of the rotation
        about each of the body's axes at the first sample. None if no noise was given.
    bridged : ndarray of bool, shape (n,)
        Mask of missing samples.
    rate : float
        Samples per second, Hz.
    method : str
        Method of integration.
    notes : tuple of str
        Sentences on missing samples, and on errors that `sigma` does not include.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> turned = zr.integrate(np.tile([0.0, 0.0, 0.5], (101, 1)), rate=100.0)
    >>> turned.quaternion[-1].round(3).tolist(), turned.sigma
    ([0.969, 0.0, 0.0, 0.247], None)
    """

    _array_field: ClassVar[str] = "angle"

    angle: Floats
    quaternion: Floats | None
    sigma: Floats | None
    bridged: Booleans
    rate: float
    method: IntegrationMethod
    notes: tuple[str, ...]


def integrate(
    z: npt.ArrayLike | Log,
    rate: float | None = None,
    method: IntegrationMethod = "coning",
    *,
    unit: str | None = None,
    noise: NoiseModel | None = None,
    angle_random_walk: npt.ArrayLike | None = None,
    rate_random_walk: npt.ArrayLike | None = None,
    bias_sigma: npt.ArrayLike | None = None,
) -> Integrated:
    """Integrate an angular rate about one or three axes, and estimate the error of the result.

    Parameters
    ----------
    z : Log, or array_like of shape (n,), (n, 1) or (n, 3)
        Rate with its bias removed.
    rate : float, optional
        Sampling rate of an array, Hz. A log has its own rate and timestamps.
    method : {"coning", "trapezoid", "backward-euler"}
        Rate assumed between two samples. "backward-euler": the rate at the second sample.
        "trapezoid": the mean of both rates. "coning" (default): the mean plus, for three axes, a
        correction for the motion of the rotation axis. For one axis, "coning" equals "trapezoid".
    unit : str, optional
        Unit of `z`. Default: the unit of the log, or rad/s for arrays.
    noise : NoiseModel, optional
        Noise of each axis, for `sigma`. N and K are used. Bias instability B is added as a constant
        bias of 0.664 B.
    angle_random_walk, rate_random_walk : float or array_like, shape (3,), optional
        N in rad/s/sqrt(Hz) and K in rad/s/sqrt(s). They replace the values of `noise`.
    bias_sigma : float or array_like, shape (3,), optional
        Standard deviation of the removed bias, rad/s.

    Returns
    -------
    Integrated
        Result with `angle`, `quaternion`, `sigma` and `bridged`.

    Raises
    ------
    ValueError
        If `z` has another shape, fewer than two samples, or an axis without samples. If an argument
        is not as described. If the unit of a log is not an angular rate (LogError, a ValueError).

    Notes
    -----
    Without rotation, `sigma` is the root of N^2 t + bias_sigma^2 t^2 + K^2 t^3/3. For three axes
    the errors are propagated through the orientation: a bias about x acts along the changing
    direction of x. `sigma` does not include the error of the method in motion that is too fast for
    the sampling rate.

    Missing samples are interpolated linearly. At an end of the record the nearest sample is held.
    The error of a gap is measured on the record: intervals of the same length without a gap are
    interpolated in the same way. Their RMS angle error is added to `sigma` after the gap. If no
    interval is long enough, the error is the standard deviation of all rates times the gap's
    length.

    Coning: the rotation between two samples is (w0 + w1) dt/2 + (w0 x w1) dt^2/12. This formula is
    exact to third order for a rate that changes linearly: J. E. Bortz, "A new mathematical
    formulation for strapdown inertial navigation", IEEE Trans. Aerosp. Electron. Syst. 7(1), 1971.

    Examples
    --------
    >>> turned = integrate(np.full(101, 0.5), rate=100.0, angle_random_walk=1e-4, bias_sigma=1e-3)
    >>> round(float(turned.angle[-1]), 6), round(float(turned.sigma[-1]), 6)
    (0.5, 0.001005)
    """
    if method not in get_args(IntegrationMethod):
        names = ", ".join(get_args(IntegrationMethod))
        raise ArgumentError("method", f"must be one of {names}, got {method!r}")
    record = _Record.of(z, rate, unit)
    errors, ignored = _rate_errors(
        record.rates.shape[1], noise, angle_random_walk, rate_random_walk, bias_sigma
    )
    dt = 1.0 / record.rate
    rates, missing, gaps = bridge(record.rates, dt)
    orientation = None
    if rates.shape[1] == 3:
        orientation = _native.integrate_rates(rates, record.steps, method)
        angle = rotations.angle(orientation)
    else:
        angle = _sum_steps(rates[:, 0], record.steps, method)
    sigma = None if errors is None else angle_sigma(orientation, record.steps, errors, gaps)
    if sigma is not None and orientation is None:
        sigma = sigma[:, 0]
    notes = (*_missing_notes(missing), *ignored)
    return Integrated(angle, orientation, sigma, missing, record.rate, method, notes)


@dataclass(frozen=True, eq=False)
class _Record:
    """Rates in rad/s, shape (n, 1) or (n, 3), their sampling rate in Hz and the steps in s."""

    rates: Floats
    rate: float
    steps: Floats

    @classmethod
    def of(cls, z: npt.ArrayLike | Log, rate: float | None, unit: str | None) -> _Record:
        values, hertz = floats(z, "z"), rate_of(rate, z)
        if values.ndim == 1:
            values = values[:, None]
        if isinstance(z, Log):
            return cls._from_values(values, hertz, np.diff(z.sampled), _resolve_unit(z, unit))
        steps = np.full(max(len(values) - 1, 0), 1.0 / hertz)
        return cls._from_values(values, hertz, steps, unit_of(unit, z) or "rad/s")

    @classmethod
    def _from_values(cls, values: Floats, rate: float, steps: Floats, unit: str) -> _Record:
        if values.ndim != 2 or values.shape[1] not in (1, 3):
            raise ArgumentError("z", f"must have shape (n,), (n, 1) or (n, 3), got {values.shape}")
        if len(values) < 2:
            raise ArgumentError("z", f"must have two samples or more, got {len(values)}")
        if not np.isfinite(values).any(axis=0).all():
            raise ArgumentError("z", "must have a sample on each axis, but all of one are missing")
        if kind(unit) != "rate":
            raise ArgumentError("unit", f"must be one of an angular rate, got {unit!r}")
        return cls(values * convert(1.0, unit, "rad/s"), rate, steps)


def _resolve_unit(log: Log, unit: str | None) -> str:
    if log.unit == UNKNOWN_UNIT and unit is None:
        raise LogError(
            make_sentence(
                f"the unit of {', '.join(log.names)} is not known: give ", keyword_argument("unit")
            )
        )
    return unit_of(unit, log) or log.unit


def _sum_steps(rates: Floats, steps: Floats, method: IntegrationMethod) -> Floats:
    """Return the angle about one axis; "coning" equals "trapezoid" here."""
    ends = rates[1:] if method == "backward-euler" else 0.5 * (rates[1:] + rates[:-1])
    return np.concatenate(([0.0], np.cumsum(ends * steps)))


def _rate_errors(
    k: int,
    noise: NoiseModel | None,
    white: npt.ArrayLike | None,
    walk: npt.ArrayLike | None,
    bias: npt.ArrayLike | None,
) -> tuple[RateErrors | None, list[str]]:
    """Return the errors of k axes, and sentences on errors that are not included."""
    if noise is None and white is None and walk is None and bias is None:
        return None, []
    if noise is not None and noise.quantity != "angular rate":
        raise ArgumentError(
            "noise", f"must be that of an angular rate, got one of {noise.quantity}"
        )
    model = NoiseModel() if noise is None else noise
    instability = FLICKER_FLOOR * _conservative_value(model.bias_instability)
    known = RateErrors(
        _broadcast_axes(
            "angle_random_walk",
            _conservative_value(model.angle_random_walk) if white is None else white,
            k,
        ),
        np.hypot(_broadcast_axes("bias_sigma", 0.0 if bias is None else bias, k), instability),
        _broadcast_axes(
            "rate_random_walk",
            _conservative_value(model.rate_random_walk) if walk is None else walk,
            k,
        ),
    )
    return known, [] if noise is None else list(_ignored_notes(noise, white, walk))


def _conservative_value(coefficient: float) -> float:
    known = cast(Coefficient, coefficient)
    return known.conservative if known.known else 0.0


def _broadcast_axes(name: str, values: npt.ArrayLike, k: int) -> Floats:
    array = np.array(values, dtype=np.float64)
    if array.shape not in ((), (k,)) or not (np.isfinite(array) & (array >= 0.0)).all():
        raise ArgumentError(
            name, "must be finite and not negative, one number or one for each axis"
        )
    return np.broadcast_to(array, (k,))


def _ignored_notes(
    noise: NoiseModel, white: npt.ArrayLike | None, walk: npt.ArrayLike | None
) -> Iterator[str]:
    names = [name.replace("_", " ") for name in _IGNORED_TERMS if getattr(noise, name)]
    if names:
        yield f"sigma leaves out of the noise model: {', '.join(names)}"
    overrides = {"angle_random_walk": white, "bias_instability": None, "rate_random_walk": walk}
    unknown = [n for n, value in overrides.items() if value is None and not getattr(noise, n).known]
    if unknown:
        listed = ", ".join(name.replace("_", " ") for name in unknown)
        yield f"sigma counts as zero, because the noise model lacks it: {listed}"


def _missing_notes(missing: Booleans) -> Iterator[str]:
    count = int(np.count_nonzero(missing))
    if count:
        verb = "is" if count == 1 else "are"
        yield f"{count} of {missing.size} samples {verb} missing, bridged by lines"
