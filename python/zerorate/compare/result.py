"""What a comparison answers."""

from collections.abc import Mapping
from dataclasses import dataclass

from zerorate.compare.trial import Kind

__all__ = ["Comparison", "Row"]


@dataclass(frozen=True)
class Row:
    """Measures of one method on one axis.

    Attributes
    ----------
    source : str
        Of the recording.
    axis : str
        The channel's name, or ``"all"`` where the axes are measured together.
    method : str
        Its name.
    angle : str
        Unit of angles in the values: ``"rad"``, or the recording's own unit times s where that is
        not known to be a rate.
    values : mapping of str to float
        Measures by name, in SI otherwise; NaN where one means nothing.
    """

    source: str
    axis: str
    method: str
    angle: str
    values: Mapping[str, float]


@dataclass(frozen=True)
class Comparison:
    """All recordings of one kind.

    Attributes
    ----------
    kind : str
        ``"rest"``, ``"turning"`` or ``"orientation"``.
    rows : tuple of Row
        Recording by recording, axis by axis, method by method.
    notes : tuple of str
        Sentences on the recordings.
    """

    kind: Kind
    rows: tuple[Row, ...]
    notes: tuple[str, ...]

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods in their order."""
        return tuple(dict.fromkeys(row.method for row in self.rows))
