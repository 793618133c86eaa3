"""Stands in for the native stream until that is there."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["ImuCorrector"]


class ImuCorrector:
    """NumPy path."""

    def __init__(  # noqa: D107
        self,
        gyro_matrix: Any,
        gyro_bias: Any,
        *,
        accel_matrix: Any = None,
        accel_bias: Any = None,
        g_sensitivity: Any = None,
        temperature: Any = None,
        inputs: int = 3,
        channels: int | None = None,
    ) -> None:
        self.m, self.b = np.array(gyro_matrix), np.array(gyro_bias)
        self.a, self.ab, self.g = accel_matrix, accel_bias, g_sensitivity
        self.inputs = inputs

    def process(self, z: Any) -> Any:
        """Correct."""
        rates = z[:, :3] - self.b
        if self.inputs == 3:
            return rates @ self.m.T
        force = (z[:, 3:6] - self.ab) @ np.array(self.a).T
        rates = rates - np.nan_to_num(force) @ np.array(self.g).T
        return rates @ self.m.T, force
