"""Commands say first what a log's motion contradicts, and put it right if asked."""

import numpy as np
import pytest

import zerorate as zr

AXES = "xyz"


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Logs of one motion by hand: as it is, with a wrong sign of y, with a unit that is not its."""
    folder = tmp_path_factory.mktemp("checked")
    motion = zr.simulate_motion("hand", 100.0, 60.0, seed=3)
    written = {}
    for name, gyro in (
        ("right", motion.gyro),
        ("sign", motion.gyro * [1.0, -1.0, 1.0]),
        ("unit", np.degrees(motion.gyro)),
    ):
        columns = {"time_s": motion.time}
        columns |= {f"gyro_{a}_radps": gyro[:, i] for i, a in enumerate(AXES)}
        columns |= {f"accel_{a}_mps2": motion.accel[:, i] for i, a in enumerate(AXES)}
        written[name] = folder / f"{name}.csv"
        header, rows = ",".join(columns), np.column_stack(list(columns.values()))
        np.savetxt(written[name], rows, delimiter=",", header=header, comments="")
    return written


SAID = {
    "sign": "the gyro's y axis has the opposite sign to the accelerometer's",
    "unit": "the gyro's values are in deg/s, not in rad/s",
}


@pytest.mark.parametrize("name", SAID)
@pytest.mark.parametrize("command", ["attitude", "replay"])
def test_what_is_mistaken_is_the_first_line(call, logs, tmp_path, command, name):
    code, text, _ = call(command, logs[name], "-o", tmp_path, "--no-figure")
    assert code == 0
    assert text.splitlines()[0] == f"{logs[name]}: {SAID[name]}: --fix corrects it"


@pytest.mark.parametrize("command", ["attitude", "replay"])
def test_nothing_is_said_of_what_is_right(call, logs, tmp_path, command):
    _, text, _ = call(command, logs["right"], "-o", tmp_path, "--no-figure", "--fix")
    assert "--fix" not in text
    assert "the motion shows" not in text


@pytest.mark.parametrize("name", SAID)
def test_what_is_put_right_is_noted(call, logs, tmp_path, name):
    plain = ("--no-figure", "-o", tmp_path / "a.parquet")
    code, text, _ = call("attitude", logs[name], *plain, "--fix")
    assert code == 0
    assert text.splitlines()[0] == f"{logs[name]}: {SAID[name]}: corrected by --fix"
    assert "as the motion shows" in text
    call("attitude", logs["right"], "-o", tmp_path / "b.parquet", "--no-figure")
    found, expected = (zr.read_log(tmp_path / f"{name}.parquet").data for name in "ab")
    # Seven digits of degrees in the log of the unit.
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_a_log_in_blocks_is_put_right_as_well(call, logs, tmp_path):
    written = {}
    for name in ("right", "sign"):
        log = zr.read_recording(logs[name])
        table = {"time_s": log.gyro.time}
        table |= {n: log.gyro.data[:, i] for i, n in enumerate(log.gyro.names)}
        table |= {n: log.accel.data[:, i] for i, n in enumerate(log.accel.names)}
        written[name] = _parquet(tmp_path / f"{name}.parquet", table)
        out = tmp_path / f"{name}-out.parquet"
        code, _, _ = call("replay", written[name], "-o", out, "--no-figure", "--fix")
        assert code == 0
    one, other = (zr.read_log(tmp_path / f"{n}-out.parquet").data for n in ("right", "sign"))
    np.testing.assert_array_equal(one, other)


def _parquet(path, table):
    pa, pq = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    pq.write_table(pa.table(table), path, row_group_size=1000)
    return path


@pytest.fixture(scope="module")
def sessions(tmp_path_factory):
    """Logs of turns between rests: with a wrong sign of y, with a unit that is not its."""
    folder = tmp_path_factory.mktemp("sessions")
    recording = zr.simulation.simulate_session(seed=2).recording
    gyro, accel = recording.gyro.data, recording.accel.data
    wrong = {"sign": gyro * [1.0, -1.0, 1.0], "unit": np.radians(gyro)}
    header = ",".join(["time_s", *(f"gyro_{a}_dps" for a in AXES), *(f"accel_{a}_g" for a in AXES)])
    for name, values in wrong.items():
        rows = np.column_stack([recording.gyro.time, values, accel])
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=header, comments="")
    return folder


def test_a_calibration_says_it_once(call, sessions, tmp_path):
    asked = ("calibrate", sessions / "sign.csv", "-o", tmp_path, "--no-figure", "--force")
    code, text, errors = call(*asked)
    assert code == 1
    # It has found the axes itself.
    assert "the gyro's y axis" not in text
    assert "left-handed" in errors
    code, text, _ = call(*asked, "--fix")
    assert code == 0
    assert text.splitlines()[0].endswith(f"{SAID['sign']}: corrected by --fix")


def test_what_is_mistaken_is_said_before_a_fault_that_comes_of_it(call, sessions, tmp_path):
    asked = ("calibrate", sessions / "unit.csv", "-o", tmp_path, "--no-figure")
    code, text, errors = call(*asked)
    assert (code, errors.count("\n")) == (1, 1)
    assert "the gyro's values are in rad/s, not in deg/s: --fix corrects it" in text
    assert call(*asked, "--fix")[0] == 0
