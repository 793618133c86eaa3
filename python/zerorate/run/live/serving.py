"""The loop of a stream: a line, its answer, now and then a checkpoint."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final

from zerorate.run.live.rows import ColumnError, LineError
from zerorate.run.live.saver import Saver
from zerorate.run.live.sources import Line
from zerorate.run.live.stream import LineStream

__all__ = ["Server"]

_TOLD: Final = 10


@dataclass
class Server:
    """Answers lines until there are no more.

    Parameters
    ----------
    stream : LineStream
        What answers.
    saver : Saver, optional
        Saves the stream after an answer has been given, never before.
    warn : callable
        Takes a sentence on each of the first ten garbled lines.
    patient : bool
        Whether garbled lines may come before the first whole one.
    """

    stream: LineStream
    saver: Saver | None
    warn: Callable[[str], None]
    patient: bool = False
    garbled: int = field(default=0, init=False)
    owing: bool = field(default=False, init=False)
    """Whether a sample was taken, but its answer not given: such a state is not to be saved."""

    def serve(self, source: Iterable[Line]) -> None:
        """Answer every line of a source."""
        for number, (line, reply) in enumerate(source, start=1):
            self.owing = True
            answer = self._answer(number, line)
            if answer is not None:
                reply(answer)
            self.owing = False
            if self.saver is not None:
                self.saver.answered(self.stream)

    def _answer(self, number: int, line: str) -> str | None:
        try:
            return self.stream.take(line)
        except ColumnError as error:
            raise ColumnError(f"line {number}: {error}") from None
        except LineError as error:
            if not self.stream.open and not self.patient:
                raise LineError(f"line {number}: {error}") from None
            self._tell(f"line {number}: {error}; it is taken as missing")
        return self.stream.no_answer if self.stream.open else None

    def _tell(self, sentence: str) -> None:
        self.garbled += 1
        if self.garbled <= _TOLD:
            self.warn(sentence)
