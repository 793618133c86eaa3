"""Sources of a live device's bytes: a serial line, sockets, pushes, Bluetooth."""

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

from zerorate.io.packets import PacketProtocol
from zerorate.texts import describe_missing_extra

_READ_BYTES: Final = 1 << 16
_MAX_PUSH_BYTES: Final = 1 << 22
"""Bytes that one push may have: some seconds of all sensors."""
_TIMEOUT_S: Final = 30.0
"""How long a connection or a device is waited for."""
_DEFAULT_BAUD: Final = 115200
_MAX_QUEUED: Final = 1 << 12
"""Largest number of waiting messages; a source faster than the filter is held up or refused."""

_Read: TypeAlias = Callable[[], bytes]
"""Returns the next bytes, none at the end."""


class AddressError(ValueError):
    """The text is no address of a source."""


@dataclass(frozen=True)
class SourceKind:
    """A kind of source: the form of its address, and its description."""

    address: str
    meaning: str
    opener: Callable[[str, PacketProtocol | None], Any]


class _ByteReader(io.RawIOBase):
    """Pieces of any size as a file, from which lines and bytes are read in the same way."""

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
def live_source(address: str, protocol: PacketProtocol | None) -> Iterator[BinaryIO]:
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
    name, colon, target = address.partition(":")
    if name not in SOURCES or not colon or not target:
        known = ", ".join(kind.address for kind in SOURCES.values())
        raise AddressError(f"takes one of {known}, got '{address}'")
    with SOURCES[name].opener(target, protocol) as read:
        yield io.BufferedReader(_ByteReader(read), _READ_BYTES)


def _check_installed(module: str, what: str) -> None:
    if find_spec(module) is None:
        raise ImportError(describe_missing_extra(module, "live", what))


def _end_line(message: bytes, protocol: PacketProtocol | None) -> bytes:
    """Return a message with a line's end, if the source is read by lines."""
    is_complete = message.endswith(b"\n") or not (protocol is None or protocol.lines)
    return message if is_complete else message + b"\n"


def _parse_host_port(target: str, kind: str) -> tuple[str, int]:
    host, _, port = target.rpartition(":")
    if not host or not port.isdecimal() or not 0 <= int(port) <= 65535:
        raise AddressError(f"takes {SOURCES[kind].address}, got '{kind}:{target}'")
    return host.strip("[]"), int(port)


@contextmanager
def _open_serial(target: str, _protocol: PacketProtocol | None) -> Iterator[_Read]:
    _check_installed("serial", "a serial line")
    import serial

    device, _, speed = target.partition("@")
    if speed and not speed.isdecimal():
        raise AddressError(f"takes {SOURCES['serial'].address}, got 'serial:{target}'")
    with serial.Serial(device, int(speed or _DEFAULT_BAUD)) as port:
        yield lambda: port.read(max(1, port.in_waiting))


@contextmanager
def _open_tcp(target: str, _protocol: PacketProtocol | None) -> Iterator[_Read]:
    with socket.create_connection(_parse_host_port(target, "tcp"), _TIMEOUT_S) as port:
        port.settimeout(None)
        yield lambda: port.recv(_READ_BYTES)


@contextmanager
def _open_udp(target: str, protocol: PacketProtocol | None) -> Iterator[_Read]:
    host, number = _parse_host_port(target, "udp")
    family, kind, _, _, local_address = socket.getaddrinfo(host, number, type=socket.SOCK_DGRAM)[0]
    with socket.socket(family, kind) as port:
        port.bind(local_address)
        # A datagram without a byte is not the end.
        yield lambda: _end_line(port.recv(_READ_BYTES), protocol) or b"\n"


