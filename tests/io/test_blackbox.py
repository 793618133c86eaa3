"""Blackbox logs of flight controllers, encoded field by field, and a real one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import zerorate as zr
from support.blackboxes import (
    BY_MASK,
    FOUR,
    INTRA_EVERY,
    SINGLE,
    THREE,
    THREE_VARIABLE,
    encode,
    write_blackbox,
)
from support.recordings import RECORDINGS, needs_recordings
from zerorate._native import read_blackbox
from zerorate.record import LogError

FIELDS = ["gyroADC", "accSmooth", "motor", "debug"]


def flight(rng, n=100, step=30):
    """Return times, us, from anywhere in the range of the clock, and values that walk."""
    values = np.cumsum(rng.integers(-step, step + 1, (n, 14)), axis=0)
    values[:, 6:10] = np.abs(values[:, 6:10])
    return np.cumsum(rng.integers(900, 1100, n)) + rng.integers(0, 2**32), values


def decode(raw):
    ((_, names, columns, lost, size),) = read_blackbox(np.frombuffer(raw, np.uint8), FIELDS)
    assert names[0] == "time"
    return columns[0], np.column_stack(columns[1:]), lost, size


@settings(deadline=None)
@given(
    st.integers(0, 2**32),
    st.sampled_from([1, 3, 30, 300, 3000, 10**6]),
    st.tuples(*[st.sampled_from([SINGLE, BY_MASK, THREE, THREE_VARIABLE])] * 2),
    st.tuples(*[st.sampled_from([SINGLE, BY_MASK, FOUR])] * 2),
)
def test_every_encoding_is_decoded(seed, step, triads, fours):
    if step > 300:  # sixteen bits hold no more
        fours = (SINGLE, BY_MASK)
    time, values = flight(np.random.default_rng(seed), step=step)
    found, decoded, lost, _ = decode(encode(time, values, (*triads, *fours)))
    assert lost == 0
    np.testing.assert_array_equal(decoded, values)
    np.testing.assert_array_equal(np.diff(found), np.diff(time))  # the clock may wrap


def test_units_axes_and_notes(tmp_path):
    time, values = flight(np.random.default_rng(1))
    recording = zr.read_recording(write_blackbox(tmp_path / "a.bbl", time, values))
    np.testing.assert_allclose(recording.gyro.data, values[:, :3])
    np.testing.assert_allclose(recording.accel.data, values[:, 3:6] / 2048)
    assert (recording.gyro.unit, recording.accel.unit) == ("deg/s", "g")
    assert recording.gyro.meta["sensor"] == ("Betaflight 4.4.2 (test) STM32F7X2, TEST BOARD gyro")
    assert "the flight controller has filtered this gyro" in recording.gyro.meta["notes"]


@pytest.mark.parametrize(
    ("headers", "scale"),
    [
        ({"gyro_scale": "0x3f800000"}, 1.0),
        ({"gyro_scale": "0x3f800000", "blackbox_high_resolution": "1"}, 0.1),
        # 1 / 16.4 deg/s in rad/us, as Cleanflight states it.
        ({"gyro_scale": "0x30924a0b"}, 1 / 16.4),
    ],
)
def test_scales_of_the_gyro(tmp_path, headers, scale):
    time, values = flight(np.random.default_rng(2))
    log = zr.read_log(write_blackbox(tmp_path / "a.bbl", time, values, **headers))
    np.testing.assert_allclose(log.data, scale * values[:, :3], rtol=1e-3)


def test_the_unfiltered_gyro_has_its_own_topic(tmp_path):
    time, values = flight(np.random.default_rng(3))
    names = "loopIteration,time,gyroADC[0],gyroADC[1],gyroADC[2],gyroUnfilt[0],gyroUnfilt[1]," + (
        "gyroUnfilt[2],motor[0],motor[1],motor[2],motor[3],debug[0],debug[1],debug[2],debug[3]"
    )
    path = write_blackbox(tmp_path / "a.bbl", time, values, **{"Field_0I_0name": names})
    np.testing.assert_allclose(zr.read_log(path).data, values[:, :3])
    raw = zr.read_log(path, topic="gyro_unfiltered")
    np.testing.assert_allclose(raw.data, values[:, 3:6])


def test_of_several_logs_the_longest_is_read(tmp_path):
    rng = np.random.default_rng(4)
    short, long = flight(rng, 40), flight(rng, 90)
    path = tmp_path / "a.bbl"
    path.write_bytes(encode(*short) + encode(*long))
    recording = zr.read_recording(path)
    np.testing.assert_allclose(recording.gyro.data, long[1][:, :3])
    assert "the file has 2 logs: log 2, the longest, is read" in recording.gyro.meta["notes"]
    np.testing.assert_allclose(zr.read_log(path, topic="1/gyro").data, short[1][:, :3])


@settings(deadline=None)
@given(st.integers(0, 2**32))
def test_no_difference_is_taken_from_a_damaged_frame(seed):
    rng = np.random.default_rng(seed)
    time, values = flight(rng)
    time -= time[0] - 1000
    raw = bytearray(encode(time, values))
    begin = raw.index(b"S\x05") + 2
    # Bytes that are lost leave a frame that ends in another, or is not followed by one.
    at = int(rng.integers(begin, len(raw) - 40))
    del raw[at : at + int(rng.integers(1, 30))]
    found, decoded, lost, _ = decode(bytes(raw))
    rows = {int(t): tuple(row) for t, row in zip(time, values, strict=True)}
    # A frame that still looks whole may be wrong, and others by it, up to the next intra frame.
    wrong = [t for t, row in zip(found, decoded, strict=True) if rows.get(int(t)) != tuple(row)]
    assert len(wrong) < INTRA_EVERY
    assert len(found) > len(time) - 3 * INTRA_EVERY
    assert lost > 0 or not wrong


def test_what_has_no_gyro_is_refused(tmp_path):
    time, values = flight(np.random.default_rng(5))
    path = write_blackbox(tmp_path / "a.bbl", time, values, gyro_scale="much")
    with pytest.raises(LogError, match=r"as a blackbox log: .*gyro_scale is 'much'"):
        zr.read_log(path)
    path.write_bytes(b"H Product:Blackbox flight data recorder by Nicholas Sherlock\nH a:b\n")
    with pytest.raises(LogError, match="no gyro is found in this log of unknown firmware; it has"):
        zr.read_log(path)


@needs_recordings
def test_a_real_log_with_damage():
    recording = zr.read_recording(RECORDINGS / "formats" / "betaflight_error_recovery.bbl")
    assert recording.gyro.n == recording.accel.n
    np.testing.assert_allclose(recording.accel.data[:, 2], 1.0, atol=0.01)
    np.testing.assert_allclose(recording.gyro.data[:1], [[0.0, 1.0, 0.0]])
    assert "126 of 240 bytes are damaged: they are left out" in recording.gyro.meta["notes"]
