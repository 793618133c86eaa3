"""Attitude of recordings, and prior knowledge of a gyro."""

from typing import TYPE_CHECKING, Final

from zerorate.lazy import lazy_exports

if TYPE_CHECKING:
    from zerorate.attitude.estimate import AttitudeEstimate, attitude_of
    from zerorate.attitude.events import Event

__all__ = [
    "AttitudeEstimate",
    "Event",
    "attitude_of",
]

_LAZY_EXPORTS: Final = {
    "estimate": "AttitudeEstimate attitude_of",
    "events": "Event",
}
if not TYPE_CHECKING:
    __getattr__, __dir__ = lazy_exports(__name__, _LAZY_EXPORTS)
