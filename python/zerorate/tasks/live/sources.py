"""Sources of a live device's bytes: serial lines, sockets, pushes, Bluetooth."""

from __future__ import annotations

import asyncio
import io
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from importlib.util import find_spec
from typing import Any, BinaryIO, Final, TypeAlias

from zerorate.io.packets import PacketProtocol
from zerorate.tasks.live.listeners import (
    CUT,
    Access,
    BoundedHandler,
    BoundedServer,
    ByteQueue,
    DatagramPort,
    parse_host_port,
)
from zerorate.texts import describe_missing_extra

_READ_BYTES: Final = 1 << 16
_MAX_PUSH_BYTES: Final = 1 << 22
"""Largest size of a push or message, bytes: several seconds of all sensors."""
_MAX_LENGTH_DIGITS: Final = 12
_TIMEOUT_S: Final = 30.0
"""Longest wait for a connection or a device, s."""
_POLL_S: Final = 0.05
_CLOSING_S: Final = 0.3
"""Longest wait for the other side at the end of the stream, s."""
_DEFAULT_BAUD: Final = 115200
_MAX_BAUD_DIGITS: Final = 9

_Read: TypeAlias = Callable[[], bytes]
"""Function that returns the next bytes, empty at the end."""


class AddressError(ValueError):
    """Error for a text that is no address of a source."""


@dataclass
class Ending:
    """End of a source, with its losses.

    Attributes
    ----------
    reason : str
        Cause of the end; empty while the source continues.
    torn : bool
        True if a record, or the connection, was cut.
    notices : list of callable
        Functions that return a sentence on losses, or an empty text.
    """

    reason: str = ""
    torn: bool = False
    notices: list[Callable[[], str]] = field(default_factory=list)

    def sentences(self) -> Iterator[str]:
        """Yield sentences on losses, and on the end of the source."""
        yield from filter(None, (notice() for notice in self.notices))
        if self.reason:
            yield self.reason


@dataclass(frozen=True)
class SourceRequest:
    """A requested source: its address, packets or lines, and permitted senders."""

    target: str
    protocol: PacketProtocol | None
    access: Access
    ending: Ending

    @property
    def has_lines(self) -> bool:
        """True if records end with a line."""
        return self.protocol is None or self.protocol.lines

    def whole(self, message: bytes) -> bytes:
        """Return a message, with a line end added if records are lines."""
        is_complete = message.endswith(b"\n") or not self.has_lines
        return message if is_complete else message + b"\n"


@dataclass(frozen=True)
class SourceKind:
    """A kind of source: the syntax of its address, and its description."""

    address: str
    meaning: str
    opener: Callable[[SourceRequest], Any]


class _ByteReader(io.RawIOBase):
    """File of pieces of any size, for the same reading of lines and bytes."""

    def __init__(self, read: _Read, request: SourceRequest) -> None:
        self._read, self._request = read, request
        self._rest, self._last, self._ended = b"", b"\n", False

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:  # noqa: ANN401
        if not self._rest and not self._ended:
            self._rest = self._read() or self._end()
        count = min(len(buffer), len(self._rest))
        buffer[:count], self._rest = self._rest[:count], self._rest[count:]
        self._last = bytes(buffer[count - 1 : count]) or self._last
        return count

    def _end(self) -> bytes:
        """Return the mark for a line that the end cuts."""
        self._ended = True
        if not self._request.has_lines or self._last == b"\n":
            return b""
        ending = self._request.ending
        ending.torn = True
        ending.reason = f"{ending.reason or 'the source ended'}, within a line"
        return CUT + b"\n"


@contextmanager
def live_source(
    address: str,
    protocol: PacketProtocol | None,
    access: Access = Access(),  # noqa: B008  # immutable
    ending: Ending | None = None,
) -> Iterator[BinaryIO]:
    """Open ``KIND:ADDRESS``, with a kind in `SOURCES`, and return its bytes as a file.

    ``ending`` is filled at the end of the source; ``access`` limits the senders of a listener.

    Raises
    ------
    AddressError
        If the text is no address of a source.
    ImportError
        If the package for this kind is not installed.
    OSError
        If the source cannot be opened, or fails later.
    """
    name, colon, target = address.partition(":")
    if name not in SOURCES or not colon or not target:
        known = ", ".join(kind.address for kind in SOURCES.values())
        raise AddressError(f"takes one of {known}, got '{address}'")
    request = SourceRequest(target, protocol, access, Ending() if ending is None else ending)
    with SOURCES[name].opener(request) as read:
        yield io.BufferedReader(_ByteReader(read, request), _READ_BYTES)


def _check_installed(module: str, what: str) -> None:
    if find_spec(module) is None:
        raise ImportError(describe_missing_extra(module, "live", what))


