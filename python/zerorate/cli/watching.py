"""Displays of a running ``zerorate stream``: options and drawing."""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from zerorate.cli.errors import UsageFault, require
from zerorate.cli.parameters import option
from zerorate.cli.process import notify
from zerorate.tasks.live.view import View, Watcher

if TYPE_CHECKING:
    from zerorate.show.live_page import LivePage
    from zerorate.show.live_terminal import LiveTerminal


@dataclass(frozen=True)
class Watched:
    """Options of the displays."""

    show: bool = option(
        False,
        "Draw rates, biases and attitude (on stderr). Answers are printed only if stdout is no "
        "terminal.",
    )
    serve: int | None = option(
        None,
        "Serve a page with plots and attitude on this port; 0: any port. Only browsers on this "
        "machine can open it.",
        metavar="PORT",
        min=0,
        max=65535,
    )

    @contextmanager
    def watcher(self) -> Iterator[Watcher | None]:
        """Open the display; yield a function that passes views to it, or None without a display."""
        puts: list[Callable[[View], None]] = []
        with ExitStack() as opened:
            if self.serve is not None:
                page = opened.enter_context(_page(self.serve))
                notify(f"watch at {page.address}")
                puts.append(page.put)
            if self.show:
                puts.append(opened.enter_context(_terminal()).put)
            yield Watcher(_to_all(puts)) if puts else None

    @property
    def hides_answers(self) -> bool:
        """True if answers would overwrite the display."""
        return self.show and sys.stdout is not None and sys.stdout.isatty()


def _to_all(puts: list[Callable[[View], None]]) -> Callable[[View], None]:
    def put(view: View) -> None:
        for each in puts:
            each(view)

    return put


def _page(port: int) -> "LivePage":
    from zerorate.show.live_page import LivePage

    try:
        return LivePage(port)
    except OSError as error:
        raise UsageFault(f"--serve cannot use port {port}: {error.strerror}") from None


def _terminal() -> "LiveTerminal":
    require("rich", "cli")
    from rich.console import Console

    from zerorate.show.live_terminal import LiveTerminal

    console = Console(stderr=True)
    if not console.is_terminal:
        raise UsageFault("--show needs a terminal on stderr")
    return LiveTerminal(console)