@contextmanager
def _open_websocket(target: str, protocol: PacketProtocol | None) -> Iterator[_Read]:
    _check_installed("websockets", "a WebSocket")
    from websockets.exceptions import ConnectionClosed, WebSocketException
    from websockets.sync.client import connect

    def read() -> bytes:
        try:
            message = socket_.recv()
        except ConnectionClosed:
            return b""
        return _end_line(message.encode() if isinstance(message, str) else message, protocol)

    try:
        socket_ = connect(f"ws:{target}", open_timeout=_TIMEOUT_S, max_size=_MAX_PUSH_BYTES)
    except WebSocketException as error:
        raise OSError(f"ws:{target} is no WebSocket: {error}") from None
    with socket_:
        yield read


@contextmanager
def _open_http(target: str, protocol: PacketProtocol | None) -> Iterator[_Read]:
    from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

    bodies: queue.Queue[bytes] = queue.Queue(_MAX_QUEUED)

    class Handler(BaseHTTPRequestHandler):
        timeout = _TIMEOUT_S

        def do_POST(self) -> None:
            length = self.headers.get("Content-Length", "")
            if not length.isdecimal() or int(length) > _MAX_PUSH_BYTES:
                self.send_error(413)
                return
            bodies.put(_end_line(self.rfile.read(int(length)), protocol))
            self.send_response(200)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Say nothing: stderr is for faults of the samples."""

    with ThreadingHTTPServer(_parse_host_port(target, "http"), Handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield lambda: bodies.get() or b"\n"
        finally:
            server.shutdown()


@contextmanager
def _open_bluetooth(target: str, protocol: PacketProtocol | None) -> Iterator[_Read]:
    _check_installed("bleak", "a Bluetooth device")
    device, _, characteristic = target.partition("/")
    characteristic = characteristic or (protocol.notify if protocol is not None else None) or ""
    if not characteristic:
        raise AddressError(f"takes {SOURCES['ble'].address}, got 'ble:{target}'")
    pieces: queue.Queue[bytes | Exception] = queue.Queue(_MAX_QUEUED)
    stopped = threading.Event()
    work = threading.Thread(
        target=lambda: _read_notifications(device, characteristic, pieces, stopped), daemon=True
    )
    work.start()

    def read() -> bytes:
        piece = pieces.get()
        if isinstance(piece, Exception):
            raise OSError(f"ble:{target}: {piece}") from None
        return piece

    try:
        yield read
    finally:
        stopped.set()
        work.join(_TIMEOUT_S)


def _read_notifications(
    device: str,
    characteristic: str,
    pieces: queue.Queue[bytes | Exception],
    stopped: threading.Event,
) -> None:
    """Put a device's notifications, nothing at its end, or the error that ends it."""
    from bleak import BleakClient

    async def run() -> None:
        disconnected = asyncio.Event()
        loop = asyncio.get_running_loop()

        def left(_: BleakClient) -> None:
            loop.call_soon_threadsafe(disconnected.set)

        client = BleakClient(device, disconnected_callback=left, timeout=_TIMEOUT_S)
        async with client:
            await client.start_notify(characteristic, lambda _, raw: pieces.put(bytes(raw)))
            while not disconnected.is_set() and not stopped.is_set():
                await asyncio.sleep(0.1)

    try:
        asyncio.run(run())
        pieces.put(b"")
    except Exception as error:
        pieces.put(error)


SOURCES: Final = {
    "serial": SourceKind(
        "serial:DEVICE@BAUD", "a serial line, 115200 baud without @", _open_serial
    ),
    "tcp": SourceKind("tcp:HOST:PORT", "a server of bytes or lines", _open_tcp),
    "udp": SourceKind("udp:HOST:PORT", "datagrams to this address of this machine", _open_udp),
    "ws": SourceKind("ws://HOST:PORT/PATH", "a WebSocket", _open_websocket),
    "http": SourceKind(
        "http:HOST:PORT", "what is pushed to this address of this machine", _open_http
    ),
    "ble": SourceKind(
        "ble:ADDRESS/CHARACTERISTIC", "a Bluetooth device's notices", _open_bluetooth
    ),
}
"""The kinds of live sources, by what their addresses begin with."""
