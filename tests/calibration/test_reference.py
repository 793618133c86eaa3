"""A gyro against a reference: simulated encoders and gyros, and a recorded shaft."""

import math

import numpy as np
import pyarrow.parquet as pq
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings

RATE = 100.0
N = 40_000
T = np.arange(N) / RATE
PULSE = 2.0 * math.pi / 7.7
ANGLE = 90.0 * np.sin(PULSE * T)
ENCODER = 360.0 / 4096.0


def turning(lag=0.0):
    """Rate of a shaft that turns to and fro."""
    return 90.0 * PULSE * np.cos(PULSE * (T - lag))


def gyro(seed, scale=-1.01, bias=0.3, lag=0.012, noise=0.05):
    z = scale * turning(lag) + bias
    return z + noise * np.random.default_rng(seed).standard_normal(N)


def log(values, unit, rate=RATE, start=0.0):
    return zr.Log(start + np.arange(len(values)) / rate, rate, values, ("a",), unit)


class TestFit:
    def test_without_noise_it_is_exact(self):
        found = zr.calibration.fit_rate(gyro(1, noise=0.0), RATE, angle=ANGLE)
        # The trapezoid of a sine of 0.13 Hz at 100 Hz: (w dt)^2/12.
        assert found.scale == pytest.approx(-1.01, rel=1e-5)
        assert found.bias == pytest.approx(0.3, abs=1e-5)
        assert found.lag == pytest.approx(0.012, abs=1e-5)
        assert found.asymmetry == pytest.approx(0.0, abs=1e-5)
        assert found.window == 1.0

    @pytest.mark.slow
    def test_errors_hold_with_an_encoder(self):
        # No turning point twice: the same rounding there would be one error in all parts.
        second = 40.0 * np.sin(0.31 * T)
        coarse = np.round((ANGLE + second) / ENCODER) * ENCODER
        slow = -1.01 * 40.0 * 0.31 * np.cos(0.31 * (T - 0.012))
        z = []
        for seed in range(25):
            found = zr.calibration.fit_rate(gyro(seed, noise=0.5) + slow, RATE, angle=coarse)
            truth = ((found.scale, -1.01), (found.bias, 0.3), (found.lag, 0.012))
            z.append([(known - true) / known.sigma for known, true in truth])
        # Ten parts give errors with nine degrees of freedom: t squared has the mean 9/7.
        assert (np.mean(np.square(z), axis=0) < 2.5).all()
        assert (np.mean(np.square(z), axis=0) > 0.5).all()
        assert found.step == pytest.approx(ENCODER)
        # Rounding of both ends, and the noise of a second's integral.
        expected = math.hypot(ENCODER / math.sqrt(6.0), 0.5 / 10.0)
        assert found.residual == pytest.approx(expected, rel=0.05)
        assert found.notes == ()

    def test_drift_of_the_bias_is_in_its_error(self):
        drift = zr.simulate(zr.NoiseModel(rate_random_walk=0.01), RATE, N / RATE, seed=3)[1]
        still = zr.calibration.fit_rate(gyro(1), RATE, angle=ANGLE).bias
        moving = zr.calibration.fit_rate(gyro(1) + drift, RATE, angle=ANGLE).bias
        assert moving.sigma > 10.0 * still.sigma
        assert abs(moving - 0.3 - drift.mean()) < 3.0 * moving.sigma

    def test_a_reference_rate(self):
        by_angle = zr.calibration.fit_rate(gyro(1), RATE, angle=ANGLE)
        by_rate = zr.calibration.fit_rate(gyro(1), RATE, reference=turning())
        assert by_rate.scale == pytest.approx(by_angle.scale, rel=1e-5)
        assert by_rate.lag == pytest.approx(by_angle.lag, abs=1e-5)
        assert math.isnan(by_rate.step)

    @pytest.mark.parametrize("lag", [-0.03, 0.0, 0.0725])
    def test_lags_of_any_sign(self, lag):
        found = zr.calibration.fit_rate(gyro(2, lag=lag), RATE, angle=ANGLE)
        assert abs(found.lag - lag) < 4.0 * found.lag.sigma < 1e-3

    def test_correct(self):
        found = zr.calibration.fit_rate(gyro(1, noise=0.0), RATE, angle=ANGLE)
        corrected = found.correct([*gyro(1, noise=0.0)[:5], np.nan])
        np.testing.assert_allclose(corrected, [*turning(0.012)[:5], np.nan], atol=1e-3)

    def test_missing_samples_are_left_out(self):
        z, angle = gyro(1), ANGLE.copy()
        z[5000:5300], angle[20_000:20_050] = np.nan, np.nan
        z[30_000] = np.inf
        found, whole = (
            zr.calibration.fit_rate(z, RATE, angle=angle),
            zr.calibration.fit_rate(gyro(1), RATE, angle=ANGLE),
        )
        assert abs(found.scale - whole.scale) < 3.0 * whole.scale.sigma
        assert abs(found.bias - whole.bias) < 3.0 * whole.bias.sigma
        assert np.isfinite([found.scale, found.bias, found.lag, found.residual]).all()


