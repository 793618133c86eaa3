"""What a replay answers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from zerorate.io import Log
from zerorate.io.quantity import split_unit, with_suffix
from zerorate.replay.allan import AllanCurves
from zerorate.replay.history import History
from zerorate.replay.readings import Readings

__all__ = ["Output", "Replay", "Score", "compensated"]

Output = Literal["estimate", "compensated"]
Floats = npt.NDArray[np.float64]


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
class Replay:
    """A log after the filters.

    Parameters
    ----------
    log : Log
        What was filtered: n samples of k axes.
    method : str
        The chosen method, of which all from `output` on speak.
    output : {"estimate", "compensated"}
        What the filtered log holds: the drift, or the raw rate minus it.
    params : mapping
        Arguments that make the chosen filter anew.
    filtered : mapping of str to ndarray, shape (n, k)
        Drift by each method, NaN before an axis' first sample.
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
    allan : AllanCurves or None
        Allan deviations at rest before and after the chosen filter, where asked for.
    readings : Readings or None
        How well the drift was known at each sample; None for a published method that neither minds
        motion nor compensates.
    """

    log: Log
    method: str
    output: Output
    params: Mapping[str, Any]
    filtered: Mapping[str, Floats]
    scores: tuple[Score, ...]
    horizons: tuple[float, ...]
    speed: Mapping[str, float]
    guard_count: Mapping[str, npt.NDArray[np.int64]]
    ready: npt.NDArray[np.bool_]
    status: tuple[str, ...]
    history: History
    memory: Floats
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
        columns: dict[str, npt.NDArray[np.float64 | np.bool_]] = {}
        for i, name in enumerate(self.log.names):
            dimensional = with_suffix(name, self.log.unit)
            bias, sigma = self.drift[:, i], self.readings.bias_sigma[:, i]
            columns[f"bias_{dimensional}"] = bias
            columns[f"bias_sigma_{dimensional}"] = np.where(np.isnan(bias), np.nan, sigma)
            columns[f"at_rest_{split_unit(name)[0]}"] = self.readings.at_rest[:, i]
        return columns


def compensated(raw: Floats, drift: Floats) -> Floats:
    """Return raw minus drift, NaN where a sample is missing."""
    # Numbers near the largest double overflow: a filter answers with its limit then.
    with np.errstate(over="ignore", invalid="ignore"):
        return np.where(np.isfinite(raw), raw - drift, np.nan)
