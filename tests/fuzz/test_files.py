"""Damaged files of every format: read, or refused in one sentence; and the files that broke."""

import re
from pathlib import Path

import numpy as np
import pytest

from support.formats import FORMATS, damaged, written
from zerorate.io import limits, open_log, read_log, read_recording
from zerorate.record import LogError

CORPUS = Path(__file__).parent / "corpus"
# Behind each damaged one a process is begun anew.
SLOW = {"a.h5", "stored.mat", "deflated.mat", "a.mp4"}
ROADS = (
    lambda path: read_log(path, rate=100),
    lambda path: read_recording(path, rate=100),
    lambda path: [block.shape for block in open_log(path, rate=100).blocks(17)],
)


def read_or_refused(path, read):
    """Return what reading a file gives, and what it is refused with."""
    try:
        return read(path), None
    except LogError as error:
        return None, str(error)


def told(path, read):
    """Return what reading a file says in one line."""
    found, refusal = read_or_refused(path, read)
    assert refusal is None or refusal.startswith(f"{path}")
    return refusal or repr(found)


@pytest.mark.every(2)
@pytest.mark.parametrize("name", FORMATS)
def test_damaged_files(search, tmp_path, name):
    path = written(tmp_path, name)
    whole = path.read_bytes()

    def case(rng):
        raw = whole
        for _ in range(rng.integers(1, 4)):
            raw = damaged(raw, rng) or raw
        path.write_bytes(raw)
        road = ROADS[rng.integers(len(ROADS))]
        assert told(path, road).isprintable()

    search(case, 2 if name in SLOW else 40)


NUMBERS = ["1", "-0.5", "1e3", "nan", "NA", "", " 7 ", "1_0", "0x1p3", "1e999", "\uff11", "9" * 400]
TEXTS = ['"', '""', '"a,b"', "'", "=1+1", "#", "%", "% x", "\\", "\ufeff", "\x00", ";", ",", "\t"]
CELLS = [*NUMBERS, "inf", *TEXTS]


def text_table(rng):
    """Return a table of text with a few cells of any kind, and its rows of data."""
    mark = rng.choice([",", ";", "\t", " "])
    end = rng.choice(["\n", "\r\n"])
    width, rows = int(rng.integers(1, 5)), int(rng.integers(1, 60))
    cells = rng.normal(size=(rows, width)).round(6).astype(str)
    # Not in the first row of numbers, which ends what may stand before a table.
    for _ in range(rng.integers(0, 4) if rows > 1 else 0):
        cells[rng.integers(1, rows), rng.integers(width)] = rng.choice(CELLS)
    lines = [mark.join(row) for row in cells]
    header = mark.join(f"gyro_{i}" for i in range(width))
    return end.join([header, *lines]) + end, rows


def test_text_tables_lose_no_row(search, tmp_path):
    """As many rows as lines: what is read is all of it, or it is refused."""
    path = tmp_path / "a.csv"

    def case(rng):
        text, rows = text_table(rng)
        path.write_bytes(text.encode())
        log, refusal = read_or_refused(path, ROADS[0])
        if refusal is not None:
            assert refusal.isprintable()
            return
        comments = sum(line.lstrip().startswith(("#", "%")) for line in text.splitlines())
        blank = sum(not line.strip() for line in text.splitlines())
        assert rows - comments - blank <= log.n <= rows

    search(case, 400)


# What was read wrongly, or ended a process, before: each with what is said of it today.
BROKE = {
    "digits-400.csv": "line 3, column 'gyro_x_dps'",
    # What lies behind its memory decides which.
    "ends-scipy.mat": "it ended the process that read it|truncated, damaged or of a foreign kind",
    "endless.h5": "reading it would take more than",
    "epoch-1hz.csv": "80 samples at 1 Hz",
    "epoch-5hz-ms.csv": "80 samples at 5 Hz",
    "infinities.npy": "infinities.npy",
    "quote-open.csv": "120 samples at 100 Hz",
    "quote-open.tsv": "80 samples at 100 Hz",
    "quote-pair.csv": "80 samples at 100 Hz",
    "rate-list.csv": "unit must be text",
    "underscore.csv": "line 32, column 'gyro_x_dps': '1_000' is not a number",
}


@pytest.mark.parametrize("name", sorted(path.name for path in CORPUS.iterdir()))
def test_what_broke_once(name, monkeypatch):
    monkeypatch.setattr(limits, "_BASE_SECONDS", 0.5)  # for the one that would never end
    assert re.search(BROKE[name], told(CORPUS / name, read_log))
    for road in ROADS:
        assert told(CORPUS / name, road).isprintable()


def test_the_numbers_are_those_written(search, tmp_path):
    """Whatever the layout, each number that is read is the double nearest to the text."""
    path = tmp_path / "a.csv"

    def case(rng):
        values = rng.normal(size=(30, 3)) * 10.0 ** rng.integers(-20, 20, (30, 3))
        values[rng.random((30, 3)) < 0.1] = np.nan
        mark, comma = rng.choice([(",", "."), (";", ","), ("\t", "."), (";", ".")])
        missing = rng.choice(["nan", "NaN", "", "NA"])
        if missing == "":
            values[0, 0] = 1.0  # a line without any cell below a header is a space
        texts = [
            [missing if np.isnan(x) else repr(float(x)).replace(".", comma) for x in row]
            for row in values
        ]
        names = mark.join(["gyro_x", "gyro_y", "gyro_z"])
        path.write_text("\n".join([names, *(mark.join(row) for row in texts)]) + "\n")
        np.testing.assert_array_equal(read_log(path, rate=50).data, values)

    search(case, 100)
