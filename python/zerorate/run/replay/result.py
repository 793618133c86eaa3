"""What a replay answers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from zerorate.io import Log
from zerorate.io.log import Header
from zerorate.run.replay.allan import AllanCurves
from zerorate.run.replay.columns import beside, compensated
from zerorate.run.replay.history import History
from zerorate.run.replay.readings import Readings

__all__ = ["Output", "Replay", "Score", "Seen", "Summary"]

Output = Literal["estimate", "compensated"]
Floats = npt.NDArray[np.float64]
Counts = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Score:
    """Measures of one axis, raw or of one method's drift; NaN where one means nothing.

    All are of the samples that are present in the raw data and, if the chosen filter minds motion,
    that it took for rest.

    Parameters
    ----------
    axis, method : str
        The channel's name, and the method or ``"raw"``.
    mean, deviation : float
        In the unit of the log.
    reduction : float
        Deviation over that of the raw data.
    coasting : tuple of float
        `zerorate.metrics.coasting_error` at each horizon, unit times seconds.
    error : float
        RMS error to the true drift where that was given.
    """

    axis: str
    method: str
    mean: float
    deviation: float
    reduction: float
    coasting: tuple[float, ...]
    error: float


@dataclass(frozen=True, eq=False)
class Seen:
    """Counts of each axis' samples, shape (k,).

    Parameters
    ----------
    missing, present : ndarray of int64
        Samples that are NaN, and that are finite.
    equal : ndarray of bool
        Whether all that are present are equal.
    at_rest : ndarray of int64 or None
        Samples at which the chosen filter learned, where that was noted.
    """

    missing: Counts
    present: Counts
    equal: npt.NDArray[np.bool_]
    at_rest: Counts | None


@dataclass(frozen=True, eq=False, kw_only=True)
class Summary:
    """What a replay says of a log, without its samples.

    Parameters
    ----------
    header : Header
        What was filtered: n samples of k axes.
    method : str
        The chosen method, of which all from `output` on speak.
    output : {"estimate", "compensated"}
        What the filtered log holds: the drift, or the raw rate minus it.
    params : mapping
        Arguments that make the chosen filter anew.
    scores : tuple of Score
        Axis by axis: the raw data, then each method.
    horizons : tuple of float
        Horizons of the coasting errors, s.
    speed : mapping of str to float
        Samples per second of computing on one core, the axes counted one by one.
    guard_count : mapping of str to ndarray, shape (k,)
        How often a step of the process noise was shortened.
    ready : ndarray of bool, shape (k,)
        Whether the axis' start-up was finished.
    status : tuple of str
        `DriftFilter.status` of each axis at the end.
    history : History
        What the chosen filter knew over time.
    memory : ndarray, shape (k,)
        Time in which the chosen filter makes 63 % of a step, s.
    seen : Seen
        How many samples were missing, and at rest.
    """

    header: Header
    method: str
    output: Output
    params: Mapping[str, Any]
    scores: tuple[Score, ...]
    horizons: tuple[float, ...]
    speed: Mapping[str, float]
    guard_count: Mapping[str, npt.NDArray[np.int64]]
    ready: npt.NDArray[np.bool_]
    status: tuple[str, ...]
    history: History
    memory: Floats
    seen: Seen


@dataclass(frozen=True, eq=False, kw_only=True)
class Replay(Summary):
    """A log after the filters: its summary, and all series.

    Parameters
    ----------
    log : Log
        What was filtered.
    filtered : mapping of str to ndarray, shape (n, k)
        Drift by each method, NaN before an axis' first sample.
    allan : AllanCurves or None
        Allan deviations at rest before and after the chosen filter, where asked for.
    readings : Readings or None
        How well the drift was known at each sample; None for a published method that neither minds
        motion nor compensates.
    """

    log: Log
    filtered: Mapping[str, Floats]
    allan: AllanCurves | None
    readings: Readings | None

    @property
    def drift(self) -> Floats:
        """The drift by the chosen method, shape (n, k)."""
        return self.filtered[self.method]

    @property
    def filtered_log(self) -> Log:
        """The log after the chosen method: the drift, or the compensated rate."""
        if self.output == "estimate":
            return self.log.with_data(self.drift)
        return self.log.with_data(compensated(self.log.data, self.drift))

    @property
    def beside(self) -> dict[str, npt.NDArray[np.float64 | np.bool_]]:
        """What belongs beside a compensated log, a column an axis: drift, its sigma, rest."""
        if self.output == "estimate" or self.readings is None:
            return {}
        sigma, at_rest = self.readings.bias_sigma.T, self.readings.at_rest.T
        return beside(self.log.names, self.log.unit, self.drift.T, sigma, at_rest)