def _parse_address(target: str, kind: str) -> tuple[str, int]:
    try:
        return parse_host_port(target)
    except ValueError:
        raise AddressError(f"takes {SOURCES[kind].address}, got '{kind}:{target}'") from None


def _until_fault(read: _Read, ending: Ending, closed: str) -> _Read:
    """Return a function that reads until the other side closes the connection or fails."""

    def read_on() -> bytes:
        try:
            piece = read()
        except OSError as error:
            ending.torn, piece = True, b""
            ending.reason = f"torn: {error.strerror or error}"
        else:
            ending.reason = ending.reason or ("" if piece else closed)
        return piece

    return read_on


@contextmanager
def _open_serial(request: SourceRequest) -> Iterator[_Read]:
    _check_installed("serial", "a serial line")
    import serial

    device, _, speed = request.target.partition("@")
    if speed and not (speed.isascii() and speed.isdecimal() and len(speed) <= _MAX_BAUD_DIGITS):
        raise AddressError(f"takes {SOURCES['serial'].address}, got 'serial:{request.target}'")
    try:
        port = serial.Serial(device, int(speed or _DEFAULT_BAUD))
    except (ValueError, OverflowError) as error:
        raise AddressError(f"cannot use 'serial:{request.target}': {error}") from None
    with port:
        yield _until_fault(
            lambda: port.read(max(1, port.in_waiting)), request.ending, "the device closed the line"
        )


@contextmanager
def _open_tcp(request: SourceRequest) -> Iterator[_Read]:
    address = _parse_address(request.target, "tcp")
    try:
        port = socket.create_connection(address, _TIMEOUT_S)
    except UnicodeError:
        raise AddressError(f"'{address[0]}' is no name of a host") from None
    with port:
        port.settimeout(None)
        yield _until_fault(lambda: port.recv(_READ_BYTES), request.ending, "closed by the server")


@contextmanager
def _open_udp(request: SourceRequest) -> Iterator[_Read]:
    pieces, faults = ByteQueue(), list[OSError]()
    stopped = threading.Event()

    def work() -> None:
        while not stopped.is_set():
            try:
                # An empty datagram is not the end.
                pieces.put(request.whole(datagrams.receive(_READ_BYTES)[0]) or b"\n")
            except TimeoutError:
                continue
            except OSError as error:
                faults.append(error)
                break
        pieces.end()

    def read() -> bytes:
        piece = pieces.get()
        if not piece and faults:
            raise faults[0]
        return piece

    with bound_socket(*_parse_address(request.target, "udp"), request.access) as port:
        port.settimeout(_POLL_S)
        datagrams = DatagramPort(port, request.access)
        request.ending.notices += [
            lambda: "; ".join(datagrams.sentences()),
            lambda: _dropped(pieces, "datagrams"),
        ]
        thread = threading.Thread(target=work, daemon=True)
        thread.start()
        try:
            yield read
        finally:
            stopped.set()
            thread.join()


def bound_socket(host: str, number: int, access: Access) -> socket.socket:
    """Return a socket for datagrams; AddressError if `Access` does not permit the address."""
    try:
        family, address = access.resolve(host, number, socket.SOCK_DGRAM)
    except ValueError as error:
        raise AddressError(str(error)) from None
    port = socket.socket(family, socket.SOCK_DGRAM)
    try:
        port.bind(address)
    except OSError:
        port.close()
        raise
    return port


@contextmanager
def _open_websocket(request: SourceRequest) -> Iterator[_Read]:
    _check_installed("websockets", "a WebSocket")
    from websockets.exceptions import ConnectionClosed, ConnectionClosedOK, WebSocketException
    from websockets.sync.client import connect

    address, ending = f"ws:{request.target}", request.ending

    def read() -> bytes:
        try:
            message = port.recv()
        except ConnectionClosedOK:
            ending.reason = "closed by the server"
            return b""
        except ConnectionClosed as error:
            sent = error.sent
            limited = sent is not None and sent.code == _MESSAGE_TOO_BIG
            size = f"limit: a message has more than {_MAX_PUSH_BYTES} bytes"
            ending.torn, ending.reason = True, size if limited else f"torn: {error}"
            return b""
        return request.whole(message.encode() if isinstance(message, str) else message)

    with ExitStack() as opened:
        try:
            connection = connect(
                address, open_timeout=_TIMEOUT_S, close_timeout=_CLOSING_S, max_size=_MAX_PUSH_BYTES
            )
            port = opened.enter_context(connection)
        except (WebSocketException, UnicodeError, ValueError) as error:
            raise OSError(f"{address} is no WebSocket: {error}") from None
        # If the server is faster than the filter, it would not notice the end of this side.
        opened.callback(_hang_up, port.socket)
        yield read


def _hang_up(port: socket.socket) -> None:
    with suppress(OSError):
        port.shutdown(socket.SHUT_RDWR)


_MESSAGE_TOO_BIG: Final = 1009


