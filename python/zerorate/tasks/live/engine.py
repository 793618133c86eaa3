"""Interface between a stream of lines and its engine: drift, attitude, array or navigation."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, Protocol, Self

from zerorate.tasks.live.lines import Layout
from zerorate.tasks.live.view import View


class Engine(ABC):
    """Engine that answers samples and defines the contents of its checkpoints.

    An answer has all cells of a line that are no sample, then the engine's columns.

    Parameters
    ----------
    layout : Layout
        Layout of every line.
    samples : int
        Number of samples to date, including lost and garbled samples if they count.
    """

    def __init__(self, layout: Layout, samples: int = 0) -> None:
        self.layout = layout
        self.samples = samples

    @property
    @abstractmethod
    def columns(self) -> Sequence[str]:
        """Names of the columns of an answer."""

    def read(self, cells: Sequence[str]) -> Any:  # noqa: ANN401  # each engine has its own
        """Return the sample in the cells of a line; LineError if there is none."""
        return self.layout.row(cells)

    @abstractmethod
    def miss(self, count: int) -> None:
        """Count this number of samples as missing."""

    @abstractmethod
    def answer(self, sample: Any) -> list[str]:  # noqa: ANN401
        """Return the answer to a sample."""

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """Return the state outside the filter's own bytes, in the types of JSON."""

    @abstractmethod
    def to_bytes(self) -> bytes:
        """Return the filter as bytes."""

    @property
    def nan_texts(self) -> list[str]:
        """Answer to a sample that was not used."""
        return ["nan"] * len(self.columns)

    @property
    def no_answer(self) -> str:
        """Answer to a garbled line: one ``nan`` per column of an answer."""
        return ",".join([*["nan"] * len(self.layout.passthrough_labels), *self.nan_texts])

    def format_answer(self, cells: Sequence[str], texts: Sequence[str]) -> str:
        """Return the answer to a line."""
        return ",".join([*self._passthrough_cells(cells), *texts])

    def header(self, cells: Sequence[str]) -> str:
        """Return the names of an answer's columns."""
        return ",".join([*self._passthrough_cells(cells), *self.columns])

    def _passthrough_cells(self, cells: Sequence[str]) -> Iterator[str]:
        return (cell for i, cell in enumerate(cells) if i not in self.layout.channels)

    def view(self) -> View | None:
        """Return the current view, None before the first sample."""
        return None

    @property
    def opening(self) -> str | None:
        """Sentence on the columns; None if not necessary."""
        return None

    def notice(self) -> str | None:
        """Return a sentence on the first samples, only once; None if not necessary."""
        return None

    def sentences(self) -> Iterator[str]:
        """Yield sentences on the whole stream."""
        yield from ()


class EngineSettings(Protocol):
    """Settings of an engine and its lines; they stay the same after a restart."""

    kind: ClassVar[str]
    """Word for the engine in a checkpoint."""

    @property
    def rate(self) -> float:
        """Samples per second, Hz."""

    @property
    def sequence(self) -> str | int | None:
        """Column of the sequence number."""

    @property
    def sequence_bits(self) -> int | None:
        """Width of the sample counter."""

    def open_engine(self, cells: Sequence[str], fields: int | None) -> Engine:
        """Return a new engine for lines like the first; raise LineError or ColumnError."""

    def restore_engine(self, layout: Layout, saved: Mapping[str, Any], filter_: bytes) -> Engine:
        """Return the engine from a checkpoint; ValueError if its parts contradict each other."""

    def as_json(self) -> dict[str, Any]:
        """Return the settings in the types of JSON."""

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the settings from the output of `as_json`."""
