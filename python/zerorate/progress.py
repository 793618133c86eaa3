"""Progress of long work, reported to a callable or shown as a bar in a notebook."""

from __future__ import annotations

import sys
from collections.abc import Callable
from html import escape
from time import monotonic
from typing import Any, Final

__all__ = ["Counter", "Progress", "choose_counter", "choose_reporter", "report_nothing"]

Progress = Callable[[str, float], None]
"""Callable that takes the name of the step and the fraction done."""

Counter = Callable[[int, int], None]
"""Callable that takes the number of items done and the number of all items."""

_BAR_DELAY_S: Final = 1.0
"""Time before a bar is shown, s; shorter work has no bar."""
_REDRAW_INTERVAL_S: Final = 0.2
"""Shortest time between two updates of the bar, s."""


def report_nothing(step: str, fraction: float) -> None:
    """Do nothing with the progress."""


def choose_reporter(progress: Progress | None) -> Progress:
    """Return the caller's reporter; by default a bar in a notebook, elsewhere no report."""
    if progress is not None:
        return progress
    return _Bar() if _in_notebook() else report_nothing


def choose_counter(progress: Counter | None) -> Counter:
    """Return the caller's counter; by default a bar in a notebook, elsewhere no report."""
    if progress is not None:
        return progress
    report = choose_reporter(None)
    return lambda through, all_of_them: report(
        f"{through} of {all_of_them}", through / max(all_of_them, 1)
    )


def _in_notebook() -> bool:
    """Return True in a notebook; IPython is not imported for this test."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return getattr(shell, "kernel", None) is not None


class _Bar:
    """A progress bar in a notebook, shown only for long work and removed at the end."""

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
        """Remove the bar when the work no longer refers to it."""
        if self._handle is not None:
            self._show("")
