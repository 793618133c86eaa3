"""Units of timestamps: names, dates, rates and steps; stamps that are missing or do not fit."""

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

from zerorate.io import read_log
from zerorate.io.clocks.stamps import to_seconds
from zerorate.record import Log, LogError


@pytest.mark.parametrize(
    ("name", "step", "per_second"),
    [
        ("time_s", 1, 1),
        ("time_ms", 10, 1e3),
        ("timestamp_us", 10, 1e6),
        ("timestamp [ns]", 10_000_000, 1e9),
        ("t", 0.01, 1),
        ("time", 10, 1e3),
        ("timestamp", 10_000, 1e6),
        ("stamp", 10_000_000, 1e9),
    ],
)
def test_unit_of_time(name, step, per_second):
    stamps = to_seconds(np.arange(5) * step, name, None)
    np.testing.assert_allclose(stamps.seconds, np.arange(5) * step / per_second)


def test_stated_rate_settles_the_unit_of_time():
    assert to_seconds(np.arange(5), "t", 1.0).seconds[-1] == 4
    with pytest.raises(LogError, match=r"may be in s \(1 Hz\) or ms \(1000 Hz\), or count samples"):
        to_seconds(np.arange(5), "t", None)


def test_nanoseconds_since_1970_keep_their_precision():
    column = 1_700_000_000_123_456_789 + 10_000_001 * np.arange(100)
    stamps = to_seconds(column, "timestamp_ns", None)
    np.testing.assert_array_equal(stamps.seconds, 10_000_001 * np.arange(100) / 1e9)


def test_missing_timestamp_names_its_row():
    with pytest.raises(LogError, match="not finite in row 2"):
        to_seconds(np.array([0.0, 1.0, np.nan]), "time_s", None)


