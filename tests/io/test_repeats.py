"""Rows that repeat because the sensor is slower than its log, and rows that only repeat."""

import numpy as np
import pyarrow.parquet as pq
import pytest

from support.recordings import RECORDINGS, needs_recordings
from support.slow_sensors import held, quantised
from zerorate.cli import run
from zerorate.io import open_log, read_log, read_recording, write_log
from zerorate.io.clocks.grid import make_unstamped_grid
from zerorate.io.clocks.repeats import (
    HEAD_ROWS,
    find_repeats,
    find_rows_per_sample,
    make_sensor_grid,
)
from zerorate.record import Log, LogError

RATE = 100.0
N = 6000


def recognised(rows):
    return find_rows_per_sample(rows[:HEAD_ROWS], np.arange(min(HEAD_ROWS, len(rows))))


def log_of(ratio, late=0.0, axes=3, n=N, sigma=10.0):
    rng = np.random.default_rng(1)
    return held(rng, quantised(rng, n, axes, sigma), RATE, ratio * RATE, late)


@pytest.mark.every(3)
@pytest.mark.parametrize("late", [0.0, 0.2])
@pytest.mark.parametrize(
    ("axes", "ratio"),
    [
        *((3, ratio) for ratio in (1.15, 1.5, 1.52, 1.9, 1.97, 2.0, 2.03, 2.5, 3.0, 7.3, 25.0)),
        # One axis repeats a value by chance in three rows of a hundred.
        *((1, ratio) for ratio in (1.5, 1.52, 1.9, 1.97, 2.0, 2.03, 2.5, 3.0, 7.3, 25.0)),
    ],
)
def test_a_slower_sensor_is_put_on_its_own_clock(axes, ratio, late):
    log = log_of(ratio, late, axes)
    found = recognised(log.rows)
    assert found == pytest.approx(ratio, rel=5e-3)
    grid = make_sensor_grid(
        make_unstamped_grid(len(log.rows), ratio * RATE), find_repeats(log.rows), found
    )
    # Half of the samples tell the rate, one place more or less.
    assert grid.rate == pytest.approx(RATE, rel=2 / N)
    # Counted from whichever sample was read first. One that is read late may be taken for the
    # next; without that only a sample equal to the one before may come a place too late.
    off = grid.indices - log.which[grid.used_rows]
    off -= int(np.median(off))
    assert np.abs(off).max() <= 1
    assert late or np.mean(off != 0) < 0.01
    samples = len(np.unique(log.which))
    assert len(grid.used_rows) == pytest.approx(samples, rel=0.06 if late else 1e-3)


def random_repeats(rng):
    rows = np.where(rng.random(N) < 0.67, np.arange(N), 0)
    return rng.standard_normal((N, 3))[np.maximum.accumulate(rows)]


def resampled(rng):
    """Return rows of which every third or fifth stands three times: a period, but no clock."""
    return np.repeat(
        rng.standard_normal((8 * 700, 3)), np.tile([3, 1, 1, 3, 1, 1, 1, 1], 700), axis=0
    )


