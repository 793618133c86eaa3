"""The joint fit: truth within its errors, and the laws that it keeps."""

import itertools

import numpy as np
import pytest

import zerorate as zr
from oracle.turns import turn as slow_turn
from support.calibrated import calibration, deviations, session, sigmas, with_data
from zerorate.geometry.rotations import from_matrices, to_rotation_vectors

DEG = np.pi / 180.0
SEEDS = range(1, 7)
DIAGONAL = [0, 4, 8]
ACCEL = [0, 3, 4, 6, 7, 8, 9, 10, 11]
GYRO = slice(12, 21)
G = slice(24, 33)


def rms(errors):
    return float(np.sqrt(np.mean(np.square(errors))))


@pytest.fixture(scope="module", params=[9, 20], ids="{} poses".format)
def sessions(request):
    """Calibrations of some sessions, and the truth."""
    found = [zr.simulation.simulate_session(request.param, seed=seed) for seed in SEEDS]
    return request.param, [(zr.calibration.calibrate(one.recording), one.truth) for one in found]


class TestTruth:
    # RMS over six sessions: accelerometer's scale and bias (g), gyro's scale and cross terms.
    # Twice what is usual: few sessions tell an RMS badly, and a bad set of poses counts much.
    MOST = {  # noqa: RUF012
        9: (1e-3, 0.8e-3, 1.2e-3, 1.4e-3),
        20: (0.3e-3, 0.25e-3, 0.3e-3, 0.5e-3),
    }

    def test_errors_are_those_of_the_method(self, sessions):
        poses, found = sessions
        errors = np.array([one.values - truth.values for one, truth in found])
        cross = np.delete(errors[:, GYRO], DIAGONAL, axis=1)
        seen = (errors[:, DIAGONAL], errors[:, 9:12], errors[:, GYRO][:, DIAGONAL], cross)
        assert [rms(one) < most for one, most in zip(seen, self.MOST[poses], strict=True)] == [
            True
        ] * 4

    def test_nine_in_ten_errors_are_within_two_sigma(self, sessions):
        _, found = sessions
        z = np.array(
            [(one.values - truth.values) / np.maximum(sigmas(one), 1e-300) for one, truth in found]
        )
        for places in (ACCEL, GYRO, G):
            # Of 54 normal deviates 51.5 are within two, 49 or more in nine cases of ten.
            assert np.mean(np.abs(z[:, places]) < 2.0) >= 0.9
            assert rms(z[:, places]) < 1.25

    def test_all_are_valid_and_complete(self, sessions):
        poses, found = sessions
        for one, _ in found:
            assert one.valid, one.problems
            assert one.identifiable.all()
            assert len(one.rests) == poses
            assert len(one.turns) == poses - 1
            assert one.held_out == (poses >= 12)

    def test_the_covariance_is_one(self, sessions):
        for one, _ in sessions[1]:
            covariance = one.covariance
            assert (covariance == covariance.T).all()
            size = np.sqrt(np.maximum(np.diagonal(covariance), 1e-300))
            assert np.linalg.eigvalsh(covariance / np.outer(size, size))[0] > -1e-9
            # In the axes of the accelerometer its matrix is lower triangular.
            assert (np.diagonal(covariance)[[1, 2, 5]] == 0.0).all()
            assert (one.values[[1, 2, 5]] == 0.0).all()


def test_errors_are_a_tenth_of_those_before():
    found = calibration()
    assert found.norm_error < 0.1 * found.norm_error_raw
    assert found.carry_error < 0.1 * found.carry_error_raw
    assert found.norm_error == pytest.approx(rms([rest.norm_error for rest in found.rests]))
    assert found.carry_error == pytest.approx(rms([turn.residual for turn in found.turns]))


def test_rests_and_turns_are_those_of_the_session():
    found, simulated = calibration(), session()
    turned = [turn.angle for turn in found.turns]
    q = simulated.quaternion[simulated.rests[:, 0]]
    cosines = np.abs((q[1:] * q[:-1]).sum(axis=1))
    np.testing.assert_allclose(turned, 2.0 * np.arccos(cosines), atol=2e-3)
    for turn in found.turns:
        before, after = (found.rests[place] for place in turn.rests)
        assert before.last - 1 == turn.first
        assert after.first + 1 == turn.last
        assert np.linalg.norm(turn.axis) == pytest.approx(1.0)
    w, x, y, z = simulated.quaternion[simulated.rests[:, 0]].T
    up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
    np.testing.assert_allclose([rest.direction for rest in found.rests], up, atol=2e-3)


def test_without_noise_the_truth_is_found():
    exact = zr.simulation.simulate_session(
        12,
        seed=3,
        rate=400.0,
        gyro=zr.simulation.GyroErrors(noise=None, resolution=0.0),
        accel=zr.simulation.AccelErrors(noise=None, resolution=0.0, disturbance=0.0),
    )
    found = zr.calibration.calibrate(exact.recording)
    # What is left is what integration at 400 Hz, and interpolation in G f, misses.
    np.testing.assert_allclose(found.values, exact.truth.values, atol=3e-5)


