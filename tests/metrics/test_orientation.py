"""Errors in orientation, against closed forms."""

import math

import numpy as np
import pytest

from support.signals import RATE
from zerorate import metrics
from zerorate.metrics import rotations


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
        steps = rotations.of_rotation_vectors(rates / RATE)
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
