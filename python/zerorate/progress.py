"""Progress of long work: reported to a caller's function, or in a notebook by a bar."""

from __future__ import annotations

import sys
from collections.abc import Callable
from html import escape
from time import monotonic
from typing import Any, Final

__all__ = ["Counter", "Progress", "choose_counter", "choose_reporter", "report_nothing"]

Progress = Callable[[str, float], None]
"""Called with the step's name and the fraction of it that is done."""

Counter = Callable[[int, int], None]
"""Called with how many things are through, and how many there are."""

_BAR_DELAY_S: Final = 1.0
"""Seconds of work that need no bar."""
_REDRAW_INTERVAL_S: Final = 0.2
"""Seconds between two drawings of it."""


def report_nothing(step: str, fraction: float) -> None:
    """Report nothing."""


def choose_reporter(progress: Progress | None) -> Progress:
    """Return the caller's reporter, or else a bar in a notebook, or one that does nothing."""
    if progress is not None:
        return progress
    return _Bar() if _in_notebook() else report_nothing


def choose_counter(progress: Counter | None) -> Counter:
    """Return the caller's counter, or else a bar in a notebook, or one that does nothing."""
    if progress is not None:
        return progress
    report = choose_reporter(None)
    return lambda through, all_of_them: report(
        f"{through} of {all_of_them}", through / max(all_of_them, 1)
    )


def _in_notebook() -> bool:
    """Return True if there is a kernel that shows output; nothing is imported for it."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return getattr(shell, "kernel", None) is not None


class _Bar:
    """A bar in a notebook, shown of work that lasts, and taken away when it is done."""

    def __init__(self) -> None:
        self._start_time = self._last_draw_time = monotonic()
        self._handle: Any = None

    def __call__(self, step: str, fraction: float) -> None:
        now = monotonic()
        if now - self._start_time < _BAR_DELAY_S or (
            now - self._last_draw_time < _REDRAW_INTERVAL_S and fraction < 1.0
        ):
            return
        self._last_draw_time = now
        self._show(
            f'<progress max="1" value="{fraction:.3f}"></progress> {escape(step)}'
            f" {100.0 * fraction:.0f} %"
        )

    def _show(self, text: str) -> None:
        from IPython.display import HTML, display  # type: ignore[import-not-found]

        if self._handle is None:
            self._handle = display(HTML(text), display_id=True)
        else:
            self._handle.update(HTML(text))

    def __del__(self) -> None:
        """Take the bar away: whoever reported to it has returned."""
        if self._handle is not None:
            self._show("")
