"""Tables with several sensors or recordings one below the other, split into records."""

from __future__ import annotations

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.columns import find_indices
from zerorate.io.formats import LogSource, label_of, open_source
from zerorate.io.parts import Part, split_table
from zerorate.io.table import Content
from zerorate.record.log import LogError


def split_log(source: LogSource, group_by: str | int) -> dict[str, Part]:
    """Return the records of a table with rows of several sensors or recordings.

    Parameters
    ----------
    source
        Source as in `read_log`, without topics.
    group_by
        Name or index of the column that identifies the record of each row by an id, a name or a
        number.

    Returns
    -------
    dict of str to Part
        Records by the column's values, in the order of the file. `read_log`, `read_recording` and
        all other functions with a source accept them.

    Raises
    ------
    LogError
        If the column does not exist, has an empty cell, or repeats hardly any value. Also if the
        source has topics, or columns without names.
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
