"""A replay that takes the accelerometer beside a gyro into account."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from zerorate.cli import run
from zerorate.io import LogFile, read_recording
from zerorate.record import LogError
from zerorate.tasks.batch import batch
from zerorate.tasks.live import LineStream
from zerorate.tasks.replay import replay_to_file
from zerorate.tasks.replay.motion import motion_of

RATE = 100.0
BIAS = 0.4
GYRO, ACCEL = ([f"{kind}_{axis}" for axis in "xyz"] for kind in ("gyro", "accel"))


def turned(rate=RATE, seed=2):
    """Return gyro in deg/s and accelerometer in g: 30 s of rest, 90 s at 2 deg/s, 30 s of rest."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(150.0 * rate)) / rate
    angle = np.radians(2.0) * np.clip(t - 30.0, 0.0, 90.0)
    accel = np.stack((np.zeros_like(t), np.sin(angle), np.cos(angle)), axis=1)
    gyro = np.full((len(t), 3), BIAS)
    gyro[(t >= 30.0) & (t < 120.0), 0] += 2.0
    noise = rng.standard_normal((2, len(t), 3))
    return t, gyro + 0.1 * noise[0], accel + 0.003 * noise[1]


def write(path, *, with_accel=True):
    t, gyro, accel = turned()
    columns = {"time_s": t} | dict(zip([f"{name}_dps" for name in GYRO], gyro.T, strict=True))
    if with_accel:
        columns |= dict(zip([f"{name}_g" for name in ACCEL], accel.T, strict=True))
    pq.write_table(pa.table(columns), path, row_group_size=900)
    return path


def worst(result):
    return np.nanmax(np.abs(result.bias[500:] - BIAS))


def test_a_recording_has_its_own(tmp_path):
    imu = read_recording(write(tmp_path / "imu.parquet"))
    both = zr.replay(imu)
    assert worst(zr.replay(imu.gyro)) > 1.0
    assert worst(both) < 0.1
    (note,) = both.header.meta["notes"]
    assert note.startswith("the accelerometer (accel_x_g, accel_y_g, accel_z_g) shows motion for 9")
    given = zr.replay(imu.gyro, accel=imu.accel)
    np.testing.assert_array_equal(given.bias, both.bias)
    # A published method takes every sample for rest, with or without.
    plain, told = (zr.replay(log, method="kf").bias for log in (imu.gyro, imu))
    np.testing.assert_array_equal(plain, told)


def test_block_by_block_as_in_memory(tmp_path):
    path = write(tmp_path / "imu.parquet")
    summary = replay_to_file(path, tmp_path / "out.parquet")
    whole = zr.replay(read_recording(path))
    assert summary.header.meta["notes"] == whole.header.meta["notes"]
    # No number equals NaN.
    assert repr(summary.scores) == repr(whole.scores)


def test_by_the_command(tmp_path, capsys):
    path = write(tmp_path / "imu.parquet")
    rest = {}
    for name, options in {"both": [], "alone": ["--no-accel"]}.items():
        folder = tmp_path / name
        assert run(["replay", str(path), "-o", f"{folder}/", "--no-figure", *options]) == 0
        assert ("the accelerometer" in capsys.readouterr().out) == (not options)
        (filtered,) = folder.iterdir()
        rest[name] = pq.read_table(filtered).to_pandas()
    middle = slice(11000, 11900)
    x = {name: table.filter(like="gyro_x").iloc[middle, 0].mean() for name, table in rest.items()}
    assert x["both"] == pytest.approx(2.0, abs=0.05)
    assert abs(x["alone"]) < 0.2


def test_a_fleet(tmp_path):
    path = write(tmp_path / "imu.parquet")
    tables = []
    for accel in (True, False):
        result = batch([str(path)], tmp_path / str(accel), accel=accel, workers=1)
        assert not result.failed
        (written,) = (tmp_path / str(accel)).rglob("imu*.parquet")
        tables.append(pq.read_table(written))
    assert not tables[0].equals(tables[1])


def test_clocks_of_their_own():
    """An accelerometer at another rate, which starts later and ends sooner."""
    t, gyro, _ = turned()
    times, _, accel = turned(rate=40.0)
    log = zr.Log(t, RATE, gyro, GYRO, "deg/s")
    beside = zr.Log(times[400:5200], 40.0, accel[400:5200], ACCEL, "g")
    moving = motion_of(LogFile.of(beside), LogFile.of(log))
    assert moving.shape == t.shape
    assert not moving[t < 30.0].any()
    assert moving[(t > 33.0) & (t < 120.0)].mean() > 0.99
    assert not moving[t > 123.0].any()