def agree(first, second, parts=1e-3):
    """Values that differ by less than a small part of their standard errors, and those errors."""
    sigma = np.maximum(sigmas(first), 1e-300)
    assert (np.abs(first.values - second.values) <= parts * sigma).all()
    np.testing.assert_allclose(sigmas(second), sigmas(first), rtol=1e-2)


class TestLaws:
    def test_units_of_the_samples_do_not_matter(self):
        recording, known = session().recording, calibration()
        si = with_data(
            recording,
            zr.units.convert(recording.gyro.data, "deg/s", "rad/s"),
            zr.units.convert(recording.accel.data, "g", "m/s^2"),
            "rad/s",
            "m/s^2",
        )
        found = zr.calibration.calibrate(si)
        assert found.gyro_units == ("rad/s", "rad/s")
        assert found.accel_units == ("m/s^2", "m/s^2")
        agree(known, found.in_units(gyro="deg/s", accel="g"))
        assert found.carry_error == pytest.approx(known.carry_error, rel=1e-6)

    def test_a_later_clock_does_not_matter(self):
        found = zr.calibration.calibrate(with_data(session().recording, start=1e6))
        agree(calibration(), found)
        assert found.rests[0].start == pytest.approx(calibration().rests[0].start + 1e6)

    @pytest.mark.parametrize("signs", [(-1, -1, 1), (1, -1, -1)])
    def test_a_body_upside_down_is_the_same_upside_down(self, signs):
        recording, known = session().recording, calibration()
        turned = zr.calibration.calibrate(
            with_data(recording, recording.gyro.data * signs, recording.accel.data * signs)
        )
        both = np.outer(signs, signs).ravel()
        expected = np.concatenate([both, signs, both, signs, both]) * known.values
        sigma = np.maximum(sigmas(known), 1e-300)
        assert (np.abs(turned.values - expected) <= 1e-3 * sigma).all()

    def test_axes_in_another_order_are_the_same_body(self):
        """In one frame of both: the accelerometer's own axes differ."""
        recording = session().recording
        order = [1, 2, 0]
        found = zr.calibration.calibrate(
            with_data(recording, recording.gyro.data[:, order], recording.accel.data[:, order]),
            frame="symmetric",
        )
        known = calibration().to_frame("symmetric")
        for name in ("accel", "gyro"):
            expected = np.array(getattr(known, name).matrix)[np.ix_(order, order)]
            # The priors are of other elements: a few parts in a hundred of a standard error.
            np.testing.assert_allclose(getattr(found, name).matrix, expected, atol=2e-5)

    def test_the_other_sign_of_gravity_is_another_convention(self):
        recording, known = session().recording, calibration()
        found = zr.calibration.calibrate(with_data(recording, accel=-recording.accel.data))
        assert found.valid
        assert found.carry_error == pytest.approx(known.carry_error, rel=1e-3)

    def test_gravity_moves_the_scale_of_the_accelerometer_alone(self):
        """And what is per g by as little."""
        recording, known = session().recording, calibration()
        found = zr.calibration.calibrate(recording, gravity=9.78)
        factor = 9.80665 / 9.78
        agree(known, found_with_scale(found, 1.0 / factor), parts=0.2)
        assert not any("gravity was not given" in note for note in found.notes)
        assert any("gravity was not given" in note for note in known.notes)


def found_with_scale(found, factor):
    """The calibration with another scale of the accelerometer."""
    from dataclasses import replace

    scale = np.ones(33)
    scale[:9] = factor
    return replace(
        found, values=found.values * scale, covariance=found.covariance * np.outer(scale, scale)
    )


