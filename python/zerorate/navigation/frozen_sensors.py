"""Sensors that repeat their values while the vehicle moves."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np

from zerorate.navigation.windows import Epochs
from zerorate.record.runs import runs
from zerorate.record.samples import Samples
from zerorate.types import Floats

_MIN_FROZEN_S: Final = 1.0
_MIN_FROZEN_SAMPLES: Final = 10
_MIN_TOTAL: Final = (3.0, 0.01)
"""Shortest total time for a finding: s, and share of the recording."""


def frozen_spans(
    samples: Samples, sensor: Literal["gyro", "accel"] | str, epochs: Epochs
) -> list[tuple[float, float]]:
    """Return the spans, s, in which a sensor repeats or lacks samples while the vehicle moves.

    The list is empty if the spans add up to less than three seconds, or less than 1 % of the time.
    """
    values: Floats = getattr(samples, sensor)
    time = samples.time
    there = np.isfinite(values.sum(axis=1))
    same = np.concatenate(([False], (values[1:] == values[:-1]).all(axis=1))) | ~there
    spans = []
    moving = epochs.speed > np.maximum(0.2, 3.0 * epochs.sigma)
    for first, last in runs(same).tolist():
        start, stop = float(time[max(first - 1, 0)]), float(time[last - 1])
        if stop - start < _MIN_FROZEN_S or last - first < _MIN_FROZEN_SAMPLES:
            continue
        inside = (epochs.time >= start) & (epochs.time <= stop)
        if inside.any() and moving[inside].mean() > 0.5:
            spans.append((start, stop))
    total = sum(stop - start for start, stop in spans)
    enough = total >= max(_MIN_TOTAL[0], _MIN_TOTAL[1] * float(time[-1] - time[0]))
    return spans if enough else []
