"""The files of a replay: a filtered log and a figure, both whole or neither."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from zerorate.cli.faults import as_usage, require, writing
from zerorate.cli.options import FigureFormat, LogFormat
from zerorate.io import atomic_path, check_writable, write_log
from zerorate.run.replay import Replay
from zerorate.run.replay.workers import Progress

__all__ = ["Outputs", "together"]


@dataclass(frozen=True)
class Outputs:
    """Where a replay's files go; `figure` is None for none."""

    log: Path
    figure: Path | None
    force: bool

    @classmethod
    def of(
        cls,
        folder: Path,
        stem: str,
        log_format: LogFormat,
        figure_format: FigureFormat | None,
        force: bool,
    ) -> "Outputs":
        """Return the files, after checking that they can be written and drawn."""
        base = folder / f"{stem}-zerorate"
        figure = None if figure_format is None else Path(f"{base}.{figure_format.value}")
        outputs = cls(Path(f"{base}.{log_format.value}"), figure, force)
        outputs._check(log_format)
        return outputs

    @property
    def paths(self) -> list[Path]:
        """The files to write."""
        return [self.log] if self.figure is None else [self.log, self.figure]

    def write(self, result: Replay, progress: Progress) -> None:
        """Draw the figure while another thread writes the log; rename when both are whole."""
        with (
            writing(),
            together(self.paths, self.force) as temporary,
            ThreadPoolExecutor(1) as executor,
        ):
            job = executor.submit(
                write_log, result.filtered_log, temporary[0], beside=result.beside
            )
            if self.figure is not None:
                progress("drawing", 0.0)
                _draw(result, temporary[1])
            progress("writing", 0.9)
            job.result()

    def _check(self, log_format: LogFormat) -> None:
        if log_format is LogFormat.parquet:
            require("pyarrow", "io")
        if self.figure is not None:
            require("matplotlib", "plot")
        with as_usage():
            for path in self.paths:
                check_writable(path, self.force)


@contextmanager
def together(paths: list[Path], force: bool) -> Iterator[list[Path]]:
    """Yield temporary names, which get the files' names once all of them are written."""
    with ExitStack() as stack:
        # Left in reverse order, so the first file is the last to appear.
        yield [stack.enter_context(atomic_path(path, force)) for path in paths]


def _draw(result: Replay, path: Path) -> None:
    from zerorate.show import plot_replay, save_figure

    save_figure(plot_replay(result), path)