def test_refused(tmp_path):
    imu = read_recording(write(tmp_path / "imu.parquet"))
    flat = zr.Log(imu.accel.time, RATE, imu.accel.data[:, :2], ACCEL[:2], "g")
    with pytest.raises(LogError, match="accel_x, accel_y: an accelerometer has three axes, got 2"):
        zr.replay(imu.gyro, accel=flat)
    with pytest.raises(LogError, match="there is no gyro"):
        zr.replay(zr.Recording({"accel": imu.accel}))


def test_without_one_nothing_is_said(tmp_path, capsys):
    path = write(tmp_path / "imu.parquet", with_accel=False)
    assert run(["replay", str(path), "-o", f"{tmp_path}/out/", "--no-figure"]) == 0
    assert "accelerometer" not in capsys.readouterr().out


@pytest.mark.every(2)
@pytest.mark.parametrize("shown", [True, False], ids=["with accelerometer", "gyro alone"])
@pytest.mark.parametrize("method", ["auto", "robust", "kf"])
def test_live_and_replay_give_the_same_numbers(tmp_path, shown, method):
    """What README promises: to the last bit, sample by sample, line by line and from a log."""
    t, gyro, accel = turned()
    gyro[4000:4003], accel[9000:9002] = np.nan, np.nan
    columns = {"t_s": t}
    columns |= dict(zip([f"{name}_dps" for name in GYRO], gyro.T, strict=True))
    columns |= dict(zip([f"{name}_g" for name in ACCEL], accel.T, strict=True))
    pq.write_table(pa.table(columns), tmp_path / "imu.parquet")
    limits = {"rest_limit": 10.0, "bias_limit": 20.0} if method == "auto" else {}
    held = {} if method == "auto" else {"motion": "hold"}
    imu = read_recording(tmp_path / "imu.parquet")
    log = zr.replay(imu if shown else imu.gyro, method=method, **limits, **held).to_log()

    filter_ = zr.DriftFilter(RATE, channels=3, method=method, **limits, **held)
    motion = zr.noise.MotionDetector(RATE)
    rates = []
    for rate, force in zip(gyro, accel, strict=True):
        moving = motion.update(force) and shown
        rates.append(filter_.update(rate, moving=moving))
    np.testing.assert_array_equal(rates, log.data)

    accels = None if shown else ()
    stream = LineStream(zr.tasks.live.Settings(RATE, method=method, accel_columns=accels, **held))
    answers = [stream.take(",".join(columns))]
    rows = np.column_stack((t, gyro, accel)).tolist()
    for i, row in enumerate(rows):
        if i == 7000:
            stream = LineStream.from_bytes(stream.to_bytes(), stream.settings)
        answers.append(stream.take(",".join(map(repr, row))))
    numbers = np.array([[float(cell) for cell in line.split(",")] for line in answers[1:]])
    np.testing.assert_array_equal(numbers[:, 1:4], log.data)
    assert ("given motion by accel_x_g, accel_y_g, accel_z_g" in stream.opening) == shown


def test_a_stream_is_told_of_its_accelerometer(capsys, tmp_path):
    """By position where no line names it, by another name, and not at all."""
    lines = tmp_path / "lines.txt"
    lines.write_text("0.1,0.2,0.3,0,0,1\n" * 3)
    asked = ["stream", str(lines), "--rate", "100", "--columns", "0,1,2"]
    assert run([*asked, "--accel-columns", "3,4,5"]) == 0
    assert "given motion by column 3, column 4, column 5" in capsys.readouterr().err
    faults = {
        ("--accel-columns", "3,4"): "--accel-columns takes three columns, got 2",
        ("--accel-columns", "2,3,4"): "--accel-columns names a column of a gyro or of the",
        ("--accel-columns", "3,4,5", "--no-accel"): "give either --accel-columns or --no-accel",
        ("--attitude", "--no-accel"): "--no-accel has no effect with --attitude",
    }
    for options, words in faults.items():
        assert run([*asked, *options]) in (1, 2)
        assert words in capsys.readouterr().err
