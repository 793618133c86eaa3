"""Videos with the telemetry of a camera: made byte by byte, and a real one."""

import sys

import numpy as np
import pytest

import zerorate as zr
from support.gopros import write_gopro
from support.recordings import RECORDINGS, needs_recordings
from zerorate.record import LogError

pytest.importorskip("telemetry_parser")

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
    assert "the channels are z,x,y, of which x, y, z are made" in recording.gyro.meta["notes"]
    np.testing.assert_array_equal(recording.temperature.data[:, 0], [40, 41, 42, 43, 44])


def test_the_orientation_of_the_maker_turns_the_axes(tmp_path):
    gyro, accel = values()
    more = [(b"ORIN", b"YxZ"), (b"ORIO", b"ZXY")]
    path = write_gopro(tmp_path / "a.mp4", gyro, accel, more=more)
    log = zr.read_log(path)
    import telemetry_parser

    rows = telemetry_parser.Parser(str(path)).normalized_imu()
    expected = np.radians([row["gyro"] for row in rows])
    np.testing.assert_allclose(log.data, expected, rtol=1e-12)
    assert any("axes are turned by the orientation" in note for note in log.meta["notes"])
    assert not np.array_equal(np.round(log.data * 3755), gyro)


def test_a_video_without_a_gyro_says_what_is_in_it(tmp_path):
    path = write_gopro(tmp_path / "a.mp4", np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(
        LogError, match=r"no gyro is found in this file of GoPro; there is: |cannot"
    ):
        zr.read_log(path)
    (tmp_path / "b.mp4").write_bytes(b"\0\0\0\x14ftypmp41" + bytes(500))
    with pytest.raises(LogError, match="cannot be read as a video or flight recorder"):
        zr.read_log(tmp_path / "b.mp4")


def test_the_extra_is_named_where_it_is_missing(tmp_path, monkeypatch):
    path = write_gopro(tmp_path / "a.mp4", *values())
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
    with pytest.raises(LogError, match="no gyro is found in this file of BlackBox Betaflight"):
        zr.read_log(RECORDINGS / "formats" / "betaflight_error_recovery.bbl")
