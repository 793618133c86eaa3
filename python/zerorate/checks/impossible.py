"""Detection of impossible rates and single corrupt samples, in batches and live.

**Evidence.** A bit error or a lost decimal point can give one sample any value. Integrated over one
period it changes the heading permanently: 20,000 deg/s in one row at 100 Hz are 200 deg.

**Thresholds.**

- No MEMS gyro has a range above 4000 deg/s (ISM330DHCX; most end at 2000): higher rates are errors.
- Within the range a sample is a spike in two cases: above 1000 deg/s if it is 8 times larger than
  both neighbours, above 300 deg/s if it is 50 times larger. A gyro's own low-pass filter, below
  half the sampling rate, spreads any motion over at least two samples. Samples of a fast motion or
  of a clipped rotation have neighbours of their size, and a knock rings. Below 50 Hz a real motion
  fits between two samples, so no sample counts as a spike.

A spike below 300 deg/s may be a knock on a sensor at rest, and stays.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from zerorate.numerals import shorten
from zerorate.record.recording import Recording
from zerorate.types import Booleans, Floats
from zerorate.units import UNITS, convert

GYRO_RANGE_DPS: Final = 4000.0
"""Largest range of a MEMS gyro on the market, deg/s."""
SPIKES: Final = ((math.radians(1000.0), 8.0), (math.radians(300.0), 50.0))
"""Pairs of a rate, rad/s, and the ratio to both neighbours above which a sample is corrupt."""
_MAX_IMPOSSIBLE_SHARE: Final = 0.01
"""Largest share of impossible samples; a larger share means a wrong unit."""
MIN_RATE_HZ: Final = 50.0
"""Sampling rate below which a real motion fits between two samples."""


def find_impossible_rates(
    rate_rad_s: Floats, limit: float | None = None, rate: float | None = None
) -> Booleans:
    """Return the mask of impossible samples, shape (n,).

    Parameters
    ----------
    rate_rad_s
        Rates of a gyro, rad/s, shape (n, 3) or (n,); NaN where missing.
    limit
        Range of the gyro, rad/s. A sample is impossible if any axis exceeds it. Default 4000 deg/s.
    rate
        Sampling rate, Hz. Below 50 Hz spikes are not tested. None: tested.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.checks.impossible import find_impossible_rates
    >>> rates = np.zeros((5, 3))
    >>> rates[1, 2], rates[3] = np.radians(20_000.0), np.radians([0.0, 500.0, 10.0])
    >>> find_impossible_rates(rates, rate=100.0)
    array([False,  True, False,  True, False])
    """
    with np.errstate(invalid="ignore"):
        size = np.abs(rate_rad_s.reshape(len(rate_rad_s), -1)).max(axis=1)
        beyond: Booleans = size > _resolve_limit(limit)
        if rate is not None and rate < MIN_RATE_HZ:
            return beyond
        known = np.where(beyond, np.nan, size)
        around = np.maximum(known[:-2], known[2:])
        spike = np.zeros(len(size), np.bool_)
        for least, ratio in SPIKES:
            spike[1:-1] |= (known[1:-1] > least) & (known[1:-1] > ratio * around)
    return beyond | spike


def _resolve_limit(limit: float | None) -> float:
    return math.radians(GYRO_RANGE_DPS) if limit is None else limit


def mask_impossible_rates(recording: Recording, gyro: str) -> tuple[Recording, tuple[str, ...]]:
    """Mask impossible samples of a gyro as missing.

    Parameters
    ----------
    recording : Recording
        Recording with a gyro of a known unit; otherwise nothing is checked.
    gyro : str
        Name of the log.

    Returns
    -------
    tuple
        Recording, unchanged if all samples are possible; and an alarm.
    """
    log = recording.get(gyro)
    if log is None or log.unit not in UNITS or UNITS[log.unit].kind != "rate":
        return recording, ()
    mask = find_impossible_rates(convert(log.data, log.unit, "rad/s"), rate=log.rate)
    count = int(mask.sum())
    # A larger share of corrupt samples means another unit.
    if not count or count > max(_MAX_IMPOSSIBLE_SHARE * log.n, 1.0):
        return recording, ()
    largest = math.degrees(float(np.nanmax(np.abs(convert(log.data[mask], log.unit, "rad/s")))))
    alarm = (
        f"{', '.join(log.names)}: {count} of {log.n} samples are impossible and left out: up to "
        f"{shorten(largest, 4)} deg/s, the first at {log.sampled[int(np.argmax(mask))]:.6g} s"
    )
    data = np.where(mask[:, np.newaxis], np.nan, log.data)
    return replace(recording, logs={**recording, gyro: replace(log, data=data)}), (alarm,)


class ImpossibleRateDetector:
    """Detector of impossible samples in a stream, as `find_impossible_rates` for a batch.

    A sample beyond the range is excluded at once. A possible spike is excluded until the next
    sample arrives; `revised` is then True if it was motion.

    Parameters
    ----------
    limit, rate
        As in `find_impossible_rates`.
    scale
        Factor from the rates to rad/s.

    Attributes
    ----------
    beyond_count, spike_count : int
        Numbers of excluded samples: beyond the range, and spikes.
    revised : bool
        After `take`: True if the previous sample was excluded as a spike but was motion.

    Examples
    --------
    >>> from zerorate.checks.impossible import ImpossibleRateDetector
    >>> check = ImpossibleRateDetector(rate=100.0)
    >>> [check.take((0.0, 0.0, z)) for z in (0.0, 400.0, 0.1, 20.0, 0.1)]
    [False, True, False, True, False]
    >>> [check.take((0.0, 0.0, z)) for z in (0.0, 20.0, 19.0)], check.revised
    ([False, True, False], True)
    """

    def __init__(
        self, limit: float | None = None, rate: float | None = None, scale: float = 1.0
    ) -> None:
        self.beyond_count = self.spike_count = 0
        self.revised = False
        self._limit = _resolve_limit(limit)
        self._spikes = rate is None or rate >= MIN_RATE_HZ
        self._scale = scale
        self._usual = _MIN_SPIKE_RATE_RAD_S / scale
        self._last: list[float] = [math.nan] * 3
        self._suspect: float | None = None

    @property
    def undecided(self) -> bool:
        """True if the next sample decides about the last one."""
        return self._suspect is not None

    def take(self, rates: Sequence[float]) -> bool:
        """Return True if a sample must be excluded; its first three numbers are the rates."""
        usual = self._usual
        if (
            self._suspect is None
            and -usual < rates[0] < usual
            and -usual < rates[1] < usual
            and -usual < rates[2] < usual
        ):
            self.revised, self._last = False, rates[:3]  # type: ignore[assignment]
            return False
        return self._classify(list(rates[:3]))

    def _classify(self, rates: list[float]) -> bool:
        size = self._size(rates)
        self.revised = self._suspect is not None and not _is_spike(self._suspect, size)
        self.spike_count -= self.revised
        beyond = size > self._limit
        spike = not beyond and self._spikes and _is_spike(size, self._size(self._last))
        # Do not compare the next sample with an excluded one.
        self._last = [math.nan] * 3 if beyond else rates
        self._suspect = size if spike else None
        self.beyond_count += beyond
        self.spike_count += spike
        return beyond or spike

    def _size(self, rates: list[float]) -> float:
        largest = max(map(abs, rates))
        return self._scale * largest if sum(rates) == sum(rates) else math.nan

    def sentences(self) -> Iterator[str]:
        """Yield sentences with the numbers of excluded samples."""
        range_ = f"{math.degrees(self._limit):.6g} deg/s"
        for count, what in (
            (self.beyond_count, f"beyond the gyro's range of {range_}"),
            (self.spike_count, "far larger than both neighbours"),
        ):
            if count:
                yield f"rates left out as impossible: {count} {what}"

    def state(self) -> dict[str, Any]:
        """Return the state for storage as JSON."""
        return dict(vars(self))

    def go_on(self, state: Mapping[str, Any]) -> None:
        """Restore a state; ValueError if it belongs to another check."""
        if state.keys() != vars(self).keys() or state["_limit"] != self._limit:
            raise ValueError("the state belongs to another check")
        vars(self).update(state)


_MIN_SPIKE_RATE_RAD_S: Final = min(least for least, _ in SPIKES)


def _is_spike(size: float, neighbour: float) -> bool:
    return any(size > least and size > ratio * neighbour for least, ratio in SPIKES)
