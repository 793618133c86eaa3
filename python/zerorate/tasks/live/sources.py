"""Where the bytes of a live device come from: a serial line, sockets, pushes, Bluetooth."""

from __future__ import annotations

import asyncio
import io
import queue
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, BinaryIO, Final, TypeAlias

from zerorate.io.packets import PacketForm
from zerorate.texts import extra_needed

_PIECE: Final = 1 << 16
_MOST: Final = 1 << 22
"""Bytes that one push may have: some seconds of all sensors."""
_SECONDS: Final = 30.0
"""How long a connection or a device is waited for."""
_BAUD: Final = 115200
_QUEUED: Final = 1 << 12
"""Messages that wait at most; a source that is faster than the filter is held up, or told off."""

_Read: TypeAlias = Callable[[], bytes]
"""Returns the next bytes, none at the end."""


class AddressError(ValueError):
    """The text is no address of a source."""


@dataclass(frozen=True)
class SourceKind:
    """A kind of source: how its address is typed, and what it is."""

    address: str
    meaning: str
    opened: Callable[[str, PacketForm | None], Any]


class _Pieces(io.RawIOBase):
    """Pieces of any size as a file, so that lines and bytes are read of it alike."""

    def __init__(self, read: _Read) -> None:
        self._read, self._rest = read, b""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:  # noqa: ANN401
        if not self._rest:
            self._rest = self._read()
        count = min(len(buffer), len(self._rest))
        buffer[:count], self._rest = self._rest[:count], self._rest[count:]
        return count


@contextmanager
def live_source(address: str, form: PacketForm | None) -> Iterator[BinaryIO]:
    """Open ``KIND:ADDRESS``, one of `SOURCES`, and give its bytes as a file.

    Raises
    ------
    AddressError
        If the text is no such address.
    ImportError
        If the package for this kind is not installed.
    OSError
        If it cannot be opened, or fails later.
    """
    name, colon, place = address.partition(":")
    if name not in SOURCES or not colon or not place:
        known = ", ".join(kind.address for kind in SOURCES.values())
        raise AddressError(f"takes one of {known}, got '{address}'")
    with SOURCES[name].opened(place, form) as read:
        yield io.BufferedReader(_Pieces(read), _PIECE)


def _needed(module: str, what: str) -> None:
    if find_spec(module) is None:
        raise ImportError(extra_needed(module, "live", what))


def _ended(message: bytes, form: PacketForm | None) -> bytes:
    """Return a message with a line's end, where lines are what is read."""
    whole = message.endswith(b"\n") or not (form is None or form.lines)
    return message if whole else message + b"\n"


def _host_and_port(place: str, kind: str) -> tuple[str, int]:
    host, _, port = place.rpartition(":")
    if not host or not port.isdecimal() or not 0 <= int(port) <= 65535:
        raise AddressError(f"takes {SOURCES[kind].address}, got '{kind}:{place}'")
    return host.strip("[]"), int(port)


@contextmanager
def _serial(place: str, _form: PacketForm | None) -> Iterator[_Read]:
    _needed("serial", "a serial line")
    import serial

    device, _, speed = place.partition("@")
    if speed and not speed.isdecimal():
        raise AddressError(f"takes {SOURCES['serial'].address}, got 'serial:{place}'")
    with serial.Serial(device, int(speed or _BAUD)) as port:
        yield lambda: port.read(max(1, port.in_waiting))


@contextmanager
def _tcp(place: str, _form: PacketForm | None) -> Iterator[_Read]:
    with socket.create_connection(_host_and_port(place, "tcp"), _SECONDS) as port:
        port.settimeout(None)
        yield lambda: port.recv(_PIECE)


@contextmanager
def _udp(place: str, form: PacketForm | None) -> Iterator[_Read]:
    host, number = _host_and_port(place, "udp")
    family, kind, _, _, bound = socket.getaddrinfo(host, number, type=socket.SOCK_DGRAM)[0]
    with socket.socket(family, kind) as port:
        port.bind(bound)
        # A datagram without a byte is not the end.
        yield lambda: _ended(port.recv(_PIECE), form) or b"\n"


