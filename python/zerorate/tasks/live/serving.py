"""Serving of a stream: sources of lines, the loop, and checkpoints on disk."""

import os
import re
import socket
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, Final, TypeAlias

from zerorate.faults import make_sentence, sentence_of
from zerorate.io.packets import Damage, PacketProtocol
from zerorate.record import atomic_path
from zerorate.record.atomic import remove_leftovers
from zerorate.tasks.interrupts import Interrupts
from zerorate.tasks.live.lines import ColumnError, LineError
from zerorate.tasks.live.listeners import CUT, Address, DatagramPort
from zerorate.tasks.live.stream import LineStream
from zerorate.tasks.live.view import Watcher

_MAX_WARNINGS: Final = 10
_MAX_LINE_BYTES: Final = 1 << 16
_COMPARED_LINES: Final = 8
"""Number of lines before the last one that show if it is cut."""

Line: TypeAlias = tuple[str | Damage, Callable[[str], None]]
"""A line, or damaged bytes of a packet; and a function that sends the answer."""


def lines_of(source: BinaryIO, answers: BinaryIO, interrupts: Interrupts) -> Iterator[Line]:
    """Yield each line when it is complete, with a function that writes its answer."""
    reply = _make_reply(answers)
    before: deque[int] = deque(maxlen=_COMPARED_LINES)
    while raw := interrupts.wait(lambda: _read_line(source)):
        decimals = _decimals(raw)
        if not raw.endswith(b"\n") and _is_cut(decimals, before):
            raw += CUT
        before.append(decimals)
        yield _decode_line(raw), reply


def _decimals(line: bytes) -> int:
    """Return the number of digits after the last decimal point of a line, -1 without one."""
    _, point, digits = re.split(rb"[,;\s]", line.strip())[-1].rpartition(b".")
    return len(digits) if point else -1


def _is_cut(decimals: int, before: Sequence[int]) -> bool:
    """Return True for a last line with fewer decimals than all lines before it."""
    return len(before) == _COMPARED_LINES and len({*before}) == 1 and decimals < before[0]


def packets_of(
    source: BinaryIO, protocol: PacketProtocol, answers: BinaryIO, interrupts: Interrupts
) -> Iterator[Line]:
    """Yield the column names of a protocol, then each sample as a line."""
    reply, decoder = _make_reply(answers), protocol.decoder()
    yield ",".join(protocol.columns), reply
    # `read` would wait for a full buffer.
    while raw := interrupts.wait(lambda: source.read1(_MAX_LINE_BYTES)):  # type: ignore[attr-defined]
        for row in decoder.feed(raw):
            yield row if isinstance(row, Damage) else ",".join(map(str, row)), reply
    for row in decoder.finish():
        yield row if isinstance(row, Damage) else ",".join(map(str, row)), reply


def _make_reply(answers: BinaryIO) -> Callable[[str], None]:
    def reply(answer: str) -> None:
        answers.write(f"{answer}\n".encode())
        answers.flush()

    return reply


def datagrams(
    port: socket.socket, received: DatagramPort, interrupts: Interrupts
) -> Iterator[Line]:
    """Yield each datagram of a permitted sender as a line, with a function that answers it."""
    while True:
        raw, sender = interrupts.wait(lambda: received.receive(_MAX_LINE_BYTES))

        def reply(answer: str, sender: Address = sender) -> None:
            # Datagrams may be lost, so a missing sender is no error.
            with suppress(OSError):
                port.sendto(answer.encode(), sender)

        yield _decode_line(raw), reply


def _read_line(source: BinaryIO) -> bytes:
    raw = source.readline(_MAX_LINE_BYTES)
    if len(raw) < _MAX_LINE_BYTES or raw.endswith(b"\n"):
        return raw
    while (rest := source.readline(_MAX_LINE_BYTES)) and not rest.endswith(b"\n"):
        pass
    return raw[:80] + CUT


def _decode_line(raw: bytes) -> str:
    return raw.decode("utf-8", "replace")


