"""Timestamps as text of ISO 8601: in every parser and every table, and what is no date."""

import datetime as dt

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zerorate.io import read_log
from zerorate.io.clocks.iso8601 import is_date, parse_dates
from zerorate.io.readers import parsers
from zerorate.record import LogError

NANOSECONDS = st.integers(-(2**62), 2**62)
OFFSETS = st.integers(-23 * 60 - 59, 23 * 60 + 59)


def written(nanoseconds, digits, mark):
    """A time as text with so many digits of its fraction, as NumPy writes it."""
    text = str(np.datetime64(nanoseconds, "ns"))
    return (text[:20] + text[20 : 20 + digits] if digits else text[:19]).replace("T", mark)


@given(st.lists(st.tuples(NANOSECONDS, st.integers(0, 9)), min_size=1), st.sampled_from("T "))
def test_texts_are_what_numpy_reads(stamps, mark):
    cells = [written(*stamp, mark) for stamp in stamps]
    expected = np.array(cells, "datetime64[ns]")
    assert all(map(is_date, cells))
    np.testing.assert_array_equal(parse_dates(cells), expected)
    np.testing.assert_array_equal(parse_dates([f"{cell}Z" for cell in cells]), expected)


@given(st.datetimes(dt.datetime(1700, 1, 2), dt.datetime(2199, 12, 30)), OFFSETS)
def test_texts_are_what_python_reads(local, minutes):
    zoned = local.replace(tzinfo=dt.timezone(dt.timedelta(minutes=minutes)))
    expected = np.datetime64(zoned.astimezone(dt.UTC).replace(tzinfo=None), "ns")
    offset = zoned.isoformat()[-6:]
    for cell in (zoned.isoformat(), str(zoned), local.isoformat() + offset.replace(":", "")):
        assert parse_dates([cell]) == [expected]


@given(st.text(st.sampled_from("0123456789-:.,TZ+ a"), max_size=30) | st.text(max_size=30))
def test_hostile_texts_are_refused_or_dates(cell):
    found = parse_dates([cell])
    if found is not None:
        day = dt.date.fromisoformat(cell[:10])
        assert abs(found.astype("M8[D]")[0].item() - day) <= dt.timedelta(days=1)


STAMPS = [f"2024-05-01 12:00:{i // 100:02d}.{i % 100:02d}0+02:00" for i in range(300)]
GYRO = np.random.default_rng(1).standard_normal(300)
TABLE = {"Date": STAMPS, "gyro_x_dps": GYRO}


@pytest.mark.parametrize("parser", ["plain", "lines"])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
@pytest.mark.parametrize("header", ["date{0}wx", "time{0}wx", ""])
def test_text_tables(tmp_path, monkeypatch, parser, mark, header):
    hidden = {"plain": "_by_line", "lines": "_plain"}[parser]
    monkeypatch.setattr(parsers, hidden, lambda *_: None)
    path = tmp_path / "log.txt"
    rows = [f"{stamp}{mark}{z!r}" for stamp, z in zip(STAMPS, GYRO.tolist(), strict=True)]
    path.write_text("\n".join(filter(None, [header.format(mark), *rows])))
    log = read_log(path)
    assert (log.rate, log.time[0]) == (100.0, 1714557600.0)
    np.testing.assert_array_equal(log.data[:, 0], GYRO)


@pytest.mark.parametrize("table", [dict, pd.DataFrame, pl.DataFrame, pa.table])
def test_texts_in_objects(table):
    log = read_log(table(TABLE))
    assert (log.rate, log.time[0], log.n) == (100.0, 1714557600.0, 300)
    broken = {"time": [*STAMPS[:7], "soon", *STAMPS[8:]], "gyro_x_dps": GYRO}
    with pytest.raises(LogError, match=r"'time', row 7 \(counting from 0\): 'soon' is no date and"):
        read_log(table(broken))


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        ("12:00:03.000", "'12:00:03.000' is no date and time of ISO 8601 such as 2024-05-01T12"),
        ("2024-05-01 12:00:03.000", "has no time zone, unlike the first row"),
        ("2024-02-30 12:00:03.000+02:00", "is no date of the calendar"),
        ("0024-05-01 12:00:03.000+02:00", "is no date and time"),
        ("2024-05-01 12:00:03.0123456789+02:00", "is no date and time"),
        ("", "'' is missing, expected a timestamp in every row"),
        ("1714557603.0", "is no date and time"),
    ],
)
@pytest.mark.parametrize("name", ["time", "date"])
def test_what_is_no_timestamp_is_named_by_line_and_column(tmp_path, name, cell, told):
    path = tmp_path / "log.csv"
    rows = [f"{stamp},{i % 7}" for i, stamp in enumerate(STAMPS)]
    rows[250] = f"{cell},1"
    path.write_text("\n".join([f"# a remark\n{name},wx", *rows]))
    with pytest.raises(LogError, match=f"line 253, column '{name}': ") as error:
        read_log(path)
    assert told in str(error.value)
