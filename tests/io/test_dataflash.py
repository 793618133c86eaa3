"""ArduPilot's DataFlash logs: made byte by byte and line by line, and a real one."""

import numpy as np
import pytest

import zerorate as zr
from support.dataflash import KINDS, SCALES, batch, flight, write_dataflash, write_text
from support.recordings import RECORDINGS, needs_recordings
from zerorate.io.readers.dataflash import parse_binary
from zerorate.record import LogError

N = 100
WRITERS = {"a.bin": write_dataflash, "a.log": write_text, "a.txt": write_text}


def column(rows, kind, name, instance=None):
    """Return what was written into a field, in the unit that its letter says."""
    letters, names = KINDS[kind]
    index = names.split(",").index(name)
    found = [row for one, row in rows if one == kind and instance in (None, row[1])]
    return np.array([row[index] for row in found]) * SCALES.get(letters[index], 1)


def axes(rows, kind, name, instance=None):
    return np.column_stack([column(rows, kind, f"{name}{a}", instance) for a in "XYZ"])


@pytest.mark.parametrize("name", WRITERS)
def test_all_sensors_of_a_flight(tmp_path, name):
    rows = flight(N)
    recording = zr.read_recording(WRITERS[name](tmp_path / name, rows))
    kinds = ("gyro", "accel", "temperature", "gyro_1", "accel_1", "temperature_1")
    others = ("mag", "pressure", "height", "position", "velocity", "reference")
    assert recording.names == (*kinds, *others)
    for imu, suffix in enumerate(["", "_1"]):
        gyro, accel = recording[f"gyro{suffix}"], recording[f"accel{suffix}"]
        assert (gyro.rate, gyro.unit, accel.unit) == (50, "rad/s", "m/s^2")
        assert (gyro.meta["sensor"], gyro.time[0]) == (f"IMU{suffix}", 1.0)
        assert gyro.meta["axes"] == "forward, right, down"
        np.testing.assert_array_equal(gyro.data, axes(rows, "IMU", "Gyr", imu))
        np.testing.assert_array_equal(accel.data, axes(rows, "IMU", "Acc", imu))
    assert recording["temperature_1"].data[0, 0] == 42.5
    mag = recording.mag
    assert (mag.rate, mag.unit) == (10, "gauss")
    np.testing.assert_allclose(mag.data, 1e-3 * axes(rows, "MAG", "Mag"), rtol=1e-15)


@pytest.mark.parametrize("name", WRITERS)
def test_the_fixes_of_a_flight(tmp_path, name):
    fixes = zr.read_fixes(WRITERS[name](tmp_path / name, flight(N)))
    assert (len(fixes), fixes.time[0]) == (9, 1.20008)
    np.testing.assert_allclose(fixes.position[0], [-35.3626267, 149.1653044, 588.82], rtol=1e-12)
    np.testing.assert_allclose(fixes.velocity[0], [0, 5, 0.5], atol=1e-12)
    assert fixes.satellites[0] == 11


