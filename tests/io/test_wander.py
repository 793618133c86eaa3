"""Clocks that wander: told from late stamps, kept through every reader, and used."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import zerorate as zr
from zerorate.io import open_log, read_log
from zerorate.io.clocks.clock import fit_grid

N, PERIOD = 30_000, 0.01
ROWS = np.arange(N)


def wandering(part=0.03, seconds=60.0, n=N):
    """When samples were taken whose rate runs up and down by a part."""
    rate = 1.0 + part * np.sin(2 * np.pi * np.arange(n) * PERIOD / seconds)
    return np.concatenate(([0.0], np.cumsum(PERIOD / rate)[:-1]))


def stalled(_):
    stamps = ROWS * PERIOD
    for first in range(500, N - 500, 500):
        stamps[first : first + 10] = stamps[first + 9]
    return stamps


STEADY = {
    "jitter of 30 % of a period": lambda rng: (ROWS + rng.uniform(-0.3, 0.3, N)) * PERIOD,
    "lateness with a tail": lambda rng: np.maximum.accumulate(
        (ROWS + rng.exponential(2.0, N)) * PERIOD
    ),
    "a rate off by 1e-4": lambda rng: ROWS * PERIOD * 1.0001 + rng.normal(0, 1e-3, N),
    "bursts of fifty": lambda _: ROWS // 50 * 50 * PERIOD,
    "stalls of ten rows": stalled,
    "whole milliseconds at 333 Hz": lambda _: np.floor(ROWS / 0.3333) / 1e3,
    "whole seconds": lambda _: np.floor(ROWS * PERIOD),
    "a host set by 20 ms and back": lambda _: (
        ROWS * PERIOD + 0.02 * ((ROWS > 9000) & (ROWS < 20_000))
    ),
}


@pytest.mark.every(2)
@pytest.mark.parametrize("kind", STEADY)
@pytest.mark.parametrize("seed", range(5))
def test_late_stamps_of_a_steady_clock_are_put_on_it(kind, seed):
    stamps = STEADY[kind](np.random.default_rng(seed))
    grid = fit_grid(stamps - stamps[0], stamps[0])
    assert grid.stamp_times is None
    assert grid.report.wander == 0.0


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    part=st.sampled_from([0.01, 0.03]),
    seconds=st.sampled_from([60.0, 300.0]),
    jitter=st.sampled_from([0.0, 0.1, 0.3]),
)
def test_stamps_of_a_clock_that_wanders_are_kept(seed, part, seconds, jitter):
    rng = np.random.default_rng(seed)
    taken = wandering(part, seconds)
    stamps = taken + jitter * PERIOD * rng.uniform(-1, 1, N)
    grid = fit_grid(stamps - stamps[0])
    # Jitter on top of a rate that changes may look like a lost row where both add up.
    assert grid.report.missing_count <= 2
    assert np.abs(grid.stamp_times - (stamps - stamps[0])).max() <= (
        1.5 * PERIOD if jitter else 1e-9
    )
    even = grid.indices / grid.rate
    assert grid.report.wander == pytest.approx(np.abs(grid.stamp_times - even).max())
    assert grid.report.slowest == pytest.approx(100 * (1 - part), rel=0.01)
    assert grid.report.fastest == pytest.approx(100 * (1 + part), rel=0.01)


def test_gaps_of_a_clock_that_wanders():
    kept = np.delete(ROWS, np.r_[9_000:9_010, 15_000, 20_000:20_100])
    taken = wandering()
    grid = fit_grid(taken[kept])
    # The rate may be 3 % from that of the grid, and each gap is of whole rows.
    assert abs(grid.report.missing_count - 111) <= 6
    np.testing.assert_allclose(grid.stamp_times, taken[kept], rtol=0, atol=1e-9)
    inside = grid.times(range(grid.length))
    assert (np.diff(inside) > 0).all()
    np.testing.assert_array_equal(inside[grid.indices], grid.stamp_times)


def test_samples_that_arrived_from_a_clock_that_wanders():
    rng = np.random.default_rng(1)
    taken, n = wandering(0.003, 300.0), N // 20 * 20
    come = taken[19:n:20] + 0.002 + rng.exponential(0.02, n // 20)
    stamps = np.maximum.accumulate(np.repeat(come, 20) + np.tile(np.arange(20) * 1e-4, n // 20))
    grid = fit_grid(stamps - stamps[0])
    assert grid.report.burst_count > 1000
    error = grid.stamp_times - taken[:n]
    # To the delays of the bursts, 20 ms, where the even clock is 0.3 s off.
    assert np.abs(error - np.median(error)).max() < 0.04


TABLE = {
    "time_s": 1.7e9 + np.round(wandering(), 6),
    "gyro_dps": np.random.default_rng(0).normal(size=(N, 3)),
    "accel_mps2": np.random.default_rng(1).normal(size=(N, 3)),
}


def test_every_reader_and_writer_keeps_them(tmp_path):
    log = read_log(TABLE)
    told = log.meta["clock"].summary()
    assert told.startswith("clock at 100 Hz with a rate that varies from 97.08 to 102.9 Hz, so ")
    # A double holds seconds since 1970 to a quarter of a microsecond.
    np.testing.assert_allclose(log.sampled, TABLE["time_s"], rtol=0, atol=1e-6)
    assert log.steps is not None
    assert np.abs(log.time - log.time[0] - ROWS / log.rate).max() < 1e-6
    for suffix in ("csv", "npz", "parquet"):
        path = tmp_path / f"log.{suffix}"
        zr.write_log(log, path)
        again = read_log(path)
        np.testing.assert_allclose(again.sampled, log.sampled, rtol=0, atol=1e-6)
        opened = open_log(path)
        np.testing.assert_array_equal(opened.sampled(7, 99), again.sampled[7:99])
        np.testing.assert_array_equal(opened.log().stamps, again.stamps)
    part = read_log(tmp_path / "log.parquet", start=100.0, stop=200.0)
    first = np.searchsorted(log.sampled, part.sampled[0] - 1e-6)
    np.testing.assert_allclose(part.sampled, log.sampled[first : first + part.n], atol=1e-6)
    recording = zr.read_recording(TABLE)
    assert recording.gyro.stamps is not None
    assert recording.accel.stamps is not None


def test_an_even_clock_has_none():
    log = read_log({"time_s": ROWS * PERIOD, "gyro_dps": TABLE["gyro_dps"]})
    assert log.stamps is None
    assert log.steps is None
    assert log.sampled is log.time


def test_a_log_checks_its_stamps():
    times = np.arange(3.0)
    for stamps, told in (
        (times[:2], r"stamps must have shape \(3,\)"),
        (times[::-1], "none before the one of the sample before"),
        ([0.0, np.nan, 1.0], "must be finite"),
    ):
        with pytest.raises(zr.LogError, match=told):
            zr.record.Log(times, 1.0, times, ["wx"], stamps=stamps)


def test_an_integral_goes_by_the_stamps():
    turning = {"time_s": wandering(seconds=300.0), "gyro_x_dps": np.full(N, 90.0)}
    log = read_log(turning)
    true = np.radians(90.0) * (log.sampled[-1] - log.sampled[0])
    assert zr.integrate(log).angle[-1] == pytest.approx(true, rel=1e-9)
    # Half of it, where the clock runs fast, is a per cent and a half longer by an even one.
    half = slice(0, N // 2)
    part = read_log(turning, stop=150.0)
    even = zr.integrate(replace(part, stamps=None)).angle[-1]
    assert even / zr.integrate(part).angle[-1] == pytest.approx(
        (N // 2) / log.rate / float(np.ptp(turning["time_s"][half])), abs=3e-3
    )


def test_navigation_by_the_stamps_is_better_than_by_an_even_clock():
    drive = zr.simulate_drive(400.0, 240.0, seed=3)
    motion = drive.recording()
    taken = np.unique(np.rint(wandering(0.018, 120.0, 24_000) * 400.0).astype(int))
    taken = taken[taken < motion.gyro.n]
    table = {"time_s": taken / 400.0, "gyro_radps": motion.gyro.data[taken]}
    found = zr.read_recording({**table, "accel_mps2": motion.accel.data[taken]})
    assert found.gyro.stamps is not None
    evened = zr.record.Recording({name: replace(log, stamps=None) for name, log in found.items()})
    errors = []
    for recording in (found, evened):
        start = zr.align(recording, latitude=48.0, heading="course", span=(0.0, 29.0))
        outages = zr.navigation.outages(
            recording, drive.fixes, seconds=10.0, nav=zr.NavigationFilter(start), first=30.0
        )
        errors.append(outages[10.0].rms())
    # 1.8 m next to 5.0 m, of 5 outages.
    assert errors[0] < 0.6 * errors[1]
