"""Output of a command: progress, results, and files; all files are written, or none."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from typing import Any, TypeVar

from zerorate.cli.errors import UsageFault, as_usage, print_alarms, require
from zerorate.cli.options import FigureFormat, FigurePanels, Force, LogFormat, NoFigure, Output
from zerorate.cli.reading import Reading, Record, records
from zerorate.progress import Progress, report_nothing
from zerorate.tasks.interrupts import run_in_background
from zerorate.tasks.saving import (
    FIGURE_FORMATS,
    LOG_FORMATS,
    Destination,
    Outputs,
    atomic_paths,
    check_paths,
    figure_writer,
    files_of,
)
from zerorate.tasks.source import sensor_ending, unique_stems
from zerorate.views import FigureError, is_undrawn, report_figure_faults

T = TypeVar("T")


def check_outputs(
    paths: Sequence[Path], force: bool, log: Path | None = None, *read: Path | None
) -> None:
    """Raise a usage fault if a file cannot be written, or is also read."""
    with as_usage():
        check_paths(paths, force, log, *read)


def check_panels(panels: FigurePanels, no_figure: bool) -> FigurePanels:
    """Return the panels of a figure; a usage fault for --figure all without a figure."""
    if panels == "all" and no_figure:
        raise UsageFault("--figure all has no effect with --no-figure")
    return panels


def figure_ending(place: Destination, format: str | None, no_figure: bool) -> list[str]:
    """Return the ending of the figure's name, if any; usage fault without matplotlib."""
    if no_figure:
        return []
    require("matplotlib", "plot")
    return [f".{place.choose('figure_format', format, FIGURE_FORMATS)}"]


def log_ending(place: Destination, format: str | None) -> str:
    """Return the format of a log by its suffix; usage fault if it cannot be written."""
    suffix = place.choose("format", format, LOG_FORMATS)
    if suffix == "parquet":
        require("pyarrow", "io")
    return suffix


def run_and_save(
    task: Callable[..., T],
    outputs: Outputs,
    done: float = 0.0,
    **choices: Any,  # noqa: ANN401
) -> tuple[T, list[Path]]:
    """Run a task with a progress bar, and save its result.

    Parameters
    ----------
    task : callable
        Function of `progress` that returns the result. An interrupt abandons it.
    outputs : Outputs
        Files to write.
    done : float
        Fraction of the work before saving.
    **choices
        Arguments of `zerorate.tasks.saving.files_of`.

    Returns
    -------
    result : object
        Result of the task.
    paths : list of Path
        Paths of the written files.
    """
    with progress_bar() as progress:
        result = run_in_background(partial(task, progress=progress))
        return result, outputs.save(files_of(result, **choices), progress, done)


@dataclass(frozen=True)
class Part:
    """A record of a log, and its output files."""

    log: Path
    record: Record
    files: Outputs
    first: bool

    @property
    def name(self) -> str:
        """Title of a part of a log, or name of a whole log."""
        return self.record.title or str(self.log)

    def title(self, several: bool) -> str:
        """Name of the record, with its log's name if there are several logs."""
        return " ".join(filter(None, (str(self.log) if several else "", self.record.title)))

    def run(
        self,
        task: Callable[..., T],
        done: float = 0.0,
        **choices: Any,  # noqa: ANN401
    ) -> tuple[T, list[Path]]:
        """Run a task of the record, save its result as `run_and_save` does, and print the title."""
        result = run_and_save(partial(task, self.record.source), self.files, done, **choices)
        self.print_title()
        return result

    def print_title(self) -> None:
        """Print the source of the following results, if there are several."""
        if self.record.title:
            print(self.record.title if self.first else f"\n{self.record.title}")


def parts_of(
    places: Sequence[tuple[Path, Destination]],
    reading: Reading,
    files: Callable[[Destination], Outputs],
    *read: Path | None,
) -> list[Part]:
    """Return the records of logs with their output files, after a check of these files.

    Parameters
    ----------
    places : sequence of (Path, Destination)
        Logs with the destinations of their files.
    reading : Reading
        Selection of the data to read.
    files : callable
        Function of a record and a destination that returns its files.
    *read : Path, optional
        Further files that are read; they must not be replaced.
    """
    parts: list[Part] = []
    for log, place in places:
        for record in records(log, reading.group_by):
            outputs = files(of_sensor(place.of_part(record.ending), reading))
            parts.append(Part(log, record, outputs, not parts))
    paths = [path for part in parts for path in part.files.paths]
    for log, _ in places:
        check_outputs(paths, parts[0].files.force, log, *read)
    return parts