class TestLogs:
    @pytest.mark.parametrize("unit", ["deg/s", "rad/s", "deg/h"])
    def test_units_do_not_matter(self, unit):
        of = zr.units.convert(1.0, "deg/s", unit)
        found = zr.calibration.fit_rate(
            log(of * gyro(1), unit), angle=log(np.radians(ANGLE), "rad")
        )
        plain = zr.calibration.fit_rate(gyro(1), RATE, angle=ANGLE)
        assert found.scale == pytest.approx(plain.scale)
        assert found.bias == pytest.approx(of * plain.bias)
        assert found.scale.sigma == pytest.approx(plain.scale.sigma, rel=1e-6)

    def test_whole_turns_are_put_together(self):
        spun = 300.0 * T + ANGLE
        z = 1.01 * (300.0 + turning()) + 0.5 * np.random.default_rng(1).standard_normal(N)
        found = zr.calibration.fit_rate(log(z, "deg/s"), angle=log(spun % 360.0, "deg"))
        assert abs(found.scale - 1.01) < 4.0 * found.scale.sigma < 1e-3
        # It never turns the other way.
        assert not found.negative.known
        assert not found.asymmetry.known

    def test_another_clock(self):
        slow = np.arange(0.0, N / RATE, 0.05)
        angle = zr.Log(slow, 20.0, 90.0 * np.sin(PULSE * slow), ("a",), "deg")
        found = zr.calibration.fit_rate(log(gyro(1, noise=0.0), "deg/s"), angle=angle)
        # Lines between samples of 20 Hz miss (w dt)^2/8 of the angle.
        assert found.scale == pytest.approx(-1.01, rel=3e-4)
        assert found.lag == pytest.approx(0.012, abs=1e-4)


class TestWarnings:
    def test_a_scale_that_differs_by_direction(self):
        true_rate = turning(0.012)
        z = true_rate + 0.002 * np.abs(true_rate)
        z += 0.05 * np.random.default_rng(1).standard_normal(N)
        found = zr.calibration.fit_rate(z, RATE, angle=ANGLE)
        assert found.asymmetry == pytest.approx(0.004, rel=0.1)
        assert any("between the directions" in note for note in found.notes)
        assert found.positive - found.negative == pytest.approx(0.004, rel=0.5)

    def test_a_bend_shows_in_each_direction_alone(self):
        true_rate = turning(0.012)
        z = true_rate + 2e-6 * true_rate**3 + 0.02 * np.random.default_rng(1).standard_normal(N)
        notes = zr.calibration.fit_rate(z, RATE, angle=ANGLE).notes
        assert sum("rates alone give a scale of" in note for note in notes) == 2

    def test_a_residual_beyond_the_steps(self):
        coarse = np.round(ANGLE / ENCODER) * ENCODER
        jitter = 0.3 * np.random.default_rng(1).standard_normal(N)
        notes = zr.calibration.fit_rate(
            gyro(1), RATE, angle=coarse + np.round(jitter / ENCODER) * ENCODER
        ).notes
        assert any("times what the reference's steps" in note for note in notes)

    def test_a_constant_rate_tells_neither_scale_nor_lag(self):
        found = zr.calibration.fit_rate(10.0 + gyro(1) - gyro(1, noise=0.0), RATE, angle=10.0 * T)
        assert not found.scale.identifiable
        assert not found.lag.identifiable
        assert np.isnan(found.correct([1.0])).all()
        assert "not identifiable" in str(found)

    def test_a_reference_at_rest_leaves_the_bias(self):
        found = zr.calibration.fit_rate(gyro(1) - gyro(1, noise=0.0) + 0.3, RATE, angle=np.zeros(N))
        assert not found.scale.identifiable
        assert abs(found.bias - 0.3) < 4.0 * found.bias.sigma < 0.01
        assert any("hardly rotates" in note for note in found.notes)

    def test_a_lag_beyond_those_tried(self):
        found = zr.calibration.fit_rate(gyro(1, lag=0.5), RATE, angle=ANGLE)
        assert not found.lag.identifiable
        assert any("the residual falls as far as 0.100 s" in note for note in found.notes)


