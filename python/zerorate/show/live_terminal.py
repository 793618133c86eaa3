"""Live stream in a terminal: rates, biases and angles, redrawn ten times a second."""

import math
from collections import deque
from collections.abc import Sequence
from time import monotonic
from typing import Final, Self

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from zerorate.tasks.live.view import View
from zerorate.texts import escape_line

_REDRAW_PERIOD_S: Final = 0.1
_BAR_LETTERS: Final = "▁▂▃▄▅▆▇█"
_HISTORY_VIEWS: Final = 60
_ANGLE_NAMES: Final = ("roll", "pitch", "yaw")


class LiveTerminal:
    """Display of views on a console, until it is closed.

    Parameters
    ----------
    console : Console
        Terminal. Text printed on it meanwhile appears above the display.
    """

    def __init__(self, console: Console) -> None:
        self._live = Live(console=console, auto_refresh=False, transient=False)
        self._past: deque[View] = deque(maxlen=_HISTORY_VIEWS)
        self._next = -math.inf

    def __enter__(self) -> Self:
        """Start to draw."""
        self._live.start()
        return self

    def __exit__(self, *fault: object) -> None:
        """Stop drawing; the last view stays visible."""
        if self._past:
            self._live.update(render_views(self._past), refresh=True)
        self._live.stop()

    def put(self, view: View) -> None:
        """Draw a view, unless the last drawing was too recent."""
        self._past.append(view)
        now = monotonic()
        if now >= self._next:
            self._next = now + _REDRAW_PERIOD_S
            self._live.update(render_views(self._past), refresh=True)


def render_views(past: Sequence[View]) -> Group:
    """Return the last view, with its history."""
    last = past[-1]
    unit = last.unit or "unit of the samples"
    table = Table(box=None, pad_edge=False)
    table.add_column("")
    table.add_column(Text(f"rate, {unit}"), justify="right")
    table.add_column(f"last {len(past)} views")
    table.add_column("bias", justify="right")
    table.add_column("±", justify="right")
    for i, name in enumerate(last.names):
        rates = [view.rate[i] for view in past]
        numbers = (last.rate[i], last.bias[i], last.bias_sigma[i])
        rate, bias, sigma = (_format_number(x) for x in numbers)
        table.add_row(Text(escape_line(name)), rate, format_bars(rates), bias, sigma)
    head = Text(f"{last.seconds:.1f} s  {last.status}", style="bold")
    parts: list[Text | Table] = [head, table]
    if last.euler_deg is not None:
        angles = (f"{n} {a:7.1f}°" for n, a in zip(_ANGLE_NAMES, last.euler_deg, strict=True))
        parts.append(Text("  ".join(angles)))
    return Group(*parts)


def format_bars(values: Sequence[float]) -> str:
    """Return numbers as bars between their minimum and maximum; missing numbers are blank."""
    finite = [value for value in values if math.isfinite(value)]
    if not finite:
        return " " * len(values)
    low, span = min(finite), max(finite) - min(finite)
    top = len(_BAR_LETTERS) - 1

    def bar(value: float) -> str:
        if not math.isfinite(value):
            return " "
        return _BAR_LETTERS[round(top * (value - low) / span) if span > 0 else 0]

    return "".join(map(bar, values))


def _format_number(value: float) -> str:
    return f"{value:+.4g}" if math.isfinite(value) else "missing"
