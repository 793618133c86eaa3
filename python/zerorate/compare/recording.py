"""A recording, and what may be asked of it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from zerorate.io import Log, LogError

__all__ = ["Kind", "Orientation", "Recording", "Reference"]

Floats = npt.NDArray[np.float64]
Kind = Literal["rest", "turning", "orientation"]


@dataclass(frozen=True, eq=False)
class Reference:
    """A rate about one axis that something else measured; its scale and sign may differ.

    Attributes
    ----------
    name : str
        Of the column.
    rate : ndarray, shape (n,)
        In rad/s, or any unit if that is not known; NaN where missing.
    """

    name: str
    rate: Floats


@dataclass(frozen=True, eq=False)
class Orientation:
    """Where the sensor's axes point, measured by something else.

    Attributes
    ----------
    names : tuple of str
        Of the four columns.
    quaternions : ndarray, shape (n, 4)
        w, x, y, z from sensor to world; NaN where missing.
    """

    names: tuple[str, ...]
    quaternions: Floats


@dataclass(frozen=True, eq=False)
class Recording:
    """Gyros, with a reference or without.

    Attributes
    ----------
    log : Log
        In rad/s, or in a unit of its own if that is not known.
    reference : Reference or None
        Rate about the axis of one of the gyros.
    orientation : Orientation or None
        Of the three gyros together.
    """

    log: Log
    reference: Reference | None = None
    orientation: Orientation | None = None

    @property
    def kind(self) -> Kind:
        """What it can tell: without a reference it has to be at rest."""
        if self.orientation is not None:
            return "orientation"
        return "rest" if self.reference is None else "turning"

    def check_axes(self) -> None:
        """Raise LogError if an axis holds no sample."""
        for name, z in zip(self.log.names, self.log.data.T, strict=True):
            if not np.isfinite(z).any():
                raise LogError(f"{self.source}: {name} holds no sample: all are missing")

    @property
    def angle(self) -> str:
        """Unit of the integral of its rates."""
        return "rad" if self.log.unit == "rad/s" else f"{self.log.unit} s"

    @property
    def source(self) -> str:
        """The file's path, where there is one."""
        return str(self.log.meta.get("source", "the log"))
