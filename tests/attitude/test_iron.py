"""A magnetometer's hard iron that is learned while the attitude is estimated."""

import copy
import math
import pickle

import numpy as np
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.record.samples import Samples

IRON = np.array([9.0, -14.0, 6.0])
RATE = 100.0
DEG = np.pi / 180.0


def moved(kind="hand", duration=60.0, seed=100):
    """Gyro, accelerometer, true field and orientation of a simulated motion."""
    errors = zr.simulation.MotionErrors(field_wander=math.radians(4.5))
    recording = zr.simulate_motion(kind, RATE, duration, seed=seed, errors=errors).recording()
    samples = Samples.of(recording)
    return samples.gyro, samples.accel, samples.mag, samples.align(recording["reference"])


@pytest.fixture(scope="module")
def hand():
    return moved()


def learned(gyro, accel, mag, **arguments):
    f = zr.Attitude(RATE, learn_magnetometer=True, **arguments)
    return f, f.process(gyro, accel, mag)


def raw(gyro, accel, mag):
    return zr.Attitude(RATE).process(gyro, accel, mag)


def heading(q, truth, where):
    return zr.metrics.orientation_errors(q, truth, where=where, heading="absolute").heading / DEG


def second_half(truth):
    return np.arange(len(truth)) >= len(truth) // 2


def test_hard_iron_is_learned_within_its_errors(hand):
    gyro, accel, true, truth = hand
    f, q = learned(gyro, accel, true + IRON)
    assert f.magnetometer_state == "known"
    assert np.all(np.abs(f.hard_iron - IRON) < 3.0 * f.hard_iron_sigma)
    assert np.all(f.hard_iron_sigma < 2.0)
    late = second_half(truth)
    assert heading(q, truth, late) < 4.0 < heading(raw(gyro, accel, true + IRON), truth, late)


def test_without_iron_every_answer_is_equal_to_the_last_bit(hand):
    gyro, accel, true, _ = hand
    f, q = learned(gyro, accel, true)
    assert f.magnetometer_state == "raw"
    np.testing.assert_array_equal(q, raw(gyro, accel, true))
    assert not f.hard_iron.any()
    assert np.isnan(f.hard_iron_sigma).all()


def test_iron_moves_neither_tilt_nor_bias_nor_matrix(hand):
    gyro, accel, true, _ = hand
    without = zr.Attitude(RATE).trace(gyro, accel, true)
    found = zr.Attitude(RATE, learn_magnetometer=True).trace(gyro, accel, true + IRON)
    for name in ("bias", "bias_sigma", "gyro_matrix", "gyro_matrix_sigma", "tilt_sigma"):
        np.testing.assert_array_equal(found[name], without[name])
    np.testing.assert_allclose(
        found["linear_acceleration"], without["linear_acceleration"], atol=1e-9
    )


@pytest.mark.parametrize("factor", [0.01, 6.842])
def test_units_do_not_matter(hand, factor):
    gyro, accel, true, _ = hand
    f, q = learned(gyro, accel, true + IRON)
    other, found = learned(gyro, accel, factor * (true + IRON))
    np.testing.assert_allclose(found, q, atol=1e-9)
    np.testing.assert_allclose(other.hard_iron, factor * f.hard_iron, rtol=1e-9)


def test_rotated_axes_rotate_the_answer(hand):
    gyro, accel, true, _ = hand
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    f, _ = learned(gyro, accel, true + IRON)
    other, _ = learned(gyro @ turn.T, accel @ turn.T, (true + IRON) @ turn.T)
    np.testing.assert_allclose(other.hard_iron, turn @ f.hard_iron, atol=1e-6)


@pytest.mark.parametrize("every", [5, 10])
def test_a_magnetometer_slower_than_the_gyro(hand, every):
    gyro, accel, true, _ = hand
    mag = np.full_like(true, np.nan)
    mag[::every] = true[::every] + IRON
    f, _ = learned(gyro, accel, mag)
    assert f.magnetometer_state in ("known", "kept")
    assert np.abs(f.hard_iron - IRON).max() < 2.0


def test_missing_samples(hand):
    gyro, accel, true, _ = hand
    mag = true + IRON
    mag[np.random.default_rng(0).random(len(mag)) < 0.3] = np.nan
    mag[2000:2500] = np.nan
    f, q = learned(gyro, accel, mag)
    assert np.isfinite(q).all()
    assert np.abs(f.hard_iron - IRON).max() < 2.0


def test_no_magnetometer(hand):
    gyro, accel, _, _ = hand
    f = zr.Attitude(RATE, learn_magnetometer=True)
    np.testing.assert_array_equal(f.process(gyro, accel), zr.Attitude(RATE).process(gyro, accel))
    assert f.magnetometer_state == "raw"
    with pytest.raises(ValueError, match=r"^learn_magnetometer has no effect with mag=False$"):
        zr.Attitude(RATE, mag=False, learn_magnetometer=True)
    with pytest.raises(ValueError, match="learn_magnetometer has no effect on method 'mahony'"):
        zr.Attitude(RATE, method="mahony", learn_magnetometer=True)


def test_a_constant_one_is_no_field(hand):
    """What is held while the body turns says nothing of iron, nor of the heading."""
    gyro, accel, true, truth = hand
    mag = np.broadcast_to(true[0], true.shape)
    f, q = learned(gyro, accel, mag)
    assert (f.magnetometer_state, f.status) == ("raw", "magnetometer stuck")
    np.testing.assert_array_equal(q, raw(gyro, accel, mag))
    assert heading(q, truth, second_half(truth)) < 1.5


