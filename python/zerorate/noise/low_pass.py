"""Low-pass filter of a sensor, and the noise behind it from the spectrum of a record."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.noise.coefficient import Coefficient, CoefficientField
from zerorate.noise.processes import Process
from zerorate.noise.responses import butterworth, moving_average
from zerorate.types import Floats

_SHARE_POINTS: Final = 1 << 14


@dataclass(frozen=True)
class LowPass:
    """Low-pass filter between the noise of a sensor and its samples.

    Parameters
    ----------
    corner : Coefficient
        Frequency at which the filter halves the power density, Hz.
    order : float
        Order of the filter; infinite for a moving average.

    Examples
    --------
    >>> from zerorate.noise import Coefficient, LowPass
    >>> print(LowPass(Coefficient(20.02, sigma=0.1), 2.0))
    low-passed at 20.02 ± 0.10 Hz, second order
    """

    corner: CoefficientField = CoefficientField(positive=True, required=True)
    order: float = 2.0

    def __post_init__(self) -> None:
        """Check the order."""
        if self.order <= 0.0:
            raise ArgumentError("order", f"must be positive, got {self.order}")

    def passed_share(self, rate: float) -> float:
        """Return the share of the white noise's variance that passes, for a sampling rate in Hz.

        Examples
        --------
        >>> from zerorate.noise import LowPass
        >>> round(1.0 / LowPass(5.0, 1.0).passed_share(200.0))  # ratio of variances
        14
        """
        f: Floats = (np.arange(_SHARE_POINTS, dtype=np.float64) + 0.5) * (0.5 / _SHARE_POINTS)
        corner: Floats = np.array([math.log(min(float(self.corner) / rate, 0.4999))])
        if math.isinf(self.order):
            return float(moving_average(f[:, None], corner).mean())
        order = 2.0 if math.isnan(self.order) else self.order
        return float(butterworth(order)(f, corner).mean())

    def __str__(self) -> str:
        """Return corner and order in words."""
        sigma = self.corner.sigma
        if not sigma:
            return f"low-passed at {self.corner.value:g} Hz, {_order_in_words(self.order)}"
        digits = max(0, 1 - math.floor(math.log10(sigma)))
        corner = f"{self.corner.value:.{digits}f} ± {sigma:.{digits}f}"
        return f"low-passed at {corner} Hz, {_order_in_words(self.order)}"


def _order_in_words(order: float) -> str:
    if math.isinf(order):
        return "moving average"
    if math.isnan(order):
        return "two poles"
    words = {1.0: "first order", 2.0: "second order", 3.0: "third order", 4.0: "fourth order"}
    return words.get(order, f"order {order:.2g}")


class Estimate(NamedTuple):
    """Squared amplitude with its standard error, with the sample as unit of time."""

    value: float
    sigma: float


NO_CORNER: Final = Estimate(math.nan, math.nan)


@dataclass(frozen=True)
class Filtered:
    """Noise behind a filter, estimated from the spectrum, with the sample as unit of time.

    Attributes
    ----------
    white, flicker, walk, ramp : Estimate
        N^2, B^2, K^2 and R^2.
    deviance, freedom, chance : float, int, float
        Deviance of the best model, its degrees of freedom, and the probability of a larger
        deviance.
    corner : Estimate
        Corner of the filter, cycles per sample; NaN if no filter is named.
    order : float
        Order of the filter.
    up_to : float
        Frequency below which the model is valid, cycles per sample; NaN for all frequencies.
    response : callable
        Function from frequency, cycles per sample, to the ratio of white noise density to N^2.
    holds : bool
        True if the model explains a filter or a part of the spectrum.
    """

    white: Estimate
    flicker: Estimate
    walk: Estimate
    ramp: Estimate
    deviance: float
    freedom: int
    chance: float
    corner: Estimate = NO_CORNER
    order: float = math.nan
    up_to: float = math.nan
    response: Callable[[Floats], Floats] | None = field(default=None, repr=False)
    holds: bool = True

    @property
    def named(self) -> bool:
        """True if a filter is certain enough to be named."""
        return math.isfinite(self.corner.value)


def band_of(filtered: Filtered, rate: float) -> str:
    """Return the band of the noise, in words; empty for the full band."""
    return describe_band(**band_fields(filtered, rate))


def describe_band(low_pass: LowPass | None = None, up_to: float | None = None) -> str:
    """Return the sentence on a low-pass, or on the part of the spectrum that a model explains."""
    if low_pass is not None:
        return f"{low_pass}: N is the density of the white noise below"
    if up_to is not None:
        return f"N is read below {up_to:.2g} Hz; above, the model does not hold"
    return ""


def band_fields(filtered: Filtered, rate: float) -> dict[str, Any]:
    """Return the model's fields for a filter: `low_pass`, and `up_to` in Hz."""
    fields: dict[str, Any] = {}
    if filtered.named:
        corner = Coefficient(filtered.corner.value * rate, filtered.corner.sigma * rate)
        fields["low_pass"] = LowPass(corner, filtered.order)
    if math.isfinite(filtered.up_to):
        fields["up_to"] = filtered.up_to * rate
    return fields


_MIN_RESPONSE_LINES: Final = 1 << 12
_MAX_RESPONSE_LINES: Final = 1 << 18


def process_of(filtered: Filtered) -> Process:
    """Return white noise behind a filter, with unit density well below its corner.

    It follows from the autocovariance r of its rate: s(k+1) - s(k) = -(r(0)/2 + r(1) + ... + r(k)).
    """
    assert filtered.response is not None
    lines = _MIN_RESPONSE_LINES
    if filtered.corner.value > 0.0:
        lines = max(lines, 1 << math.ceil(math.log2(64.0 / filtered.corner.value)))
    lines = min(lines, _MAX_RESPONSE_LINES)
    density = filtered.response((np.arange(lines + 1) * 0.5 / lines)[:, None])[:, 0]
    covariance = np.fft.irfft(density)[:lines]
    covariance[0] *= 0.5
    slope = -np.cumsum(covariance)
    phase = np.concatenate(([0.0], np.cumsum(slope)))
    # The running sum is even, and its negative second difference is the phase.
    rise = np.concatenate(([0.0], -np.cumsum(phase[1:-1])))
    summed = np.concatenate(([0.0], np.cumsum(rise)))
    return Process(
        phase=lambda k: _continued(phase, np.abs(k), 0),
        summed=lambda k: _continued(summed, np.abs(k), 1),
    )


def _continued(table: Floats, k: Floats, sums: int) -> Floats:
    """Return a table at any lags; beyond its end it continues like white noise."""
    last = len(table) - 1
    near = np.interp(np.minimum(k, last), np.arange(len(table)), table)
    over = np.maximum(k - last, 0.0)
    if sums == 0:
        return near - 0.5 * over
    level = -(table[last] - 2.0 * table[last - 1] + table[last - 2])
    step = table[last] - table[last - 1]
    # The sum of -phase(last + j) = level' + j/2, taken twice.
    cube = over * (over - 1.0) * (over + 1.0) / 12.0
    return np.asarray(near + over * step - (level - 0.5) * over * (over + 1.0) / 2.0 + cube)