@pytest.mark.parametrize(("unit", "per_second"), [("s", 1), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
@pytest.mark.parametrize("year", [2001, 2024, 2099])
@pytest.mark.parametrize("rate", [0.1, 1.0, 5.0, 100.0, 8000.0])
@pytest.mark.parametrize("kind", [np.int64, np.float64])
def test_dates_tell_their_unit_by_their_size(unit, per_second, year, rate, kind):
    dates = (year - 1970) * 365.25 * 86_400
    # Whole counts that differ: a date in seconds has no more digits than that.
    step = max(per_second / rate, 1 if kind is np.int64 else 0)
    column = (dates * per_second + step * np.arange(50)).astype(kind)
    stamps = to_seconds(column, "t", None)
    assert stamps.start == pytest.approx(dates)
    assert stamps.seconds[-1] == pytest.approx(49 * step / per_second, abs=1e-5)
    alone = unit == "s" and step < 0.5
    assert stamps.note == (
        None if alone else f"time column 't' read as {unit}: in that unit it holds dates"
    )


def test_one_wild_stamp_moves_no_dates():
    for row in (0, 25, 49):
        column = 1_700_000_000 + np.arange(50)
        column[row] = 0
        assert "read as s" in to_seconds(column, "t", None).note


def test_a_counter_that_passes_the_numbers_of_dates_is_none():
    micros = 1_700_000_000 + 10_000 * np.arange(50)
    assert to_seconds(micros, "t", None).seconds[-1] == pytest.approx(0.49)


def test_a_name_that_dates_contradict():
    uptime = to_seconds(1_700_000_000 + np.arange(50), "time_ms", None)
    assert uptime.seconds[-1] == pytest.approx(0.049)
    assert uptime.note == (
        "time column 'time_ms' read as ms, as its name says; in s it would hold dates"
    )
    with pytest.raises(LogError, match="is in s by its name, but holds dates in us; rename it"):
        to_seconds(1_700_000_000_000_000 + np.arange(50), "time_s", None)


def test_a_rate_that_dates_contradict_is_refused_with_what_was_assumed():
    table = {"t": 1.7e9 + np.arange(50), "wx": np.ones(50)}
    assert read_log(table, rate=1.0).rate == 1
    with pytest.raises(LogError, match=r"run at 1 Hz \(time column 't' read as s: .* dates\)"):
        read_log(table, rate=1000.0)


FAR = np.array(["2500-01-01T00:00:00", "2500-01-01T00:00:01", "2500-01-01T00:00:02"], "M8[us]")
DATES = [
    {"time": FAR, "wx": np.ones(3)},
    {"time": FAR.astype("M8[s]"), "wx": np.ones(3)},
    {"time": FAR.astype("M8[us]").astype("m8[us]"), "wx": np.ones(3)},
    pd.DataFrame({"time": FAR, "wx": np.ones(3)}),
    pd.DataFrame({"time": pd.Series(FAR).dt.tz_localize("UTC"), "wx": np.ones(3)}),
    pd.DataFrame({"time": pd.Series(FAR).astype("timestamp[us][pyarrow]"), "wx": np.ones(3)}),
    pd.DataFrame({"wx": np.ones(3)}, pd.DatetimeIndex(FAR).tz_localize("UTC")),
    pl.DataFrame({"time": FAR, "wx": np.ones(3)}),
    pa.table({"time": pa.array(FAR), "wx": np.ones(3)}),
]


@pytest.mark.parametrize("table", DATES, ids=lambda table: type(table).__name__)
def test_dates_that_nanoseconds_cannot_hold(table):
    log = read_log(table)
    assert log.rate == 1
    np.testing.assert_array_equal(log.time, FAR.astype("M8[s]").astype(np.float64))


NAT = np.array(["2024-01-01", "NaT", "2024-01-03"], "M8[ns]")


@pytest.mark.parametrize(
    "table",
    [
        {"time": NAT},
        {"time": NAT.astype("M8[D]")},
        {"time": NAT - NAT[0]},
        {"time": np.array([0, "NaT", 2], "m8")},
        pd.DataFrame({"time": NAT}),
        pd.DataFrame({"time": pd.Series(NAT).dt.tz_localize("Europe/Berlin")}),
        pd.DataFrame({"time": pd.Series(NAT).astype("timestamp[us][pyarrow]")}),
        pl.DataFrame({"time": NAT}),
        pl.DataFrame({"time": [0, None, 2]}),
        pa.table({"time": pa.array(NAT)}),
        pa.table({"time": pa.array([0, None, 2])}),
    ],
    ids=lambda table: type(table).__name__,
)
def test_a_missing_stamp_in_every_kind_of_table(table):
    if isinstance(table, dict):
        table = {**table, "wx": np.ones(3)}
    elif isinstance(table, pd.DataFrame):
        table["wx"] = np.ones(3)
    elif isinstance(table, pl.DataFrame):
        table = table.with_columns(wx=pl.Series(np.ones(3)))
    else:
        table = table.append_column("wx", pa.array(np.ones(3)))
    with pytest.raises(LogError, match="time column 'time' is not finite in row 1"):
        read_log(table)


@pytest.mark.parametrize(
    ("time", "message"),
    [
        (np.array(["NaT"], "M8[ns]"), r"time must hold real numbers, got dtype datetime64\[ns\]"),
        (np.array([0], "m8[s]"), r"time must hold real numbers, got dtype timedelta64\[s\]"),
        (np.ma.array([1.0], mask=[True]), "time must be finite"),
        ([None], "time must be finite"),
        ([10**400], "time holds a number beyond the largest double"),
    ],
)
def test_a_log_takes_seconds_that_are_there(time, message):
    with pytest.raises(LogError, match=message):
        Log(time, 1.0, [1.0], ["wx"])


def test_whole_numbers_beyond_a_signed_one():
    column = np.array([2**63 + i * 10_000_000 for i in range(-2, 3)], np.uint64)
    stamps = to_seconds(column, "time_ns", None)
    np.testing.assert_array_equal(stamps.seconds, np.arange(5) / 100)
    assert stamps.start == (2**63 - 20_000_000) / 1e9
    with pytest.raises(LogError, match="goes backward in 4 of 4"):
        read_log({"time_ns": column[::-1].copy(), "wx": np.ones(5)})


@pytest.mark.parametrize(
    "column",
    [np.array([0, 1, 2**64 - 1], np.uint64), np.array([-(2**63), 0, 2**63 - 1], np.int64)],
)
def test_stamps_too_far_apart_to_subtract(column):
    with pytest.raises(LogError, match="spans more than 64 bits can count"):
        to_seconds(column, "time_ns", None)


def test_whole_numbers_of_python_are_exact():
    column = np.array([1_700_000_000_000_000_001 + 10_000_001 * i for i in range(5)], object)
    stamps = to_seconds(column, "time_ns", None)
    np.testing.assert_array_equal(stamps.seconds, 10_000_001 * np.arange(5) / 1e9)


def test_whole_numbers_of_64_bits_are_the_nearest_doubles():
    log = read_log({"wx": np.array([2**64 - 1, -(2**63)], object)}, rate=1.0)
    np.testing.assert_array_equal(log.data[:, 0], [2.0**64, -(2.0**63)])


@pytest.mark.parametrize("kind", ["M8[M]", "m8[Y]"])
def test_months_have_no_length(kind):
    with pytest.raises(LogError, match="expected times to the day or finer"):
        to_seconds(np.arange(3).astype(kind), "time", None)


GYRO = np.random.default_rng(1).standard_normal(1000)
COUNTED = 5000 * np.arange(1000) + 2**32 - 2_000_000


@pytest.mark.parametrize("kind", [np.uint32, np.int64, np.uint64, np.float64])
@pytest.mark.parametrize("name", ["micros", "timestamp_us", "t"])
def test_a_counter_of_32_bits_that_began_anew_goes_on(kind, name):
    column = (COUNTED % 2**32).astype(kind)
    log = read_log({name: column, "wx_dps": GYRO})
    assert (log.rate, log.n, log.meta["clock"].regular) == (200.0, 1000, True)
    assert f"time column '{name}' wrapped at 2^32 once" in log.meta["notes"][0]
    lost = np.r_[0:390, 420:1000]
    log = read_log({name: column[lost], "wx_dps": GYRO[lost]})
    assert (log.n, log.missing_count, log.meta["clock"].gap_count) == (1000, 30, 1)


def test_a_counter_that_was_reset_did_not_wrap():
    reset = np.r_[3_000_000_000 + COUNTED[:500] - COUNTED[0], COUNTED[:500] - COUNTED[0]]
    log = read_log({"micros": reset, "wx_dps": GYRO})
    clock = log.meta["clock"]
    assert (clock.backward_count, clock.restart_count, log.meta["notes"]) == (1, 1, ())
    assert log.n == 1000 + clock.missing_count


def test_every_wrap_of_a_long_log_counts():
    column = 60_000_000 * np.arange(400) % 2**32
    stamps = to_seconds(column, "micros", None)
    np.testing.assert_allclose(stamps.seconds, 60.0 * np.arange(400))
    assert "5 times" in stamps.note


@pytest.mark.parametrize(
    ("name", "column", "told"),
    [
        ("elapsed", 5003.0 + GYRO, "its values do not rise"),
        ("ts", np.full(1000, 0.005), "its values do not rise"),
        ("date", ["01.05.2024"] * 1000, "is no date and time of ISO 8601"),
        ("seconds", np.full(1000, np.nan), "not finite in row 0"),
    ],
)
def test_what_only_may_be_the_time_by_its_name_has_to_rise(name, column, told):
    table = pd.DataFrame({"wx_dps": GYRO, name: column})
    log = read_log(table, rate=200)
    assert (log.rate, log.n) == (200.0, 1000)
    assert log.meta["notes"][0].startswith(f"column '{name}' is not read as the time: ")
    assert told in log.meta["notes"][0]
    with pytest.raises(LogError, match=rf"give rate= in Hz; column '{name}' is not .*{told}"):
        read_log(table)
    # A better name is believed, wherever it stands.
    assert read_log(table.assign(time_s=0.01 * np.arange(1000))).rate == 100.0


@pytest.mark.parametrize("name", ["millis", "elapsed_ms", "ts"])
def test_names_that_may_be_of_the_time(name):
    table = pd.DataFrame({"wx_dps": GYRO, name: 5 * np.arange(1000)})
    assert read_log(table).rate == 200.0
    for columns in (1, name):
        told = f"columns= names '{name}', which holds the time, not samples; the gyro .* are wx_dps"
        with pytest.raises(LogError, match=told):
            read_log(table, columns=columns)
