"""Samples of a recording as fewer increments, for filters that run over it many times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zerorate.navigation.windows import Means
from zerorate.record.samples import Samples
from zerorate.types import Floats

_RATE_HZ: Final = 50.0
"""Hz, of what a filter is given that runs many times."""


@dataclass(frozen=True, eq=False)
class Increments:
    """Times of samples with the angles and the velocities gained since the one before."""

    time: Floats
    gyro: Floats
    accel: Floats

    @classmethod
    def of(cls, samples: Samples, rate: float = _RATE_HZ) -> Increments:
        """Return steps of a fiftieth of a second or a sample, of which there are many to be run."""
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
        """Return increments of samples, and options of a filter that takes them."""
        if options.get("kind", "rate") == "rate":
            return cls.of(samples, rate), {**options, "kind": "increment"}
        return cls(samples.time, samples.gyro, samples.accel), options
