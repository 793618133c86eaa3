"""Files of a result, named after its log; all are written, or none.

`save` writes the same files as the corresponding command with ``-o``.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol, Self, TypeAlias

from zerorate.faults import bare_argument, keyword_argument, make_sentence
from zerorate.io.formats import FORMATS
from zerorate.progress import Progress, report_nothing
from zerorate.record.atomic import atomic_path, check_writable, remove_leftovers
from zerorate.tasks.source import stem_of
from zerorate.texts import describe_missing_extra
from zerorate.views import FigureError, is_undrawn, report_figure_faults, save_figure

Writer: TypeAlias = Callable[[Path], object]
"""Function that writes a file with this path."""

LOG_FORMATS: Final = ("parquet", "csv", "npz", "mcap", "gcsv")
"""Formats of a log, by suffix; the first is the default."""

FIGURE_FORMATS: Final = ("png", "svg", "pdf")
"""Formats of a figure; the first is the default."""

_OTHER_SUFFIXES: Final = (
    *(suffix.removeprefix(".") for one in FORMATS for suffix in one.suffixes),
    *("html", "json", "pdf", "png", "svg", "xls", "xlsx", "yaml"),
)


class SavableResult(Protocol):
    """Result that can be saved; it needs the name of its recording."""

    @property
    def source(self) -> str:
        """Name of the recording."""


class Files(NamedTuple):
    """Files of a result.

    Attributes
    ----------
    ending : str
        Ending of the file names, after the name of the log: ``-zerorate-attitude``.
    first : str
        Suffix of the first file, with its dot; "" if its format can be chosen.
    data : sequence of Writer
        Writers of the first file and of the others.
    others : sequence of str
        Endings of the other files' names, with suffixes. An ending with a final dot is a log in the
        format of the first file.
    figures : mapping of str to Writer
        Writers of the figures, by the ending of the name before the suffix.
    stem : str
        Beginning of the file names; "" for the name of the source.
    formats : sequence of str
        Suffixes of the possible formats of the first file; the first is the default.
    """

    ending: str
    first: str
    data: Sequence[Writer]
    others: Sequence[str]
    figures: Mapping[str, Writer]
    stem: str = ""
    formats: Sequence[str] = LOG_FORMATS

    def in_format(self, format: str) -> Files:
        """Return the files with this format for all logs."""
        ends = [f"{end}{format}" if end.endswith(".") else end for end in self.others]
        return self._replace(others=ends)


_FILES: Final[dict[str, str]] = {
    "attitude.estimate.AttitudeEstimate": "zerorate.tasks.attitude:files_of",
    "foot.foot.FootTrack": "zerorate.tasks.walk:files_of",
    "calibration.calibration.Calibration": "zerorate.tasks.calibrate:files_of",
    "calibration.magnetometer.MagnetometerCalibration": (
        "zerorate.tasks.calibrate:magnetometer_files"
    ),
    "findings.before_after.BeforeAfter": "zerorate.tasks.report:files_of",
    "findings.report.Report": "zerorate.tasks.report:files_of",
    "tasks.batch.run.BatchResult": "zerorate.tasks.batch.run:files_of",
    "tasks.calibrate.Corrected": "zerorate.tasks.calibrate:corrected_files",
    "tasks.array.ArrayReplay": "zerorate.tasks.array:files_of",
    "tasks.characterise.Characterised": "zerorate.tasks.characterise:files_of",
    "tasks.compare.task.Compared": "zerorate.tasks.compare.task:files_of",
    "tasks.identify.Identified": "zerorate.tasks.identify:files_of",
    "tasks.navigate.Navigation": "zerorate.tasks.navigate:files_of",
    "tasks.replay.result.Replay": "zerorate.tasks.replay.task:files_of",
}
"""Names of the functions that return a result's files, by the class of the result."""


def files_of(result: object, **choices: object) -> Files:
    """Return the files of a result; TypeError if its class cannot be saved."""
    for base in type(result).__mro__:
        name = f"{base.__module__}.{base.__qualname__}".removeprefix("zerorate.")
        if name in _FILES:
            module, _, function = _FILES[name].partition(":")
            files: Files = getattr(import_module(module), function)(result, **choices)
            return files
    raise TypeError(f"a {type(result).__name__} is not saved in files")


