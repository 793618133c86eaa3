"""Live stream in a browser on this machine: a page, and views that are sent to it."""

from __future__ import annotations

import json
import queue
import threading
from collections import deque
from collections.abc import Iterator
from http import HTTPStatus
from importlib.resources import files
from time import monotonic, sleep
from typing import Final, Self

from zerorate.tasks.live.listeners import Access, BoundedHandler, BoundedServer
from zerorate.tasks.live.view import PERIOD_S, View

HOST: Final = "127.0.0.1"
_HISTORY_S: Final = 60.0
"""Length of the history on a page, s; a page that is opened later gets it at once."""
_MAX_QUEUED_VIEWS: Final = 200
"""Largest number of views waiting for a page; the oldest are dropped."""
_CLOSING_TIME_S: Final = 0.5
"""Time for the pages to receive the end message, s."""
_FILES: Final = {
    "/": ("live_page.html", "text/html"),
    "/live_page.css": ("live_page.css", "text/css"),
    "/live_page.js": ("live_page.js", "text/javascript"),
}
_CONTENT_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; "
    "frame-ancestors 'none'; base-uri 'none'"
)

_Pages = set[queue.Queue[str | None]]


class LivePage:
    """Server of the page for this machine, until it is closed.

    Parameters
    ----------
    port : int
        Port on the loopback interface. 0 selects any free port.

    Raises
    ------
    OSError
        If the port cannot be used.
    """

    def __init__(self, port: int) -> None:
        self._past: deque[str] = deque(maxlen=round(_HISTORY_S / PERIOD_S))
        self._pages: _Pages = set()
        self._lock = threading.Lock()
        self._server = _Server(port, self)

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self._server.server_address[1]}/"

    def __enter__(self) -> Self:
        """Start the server."""
        self._server.begin()
        return self

    def __exit__(self, *fault: object) -> None:
        """Tell all pages that the stream has ended."""
        self._send(None)
        deadline = monotonic() + _CLOSING_TIME_S
        while self._pages and monotonic() < deadline:
            sleep(0.01)
        self._server.end()

    def put(self, view: View) -> None:
        """Send a view to all pages without waiting for them."""
        text = json.dumps(view.to_json())
        self._past.append(text)
        self._send(text)

    def events(self) -> Iterator[bytes]:
        """Yield the views of the last minute, then new views, then the end."""
        waiting: queue.Queue[str | None] = queue.Queue(_MAX_QUEUED_VIEWS)
        with self._lock:
            past = list(self._past)
            self._pages.add(waiting)
        try:
            yield from map(_encode_event, past)
            while (text := _next_text(waiting)) is not None:
                # A comment line tests if the page is still connected.
                yield _encode_event(text) if text else b": \n\n"
            yield b"event: end\ndata: \n\n"
        finally:
            with self._lock:
                self._pages.discard(waiting)

    def _send(self, text: str | None) -> None:
        with self._lock:
            for page in self._pages:
                if page.full():
                    page.get_nowait()
                page.put_nowait(text)


def _encode_event(text: str) -> bytes:
    return f"data: {text}\n\n".encode()


def _next_text(waiting: queue.Queue[str | None]) -> str | None:
    """Return the next view, "" if none arrives within a second, or None at the end."""
    try:
        return waiting.get(timeout=1.0)
    except queue.Empty:
        return ""


class _Server(BoundedServer):
    def __init__(self, port: int, page: LivePage) -> None:
        super().__init__(HOST, port, _Handler, Access())
        self.page = page


class _Handler(BoundedHandler):
    server: _Server

    def do_GET(self) -> None:  # the name that the base class calls
        """Answer with a file or with the stream of views."""
        if not self.is_admitted():
            return
        if self.path == "/events":
            self._events()
        elif self.path in _FILES:
            self._file(*_FILES[self.path])
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _file(self, name: str, kind: str) -> None:
        body = files("zerorate.show").joinpath(name).read_bytes()
        self._head(f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def _events(self) -> None:
        self._head("text/event-stream")
        self.end_headers()
        for event in self.server.page.events():
            self.wfile.write(event)
            self.wfile.flush()

    def _head(self, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", _CONTENT_POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
