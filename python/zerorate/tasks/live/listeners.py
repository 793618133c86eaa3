"""Listeners: permitted senders, and limits of their connections and data.

The page of ``--serve``, pushes and datagrams use this module.
"""

from __future__ import annotations

import ipaddress
import socket
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from email.message import Message
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from time import monotonic
from typing import Any, Final, Self, TypeAlias

MAX_QUEUED_BYTES: Final = 1 << 26
"""Largest number of bytes waiting for the filter."""
CUT: Final = b"..."
"""Mark at the end of a cut record, which otherwise could look complete."""
_MAX_CONNECTIONS: Final = 64
"""Largest number of connections per listener; beyond, the longest idle one is closed."""
_COUNTS_DROPS: Final = sys.platform == "linux"
_DROP_COUNT_OPTION: Final = 40
"""Linux's ``SO_RXQ_OVFL``, which `socket` does not define."""
_DROP_COUNT_BYTES: Final = 4
_KEPT_BYTES: Final = 80
"""Number of bytes kept of a cut datagram."""
_IDLE_S: Final = 30.0
"""Longest wait for data on a connection, s."""
_POLL_S: Final = 0.05
_MAX_PORT: Final = 65535
_ANY: Final = "any"

_Network: TypeAlias = ipaddress.IPv4Network | ipaddress.IPv6Network
Address: TypeAlias = tuple[Any, ...]


def parse_host_port(text: str) -> tuple[str, int]:
    """Return host and port of ``HOST:PORT``; ValueError for other texts."""
    host, _, number = text.rpartition(":")
    is_port = number.isascii() and number.isdecimal() and len(number) <= len(str(_MAX_PORT))
    if not host or not is_port or int(number) > _MAX_PORT:
        raise ValueError(f"'{text}' is not HOST:PORT")
    return host.strip("[]"), int(number)


@dataclass(frozen=True)
class Access:
    """Permitted peers of a listener: this machine, and the named addresses.

    Parameters
    ----------
    networks : tuple of networks
        Addresses of other machines that are permitted to send.
    names : tuple of str
        Names of this machine that requests may use, besides its addresses.
    """

    networks: tuple[_Network, ...] = ()
    names: tuple[str, ...] = ()

    @classmethod
    def of(cls, text: str | None) -> Self:
        """Return the access for a list of addresses, networks and names (commas), or ``any``.

        Raises
        ------
        ValueError
            If a part with a slash is not a network.
        """
        parts = [part.strip() for part in (text or "").split(",") if part.strip()]
        networks: list[_Network] = []
        names: list[str] = []
        for part in parts:
            if part == _ANY:
                networks += map(ipaddress.ip_network, ("0.0.0.0/0", "::/0"))
                continue
            try:
                networks.append(ipaddress.ip_network(part, strict=False))
            except ValueError:
                if "/" in part:
                    raise
                names.append(part.lower())
        return cls(tuple(networks), tuple(names))

    def resolve(self, host: str, port: int, kind: int) -> tuple[int, Address]:
        """Return the address family and address for a listener.

        Raises
        ------
        ValueError
            If other machines can reach the address, but none is permitted.
        OSError
            If the host is unknown.
        """
        try:
            family, _, _, _, address = socket.getaddrinfo(host, port, type=kind)[0]
        except UnicodeError:
            raise OSError(f"'{host}' is no name of a host") from None
        if not self.networks and not ipaddress.ip_address(address[0]).is_loopback:
            raise ValueError(
                f"listens at an address of this machine alone, got '{address[0]}'; --allow "
                "ADDRESS opens it to others"
            )
        return family, address

    def admits_peer(self, peer: str) -> bool:
        """Return True if a peer with this address is permitted to send."""
        try:
            address = ipaddress.ip_address(peer.partition("%")[0])
        except ValueError:
            return False
        plain = getattr(address, "ipv4_mapped", None) or address
        return plain.is_loopback or any(plain in network for network in self.networks)

    def admits_request(self, headers: Message, port: int) -> bool:
        """Return True if a request is for this listener, and not from a page of another site.

        Such a page sends its own ``Origin``. If the site's name resolves to this machine, the page
        sends this name as ``Host``.
        """
        stated = headers.get("Host", "")
        try:
            host, number = parse_host_port(stated)
        except ValueError:
            return False
        origin = headers.get("Origin")
        same_site = origin is None or origin.lower() == f"http://{stated.lower()}"
        return number == port and same_site and self._is_own_name(host.lower())

    def _is_own_name(self, host: str) -> bool:
        if host == "localhost" or host in self.names:
            return True
        try:
            address = ipaddress.ip_address(host)
        except ValueError:
            return False
        return address.is_loopback or bool(self.networks)


