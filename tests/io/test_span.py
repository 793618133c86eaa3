"""Parts of logs: the same samples on every road, and what lies outside."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

import zerorate as zr
from zerorate.io import open_log
from zerorate.io.reading import read_sensors

N, RATE = 1000, 200.0
KEPT = np.r_[0:300, 340:700, 701:N]
"""Rows of a log with gaps."""
NAMES = ["ax", "gx", "gy"]
TABLE = pd.DataFrame(
    {"t": 1.7e9 + KEPT / RATE}
    | {
        n: np.rint(100 * np.random.default_rng(i).standard_normal(len(KEPT)))
        for i, n in enumerate(NAMES)
    }
)
MPU = zr.raw_counts("MPU-6050", 250, 2)


@pytest.fixture(scope="module")
def parquet(tmp_path_factory):
    path = tmp_path_factory.mktemp("span") / "log.parquet"
    TABLE.to_parquet(path, row_group_size=97)
    return path


ENDS = st.floats(0.0, 4.9) | st.integers(0, 980).map(lambda i: i / RATE)


@given(st.data())
def test_every_road_reads_the_same_part(parquet, data):
    start = data.draw(st.none() | ENDS)
    stop = data.draw(st.none() | ENDS.map(lambda s: (start or 0.0) + 0.005 + s / 50))
    asked = {"scale": MPU, "start": start, "stop": stop}
    whole = zr.read_log(TABLE, scale=MPU)
    seconds = np.arange(N) / RATE
    low, high = start or 0.0, np.inf if stop is None else stop
    inside = (seconds >= low - 1e-9) & (seconds < high - 1e-9)
    opened, rows = open_log(parquet, **asked), data.draw(st.integers(1, 300))
    blocks = np.concatenate([block.T for block in opened.blocks(rows)])
    times = opened.time(0, opened.header.n)
    recording = zr.read_recording(TABLE, **asked)
    logs = [
        zr.read_log(TABLE, **asked),
        zr.read_log(parquet, **asked),
        opened.log(),
        recording.gyro,
        read_sensors(TABLE, **asked)[0],
    ]
    for values, time in [(blocks, times), *((log.data, log.time) for log in logs)]:
        np.testing.assert_array_equal(values, whole.data[inside])
        np.testing.assert_array_equal(time, whole.time[inside])
    # A column may be known to be all missing only where the whole of it is in memory.
    noted = [{note for note in log.meta["notes"] if "all missing" not in note} for log in logs[:3]]
    assert noted[0] == noted[1] == noted[2]
    assert opened.header.n == inside.sum()


@pytest.mark.parametrize(
    ("arguments", "error", "told"),
    [
        ({"start": 5.0}, zr.LogError, "start= is at 5 s, but the log is 5 s long"),
        ({"stop": 9.0}, zr.LogError, "stop= is at 9 s, but the log is 5 s long"),
        ({"start": 1.001, "stop": 1.002}, zr.LogError, "no sample between start= at 1.001 s and"),
        ({"start": -1.0}, ValueError, "start= is seconds from the first sample, got -1.0"),
        ({"stop": np.nan}, ValueError, "stop= is seconds"),
        ({"stop": True}, ValueError, "stop= is seconds"),
        ({"start": 3.0, "stop": 2.0}, ValueError, "stop= at 2 s is not after start= at 3 s"),
    ],
)
def test_what_lies_outside(parquet, arguments, error, told):
    for read in (zr.read_log, open_log, zr.read_recording, read_sensors):
        with pytest.raises(error, match=told):
            read(parquet, **arguments)


def test_a_rounded_length_is_no_fault():
    assert zr.read_log(TABLE, stop=5.004).n == N


def test_logs_of_a_recording_are_cut_on_their_common_clock():
    temperature = np.full(N, np.nan)
    temperature[40:900:200] = 21.5
    table = {"t": np.arange(N) / RATE, "gyro_dps": np.zeros((N, 3)), "temp_degc": temperature}
    recording = zr.read_recording(table, start=1.0, stop=3.0)
    assert recording.gyro.time[[0, -1]].tolist() == [1.0, 2.995]
    assert recording["temperature"].time.tolist() == [1.2, 2.2]
    early = zr.read_recording(table, stop=0.1)
    assert (early.gyro.n, early.temperature) == (20, None)
    assert "temp_degc: left out, for there is no sample between start= at 0 s and" in str(
        early.notes
    )
