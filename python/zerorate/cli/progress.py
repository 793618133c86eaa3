"""A progress bar on stderr, where that is a terminal."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from zerorate.run.replay.workers import Progress, silent

__all__ = ["counting_bar", "progress_bar"]


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Yield a function of the step's name and the fraction of it that is done."""
    if not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:10}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading", total=1.0)
        yield lambda step, fraction: bar.update(task, description=step, completed=fraction)


@contextmanager
def counting_bar(things: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a function of how many things are through and how many there are to do."""
    if not sys.stderr.isatty():
        yield lambda through, all_of_them: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        MofNCompleteColumn(),
        TextColumn(things),
        BarColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(things, total=None, rate="")

        def show(through: int, all_of_them: int) -> None:
            seconds = bar.tasks[0].elapsed
            rate = f"{through / seconds:.1f}/s" if seconds else ""
            bar.update(task, completed=through, total=all_of_them, rate=rate)

        yield show
