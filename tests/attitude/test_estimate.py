"""The attitude of a recording: what the filter gives, on the clock of the gyro."""

from dataclasses import replace

import numpy as np
import pytest

import zerorate as zr
from zerorate.geometry.frames import FRAMES, from_enu, in_enu
from zerorate.record import Log, LogError, Recording
from zerorate.record.samples import Samples

MOTION = zr.simulate_motion("hand", duration=20.0, seed=4)
RECORDING = MOTION.recording()


def with_log(name, log, recording=RECORDING):
    return Recording({**recording, name: log}, recording.source)


def without(*names):
    return Recording({k: v for k, v in RECORDING.items() if k not in names}, RECORDING.source)


def slowed(log, every, late=0.0):
    """Return every so many samples of a log, on a clock of their own that may be late."""
    time = log.time[::every] + late
    return Log(time, log.rate / every, log.data[::every], log.names, log.unit)


class TestSamples:
    def test_a_slower_sensor_stands_at_its_samples(self):
        found = Samples.of(with_log("mag", slowed(RECORDING.mag, 5)))
        np.testing.assert_array_equal(found.mag[::5], RECORDING.mag.data[::5])
        assert np.isnan(np.delete(found.mag, np.s_[::5], axis=0)).all()
        assert "20 Hz on a clock of their own" in " ".join(found.notes)

    def test_nothing_is_seen_before_its_time(self):
        found = Samples.of(with_log("accel", slowed(RECORDING.accel, 5, late=0.004)))
        # Taken 4 ms after a sample of the gyro, so first known at the one after it.
        np.testing.assert_array_equal(found.accel[1::5], RECORDING.accel.data[::5])
        assert np.isfinite(found.accel).all(axis=1).sum() == 400

    def test_of_several_the_last_one_counts(self):
        found = Samples.of(with_log("gyro", slowed(RECORDING.gyro, 4)))
        np.testing.assert_array_equal(found.accel, RECORDING.accel.data[::4])
        assert "1497 that a later one came with left out" in " ".join(found.notes)

    def test_what_comes_before_or_after_the_gyro_has_no_place(self):
        early = replace(RECORDING.mag, time=RECORDING.mag.time - 10.0)
        found = Samples.of(with_log("mag", early))
        assert np.isfinite(found.mag).all(axis=1).sum() == 1000

    def test_units_become_si(self):
        gyro = replace(RECORDING.gyro, data=np.degrees(RECORDING.gyro.data), unit="deg/s")
        accel = replace(RECORDING.accel, data=RECORDING.accel.data / 9.80665, unit="g")
        found = Samples.of(with_log("gyro", gyro, with_log("accel", accel)))
        np.testing.assert_allclose(found.gyro, RECORDING.gyro.data, rtol=1e-14)
        np.testing.assert_allclose(found.accel, RECORDING.accel.data, rtol=1e-14)

    def test_stamps_that_are_uneven_become_steps(self):
        assert Samples.of(RECORDING).dt is None
        time = RECORDING.gyro.time.copy()
        time[1000:] += 0.003
        dt = Samples.of(with_log("gyro", replace(RECORDING.gyro, time=time))).dt
        assert dt[999:1002] == pytest.approx([0.01, 0.013, 0.01], abs=1e-12)

    @pytest.mark.parametrize(
        ("recording", "match"),
        [
            (without("gyro"), "needs a gyro; there is no gyro, the recording has: accel"),
            (without("accel"), "needs an accelerometer; there is no accel"),
            (
                with_log("gyro", replace(RECORDING.gyro, unit="unit")),
                "gyro_z_radps: an attitude needs a gyro of a known unit, got 'unit'; give unit=",
            ),
            (
                with_log("accel", replace(RECORDING.accel, unit="deg/s")),
                "an accelerometer of a known unit, got 'deg/s'",
            ),
            (
                with_log("gyro", Log([0.0, 0.01], 100.0, np.ones((2, 2)), ["a", "b"], "deg/s")),
                "a, b: an attitude needs a gyro of three axes, got 2",
            ),
            (
                with_log("accel", RECORDING.accel.with_data(np.full((2000, 3), np.nan))),
                "no sample has all three axes",
            ),
        ],
    )
    def test_refusals(self, recording, match):
        with pytest.raises(LogError, match=match):
            Samples.of(recording)

    def test_a_sensor_that_was_asked_for_must_be_there(self):
        with pytest.raises(LogError, match="there is no accel_3"):
            Samples.of(RECORDING, accel="accel_3")