def save(
    result: SavableResult,
    output: str | os.PathLike[str] = ".",
    *,
    force: bool = False,
    figure: bool = True,
    format: str | None = None,
    figure_format: str | None = None,
    **choices: Any,  # noqa: ANN401
) -> list[Path]:
    """Write all files of a result; see `zerorate.views.Result.save`."""
    files = files_of(result, **choices)
    stem = files.stem or stem_of(result.source)
    destination = Destination.of(os.fspath(output), stem + files.ending, _possible_suffixes(files))
    suffix = files.first or "." + destination.choose("format", format, files.formats)
    figures = files.figures if figure else {}
    figure_suffix = (
        destination.choose("figure_format", figure_format, FIGURE_FORMATS) if figures else ""
    )
    others = files.in_format(suffix[1:]).others
    outputs = destination.files(
        suffix, others, [f"{end}.{figure_suffix}" for end in figures], force
    )
    check_paths(outputs.paths, force)
    outputs.write(files.data, list(figures.values()), report_nothing)
    return outputs.paths


def _possible_suffixes(files: Files) -> list[str]:
    """Return the possible suffixes of a result's files, without dots."""
    first = files.formats if not files.first else (files.first[1:],)
    others = (ending.rpartition(".")[2] for ending in files.others)
    return [*first, *filter(None, others), *FIGURE_FORMATS]


@dataclass(frozen=True)
class Destination:
    """Destination of a result's files; their names differ only in their endings.

    Attributes
    ----------
    base : Path
        Common path of the files, without their endings.
    named_suffix : str
        Suffix of the named file, without its dot; empty if a folder was named.
    """

    base: Path
    named_suffix: str

    @classmethod
    def of(cls, output: str, default_name: str, suffixes: Iterable[str]) -> Self:
        """Return the destination for an output option.

        An output is a folder if it exists as a folder, ends with a slash, or has no file suffix.

        Parameters
        ----------
        output : str
            Folder, or name of one file.
        default_name : str
            Name of the files in a folder.
        suffixes : iterable of str
            Suffixes of the written files, without dots.

        Raises
        ------
        ValueError
            If a named file has another suffix.
        """
        path, allowed = Path(output), list(suffixes)
        suffix = path.suffix.lower().removeprefix(".")
        if (
            output.endswith((os.sep, "/"))
            or path.is_dir()
            or suffix not in (*allowed, *_OTHER_SUFFIXES)
        ):
            return cls(path / default_name, "")
        if suffix not in allowed:
            listed = ", ".join(dict.fromkeys(allowed))
            raise ValueError(
                make_sentence(_OUTPUT, f" takes a folder, or a file as {listed}, got '{output}'")
            )
        return cls(path.with_suffix(""), suffix)

    def choose(self, option: str, requested: str | None, formats: Sequence[str]) -> str:
        """Return the format from the named file, else from the option, else the default."""
        by_name = self.named_suffix if self.named_suffix in formats else None
        if requested is not None and by_name not in (None, requested):
            raise ValueError(
                make_sentence(
                    _OUTPUT,
                    f" names a file as {by_name}, but ",
                    bare_argument(option),
                    f" says {requested}",
                )
            )
        return by_name or requested or formats[0]

    def of_part(self, ending: str) -> Self:
        """Return the destination for a part of the log; `ending` is added to the names."""
        return replace(self, base=self.file(ending))

    def files(
        self, first: str, others: Iterable[str], figures: Iterable[str], force: bool
    ) -> Outputs:
        """Return the files with these endings."""
        further, drawn = (tuple(map(self.file, endings)) for endings in (others, figures))
        return Outputs(self.file(first), drawn, force, further)

    def file(self, ending: str) -> Path:
        """Return the file with this ending."""
        return Path(f"{self.base}{ending}")


_OUTPUT: Final = keyword_argument("destination", "", "output")