@pytest.mark.parametrize("name", WRITERS)
def test_the_attitude_is_said_to_be_an_estimate(tmp_path, name):
    reference = zr.read_recording(WRITERS[name](tmp_path / name, flight(N))).reference
    roll, pitch, yaw = np.radians([30, -10, 120])
    # Roll, then pitch, then yaw of the body turn it to north, east, down.
    x = np.array([np.cos(roll / 2), np.sin(roll / 2), 0, 0])
    y = np.array([np.cos(pitch / 2), 0, np.sin(pitch / 2), 0])
    z = np.array([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
    from zerorate.geometry.rotations import product

    np.testing.assert_allclose(reference.data[0], product(z, product(y, x)), atol=1e-15)
    assert any("the autopilot's own estimate" in note for note in reference.meta["notes"])


@pytest.mark.parametrize("name", WRITERS)
def test_the_calibration_among_the_parameters(tmp_path, name):
    log = zr.read_log(WRITERS[name](tmp_path / name, flight(N)))
    assert log.meta["calibration"] == {"INS_GYROFFS_X": pytest.approx(0.0125)}
    assert log.meta["format"] == ("dataflash" if name == "a.bin" else "dataflash text")


def test_batches_of_fast_samples_are_a_log_of_their_own(tmp_path):
    values = np.random.default_rng(1).integers(-3000, 3000, (2, 100, 3))
    rows = flight(N)
    rows += batch(7, 0, values[0], 1_000_000) + batch(8, 1, values[0], 1_100_000)
    rows += batch(9, 1, values[1], 1_200_000)[:-1]
    path = write_dataflash(tmp_path / "a.bin", rows)
    log = zr.read_log(path, topic="ISB_gyro_0")
    assert (log.rate, log.unit, log.time[0]) == (4000, "rad/s", 1.1)
    there = ~np.isnan(log.data[:, 0])
    # The last message of the second batch, with four samples, is not there.
    sound = np.concatenate([values[0], values[1][:96]])
    np.testing.assert_array_equal(log.data[there], sound / 1000)
    assert np.flatnonzero(there)[100] == 400
    assert zr.read_recording(path, topic="ISB_accel_0", only=["accel"]).accel.rate == 4000
    note = "faster samples are read by topic=: ISB_gyro_0"
    assert any(note in one for one in zr.read_log(path).meta["notes"])
    assert "gyro_2" not in zr.read_recording(path).names


def test_a_number_of_a_batch_that_comes_again_is_another_batch(tmp_path):
    values = np.random.default_rng(1).integers(-3000, 3000, (2, 64, 3))
    rows = batch(7, 1, values[0], 1_000_000) + batch(7, 1, values[1], 1_032_000)
    log = zr.read_log(write_dataflash(tmp_path / "a.bin", rows), topic="ISB_gyro_0")
    there = ~np.isnan(log.data[:, 0])
    np.testing.assert_array_equal(log.data[there], values.reshape(-1, 3) / 1000)


def test_sensors_that_older_firmware_numbers(tmp_path):
    old = ("IffffffB", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,GH")
    kinds = {"IMU": old, "IMU2": old}
    rows = [(k, (20 * i, i, 0, 0, 0, 0, 9.8, 1)) for i in range(50) for k in kinds]
    recording = zr.read_recording(write_dataflash(tmp_path / "a.bin", rows, kinds, told=False))
    assert recording.names == ("gyro", "accel", "gyro_1", "accel_1")
    assert (recording.gyro.rate, recording["gyro_1"].meta["sensor"]) == (50, "IMU2")


def test_a_topic_is_chosen_by_name(tmp_path):
    path = write_dataflash(tmp_path / "a.bin", flight(N))
    assert zr.read_log(path, topic="IMU_1").meta["sensor"] == "IMU_1"
    assert zr.read_log(path, topic="BARO", columns="pressure_pa").data[0, 0] == 94144
    with pytest.raises(LogError, match="no topic 'XKF1'; the log has: ATT, BARO, FMT, "):
        zr.read_log(path, topic="XKF1")


def test_damaged_messages_are_left_out_and_noted(tmp_path):
    path = write_dataflash(tmp_path / "a.bin", flight(N))
    raw = bytearray(path.read_bytes())
    at = raw.index(b"\xa3\x95", len(raw) // 2)
    raw[at : at + 200] = b"\x55" * 200
    path.write_bytes(raw[:-4])
    log = zr.read_log(path)
    assert N - 5 < log.n - log.missing_count < N
    assert any("are damaged or unknown: they are left out" in one for one in log.meta["notes"])
    assert any("it was cut off" in one for one in log.meta["notes"])


def test_damaged_lines_are_left_out_and_noted(tmp_path):
    path = write_text(tmp_path / "a.log", flight(N))
    lines = path.read_text().split("\n")
    lines[60] = lines[60][:20]
    path.write_text("\n".join(lines))
    assert any("1 of its " in note for note in zr.read_log(path).meta["notes"])


def test_logs_that_hold_no_gyro_or_nothing(tmp_path):
    rows = [row for row in flight(N) if row[0] == "BARO"]
    with pytest.raises(LogError, match=r"no message holds a gyro, .*; the log has: BARO, "):
        zr.read_log(write_dataflash(tmp_path / "a.bin", rows))
    (tmp_path / "b.bin").write_bytes((tmp_path / "a.bin").read_bytes()[:50])
    with pytest.raises(LogError, match="cannot be read as a DataFlash log: truncated, damaged or"):
        zr.read_log(tmp_path / "b.bin")
    (tmp_path / "c.bin").write_bytes(b"\x00" * 50)
    with pytest.raises(LogError, match="by its content something else"):
        zr.read_log(tmp_path / "c.bin")


def assert_as_pymavlink(path):
    """Every field of every message as pymavlink has it."""
    reader = pytest.importorskip("pymavlink.DFReader").DFReader_binary(str(path))
    expected = {}
    while (message := reader.recv_msg()) is not None:
        expected.setdefault(message.get_type(), []).append(message)
    reader.close()
    log = parse_binary(path)
    found = {name: message for name, message in log.messages.items() if message.rows}
    assert set(found) == set(expected)
    for name, message in found.items():
        assert message.rows == len(expected[name])
        for field in message.names:
            values = message[field].tolist()
            texts = [v.partition(b"\0")[0].decode() if isinstance(v, bytes) else v for v in values]
            theirs = [getattr(one, field) for one in expected[name]]
            np.testing.assert_array_equal(texts, theirs, err_msg=f"{name}.{field}")
    return log


def test_every_field_is_as_pymavlink_reads_it(tmp_path):
    rows = flight(40) + batch(7, 1, np.arange(192).reshape(64, 3), 5_000_000)
    assert_as_pymavlink(write_dataflash(tmp_path / "a.bin", rows))


@needs_recordings
def test_a_real_log():
    path = RECORDINGS / "formats" / "ardupilot_test.BIN"
    log = assert_as_pymavlink(path)
    assert (log.lost_count, log.messages["IMU"].rows, log.messages["PARM"].rows) == (0, 45, 809)
    recording = zr.read_recording(path)
    lengths = np.linalg.norm(recording.accel.data, axis=1)
    np.testing.assert_allclose(np.nanmean(lengths), 9.8, atol=0.2)
    assert recording.gyro.meta["calibration"]["INS_GYROFFS_X"] != 0
