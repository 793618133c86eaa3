"""Names that a spreadsheet would run as formulas are written as text, and read back."""

import csv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from zerorate.io import read_log, write_log
from zerorate.io.readers.cells import make_inert, undo_inert
from zerorate.record import Log
from zerorate.tasks.curve_files import write_curves
from zerorate.tasks.live import DriftColumn, LineStream, Settings

STARTERS = "=+-@\t\r\n＝＋－＠"
NAMES = ["=cmd|' /C calc'!A0", "+1", "-x", "@SUM(1)", "'=x", "＝a", "a,=b", 'q"=c', "a;-b", "wx"]


def formulas(path, delimiter=","):
    """Return the cells of a file that a spreadsheet would run; numbers are none."""
    with path.open(newline="", encoding="utf-8") as file:
        cells = [cell for row in csv.reader(file, delimiter=delimiter) for cell in row]
    return [cell for cell in cells if cell and cell[0] in STARTERS and not is_number(cell)]


def is_number(cell):
    try:
        float(cell)
    except ValueError:
        return False
    return True


def record(unit="deg/s", **extra):
    data = np.random.default_rng(1).standard_normal((200, len(NAMES)))
    return Log(np.arange(200) / 100, 100.0, data, NAMES, unit, extra=extra)


@pytest.mark.parametrize("suffix", ["csv", "tsv"])
def test_a_log(tmp_path, suffix):
    path, log = tmp_path / f"a.{suffix}", record(**{"=extra": np.arange(200)})
    write_log(log, path)
    assert formulas(path, "," if suffix == "csv" else "\t") == []
    again = read_log(path)
    assert again.names == log.names
    assert again.data.tobytes() == log.data.tobytes()
    assert read_log(path, columns=["=extra", "'=x"]).channels == 2


def test_a_unit(tmp_path):
    log = record("=unit,=unit;+unit")
    write_log(log, tmp_path / "a.csv")
    assert formulas(tmp_path / "a.csv") == []
    assert read_log(tmp_path / "a.csv").unit == log.unit


def test_curves(tmp_path):
    log = record()
    curves = zr.allan(log)
    write_curves([curves], tmp_path / "a.csv")
    assert formulas(tmp_path / "a.csv") == []


def test_a_stream():
    settings = Settings(100.0, sequence="@n", extra=(DriftColumn.bias,))
    for names in ("@n,=cmd,wx", "'@n,'=cmd,wx"):
        assert LineStream(settings).take(names) == "'@n,'=cmd,wx,bias_wx"


@given(st.text())
def test_any_text_comes_back(text):
    assert undo_inert(make_inert(text)) == text
    assert not make_inert(text).startswith(tuple(STARTERS))
