"""Deviation curves in a window that slides along a record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from zerorate import _native
from zerorate.faults import ArgumentError
from zerorate.noise.kinds import KindName, TauGrid, averaging_factors, averaging_times
from zerorate.noise.kinds import kind as find_kind
from zerorate.noise.quantities import check_unit
from zerorate.noise.records import check_record
from zerorate.record.named import rate_of, unit_of

if TYPE_CHECKING:
    pass

from zerorate.types import Floats
from zerorate.units import whole_samples
from zerorate.views import Result

_DEFAULT_WINDOW_COUNT: Final = 50
_TAUS_PER_WINDOW: Final = 10
_MIN_SAMPLES: Final = 20
# Number of windows in one computation, so that copies stay small compared with the record.
_BATCH_WINDOWS: Final = 16


@dataclass(frozen=True, eq=False)
class DynamicAllan(Result):
    """Deviations in a window that slides along a record.

    Attributes
    ----------
    kind : str
        Kind of deviation.
    times : ndarray, shape (w,)
        Middle of each window, s from the start of the record.
    taus : ndarray, shape (t,)
        Averaging times, s.
    deviation : ndarray, shape (w, t)
        Deviations in `unit`; NaN if gaps leave no term in a window.
    window : float
        Length of a window, s.
    unit : str
        Unit of the record; ``"unit"`` if it is unknown.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> z = np.random.default_rng(1).standard_normal(20_000)
    >>> d = zr.noise.dynamic_allan(z, rate=100.0, window=20.0, unit="deg/s")
    >>> d.window, d.deviation.shape == (len(d.times), len(d.taus))
    (20.0, True)
    """

    kind: str
    times: Floats
    taus: Floats
    deviation: Floats
    window: float
    unit: str


def dynamic_allan(
    z: npt.ArrayLike,
    rate: float | None = None,
    window: float | None = None,
    step: float | None = None,
    kind: KindName = "oadev",
    taus: TauGrid | Sequence[float] | npt.ArrayLike = "octave",
    *,
    unit: str | None = None,
    threads: int | None = None,
) -> DynamicAllan:
    """Return deviation curves in a window that slides along a record.

    Use it for sensors with changing noise: warm-up, intermittent vibration, a failing part.

    Parameters
    ----------
    z : array_like, shape (n,)
        Rates; values that are not finite count as missing.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`.
    window : float, optional
        Length of the window, s. Default: a tenth of the record. Averaging times end at a tenth of
        the window, because deviations at longer times would be too uncertain.
    step : float, optional
        Time from one window to the next, s. Default: chosen for about fifty windows in the record.
    kind, taus, unit, threads
        As in `allan`.

    Returns
    -------
    DynamicAllan
        The deviations, with `plot`.

    Raises
    ------
    ValueError
        If the window has fewer than 20 samples or is longer than the record. If the step is not
        positive. If another argument is not as described.

    Notes
    -----
    L. Galleani, P. Tavella, "The dynamic Allan variance", IEEE Trans. Ultrason. Ferroelectr. Freq.
    Control 56(3), 2009.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> louder = np.linspace(1.0, 2.0, 20_000) * np.random.default_rng(1).standard_normal(20_000)
    >>> d = zr.noise.dynamic_allan(louder, rate=100.0, window=20.0, unit="deg/s")
    >>> bool(d.deviation[-1, 0] > 1.7 * d.deviation[0, 0])
    True
    """
    rate, family = rate_of(rate, z), find_kind(kind)
    record = check_record(z, rate)
    size, stride = _window_sizes(record.size, rate, window, step)
    longest = max(_native.longest_factor(kind, size) * 2 // _TAUS_PER_WINDOW, 1)
    m, _ = averaging_factors(taus, family, rate, longest)
    if m.size == 0:
        raise ValueError(f"a window of {size / rate:g} s is too short for {kind}")
    windows = np.lib.stride_tricks.sliding_window_view(record, size)[::stride]
    deviations = [
        _native.allan_deviations(windows[i : i + _BATCH_WINDOWS].T, m, kind, 0, threads)[0].T
        for i in range(0, len(windows), _BATCH_WINDOWS)
    ]
    time = 1.0 / rate if family.time else 1.0
    return DynamicAllan(
        kind=kind,
        times=(np.arange(len(windows), dtype=np.float64) * stride + size / 2.0) / rate,
        taus=averaging_times(m, family, rate),
        deviation=np.concatenate(deviations) * time,
        window=size / rate,
        unit=check_unit(unit_of(unit, z)),
    )


def _window_sizes(n: int, rate: float, window: float | None, step: float | None) -> tuple[int, int]:
    """Return the length of a window and the step to the next, in samples."""
    for name, time in (("window", window), ("step", step)):
        if time is not None and not math.isfinite(time):
            raise ArgumentError(name, f"must be a finite time in s, got {time}")
    size = n // 10 if window is None else whole_samples(window, rate)
    if not _MIN_SAMPLES <= size <= n:
        raise ValueError(
            f"a window must hold {_MIN_SAMPLES} to {n} samples (the record), "
            f"{size / rate:g} s hold {size}"
        )
    stride = (
        max((n - size) // _DEFAULT_WINDOW_COUNT, 1) if step is None else whole_samples(step, rate)
    )
    if stride < 1:
        raise ArgumentError("step", f"must be at least one sample, {1.0 / rate:g} s, got {step}")
    return size, stride