class BoundedServer(ThreadingHTTPServer):
    """HTTP server with a limited number of connections.

    Parameters
    ----------
    host, port
        Address of the listener; port 0 means any free port.
    handler : type
        Class that answers requests.
    access : Access
        Permitted peers.

    Raises
    ------
    ValueError
        As `Access.resolve`.
    OSError
        If the address cannot be used.
    """

    daemon_threads = True
    block_on_close = False
    request_queue_size = _MAX_CONNECTIONS

    def __init__(self, host: str, port: int, handler: type[BoundedHandler], access: Access) -> None:
        self.access = access
        self._lock = threading.Lock()
        self._open: dict[socket.socket, tuple[bool, float]] = {}
        self.address_family, address = access.resolve(host, port, socket.SOCK_STREAM)
        super().__init__(address, handler)
        self._thread = threading.Thread(target=lambda: self.serve_forever(_POLL_S), daemon=True)

    def begin(self) -> None:
        """Start serving in a separate thread."""
        self._thread.start()

    def end(self) -> None:
        """Stop serving without waiting for connections."""
        self.shutdown()
        self.server_close()
        with self._lock:
            left = [*self._open]
        for request in left:
            _hang_up(request)

    def verify_request(self, request: Any, client_address: Any) -> bool:  # noqa: ANN401
        """Return True if the peer is permitted to send."""
        return self.access.admits_peer(client_address[0])

    def process_request(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Answer in a thread; if there are too many connections, close the longest idle one."""
        with self._lock:
            if len(self._open) >= _MAX_CONNECTIONS:
                longest = min(self._open, key=self._open.__getitem__)
                del self._open[longest]
                _hang_up(longest)
            self._open[request] = (False, monotonic())
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:  # noqa: ANN401
        """Remove a closed connection."""
        with self._lock:
            self._open.pop(request, None)
        super().shutdown_request(request)

    def hold(self, request: socket.socket) -> None:
        """Mark a connection as busy, so that idle connections are closed before it."""
        with self._lock:
            if request in self._open:
                self._open[request] = (True, monotonic())

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore errors of disconnected peers."""


def _hang_up(request: socket.socket) -> None:
    try:
        request.shutdown(socket.SHUT_RDWR)
    except OSError:
        request.close()


class BoundedHandler(BaseHTTPRequestHandler):
    """Handler for requests that `Access` permits."""

    server: BoundedServer
    timeout = _IDLE_S

    def is_admitted(self) -> bool:
        """Return True if the request is permitted; otherwise answer with an error."""
        self.server.hold(self.connection)
        if self.server.access.admits_request(self.headers, self.server.server_address[1]):
            return True
        self.send_error(HTTPStatus.FORBIDDEN)
        return False

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing, because stderr belongs to the stream."""


class DatagramPort:
    """Datagrams of permitted peers, and the number of datagrams dropped by the system.

    The system drops datagrams if its buffer is full. Only Linux counts them; on other systems the
    number stays zero.

    Parameters
    ----------
    port : socket
        The bound socket.
    access : Access
        Permitted peers.
    """

    def __init__(self, port: socket.socket, access: Access) -> None:
        self._port, self._access = port, access
        self.dropped_count = 0
        """Number of datagrams dropped because of a full buffer, at the last received one."""
        self.last_foreign = ""
        """Address of the last peer without permission; empty if there was none."""
        if _COUNTS_DROPS:
            port.setsockopt(socket.SOL_SOCKET, _DROP_COUNT_OPTION, 1)

    def receive(self, size: int) -> tuple[bytes, Address]:
        """Return the next datagram and its peer; more than ``size`` bytes are cut, with a mark.

        Raises
        ------
        OSError
            If the socket fails, or the time limit is reached.
        """
        while True:
            raw, sender = self._receive_any(size)
            if self._access.admits_peer(sender[0]):
                return raw, sender
            self.last_foreign = sender[0]

    def _receive_any(self, size: int) -> tuple[bytes, Address]:
        if not _COUNTS_DROPS:
            return self._port.recvfrom(size)
        raw, extra, flags, sender = self._port.recvmsg(size, socket.CMSG_SPACE(_DROP_COUNT_BYTES))
        for level, kind, value in extra:
            if (level, kind) == (socket.SOL_SOCKET, _DROP_COUNT_OPTION):
                self.dropped_count = int.from_bytes(value[:_DROP_COUNT_BYTES], sys.byteorder)
        return (raw[:_KEPT_BYTES] + CUT if flags & socket.MSG_TRUNC else raw), sender

    def sentences(self) -> Iterator[str]:
        """Yield sentences on dropped datagrams, and on datagrams of other peers."""
        if self.dropped_count:
            yield (
                f"{self.dropped_count} datagrams were dropped by the system: its buffer was full"
            )
        if self.last_foreign:
            yield f"datagrams of others were left out, last of {self.last_foreign}"


class ByteQueue:
    """Queue of pieces of bytes between two threads, with a limited size.

    Parameters
    ----------
    limit : int
        Largest number of waiting bytes.
    """

    def __init__(self, limit: int = MAX_QUEUED_BYTES) -> None:
        self._limit, self._size = limit, 0
        self._pieces: list[bytes] = []
        self._ended = False
        self._changed = threading.Condition()
        self.dropped_count = 0
        """Number of pieces dropped because the queue was full."""

    def put(self, piece: bytes) -> bool:
        """Append a piece; return False if the queue is full, and drop the piece."""
        with self._changed:
            if self._size + len(piece) > self._limit:
                self.dropped_count += 1
                return False
            self._size += len(piece)
            self._pieces.append(piece)
            self._changed.notify()
        return True

    def end(self) -> None:
        """Mark the end: `get` returns an empty piece after all waiting pieces."""
        with self._changed:
            self._ended = True
            self._changed.notify()

    def get(self) -> bytes:
        """Return all waiting bytes, or wait for the next; empty at the end."""
        with self._changed:
            while not self._pieces and not self._ended:
                self._changed.wait()
            taken, self._pieces, self._size = b"".join(self._pieces), [], 0
        return taken
