"""Readings of a barometer, a compass or an antenna pair, on their own clocks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.record.missing import floats
from zerorate.types import Booleans, Floats, Integers

AID_KINDS: Final = ("height", "pressure", "heading", "baseline")
"""Kinds of aids; ``NavigationFilter.process_arrays`` uses the index in this tuple as the kind."""

OUTPUTS: Final = ("position", "height", "velocity", "attitude", "heading")
"""Names of the columns of `Track.usable`."""

_AXES: Final = {"height": 1, "pressure": 1, "heading": 1, "baseline": 3}


@dataclass(frozen=True, eq=False, repr=False)
class Aid:
    """Readings of one aid for ``NavigationFilter.process``.

    Parameters
    ----------
    time : array_like, shape (k,)
        Times of the readings, s, in rising order, on the clock of the inertial sensors.
    value : array_like, shape (k,) or (k, 3)
        Readings, NaN if missing. The unit depends on the kind of aid:

        - height: m
        - pressure: Pa
        - heading: rad
        - baseline between two antennas: vector north, east, down (m)
    sigma : float or array_like, shape (k,) or (k, 3), optional
        Standard deviation of the readings, in the unit of `value`. Default: the filter's value.

    Raises
    ------
    ValueError
        If the shapes do not match, the times are not finite and rising, or a standard deviation is
        not positive.

    Examples
    --------
    >>> from zerorate.navigation import Aid
    >>> Aid([0.0, 0.1, 0.2], [1.20, float("nan"), 1.21], sigma=0.05)
    Aid(2 readings)
    """

    time: npt.ArrayLike
    value: npt.ArrayLike
    sigma: float | npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        """Check the arguments."""
        time, value = floats(self.time, "time"), floats(self.value, "value")
        if time.ndim != 1 or value.shape not in ((len(time),), (len(time), 3)):
            expected = f"({len(time)},) or ({len(time)}, 3)" if time.ndim == 1 else "(k,) or (k, 3)"
            raise ArgumentError("value", f"must have shape {expected}, got {value.shape}")
        if not (np.isfinite(time).all() and (np.diff(time) >= 0.0).all()):
            raise ArgumentError("time", "must be finite and in order")
        spread = floats(np.nan if self.sigma is None else self.sigma, "sigma")
        if spread.ndim == 1 and value.ndim == 2 and spread.shape == time.shape != (3,):
            spread = spread[:, np.newaxis]
        if spread.ndim > value.ndim or (spread <= 0.0).any():
            raise ArgumentError("sigma", "must be positive, one or of the shape of value")
        spread = np.broadcast_to(spread, value.shape).copy()
        for name, values in (("time", time), ("value", value), ("sigma", spread)):
            object.__setattr__(self, name, values)

    def __repr__(self) -> str:
        """Return the number of readings."""
        values = floats(self.value, "value")
        missing = np.isnan(values) if values.ndim == 1 else np.isnan(values).any(axis=1)
        return f"Aid({np.sum(~missing)} readings)"


@dataclass(frozen=True, eq=False)
class AidResults:
    """Readings of one aid, with the filter's verdict on each reading.

    Attributes
    ----------
    time : ndarray, shape (k,)
        Times of the readings, s.
    value : ndarray, shape (k,) or (k, 3)
        Readings, in the units of `Aid`.
    verdict : ndarray of uint8, shape (k,)
        Verdict on each reading: an index into `zerorate.navigation.VERDICTS`.
    nis : ndarray, shape (k,)
        Normalised innovation squared of each reading. In a consistent filter its mean is 3 for a
        baseline and 1 for other aids. NaN for readings out of sequence.
    taken : ndarray, shape (k,)
        Time of the sample after which the filter used each reading, s. NaN for readings after the
        last sample.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=60.0, seed=1)
    >>> start = zr.align(drive.recording(), latitude=48.0, heading="course")
    >>> nav = zr.NavigationFilter(start)
    >>> height = drive.truth_position[:, 2] + 30.0
    >>> track = nav.process(drive.recording(), drive.fixes, height=height)
    >>> readings = track.aids["height"]
    >>> zr.navigation.VERDICTS[readings.verdict[-1]], round(nav.height_reference)
    ('used', 30)
    """

    time: Floats
    value: Floats
    verdict: npt.NDArray[np.uint8]
    nis: Floats
    taken: Floats


@dataclass(frozen=True, eq=False)
class AidRows:
    """Readings of all aids, sorted by time.

    Parameters
    ----------
    rows : ndarray, shape (a, 8)
        Rows for ``process_arrays``: kind, time, three readings and three standard deviations.
    """

    rows: Floats

    @classmethod
    def of(cls, given: dict[str, npt.ArrayLike | Aid | None], time: Floats) -> AidRows:
        """Return the rows, from the readings by kind. Readings without times belong to `time`."""
        parts = [
            _pack(kind, aid if isinstance(aid, Aid) else _at_samples(kind, aid, time))
            for kind, aid in given.items()
            if aid is not None
        ]
        rows = np.concatenate(parts) if parts else np.empty((0, 8))
        # Readings at the same time keep the order of their kinds.
        return cls(rows[np.argsort(rows[:, 1], kind="stable")])

    def results(self, outputs: dict[str, Any]) -> dict[str, AidResults]:
        """Remove the aids' results from a filter's outputs, and return them by kind."""
        verdict, nis, taken = (outputs.pop(f"aid_{name}") for name in ("verdict", "nis", "taken"))
        kinds = self.rows[:, 0].astype(int)
        found: dict[str, AidResults] = {}
        for k in np.unique(kinds).tolist():
            at: Integers = np.flatnonzero(kinds == k)
            value = self.rows[at, 2:5] if _AXES[AID_KINDS[k]] == 3 else self.rows[at, 2]
            parts = (self.rows[at, 1], value, verdict[at], nis[at], taken[at])
            found[AID_KINDS[k]] = AidResults(*parts)
        return found


def _at_samples(kind: str, values: npt.ArrayLike, time: Floats) -> Aid:
    found = floats(values, kind)
    expected = (len(time),) if _AXES[kind] == 1 else (len(time), 3)
    if found.shape != expected:
        raise ArgumentError(kind, f"must have shape {expected}, or be an Aid, got {found.shape}")
    there = np.isfinite(found)
    present = there if there.ndim == 1 else there.all(axis=1)
    return Aid(time[present], found[present])


def _pack(kind: str, aid: Aid) -> Floats:
    # `Aid` converts its arguments to arrays.
    time, value, sigma = (np.asarray(part) for part in (aid.time, aid.value, aid.sigma))
    axes = _AXES[kind]
    if (value.ndim == 2) != (axes == 3):
        raise ArgumentError(kind, f"must have {axes} number{'s' * (axes > 1)} at each time")
    rows = np.zeros((len(time), 8))
    rows[:, 0], rows[:, 1] = AID_KINDS.index(kind), time
    rows[:, 2 : 2 + axes] = value.reshape(len(time), axes)
    rows[:, 5:8] = sigma.reshape(len(time), axes)
    return rows


def unpack_usable(bits: npt.NDArray[np.uint8]) -> Booleans:
    """Return the columns of `Track.usable`, shape (n, 5), from the filter's bits."""
    powers = np.uint8(1) << np.arange(len(OUTPUTS), dtype=np.uint8)
    columns: Booleans = (bits[:, np.newaxis] & powers) != 0
    return columns


def judge_sigma(sigma: Floats, limits: dict[str, float]) -> Booleans:
    """Return the mask of smoothed outputs with a standard deviation within its limit, (n, 5)."""
    parts = (slice(0, 2), slice(2, 3), slice(3, 6), slice(6, 8), slice(8, 9))
    sizes = [np.sqrt((sigma[:, part] ** 2).sum(axis=1)) for part in parts]
    within: Booleans = np.column_stack(sizes) <= [limits[name] for name in OUTPUTS]
    return within
