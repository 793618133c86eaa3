"""What a command shows and writes: progress bars, files that are all whole or none, their names."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Thread

from zerorate.cli.errors import as_usage
from zerorate.io import atomic_path, check_writable
from zerorate.io.atomic import sweep
from zerorate.progress import Progress, silent

__all__ = [
    "check_outputs",
    "counting_bar",
    "preloaded",
    "print_written",
    "progress_bar",
    "together",
]


def check_outputs(paths: Sequence[Path], force: bool) -> None:
    """Raise a usage fault if a file cannot be written; remove what killed runs left of them."""
    with as_usage():
        for path in paths:
            check_writable(path, force)
    sweep(paths)


@contextmanager
def together(paths: Sequence[Path], force: bool) -> Iterator[list[Path]]:
    """Yield temporary names, which get the files' names once all of them are written."""
    with ExitStack() as stack:
        # Left in reverse order, so the first file is the last to appear.
        yield [stack.enter_context(atomic_path(path, force)) for path in paths]


def print_written(paths: Sequence[Path]) -> None:
    """Print which files were written, after an empty line."""
    print()
    for path in paths:
        print(f"wrote {path}")


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


def preloaded(load: Callable[[], object]) -> None:
    """Begin to import what is needed later; if that fails, the later import says so."""
    Thread(target=_quietly, args=(load,), daemon=True).start()


def _quietly(load: Callable[[], object]) -> None:
    try:
        load()
    except ImportError:
        return
