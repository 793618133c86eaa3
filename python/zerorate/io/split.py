"""Tables of several sensors or recordings one below the other, each a record of its own."""

from __future__ import annotations

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.columns import find_indices
from zerorate.io.formats import LogSource, label_of, open_source
from zerorate.io.parts import Part, split_table
from zerorate.io.table import Content
from zerorate.record.log import LogError


def split_log(source: LogSource, group_by: str | int) -> dict[str, Part]:
    """Return the records in a table whose rows belong to several sensors or recordings.

    Parameters
    ----------
    source
        As in `read_log`, without topics.
    group_by
        Name or index of the column that distinguishes the records: an id, a name, a number.

    Returns
    -------
    dict of str to Part
        Values of the column, in the order of the file, and the rows of each: a source for
        `read_log`, `read_recording` and all functions that take one.

    Raises
    ------
    LogError
        If there is no such column, a row has no value in it, hardly any value occurs twice, or the
        source has topics or no names.
    TypeError, OSError, ImportError
        As `read_log`.

    Examples
    --------
    >>> import zerorate as zr
    >>> table = {"sensor": [1, 1, 1, 2, 2, 2], "t": [0.0, 0.1, 0.2] * 2, "gyro_x_dps": range(6)}
    >>> parts = zr.io.split_log(table, "sensor")
    >>> zr.read_log(parts["2"]).data[:, 0]
    array([3., 4., 5.])
    """
    label = label_of(source)
    try:
        kind, content = open_source(source)
        if "" not in content.tables:
            raise LogError(
                make_sentence(
                    keyword_argument("group_by"),
                    " is for tables, and this is a recording of topics",
                ),
                "group_by",
            )
        table = content.choose_table(None)
        if table.names is None:
            raise LogError(
                make_sentence(
                    "a table without names has no column for ", keyword_argument("group_by")
                ),
                "group_by",
            )
        (index,) = find_indices(table, group_by)
        tables = split_table(table, index)
    except LogError as error:
        raise error.with_context(f"{label}: ") from None
    column = table.label(index)
    return {
        name: Part(name, f"{label} ({column} {name})", kind, Content.of(part))
        for name, part in tables.items()
    }
