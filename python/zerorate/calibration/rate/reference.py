"""Fit of a gyro to a reference, an encoder or another gyro: scale, bias and lag with errors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.noise.coefficient import UNKNOWN_COEFFICIENT, Coefficient, check_positive
from zerorate.numerals import format_significant, format_with_error
from zerorate.record import Log, LogError
from zerorate.record.missing import floats
from zerorate.record.named import rate_of
from zerorate.record.names import UNKNOWN_UNIT
from zerorate.types import Booleans, Floats
from zerorate.units import convert, kind
from zerorate.views import Result

_PART_COUNT: Final = 10
_MAX_SIGMAS: Final = 3.0
"""Difference in standard errors above which the model is wrong."""
_MAX_RELATIVE_SIGMA: Final = 0.3
"""Largest standard error of an identifiable scale or lag, relative to the scale or to the longest
lag.
"""
_MIN_WINDOW_SHARE: Final = 0.1
"""Smallest share of the windows for a fit of one direction alone."""
_WINDOW_PIECES: Final = 8
"""Number of pieces of a window. A rotation forth and back within a piece is not detected."""
_FULL_TURNS: Final = {"rad": 2.0 * math.pi, "deg": 360.0}
"""Full turn in each unit."""


@dataclass(frozen=True)
class FittedRate(Result):
    """Fit of a gyro to the rate of a reference: ``z(t) = scale w(t - lag) + bias``.

    Attributes
    ----------
    scale : Coefficient
        Scale; negative if the axes point in opposite directions.
    bias : Coefficient
        Bias in the unit of the gyro.
    lag : Coefficient
        Delay of the gyro, s.
    positive, negative : Coefficient
        Scale from windows with positive reference rates, and scale from windows with negative
        rates. Each of these fits has its own bias.
    asymmetry : Coefficient
        Scale for positive rates minus scale for negative rates, with a common bias.
    residual : float
        RMS residual of the angle over a window, in the unit of the gyro times seconds.
    step : float
        Smallest step between values of the reference angle; NaN for a reference rate.
    window : float
        Length of a window, s.
    notes : tuple of str
        Sentences on deviations from the model, and on unknown quantities.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> t = np.arange(20_000) / 100.0
    >>> found = zr.calibration.fit_rate(1.02 * np.cos(t) + 0.1, rate=100.0, reference=np.cos(t))
    >>> round(found.scale.value, 6), found.correct([0.1, 1.12]).round(6).tolist()
    (1.02, [0.0, 1.0])
    """

    scale: Coefficient
    bias: Coefficient
    lag: Coefficient
    positive: Coefficient
    negative: Coefficient
    asymmetry: Coefficient
    residual: float
    step: float
    window: float
    notes: tuple[str, ...]

    def correct(self, z: npt.ArrayLike) -> Floats:
        """Return rates corrected for bias and scale, but not for the lag.

        NaN if the scale is unknown.
        """
        scale = self.scale.value if self.scale.identifiable else math.nan
        corrected: Floats = (floats(z, "z") - self.bias.value) / scale
        return corrected


def fit_rate(
    z: npt.ArrayLike | Log,
    rate: float | None = None,
    angle: npt.ArrayLike | Log | None = None,
    reference: npt.ArrayLike | Log | None = None,
    *,
    window: float = 1.0,
    max_lag: float = 0.1,
) -> FittedRate:
    """Fit scale, bias and lag of one axis of a gyro to a reference angle or rate.

    Parameters
    ----------
    z : array_like, shape (n,), or Log of one channel
        Rate from the gyro, NaN where missing.
    rate : float, optional
        Sampling rate of arrays, Hz. A log has its own.
    angle : array_like, shape (n,), or Log of one channel, optional
        True angle at the samples, for instance from an encoder, in the unit of `z` times seconds. A
        log in deg or rad is converted and unwrapped.
    reference : array_like, shape (n,), or Log of one channel, optional
        True rate at the samples, as an alternative to `angle`.
    window : float
        Time over which angles are compared, s. Default 1. A longer window reduces the effect of the
        reference's steps and of clock jitter. A shorter window makes more use of fast motion.
    max_lag : float
        Largest lag to try, positive or negative, s. Default 0.1.

    Returns
    -------
    FittedRate
        Result with `scale`, `bias` and `lag`; `notes` describe deviations from the model.

    Raises
    ------
    ValueError
        If not exactly one of `angle` and `reference` is given. If lengths differ. If a tenth of the
        record is shorter than two windows. If the units of logs are not of one quantity (LogError,
        a ValueError).

    Notes
    -----
    For every window, the gyro rate is shifted by the lag and integrated by trapezoids. The
    integrals are fitted to the rotations of the reference. A window begins at each sample, because
    windows without overlap may beat with a periodic motion. The lag minimises the residual.

    Standard errors are jackknife estimates: each of ten parts of the record is left out in turn.
    They include the drift of the bias and the correlation of neighbouring windows. They do not
    include errors that repeat in all parts, such as the steps of an encoder in an exactly periodic
    motion. Therefore each direction is also fitted alone. A note states if the two scales differ by
    more than three standard errors.

    Examples
    --------
    >>> t = np.arange(20_000) / 100.0
    >>> true_angle = 90.0 * np.sin(t)
    >>> z = 1.02 * 90.0 * np.cos(t - 0.013) + 0.4
    >>> found = fit_rate(z, rate=100.0, angle=true_angle)
    >>> round(found.scale.value, 4), round(found.bias.value, 3), round(found.lag.value, 4)
    (1.02, 0.4, 0.013)
    """
    track = _make_track(z, rate, angle, reference)
    width = max(round(check_positive("window", window) * track.rate), 1)
    margin = math.ceil(check_positive("max_lag", max_lag) * track.rate) + 1
    windows = _Windows.of(track, width, margin)
    fit = _fit_windows(windows, margin - 1)
    step = math.nan if angle is None else _median_step(track.angle)
    result = replace(fit, step=step, window=width / track.rate)
    return replace(result, notes=tuple(_notes(result, windows, fit.notes)))


class _Track(NamedTuple):
    """Rates of the gyro, and the reference angle at its samples, shape (n,), NaN where missing."""

    z: Floats
    angle: Floats
    rate: float


def _make_track(
    z: npt.ArrayLike | Log,
    rate: float | None,
    angle: npt.ArrayLike | Log | None,
    reference: npt.ArrayLike | Log | None,
) -> _Track:
    if (angle is None) == (reference is None):
        raise ValueError("give either angle or reference")
    hertz = rate_of(rate, z)
    values = _parse_channel("z", z)
    if angle is not None:
        whole = _unwrap(angle, _parse_channel("angle", angle))
        reference_angle = _interpolate_at(z, angle, whole * _unit_factor(z, angle, is_angle=True))
    else:
        assert reference is not None
        rates = _parse_channel("reference", reference) * _unit_factor(z, reference, is_angle=False)
        reference_angle = _integrate(_interpolate_at(z, reference, rates), hertz)
    if reference_angle.shape != values.shape:
        raise ValueError(
            f"the reference must have the gyro's shape {values.shape}, got {reference_angle.shape}"
        )
    return _Track(_replace_infinite(values), _replace_infinite(reference_angle), hertz)


def _replace_infinite(values: Floats) -> Floats:
    """Return the samples with infinite values replaced by NaN."""
    return np.where(np.isfinite(values), values, np.nan)


def _parse_channel(name: str, channel: npt.ArrayLike | Log) -> Floats:
    values = floats(channel, name)
    if values.ndim == 2 and values.shape[1] == 1:
        values = values[:, 0]
    if values.ndim != 1:
        raise ArgumentError(name, f"must be one axis, of shape (n,), got {values.shape}")
    return values


def _unit_factor(
    z: npt.ArrayLike | Log, reference: npt.ArrayLike | Log, *, is_angle: bool
) -> float:
    """Return the factor from the unit of a reference to the unit of the gyro."""
    if (
        not isinstance(z, Log)
        or not isinstance(reference, Log)
        or UNKNOWN_UNIT in (z.unit, reference.unit)
    ):
        return 1.0
    wanted = "angle" if is_angle else "rate"
    try:
        kinds = kind(z.unit), kind(reference.unit)
    except ValueError as error:
        raise LogError(str(error)) from None
    if kinds != ("rate", wanted):
        raise LogError(
            f"the gyro must be in a unit of rate and the reference in one of {wanted}, "
            f"got {z.unit} and {reference.unit}"
        )
    if not is_angle:
        return convert(1.0, reference.unit, z.unit)
    return convert(1.0, reference.unit, "rad") * convert(1.0, "rad/s", z.unit)


def _unwrap(angle: npt.ArrayLike | Log, values: Floats) -> Floats:
    """Return the angle of a log without jumps by full turns."""
    turn = _FULL_TURNS.get(angle.unit) if isinstance(angle, Log) else None
    if turn is None:
        return values
    finite, unwrapped = np.isfinite(values), values.copy()
    unwrapped[finite] = np.unwrap(values[finite], period=turn)
    return unwrapped


def _interpolate_at(
    z: npt.ArrayLike | Log, reference: npt.ArrayLike | Log, values: Floats
) -> Floats:
    """Return the reference interpolated at the samples of the gyro."""
    if not isinstance(z, Log) or not isinstance(reference, Log):
        return values
    if z.n == reference.n and np.allclose(
        z.sampled, reference.sampled, rtol=0.0, atol=1e-3 / z.rate
    ):
        return values
    return np.interp(z.sampled, reference.sampled, values, left=np.nan, right=np.nan)


def _integrate(rates: Floats, rate: float) -> Floats:
    """Return the angle by trapezoids, with the last sample held at missing samples."""
    finite = np.isfinite(rates)
    if not finite.any():
        return np.full(rates.shape, np.nan)
    index = np.arange(rates.size)
    filled = np.interp(index, index[finite], rates[finite])
    angle = np.concatenate(([0.0], np.cumsum(0.5 * (filled[1:] + filled[:-1])))) / rate
    return np.where(finite, angle, np.nan)


@dataclass(frozen=True, eq=False)
class _Windows:
    """Windows that begin at each sample: rotation of the reference, and integral of the gyro."""

    first: npt.NDArray[np.int64]
    rotation: Floats
    total_rotation: Floats
    width: int
    rate: float
    rates: Floats
    sums: Floats
    part: npt.NDArray[np.int64]

    @classmethod
    def of(cls, track: _Track, width: int, margin: int) -> _Windows:
        n = track.z.size
        least = 2 * _PART_COUNT * width + 2 * margin
        if n < least:
            raise ValueError(
                f"{n} samples are too few for windows of {width}: {_PART_COUNT} parts of "
                "two windows "
                f"need {least}; a shorter window needs fewer"
            )
        there = np.isfinite(track.z)
        rates = np.where(there, track.z, 0.0)
        sums = np.concatenate(([0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1]))))
        counts = np.concatenate(([0], np.cumsum(~there)))
        first = np.arange(margin, n - margin - width)
        whole = counts[first + width + margin] == counts[first - margin]
        turned = track.angle[first + width] - track.angle[first]
        known = whole & np.isfinite(turned)
        first, turned = first[known], turned[known]
        part = ((first - margin) * _PART_COUNT) // (n - 2 * margin - width)
        if len(np.unique(part)) < _PART_COUNT:
            raise ValueError("too many samples are missing: a tenth of the record has no window")
        way = _total_rotation(track.angle, width)[first]
        return cls(first, turned, way, width, track.rate, rates, sums, part)

    def integral(self, lag: float) -> Floats:
        """Return the integral of the gyro over each window, shifted by a lag in samples."""
        return (
            self._angle(self.first + self.width, lag) - self._angle(self.first, lag)
        ) / self.rate

    def _angle(self, index: npt.NDArray[np.int64], lag: float) -> Floats:
        whole = math.floor(lag)
        part, at = lag - whole, index + whole
        before, after = self.rates[at], self.rates[at + 1]
        angle: Floats = self.sums[at] + part * before + 0.5 * part**2 * (after - before)
        return angle


def _total_rotation(angle: Floats, width: int) -> Floats:
    """Return the absolute rotation of each window, summed over its pieces."""
    finite, index = np.isfinite(angle), np.arange(angle.size)
    whole = np.interp(index, index[finite], angle[finite])
    edges = np.unique(np.linspace(0, width, _WINDOW_PIECES + 1).round().astype(np.int64))
    last = angle.size - width
    rotation = np.zeros(last)
    for begin, end in pairwise(edges):
        rotation += np.abs(whole[end : end + last] - whole[begin : begin + last])
    return rotation


class _Moments(NamedTuple):
    """Sums over the windows of each part: products of time, x, way and y, shape (parts, 4, 4).

    x is the reference's rotation over a window. The way is the sum of the absolute rotations in its
    pieces.
    """

    sums: Floats

    @classmethod
    def of(
        cls,
        windows: _Windows,
        lag: float,
        mask: Booleans | None = None,
    ) -> _Moments:
        rows = slice(None) if mask is None else mask
        x, y = windows.rotation[rows], windows.integral(lag)[rows]
        length = windows.width / windows.rate
        columns = np.stack((np.full(x.size, length), x, windows.total_rotation[rows], y))
        part, sums = windows.part[rows], np.empty((_PART_COUNT, 4, 4))
        for i, one in enumerate(columns):
            for j, other in enumerate(columns[: i + 1]):
                both = np.bincount(part, one * other, _PART_COUNT)
                sums[:, i, j] = sums[:, j, i] = both
        return cls(sums)

    def leave_one_out(self) -> Floats:
        """Return the sums of all parts, then without each part, shape (parts + 1, 4, 4)."""
        total = self.sums.sum(axis=0)
        return np.concatenate((total[None], total - self.sums))


def _solve(sums: Floats, columns: tuple[int, ...]) -> tuple[Floats, Floats]:
    """Return coefficients of columns, shape (m, c), and residual sums of squares, (m,)."""
    indices = list(columns)
    A, b = sums[:, indices][:, :, indices], sums[:, indices, 3]
    size = np.sqrt(np.diagonal(A, axis1=1, axis2=2))
    size = np.where(size > 0.0, size, 1.0)
    scaled = A / size[:, :, None] / size[:, None, :]
    with np.errstate(invalid="ignore"):
        sound = np.linalg.cond(scaled) < 1e12
    values = np.full(b.shape, np.nan)
    solved = np.linalg.solve(scaled[sound], (b / size)[sound][..., None])[..., 0]
    values[sound] = solved / size[sound]
    squares = sums[:, 3, 3] - np.einsum("mi,mi->m", values, b)
    return values, squares


_LINE_COLUMNS: Final = (0, 1)
_BENT_COLUMNS: Final = (0, 1, 2)


def _fit_windows(windows: _Windows, max_lag: int) -> FittedRate:
    """Return the fit; `max_lag` is the longest lag in samples."""
    lags, notes = _find_lag(windows, max_lag)
    moments = _Moments.of(windows, float(lags[0]))
    values, squares = _solve(moments.leave_one_out(), _LINE_COLUMNS)
    by_direction = [
        _scale_of_direction(windows, float(lags[0]), mask)
        for mask in (windows.rotation > 0.0, windows.rotation < 0.0)
    ]
    known = bool(np.isfinite(values).all())
    scale = (
        _make_coefficient(values[:, 1], _MAX_RELATIVE_SIGMA * abs(values[0, 1]))
        if known
        else UNKNOWN_COEFFICIENT
    )
    # Without motion only the bias remains.
    bias = _make_coefficient(
        values[:, 0] if known else _solve(moments.leave_one_out(), (0,))[0][:, 0]
    )
    if not scale.identifiable:
        notes.append("the scale is not identifiable: the reference hardly rotates")
    lag = _make_coefficient(lags / windows.rate, _MAX_RELATIVE_SIGMA * max_lag / windows.rate)
    asymmetry = UNKNOWN_COEFFICIENT
    if scale.identifiable and all(np.isfinite(one).all() for one in by_direction):
        notes.extend(_direction_notes(values[:, 1], *by_direction))
        asymmetry = _make_coefficient(2.0 * _solve(moments.leave_one_out(), _BENT_COLUMNS)[0][:, 2])
    return FittedRate(
        scale=scale,
        bias=bias,
        lag=lag,
        positive=_make_coefficient(by_direction[0]),
        negative=_make_coefficient(by_direction[1]),
        asymmetry=asymmetry,
        residual=math.sqrt(max(float(squares[0]), 0.0) / windows.first.size) if known else math.nan,
        step=math.nan,
        window=math.nan,
        notes=tuple(notes),
    )


def _scale_of_direction(windows: _Windows, lag: float, mask: Booleans) -> Floats:
    """Return the scale from some windows, then without each part; NaN for few windows."""
    if np.mean(mask) < _MIN_WINDOW_SHARE:
        return np.full(_PART_COUNT + 1, np.nan)
    scales: Floats = _solve(_Moments.of(windows, lag, mask).leave_one_out(), _LINE_COLUMNS)[0][:, 1]
    return scales


def _find_lag(windows: _Windows, max_lag: int) -> tuple[Floats, list[str]]:
    """Return the lag in samples with the smallest residual, then without each part, and notes.

    A parabola through three lags one sample apart gives a first minimum. A parabola through three
    lags a quarter apart around this minimum gives the lag.
    """
    candidates = np.arange(-max_lag, max_lag + 1)
    squares = [
        _solve(_Moments.of(windows, float(lag)).leave_one_out()[:1], _LINE_COLUMNS)[1][0]
        for lag in candidates
    ]
    unknown = np.full(_PART_COUNT + 1, np.nan)
    unknown[0] = 0.0
    if not np.isfinite(squares).all():
        return unknown, []
    best = int(np.argmin(squares))
    if best in (0, candidates.size - 1):
        farthest = format_significant(max_lag / windows.rate)
        return unknown, [f"the lag is not identifiable: the residual falls as far as {farthest} s"]
    lags = np.full(_PART_COUNT + 1, float(candidates[best]))
    for step in (1.0, 0.25):
        middle = min(max(float(lags[0]), 1.0 - max_lag), max_lag - 1.0)
        lags_tried = [middle + step * k for k in (-1, 0, 1)]
        low, mid, high = (
            _solve(_Moments.of(windows, t).leave_one_out(), _LINE_COLUMNS)[1] for t in lags_tried
        )
        curvature = low - 2.0 * mid + high
        with np.errstate(divide="ignore", invalid="ignore"):
            lags = middle + step * np.where(curvature > 0.0, 0.5 * (low - high) / curvature, np.nan)
        if not np.isfinite(lags[0]):
            break
    sigma = _jackknife_sigma(lags)
    if not sigma <= _MAX_RELATIVE_SIGMA * max_lag:
        return unknown, ["the lag is not identifiable: the reference rotates too steadily"]
    return lags, []


def _jackknife_sigma(values: Floats) -> float:
    """Return the standard error of the first value; the others each omit a part."""
    spread = float(np.mean((values[1:] - values[1:].mean()) ** 2))
    return math.sqrt((_PART_COUNT - 1) * spread)


def _make_coefficient(values: Floats, limit: float = math.inf) -> Coefficient:
    """Return the first value with its error; not identifiable if the error exceeds the limit."""
    if not np.isfinite(values).all():
        return UNKNOWN_COEFFICIENT
    coefficient = Coefficient(float(values[0]), _jackknife_sigma(values))
    if coefficient.sigma <= limit:
        return coefficient
    return Coefficient(coefficient.value, coefficient.sigma, False, coefficient.upper_bound)


def _direction_notes(both: Floats, positive_: Floats, negative: Floats) -> Iterator[str]:
    """Yield a sentence if the scale of one direction differs from the scale of both."""
    for name, alone in (("positive", positive_), ("negative", negative)):
        off = _make_coefficient(alone - both)
        if not off.known or not abs(off) > _MAX_SIGMAS * off.sigma:
            continue
        yield (
            f"{name} rates alone give a scale of {alone[0]:.6g}, {abs(off) / off.sigma:.2g} "
            f"standard errors from that of both, {both[0]:.6g}: the model lacks an effect that "
            f"these errors do not include"
        )


def _notes(fit: FittedRate, windows: _Windows, notes: tuple[str, ...]) -> Iterator[str]:
    yield from notes
    # A window has two ends, each with a uniform error of one step.
    by_steps = fit.step / math.sqrt(6.0)
    if fit.residual > _MAX_SIGMAS * by_steps:
        yield (
            f"the residual is {fit.residual / by_steps:.2g} times what the reference's steps of "
            f"{format_significant(fit.step)} make"
        )
    if fit.asymmetry.known and abs(fit.asymmetry) > _MAX_SIGMAS * fit.asymmetry.sigma:
        number = format_with_error(fit.asymmetry.value, fit.asymmetry.sigma)
        yield f"the scale differs by {number} between the directions"


def _median_step(angle: Floats) -> float:
    """Return the usual step between neighbouring values of an angle, NaN if there are none."""
    values = np.unique(angle[np.isfinite(angle)])
    return float(np.median(np.diff(values))) if values.size > 1 else math.nan
