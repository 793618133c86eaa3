"""A recording through the filters and into a file, no more than some blocks of it in memory."""

from collections.abc import Sequence
from pathlib import Path
from typing import Unpack

from zerorate.io import atomic_path, write_log
from zerorate.io.logfile import LogFile
from zerorate.io.parquet import TIME_NAME, RowGroups, about
from zerorate.io.writing import column_names
from zerorate.run.replay.block import Block
from zerorate.run.replay.columns import beside, beside_names, compensated
from zerorate.run.replay.filters import Filters
from zerorate.run.replay.measure import Measures
from zerorate.run.replay.passes import FilterOptions
from zerorate.run.replay.pipeline import ROWS, drive, summed_up
from zerorate.run.replay.result import Output, Summary
from zerorate.run.replay.run import replay
from zerorate.run.replay.workers import Progress, silent

__all__ = ["replay_to_file"]


def replay_to_file(
    recording: LogFile,
    path: Path,
    *,
    methods: Sequence[str] = ("kf", "akf", "fading", "auto"),
    output: Output | None = None,
    horizons: Sequence[float] = (10.0, 60.0),
    force: bool = False,
    progress: Progress | None = None,
    rows: int = ROWS,
    **options: Unpack[FilterOptions],
) -> Summary:
    """Filter a recording block by block and write the filtered log.

    Scores and bytes are those that `replay` and `write_log` give of the same log in memory. Its
    length does not matter here, if it is written as Parquet; other formats are made in memory.

    Parameters
    ----------
    recording : LogFile
        As of `zerorate.io.open_log`.
    path : Path
        The file to write, whole or not at all.
    methods, output, horizons, progress, **options
        As of `replay`.
    force : bool
        Whether to replace an existing file; default no.
    rows : int
        Samples of a block; the results do not depend on it.

    Returns
    -------
    Summary
        All that `replay` says but for the series themselves.

    Raises
    ------
    LogError
        If the file cannot be read to its end, or no axis holds a sample.
    ValueError
        If a method or an argument is not valid.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from zerorate import Log, write_log
    >>> from zerorate.io import open_log
    >>> folder = Path(tempfile.mkdtemp())
    >>> z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal(6000)
    >>> write_log(Log(np.arange(6000) / 100.0, 100.0, z, ["gyro_z"]), folder / "raw.parquet")
    >>> recording = open_log(folder / "raw.parquet")
    >>> summary = replay_to_file(recording, folder / "filtered.parquet", methods=["auto"])
    >>> summary.header.n, [score.method for score in summary.scores]
    (6000, ['raw', 'auto'])
    """
    if path.suffix.lower() != ".parquet":
        result = replay(
            recording.log(),
            methods=methods,
            output=output,
            horizons=horizons,
            allan=False,
            progress=progress,
            **options,
        )
        write_log(result.filtered_log, path, force=force, beside=result.beside)
        return result
    header = recording.header
    filters = Filters(header.n, header.rate, header.channels, methods, output, options)
    measures = Measures(header, list(filters.runs), horizons, filters.holds)
    with atomic_path(path, force) as temporary:
        with _Filtered(temporary, recording, filters) as filtered:
            sinks = (measures.take, filtered.take)
            drive(recording, filters, sinks, silent if progress is None else progress, rows)
        return summed_up(recording, filters, measures, horizons)


class _Filtered(RowGroups):
    """The filtered log of blocks."""

    def __init__(self, path: Path, recording: LogFile, filters: Filters) -> None:
        header = recording.header
        self._recording = recording
        # Not the filter itself: it works on the next block while this one is written.
        self._method = filters.chosen.method
        self._compensates = filters.output == "compensated"
        every = list(beside_names(header.names, header.unit))
        others = [name for names in every for name in names] if self._compensates else []
        names = column_names(header.names, header.unit, others)
        super().__init__(path, [TIME_NAME, *names, *others], about(header))

    def take(self, block: Block) -> None:
        """Write one block."""
        time = self._recording.time(block.first, block.end)
        drift = block.drift[self._method]
        if not self._compensates or block.bias_sigma is None or block.at_rest is None:
            self.write([time, *drift])
            return
        header = self._recording.header
        others = beside(header.names, header.unit, drift, block.bias_sigma, block.at_rest)
        self.write([time, *compensated(block.raw, drift), *others.values()])
