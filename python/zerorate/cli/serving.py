"""How a stream on the command line begins and ends."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final, TextIO

import typer

from zerorate.cli.faults import DataFault, as_usage
from zerorate.cli.stdout import BROKEN_PIPE, drop_stdout
from zerorate.run.live import LineError
from zerorate.run.live.interrupts import Interrupted, Interrupts
from zerorate.run.live.serving import Server
from zerorate.run.live.sources import Line, datagrams, lines, loopback

__all__ = ["report", "run", "tell"]

_BY_SIGNAL: Final = 128


def tell(sentence: str) -> None:
    """Print a sentence on stderr."""
    print(f"zerorate: {sentence}", file=sys.stderr, flush=True)


def run(server: Server, source: Path | None, udp: str | None) -> None:
    """Serve lines of a file, datagrams or stdin; a signal ends it with the code of a shell."""
    interrupts = Interrupts()
    try:
        with (
            interrupts.caught(),
            _saved(server),
            _source(source, udp, interrupts) as taken,
            _faults(),
        ):
            server.serve(taken)
    except Interrupted as interrupted:
        if interrupted.args[0] == signal.SIGINT:
            raise KeyboardInterrupt from None
        raise typer.Exit(_BY_SIGNAL + interrupted.args[0]) from None


def report(server: Server) -> None:
    """Tell what was lost, if samples were numbered, and how many lines were garbled."""
    count = server.stream.sequence
    if server.stream.open and server.stream.settings.sequence is not None:
        tell(
            f"{server.stream.samples} samples, {count.lost} of them lost; {count.late} came late "
            f"or again; the numbers began anew {count.restarts} times"
        )
    if server.garbled:
        tell(f"garbled lines: {server.garbled}")


@contextmanager
def _saved(server: Server) -> Iterator[None]:
    try:
        yield
    finally:
        if server.saver is not None:
            try:
                server.saver.finish(None if server.owing else server.stream)
            except OSError as error:
                raise DataFault(f"the checkpoint cannot be written: {error}") from None


@contextmanager
def _source(
    source: Path | None, udp: str | None, interrupts: Interrupts
) -> Iterator[Iterator[Line]]:
    if udp is not None:
        with as_usage():
            port = loopback(udp)
        with port:
            tell("listening on {}:{}".format(*port.getsockname()[:2]))
            yield datagrams(port, interrupts)
    elif source is not None:
        # To open a FIFO is to wait for its writer.
        with interrupts.wait(lambda: _opened(source)) as file:
            yield lines(file, _bytes_of(sys.stdout, "stdout"), interrupts)
    else:
        yield lines(_bytes_of(sys.stdin, "stdin"), _bytes_of(sys.stdout, "stdout"), interrupts)


def _bytes_of(stream: TextIO | None, name: str) -> BinaryIO:
    # None is what a closed descriptor becomes.
    if stream is None:
        raise DataFault(f"{name} is closed")
    return stream.buffer


def _opened(source: Path) -> BinaryIO:
    try:
        return source.open("rb")
    except OSError as error:
        raise DataFault(str(error)) from None


@contextmanager
def _faults() -> Iterator[None]:
    try:
        yield
    except LineError as error:
        raise DataFault(str(error)) from None
    except BrokenPipeError:
        drop_stdout()
        raise typer.Exit(BROKEN_PIPE) from None
    except OSError as error:
        raise DataFault(f"a sample could not be read, or not answered: {error}") from None
