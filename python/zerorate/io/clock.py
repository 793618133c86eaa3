"""From timestamps to a uniform grid, with a report on how good the clock was."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from zerorate.io.errors import LogError
from zerorate.io.gaps import LONG_STEP, WINDOW, missing_samples, places
from zerorate.io.steady import resolution, roundest, steady_clock

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class ClockReport:
    """How the timestamps of a log deviate from a uniform clock.

    Parameters
    ----------
    rate
        Rate of the best uniform clock through the stamps, Hz; without stamps the rate given.
    stamped
        Whether the file had timestamps.
    jitter_rms, jitter_max
        Deviation of the stamps from that clock, s.
    repeated, backward
        Stamps equal to, and less than, the one before. Their rows are kept in file order.
    gaps, missing_samples
        Places where samples are missing, and the number of NaN rows put there.
    longest_gap
        Longest step between two stamps at a gap, s.
    """

    rate: float
    stamped: bool = True
    jitter_rms: float = 0.0
    jitter_max: float = 0.0
    repeated: int = 0
    backward: int = 0
    gaps: int = 0
    missing_samples: int = 0
    longest_gap: float = 0.0

    def summary(self) -> str:
        """Return one sentence on the clock.

        Examples
        --------
        >>> ClockReport(rate=100.0).summary()
        'clock regular at 100 Hz'
        """
        if not self.stamped:
            return f"no timestamps, rate {self.rate:.7g} Hz as stated"
        faults = self._faults()
        if not faults:
            return f"clock regular at {self.rate:.7g} Hz"
        return f"clock at {self.rate:.7g} Hz with {', '.join(faults)}"

    def _faults(self) -> list[str]:
        faults = []
        if self.jitter_max * self.rate > 0.01:
            rms, most = 1e3 * self.jitter_rms, 1e3 * self.jitter_max
            faults.append(f"jitter of {rms:.3g} ms rms ({most:.3g} ms at most)")
        if self.repeated:
            faults.append(_counted(self.repeated, "repeated stamp"))
        if self.backward:
            faults.append(_counted(self.backward, "backward step"))
        if self.gaps:
            missing = _counted(self.missing_samples, "missing sample")
            gaps = f"{missing} in {_counted(self.gaps, 'gap')}"
            faults.append(f"{gaps} (longest {self.longest_gap:.3g} s)")
        return faults


@dataclass(frozen=True)
class Grid:
    """Uniform rate (Hz), grid length, the report, and the places of rows that leave gaps."""

    rate: float
    length: int
    report: ClockReport
    spread: IntArray | None = None

    @property
    def place(self) -> IntArray:
        """Place of each row on the grid, shape (n,)."""
        return np.arange(self.length) if self.spread is None else self.spread


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def unstamped(n: int, rate: float) -> Grid:
    """Return the grid of n rows without timestamps."""
    return Grid(rate, n, ClockReport(rate, stamped=False))


def fit_grid(stamps: FloatArray, start: float = 0.0, rate: float | None = None) -> Grid:
    """Return the uniform grid that fits the stamps.

    Parameters
    ----------
    stamps
        Seconds since the first one, shape (n,), finite.
    start
        The first stamp, s; it bounds the precision of the others.
    rate
        Rate stated by the caller or the file, Hz. It is taken if the stamps agree.

    Raises
    ------
    LogError
        If the stamps are no clock, contradict the rate, or leave a gap too long to fill.
    """
    if len(stamps) < 2:
        if rate is None:
            raise LogError("one row gives no rate; give rate=")
        return Grid(rate, 1, ClockReport(rate))
    if (steady := steady_clock(stamps, start)) is not None:
        _check_agrees(rate, steady.rate)
        report = ClockReport(steady.rate, jitter_rms=steady.rms, jitter_max=steady.most)
        return Grid(rate or steady.rate, len(stamps), report)
    return _fitted(stamps, start, rate)


def _fitted(stamps: FloatArray, start: float, rate: float | None) -> Grid:
    """Return the grid of stamps that may be late, early, coarse, or missing."""
    steps = np.diff(stamps)
    _check_forward(steps)
    period = _first_period(stamps, steps)
    even = _rebased(stamps, steps, period)
    for _ in range(2):
        missing = missing_samples(even, period)
        place = places(missing, even)
        period = _slope(even, place)
    own_rate, deviation = _own_rate(even, place, start)
    report = _report(steps, missing, deviation, own_rate)
    _check_agrees(rate, own_rate)
    length = int(place[-1]) + 1
    return Grid(rate or own_rate, length, report, None if length == len(stamps) else place)


def _check_forward(steps: FloatArray) -> None:
    backward = int((steps < 0).sum())
    if backward > max(1, 0.01 * len(steps)):
        raise LogError(
            f"the time column goes backward in {backward} of {len(steps)} steps, "
            "expected timestamps that rise"
        )


def _check_agrees(rate: float | None, own_rate: float) -> None:
    if rate is not None and abs(own_rate / rate - 1) > 0.01:
        raise LogError(
            f"the rate is stated as {rate:g} Hz, but the timestamps run at {own_rate:g} Hz"
        )


def _first_period(stamps: FloatArray, steps: FloatArray) -> float:
    """Return the period to a few per cent, unmoved by gaps, coarse stamps and bursts."""
    middle = float(np.median(steps))
    near = np.abs(steps - middle) <= 0.5 * middle
    if middle > 0 and near.mean() >= 0.9:
        return float(steps[near].mean())
    # Lost samples never shorten a step: many short ones are late stamps or bursts.
    if np.mean(steps < 0.5 * middle) > 0.05 or middle <= 0:
        return _slope(stamps, np.arange(len(stamps)))
    # Coarse stamps even out over many rows, where lost samples do not.
    lag = max(1, min(512, len(stamps) // 8))
    low, half, high = np.percentile(stamps[lag:] - stamps[:-lag], (25, 50, 75))
    if high - low > 1.5 * middle:
        return float(steps[near].mean())
    return float(half) / lag


def _advancing(period: float) -> float:
    if not 0 < period < np.inf:
        raise LogError("the timestamps do not advance")
    return period


def _rebased(stamps: FloatArray, steps: FloatArray, period: float) -> FloatArray:
    """Return the stamps with every lasting jump backward taken out."""
    deviation = stamps - period * np.arange(len(stamps))
    jump = np.zeros(len(stamps))
    for row in np.flatnonzero(steps < 0) + 1:
        before = np.median(deviation[max(0, row - WINDOW) : row])
        after = np.median(deviation[row : row + WINDOW])
        if after - before < -LONG_STEP * period:
            jump[row] = after - before
    return stamps - np.cumsum(jump) if jump.any() else stamps


def _slope(stamps: FloatArray, place: IntArray) -> float:
    half = len(stamps) // 2
    slopes = (stamps[half:] - stamps[:-half]) / (place[half:] - place[:-half])
    return _advancing(float(np.median(slopes)))


def _own_rate(stamps: FloatArray, place: IntArray, start: float) -> tuple[float, FloatArray]:
    """Return the roundest rate the stamps cannot tell from the fitted one, and the deviations."""
    period = _slope(stamps, place)
    deviation = stamps - period * place
    deviation -= np.median(deviation)
    unsure = float(np.median(np.abs(deviation))) + resolution(start, float(stamps[-1]))
    return roundest(period, unsure / (period * int(place[-1]))), deviation


def _report(
    steps: FloatArray, missing: FloatArray, deviation: FloatArray, rate: float
) -> ClockReport:
    gaps = missing > 0
    return ClockReport(
        rate=rate,
        jitter_rms=float(np.sqrt(np.mean(deviation**2))),
        jitter_max=float(np.abs(deviation).max()),
        repeated=int((steps == 0).sum()),
        backward=int((steps < 0).sum()),
        gaps=int(gaps.sum()),
        missing_samples=int(missing.sum()),
        longest_gap=float(steps[gaps].max()) if gaps.any() else 0.0,
    )
