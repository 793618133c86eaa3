"""Sources of samples for ``zerorate stream``: stdin, files, datagrams, live devices."""

import os
import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final, TextIO

from zerorate.cli.errors import DataFault, UsageFault, of_a_file, sentence
from zerorate.cli.parameters import option
from zerorate.cli.process import notify
from zerorate.io.packets import PACKETS, PacketProtocol
from zerorate.tasks.interrupts import Interrupts
from zerorate.tasks.live.listeners import Access, DatagramPort, parse_host_port
from zerorate.tasks.live.serving import Line, datagrams, lines_of, packets_of
from zerorate.tasks.live.sources import (
    SOURCES,
    AddressError,
    Ending,
    bound_socket,
    live_source,
)

_HEAD_BYTES: Final = 4096
"""Largest length of a first line with rate and unit, bytes."""


@dataclass(frozen=True)
class Origin:
    """Options for sources of samples other than a file."""

    udp: str | None = option(
        None, "Receive datagrams, and answer to their sender.", metavar="HOST:PORT"
    )
    address: str | None = option(
        None,
        "Live device: " + ", ".join(kind.address for kind in SOURCES.values()) + ".",
        "--from",
        metavar="KIND:ADDRESS",
    )
    form: str | None = option(
        None,
        f"Protocol of packets, instead of lines: {', '.join(PACKETS)}; zerorate formats lists "
        f"them.",
        metavar="FORM",
    )

    allow: str | None = option(
        None,
        "Senders allowed besides this machine: addresses, networks, or any, separated by commas. "
        "A name allows HTTP requests that address this machine by it.",
        metavar="ADDRESS",
    )

    def packets(self) -> PacketProtocol | None:
        """Return the protocol of the packets; None for lines."""
        if self.form is None:
            return None
        if self.form not in PACKETS:
            raise UsageFault(f"--form takes one of {', '.join(PACKETS)}, got '{self.form}'")
        if self.udp is not None:
            raise UsageFault("--udp takes lines only; --from udp:HOST:PORT takes packets")
        return PACKETS[self.form]

    def check(self, source: Path | None, fields: int | None) -> None:
        """Raise a usage fault for two sources, or for options that contradict the protocol."""
        if sum(one is not None for one in (source, self.udp, self.address)) > 1:
            raise UsageFault("give only one of SOURCE, --from and --udp")
        if self.allow is not None and not self._listens:
            raise UsageFault("--allow is for --udp, --from udp: and --from http:")
        if self.form is not None and fields is not None:
            raise UsageFault("--fields has no effect with --form, which determines the fields")

    @property
    def _listens(self) -> bool:
        return self.udp is not None or (self.address or "").startswith(("udp:", "http:"))

    def _access(self) -> Access:
        try:
            return Access.of(self.allow)
        except ValueError as error:
            raise UsageFault(f"--allow: {error}") from None

    def numbers(self) -> dict[str, Any]:
        """Return the settings of the protocol's sequence number."""
        form = self.packets()
        if form is None or form.counter is None:
            return {}
        return {"sequence": form.counter, "sequence_bits": form.counter_bits}

    def has_lines(self) -> bool:
        """Return True if samples are lines of a file, a pipe or stdin."""
        return self.udp is None and self.address is None and self.form is None

    def first_line(self, source: Path | None) -> str:
        """Return the first line of the source without consuming it; empty for a FIFO."""
        if source is None:
            peek = getattr(sys.stdin and sys.stdin.buffer, "peek", None)
            head = peek(_HEAD_BYTES) if peek is not None else b""
        elif source.is_file():
            with suppress(OSError), source.open("rb") as file:
                return file.readline(_HEAD_BYTES).decode("utf-8", "replace")
            return ""
        else:
            return ""
        return bytes(head).partition(b"\n")[0].decode("utf-8", "replace")

    @contextmanager
    def opened(
        self, source: Path | None, interrupts: Interrupts, hidden: bool
    ) -> Iterator[Iterator[Line]]:
        """Yield the lines or packets of the source; with `hidden`, answers are not printed."""
        form = self.packets()
        if self.udp is not None:
            with self._port(self.udp) as port:
                notify("listening on {}:{}".format(*port.getsockname()[:2]))
                received = DatagramPort(port, self._access())
                try:
                    yield datagrams(port, received, interrupts)
                finally:
                    for text in received.sentences():
                        notify(f"--udp: {text}")
            return
        with self._bytes(source, form, interrupts) as file, _answers(hidden) as answers:
            if form is None:
                yield lines_of(file, answers, interrupts)
            else:
                yield packets_of(file, form, answers, interrupts)

    def _port(self, address: str) -> socket.socket:
        try:
            return bound_socket(*parse_host_port(address), self._access())
        except AddressError as error:
            raise UsageFault(f"--udp {error}") from None
        except ValueError:
            example = "127.0.0.1:5005"
            raise UsageFault(f"--udp takes HOST:PORT such as {example}, got '{address}'") from None
        except OSError as error:
            raise UsageFault(f"--udp cannot use {address}: {error.strerror or error}") from None

    @contextmanager
    def _bytes(
        self, source: Path | None, form: PacketProtocol | None, interrupts: Interrupts
    ) -> Iterator[BinaryIO]:
        if self.address is not None:
            ending = Ending()
            try:
                with ExitStack() as opened:
                    source_ = live_source(self.address, form, self._access(), ending)
                    # Wait for a server that does not answer yet.
                    yield interrupts.wait(lambda: opened.enter_context(source_))
            except AddressError as error:
                raise UsageFault(f"--from {error}") from None
            except ImportError as error:
                raise UsageFault(sentence(error)) from None
            except OSError as error:
                raise DataFault(f"{self.address} cannot be read: {error}") from None
            finally:
                *lost, last = ["", *ending.sentences()]
                for text in filter(None, [*lost, "" if ending.torn else last]):
                    notify(f"{self.address}: {text}")
            if ending.torn:
                raise DataFault(f"{self.address}: {last}")
        elif source is not None:
            # Opening a FIFO waits for its writer.
            with interrupts.wait(lambda: _opened(source)) as file:
                yield file
        else:
            yield _bytes_of(sys.stdin, "stdin")


@contextmanager
def _answers(hidden: bool) -> Iterator[BinaryIO]:
    if not hidden:
        yield _bytes_of(sys.stdout, "stdout")
        return
    with open(os.devnull, "wb") as nowhere:
        yield nowhere


def _bytes_of(stream: TextIO | None, name: str) -> BinaryIO:
    # A closed stream is None.
    if stream is None:
        raise DataFault(f"{name} is closed")
    return stream.buffer


def _opened(source: Path) -> BinaryIO:
    try:
        return source.open("rb")
    except OSError as error:
        raise DataFault(of_a_file(error)) from None
