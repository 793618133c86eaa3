"""Processing of one log of a batch as a separate function, for other engines."""

import os
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Literal

from zerorate.io.formats import label_of
from zerorate.io.remote import is_address
from zerorate.tasks.batch.fleet import fleet_of
from zerorate.tasks.batch.inputs import Inputs, LogFile
from zerorate.tasks.batch.planning import make_tasks
from zerorate.tasks.batch.summary import batch_rows
from zerorate.tasks.batch.task import BatchArguments, Settings, run_task


def process_log(
    source: str | os.PathLike[str],
    command: Literal["replay", "allan", "report", "check"] = "replay",
    options: BatchArguments | None = None,
    *,
    folder: str | os.PathLike[str] | None = None,
) -> list[dict[str, object]]:
    """Run a command on one log and return its rows of the summary, in any job system.

    The function depends only on its arguments. Pickle and Arrow can transfer the arguments and the
    result. An unreadable log gives a row with the status "failed".

    Parameters
    ----------
    source : str or path
        Path of a file, or its address: ``"s3://bucket/log.parquet"``.
    command : {"replay", "allan", "report", "check"}
        Command, as in `batch`.
    options : mapping, optional
        Arguments of `Settings`, such as ``{"unit": "deg/s"}``.
    folder : path, optional
        Folder for the output and its record. By default nothing is written.

    Returns
    -------
    list of dict
        One row for each axis or finding; for a failed log, a single row.

    Raises
    ------
    ValueError
        If an option is not valid.

    Examples
    --------
    >>> from zerorate.tasks.batch import process_log
    >>> (row,) = process_log("no.parquet", "report")
    >>> row["status"], row["error"]
    ('failed', 'No such file or directory')
    """
    settings, name = Settings(command=command, **(options or {})), os.fspath(source)
    address = is_address(name)
    stem = PurePosixPath(name.partition("?")[0]).name if address else Path(name).name
    log = LogFile(stem, name if address else Path(name))
    with nullcontext(folder) if folder is not None else TemporaryDirectory() as place:
        tasks, unread = make_tasks(Inputs((log,), {}, ()), Path(place), settings)
        outcomes = [*unread, *map(run_task, tasks)]
    rows = batch_rows([replace(one, name=label_of(source)) for one in outcomes], fleet_of({}, ()))
    return [{key: value for key, value in row.items() if key != "outlying"} for row in rows]