@pytest.mark.parametrize("spoil", ["stuck", "saturated"])
def test_a_bad_axis_makes_nothing_worse(hand, spoil):
    gyro, accel, true, truth = hand
    mag = true + IRON
    if spoil == "stuck":
        mag[:, 2] = 12.0
    else:
        mag[:, 0] = np.clip(mag[:, 0], -40.0, 40.0)
    _, q = learned(gyro, accel, mag)
    every = np.ones(len(truth), dtype=bool)
    assert heading(q, truth, every) < 1.02 * heading(raw(gyro, accel, mag), truth, every)


def test_a_magnet_that_comes_and_goes():
    gyro, accel, true, truth = moved(duration=120.0, seed=102)
    mag, magnet = true.copy(), [30.0, -10.0, 40.0]
    mag[2000:9000] += magnet
    f, q = learned(gyro[:9000], accel[:9000], mag[:9000])
    assert f.magnetometer_state == "known"
    assert np.abs(f.hard_iron - magnet).max() < 2.0
    with_magnet = np.arange(9000) >= 6000
    worse = heading(raw(gyro[:9000], accel[:9000], mag[:9000]), truth[:9000], with_magnet)
    assert heading(q, truth[:9000], with_magnet) < min(worse, 2.0)
    f.process(gyro[9000:], accel[9000:], mag[9000:])
    assert f.magnetometer_state == "kept"
    assert np.abs(f.hard_iron).max() < 2.0


def test_on_top_of_a_calibration(hand):
    gyro, accel, true, _ = hand
    errors = zr.simulation.MotionErrors(field_wander=math.radians(4.5))
    recording = zr.simulate_motion("hand", RATE, 60.0, seed=100, errors=errors).recording()
    logs = dict(recording)
    logs["mag"] = logs["mag"].with_data(recording.mag.data + IRON)
    cal = zr.calibrate_magnetometer(type(recording)(**{**vars(recording), "logs": logs}))
    assert cal.applied
    same = zr.Attitude(RATE, magnetometer=cal).process(gyro, accel, true + IRON)
    f, q = learned(gyro, accel, true + IRON, magnetometer=cal)
    np.testing.assert_array_equal(q, same)
    assert f.magnetometer_state == "raw"
    more = np.array([-12.0, 8.0, 5.0])
    f, _ = learned(gyro, accel, true + IRON + more, magnetometer=cal)
    assert np.abs(f.hard_iron - more).max() < 3.0


def test_goes_on_from_a_checkpoint(hand):
    gyro, accel, true, _ = hand
    _, q = learned(gyro, accel, true + IRON)
    f, _ = learned(gyro[:3210], accel[:3210], true[:3210] + IRON)
    assert f.magnetometer_state == "known"
    for other in (pickle.loads(pickle.dumps(f)), copy.deepcopy(f)):
        rest = other.process(gyro[3210:], accel[3210:], true[3210:] + IRON)
        np.testing.assert_array_equal(rest, q[3210:])
        assert repr(other) == "Attitude(rate=100.0, learn_magnetometer=True)"


def test_a_gap_and_an_alignment_keep_what_is_known(hand):
    gyro, accel, true, _ = hand
    f, _ = learned(gyro[:3000], accel[:3000], true[:3000] + IRON)
    iron = f.hard_iron
    f.update(gyro[3000], accel[3000], true[3000] + IRON, dt=20.0)
    f.process(gyro[3001:3300], accel[3001:3300], true[3001:3300] + IRON)
    np.testing.assert_allclose(f.hard_iron, iron)
    assert f.magnetometer_state == "kept"
    f.reset()
    assert f.magnetometer_state == "raw"
    assert not f.hard_iron.any()


def test_channels(hand):
    gyro, accel, true, _ = hand
    both = [np.stack([x, x], axis=1) for x in (gyro, accel, true)]
    both[2][:, 1] += IRON
    f = zr.Attitude(RATE, learn_magnetometer=True, channels=2)
    q = f.process(*both)
    assert f.magnetometer_state == ["raw", "known"]
    assert f.hard_iron.shape == f.hard_iron_sigma.shape == (2, 3)
    np.testing.assert_array_equal(q[:, 1], learned(gyro, accel, true + IRON)[1])


def test_what_does_not_learn():
    f = zr.Attitude(RATE)
    assert f.magnetometer_state == "raw"
    assert np.isnan(f.hard_iron).all()
    assert np.isnan(f.hard_iron_sigma).all()


BROAD = {
    5: "broad_05_undisturbed_slow_rotation_with_breaks_B",
    32: "broad_32_disturbed_attached_magnet_1cm",
}


def trial(number):
    table = pq.read_table(RECORDINGS / f"{BROAD[number]}.parquet")

    def columns(names):
        return np.column_stack([table[name].to_numpy() for name in names]).astype(float)

    units = {"gyro": "radps", "accel": "mps2", "mag": "ut"}
    sensors = [columns([f"{s}_{x}_{units[s]}" for x in "xyz"]) for s in units]
    moving = table["movement"].to_numpy(zero_copy_only=False) > 0
    return sensors, columns([f"ref_quat_{x}" for x in "wxyz"]), moving


@needs_recordings
def test_an_undisturbed_recording_is_as_it_was():
    sensors, _, _ = trial(5)
    rate = 2000.0 / 7.0
    expected = zr.Attitude(rate).trace(*sensors)
    found = zr.Attitude(rate, learn_magnetometer=True).trace(*sensors)
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)


@needs_recordings
def test_a_recording_with_a_magnet():
    sensors, reference, moving = trial(32)
    f = zr.Attitude(2000.0 / 7.0, learn_magnetometer=True)
    assert heading(f.process(*sensors), reference, moving) <= 2.0  # 1.09; 4.22 as it is
