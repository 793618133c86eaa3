"""What a stream is asked to do: it must be the same after a restart."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final, Self

from zerorate._native import DriftFilter
from zerorate.run.live.answers import Beside
from zerorate.run.live.layout import Wanted

__all__ = ["Settings"]

_OF_THE_FILTER: Final = (
    "method",
    "motion",
    "output",
    "order",
    "fading",
    "adapt_for",
    "forgetting_factor",
    "process_noise",
    "startup",
    "noise",
)


@dataclass(frozen=True)
class Settings:
    """The filter of a stream, and what its lines hold.

    Parameters
    ----------
    rate : float
        Samples a second.
    method, motion, output : str
        As `zerorate.DriftFilter` takes them; ``motion=None`` is the method's default.
    beside : tuple of str
        Further columns of an answer: ``"bias"``, ``"bias_sigma"``, ``"at_rest"``.
    columns : tuple of str or int, optional
        Channels by name or position; None is all but the sequence number.
    sequence : str or int, optional
        Column of the sequence number; None for no such column.
    order, fading, adapt_for, forgetting_factor, process_noise, startup, noise
        As `zerorate.DriftFilter` takes them, with its defaults; "auto" knows `startup` alone.

    Raises
    ------
    ValueError
        If the filter refuses its parameters.
    """

    rate: float
    method: str = "auto"
    motion: str | None = None
    output: str = "compensated"
    beside: tuple[Beside, ...] = ()
    columns: tuple[str | int, ...] | None = None
    sequence: str | int | None = None
    order: tuple[int, int] = (2, 1)
    fading: float = 0.97
    adapt_for: float | None = 120.0
    forgetting_factor: float = 1.0
    process_noise: float = 0.1
    startup: float = 1.0
    noise: str = "allan"

    def __post_init__(self) -> None:
        """Check the filter's parameters, and write out what its default is for motion."""
        object.__setattr__(self, "motion", self.filter(1).params["motion"])

    def filter(self, channels: int) -> DriftFilter:
        """Return a new filter; for one channel it takes floats, the fastest way."""
        options: dict[str, Any] = {name: getattr(self, name) for name in _OF_THE_FILTER}
        return DriftFilter(self.rate, channels=None if channels == 1 else channels, **options)

    def wanted(self, fields: int | None) -> Wanted:
        """Return which columns to look for in lines of so many cells, None for any number."""
        return Wanted(self.columns, self.sequence, fields)

    def as_json(self) -> dict[str, Any]:
        """Return the settings as JSON keeps them."""
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(self).items()
        }

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings that `as_json` gave."""
        lists = {name: tuple(v) for name, v in fields.items() if isinstance(v, list)}
        return cls(**{**fields, **lists})
