"""Text tables: every layout, all parsers, and faults named by line and column."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zerorate.io import read_log
from zerorate.io.readers import parsers
from zerorate.record import LogError


@pytest.fixture(params=["plain", "lines"])
def parser(request, monkeypatch):
    """Force one parser, except for rows that the first leaves to the second."""
    if request.param == "lines":
        monkeypatch.setattr(parsers, "_plain", lambda *_: None)
    return request.param


def read(tmp_path, text, suffix=".csv", **options):
    path = tmp_path / f"log{suffix}"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_log(path, **options)


LAYOUTS = {
    "comma": "time_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2\n0.01,2.5,1e-3\n",
    "comma and blanks": "time_s, gyro_x_dps, gyro_y_dps\n0, 1.5, -2\n0.01, 2.5, 1e-3\n",
    "semicolon": "time_s;gyro_x_dps;gyro_y_dps\n0;1.5;-2\n0.01;2.5;1e-3\n",
    "decimal comma": "time_s;gyro_x_dps;gyro_y_dps\n0;1,5;-2\n0,01;2,5;1e-3\n",
    "tab": "time_s\tgyro_x_dps\tgyro_y_dps\n0\t1.5\t-2\n0.01\t2.5\t1e-3\n",
    "blanks": "  time_s  gyro_x_dps gyro_y_dps\n  0     1.5  -2 \n 0.01  2.5  1e-3\n",
    "bom and crlf": "\ufefftime_s,gyro_x_dps,gyro_y_dps\r\n0,1.5,-2\r\n0.01,2.5,1e-3\r\n",
    "no last newline": "time_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2\n0.01,2.5,1e-3",
    "quotes": '"time_s","gyro_x_dps","gyro_y_dps"\n"0","1.5","-2"\n"0.01","2.5","1e-3"\n',
    "comments": "# a\n\n% b\ntime_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2\n# c\n0.01,2.5,1e-3\n",
    "header in a comment": "#time_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2\n0.01,2.5,1e-3\n",
    "other columns": "note,time_s,gyro_x_dps,gyro_y_dps\nok,0,1.5,-2\n,0.01,2.5,1e-3\n",
    "UTF-16": "time_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2\n0.01,2.5,1e-3\n".encode("utf-16"),
    "separator stated": "sep=,\ntime_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2\n0.01,2.5,1e-3\n",
    "slashes": "// a\ntime_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2\n// b\n0.01,2.5,1e-3\n",
    "preamble": "Made by: me\nAt:,9:00\n\ntime_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2\n0.01,2.5,1e-3\n",
    "header again": "time_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2\ntime_s,gyro_x_dps,gyro_y_dps\n"
    "0.01,2.5,1e-3\n",
    "trailing commas": "time_s,gyro_x_dps,gyro_y_dps\n0,1.5,-2,\n0.01,2.5,1e-3,\n",
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts(tmp_path, parser, layout):
    log = read(tmp_path, LAYOUTS[layout])
    assert log.names == ("gyro_x_dps", "gyro_y_dps")
    assert (log.rate, log.unit) == (100.0, "deg/s")
    assert log.data.tolist() == [[1.5, -2.0], [2.5, 1e-3]]


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "NA", "N/A", "null"])
def test_missing_cells(tmp_path, parser, cell):
    log = read(tmp_path, f"time_s,gx,gy\n0,{cell},1\n0.1,2,{cell}\n0.2,3,4\n")
    np.testing.assert_array_equal(log.data, [[np.nan, 1], [2, np.nan], [3, 4]])
    assert log.missing_count == 2


def test_all_missing_column_is_noted(tmp_path, parser):
    log = read(tmp_path, "time_s,gx_dps,gy_dps\n0,,1\n0.1,,2\n")
    assert np.isnan(log.data[:, 0]).all()
    assert log.meta["notes"] == ("column 'gx_dps' is all missing",)


def test_nanoseconds_keep_their_precision(tmp_path, parser):
    stamps = 1_700_000_000_000_000_123 + 5_000_000 * np.arange(4)
    rows = "".join(f"{s},0.5,0,0\n" for s in stamps)
    head = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1]\n"
    log = read(tmp_path, head + rows)
    assert (log.rate, log.unit, log.channels) == (200.0, "rad/s", 3)
    assert log.meta["clock"].jitter_max < 1e-12


@settings(max_examples=60, deadline=None)
@given(
    rows=st.lists(
        st.tuples(st.floats(allow_nan=False), st.floats(width=32) | st.just(float("nan"))),
        min_size=1,
        max_size=8,
    ),
    mark=st.sampled_from([",", ";", "\t", " "]),
)
def test_parsers_agree_to_the_last_bit(tmp_path_factory, rows, mark):
    path = tmp_path_factory.mktemp("parsers") / "a.txt"
    path.write_text(f"wx{mark}wy\n" + "".join(f"{x!r}{mark}{y!r}\n" for x, y in rows))
    got = []
    for hidden in ((), ("_plain",)):
        with pytest.MonkeyPatch.context() as patch:
            for name in hidden:
                patch.setattr(parsers, name, lambda *_: None)
            got.append(read_log(path, rate=10).data)
    for found in got:
        np.testing.assert_array_equal(found, np.array(rows))


@pytest.mark.parametrize("mark", [",", ";", "\t", "|", "  "])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_plain_table_is_read_by_the_parser_of_plain_rows(tmp_path, monkeypatch, mark, end):
    monkeypatch.setattr(parsers, "_by_line", None)
    rng = np.random.default_rng(1)
    data = rng.standard_normal((400, 2)) * 10.0 ** rng.integers(-30, 30, (400, 2))
    data[7, 1] = np.nan
    rows = [
        f"{170000000000000000 + i}{mark}{x!r}{mark}{y!r}" for i, (x, y) in enumerate(data.tolist())
    ]
    log = read(
        tmp_path,
        end.join((mark.join(("stamp_ns", "wx", "wy")), *rows)) + 2 * end,
        rate=1e9,
        time=False,
    )
    np.testing.assert_array_equal(log.data, data)


def test_many_plain_rows_are_those_of_other_parsers(tmp_path, monkeypatch):
    rows = "".join(f"{i / 100:.2f},{np.sin(i):.9g},{np.cos(i):.5f}\n" for i in range(30_000))
    text = "time_s,gyro_x_dps,gyro_y_dps\n" + rows
    plain = read(tmp_path, text)
    monkeypatch.setattr(parsers, "_plain", lambda *_: None)
    np.testing.assert_array_equal(plain.data, read(tmp_path, text).data)


def test_headerless_time_is_found(tmp_path, parser):
    log = read(tmp_path, "0.00 5 1\n0.02 4 7\n0.04 6 3\n0.06 2 1\n", ".txt")
    assert (log.rate, log.names) == (50.0, ("column_1", "column_2"))
    assert log.unit == "unit"
    notes = log.meta["notes"]
    assert notes[0] == "the table has no names: column_1, column_2 are read as a gyro"
    assert any("is not known; give unit=" in note for note in notes)


def test_headerless_without_time_takes_all_columns(tmp_path):
    log = read(tmp_path, "1,2\n5,1\n3,3\n", rate=10, unit="dps")
    assert (log.names, log.unit) == (("column_0", "column_1"), "deg/s")


def test_headerless_row_counter_is_left_out(tmp_path):
    text = "".join(f"{i},{x}\n" for i, x in enumerate([4, 2, 7, 1]))
    assert read(tmp_path, text, rate=10).names == ("column_1",)
    with pytest.raises(LogError, match="give rate="):
        read(tmp_path, text)


def test_single_column(tmp_path, parser):
    assert read(tmp_path, "0.5\n1.5\n", ".dat", rate=10).data[:, 0].tolist() == [0.5, 1.5]
    assert read(tmp_path, "gyro\n0.5\n1.5\n", rate=10).names == ("gyro",)


HEAD = "time_s,gyro_x_dps\n0.00,1\n0.01,2\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty, expected a text table"),
        ("# only\n", "holds no rows"),
        ("time_s,gyro_x_dps\n", "line 1 is a header without rows"),
        (HEAD + "0.02\n", "line 4 has 1 cells, expected 2"),
        (HEAD + "0.02,3,4\n", "line 4 has 3 cells, expected 2"),
        (HEAD + "0.02,abc\n", "line 4, column 'gyro_x_dps': 'abc' is not a number"),
        (HEAD + "# note\n\n0.02,1.2.3\n", "line 6, column 'gyro_x_dps': '1.2.3' is not"),
        (HEAD + ",3\n", "time column 'time_s' is not finite in row 2"),
        ("time_s,gyro_x_dps\n0,1,2\n", "header on line 1 names 2 columns, but line 2 has 3"),
        ("Dear all,\nhello there, friends\n", "line 2 holds no number"),
        (b"a,b\n\x00\x01\x02\xff\xfe", "the content is binary, expected a text table"),
        (
            b'{\n  "format": "zerorate calibration",\n  "version": 1}',
            "the file holds a result of zerorate (calibration), expected a log",
        ),
        (b"\xff\xfe\x00\xd8\x00", "damaged UTF-16"),
        ('# zerorate {"rate": "x"}\nwx,wy\n1,2\n', "in the metadata, rate must be a positive"),
        ("# zerorate nonsense\nwx,wy\n1,2\n", "no JSON object"),
    ],
)
def test_faults_are_named(tmp_path, parser, text, message):
    with pytest.raises(LogError) as caught:
        read(tmp_path, text)
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "log.csv: "))
    assert "\n" not in str(caught.value)


@settings(max_examples=150, deadline=None)
@given(raw=st.binary(max_size=60) | st.text("0123456789.,;eE+-na\n\t #%\"'x", max_size=60))
def test_any_content_is_read_or_refused(tmp_path_factory, raw):
    path = tmp_path_factory.mktemp("any") / "log.csv"
    path.write_bytes(raw if isinstance(raw, bytes) else raw.encode())
    try:
        log = read_log(path, rate=10)
    except LogError:
        return
    assert log.n >= 1


@pytest.mark.parametrize("first", ["NA;NA;-2,5", ";;-2,5", "NA;NA;NA"])
def test_a_first_row_with_much_missing_is_a_row(tmp_path, parser, first):
    path = tmp_path / "log.csv"
    path.write_text(f"gyro_x;gyro_y;gyro_z\n{first}\n" + "1,5;2,5;3,5\n" * 5)
    data = read_log(path, rate=100).data
    assert data.shape == (6, 3)
    assert np.isnan(data[0, :2]).all()


def test_a_space_below_the_names_is_none_among_the_rows(tmp_path, parser):
    path = tmp_path / "log.csv"
    path.write_text("gyro_x;gyro_y;gyro_z\n;;\n" + "1,5;2,5;3,5\n;;\n" * 5)
    data = read_log(path, rate=100).data
    np.testing.assert_array_equal(np.isnan(data).all(axis=1), [False, True] * 5)
