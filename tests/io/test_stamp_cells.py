"""Stamps in cells, one by one: the seconds are those that the reader of a log gives."""

import numpy as np
import pytest

from support.clocks import forms
from zerorate.io.clocks.stamp_cells import StampCells
from zerorate.io.clocks.stamps import to_seconds
from zerorate.record import LogError

FORMS = forms(100.0, 3000)


@pytest.mark.parametrize("form", FORMS)
def test_seconds_are_those_of_a_log(form):
    stamped = FORMS[form]
    cells = StampCells(100.0, stamped.unit)
    found = [cells.seconds(repr(stamp)) for stamp in stamped.column.tolist()]
    expected = to_seconds(stamped.column, "t", None, stamped.unit).seconds
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(("unit", "per_second"), [("s", 1), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_a_unit_is_told_by_the_first_step(unit, per_second):
    """In blocks of five too."""
    counts = np.repeat(np.arange(0.0, 1.0, 0.05), 5) * per_second
    cells = StampCells(100.0)
    found = [cells.seconds(f"{count:.9g}") for count in counts]
    np.testing.assert_allclose(found, counts / per_second, atol=1e-9)


def test_dates_and_midnights():
    cells = StampCells(1.0)
    days = ("2024-05-01T23:59:59.500Z", "2024-05-02T00:00:00.500Z")
    assert [cells.seconds(day) for day in days] == [0.0, 1.0]
    day = StampCells(1.0, "s")
    assert [day.seconds(cell) for cell in ("86399", "0", "1", "", "nan")] == [0, 1, 2, None, None]
    with pytest.raises(LogError, match="its time is no number and no date"):
        day.seconds("soon")