class TestChoices:
    def test_arrays_need_no_unit(self):
        recording, known = session().recording, calibration()
        found = zr.calibration.calibrate(
            accel=recording.accel.data * 2048.0, gyro=recording.gyro.data * 16.4, rate=100.0
        )
        assert found.valid
        assert found.gyro_units == ("unit", "rad/s")
        assert found.accel_units == ("unit", "m/s^2")
        # Counts per SI; a prior of half the scale is as good as none.
        np.testing.assert_allclose(
            np.array(found.gyro.matrix) * DEG / 16.4, known.gyro.matrix, atol=2e-4
        )
        np.testing.assert_allclose(
            np.array(found.accel.matrix) * 9.80665 / 2048.0, known.accel.matrix, atol=2e-4
        )
        assert any("the gyro has no known unit" in note for note in found.notes)
        raw = recording.gyro.data[1000:1010] * 16.4
        np.testing.assert_allclose(
            found.apply_gyro(raw), known.apply_gyro(raw / 16.4) * DEG, atol=1e-3
        )

    def test_a_wide_prior_changes_little_where_the_record_is_rich(self):
        found = zr.calibration.calibrate(session().recording, prior="wide")
        assert np.abs(found.values - calibration().values).max() < 0.2 * sigmas(calibration()).max()

    def test_rests_may_be_given(self):
        known = calibration()
        found = zr.calibration.calibrate(session().recording, rests=known.rests)
        np.testing.assert_array_equal(found.values, known.values)
        few = zr.calibration.calibrate(
            session().recording, rests=[(rest.start, rest.stop) for rest in known.rests[:10]]
        )
        assert len(few.rests) == 10
        assert not few.held_out

    def test_frames(self):
        found = zr.calibration.calibrate(session().recording, frame="z")
        assert found.frame == "z"
        np.testing.assert_allclose(found.values, calibration().to_frame("z").values)

    def test_sensors_may_have_clocks_of_their_own(self):
        fast = zr.simulation.simulate_session(20, seed=5, rate=200.0)
        gyro, accel = fast.recording.gyro, fast.recording.accel
        slow = zr.Log(accel.time[1::2], 100.0, accel.data[1::2], accel.names, accel.unit)
        found = zr.calibration.calibrate(zr.Recording({"gyro": gyro, "accel": slow}))
        assert found.valid
        assert np.abs(deviations(found, fast.truth)).max() < 4.0
        assert found.rate == 200.0

    def test_one_of_several_sensors_and_its_partner(self):
        recording = session().recording
        several = zr.Recording(
            {
                "gyro": recording.gyro,
                "accel": recording.accel,
                "gyro_1": recording.gyro.with_data(2.0 * recording.gyro.data),
                "accel_1": recording.accel.with_data(1.1 * recording.accel.data),
            }
        )
        with pytest.raises(zr.LogError, match="2 logs of gyro: gyro, gyro_1; choose one"):
            zr.calibration.calibrate(several)
        found = zr.calibration.calibrate(several, gyro="gyro")
        np.testing.assert_array_equal(found.values, calibration().values)
        other = zr.calibration.calibrate(several, accel="accel_1", gyro="gyro")
        assert other.accel.scale[0] == pytest.approx(1.1 * found.accel.scale[0], rel=2e-3)

    def test_the_mean_temperature_is_noted(self):
        warm = zr.simulation.simulate_session(8, seed=3, temperature=(20.0, 30.0))
        found = zr.calibration.calibrate(warm.recording)
        assert found.temperature == pytest.approx(np.mean(warm.recording.temperature.data))


class TestGSensitivity:
    @staticmethod
    def scale_error(size, choice):
        errors = []
        for seed in (1, 2):
            gyro = zr.simulation.GyroErrors(g_sensitivity=size * DEG)
            one = zr.simulation.simulate_session(12, seed=seed, gyro=gyro)
            found = zr.calibration.calibrate(one.recording, g_sensitivity=choice)
            errors.append((found.values - one.truth.values)[GYRO])
        return rms(errors)

    def test_what_is_large_is_taken_off_in_turns(self):
        """Three times the error is what 0.3 deg/s/g costs in these turns, at least."""
        assert self.scale_error(0.3, False) > 3.0 * self.scale_error(0.3, "auto")

    def test_the_choice_is_told(self):
        taken = "g-sensitivity of the gyro was subtracted in the turns"
        assert taken in calibration().notes
        none = zr.simulation.simulate_session(
            12, seed=4, gyro=zr.simulation.GyroErrors(g_sensitivity=0.0)
        )
        assert taken not in zr.calibration.calibrate(none.recording).notes

    def test_without_it_it_is_zero_and_fixed(self):
        found = zr.calibration.calibrate(session().recording, g_sensitivity=False)
        assert (found.values[G] == 0.0).all()
        assert (found.covariance[G] == 0.0).all()
        assert found.identifiable[G].all()

    def test_the_bias_of_a_gyro_that_drifts_is_known_less_well(self):
        """The walk within the record is part of its standard error."""
        steady, drift = session(12, 3), session(12, 3).recording.gyro.data.copy()
        rng = np.random.default_rng(1)
        drift += 0.01 * np.cumsum(rng.standard_normal(drift.shape), axis=0) / 10.0
        moved = zr.calibration.calibrate(with_data(steady.recording, drift))
        known = zr.calibration.calibrate(steady.recording)
        assert (sigmas(moved)[21:24] > 2.0 * sigmas(known)[21:24]).all()


def test_the_turns_are_those_of_the_oracle():
    """The whole chain once: angle and axis of a turn by the slow twin."""
    found, simulated = calibration(), session()
    rates = zr.units.convert(simulated.recording.gyro.data, "deg/s", "rad/s")
    at = [np.array(found.rests[place].gyro) for place in range(4)]
    bias = np.array([before + after for before, after in itertools.pairwise(at)]) / 2.0 * DEG
    for one, b in zip(found.turns, bias, strict=False):
        steps = np.full(one.last - one.first - 1, 0.01)
        P = slow_turn(rates[one.first : one.last], steps, b, found.gyro.correction)
        vector = to_rotation_vectors(from_matrices(P[np.newaxis]))[0]
        # What gravity does to this gyro is left in, some 0.1 deg/s for 2 s.
        np.testing.assert_allclose(one.angle * one.axis, vector, atol=0.01)
