"""Output that commands share: progress bars, and files that are all whole or none."""

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from threading import Thread
from typing import Final, Self, TypeAlias, TypeVar

from zerorate.cli.errors import UsageFault, as_usage, require, writing
from zerorate.cli.options import (
    FigureFormat,
    FigureFormatOption,
    FigurePanels,
    Force,
    LogFormat,
    LogFormatOption,
    NoFigure,
    Output,
    PanelsOption,
)
from zerorate.io.formats import FORMATS
from zerorate.progress import Progress, silent
from zerorate.record import atomic_path, check_writable
from zerorate.record.atomic import sweep

_Format = TypeVar("_Format", bound=StrEnum)
Writer: TypeAlias = Callable[[Path], object]
"""Writes a file of this name."""


@dataclass(frozen=True)
class Destination:
    """Where ``-o`` puts the files of a command, which share a name but for what ends it.

    Attributes
    ----------
    base : Path
        The files without their suffixes.
    named : str
        Suffix of the file that was named, without its dot; empty where that was a folder.
    """

    base: Path
    named: str

    @classmethod
    def of(cls, output: str, usual: str, suffixes: Iterable[str]) -> Self:
        """Return the destination; a usage fault for a file that the command does not write.

        A folder that exists is one, and so is what ends as one or in no suffix of a file.

        Parameters
        ----------
        output : str
            What was typed.
        usual : str
            Name of the files in a folder.
        suffixes : iterable of str
            Those that the command writes, without dots.
        """
        path, known = Path(output), list(suffixes)
        suffix = path.suffix.lower().removeprefix(".")
        if output.endswith((os.sep, "/")) or path.is_dir() or suffix not in (*known, *_FOREIGN):
            return cls(path / usual, "")
        if suffix not in known:
            raise UsageFault(f"-o takes a folder, or a file as {', '.join(known)}, got '{output}'")
        return cls(path.with_suffix(""), suffix)

    def choose(self, option: str, given: _Format | None, usual: _Format) -> _Format:
        """Return the format by the file that was named, by the option, or the usual one."""
        formats = {str(one): one for one in type(usual)}
        by_name = formats.get(self.named)
        if given is not None and by_name not in (None, given):
            raise UsageFault(f"-o names a file as {by_name}, but {option} says {given}")
        return by_name or given or usual

    def of_part(self, ending: str) -> Self:
        """Return where the files of a part of the log go, whose names end so."""
        return replace(self, base=self.file(ending))

    def files(
        self, first: str, beside: Iterable[str], figures: Iterable[str], force: bool
    ) -> "Outputs":
        """Return the files of these endings."""
        others, drawn = (tuple(map(self.file, endings)) for endings in (beside, figures))
        return Outputs(self.file(first), drawn, force, others)

    def file(self, ending: str) -> Path:
        """Return the file of this ending."""
        return Path(f"{self.base}{ending}")


def own_names(logs: Sequence[Path]) -> list[str]:
    """Return what the files of each log begin with; a usage fault where two would be the same."""
    stems = [log.stem for log in logs]
    names = [
        stem if stems.count(stem) == 1 else f"{log.absolute().parent.name}-{stem}"
        for log, stem in zip(logs, stems, strict=True)
    ]
    if len(set(names)) < len(names):
        raise UsageFault("two logs have one name: give each once, or copies of other names")
    return names


_FOREIGN: Final = (
    *(suffix.removeprefix(".") for one in FORMATS for suffix in one.suffixes),
    *("html", "json", "pdf", "png", "svg", "xls", "xlsx", "yaml"),
)


def check_outputs(
    paths: Sequence[Path], force: bool, log: Path | None = None, *read: Path | None
) -> None:
    """Raise a usage fault if a file cannot be written; remove what killed runs left there.

    What a command reads, its `log` and the other files `read`, it does not replace.
    """
    with as_usage():
        for path in paths:
            if _is_one(path, log):
                raise UsageFault(f"-o names the log itself: {path}")
            if any(_is_one(path, source) for source in read):
                raise UsageFault(f"{path} is read as well, and is not replaced: give another -o")
            check_writable(path, force, make_folders=True)
    sweep(paths)


def _is_one(path: Path, source: Path | None) -> bool:
    """Return whether a file to be written is one that is read, by whatever name."""
    return source is not None and path.exists() and source.exists() and path.samefile(source)


def make_folders(paths: Iterable[Path]) -> None:
    """Make the folders of files that are to be written, as far as they are missing."""
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)


@contextmanager
def together(paths: Sequence[Path], force: bool) -> Iterator[list[Path]]:
    """Yield temporary names, which get the files' names once all of them are written."""
    make_folders(paths)
    with ExitStack() as stack:
        # Left in reverse order, so the first file is the last to appear.
        yield [stack.enter_context(atomic_path(path, force)) for path in paths]


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
class Outputs:
    """A log or what else a command is about, what is written beside it, and figures; all or none.

    Attributes
    ----------
    log : Path
        The first file.
    figures : tuple of Path
        The figures.
    force : bool
        Whether files that exist are replaced.
    beside : tuple of Path
        Further files.
    """

    log: Path
    figures: tuple[Path, ...]
    force: bool
    beside: tuple[Path, ...] = ()

    @property
    def paths(self) -> list[Path]:
        """The files to write."""
        return [self.log, *self.beside, *self.figures]

    def write(
        self,
        writers: Sequence[Writer],
        draw: Writer | Sequence[Writer],
        progress: Progress,
        done: float = 0.0,
    ) -> None:
        """Draw the figures while another thread writes the others; rename when all are whole.

        Parameters
        ----------
        writers : sequence of callable
            Of the log, and of each file beside it.
        draw : callable or sequence of callable
            Of the figure, or of each.
        progress : callable
            As of `progress_bar`.
        done : float
            Fraction that was done before.
        """
        draws = [draw] if callable(draw) else draw
        with (
            writing(),
            together(self.paths, self.force) as temporary,
            ThreadPoolExecutor(1) as executor,
        ):
            others = 1 + len(self.beside)
            pairs = zip(writers, temporary[:others], strict=True)
            jobs = [executor.submit(write, path) for write, path in pairs]
            for one, path in zip(draws, temporary[others:], strict=False):
                progress("drawing", done)
                one(path)
            progress("writing", 0.9)
            for job in jobs:
                job.result()


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
        figures = () if self.no_figure else FigureFormat
        return Destination.of(self.output, usual, [*LogFormat, *further, *figures])

    def at(self, place: Destination, beside: Sequence[str] = ()) -> Outputs:
        """Return the files, after checking that what they need is there.

        Those beside are given by their suffixes, without dots.
        """
        chosen = place.choose("--format", self.format, LogFormat.parquet)
        if chosen is LogFormat.parquet:
            require("pyarrow", "io")
        drawn = []
        if not self.no_figure:
            require("matplotlib", "plot")
            drawn = [place.choose("--figure-format", self.figure_format, FigureFormat.png)]
        others, figures = ([f".{one}" for one in some] for some in (beside, drawn))
        return place.files(f".{chosen}", others, figures, self.force)

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


def text_writer(text: str) -> Writer:
    """Return what writes a text into a file."""
    return lambda path: path.write_text(text, encoding="utf-8", newline="\n")
