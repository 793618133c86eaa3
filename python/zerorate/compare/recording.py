"""A recording, and what may be asked of it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from zerorate.io import Log

__all__ = ["Kind", "Recording", "Reference"]

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
        In any unit per second; NaN where missing.
    """

    name: str
    rate: Floats


@dataclass(frozen=True, eq=False)
class Recording:
    """Gyros, with a reference or without.

    Attributes
    ----------
    log : Log
        In rad/s, or in a unit of its own if that is not known.
    reference : Reference or None
        Rate about the axis of one of the gyros.
    quaternions : ndarray, shape (n, 4), or None
        Orientation w, x, y, z, from sensor to world; NaN where missing.
    """

    log: Log
    reference: Reference | None = None
    quaternions: Floats | None = None

    @property
    def kind(self) -> Kind:
        """What it can tell: without a reference it has to be at rest."""
        if self.quaternions is not None:
            return "orientation"
        return "rest" if self.reference is None else "turning"

    @property
    def angle(self) -> str:
        """Unit of the integral of its rates."""
        return "rad" if self.log.unit == "rad/s" else f"{self.log.unit} s"

    @property
    def source(self) -> str:
        """The file's path, where there is one."""
        return str(self.log.meta.get("source", "the log"))
