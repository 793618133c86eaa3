"""Output that commands share: progress bars, and files that are all whole or none."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from threading import Thread

from zerorate.cli.errors import UsageFault, as_usage, require
from zerorate.cli.options import (
    FigureFormatOption,
    FigurePanels,
    Force,
    LogFormatOption,
    NoFigure,
    Output,
    PanelsOption,
)
from zerorate.progress import Progress, silent
from zerorate.tasks.saving import (
    FIGURE_FORMATS,
    LOG_FORMATS,
    Destination,
    Outputs,
    check_paths,
)
from zerorate.tasks.source import own_names as names_of


def own_names(logs: Sequence[Path]) -> list[str]:
    """Return what the files of each log begin with; a usage fault where two would be the same."""
    return names_of([str(log) for log in logs])


def check_outputs(
    paths: Sequence[Path], force: bool, log: Path | None = None, *read: Path | None
) -> None:
    """Raise a usage fault if a file cannot be written, or is one that is read."""
    with as_usage():
        check_paths(paths, force, log, *read)


def all_panels(panels: FigurePanels, draws: bool) -> bool:
    """Return whether a figure has all its panels; a usage fault where none is drawn."""
    if panels is FigurePanels.usual:
        return False
    if not draws:
        raise UsageFault("--figure all has no effect with --no-figure")
    return True


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


def preload_figure(module: str, svg: bool = False) -> None:
    """Begin to import what draws a figure, a module of `zerorate.show`, while a log is read.

    If that fails, the later import says so.
    """
    names = ["matplotlib.backends.backend_agg", "matplotlib.figure", f"zerorate.show.{module}"]
    if svg:
        names.insert(1, "matplotlib.backends.backend_svg")
    Thread(target=_quietly, args=(names,), daemon=True).start()


def _quietly(modules: Sequence[str]) -> None:
    with suppress(ImportError):
        for name in modules:
            import_module(name)


@dataclass(frozen=True)
class LogAndFigure:
    """Where a command puts a log and its figure, as it is typed: a group of options."""

    output: Output = "."
    format: LogFormatOption = None
    figure_format: FigureFormatOption = None
    no_figure: NoFigure = False
    force: Force = False

    def place(self, usual: str, *further: str) -> Destination:
        """Return the destination of files that are usually called so, some with further suffixes.

        Raises a usage fault for a file that the command does not write.
        """
        figures = () if self.no_figure else FIGURE_FORMATS
        return Destination.of(self.output, usual, [*LOG_FORMATS, *further, *figures])

    def at(self, place: Destination, others: Sequence[str] = ()) -> Outputs:
        """Return the files, after checking that what they need is there.

        Others than the log and its figure are given by their suffixes, without dots.
        """
        chosen = place.choose("format", self.format, LOG_FORMATS)
        if chosen == "parquet":
            require("pyarrow", "io")
        drawn = []
        if not self.no_figure:
            require("matplotlib", "plot")
            drawn = [place.choose("figure_format", self.figure_format, FIGURE_FORMATS)]
        further, figures = ([f".{one}" for one in some] for some in (others, drawn))
        return place.files(f".{chosen}", further, figures, self.force)

    def preload(self, module: str) -> None:
        """Begin to import what draws the figure, if there is one."""
        if not self.no_figure:
            preload_figure(module)


@dataclass(frozen=True)
class LogAndPanels(LogAndFigure):
    """The same where the figure may have all its panels."""

    figure: PanelsOption = FigurePanels.usual

    @property
    def everything(self) -> bool:
        """Whether it has all of them; a usage fault where none is drawn."""
        return all_panels(self.figure, not self.no_figure)
