"""Angle and orientation from rates: closed forms, the oracle, and errors that cover the truth."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import zerorate as zr
from zerorate.geometry import rotations

METHODS = ["backward-euler", "trapezoid", "coning"]
RATE = 100.0
FLICKER = math.sqrt(2.0 * math.log(2.0) / math.pi)


def log(data, unit="rad/s", rate=RATE):
    data = np.asarray(data, dtype=float).reshape(len(data), -1)
    return zr.Log(np.arange(len(data)) / rate, rate, data, tuple("xyz"[: data.shape[1]]), unit)


def coning(t, beta=0.1, pulse=10.0):
    """Rates of a body whose z axis runs round a cone of half-angle beta, and its orientation."""
    cos, sin = np.cos(pulse * t), np.sin(pulse * t)
    along = np.full(t.size, 2.0 * math.sin(beta / 2.0) ** 2)
    rates = pulse * np.column_stack((-math.sin(beta) * sin, math.sin(beta) * cos, -along))
    axis = np.column_stack((cos, sin, np.zeros(t.size)))
    return rates, rotations.from_rotation_vectors(beta * axis)


def off(orientation, truth):
    """Angle at each sample between an orientation and the true one, both since the first."""
    since = rotations.product(rotations.inverse(truth[:1]), truth)
    return rotations.angle(rotations.product(rotations.inverse(since), orientation))


class TestOneAxis:
    @pytest.mark.parametrize("method", METHODS)
    def test_a_constant_rate(self, method):
        found = zr.integrate(np.full(501, 0.25), RATE, method)
        np.testing.assert_allclose(found.angle, 0.25 * np.arange(501) / RATE, atol=1e-12)
        assert (found.quaternion, found.sigma, found.method) == (None, None, method)

    def test_a_rate_that_rises_evenly(self):
        t = np.arange(501) / RATE
        trapezoid, coned, euler = (
            zr.integrate(3.0 * t, RATE, m).angle for m in ("trapezoid", "coning", "backward-euler")
        )
        np.testing.assert_allclose(trapezoid, 1.5 * t**2, atol=1e-12)
        np.testing.assert_array_equal(coned, trapezoid)
        # The published sum takes each step at its end: half a step's rise too much.
        np.testing.assert_allclose(euler, 1.5 * t**2 + 1.5 * t / RATE, atol=1e-12)

    def test_what_it_takes(self):
        z = np.linspace(0.0, 90.0, 50)
        expected = zr.integrate(np.radians(z), RATE).angle
        for found in (
            zr.integrate(z, RATE, unit="deg/s"),
            zr.integrate(log(z, "deg/s")),
            zr.integrate(log(z, "unit"), unit="dps"),
            zr.integrate(z[:, None], RATE, unit="deg/s"),
            zr.integrate(z.tolist(), RATE, unit="deg/s"),
        ):
            np.testing.assert_allclose(found.angle, expected, rtol=1e-12)


class TestThreeAxes:
    @given(arrays(float, 30, elements=st.floats(-5.0, 5.0)), st.sampled_from(METHODS))
    def test_about_one_axis_it_is_the_angle(self, rate, method):
        axis = np.array([2.0, -1.0, 2.0]) / 3.0
        found = zr.integrate(rate[:, None] * axis, RATE, method)
        angle = zr.integrate(rate, RATE, method).angle
        expected = rotations.from_rotation_vectors(angle[:, None] * axis)
        np.testing.assert_allclose(found.quaternion, expected, atol=1e-12)
        np.testing.assert_allclose(found.angle, np.abs(angle), atol=1e-7)

    def test_errors_fall_with_the_order_of_the_method(self):
        def error(method, rate):
            rates, truth = coning(np.arange(round(10 * rate)) / rate)
            return off(zr.integrate(rates, rate, method).quaternion, truth)[-1]

        for method, order in (("backward-euler", 2.0), ("trapezoid", 4.0), ("coning", 4.0)):
            assert error(method, 200.0) * order == pytest.approx(error(method, 100.0), rel=0.2)
        assert error("coning", 100.0) < 0.6 * error("trapezoid", 100.0)

    def test_of_a_rate_that_changes_evenly_coning_is_of_fourth_order(self):
        def at_the_end(method, rate):
            t = np.arange(round(rate) + 1)[:, None] / rate
            rates = np.array([1.0, -2.0, 0.5]) + t * np.array([-3.0, 1.0, 4.0])
            return zr.integrate(rates, rate, method).quaternion[-1:]

        truth = at_the_end("coning", 6400.0)
        error = {
            (m, r): rotations.angle(rotations.product(rotations.inverse(truth), at_the_end(m, r)))
            for m in ("trapezoid", "coning")
            for r in (50.0, 100.0)
        }
        assert error["coning", 50.0] / error["coning", 100.0] == pytest.approx(16.0, rel=0.1)
        assert error["coning", 100.0] < 1e-2 * error["trapezoid", 100.0]

    def test_a_session_comes_back_to_its_poses(self):
        session = zr.simulation.simulate_session(8, seed=3)
        error = off(zr.integrate(session.rates, RATE).quaternion, session.quaternion)
        # Samples at 100 Hz leave 1e-6 rad of a turn whose axis moves.
        assert error[session.rests[:, 0] + 5].max() < 2e-5

    def test_a_longer_way_round_is_an_angle_of_at_most_half_a_turn(self):
        found = zr.integrate(np.tile([0.0, 0.0, 1.5 * math.pi], (101, 1)), RATE)
        assert found.angle[-1] == pytest.approx(0.5 * math.pi)
        assert found.angle.max() <= math.pi


class TestSigma:
    def test_closed_forms(self):
        t = np.arange(10_001) / RATE
        z = np.zeros(t.size)
        white = zr.integrate(z, RATE, angle_random_walk=2e-4).sigma
        np.testing.assert_allclose(white, 2e-4 * np.sqrt(t), atol=1e-12)
        bias = zr.integrate(z, RATE, bias_sigma=3e-5).sigma
        np.testing.assert_allclose(bias, 3e-5 * t, atol=1e-12)
        walk = zr.integrate(z, RATE, rate_random_walk=1e-6).sigma
        # Sums for integrals: the first second is coarse.
        np.testing.assert_allclose(walk[100:], 1e-6 * np.sqrt(t[100:] ** 3 / 3.0), rtol=1e-4)
        model = zr.NoiseModel(2e-4, 1e-5, 1e-6)
        both = zr.integrate(z, RATE, noise=model, bias_sigma=3e-5).sigma
        expected = np.sqrt(white**2 + bias**2 + walk**2 + (FLICKER * 1e-5 * t) ** 2)
        np.testing.assert_allclose(both, expected, rtol=1e-9)

    def test_without_turning_three_axes_are_three_times_one(self):
        z = np.zeros(70_000)
        model = zr.NoiseModel(2e-4, 1e-5, 1e-6)
        one = zr.integrate(z, RATE, noise=model).sigma
        three = zr.integrate(np.zeros((z.size, 3)), RATE, noise=model).sigma
        np.testing.assert_allclose(three, np.tile(one[:, None], (1, 3)), rtol=1e-9)

    def test_turning_carries_a_bias_with_it(self):
        n = 1001
        rates = np.tile([0.0, 0.0, 2.0], (n, 1))
        found = zr.integrate(rates, RATE, bias_sigma=(1e-3, 0.0, 2e-3)).sigma
        angle = 2.0 * np.arange(n) / RATE
        # The integral of a bias about x, whose axis goes round in the first axes.
        expected = [np.abs(np.sin(angle)) / 2e3, (1.0 - np.cos(angle)) / 2e3, 1e-3 * angle]
        np.testing.assert_allclose(found, np.column_stack(expected), atol=1e-7)

    def test_it_covers_what_happens(self):
        noise = zr.NoiseModel(1e-4, rate_random_walk=2e-5)
        session = zr.simulation.simulate_session(4, seed=2, rest=1.0)
        n, errors = len(session.rates), []
        since = zr.integrate(session.rates, RATE).quaternion[-1]
        for seed in range(40):
            z, _ = zr.simulate(noise, RATE, n / RATE, seed, axes=3)
            turned = zr.integrate(session.rates + z, RATE, noise=noise)
            error = rotations.product(turned.quaternion[-1], rotations.inverse(since))
            errors.append(2.0 * error[1:] * np.sign(error[0]) / turned.sigma[-1])
        # 120 squares, of which the mean has a deviation of sqrt(2/120), five of them.
        assert np.mean(np.square(errors)) == pytest.approx(1.0, abs=5.0 * math.sqrt(2.0 / 120.0))

    def test_it_says_what_it_leaves_out(self):
        model = zr.NoiseModel(1e-4, rate_ramp=1e-9)
        notes = zr.integrate(np.zeros(10), RATE, noise=model).notes
        assert notes == (
            "sigma leaves out of the noise model: rate ramp",
            "sigma counts as zero, because the noise model lacks it: "
            "bias instability, rate random walk",
        )


class TestMissing:
    def test_a_line_bridges_them(self):
        t = np.arange(200) / RATE
        z = 1.0 + 3.0 * t
        gappy = z.copy()
        gappy[[50, 51, 52, 120]] = np.nan
        gappy[150] = np.inf
        found = zr.integrate(gappy, RATE, angle_random_walk=0.0)
        np.testing.assert_allclose(found.angle, zr.integrate(z, RATE).angle, atol=1e-12)
        assert np.flatnonzero(found.bridged).tolist() == [50, 51, 52, 120, 150]
        assert found.notes == ("5 of 200 samples are missing, bridged by lines",)
        # A line bridges a line without error.
        assert found.sigma.max() < 1e-9

    def test_sigma_grows_by_what_such_gaps_cost_in_the_record(self):
        rng = np.random.default_rng(5)
        # A random walk: what a bridge of T seconds misses has the variance K^2 T^3/12.
        z = np.cumsum(rng.standard_normal(200_000)) * 0.01 / math.sqrt(RATE)
        z[1000:1100] = np.nan
        found = zr.integrate(z, RATE, bias_sigma=0.0).sigma
        assert (found[:1000] == 0.0).all()
        # Overlapping windows of 1 s in 2000 s; the length is rounded up by at most a fifth.
        low = 0.01 * math.sqrt(1.01**3 / 12.0)
        assert 0.95 * low < found[-1] < 1.05 * 1.2**1.5 * low

    def test_ends_hold_the_nearest(self):
        z = np.array([np.nan, np.nan, 1.0, 2.0, 3.0, np.nan])
        found = zr.integrate(z, 1.0)
        np.testing.assert_allclose(found.angle, [0.0, 1.0, 2.0, 3.5, 6.0, 9.0])

    def test_where_no_stretch_is_as_long_any_rate_may_have_been(self):
        z = np.array([0.0, 1.0, 0.0, 1.0] * 10 + [np.nan] * 100 + [0.0, 1.0])
        found = zr.integrate(z, 10.0, angle_random_walk=0.0).sigma
        # The deviation of the rate is 0.5; the gap counts as 100 to 120 samples.
        assert 5.0 <= found[-1] <= 6.0
        alone = np.array([np.nan, 1.0, np.nan])
        assert zr.integrate(alone, 1.0, bias_sigma=0.1).sigma[-1] == math.inf

    def test_one_axis_may_have_a_gap(self):
        rates = np.random.default_rng(3).standard_normal((500, 3))
        rates[200:210, 1] = np.nan
        found = zr.integrate(rates, RATE, angle_random_walk=0.0)
        assert found.bridged.sum() == 10
        assert np.isfinite(found.quaternion).all()
        assert (found.sigma[:200] == 0.0).all()
        # The gap's error is one of y, which the body has turned a little by then.
        assert np.argmax(found.sigma[-1]) == 1

    @given(
        arrays(float, (30, 3), elements=st.floats(-1e3, 1e3) | st.just(math.nan)),
        st.sampled_from(METHODS),
    )
    def test_nothing_is_ever_nan(self, rates, method):
        rates[3] = 0.0
        found = zr.integrate(rates, RATE, method, noise=zr.NoiseModel(1e-4, 1e-5, 1e-6))
        for values in (found.angle, found.quaternion, found.sigma):
            assert not np.isnan(values).any()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"z": np.zeros(5)}, "rate must be given in Hz"),
        ({"z": np.zeros((5, 2)), "rate": 1.0}, r"shape \(n,\), \(n, 1\) or \(n, 3\), got \(5, 2\)"),
        ({"z": np.zeros(1), "rate": 1.0}, "two samples or more, got 1"),
        ({"z": np.full(5, np.nan), "rate": 1.0}, "all of one are missing"),
        ({"z": np.zeros(5), "rate": -1.0}, "rate must be a positive"),
        ({"z": np.zeros(5), "rate": 1.0, "method": "euler"}, "one of backward-euler, trapezoid"),
        ({"z": np.zeros(5), "rate": 1.0, "unit": "g"}, "must be one of an angular rate"),
        ({"z": np.zeros(5), "rate": 1.0, "bias_sigma": -1.0}, "bias_sigma must be finite"),
        ({"z": np.zeros(5), "rate": 1.0, "bias_sigma": (1.0, 1.0)}, "one number or one for each"),
        ({"z": log(np.zeros(5), "unit")}, "unit of x is not known"),
        ({"z": log(np.zeros(5), "deg/s"), "unit": "rad/s"}, "unit must be that of the samp"),
        ({"z": log(np.zeros(5)), "rate": 2.0 * RATE}, "rate must be that of the log"),
        (
            {"z": np.zeros(5), "rate": 1.0, "noise": zr.NoiseModel(1.0, quantity="acceleration")},
            "must be that of an angular rate",
        ),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(ValueError, match=message):
        zr.integrate(**arguments)
