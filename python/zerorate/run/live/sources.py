"""Where lines come from, and where their answers go."""

import ipaddress
import socket
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, BinaryIO, Final, TypeAlias

from zerorate.run.live.interrupts import Interrupts

__all__ = ["Line", "datagrams", "lines", "loopback"]

Line: TypeAlias = tuple[str, Callable[[str], None]]
"""A line, and what sends its answer."""

_LONGEST: Final = 1 << 16


def lines(source: BinaryIO, answers: BinaryIO, interrupts: Interrupts) -> Iterator[Line]:
    """Yield each line as soon as it is complete, with a function that writes its answer."""

    def reply(answer: str) -> None:
        answers.write(f"{answer}\n".encode())
        answers.flush()

    while raw := interrupts.wait(lambda: _line(source)):
        yield _text(raw), reply


def datagrams(port: socket.socket, interrupts: Interrupts) -> Iterator[Line]:
    """Yield each datagram as a line, with a function that answers to its sender."""
    while True:
        raw, sender = interrupts.wait(lambda: port.recvfrom(_LONGEST))

        def reply(answer: str, sender: tuple[str, int] = sender) -> None:
            # A sender that is gone is no fault of the stream: datagrams may be lost.
            with suppress(OSError):
                port.sendto(answer.encode(), sender)

        yield _text(raw), reply


def loopback(address: str) -> socket.socket:
    """Return a socket bound to ``HOST:PORT`` of this machine alone; port 0 is any free one.

    Raises
    ------
    ValueError
        If the text is no such address, is open to other machines, not known, or in use.
    """
    host, _, number = address.rpartition(":")
    if not host or not number.isdecimal() or int(number) > 65535:
        raise ValueError(f"--udp takes HOST:PORT such as 127.0.0.1:5005, got '{address}'")
    try:
        found = socket.getaddrinfo(host.strip("[]"), int(number), type=socket.SOCK_DGRAM)
        return _bound(*found[0])
    except OSError as error:
        raise ValueError(f"--udp cannot use {address}: {error.strerror}") from None


def _bound(
    family: int, kind: int, _protocol: int, _name: str, place: tuple[Any, ...]
) -> socket.socket:
    # Datagrams are taken from whoever sends them, so from this machine alone.
    if not ipaddress.ip_address(place[0]).is_loopback:
        raise ValueError(f"--udp takes an address of this machine alone, got '{place[0]}'")
    port = socket.socket(family, kind)
    try:
        port.bind(place)
    except OSError:
        port.close()
        raise
    return port


def _line(source: BinaryIO) -> bytes:
    raw = source.readline(_LONGEST)
    if len(raw) < _LONGEST or raw.endswith(b"\n"):
        return raw
    while (rest := source.readline(_LONGEST)) and not rest.endswith(b"\n"):
        pass
    # Cut short it could pass for a number.
    return raw[:80] + b"..."


def _text(raw: bytes) -> str:
    return raw.decode("utf-8", "replace")
