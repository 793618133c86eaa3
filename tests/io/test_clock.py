"""Timestamps: jitter, coarse stamps, gaps, jumps, and what is no clock at all."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zerorate.io import read_log
from zerorate.io.clocks.clock import fit_grid
from zerorate.record import LogError
from zerorate.record.clock import ClockReport

N = 20_000
ROWS = np.arange(N)


def late_by_exponential(rng):
    return np.maximum.accumulate((ROWS + 0.3 * rng.exponential(size=N)) * 0.01)


def stalls(_):
    """Ten rows in every 500 stamped with the time of the last of them."""
    stamps = ROWS * 0.01
    for first in range(500, N - 500, 500):
        stamps[first : first + 10] = stamps[first + 9]
    return stamps


def stale(_):
    stamps = ROWS * 0.01
    stamps[[10, 30, 31, 100]] = stamps[[9, 29, 29, 99]]
    return stamps


def one_wild_stamp(_):
    stamps = ROWS * 0.01
    stamps[500] = 50_000
    return stamps


REGULAR = {
    "exact": lambda _: ROWS * 0.01,
    "since 1970": lambda _: 1.7e9 + ROWS * 0.01,
    "jitter of 0.2 periods": lambda rng: (ROWS + 0.2 * rng.normal(size=N)) * 0.01,
    "exponential latency": late_by_exponential,
    "bursts of ten": lambda _: ROWS // 10 * 10 * 0.01,
    "bursts of fifty": lambda _: ROWS // 50 * 50 * 0.01,
    "stalls made up for": stalls,
    "old stamps repeated": stale,
    "one wild stamp": one_wild_stamp,
    "slow wander": lambda _: ROWS * 0.01 + 0.05 * np.sin(ROWS / 3000),
}


@pytest.mark.parametrize("kind", REGULAR)
def test_bad_stamps_add_and_drop_no_rows(kind):
    stamps = REGULAR[kind](np.random.default_rng(1))
    grid = fit_grid(stamps - stamps[0], stamps[0])
    np.testing.assert_array_equal(grid.indices, ROWS)
    assert grid.rate == pytest.approx(100, rel=1e-3)
    assert grid.report.gap_count == 0


@pytest.mark.parametrize("rate", [50.0, 62.5, 128.0, 300.0, 800.0, 2000 / 7])
def test_stamps_in_whole_milliseconds(rate):
    grid = fit_grid(np.floor(ROWS / rate * 1e3) / 1e3)
    np.testing.assert_array_equal(grid.indices, ROWS)
    assert grid.rate == pytest.approx(rate, rel=2e-5)


@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    loss=st.sampled_from([0.0, 0.001, 0.01, 0.05]),
    jitter=st.sampled_from([0.0, 0.05, 0.1]),
    rate=st.sampled_from([10.0, 62.5, 100.0, 1000.0, 8000.0]),
)
def test_lost_rows_come_back_at_their_place(seed, loss, jitter, rate):
    rng = np.random.default_rng(seed)
    kept = np.flatnonzero(rng.random(5000) >= loss)
    kept -= kept[0]
    stamps = (kept + jitter * rng.normal(size=len(kept))) / rate
    grid = fit_grid(stamps - stamps[0])
    # At 10 % jitter the step over a lost row stays below 1.5 periods once in some 4000 times.
    assert np.abs(grid.indices - kept).max() <= (1 if jitter > 0.05 else 0)
    assert grid.report.missing_count == grid.length - len(kept)
    assert grid.rate == pytest.approx(rate, rel=1e-4)


def test_gap_becomes_missing_rows(tmp_path):
    rows = np.r_[0:50, 57:100]
    text = "".join(f"{i / 100:.2f},{i}\n" for i in rows)
    (tmp_path / "a.csv").write_text("time_s,gyro_x_dps\n" + text)
    log = read_log(tmp_path / "a.csv")
    assert (log.n, log.missing_count) == (100, 7)
    np.testing.assert_array_equal(log.data[rows, 0], rows)
    clock = log.meta["clock"]
    assert (clock.gap_count, clock.missing_count) == (1, 7)
    assert clock.longest_gap == pytest.approx(0.08)
    assert clock.summary() == ("clock at 100 Hz with 7 missing samples in 1 gap (longest 0.08 s)")


def test_a_clock_that_is_set_back_goes_on_in_file_order():
    stamps = np.where(ROWS < 7000, ROWS, ROWS - 80) * 0.01
    grid = fit_grid(stamps)
    np.testing.assert_array_equal(grid.indices, ROWS)
    assert (grid.report.backward_count, grid.report.restart_count) == (1, 0)
    assert grid.report.jitter_max < 1e-9


def test_a_clock_that_begins_anew_leaves_a_gap():
    stamps = np.where(ROWS < 7000, ROWS, ROWS - 7000) * 0.01
    grid = fit_grid(stamps)
    np.testing.assert_array_equal(grid.indices, np.where(ROWS < 7000, ROWS, ROWS + 1000))
    report = grid.report
    assert (report.backward_count, report.restart_count, report.longest_gap) == (1, 1, 10.0)
    assert "1 new beginning, each after an unknown time without samples" in report.summary()
    assert report.jitter_max < 1e-9


def test_swapped_rows_are_counted_and_kept():
    stamps = ROWS * 0.01
    stamps[[500, 501]] = stamps[[501, 500]]
    grid = fit_grid(stamps)
    np.testing.assert_array_equal(grid.indices, ROWS)
    assert grid.report.backward_count == 1


def test_jitter_is_measured():
    rng = np.random.default_rng(2)
    grid = fit_grid((ROWS + 0.1 * rng.normal(size=N)) * 0.01)
    assert grid.report.jitter_rms == pytest.approx(1e-3, rel=0.05)
    assert 3e-3 < grid.report.jitter_max < 7e-3
    assert "ms rms" in grid.report.summary()


@pytest.mark.parametrize(
    ("stamps", "message"),
    [
        (-ROWS * 0.01, "goes backward in 19999 of 19999 steps"),
        (np.random.default_rng(0).random(N), "expected timestamps that rise"),
        (np.ones(N), "do not advance"),
        (np.where(ROWS < 100, ROWS, ROWS + 1e8), r"gap of 1e\+08 s before row 100 .* cut the log"),
    ],
)
def test_what_is_no_clock(stamps, message):
    with pytest.raises(LogError, match=message):
        fit_grid(stamps)


def test_stated_rate_wins_within_one_per_cent():
    assert fit_grid(ROWS * 0.01, rate=100.5).rate == 100.5
    with pytest.raises(LogError, match=r"stated as 50 Hz, .* run at 100 Hz"):
        fit_grid(ROWS * 0.01, rate=50.0)


def test_one_row_needs_a_rate():
    assert fit_grid(np.zeros(1), rate=10.0).length == 1
    with pytest.raises(LogError, match="give rate="):
        fit_grid(np.zeros(1))


@pytest.mark.parametrize("rate", [100.0, 2000 / 7, 123.456, 1 / 3, 8000.0])
@pytest.mark.parametrize("n", [2, 3, 10, 1000])
def test_rate_of_exact_stamps_is_exact(rate, n):
    assert fit_grid(np.arange(n) / rate).rate == rate


def test_summaries():
    assert ClockReport(100.0).summary() == "clock regular at 100 Hz"
    assert ClockReport(100.0, stamped=False).summary() == "no timestamps, rate 100 Hz as stated"
    assert "2 backward steps" in ClockReport(100.0, backward_count=2).summary()