def of_sensor(place: Destination, reading: Reading) -> Destination:
    """Return the destination for the chosen sensor; its name is added to files in a folder."""
    sensor = reading.arguments.get("sensor")
    return place if place.named_suffix else place.of_part(sensor_ending(sensor))


def places_of_logs(
    logs: Sequence[Path], output: str, ending: str, suffixes: Sequence[str]
) -> list[tuple[Path, Destination]]:
    """Return each log with the destination of its files; usage fault for equal file names.

    `ending` and `suffixes` (without dots) are the ends of file names in a folder.
    """
    names = unique_stems([str(log) for log in logs])
    places = [Destination.of(output, name + ending, suffixes) for name in names]
    if len(places) > 1 and places[0].named_suffix:
        raise UsageFault(f"-o takes a folder for several logs, got '{output}'")
    return list(zip(logs, places, strict=True))


def draw_overlay(results: Any, paths: Sequence[Path], force: bool) -> None:  # noqa: ANN401
    """Draw the results of several logs in one figure."""
    for path in paths:
        try:
            with atomic_paths([path], force) as (temporary,):
                figure_writer(results.plot)(temporary)
        except (ImportError, OSError):
            raise
        except Exception as error:  # the data are kept if the figure fails
            report_figure_faults([FigureError(path, error)])


def print_result(result: Any, paths: Sequence[Path], further: str = "") -> None:  # noqa: ANN401
    """Print alarms, a result and its notes, and the files that were written."""
    print_alarms(result.alarms)
    print(result)
    if further:
        print(further)
    print_written(paths)


def print_written(paths: Sequence[Path]) -> None:
    """Print the written files after an empty line."""
    print()
    for path in paths:
        if not is_undrawn(path):
            print(f"wrote {path}")


def _has_terminal() -> bool:
    """Return True if progress can be drawn on stderr."""
    return sys.stderr.isatty() and find_spec("rich") is not None


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Yield a function of the step's name and the fraction done."""
    if not _has_terminal():
        yield report_nothing
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:10}", markup=False), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading", total=1.0)
        yield lambda step, fraction: bar.update(task, description=step, completed=fraction)


@contextmanager
def counting_bar(things: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a function of the numbers of finished and of all items."""
    if not _has_terminal():
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
        TextColumn(things, markup=False),
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
    """Start to import a module of `zerorate.show` for a figure while a log is read.

    An error is raised by the later import.
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
    """Options for the destination of a log and its figure."""

    output: Output = "."
    format: LogFormat = None
    figure_format: FigureFormat = None
    no_figure: NoFigure = False
    force: Force = False

    def suffixes(self, *further: str) -> list[str]:
        """Return the suffixes of the files, without dots."""
        return [*LOG_FORMATS, *further, *(() if self.no_figure else FIGURE_FORMATS)]

    def place(self, usual: str, *further: str) -> Destination:
        """Return the destination of files with a default name and suffixes.

        Raises a usage fault for a file that the command does not write.
        """
        return Destination.of(self.output, usual, self.suffixes(*further))

    def at(self, place: Destination, others: Sequence[str] = ()) -> Outputs:
        """Return the files after a check of their requirements.

        `others` are the ends of further files' names.
        """
        log = log_ending(place, self.format)
        figures = figure_ending(place, self.figure_format, self.no_figure)
        return place.files(f".{log}", others, figures, self.force)

    def preload(self, module: str) -> None:
        """Start to import the module of the figure, if one is drawn."""
        if not self.no_figure:
            preload_figure(module)


@dataclass(frozen=True)
class LogAndPanels(LogAndFigure):
    """Destination of a log and of a figure with a choice of panels."""

    figure: FigurePanels = "usual"

    @property
    def panels(self) -> FigurePanels:
        """Panels of the figure; a usage fault without a figure."""
        return check_panels(self.figure, self.no_figure)