@pytest.fixture(scope="module")
def shaft():
    table = pq.read_table(RECORDINGS / "mpu6050_encoder_yaw_slow_100hz.parquet")
    return [table[n].to_numpy() for n in ("shaft_gyro_z_dps", "encoder_deg")]


@pytest.fixture(scope="module")
def found(shaft):
    z, angle = shaft
    return zr.calibration.fit_rate(z, 149_826 / 1499.913, angle=angle)


@needs_recordings
class TestShaft:
    """A shaft that turns by 180 deg to and fro at 50 deg/s, its encoder in steps of 0.088 deg."""

    def test_scale_bias_and_lag(self, found):
        assert found.scale == pytest.approx(-1.0060, abs=4e-4)
        assert found.scale.sigma < 1e-4
        assert found.bias == pytest.approx(-0.085, abs=0.004)
        assert found.bias.sigma == pytest.approx(0.0023, rel=0.3)
        # In samples 1.2 by the trapezoid, and half a sample less by sums.
        assert found.lag == pytest.approx(0.012, abs=5e-4)

    def test_it_says_that_the_model_does_not_hold(self, found):
        assert any("rates alone give a scale of" in note for note in found.notes)
        assert any("times what the reference's steps" in note for note in found.notes)

    def test_windows_that_follow_each_other_beat_with_the_motion(self, shaft, found):
        """The scale of those a second apart depends on where they begin: so every window counts."""
        z, angle = shaft
        sums = np.cumsum(z) / 99.891
        scales = []
        for first in range(0, 100, 10):
            turned, integral = np.diff(angle[first::100]), np.diff(sums[first::100])
            scales.append(np.polyfit(turned, integral, 1)[0])
        assert np.std(scales) > 10.0 * found.scale.sigma


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"angle": None}, "give either angle or reference"),
        ({"reference": np.zeros(N)}, "give either angle or reference"),
        ({"rate": None}, "rate must be given in Hz"),
        ({"z": log(np.zeros(N), "deg/s", 2.0 * RATE)}, "rate must be that of the log"),
        ({"z": np.zeros((N, 3))}, r"z must be one axis, of shape \(n,\), got \(40000, 3\)"),
        ({"angle": np.zeros(5)}, r"must have the gyro's shape \(40000,\), got \(5,\)"),
        ({"window": 30.0}, "a shorter window needs fewer"),
        ({"window": -1.0}, "window must be positive"),
        ({"z": np.full(N, np.nan)}, "too many samples are missing"),
        (
            {"z": log(np.zeros(N), "deg/s"), "rate": None, "angle": log(np.zeros(N), "deg/s")},
            "the reference in one of angle, got deg/s and deg/s",
        ),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(ValueError, match=message):
        zr.calibration.fit_rate(**{"z": gyro(1), "rate": RATE, "angle": ANGLE, **arguments})
