"""Cells of text tables: no quote takes a line from the table, and one grammar holds for numbers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zerorate.io import read_log
from zerorate.io.readers import parsers
from zerorate.record import LogError

PARSERS = ("plain", "lines")
ROWS = 30


def read(path, parser, **options):
    """Return the log, or the sentence of its refusal, as one parser gives it."""
    with pytest.MonkeyPatch.context() as patch:
        if parser == "lines":
            patch.setattr(parsers, "_plain", lambda *_: None)
        try:
            return read_log(path, rate=10, **options)
        except LogError as error:
            return str(error)


def agreed(path, **options):
    """Return what all parsers give, after checking that it is the same to the last bit."""
    first, *others = (read(path, parser, **options) for parser in PARSERS)
    for other in others:
        if isinstance(first, str):
            assert first == other
        else:
            assert_same(first.data, other.data)
            assert first.meta["notes"] == other.meta["notes"]
    return first


def assert_same(found, expected):
    """Check that arrays are equal to the last bit, be their NaN of any sign."""
    np.testing.assert_array_equal(found, expected)
    known = ~np.isnan(expected)
    np.testing.assert_array_equal(np.signbit(found[known]), np.signbit(expected[known]))


def table(mark, cells=None):
    """Return the lines of a table: a header, and rows of a rate, a remark and a rate."""
    rows = cells or [[f"{i}.5", f"ok{i}", f"-{i}.25"] for i in range(ROWS)]
    return [mark.join(("wx", "remark", "wy")), *(mark.join(row) for row in rows)]


def written(folder, lines):
    path = folder / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


PLACES = st.lists(
    st.tuples(st.integers(1, ROWS), st.integers(0, 12), st.sampled_from(['"', '""', '"x"'])),
    min_size=1,
    max_size=6,
)


@settings(max_examples=5 * settings().max_examples)
@given(places=PLACES, mark=st.sampled_from([",", ";", "\t", " "]))
def test_a_quote_never_takes_a_row(tmp_path_factory, places, mark):
    lines = table(mark)
    for row, at, quotes in places:
        lines[row] = lines[row][:at] + quotes + lines[row][at:]
    got = agreed(written(tmp_path_factory.mktemp("quotes"), lines))
    if isinstance(got, str):
        assert "line " in got or "columns" in got
        return
    assert got.n == ROWS
    clean = [i for i in range(ROWS) if '"' not in lines[1 + i]]
    np.testing.assert_array_equal(got.data[clean, 0], [i + 0.5 for i in clean])
    np.testing.assert_array_equal(got.data[clean, 1], [-i - 0.25 for i in clean])


@settings(max_examples=3 * settings().max_examples)
@given(
    remarks=st.lists(st.text("\"ab '", max_size=6), min_size=ROWS, max_size=ROWS),
    mark=st.sampled_from([",", ";", "\t"]),
)
def test_quotes_in_remarks_cost_nothing(tmp_path_factory, remarks, mark):
    cells = [[f"{i}.5", remark, f"-{i}.25"] for i, remark in enumerate(remarks)]
    got = agreed(written(tmp_path_factory.mktemp("remarks"), table(mark, cells)))
    if isinstance(got, str):
        # Only of a pair of quotes around several cells.
        assert "cells, expected" in got
        return
    assert got.data[:, 0].tolist() == [i + 0.5 for i in range(ROWS)]


@pytest.mark.parametrize("rows", [(7,), (7, 25), (7, 8, 9)])
@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
def test_an_open_quote_is_an_ordinary_character_and_noted(tmp_path, mark, rows):
    lines = table(mark)
    for row in rows:
        lines[row] = lines[row].replace("ok", '"oops')
    log = agreed(written(tmp_path, lines))
    assert log.data[:, 0].tolist() == [i + 0.5 for i in range(ROWS)]
    assert log.data[:, 1].tolist() == [-i - 0.25 for i in range(ROWS)]
    others = {1: "line 8: ", 2: "line 8 and 1 more: ", 3: "line 8 and 2 more: "}[len(rows)]
    assert any(note.startswith(others + "a quote does not close") for note in log.meta["notes"])


@pytest.mark.parametrize("remark", ['"a, b"', '"say ""no"""', '"#1"', '""', ' "a; b"'])
def test_quotes_around_a_cell_are_the_tables(tmp_path, remark):
    log = agreed(written(tmp_path, table(",", [["1", remark, "2"], ["3", remark, "4"]])))
    assert log.data.tolist() == [[1, 2], [3, 4]]
    assert not any("quote" in note for note in log.meta["notes"])


def test_a_cell_over_two_lines_is_refused_by_its_line(tmp_path):
    lines = table(",")
    lines[5] = '4.5,"two\nlines",-4.25'
    assert "line 6 has 2 cells, expected 3" in agreed(written(tmp_path, lines))