@contextmanager
def _open_http(request: SourceRequest) -> Iterator[_Read]:
    bodies = ByteQueue()
    torn: list[str] = []

    class Handler(BoundedHandler):
        def do_POST(self) -> None:
            if not self.is_admitted():
                return
            length = self.headers.get("Content-Length", "")
            is_number = length.isascii() and length.isdecimal()
            if not is_number or len(length) > _MAX_LENGTH_DIGITS or int(length) > _MAX_PUSH_BYTES:
                self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
                return
            self._take(int(length))

        def _take(self, length: int) -> None:
            try:
                body = _read_body(self.rfile, length)
            except OSError:
                return
            if len(body) < length:
                torn.append(f"a push had {len(body)} of its {length} bytes")
                if body and request.has_lines:
                    bodies.put(body.removesuffix(b"\n") + CUT + b"\n")
                self.send_error(HTTPStatus.BAD_REQUEST)
                return
            if not bodies.put(request.whole(body) or b"\n"):
                self.send_error(HTTPStatus.SERVICE_UNAVAILABLE)
                return
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Length", "0")
            self.end_headers()

    request.ending.notices += [
        lambda: _dropped(bodies, "pushes"),
        lambda: f"{len(torn)} requests were incomplete; the first: {torn[0]}" if torn else "",
    ]
    host, number = _parse_address(request.target, "http")
    try:
        server = BoundedServer(host, number, Handler, request.access)
    except ValueError as error:
        raise AddressError(str(error)) from None
    server.begin()
    try:
        yield bodies.get
    finally:
        server.end()


def _read_body(file: io.BufferedIOBase, length: int) -> bytes:
    """Return the bytes of a body; fewer if the connection ends or waits too long."""
    body = bytearray()
    while len(body) < length:
        try:
            piece = file.read1(min(_READ_BYTES, length - len(body)))
        except OSError:
            break
        if not piece:
            break
        body += piece
    return bytes(body)


def _dropped(pieces: ByteQueue, what: str) -> str:
    count = pieces.dropped_count
    return f"{count} {what} were dropped: the filter is slower than the source" if count else ""


@contextmanager
def _open_bluetooth(request: SourceRequest) -> Iterator[_Read]:
    _check_installed("bleak", "a Bluetooth device")
    device, _, characteristic = request.target.partition("/")
    protocol = request.protocol
    characteristic = characteristic or (protocol.notify if protocol is not None else None) or ""
    if not characteristic:
        raise AddressError(f"takes {SOURCES['ble'].address}, got 'ble:{request.target}'")
    pieces, faults = ByteQueue(), list[Exception]()
    stopped = threading.Event()
    request.ending.notices.append(lambda: _dropped(pieces, "notices"))

    def work() -> None:
        try:
            asyncio.run(_read_notifications(device, characteristic, pieces, stopped))
        except Exception as error:
            faults.append(error)
        pieces.end()

    thread = threading.Thread(target=work, daemon=True)
    thread.start()

    def read() -> bytes:
        piece = pieces.get()
        if not piece and faults:
            raise OSError(f"ble:{request.target}: {faults[0]}") from None
        request.ending.reason = "" if piece else "the device disconnected"
        return piece

    try:
        yield read
    finally:
        stopped.set()
        thread.join(_CLOSING_S)


async def _read_notifications(
    device: str, characteristic: str, pieces: ByteQueue, stopped: threading.Event
) -> None:
    """Queue the notifications of a device until it disconnects or the stream ends."""
    from bleak import BleakClient

    disconnected = asyncio.Event()
    loop = asyncio.get_running_loop()

    def left(_: BleakClient) -> None:
        loop.call_soon_threadsafe(disconnected.set)

    def take(_: object, raw: bytearray) -> None:
        pieces.put(bytes(raw))

    client = BleakClient(device, disconnected_callback=left, timeout=_TIMEOUT_S)
    async with client:
        await client.start_notify(characteristic, take)
        while not disconnected.is_set() and not stopped.is_set():
            await asyncio.sleep(0.1)


SOURCES: Final = {
    "serial": SourceKind(
        "serial:DEVICE@BAUD", "a serial line, 115200 baud without @", _open_serial
    ),
    "tcp": SourceKind("tcp:HOST:PORT", "a server of bytes or lines", _open_tcp),
    "udp": SourceKind("udp:HOST:PORT", "datagrams to this address of this machine", _open_udp),
    "ws": SourceKind("ws://HOST:PORT/PATH", "a WebSocket", _open_websocket),
    "http": SourceKind(
        "http:HOST:PORT", "HTTP requests to this address of this machine", _open_http
    ),
    "ble": SourceKind(
        "ble:ADDRESS/CHARACTERISTIC", "notifications of a Bluetooth device", _open_bluetooth
    ),
}
"""Kinds of live sources by the beginning of their addresses."""
