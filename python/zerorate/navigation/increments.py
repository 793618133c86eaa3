"""Samples of a recording combined to fewer increments, for filters that run many times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zerorate.navigation.windows import Means
from zerorate.record.samples import Samples
from zerorate.types import Floats

_RATE_HZ: Final = 50.0
"""Sampling rate for filters that run many times, Hz."""


@dataclass(frozen=True, eq=False)
class Increments:
    """Times of steps, with the increments of angle and velocity since the previous step."""

    time: Floats
    gyro: Floats
    accel: Floats

    @classmethod
    def of(cls, samples: Samples, rate: float = _RATE_HZ) -> Increments:
        """Return steps of 0.02 s, or single samples if they are longer."""
        every = max(1, round(samples.log.rate / rate))
        means = Means.of(samples)
        gained = np.diff(means.integral[::every], axis=0)
        gained[np.diff(means.missing[::every]) > 0.0] = np.nan
        gained = np.concatenate((np.zeros((1, 6)), gained))
        return cls(samples.time[::every], gained[:, :3].copy(), gained[:, 3:].copy())

    @classmethod
    def for_filter(
        cls, samples: Samples, options: dict[str, Any], rate: float = _RATE_HZ
    ) -> tuple[Increments, dict[str, Any]]:
        """Return increments of the samples, and filter options for increments."""
        if options.get("kind", "rate") == "rate":
            return cls.of(samples, rate), {**options, "kind": "increment"}
        return cls(samples.time, samples.gyro, samples.accel), options
