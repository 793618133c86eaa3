"""Videos with the telemetry of a GoPro: made byte by byte, and a real one."""

import sys
from importlib.util import find_spec
from itertools import permutations, product

import numpy as np
import pytest

import zerorate as zr
from support.gopros import write_gopro
from support.recordings import RECORDINGS, needs_recordings
from zerorate.record import LogError

N, RATE = 1000, 200


def values():
    rng = np.random.default_rng(3)
    gyro, accel = rng.integers(-3000, 3000, (N, 3)), rng.integers(-3000, 3000, (N // 2, 3))
    return gyro, accel


def test_raw_values_with_their_scale_unit_temperature_and_clock(tmp_path):
    gyro, accel = values()
    recording = zr.read_recording(write_gopro(tmp_path / "a.mp4", gyro, accel))
    # The channels are z, x, y.
    np.testing.assert_allclose(recording.gyro.data, gyro[:, [1, 2, 0]] / 3755, rtol=1e-15)
    np.testing.assert_allclose(recording.accel.data, accel[:, [1, 2, 0]] / 418, rtol=1e-15)
    assert (recording.gyro.unit, recording.accel.unit) == ("rad/s", "m/s^2")
    assert (recording.gyro.rate, recording.accel.rate) == (RATE, RATE / 2)
    assert (recording.gyro.time[0], recording.gyro.meta["format"]) == (5.0, "camera")
    assert recording.gyro.meta["sensor"].startswith("GoPro")
    assert "the channels are z,x,y: they are reordered to x, y, z" in recording.gyro.meta["notes"]
    np.testing.assert_array_equal(recording.temperature.data[:, 0], [40, 41, 42, 43, 44])


def test_the_orientation_of_the_maker_turns_the_axes(tmp_path):
    gyro, accel = values()
    for letters, signs in product(permutations("XYZ"), product((1, -1), repeat=3)):
        axes = [a if sign > 0 else a.lower() for a, sign in zip(letters, signs, strict=True)]
        more = [(b"ORIN", "".join(axes).encode()), (b"ORIO", b"ZXY")]
        log = zr.read_log(write_gopro(tmp_path / "a.mp4", gyro, accel, more=more))
        expected = np.empty((N, 3))
        expected[:, ["XYZ".index(a) for a in letters]] = gyro * signs
        np.testing.assert_allclose(log.data, expected / 3755, rtol=1e-15)
        assert f"axes are turned by the orientation {''.join(axes)}" in log.meta["notes"]


@pytest.mark.parametrize("more", [[], [(b"ORIN", b"YxZ"), (b"ORIO", b"ZXY")]])
def test_values_are_those_of_telemetry_parser(tmp_path, more):
    parser = pytest.importorskip("telemetry_parser").Parser
    path = write_gopro(tmp_path / "a.mp4", *values(), more=more)
    rows = np.radians([row["gyro"] for row in parser(str(path)).normalized_imu()])
    # It keeps the order Z, X, Y of the channels.
    np.testing.assert_allclose(zr.read_log(path).data, rows[:, [1, 2, 0]], rtol=1e-12)


def test_lost_samples_are_a_gap(tmp_path):
    gyro, accel = values()
    path = write_gopro(tmp_path / "a.mp4", gyro, accel, lost=2)
    log = zr.read_log(path)
    is_lost = np.isnan(log.data[:, 0])
    np.testing.assert_array_equal(np.flatnonzero(is_lost), 2 * RATE + np.arange(RATE))
    expected = gyro[~is_lost][:, [1, 2, 0]] / 3755
    np.testing.assert_allclose(log.data[~is_lost], expected, rtol=1e-15)


def test_damaged_packets_are_left_out(tmp_path):
    path = write_gopro(tmp_path / "a.mp4", *values())
    raw = bytearray(path.read_bytes())
    at = raw.index(b"STRM", raw.index(b"DEVC", raw.index(b"DEVC") + 4))
    raw[at + 6 : at + 8] = b"\xff\xff"
    path.write_bytes(raw)
    log = zr.read_log(path)
    assert "1 of 5 packets are damaged: they are left out" in log.meta["notes"]
    assert np.isfinite(log.data[:, 0]).sum() == N - RATE


def test_fixes_of_the_receiver(tmp_path):
    rng = np.random.default_rng(5)
    fixes = np.column_stack(
        [rng.normal(47.0, 1e-4, 90), rng.normal(8.0, 1e-4, 90), np.full(90, 431.5)]
    )
    path = write_gopro(tmp_path / "a.mp4", *values(), fixes=fixes)
    found = zr.read_fixes(path)
    np.testing.assert_allclose(found.position, fixes, rtol=0, atol=1.1e-3)
    np.testing.assert_allclose(np.diff(found.time), 1 / 18, atol=2e-6)


def test_a_video_without_a_gyro_says_what_is_in_it(tmp_path):
    path = write_gopro(tmp_path / "a.mp4", np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(
        LogError, match=r"no gyro is found in this file of GoPro; there is: Exposure time$"
    ):
        zr.read_log(path)


def test_a_video_of_another_camera_says_what_it_needs(tmp_path, monkeypatch):
    path = tmp_path / "b.mp4"
    path.write_bytes(b"\0\0\0\x14ftypmp41" + bytes(500))
    if find_spec("telemetry_parser") is not None:
        with pytest.raises(LogError, match="cannot be read as a video with telemetry"):
            zr.read_log(path)
    monkeypatch.setitem(sys.modules, "telemetry_parser", None)
    monkeypatch.setattr("zerorate.io.readers.camera.find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"needs telemetry_parser: run pip install '.\[camera\]'"):
        zr.read_log(path)
    monkeypatch.setattr("zerorate.io.readers.camera.sys.version_info", (3, 13, 0))
    with pytest.raises(ImportError, match=r"checkout of zerorate, with Python 3\.12 or older$"):
        zr.read_log(path)


@needs_recordings
def test_a_real_video():
    recording = zr.read_recording(RECORDINGS / "formats" / "gopro_karma.mp4")
    assert (recording.gyro.n, recording.accel.n) == (4795, 2397)
    assert (round(recording.gyro.rate), round(recording.accel.rate)) == (398, 199)
    # Upright: the specific force points up, along z.
    np.testing.assert_allclose(recording.accel.data.mean(axis=0)[2], 9.7, atol=0.5)
    lengths = np.linalg.norm(recording.accel.data, axis=1)
    np.testing.assert_allclose(lengths.mean(), 9.79, atol=0.1)
    assert recording.gyro.meta["sensor"] == "GoPro HERO5 Black gyro"
