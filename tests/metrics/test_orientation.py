"""Errors in orientation, against closed forms."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from support.signals import RATE
from zerorate import metrics
from zerorate.geometry import rotations


def quaternion(axis, angle):
    return np.array([math.cos(angle / 2.0), *(math.sin(angle / 2.0) * np.array(axis))])


def turning(rates, rate=RATE):
    """Return the exact orientation of body rates that are constant over each sample."""
    q, path = np.array([1.0, 0.0, 0.0, 0.0]), []
    for w in rates:
        size = np.linalg.norm(w)
        step = quaternion(w / size, size / rate) if size else np.array([1.0, 0.0, 0.0, 0.0])
        q = rotations.product(q, step)
        path.append(q)
    return np.array(path)


def body_rates(n=3000):
    t = np.arange(n) / RATE
    return np.column_stack((np.sin(t), 0.7 * np.cos(1.7 * t), 0.3 + 0.0 * t))


class TestOrientationErrorGrowth:
    def test_perfect_rates_have_no_error(self):
        rates = body_rates()
        growth = metrics.orientation_error_growth(rates, turning(rates), RATE, (1.0, 10.0))
        # Thousands of products, each rounded.
        assert (growth < 1e-12).all()

    def test_a_bias_about_the_axis_of_turning_grows_with_time(self):
        rates = np.tile([0.0, 0.0, 1.2], (3000, 1))
        growth = metrics.orientation_error_growth(
            rates + np.array([0.0, 0.0, 0.01]), turning(rates), RATE, (1.0, 20.0)
        )
        # Thousands of products, each rounded.
        np.testing.assert_allclose(growth, [0.01, 0.2], rtol=1e-11)

    def test_the_world_of_the_reference_does_not_matter(self):
        rates = body_rates()
        north = quaternion([0.6, 0.0, 0.8], 2.0)
        path = turning(rates)
        wrong = rates + np.array([0.01, -0.02, 0.005])
        here = metrics.orientation_error_growth(wrong, path, RATE, (10.0,))
        there = metrics.orientation_error_growth(
            wrong, -3.0 * rotations.product(north, path), RATE, (10.0,)
        )
        np.testing.assert_allclose(here, there, rtol=1e-10)  # as above
        # No angle can grow faster than the size of the wrong rate.
        assert 0.0 < here[0] <= 10.0 * np.linalg.norm([0.01, -0.02, 0.005])

    def test_windows_with_gaps_are_left_out(self):
        rates = body_rates()
        path = turning(rates)
        wrong = rates + np.array([0.0, 0.0, 0.01])
        clean = metrics.orientation_error_growth(wrong[:2000], path[:2000], RATE, (1.0,))
        wrong[2000:] = 50.0
        wrong[2000] = np.nan
        path[2001:] = np.nan
        gappy = metrics.orientation_error_growth(wrong, path, RATE, (1.0,))
        np.testing.assert_allclose(gappy, clean, rtol=1e-10)  # as above

    def test_long_records_equal_a_loop(self):
        rates = body_rates(700)
        steps = rotations.from_rotation_vectors(rates / RATE)
        # Seven hundred products, each rounded.
        np.testing.assert_allclose(rotations.cumulative_product(steps), turning(rates), atol=1e-13)

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"rates": np.zeros((10, 2))}, r"rates must have shape \(n, 3\)"),
            ({"quaternions": np.zeros((10, 3))}, r"quaternions must have shape \(n, 4\)"),
            ({"quaternions": np.zeros((9, 4))}, "of one length, got 10 and 9"),
            ({"horizons": (60.0,)}, "less than the record's 10"),
            ({"horizons": (-1.0,)}, "horizon must be positive"),
            ({"every": 0.0}, "every must be positive"),
            ({"quaternions": np.zeros((10, 4))}, "no window of 0.05 s"),
        ],
    )
    def test_refusals(self, change, match):
        arguments = {
            "rates": np.zeros((10, 3)),
            "quaternions": np.tile([1.0, 0.0, 0.0, 0.0], (10, 1)),
            "rate": RATE,
            "horizons": (0.05,),
        }
        with pytest.raises(ValueError, match=match):
            metrics.orientation_error_growth(**arguments | change)


def east(heading, lean, toward=0.4):
    """Return a turn about the vertical after one about a level axis."""
    level = quaternion([math.cos(toward), math.sin(toward), 0.0], lean)
    return rotations.product(quaternion([0.0, 0.0, 1.0], heading), level)


def wandering(n=200):
    rng = np.random.default_rng(4)
    return rotations.unit(rng.standard_normal((n, 4)))


class TestOrientationErrors:
    @pytest.mark.parametrize("size", [1e-9, 1e-3, 0.3])
    def test_heading_and_inclination_are_told_apart(self, size):
        """Also angles of which the cosine says nothing."""
        truth = wandering()
        found = metrics.orientation_errors(rotations.product(east(2.0 * size, size), truth), truth)
        # The rounding of quaternions, of which an angle is twice as much: absolute.
        assert found.heading == pytest.approx(2.0 * size, abs=1e-15)
        assert found.inclination == pytest.approx(size, abs=1e-15)
        whole = 2.0 * math.asin(math.hypot(math.sin(size), math.cos(size) * math.sin(size / 2.0)))
        assert found.total == pytest.approx(whole, abs=1e-15)
        assert found.sample_count == len(truth)

    def test_root_of_the_mean_square(self):
        truth = wandering(4)
        wrong = np.array([east(a, 0.0) for a in (0.1, -0.1, 0.7, 0.7)])
        found = metrics.orientation_errors(rotations.product(wrong, truth), truth)
        assert found.heading == pytest.approx(0.5)
        assert found.total == pytest.approx(0.5)
        assert found.inclination < 1e-15

    def test_length_and_sign_do_not_matter(self):
        truth = wandering()
        estimate = rotations.product(east(0.2, 0.1), truth)
        sign = np.where(np.arange(len(truth)) % 2, 3.0, -0.5)[:, None]
        plain = metrics.orientation_errors(estimate, truth)
        scaled = metrics.orientation_errors(sign * estimate, -2.0 * truth)
        # Each is a rounding of unit quaternions apart.
        assert scaled.total == pytest.approx(plain.total, rel=1e-14)
        assert scaled.heading == pytest.approx(plain.heading, rel=1e-14)
        assert scaled.inclination == pytest.approx(plain.inclination, rel=1e-14)

    def test_half_a_turn_is_the_largest_error(self):
        truth = wandering(3)
        upside_down = rotations.product(east(0.0, math.pi), truth)
        assert metrics.orientation_errors(upside_down, truth).inclination == pytest.approx(math.pi)
        backwards = metrics.orientation_errors(rotations.product(east(math.pi, 0.0), truth), truth)
        assert backwards.heading == pytest.approx(math.pi)
        assert backwards.inclination < 1e-15

    def test_a_relative_heading_is_drift_since_the_first_sample_judged(self):
        truth = wandering()
        drift = np.linspace(0.0, 0.2, len(truth))
        turned = np.array([east(2.5 + a, 0.05) for a in drift])
        estimate = rotations.product(turned, truth)
        later = np.arange(len(truth)) >= 50
        found = metrics.orientation_errors(estimate, truth, where=later, heading="relative")
        since = drift[later] - drift[50]
        # As above.
        assert found.heading == pytest.approx(np.sqrt(np.mean(since**2)), rel=1e-13)
        assert found.inclination == pytest.approx(0.05, rel=1e-13)
        assert found.total < 0.2
        absolute = metrics.orientation_errors(estimate, truth, where=later)
        assert absolute.heading > 2.5
        assert absolute.inclination == pytest.approx(found.inclination, rel=1e-13)

    def test_missing_samples_are_left_out(self):
        truth = wandering()
        estimate = rotations.product(east(0.2, 0.1), truth)
        truth[3, 1], estimate[7] = np.nan, np.inf
        estimate[9] = 0.0
        judged = np.arange(len(truth)) < 20
        found = metrics.orientation_errors(estimate, truth, where=judged)
        assert found.sample_count == 17
        assert found.heading == pytest.approx(0.2)

    def test_rotations_of_scipy(self):
        truth = wandering()
        estimate = rotations.product(east(0.2, 0.1), truth)
        turned = [Rotation.from_quat(q, scalar_first=True) for q in (estimate, truth)]
        found = metrics.orientation_errors(*turned)
        assert found.heading == pytest.approx(0.2)
        # What turns the earth's axes, so the error is one in the earth's frame.
        between = (turned[0] * turned[1].inv()).magnitude()
        assert found.total == pytest.approx(np.sqrt(np.mean(between**2)))

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"quaternions": np.zeros((10, 3))}, r"quaternions must have shape \(n, 4\)"),
            ({"reference": np.ones((9, 4))}, "of one length, got 10 and 9"),
            (
                {"heading": "free"},
                "heading must be one of 'absolute', 'relative', 'aligned', got 'free'",
            ),
            ({"where": np.ones(10)}, "where must hold true and false in shape"),
            ({"where": np.ones(9, dtype=bool)}, r"in shape \(10,\), got bool in \(9,\)"),
            ({"where": np.zeros(10, dtype=bool)}, "no sample that counts is present"),
            ({"reference": np.full((10, 4), np.nan)}, "no sample that counts is present"),
        ],
    )
    def test_refusals(self, change, match):
        arguments = {"quaternions": np.ones((10, 4)), "reference": np.ones((10, 4))}
        with pytest.raises(ValueError, match=match):
            metrics.orientation_errors(**arguments | change)


def test_headings_are_aligned_by_the_angle_that_fits_best():
    rng = np.random.default_rng(1)
    true = rng.standard_normal((50, 4))
    angle = 0.7 + 0.01 * rng.standard_normal(50)
    zero = np.zeros(50)
    turn = np.column_stack((np.cos(angle / 2.0), zero, zero, np.sin(angle / 2.0)))
    found = rotations.product(turn, true)
    assert zr.metrics.heading_offset(found, true) == pytest.approx(angle.mean(), abs=1e-4)
    aligned = zr.metrics.orientation_errors(found, true, heading="aligned")
    assert aligned.heading == pytest.approx(angle.std(), rel=1e-3)
    assert aligned.inclination == pytest.approx(0.0, abs=1e-7)
    assert zr.metrics.heading_offset(true, found) == pytest.approx(-angle.mean(), abs=1e-4)
