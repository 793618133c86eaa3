"""What a replay answers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from zerorate.io import Log
from zerorate.replay.allan import AllanCurves
from zerorate.replay.history import History

__all__ = ["Replay", "Score"]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Score:
    """Measures of one axis, raw or after one method; NaN where one means nothing.

    Parameters
    ----------
    axis, method : str
        The channel's name, and the method or ``"raw"``.
    mean, deviation : float
        In the unit of the log, over the samples present in the raw data.
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
        The chosen method, of which `history`, `memory` and `allan` speak.
    params : mapping
        Arguments that make the chosen filter anew.
    filtered : mapping of str to ndarray, shape (n, k)
        Output of each method, NaN before an axis' first sample.
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
    history : History
        What the chosen filter knew over time.
    memory : ndarray, shape (k,)
        Time in which the chosen filter makes 63 % of a step, s.
    allan : AllanCurves or None
        Allan deviations before and after the chosen filter, where asked for.
    """

    log: Log
    method: str
    params: Mapping[str, Any]
    filtered: Mapping[str, Floats]
    scores: tuple[Score, ...]
    horizons: tuple[float, ...]
    speed: Mapping[str, float]
    guard_count: Mapping[str, npt.NDArray[np.int64]]
    ready: npt.NDArray[np.bool_]
    history: History
    memory: Floats
    allan: AllanCurves | None

    @property
    def filtered_log(self) -> Log:
        """The log after the chosen method."""
        return self.log.with_data(self.filtered[self.method])
