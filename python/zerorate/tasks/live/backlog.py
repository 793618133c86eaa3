"""Filter of a stream that answers without delay, even after a long gap."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zerorate._native import DriftFilter, MotionDetector
from zerorate.tasks.live.lines import DriftColumn, answer_texts

# Enough for a millisecond of the slowest method; a longer prediction has no use in a stream.
_MAX_IMMEDIATE_SAMPLES: Final = 1 << 14
# The slowest method predicts this number in a third of the time between samples.
_PREDICTED_SAMPLES_PER_S: Final = 1 << 22
_BLOCK_SAMPLES: Final = 1 << 16
_NO_FORCE: Final = (math.nan, math.nan, math.nan)


@dataclass
class BacklogFilter:
    """Filter with the number of missing samples that it has not processed yet.

    It processes a long gap in pieces, one with each new sample. Samples that arrive meanwhile are
    answered with the last known drift and count as missing. So the state does not depend on the
    speed of the machine.

    Parameters
    ----------
    filter : DriftFilter
        Filter; with one channel it takes floats.
    extra_columns : sequence of DriftColumn
        Extra columns of an answer.
    pending_count : int
        Number of missing samples that the filter has not processed yet.
    motion : MotionDetector, optional
        Detector of motion by the gyro's accelerometer; a filter that holds the bias in motion uses
        it, as in a replay.
    """

    filter: DriftFilter
    extra_columns: Sequence[DriftColumn]
    pending_count: int = 0
    motion: MotionDetector[Any] | None = None

    def __post_init__(self) -> None:
        """Set the derived fields."""
        self._holds_in_motion = self.motion is not None and self.filter.params["motion"] == "hold"
        self._width = self.filter.channels or 1
        params = self.filter.params
        # A saturated sample counts as missing.
        self._limit = math.inf if params["limit"] is None else params["limit"]
        self._compensates = params["output"] == "compensated"
        # At least two, because the sample that arrives meanwhile is also pending.
        self._catch_up_samples = max(
            2, int(_PREDICTED_SAMPLES_PER_S / (self.filter.rate * self._width))
        )

    def answer(self, row: list[float], force: Sequence[float] = _NO_FORCE) -> list[str]:
        """Return the answer to a sample: one text per channel, then the extra columns.

        `force` is the accelerometer's sample, three numbers, if there is one.
        """
        self._predict(self._catch_up_samples)
        if self.pending_count:
            self.pending_count += 1
            rate = self._rate_from_bias(row)
        else:
            moving = self.motion is not None and bool(self.motion.update(force))
            sample = row[0] if self.filter.channels is None else row
            rate = self.filter.update(sample, moving and self._holds_in_motion)
        return answer_texts(rate, self.filter, self.extra_columns)

    def miss(self, count: int) -> None:
        """Count this number of samples as missing."""
        is_behind = self.pending_count > 0
        self.pending_count += count
        if not is_behind and count * self._width <= _MAX_IMMEDIATE_SAMPLES:
            self._predict(self.pending_count)

    def snapshot(self) -> list[Any]:
        """Return the state that samples change: pending count, filter, motion detector."""
        motion = None if self.motion is None else self.motion.to_bytes()
        return [self.pending_count, self.filter.to_bytes(), motion]

    def restore(self, saved: Sequence[Any]) -> None:
        """Restore the state from `saved`."""
        self.pending_count, filter_, motion = saved
        self.filter = DriftFilter.from_bytes(filter_)
        self.motion = None if motion is None else MotionDetector.from_bytes(motion)

    def _rate_from_bias(self, row: list[float]) -> Any:  # noqa: ANN401  # a float, or one a channel
        if not self._compensates:
            return self.filter.estimate
        z = np.array(row)
        rate = np.where(np.abs(z) < self._limit, z, np.nan) - self.filter.bias
        return float(rate[0]) if self.filter.channels is None else rate

    def _predict(self, max_samples: int) -> None:
        count = min(max_samples, self.pending_count)
        self.pending_count -= count
        while count > 0:
            n = min(count, max(1, _BLOCK_SAMPLES // self._width))
            shape = n if self.filter.channels is None else (n, self._width)
            moving = None
            if self.motion is not None:
                shows_motion = self.motion.process(np.full((n, len(_NO_FORCE)), np.nan))
                moving = shows_motion if self._holds_in_motion else None
            self.filter.process(np.full(shape, np.nan), moving=moving)
            count -= n
