"""Tables of several sensors or recordings: each is a record of its own, and a hint says so."""

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.bags import write_recording
from zerorate.cli import run
from zerorate.io import open_log, read_log, read_recording
from zerorate.record import LogError

N = 400
TIME = np.arange(N) / 100
GYRO = np.random.default_rng(1).standard_normal((3, N))
NAMES = ("left", "=right", "7")


def frame(ids=NAMES, order=None):
    """Return three recordings one below the other, or with their rows in another order."""
    table = pd.DataFrame(
        {
            "sensor": np.repeat(np.array(ids, dtype=object), N),
            "time_s": np.tile(TIME, 3),
            "gyro_x_dps": GYRO.ravel(),
        }
    )
    return table if order is None else table.iloc[order]


def file(folder, suffix, table):
    path = folder / f"run.{suffix}"
    if suffix == "csv":
        table.to_csv(path, index=False)
    else:
        pq.write_table(pa.Table.from_pandas(table, preserve_index=False), path)
    return path


INTERLEAVED = np.arange(3 * N).reshape(3, N).T.ravel()


@pytest.mark.parametrize("order", [None, INTERLEAVED], ids=["below", "between"])
@pytest.mark.parametrize("suffix", ["csv", "parquet", "pandas", "polars", "arrow", "arrays"])
def test_each_value_is_a_record(tmp_path, suffix, order):
    table = frame(order=order)
    source = {
        "pandas": lambda: table,
        "polars": lambda: pl.from_pandas(table.reset_index(drop=True)),
        "arrow": lambda: pa.Table.from_pandas(table, preserve_index=False),
        "arrays": lambda: {name: table[name].to_numpy() for name in table},
    }.get(suffix, lambda: file(tmp_path, suffix, table))()
    parts = zr.io.split_log(source, "sensor")
    assert tuple(parts) == NAMES
    for part, gyro in zip(parts.values(), GYRO, strict=True):
        for log in (read_log(part), read_recording(part).gyro, open_log(part).log()):
            assert (log.rate, log.missing_count, log.names) == (100.0, 0, ("gyro_x_dps",))
            np.testing.assert_array_equal(log.data[:, 0], gyro)
            assert log.meta["source"].endswith(f" (sensor {part.name})")


@pytest.mark.parametrize("ids", [(1, 2, 3), (1.0, 2.0, 3.5), (True, False, True)])
def test_ids_of_any_type(tmp_path, ids):
    named = {1.0: "1", 2.0: "2", 3: "3", 3.5: "3.5"}
    expected = ["True", "False"] if ids[1] is False else [named[i] for i in ids]
    assert list(zr.io.split_log(frame(ids), 0)) == expected


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("order", [None, INTERLEAVED], ids=["below", "between"])
def test_a_table_that_is_not_split_says_how(tmp_path, suffix, order):
    path = file(tmp_path, suffix, frame(order=order))
    try:
        said = " ".join(read_log(path).meta["notes"])
    except LogError as error:
        said = str(error)
    assert "column 'sensor' seems to distinguish several records; group_by= reads each" in said


def test_a_clock_that_was_set_back_is_no_reason_to_split(tmp_path):
    table = frame(("a", "a", "a"))
    table["state"] = np.arange(3 * N) // 250
    notes = read_log(table).meta["notes"]
    assert not any("group_by" in note for note in notes)


@pytest.mark.parametrize(
    ("source", "by", "message"),
    [
        (frame(), "imu", "there is no column 'imu'"),
        (frame(), "gyro_x_dps", "has 1200 different values in 1200 rows, expected the few of"),
        (frame(("a", None, "b")), "sensor", "column 'sensor' has no value in row 400"),
        (np.zeros((10, 3)), 0, "a table without names has no column"),
    ],
)
def test_faults(source, by, message):
    with pytest.raises(LogError, match=message):
        zr.io.split_log(source, by)


def test_topics_are_not_split(tmp_path):
    with pytest.raises(LogError, match="this is a recording of topics"):
        zr.io.split_log(write_recording(tmp_path, "mcap", ["/imu"]), "stamp_ns")


# On the command line.

COMMANDS = {
    "replay": (["--no-figure"], ["run-zerorate{}.parquet"]),
    "allan": (["--no-figure"], ["run-zerorate-allan{}.csv"]),
    "identify": (["--no-figure", "--order", "1,0"], ["run-zerorate-identify{}.json"]),
}


@pytest.fixture
def many(tmp_path, monkeypatch):
    """Return a table of long recordings in a folder of its own, where commands run."""
    monkeypatch.chdir(tmp_path)
    n = 3000
    table = pd.DataFrame(
        {
            "sensor": np.repeat(["a b", "a/b"], n),
            "time_s": np.tile(np.arange(n) / 100, 2),
            "gyro_x_dps": np.random.default_rng(2).standard_normal(2 * n),
        }
    )
    return file(tmp_path, "csv", table)


@pytest.mark.parametrize("command", COMMANDS)
def test_commands(many, command, capsys):
    options, files = COMMANDS[command]
    assert run([command, str(many), "--group-by", "sensor", *options]) == 0
    text = capsys.readouterr().out
    for name, ending in (("a b", "-a_b"), ("a/b", "-a_b-1")):
        assert f"{many} (sensor {name})" in text
        for one in files:
            assert (many.parent / one.format(ending)).stat().st_size > 0


def test_compare_takes_each(many, capsys):
    options = ["--methods", "auto", "--group-by", "0"]
    assert run(["compare", str(many), *options]) == 0
    text = capsys.readouterr().out
    assert "sensor a b" in text
    assert "sensor a/b" in text


def test_a_column_that_is_not_there_is_a_fault_of_usage(many, capsys):
    assert run(["replay", str(many), "--group-by", "imu", "--no-figure"]) == 2
    assert "there is no column 'imu'" in capsys.readouterr().err
    run(["replay", str(many), "--no-figure"])
    assert "--group-by reads each" in "".join(capsys.readouterr())