class TestEstimate:
    def test_it_is_what_the_filter_gives(self):
        found = zr.estimate_attitude(RECORDING)
        own = zr.Attitude(100.0).trace(MOTION.gyro, MOTION.accel, MOTION.mag)
        for name in ("quaternion", "bias", "tilt_sigma", "heading_sigma", "at_rest", "disturbed"):
            np.testing.assert_array_equal(getattr(found, name), own[name])
        np.testing.assert_array_equal(found.gyro_matrices, own["gyro_matrix"][found.moments])
        np.testing.assert_array_equal(found.gyro_matrix, own["gyro_matrix"][-1])

    def test_blocks_make_no_difference(self, monkeypatch):
        whole = zr.estimate_attitude(RECORDING)
        monkeypatch.setattr("zerorate.attitude.estimate._BLOCK_SAMPLES", 170)
        said = []
        parts = zr.estimate_attitude(RECORDING, progress=lambda step, part: said.append(part))
        np.testing.assert_array_equal(parts.quaternion, whole.quaternion)
        np.testing.assert_array_equal(parts.gyro_matrices, whole.gyro_matrices)
        assert said == sorted(said)
        assert said[-1] == 1.0

    def test_offline_is_what_smooth_gives(self):
        found = zr.estimate_attitude(RECORDING, offline=True)
        own = zr.Attitude(100.0).smooth(MOTION.gyro, MOTION.accel, MOTION.mag)
        np.testing.assert_array_equal(found.quaternion, own["quaternion"])
        assert found.errors().heading < zr.estimate_attitude(RECORDING).errors().heading

    def test_without_a_magnetometer(self):
        for found in (
            zr.estimate_attitude(RECORDING, mag=False),
            zr.estimate_attitude(without("mag")),
        ):
            own = zr.Attitude(100.0, mag=False).process(MOTION.gyro, MOTION.accel)
            np.testing.assert_array_equal(found.quaternion, own)
            assert not found.mag
        assert "there is no magnetometer" in found.notes[-1]

    @pytest.mark.parametrize("frame", FRAMES)
    def test_frames(self, frame):
        found = zr.estimate_attitude(RECORDING, frame=frame, reference_frame="enu")
        usual = zr.estimate_attitude(RECORDING)
        # Rotations by constants: the bits may differ, the angles not.
        for name in ("total", "heading", "inclination"):
            expected = getattr(usual.errors(), name)
            assert getattr(found.errors(), name) == pytest.approx(expected, rel=1e-9)
        np.testing.assert_allclose(
            from_enu(in_enu(found.quaternion, frame), frame), found.quaternion, atol=1e-14
        )

    @pytest.mark.parametrize("frame", FRAMES)
    def test_a_declination_turns_to_true_north(self, frame):
        """A needle that points 10 deg east of north: a body along it looks 10 deg east."""
        magnetic = zr.estimate_attitude(RECORDING, frame=frame)
        true = zr.estimate_attitude(RECORDING, frame=frame, declination=np.radians(10.0))
        # Clockwise from north in NED, anticlockwise from east or north in the others.
        turned = np.degrees(true.euler[:, 2] - magnetic.euler[:, 2])
        expected = 10.0 if frame == "ned" else -10.0
        np.testing.assert_allclose((turned + 180.0) % 360.0 - 180.0, expected, atol=1e-9)
        np.testing.assert_allclose(true.euler[:, :2], magnetic.euler[:, :2], atol=1e-12)

    def test_euler_angles_are_those_of_the_filter(self):
        filter_ = zr.Attitude(100.0, frame="ned")
        filter_.process(MOTION.gyro, MOTION.accel, MOTION.mag)
        found = zr.estimate_attitude(RECORDING, frame="ned")
        np.testing.assert_allclose(found.euler[-1], filter_.euler, atol=1e-12)
        expected = found.rotation.as_euler("ZYX")[:, ::-1]
        np.testing.assert_allclose(found.euler, expected, atol=1e-9)

    def test_lost_samples_take_their_time(self):
        lost = zr.simulate_motion(
            "hand", duration=60.0, errors=zr.simulation.MotionErrors(lost=0.03)
        )
        whole = zr.simulate_motion("hand", duration=60.0)
        found = zr.estimate_attitude(lost.recording()).errors().inclination
        # Three in a hundred, each held for a sample: a tenth of a degree at most.
        assert found < zr.estimate_attitude(whole.recording()).errors().inclination + 0.002
        blind = zr.Attitude(100.0).process(lost.gyro, lost.accel, lost.mag)
        assert zr.metrics.orientation_errors(blind, lost.quaternion).inclination > 2.0 * found

    def test_a_wrong_unit_of_the_accelerometer_is_a_note(self):
        still = np.tile([0.0, 0.0, 1.0], (1000, 1))
        gyro = Log(np.arange(1000) / 100, 100.0, 0.0 * still, ["x", "y", "z"], "rad/s")
        accel = Log(gyro.time, 100.0, still, ["ax", "ay", "az"], "m/s^2")
        found = zr.estimate_attitude(Recording({"gyro": gyro, "accel": accel}))
        assert "the accelerometer shows 1.000 m/s^2 at rest" in found.notes[0]

    def test_errors_need_a_reference(self):
        found = zr.estimate_attitude(without("reference"))
        with pytest.raises(ValueError, match="no true orientation"):
            found.errors()
        assert "Errors" not in found.table()

    @pytest.mark.parametrize(
        ("arguments", "match"),
        [
            ({"frame": "up"}, "frame must be"),
            ({"reference_frame": "up"}, "reference_frame must be one of enu, ned, nwu, got 'up'"),
            ({"method": "kf"}, "method must be"),
            ({"method": "ekf", "offline": True}, "smooth is for method 'auto'"),
            ({"declination": 10.0}, "declination must be -pi to pi rad, got 10.0"),
            ({"declination": 0.1, "mag": False}, "declination has no effect: no magnetometer"),
        ],
    )
    def test_refusals(self, arguments, match):
        with pytest.raises(ValueError, match=match):
            zr.estimate_attitude(RECORDING, **arguments)

    @pytest.mark.parametrize("method", ["complementary", "mahony", "madgwick", "ekf", "ukf"])
    def test_named_methods(self, method):
        found = zr.estimate_attitude(RECORDING, method=method)
        assert f"nine axes, {method}" in found.table()
        assert np.isfinite(found.quaternion).all()

    def test_the_log_is_read_back(self, tmp_path):
        found = zr.estimate_attitude(RECORDING)
        zr.write_log(found.to_log(), tmp_path / "a.csv")
        read = zr.read_recording(tmp_path / "a.csv")
        np.testing.assert_array_equal(read.reference.data, found.quaternion)
        assert read.names == ("reference",)
