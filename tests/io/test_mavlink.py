"""Telemetry logs of MAVLink: their packets as sensors, fixes and attitudes; damage is told."""

import numpy as np
import pytest

import zerorate as zr
from support.tlogs import packet, record
from zerorate.io import read_recording
from zerorate.record import LogError

N = 200
COUNTS = np.random.default_rng(5).integers(-500, 500, (N, 9))
G = 9.80665


def scaled(name, n, version=2, counts=COUNTS, **more):
    return packet(name, n * 20, *counts[n].tolist(), 2500, version=version, **more)


def raw(n, version=2):
    return packet("RAW_IMU", n * 20_000, *COUNTS[n].tolist(), 0, 0, version=version)


def write(tmp_path, *packets, name="a.tlog"):
    path = tmp_path / name
    path.write_bytes(b"".join(record(n / 50, one) for n, one in enumerate(packets)))
    return path


def flight(version=2):
    heartbeat = packet("HEARTBEAT", 0, 2, 3, 81, 3, 3, version=version)
    for n in range(N):
        yield scaled("SCALED_IMU", n, version)
        yield scaled("SCALED_IMU2", n, version, COUNTS[::-1])
        yield heartbeat
        place = (481234567, 115678901, 520_000)
        moved = (100, 65535, 500, 9000, 3 if n > 9 else 1, 12)
        yield packet("GPS_RAW_INT", n * 20_000, *place, *moved, version=version)
        yield packet("ATTITUDE", n * 20, 0.0, 0.0, np.pi / 2, 0.0, 0.0, 0.0, version=version)


@pytest.mark.parametrize("version", [1, 2])
def test_a_flight_of_two_imus(tmp_path, version):
    recording = read_recording(write(tmp_path, *flight(version)))
    first, second = (recording[name] for name in ("gyro", "gyro_1"))
    np.testing.assert_allclose(first.data, COUNTS[:, 3:6] * 1e-3)
    np.testing.assert_allclose(second.data, COUNTS[::-1, 3:6] * 1e-3)
    np.testing.assert_allclose(recording.accel.data, COUNTS[:, :3] * 1e-3 * G)
    np.testing.assert_allclose(recording.mag.data, COUNTS[:, 6:] * 1e-3)
    assert (first.unit, recording.accel.unit, recording.mag.unit) == ("rad/s", "m/s^2", "gauss")
    assert first.rate == pytest.approx(50.0)
    assert np.all(recording["temperature"].data == 25.0)
    half = np.sqrt(0.5)
    np.testing.assert_allclose(recording.reference.data[0], [half, 0.0, 0.0, half], atol=1e-7)
    assert any("autopilot's own estimate" in note for note in recording.reference.meta["notes"])


def test_fixes_are_read_and_missing_until_there_is_one(tmp_path):
    fixes = zr.read_fixes(write(tmp_path, *flight()))
    assert len(fixes.time) == N - 10
    assert fixes.position[0, 0] == pytest.approx(48.1234567)
    np.testing.assert_allclose(fixes.velocity[0, :2], [0.0, 5.0], atol=1e-9)


def test_the_same_sensor_told_twice_is_read_once(tmp_path):
    packets = (one for n in range(N) for one in (raw(n), scaled("SCALED_IMU", n)))
    recording = read_recording(write(tmp_path, *packets, raw(N - 1)))
    assert [name for name in recording if name.startswith("gyro")] == ["gyro"]
    assert recording.gyro.meta["sensor"] == "RAW_IMU"


def test_an_imu_of_high_resolution_comes_first(tmp_path):
    values = (0.01, 0.02, 9.8, 0.1, 0.2, 0.3, 0.2, 0.0, 0.4, 0.0, 0.0, 0.0, 0.0)
    highres = (packet("HIGHRES_IMU", n * 20_000, *values, 0, 0) for n in range(N))
    packets = (one for n, high in enumerate(highres) for one in (high, raw(n)))
    recording = read_recording(write(tmp_path, *packets))
    np.testing.assert_allclose(recording.gyro.data, np.tile([0.1, 0.2, 0.3], (N, 1)), rtol=1e-6)
    assert "temperature" not in recording or np.isnan(recording["temperature"].data).all()


def test_each_vehicle_has_topics_of_its_own(tmp_path):
    others = [scaled("SCALED_IMU", n, system=7, counts=COUNTS * 2) for n in range(N // 2)]
    path = write(tmp_path, *(scaled("SCALED_IMU", n) for n in range(N)), *others)
    assert zr.read_log(path).n == N
    np.testing.assert_allclose(
        zr.read_log(path, topic="SCALED_IMU/7").data, COUNTS[: N // 2, 3:6] * 2e-3
    )


def test_signed_packets(tmp_path):
    path = write(tmp_path, *(scaled("SCALED_IMU", n, signed=True) for n in range(N)))
    assert zr.read_log(path).n == N


def test_damage_is_told_and_the_rest_is_read(tmp_path):
    path = write(tmp_path, *(scaled("SCALED_IMU", n) for n in range(N)))
    whole = path.read_bytes()
    size = len(whole) // N
    bad = bytearray(whole)
    bad[50 * size + 25] ^= 4
    path.write_bytes(bytes(bad[: 100 * size]) + b"\xfd\xfe lost" + bytes(bad[100 * size : -5]))
    log = zr.read_log(path)
    told = " ".join(log.meta["notes"])
    assert "1 packets have a wrong checksum" in told
    assert "bytes are no packet" in told
    assert np.isfinite(log.data[:, 0]).sum() >= N - 5


@pytest.mark.parametrize("cut", [0, 5, 9, 30])
def test_what_holds_no_sensor_is_refused(tmp_path, cut):
    path = write(tmp_path, packet("HEARTBEAT", 0, 2, 3, 81, 3, 3))
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(LogError):
        zr.read_log(path)


def test_any_bytes_are_refused_or_read(tmp_path):
    """Damage of every kind, as `make fuzz` searches for more."""
    rng = np.random.default_rng(0)
    whole = np.frombuffer(write(tmp_path, *list(flight())[:200]).read_bytes(), np.uint8)
    path = tmp_path / "b.tlog"
    for _ in range(100):
        changed = whole.copy()
        at = rng.integers(_STARTS, len(changed), 20)
        changed[at] = rng.integers(0, 256, 20)
        path.write_bytes(changed[: rng.integers(9, len(changed))].tobytes())
        try:
            recording = read_recording(path)
        except LogError:
            continue
        assert all(log.n for log in recording.values())


_STARTS = 9
"""What a file is known by."""


def test_values_as_pymavlink_has_them(tmp_path, monkeypatch):
    monkeypatch.setenv("MAVLINK20", "1")
    from pymavlink import mavutil

    path = write(tmp_path, *flight(1))
    theirs = mavutil.mavlink_connection(str(path))
    rates = []
    while (message := theirs.recv_match(type="SCALED_IMU")) is not None:
        rates.append((message.xgyro, message.ygyro, message.zgyro))
    theirs.close()
    np.testing.assert_allclose(zr.read_log(path).data, np.array(rates) * 1e-3)