class Saver:
    """Saver that writes a stream's state periodically, and at its end.

    Another thread writes the file, so answers never wait for the disk.

    Parameters
    ----------
    path : Path
        Path of the file, which is replaced as a whole.
    every : int
        Samples between two checkpoints; a running write delays the next one.
    warn : callable
        Function of a sentence, called if a checkpoint cannot be written; the stream continues.
    """

    def __init__(self, path: Path, every: int, warn: Callable[[str], None]) -> None:
        # The last run may have been killed during a write.
        remove_leftovers([path])
        self._path = path
        self._every = every
        self._warn = warn
        self._next: int | None = None
        self._failing = False
        self._thread = ThreadPoolExecutor(1)
        # Reserved for the checkpoint, in case all other descriptors are in use.
        self._descriptor = os.open(os.devnull, os.O_RDONLY)
        self._job: Future[None] | None = None

    def after_answer(self, stream: LineStream) -> None:
        """Save the stream if enough samples have been answered since the last checkpoint."""
        if self._next is None:
            self._next = stream.samples + self._every
        if stream.samples < self._next or (self._job is not None and not self._job.done()):
            return
        self._check_last_job()
        self._next = stream.samples + self._every
        self._job = self._thread.submit(self._write, stream.to_bytes())

    def finish(self, stream: LineStream | None) -> None:
        """Wait for the last checkpoint, and save once more; OSError if writing fails.

        Pass None if some answers may be missing: the last checkpoint then remains.
        """
        self._thread.shutdown()
        if stream is not None and stream.open:
            self._write(stream.to_bytes())

    def _write(self, raw: bytes) -> None:
        os.close(self._descriptor)
        try:
            with atomic_path(self._path, force=True) as temporary:
                temporary.write_bytes(raw)
        finally:
            self._descriptor = os.open(os.devnull, os.O_RDONLY)

    def _check_last_job(self) -> None:
        error = None if self._job is None else self._job.exception()
        if error is not None and not self._failing:
            self._warn(f"the checkpoint cannot be written: {error}")
        self._failing = error is not None


@dataclass
class Server:
    """Server that answers all lines of a source.

    Parameters
    ----------
    stream : LineStream
        Stream with the filter and its settings.
    saver : Saver, optional
        Saver of the stream; it saves only after an answer was given.
    warn : callable
        Function of a sentence. It is called for the filtered columns and for samples that look like
        raw counts. It is also called for the first ten garbled lines, and the first ten restarts of
        the sequence numbers.
    allow_garbled_start : bool
        Allow garbled lines before the first complete line.
    watcher : Watcher, optional
        Receiver of a view of the stream after an answer was given.
    """

    stream: LineStream
    saver: Saver | None
    warn: Callable[[str], None]
    allow_garbled_start: bool = False
    watcher: Watcher | None = None
    garbled_count: int = field(default=0, init=False)
    restart_count: int = field(default=0, init=False)
    answer_pending: bool = field(default=False, init=False)
    """True if a sample has been processed but not answered; this state must not be saved."""

    def serve(self, source: Iterable[Line]) -> None:
        """Answer every line of a source."""
        opening = True
        for number, (line, reply) in enumerate(source, start=1):
            self.answer_pending = True
            restarts = self.stream.sequence.restart_count
            answer = self._answer(number, line)
            if opening and self.stream.open:
                opening = False
                self._warn_opening()
            if restarts < self.stream.sequence.restart_count:
                self._warn_restart(number)
            if answer is not None:
                reply(answer)
            if (notice := self.stream.notice()) is not None:
                self.warn(notice)
            self.answer_pending = False
            if self.saver is not None:
                self.saver.after_answer(self.stream)
            if self.watcher is not None:
                self.watcher.after_answer(self.stream)
        if self.watcher is not None:
            self.watcher.finish(self.stream)

    def sentences(self, numbered: bool) -> Iterator[str]:
        """Yield sentences on lost (if numbered), garbled and left-out samples."""
        yield from self.stream.sentences()
        count = self.stream.sequence
        if self.stream.open and numbered:
            wrap = f"; they wrap after {count.turn[1]}" if count.wraps and count.turn else ""
            yield (
                f"{self.stream.samples} samples, {count.lost_count} of them lost; "
                f"{count.late_count} came late or twice; the numbers restarted "
                f"{count.restart_count} times{wrap}"
            )
        if self.garbled_count:
            yield f"garbled lines: {self.garbled_count}"

    def _warn_opening(self) -> None:
        sentence = self.stream.opening
        if sentence is not None:
            self.warn(sentence)

    def _answer(self, number: int, line: str | Damage) -> str | None:
        if isinstance(line, Damage):
            self._warn_garbled(
                f"after {self.stream.samples} samples {line.reason}; it counts as missing"
            )
            return self.stream.take_damaged()
        try:
            return self.stream.take(line)
        except ColumnError as error:
            raise ColumnError(make_sentence(f"line {number}: ", sentence_of(error))) from None
        except LineError as error:
            if not self.stream.open and not self.allow_garbled_start:
                raise LineError(make_sentence(f"line {number}: ", sentence_of(error))) from None
            self._warn_garbled(
                make_sentence(f"line {number}: ", sentence_of(error), "; it counts as missing")
            )
        return self.stream.no_answer if self.stream.open else None

    def _warn_garbled(self, sentence: str) -> None:
        self.garbled_count += 1
        if self.garbled_count <= _MAX_WARNINGS:
            self.warn(sentence)

    def _warn_restart(self, number: int) -> None:
        self.restart_count += 1
        if self.restart_count <= _MAX_WARNINGS:
            last = self.stream.sequence.last
            self.warn(f"line {number}: the sequence numbers restart, here with {last}")
