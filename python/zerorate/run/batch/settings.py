"""How each log of a batch is read, filtered and written."""

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Final, Literal, get_args

from zerorate._native import __version__
from zerorate.io.log import checked_rate
from zerorate.io.names import canonical_unit
from zerorate.run.replay.result import Output

__all__ = ["Settings"]

_METHODS: Final = ("kf", "akf", "fading", "auto")
_MOTIONS: Final = ("hold", "ignore", None)
_FORMATS: Final = ("parquet", "csv", "npz")


@dataclass(frozen=True)
class Settings:
    """Options of every log of a batch.

    Parameters
    ----------
    method : {"auto", "kf", "akf", "fading"}
        Method of `zerorate.DriftFilter`; default "auto".
    motion : {"hold", "ignore"}, optional
        What the filter does while the sensor moves; by default what the method does.
    output : {"estimate", "compensated"}, optional
        What the filtered log holds; by default the compensated rate of "auto", else the estimate.
    rate : float, optional
        Samples per second, Hz, where the logs do not tell it.
    columns : tuple of str or int, optional
        Names or indices; by default the gyro columns.
    unit : str, optional
        Unit of the data, where the logs do not tell it.
    format : {"parquet", "csv", "npz"}
        Of the filtered logs; default Parquet.

    Raises
    ------
    ValueError
        If an option is none of these.
    """

    method: str = "auto"
    motion: Literal["hold", "ignore"] | None = None
    output: Output | None = None
    rate: float | None = None
    columns: tuple[str | int, ...] | None = None
    unit: str | None = None
    format: str = "parquet"

    def __post_init__(self) -> None:
        """Refuse here what would otherwise fail in every log."""
        _check("method", self.method, _METHODS)
        _check("motion", self.motion, _MOTIONS)
        _check("output", self.output, (*get_args(Output), None))
        _check("format", self.format, _FORMATS)
        if self.rate is not None:
            checked_rate(self.rate)
        if self.unit is not None:
            canonical_unit(self.unit)

    def fingerprint(self, name: str, size: int, modified: int) -> str:
        """Return a hash that changes whenever the result of a log could.

        The input counts by its name, size and time of change, not by its content: to see that
        nothing is left to do must not cost a reading of all the data.
        """
        parts = {"version": __version__, "input": [name, size, modified], **asdict(self)}
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _check(option: str, value: object, known: tuple[object, ...]) -> None:
    if value not in known:
        listed = ", ".join(repr(one) for one in known if one is not None)
        raise ValueError(f"{option} must be one of {listed}, got {value!r}")