@contextmanager
def _websocket(place: str, form: PacketForm | None) -> Iterator[_Read]:
    _needed("websockets", "a WebSocket")
    from websockets.exceptions import ConnectionClosed, WebSocketException
    from websockets.sync.client import connect

    def read() -> bytes:
        try:
            message = socket_.recv()
        except ConnectionClosed:
            return b""
        return _ended(message.encode() if isinstance(message, str) else message, form)

    try:
        socket_ = connect(f"ws:{place}", open_timeout=_SECONDS, max_size=_MOST)
    except WebSocketException as error:
        raise OSError(f"ws:{place} is no WebSocket: {error}") from None
    with socket_:
        yield read


@contextmanager
def _pushed(place: str, form: PacketForm | None) -> Iterator[_Read]:
    from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

    bodies: queue.Queue[bytes] = queue.Queue(_QUEUED)

    class Handler(BaseHTTPRequestHandler):
        timeout = _SECONDS

        def do_POST(self) -> None:
            length = self.headers.get("Content-Length", "")
            if not length.isdecimal() or int(length) > _MOST:
                self.send_error(413)
                return
            bodies.put(_ended(self.rfile.read(int(length)), form))
            self.send_response(200)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Say nothing: stderr is for what is wrong with the samples."""

    with ThreadingHTTPServer(_host_and_port(place, "http"), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield lambda: bodies.get() or b"\n"
        finally:
            server.shutdown()


@contextmanager
def _bluetooth(place: str, form: PacketForm | None) -> Iterator[_Read]:
    _needed("bleak", "a Bluetooth device")
    device, _, characteristic = place.partition("/")
    characteristic = characteristic or (form.notify if form is not None else None) or ""
    if not characteristic:
        raise AddressError(f"takes {SOURCES['ble'].address}, got 'ble:{place}'")
    pieces: queue.Queue[bytes | Exception] = queue.Queue(_QUEUED)
    ended = threading.Event()
    work = threading.Thread(
        target=lambda: _notified(device, characteristic, pieces, ended), daemon=True
    )
    work.start()

    def read() -> bytes:
        piece = pieces.get()
        if isinstance(piece, Exception):
            raise OSError(f"ble:{place}: {piece}") from None
        return piece

    try:
        yield read
    finally:
        ended.set()
        work.join(_SECONDS)


def _notified(
    device: str,
    characteristic: str,
    pieces: queue.Queue[bytes | Exception],
    ended: threading.Event,
) -> None:
    """Put what a device notifies, nothing at its end, or the error that ends it."""
    from bleak import BleakClient

    async def run() -> None:
        gone = asyncio.Event()
        loop = asyncio.get_running_loop()

        def left(_: BleakClient) -> None:
            loop.call_soon_threadsafe(gone.set)

        client = BleakClient(device, disconnected_callback=left, timeout=_SECONDS)
        async with client:
            await client.start_notify(characteristic, lambda _, raw: pieces.put(bytes(raw)))
            while not gone.is_set() and not ended.is_set():
                await asyncio.sleep(0.1)

    try:
        asyncio.run(run())
        pieces.put(b"")
    except Exception as error:
        pieces.put(error)


SOURCES: Final = {
    "serial": SourceKind("serial:DEVICE@BAUD", "a serial line, 115200 baud without @", _serial),
    "tcp": SourceKind("tcp:HOST:PORT", "a server of bytes or lines", _tcp),
    "udp": SourceKind("udp:HOST:PORT", "datagrams to this address of this machine", _udp),
    "ws": SourceKind("ws://HOST:PORT/PATH", "a WebSocket", _websocket),
    "http": SourceKind("http:HOST:PORT", "what is pushed to this address of this machine", _pushed),
    "ble": SourceKind("ble:ADDRESS/CHARACTERISTIC", "a Bluetooth device's notices", _bluetooth),
}
"""The kinds of live sources, by what their addresses begin with."""