@dataclass(frozen=True)
class Outputs:
    """Files of a result: the first, others, and figures. Either all or none are written.

    Attributes
    ----------
    log : Path
        The first file.
    figures : tuple of Path
        The figures.
    force : bool
        Replace files that exist.
    others : tuple of Path
        Further files.
    """

    log: Path
    figures: tuple[Path, ...]
    force: bool
    others: tuple[Path, ...] = ()

    @property
    def paths(self) -> list[Path]:
        """The files to write."""
        return [self.log, *self.others, *self.figures]

    @property
    def written(self) -> list[Path]:
        """Files to write, without figures that could not be drawn."""
        return [path for path in self.paths if not is_undrawn(path)]

    def save(self, files: Files, progress: Progress, done: float = 0.0) -> list[Path]:
        """Write the files of a result and return their paths; see `write`.

        Files that the result does not have, such as exports of doubtful numbers, are not written.
        """
        present = tuple(
            ending for ending in self.others if str(ending).endswith(tuple(files.others))
        )
        outputs = replace(self, others=present)
        outputs.write(files.data, list(files.figures.values())[: len(self.figures)], progress, done)
        return outputs.written

    def write(
        self,
        writers: Sequence[Writer],
        draw: Writer | Sequence[Writer],
        progress: Progress,
        done: float = 0.0,
    ) -> None:
        """Draw the figures while another thread writes the data.

        Parameters
        ----------
        writers : sequence of callable
            Writers of the first file, and of each other file.
        draw : callable or sequence of callable
            Function that draws the figure, or one for each figure.
        progress : callable
            Called with the name of the step and the fraction done.
        done : float
            Fraction done before this step.

        Raises
        ------
        OSError
            If a file exists (without `force`) or cannot be written.
        FigureError
            If a figure cannot be drawn; all other files are written.
        """
        draws = [draw] if callable(draw) else draw
        # Once: a folder that goes away while the files are written is not made again.
        make_folders(self.paths)
        # Figures are renamed after the data: without data, no figure appears.
        with ThreadPoolExecutor(1) as executor, ExitStack() as drawn:
            data = executor.submit(self._write_data, writers)
            faults = []
            for draw_figure, path in zip(draws, self.figures, strict=False):
                progress("drawing", done)
                try:
                    with ExitStack() as one:
                        draw_figure(*one.enter_context(_temporary_paths([path], self.force)))
                        drawn.push(one.pop_all())
                except (ImportError, FileExistsError):
                    raise
                except Exception as error:  # the data are kept if a figure fails
                    faults.append(FigureError(path, error))
            progress("writing", 0.9)
            data.result()
        report_figure_faults(faults)

    def _write_data(self, writers: Sequence[Writer]) -> None:
        with _temporary_paths([self.log, *self.others], self.force) as temporary:
            for write, path in zip(writers, temporary, strict=True):
                write(path)


def check_paths(
    paths: Sequence[Path], force: bool, log: Path | None = None, *read: Path | None
) -> None:
    """Check that files can be written, and remove the temporary files of killed runs.

    Parameters
    ----------
    paths : sequence of Path
        The files.
    force : bool
        Replace existing files.
    log, *read : Path, optional
        Files that are also read and must not be replaced.

    Raises
    ------
    ValueError
        If a file to write is also read.
    OSError
        If a file cannot be written.
    """
    for path in paths:
        if _is_same_file(path, log):
            raise ValueError(make_sentence(_OUTPUT, f" names the log itself: {path}"))
        if any(_is_same_file(path, source) for source in read):
            raise ValueError(
                make_sentence(
                    f"{path} is read as well, and is not replaced: give another ", _OUTPUT
                )
            )
        check_writable(path, force, make_folders=True)
    remove_leftovers(paths)


def _is_same_file(path: Path, source: Path | None) -> bool:
    """Return True if a file to write is also read, possibly by another name."""
    return source is not None and path.exists() and source.exists() and path.samefile(source)


def make_folders(paths: Iterable[Path]) -> None:
    """Make the missing folders of files to write."""
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)


@contextmanager
def atomic_paths(paths: Sequence[Path], force: bool) -> Iterator[list[Path]]:
    """Make folders, yield temporary paths; rename them to the files when all are written."""
    make_folders(paths)
    with _temporary_paths(paths, force) as temporary:
        yield temporary


@contextmanager
def _temporary_paths(paths: Sequence[Path], force: bool) -> Iterator[list[Path]]:
    """Yield temporary paths in folders that exist; rename them when all are written."""
    with ExitStack() as stack:
        # Exit in reverse order, so the first file appears last.
        yield [stack.enter_context(atomic_path(path, force)) for path in paths]


def text_writer(text: str) -> Writer:
    """Return a function that writes a text into a file."""
    return lambda path: path.write_text(text, encoding="utf-8", newline="\n")


def figure_writer(draw: Callable[[], Any]) -> Writer:
    """Return a function that writes a figure into a file; ImportError without matplotlib."""

    def write(path: Path) -> None:
        if find_spec("matplotlib") is None:
            raise ImportError(describe_missing_extra("matplotlib", "plot"))
        save_figure(draw(), path)

    return write
