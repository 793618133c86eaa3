"""Parts of a table with several sensors or recordings: the rows of one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.io.clocks.names import looks_like_time
from zerorate.io.table import Column, Content, Table
from zerorate.record.log import LogError
from zerorate.record.names import meaning_of
from zerorate.texts import escape_line
from zerorate.types import Integers


@dataclass(frozen=True)
class Part:
    """Rows of a source that form one record, as `zerorate.io.split_log` returns them.

    Parameters
    ----------
    name
        Value of these rows in the column that distinguishes the records.
    label
        Name of the record in messages and outputs.
    kind, content
        Format of the source, and the rows.
    """

    name: str
    label: str
    kind: str
    content: Content


def split_table(table: Table, column: int) -> dict[str, Table]:
    """Return the rows for each value of a column, in the order of first appearance.

    Raises
    ------
    LogError
        If a row has no value in the column, or hardly any value occurs twice.
    """
    names, value_numbers = _number_values(_load_labels(table, column), table.label(column))
    return {
        name: _select_rows(table, np.flatnonzero(value_numbers == i))
        for i, name in enumerate(names)
    }


def _load_labels(table: Table, index: int) -> Column:
    return table.load([index])[0] if table.labels is None else table.labels(index)


def _number_values(labels: Column, column: str) -> tuple[list[str], Integers]:
    """Return the distinct values as texts, and the index of each row's value, shape (n,)."""
    texts = [_format_value(value) for value in labels.tolist()]
    if None in texts:
        raise LogError(f"column '{column}' has no value in row {texts.index(None)}")
    names = [escape_line(str(text)) for text in dict.fromkeys(texts)]
    if 2 * len(names) > len(texts):
        raise LogError(
            f"column '{column}' has {len(names)} different values in {len(texts)} rows, "
            "expected the few of an id"
        )
    numbers = {text: number for number, text in enumerate(dict.fromkeys(texts))}
    return names, np.array([numbers[text] for text in texts])


def _format_value(value: object) -> str | None:
    """Return a value as text for people; None if it is missing."""
    if value is None or value != value or str(value).strip() in ("", "NaT", "<NA>"):
        return None
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    return str(value).strip()


def _select_rows(table: Table, rows: Integers) -> Table:
    def load(wanted: Sequence[int]) -> list[Column]:
        return [column[rows] for column in table.load(wanted)]

    return replace(table, load=load, lengths=None, pieces=None, rows=0, labels=None, whole=None)


def suggest_grouping(table: Table, time: int | None, stamps: Column | None) -> str | None:
    """Return a sentence on a column that splits a table with a broken clock into records.

    Within each value of this column the stamps increase, but not in the whole file.
    """
    if time is None or stamps is None or table.names is None or len(stamps) < 2:
        return None
    is_backward, is_equal = stamps[1:] < stamps[:-1], stamps[1:] == stamps[:-1]
    if not is_backward.any() and 2 * np.count_nonzero(is_equal) < len(stamps) - 1:
        return None
    for index, name in enumerate(table.names):
        if index == time or looks_like_time(name) or meaning_of(name) is not None:
            continue
        if _separates_clocks(table, index, stamps):
            return make_sentence(
                f"column '{name}' seems to distinguish several records; ",
                keyword_argument("group_by"),
                " reads each",
            )
    return None


def _separates_clocks(table: Table, index: int, stamps: Column) -> bool:
    try:
        names, value_numbers = _number_values(_load_labels(table, index), table.label(index))
    except LogError:
        return False
    if len(names) < 2 or len(value_numbers) != len(stamps):
        return False
    order = np.argsort(value_numbers, kind="stable")
    is_same_value = np.diff(value_numbers[order]) == 0
    return bool((stamps[order][1:] > stamps[order][:-1])[is_same_value].all())