def test_a_cell_of_any_length(tmp_path):
    for long in ("x" * 200_000, '"' + "x, " * 70_000 + '"', '"' + "x" * 200_000):
        lines = table(",")
        lines[4] = f"3.5,{long},-3.25"
        got = agreed(written(tmp_path, lines))
        assert "line 5 has" in got if "," in long else got.n == ROWS
    lines[4] = f"3.5,ok,{'7' * 200_000}"
    assert "line 5, column 'wy'" in agreed(written(tmp_path, lines))
    assert len(agreed(tmp_path / "log.csv")) < 300


NUMBERS = {
    "1": 1.0,
    "+1": 1.0,
    "-0": -0.0,
    "007": 7.0,
    "1.": 1.0,
    ".5": 0.5,
    "1e5": 1e5,
    "1E-5": 1e-5,
    " 1 ": 1.0,
    "1e-400": 0.0,
    "9" * 25: 1e25,
    "inf": np.inf,
    "-Infinity": -np.inf,
    "nAn": np.nan,
    "-nan(ind)": np.nan,
    "": np.nan,
    "N/A": np.nan,
}
REFUSED = [
    "1_000",
    "１２",
    "١",
    "²",
    "0x10",
    "1,5",
    "1d5",
    "1e",
    "e5",
    "--1",
    "1 000",
    "true",
    "ınf",
    "nan(",
    "1.#INF",
]
BEYOND = ["1e400", "-1e309", "9" * 400, "9" * 5000]


@pytest.mark.parametrize("cell", NUMBERS)
@pytest.mark.parametrize("mark", [";", "\t"])
def test_numbers(tmp_path, cell, mark):
    rows = [["2", "ok", "3"], ["2", "ok", cell]]
    expected = np.array([3.0, NUMBERS[cell]])
    assert_same(agreed(written(tmp_path, table(mark, rows))).data[:, 1], expected)


@pytest.mark.parametrize("cell", [*REFUSED, *BEYOND])
def test_what_is_no_number(tmp_path, cell):
    rows = [["2.0", "ok", "3.0"], ["2.0", "ok", cell]]
    got = agreed(written(tmp_path, table(";", rows)))
    why = "is not a number" if cell in REFUSED else "is beyond the largest double, 1.8e308"
    assert "line 3, column 'wy'" in got
    assert got.endswith(why)


@pytest.mark.parametrize("cell", ["0x10", "1_000", "9" * 400, "1.5"])
def test_columns_of_long_whole_numbers(tmp_path, cell):
    path = written(tmp_path, ["wy;wx", "1700000000000000123;1", f"{cell};2"])
    got = agreed(path, columns=["wy"])
    assert isinstance(got, str) == (cell != "1.5")


def test_a_decimal_comma_makes_the_point_no_number(tmp_path):
    path = written(tmp_path, ["wx;wy", *(f"{i},5;1" for i in range(60)), "1.234;1"])
    assert "line 62, column 'wx': '1.234' is not a number" in agreed(path)


@settings(max_examples=5 * settings().max_examples)
@given(
    cells=st.lists(st.text("019.,eE+-nainf_xX# \t\"'%²１", max_size=7), min_size=1, max_size=4),
    mark=st.sampled_from([",", ";", "\t", " "]),
)
def test_parsers_agree_on_any_cell(tmp_path_factory, cells, mark):
    rows = [["2.5", "ok", "3.5"], *(["1.5", "ok", cell] for cell in cells)]
    agreed(written(tmp_path_factory.mktemp("cells"), table(mark, rows)))


@pytest.mark.parametrize("odd", ['5.00,"0.5"', '"5.00","0.5"', '# "so"', '# "so', "", "% 5,6"])
def test_a_quote_or_remark_costs_its_own_line_alone(tmp_path, monkeypatch, odd):
    """Lines are taken apart one by one where they have quotes, however many others there are."""
    taken = []
    for name in ("split_cells", "has_stray_quotes"):
        own = getattr(parsers, name)
        told = lambda line, mark, own=own: taken.append(line) or own(line, mark)  # noqa: E731
        monkeypatch.setattr(parsers, name, told)
    counts = []
    for rows in (400, 4000):
        lines = [f"{k / 100:.2f},{k % 7 - 3}.5" for k in range(rows)]
        lines[rows // 2 : rows // 2] = [odd] if "5.00" not in odd else []
        lines[100] = odd if "5.00" in odd else lines[100]
        taken.clear()
        log = read_log(written(tmp_path, ["time_s,gyro_x_dps", *lines]), rate=100)
        assert log.n == rows
        counts.append(len(taken))
    assert counts[0] == counts[1] < 200
