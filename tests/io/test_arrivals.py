"""Stamps of arrival: bursts that are recognised, and logs that only look so."""

import numpy as np
import pytest

from support.arrivals import arrived, packets, polls, stalls
from zerorate.io import read_log
from zerorate.io.clocks.clock import fit_grid
from zerorate.record import LogError

RATE = 99.3
GAPS = ((3000, 300), (10_000, 500), (15_000, 120), (15_600, 400))

HOSTS = {
    "packets of twenty": lambda rng: packets(rng, 20),
    "packets of five": lambda rng: packets(rng, 5),
    "polls": polls,
    "polls and stalls": lambda rng: stalls(rng, polls(rng)),
    "packets and stalls": lambda rng: stalls(rng, packets(rng, 20)),
}


def grid_of(log, **stated):
    return fit_grid(log.stamps - log.stamps[0], log.stamps[0], **stated)


@pytest.mark.parametrize("host", HOSTS)
@pytest.mark.parametrize("drift", [0.0, 2e-4])
@pytest.mark.parametrize("seed", range(2))
def test_arrivals_stand_on_the_clock_that_made_them(host, drift, seed):
    rng = np.random.default_rng(seed)
    log = arrived(rng, HOSTS[host](rng), rate=RATE, drift=drift)
    grid = grid_of(log)
    np.testing.assert_array_equal(grid.indices, np.arange(len(log.stamps)))
    # The mean rate of a drifting sensor is RATE / (1 - drift / 2) at first.
    assert grid.rate == pytest.approx(RATE, rel=1e-4 + drift)
    assert grid.report.gap_count == 0
    assert grid.report.burst_count > 500
    assert grid.report.jitter_max == pytest.approx(log.delays.max(), abs=0.1)


@pytest.mark.parametrize("host", HOSTS)
@pytest.mark.parametrize("seed", range(2))
def test_true_gaps_survive(host, seed):
    rng = np.random.default_rng(seed)
    log = arrived(rng, HOSTS[host](rng), rate=RATE, gaps=GAPS)
    grid = grid_of(log)
    assert grid.rate == pytest.approx(RATE, rel=1e-4)
    # Each place to within the delay of the sample, which is all that its stamp can tell.
    assert (np.abs(grid.indices - log.made) <= np.maximum(3, log.delays * RATE)).all()
    assert (np.diff(grid.indices) > 0).all()
    assert grid.length == pytest.approx(log.made[-1] + 1, abs=5)
    for row, lost in GAPS:
        near = slice(row - 150, row + 150)
        assert np.ptp(grid.indices[near]) - 299 == pytest.approx(lost, abs=5)
    assert grid.report.longest_gap > 300 / RATE


def test_short_arrivals_with_the_rate_stated():
    rng = np.random.default_rng(4)
    log = arrived(rng, polls(rng), n=400, rate=RATE)
    np.testing.assert_array_equal(grid_of(log, rate=RATE).indices, np.arange(400))
    # Twelve bursts are too few to tell.
    assert grid_of(log).report.burst_count == 0


def test_a_stated_rate_chooses_between_bursts_and_gaps():
    rng = np.random.default_rng(5)
    log = arrived(rng, polls(rng), rate=RATE)
    assert grid_of(log, rate=100.0).report.burst_count > 0
    assert grid_of(log, rate=500.0).report.burst_count == 0
    with pytest.raises(LogError, match=r"stated as 200 Hz, .* run at 99\.3 Hz"):
        grid_of(log, rate=200.0)


def test_what_is_said_of_arrivals():
    rng = np.random.default_rng(6)
    log = arrived(rng, polls(rng), rate=RATE, gaps=GAPS)
    table = {"time_s": 1.7e9 + log.stamps, "gyro_x_dps": np.arange(len(log.stamps))}
    read = read_log(table)
    clock = read.meta["clock"]
    assert f"clock at 99.3 Hz with stamps of arrival in {clock.burst_count} bursts (late by " in (
        clock.summary()
    )
    assert any("samples arrived in" in note and "99.3 Hz" in note for note in read.meta["notes"])
    # No sample is lost, and each stands where it was made.
    there = np.flatnonzero(np.isfinite(read.data[:, 0]))
    np.testing.assert_array_equal(read.data[there, 0], np.arange(len(log.stamps)))
    made = 1.7e9 + log.stamps - log.delays
    assert np.abs(read.time[there] - made).max() < 0.05 + log.delays.max()
    assert np.median(np.abs(read.time[there] - made)) < 0.05


def blocks(rng, on, off, jitter=0.1, count=150):
    """Return stamps of a sensor at 100 Hz that is switched on and off, in samples."""
    on, off = (np.broadcast_to(one(rng, count), count) for one in (on, off))
    rows = np.arange(on.sum()) + np.repeat(np.cumsum(off) - off, on)
    return (rows + jitter * rng.standard_normal(len(rows))) / 100


def of_size(size):
    return lambda rng, count: size


def between(low, high):
    return lambda rng, count: rng.integers(low, high, count)


@pytest.mark.parametrize("jitter", [0.0, 0.1])
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    ("on", "off"),
    [
        (of_size(20), of_size(80)),
        (of_size(20), between(20, 120)),
        (of_size(20), between(78, 83)),
        (between(10, 30), of_size(60)),
        (between(2, 60), between(1, 150)),
    ],
    ids=["a cycle", "pauses differ", "pauses differ a little", "bursts differ", "both differ"],
)
def test_a_sensor_switched_on_and_off_has_gaps(on, off, seed, jitter):
    stamps = blocks(np.random.default_rng(seed), on, off, jitter)
    report = fit_grid(stamps - stamps[0]).report
    assert report.burst_count == 0
    # Not that of the rows, 20 to 50 Hz.
    assert report.rate == pytest.approx(100, rel=0.01)


def test_more_gaps_than_samples_are_said():
    stamps = blocks(np.random.default_rng(1), of_size(20), of_size(80), 0.0)
    log = read_log({"t": stamps, "wx": np.ones(len(stamps))})
    assert any("more samples are missing than there are" in note for note in log.meta["notes"])
