"""Times that are written otherwise than in ISO 8601."""

import numpy as np
import pytest

from zerorate.io import read_log
from zerorate.io.clocks.iso8601 import is_date, parse_dates
from zerorate.io.clocks.stamps import to_seconds
from zerorate.io.clocks.written import unpack_times
from zerorate.record import LogError

N = 300


def written(form, start="2024-05-13T12:59:58"):
    times = (np.datetime64(start, "ms") + 10 * np.arange(N).astype("timedelta64[ms]")).tolist()
    return [form(time) for time in times]


FORMS = {
    "of MATLAB": lambda t: f"{t:%d-%b-%Y %H:%M:%S}.{t.microsecond // 1000:03}",
    "of America": lambda t: f"{t.month}/{t.day}/{t.year} {t:%I:%M:%S}.{t.microsecond:06} {t:%p}",
    "of Germany": lambda t: f"{t:%d.%m.%Y %H:%M:%S}.{t.microsecond // 1000:03}",
    "with slashes": lambda t: f"{t:%Y/%m/%d %H:%M:%S.%f}",
    "with a zone behind a blank": lambda t: f"{t:%Y-%m-%d %H:%M:%S.%f} +0000",
}
OF_DAY = {
    "of day": lambda t: f"{t:%H:%M:%S.%f}",
    "of day to the millisecond": lambda t: f"{t:%H:%M:%S}.{t.microsecond // 1000:03}",
    "of day after noon": lambda t: f"{t:%I:%M:%S}.{t.microsecond:06} {t:%p}",
}


@pytest.mark.parametrize("form", FORMS)
def test_dates_and_times(form, tmp_path):
    cells = written(FORMS[form])
    assert all(map(is_date, cells))
    log = read_log({"when_time": np.array(cells, object), "gyro_x": np.ones(N)})
    assert log.time[0] == np.datetime64("2024-05-13T12:59:58").astype(int)
    (tmp_path / "log.csv").write_text("time;gyro_x\n" + "".join(f"{c};1\n" for c in cells))
    for found in (log, read_log(tmp_path / "log.csv")):
        assert (found.rate, found.n, found.meta["clock"].regular) == (100.0, N, True)


@pytest.mark.parametrize("form", OF_DAY)
@pytest.mark.parametrize("start", ["2024-05-13T12:59:58", "2024-05-13T23:59:59"])
def test_times_of_day_go_on_at_noon_and_at_midnight(form, start, tmp_path):
    cells = written(OF_DAY[form], start)
    (tmp_path / "log.csv").write_text("time,gyro_x\n" + "".join(f"{c},1\n" for c in cells))
    log = read_log(tmp_path / "log.csv")
    assert (log.rate, log.n, log.meta["clock"].regular) == (100.0, N, True)
    midnight = any("passes midnight once" in note for note in log.meta["notes"])
    assert midnight == start.endswith("23:59:59")


def test_a_date_that_may_be_two_is_none():
    assert parse_dates(["5/1/2024 1:02:03", "5/1/2024 1:02:04"]).dtype.kind == "m"
    assert parse_dates(["5/13/2024 1:02:03"])[0] == np.datetime64("2024-05-13T01:02:03")
    assert parse_dates(["13/5/2024 1:02:03"])[0] == np.datetime64("2024-05-13T01:02:03")
    assert parse_dates(["1.5.2024 1:02:03"])[0] == np.datetime64("2024-05-01T01:02:03")
    assert parse_dates(["53:10.2"])[0] == np.timedelta64(53 * 60_000 + 10_200, "ms")


@pytest.mark.parametrize(
    "cell",
    ["25:00:00", "1:60:00", "31-Feb-2024 1:00:00", "1-Foo-2024 1:00:00", "1:2", "13:00:00 PM"],
)
def test_what_is_no_time(cell):
    assert not is_date(cell) or parse_dates([cell]) is None


def test_rows_are_written_alike(tmp_path):
    for other, told in (("1.5", "no time as in the first row"), ("", "")):
        text = f"time,gyro_x\n12:00:00.0,1\n12:00:00.1,1\n{other},1\n"
        (tmp_path / "log.csv").write_text(text)
        with pytest.raises(
            LogError, match=f"line 4, column 'time': '{other}' is .*{told}|is missing"
        ):
            read_log(tmp_path / "log.csv")


def test_a_time_in_several_columns():
    count = 23 * 3600 * 1000 + 59 * 60_000 + 58_000 + 10 * np.arange(N)
    of_day = {"Hour": count // 3_600_000 % 24, "Minute": count // 60_000 % 60}
    whole = {**of_day, "Second": count // 1000 % 60, "ms": count % 1000, "gyro_x": np.ones(N)}
    for table in (whole, {**of_day, "Second": count / 1000 % 60, "gyro_x": np.ones(N)}):
        log = read_log(table)
        assert (log.rate, log.n, log.meta["clock"].regular) == (100.0, N, True)
    nanoseconds = 1_714_560_000_000_000_000 + 3_333_333 * np.arange(N, dtype=np.int64)
    parts = {"stamp.sec": nanoseconds // 10**9, "stamp.nsec": nanoseconds % 10**9}
    log = read_log({**parts, "gyro_x": np.ones(N)})
    assert log.rate == pytest.approx(300.0, rel=1e-6)
    assert log.meta["clock"].regular
    # Two clocks that each tell all are not added.
    both = {"time_s": np.arange(N) / 500, "time_ns": 2_000_000 * np.arange(N)}
    assert read_log({**both, "gyro_x": np.ones(N)}).rate == 500.0


def packed(seconds, per_second):
    """Hours, minutes and seconds of the day as one number."""
    hours, minutes = np.floor(seconds / 3600) % 24, np.floor(seconds / 60) % 60
    return np.rint((1e4 * hours + 1e2 * minutes + seconds % 60) * per_second)


@pytest.mark.parametrize("start", ["11:59:30", "23:59:58", "0:00:59"])
@pytest.mark.parametrize(("per_second", "kind"), [(1e3, np.int64), (1e3, float), (1e6, np.int64)])
def test_hours_minutes_and_seconds_in_one_number(start, per_second, kind):
    h, m, s = map(int, start.split(":"))
    since = np.arange(6000) / 100
    first = 3600 * h + 60 * m + s
    found = to_seconds(packed(first + since, per_second).astype(kind), "time", None)
    assert found.start == first
    np.testing.assert_allclose(found.seconds, since, atol=1e-6)
    assert "hours, minutes and seconds in one number" in found.note


@pytest.mark.parametrize("step", [1, 10, 1000, 10_000])
def test_a_count_is_no_time_of_day(step):
    counts = 123_456 + step * np.arange(30_000)
    assert unpack_times(counts) is None
