"""Views of a running stream, for a person."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import monotonic
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from zerorate.tasks.live.stream import LineStream

PERIOD_S: Final = 0.05
"""Time between two views, s; eyes cannot distinguish more than twenty per second."""


@dataclass(frozen=True)
class View:
    """Estimates of the filter after a sample.

    Parameters
    ----------
    seconds : float
        Time since the start by the number of samples, s.
    names : tuple of str
        Axes of the gyro.
    unit : str
        Unit of the rates, "" if unknown.
    rate, bias, bias_sigma : tuple of float
        Last sample minus the bias, bias, and its standard deviation; NaN where missing.
    status : str
        State of the filter, in words.
    quaternion : tuple of float, optional
        Orientation w, x, y, z from the sensor to earth axes with the third axis up.
    euler_deg : tuple of float, optional
        Roll, pitch and yaw, deg.
    """

    seconds: float
    names: tuple[str, ...]
    unit: str
    rate: tuple[float, ...]
    bias: tuple[float, ...]
    bias_sigma: tuple[float, ...]
    status: str
    quaternion: tuple[float, ...] | None = None
    euler_deg: tuple[float, ...] | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the view in the types of JSON, with None for non-finite numbers."""
        return {
            "seconds": self.seconds,
            "names": list(self.names),
            "unit": self.unit,
            "rate": _finite(self.rate),
            "bias": _finite(self.bias),
            "bias_sigma": _finite(self.bias_sigma),
            "status": self.status,
            "quaternion": None if self.quaternion is None else _finite(self.quaternion),
            "euler_deg": None if self.euler_deg is None else _finite(self.euler_deg),
        }


def _finite(values: Sequence[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values]


@dataclass
class Watcher:
    """Reader of views of a stream in regular intervals, which passes them on.

    Parameters
    ----------
    put : callable
        Function of a view; it must return at once, because the next answer waits for it.
    """

    put: Callable[[View], None]
    _next: float = -math.inf

    def after_answer(self, stream: "LineStream") -> None:
        """Take a view of the stream if enough time has passed."""
        now = monotonic()
        if now >= self._next and self._look(stream):
            self._next = now + PERIOD_S

    def finish(self, stream: "LineStream") -> None:
        """Take a last view at the end."""
        self._look(stream)

    def _look(self, stream: "LineStream") -> bool:
        view = stream.view()
        if view is not None:
            self.put(view)
        return view is not None