def stuck(rng):
    stuck_ = (np.arange(N) // 500 % 2 == 0)[:, None]
    return np.where(stuck_, rng.standard_normal((N, 3)), 1.0)


FAST = {
    "noise": lambda rng: rng.standard_normal((N, 3)),
    "repeats at random": random_repeats,
    "resampled": resampled,
    "stuck now and then": stuck,
    "constant": lambda rng: np.ones((N, 3)),
    "missing": lambda rng: np.full((N, 3), np.nan),
    "encoder at a steady rate": lambda rng: np.rint(0.37 * np.arange(N))[:, None],
    "coarse sine": lambda rng: np.rint(3 * np.sin(0.1 * np.arange(N)))[:, None],
    "saturated": lambda rng: np.clip(50 * np.sin(0.05 * np.arange(N)), -20, 20)[:, None],
    "temperature": lambda rng: np.rint(0.05 * np.cumsum(rng.standard_normal(N)))[:, None],
    "too few to tell": lambda rng: np.repeat(rng.standard_normal((400, 3)), 2, axis=0),
}


@pytest.mark.parametrize("kind", FAST)
@pytest.mark.parametrize("seed", range(3))
def test_other_repeats_are_left(kind, seed):
    assert recognised(FAST[kind](np.random.default_rng(seed))) is None


@pytest.mark.parametrize("axes", [1, 3])
@pytest.mark.parametrize("sigma", [0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_coarse_or_quiet_sensor_repeats_values(axes, sigma, seed):
    rng = np.random.default_rng(seed)
    assert recognised(quantised(rng, 20_000, axes, sigma)) is None
    assert (
        recognised(np.rint(np.cumsum(sigma * rng.standard_normal((20_000, axes)), axis=0))) is None
    )


@needs_recordings
def test_no_column_of_the_recordings_is_of_a_slower_sensor():
    for path in RECORDINGS.glob("*.parquet"):
        table = pq.read_table(path)
        for name in table.column_names:
            values = table[name].to_numpy().astype(np.float64)[:, None]
            assert recognised(values) is None, (path.name, name)


def test_a_sensor_that_rests_and_repeats_itself_keeps_its_samples():
    """Every twentieth sample equals the one before, and a hundred are stuck."""
    rng = np.random.default_rng(3)
    samples = quantised(rng, N, 3)
    samples[20::20] = samples[19:-1:20]
    samples[3000:3100] = samples[3000]
    log = held(rng, samples, RATE, 1.5 * RATE)
    grid = make_sensor_grid(
        make_unstamped_grid(len(log.rows), 150.0), find_repeats(log.rows), recognised(log.rows)
    )
    assert grid.report.missing_count == 0
    np.testing.assert_array_equal(log.rows[grid.used_rows], samples[: grid.length])


def test_gaps_of_the_log_are_gaps_of_the_sensor():
    log = log_of(1.5)
    kept = np.r_[0:2000, 2600 : len(log.rows)]
    table = {
        "t": log.time[kept],
        **{f"gyro_{a}_dps": log.rows[kept, i] for i, a in enumerate("xyz")},
    }
    read = read_log(table)
    clock = read.meta["clock"]
    assert read.rate == pytest.approx(RATE, rel=1e-4)
    assert (clock.gap_count, clock.missing_count) == (1, pytest.approx(400, abs=1))
    assert clock.longest_gap == pytest.approx(4.0, abs=0.02)
    assert read.n == pytest.approx(N, abs=2)
    # Values and times belong together on both sides of the gap.
    which = np.rint(read.time * RATE).astype(int)
    there = np.isfinite(read.data[:, 0])
    expected = log.samples[np.minimum(which, N - 1)]
    assert np.mean((read.data == expected)[there]) > 0.99


def columns_of(log):
    return {f"gyro_{axis}_dps": log.rows[:, i] for i, axis in enumerate("xyz")}


class TestWhatIsSaid:
    log = log_of(1.52)

    @property
    def stamped(self):
        return {"time_s": self.log.time, **columns_of(self.log)}

    def test_of_stamps(self):
        read = read_log(self.stamped)
        assert read.rate == pytest.approx(RATE, rel=1e-4)
        assert read.meta["notes"] == (
            "34% of the rows repeat the one before, as of a sensor of 100 Hz in a log of 152 Hz; "
            "each sample is taken once",
        )
        assert "3120 rows left out that repeat the one before" in read.meta["clock"].summary()

    def test_of_no_stamps(self):
        read = read_log(columns_of(self.log), rate=152.0)
        assert read.rate == pytest.approx(RATE, rel=1e-4)
        assert "in a log of 152 Hz; each sample is taken once" in read.meta["notes"][0]
        assert "no timestamps" in read.meta["clock"].summary()

    def test_of_the_rate_of_the_sensor_stated(self):
        read = read_log(self.stamped, rate=100.5)
        assert read.rate == 100.5
        assert "each sample is taken once" in read.meta["notes"][0]

    def test_of_the_rate_of_the_rows_stated(self):
        read = read_log(self.stamped, rate=152.0)
        np.testing.assert_array_equal(read.data, self.log.rows)
        assert "they are kept, for that is the rate stated" in read.meta["notes"][0]

    def test_of_another_rate_stated(self):
        with pytest.raises(LogError, match="stated as 200 Hz, but the timestamps run at 100 Hz"):
            read_log(self.stamped, rate=200.0)


def test_each_sensor_of_a_recording_has_its_own_rate():
    rng = np.random.default_rng(5)
    slow = log_of(1.5)
    gyro = quantised(rng, len(slow.rows), 3)
    table = {"t": slow.time, "gyro_dps": gyro, "accel_g": slow.rows}
    recording = read_recording(table)
    assert recording.gyro.rate == pytest.approx(150)
    np.testing.assert_array_equal(recording.gyro.data, gyro)
    assert recording.accel.rate == pytest.approx(RATE, rel=1e-4)
    assert recording.accel.n == pytest.approx(N, abs=2)


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".parquet"])
def test_what_was_written_is_read_back_with_its_rows(tmp_path, suffix):
    log = log_of(1.5)
    path = tmp_path / f"log{suffix}"
    names = ["gyro_x_dps", "gyro_y_dps", "gyro_z_dps"]
    write_log(Log(log.time, 150.0, log.rows, names, "deg/s"), path)
    np.testing.assert_array_equal(read_log(path).data, log.rows)


def test_block_by_block_as_in_one_piece(tmp_path):
    import pyarrow as pa

    log = log_of(1.5, late=0.2, n=120_000)
    kept = np.r_[0:50_000, 50_400 : len(log.rows)]
    columns = {"time_s": log.time[kept], "gyro_x_dps": log.rows[kept, 0].astype(np.float32)}
    columns["gyro_y_dps"] = log.rows[kept, 1]
    pq.write_table(pa.table(columns), tmp_path / "log.parquet", row_group_size=7001)
    whole, opened = read_log(tmp_path / "log.parquet"), open_log(tmp_path / "log.parquet")
    assert opened.header.meta == whole.meta
    assert opened.header.rate == whole.rate == pytest.approx(RATE, rel=1e-4)
    blocks = np.concatenate(list(opened.blocks(10_000)), axis=1).T
    np.testing.assert_array_equal(blocks, whole.data)
    np.testing.assert_array_equal(opened.time(0, whole.n), whole.time)


def test_a_replay_writes_the_samples_of_the_sensor(tmp_path):
    log = log_of(1.5)
    columns = ("time_s", "gyro_x_dps", "gyro_y_dps", "gyro_z_dps")
    rows = np.column_stack((log.time, log.rows))
    np.savetxt(tmp_path / "log.csv", rows, "%.17g", ",", header=",".join(columns), comments="")
    command = f"replay {tmp_path}/log.csv -o {tmp_path} --no-figure"
    assert run(command.split()) == 0
    raw, filtered = read_log(tmp_path / "log.csv"), read_log(tmp_path / "log-zerorate.parquet")
    assert (filtered.n, filtered.rate, filtered.names) == (raw.n, raw.rate, raw.names)
    np.testing.assert_array_equal(filtered.time, raw.time)
