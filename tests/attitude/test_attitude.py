"""The default attitude filter on simulated motions: how well, how surely, and through what."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from support.calibrations import calibration
from support.checks import assert_same_bits

DEG = np.pi / 180.0
RATE = 100.0
NONE = zr.simulation.MotionErrors.none()


def errors(q, motion, where=None):
    """Total, heading and inclination, deg."""
    found = zr.metrics.orientation_errors(q, motion.quaternion, where=where)
    return np.array([found.total, found.heading, found.inclination]) / DEG


@cache
def simulated(kind, rate, duration, seed, start="rest", **of_sensors):
    of = zr.simulation.MotionErrors(**of_sensors)
    return zr.simulate_motion(kind, rate, duration, seed=seed, start=start, errors=of)


def process(motion, dt=None, **changed):
    sensors = {"gyro": motion.gyro, "accel": motion.accel, "mag": motion.mag, **changed}
    return zr.Attitude(motion.rate).process(**sensors, dt=dt)


class TestAccuracy:
    @pytest.mark.parametrize("rate", [5.0, 10.0, 25.0, 100.0, 1000.0])
    def test_rates(self, rate):
        """A hand turns by less than a degree in what a sample of 5 Hz cannot tell."""
        motion = simulated("hand", rate, 40.0, 2)
        total, _, inclination = errors(process(motion), motion)
        # The field wanders by 4.5 deg.
        assert total < 6.0
        assert inclination < 1.0

    @pytest.mark.slow
    def test_eight_thousand_samples_a_second(self):
        motion = simulated("hand", 8000.0, 9.0, 2)
        assert errors(process(motion), motion)[2] < 2.0

    @pytest.mark.every(2)
    @pytest.mark.parametrize("kind", ["hand", "arm", "pendulum", "spinning pendulum"])
    def test_a_start_in_motion(self, kind):
        """Levelled by a mean force, it is as good as any after some seconds."""
        for seed in range(3):
            motion = simulated(kind, RATE, 40.0, seed, "motion")
            assert errors(process(motion), motion, motion.time > 15.0)[2] < 2.0

    @pytest.mark.every(2)
    @pytest.mark.parametrize("seed", range(4))
    def test_lost_samples_with_their_times_are_as_good_as_none_lost(self, seed):
        whole = simulated("hand", RATE, 60.0, seed)
        lossy = simulated("hand", RATE, 60.0, seed, lost=0.03)
        assert len(lossy.time) < len(whole.time)
        expected = errors(process(whole), whole)
        np.testing.assert_allclose(errors(process(lossy, lossy.dt), lossy), expected, atol=0.1)
        assert errors(process(lossy), lossy)[2] > 1.5 * expected[2]

    def test_a_slow_magnetometer(self):
        """At 20 Hz beside 200 Hz: each field stands for the time since the one before."""
        motion = simulated("hand", 200.0, 60.0, 2)
        mag = np.full_like(motion.mag, np.nan)
        mag[3::10] = motion.mag[3::10]
        expected = errors(process(motion), motion)
        np.testing.assert_allclose(errors(process(motion, mag=mag), motion), expected, atol=0.2)

    def test_a_fifth_of_the_forces_lost(self):
        motion = simulated("hand", RATE, 60.0, 2)
        accel = motion.accel.copy()
        accel[np.random.default_rng(1).random(len(accel)) < 0.2] = np.nan
        expected = errors(process(motion), motion)
        np.testing.assert_allclose(errors(process(motion, accel=accel), motion), expected, atol=0.3)

    def test_a_day(self):
        """There and back for 24 hours: of length one, level, and with a gyro that is known."""
        motion = simulated("hand", 50.0, 60.0, 2)
        gyro, accel, mag = there_and_back(motion)
        f = zr.Attitude(50.0)
        f.process(gyro, accel, mag)
        early = f.process(gyro, accel, mag)
        for _ in range(24 * 30):
            q = f.process(gyro, accel, mag)
        assert f.samples_seen == (24 * 30 + 2) * 6000
        # Some roundings a tick, never their sum.
        assert np.max(np.abs(np.sum(q**2, axis=1) - 1.0)) < 1e-13
        truth = np.concatenate([motion.quaternion, motion.quaternion[::-1]])
        first, last = (
            zr.metrics.orientation_errors(answers, truth).inclination / DEG
            for answers in (early, q)
        )
        assert last < first + 0.2
        assert last < 1.0
        assert np.max(np.abs(f.gyro_matrix - motion.gyro_matrix)) < 0.01


def there_and_back(motion):
    """A motion, and the same backwards in time: it ends where it began."""
    back = np.vstack([-motion.rates[:0:-1], np.zeros((1, 3))])
    rates = np.concatenate([np.zeros((1, 3)), motion.rates[1:], np.zeros((1, 3)), back[:-1]])
    noise = 1e-3 * np.random.default_rng(1).standard_normal(rates.shape)
    gyro = np.linalg.solve(motion.gyro_matrix, rates.T).T + motion.bias[0] + noise
    return gyro, *(np.concatenate([v, v[::-1]]) for v in (motion.accel, motion.mag))


class TestKnowledge:
    def test_bias_and_matrix_within_three_sigma(self):
        """Of sensors as they are expected, whose accelerometer has no bias."""
        deviations = []
        for seed in range(8):
            motion = simulated("hand", RATE, 120.0, seed, accel_bias=0.0)
            f = zr.Attitude(RATE)
            f.process(motion.gyro, motion.accel, motion.mag)
            of_matrix = (f.gyro_matrix - motion.gyro_matrix) / f.gyro_matrix_sigma
            of_bias = (f.bias - motion.bias[-1]) / f.bias_sigma
            deviations.append([*of_matrix.ravel(), *of_bias])
            # And they were learned: at first 0.008 and 0.005.
            assert np.mean(f.gyro_matrix_sigma) < 0.004
        assert np.max(np.abs(deviations)) < 3.0
        # Neither too sure nor too modest.
        assert 0.5 < np.sqrt(np.mean(np.square(deviations))) < 1.3

    def test_tilt_and_heading_within_three_sigma(self):
        for seed in range(4):
            motion = simulated("hand", RATE, 60.0, seed, accel_bias=0.0)
            t = zr.Attitude(RATE).trace(motion.gyro, motion.accel, motion.mag)
            apart = (
                Rotation.from_quat(t["quaternion"], scalar_first=True)
                * Rotation.from_quat(motion.quaternion, scalar_first=True).inv()
            ).as_rotvec()
            tilt = np.hypot(apart[:, 0], apart[:, 1]) / t["tilt_sigma"]
            heading = np.abs(apart[:, 2]) / t["heading_sigma"]
            # In motion for most of the time, where errors last: not all samples count anew.
            assert np.mean(tilt < 3.0) > 0.95
            assert np.mean(heading < 3.0) > 0.95

    def test_rest_is_seen_and_its_bias_known(self):
        motion = simulated("hand", RATE, 30.0, 1)
        t = zr.Attitude(RATE).trace(motion.gyro, motion.accel, motion.mag)
        rest = motion.at_rest & (motion.time > 2.0)
        assert np.mean(t["at_rest"][rest]) > 0.9
        assert not t["at_rest"][motion.time > 7.0].any()
        end = np.flatnonzero(rest)[-1]
        np.testing.assert_allclose(t["bias"][end], motion.bias[end], atol=0.1 * DEG)

    def test_a_magnet_is_told(self):
        motion = zr.simulate_motion("hand", RATE, 60.0, seed=3, magnet=[(30.0, 40.0)])
        t = zr.Attitude(RATE).trace(motion.gyro, motion.accel, motion.mag)
        settled = motion.time > 15.0
        apart = t["disturbed"] != motion.disturbed
        # Half a second until it is trusted again, and a tick.
        assert np.mean(apart[settled]) < 1.0 / 45.0

    def test_status(self):
        f, level, field = zr.Attitude(RATE), [0.0, 0.0, 9.81], [0.0, 20.0, -40.0]
        assert f.status == "starting"
        seen = []
        for k in range(700):
            rate = [0.0, 0.0, np.sin(k / 20.0) if k > 400 else 0.0]
            f.update([np.nan] * 3 if 500 <= k < 520 else rate, level, field)
            seen.append(f.status)
        assert seen[50] == "starting"
        assert seen[300] == "at rest"
        assert seen[515] == "rate missing"
        assert seen[-1] == "moving"
        assert zr.Attitude(RATE, channels=2).status == ["starting"] * 2


def turning(seconds, rate=RATE):
    """About the vertical at 1 rad/s, level."""
    n = round(seconds * rate)
    return np.tile([0.0, 0.0, 1.0], (n, 1)), np.tile([0.0, 0.0, 9.81], (n, 1))


class TestGaps:
    def turned(self, gap, **more):
        """A filter that turned for 3 s, then a sample so many seconds later."""
        f = zr.Attitude(RATE, mag=False, **more)
        f.process(*turning(3.0))
        before = f.copy()
        f.update([0.0, 0.0, 1.0], [0.0, 0.0, 9.81], dt=gap)
        return before, f

    @pytest.mark.parametrize("gap", [0.02, 0.1, 0.5, 1.0])
    def test_up_to_a_second_the_rate_goes_on(self, gap):
        before, f = self.turned(gap)
        turned = (f.rotation * before.rotation.inv()).as_rotvec()
        # Bias and scale that were learned turn with it.
        np.testing.assert_allclose(turned, [0.0, 0.0, gap], atol=1e-3)
        # (1 rad/s)^2 of noise from 50 ms on, and a bias of 1 deg/s for the time and all before it.
        grown = f.heading_sigma**2 - before.heading_sigma**2
        assert grown == pytest.approx(max(gap - 0.05, 0.0), abs=3e-3)

    @pytest.mark.parametrize("gap", [1.5, 4.0])
    def test_beyond_a_second_nothing_is_known_of_it(self, gap):
        before, f = self.turned(gap)
        turned = (f.rotation * before.rotation.inv()).magnitude()
        assert turned < 1e-6
        grown = f.heading_sigma**2 - before.heading_sigma**2
        assert grown == pytest.approx(gap, rel=0.01)

    @pytest.mark.parametrize("angle", [60.0, 180.0])
    def test_whatever_happened_it_is_level_again(self, angle):
        f = zr.Attitude(RATE)
        f.process(*turning(5.0))
        accel = Rotation.from_rotvec([angle * DEG, 0.0, 0.0]).apply([0.0, 0.0, 9.81])
        f.update([0.0, 0.0, 0.0], accel, dt=100.0)
        f.process(np.zeros((100, 3)), np.tile(accel, (100, 1)))
        np.testing.assert_allclose(f.up, accel / 9.81, atol=1e-3)

    def test_a_missing_rate_fades(self):
        """Within 0.3 s; then the body may go on to turn, or not."""
        fades, stopped = zr.Attitude(RATE, mag=False), zr.Attitude(RATE, mag=False)
        for f in (fades, stopped):
            f.process(*turning(3.0))
        before, sigma = fades.rotation, fades.heading_sigma
        nothing = [np.nan] * 3
        for _ in range(4):
            fades.update(nothing, [0.0, 0.0, 9.81])
        share = np.exp(-np.arange(1, 51) / 30.0)
        turned = (fades.rotation * before.inv()).magnitude()
        assert turned == pytest.approx(0.01 * share[:4].sum(), abs=1e-3)
        for _ in range(50):
            stopped.update(nothing, [0.0, 0.0, 9.81])
        turned = (stopped.rotation * before.inv()).magnitude()
        assert turned == pytest.approx(0.01 * share.sum(), abs=0.01)
        # What has faded of 1 rad/s adds up as one angle.
        grown = stopped.heading_sigma**2 - sigma**2
        assert grown == pytest.approx((0.01 * (1.0 - share).sum()) ** 2, abs=3e-3)
        assert stopped.status == "rate missing"

    def test_a_rate_from_before_a_gap_is_not_held(self):
        f = zr.Attitude(RATE, mag=False)
        f.process(*turning(3.0))
        before = f.rotation
        f.update([np.nan] * 3, [0.0, 0.0, 9.81], dt=20.0)
        f.update([np.nan] * 3, [0.0, 0.0, 9.81])
        assert (f.rotation * before.inv()).magnitude() < 1e-9


class TestKeeping:
    def test_switched_on_again_it_knows_scale_and_misalignment(self):
        motion = simulated("hand", RATE, 60.0, 2)
        f, new = zr.Attitude(RATE), zr.Attitude(RATE)
        f.process(motion.gyro, motion.accel, motion.mag)
        known, sigma = f.gyro_matrix, f.gyro_matrix_sigma
        f.power_on()
        assert_same_bits(f.gyro_matrix, known)
        assert_same_bits(f.gyro_matrix_sigma, sigma)
        for name in ("quaternion", "bias", "bias_sigma", "tilt_sigma", "heading_sigma"):
            assert_same_bits(getattr(f, name), getattr(new, name))
        assert f.status == "starting"

    def test_a_known_bias_is_a_better_start(self):
        motion = simulated("hand", RATE, 30.0, 2, "motion", gyro_bias=(0.05, -0.04, 0.03))
        given = zr.Attitude(RATE, mag=False, bias=motion.bias[0], bias_sigma=0.02 * DEG)
        anyhow = zr.Attitude(RATE, mag=False)
        drifts = [
            zr.metrics.orientation_errors(
                f.process(motion.gyro, motion.accel), motion.quaternion, heading="relative"
            ).heading
            for f in (given, anyhow)
        ]
        assert drifts[0] < 0.5 * drifts[1]

    def test_what_a_filter_has_learned_is_believed_to_a_twentieth_of_a_degree(self):
        gyro = np.radians([4.0, -3.0, 2.0]) + 1e-3 * np.random.default_rng(1).normal(size=(3000, 3))
        drift = zr.DriftFilter(RATE, channels=3, rest_limit=10.0 * DEG)
        drift.process(gyro)
        known = zr.Attitude(RATE, mag=False, bias=drift)
        np.testing.assert_allclose(known.bias_sigma, 0.05 * DEG, rtol=1e-9)
        np.testing.assert_allclose(known.bias, drift.bias)
        numbers = zr.Attitude(RATE, mag=False, bias=drift.bias)
        np.testing.assert_allclose(numbers.bias_sigma, 0.5 * DEG, rtol=1e-9)

    def test_a_calibration_is_believed_as_far_and_gives_the_matrix(self):
        known = calibration()
        f = zr.Attitude(RATE, mag=False, gyro_unit="deg/s", bias=known)
        np.testing.assert_allclose(f.bias_sigma, 0.05, rtol=1e-9)
        np.testing.assert_allclose(f.bias, known.gyro.bias, rtol=1e-12)
        np.testing.assert_allclose(f.gyro_matrix, known.gyro.correction, rtol=1e-12)
        wider = zr.Attitude(RATE, mag=False, gyro_unit="deg/s", bias=known, bias_sigma=0.2)
        np.testing.assert_allclose(wider.bias_sigma, 0.2, rtol=1e-9)

    def test_it_goes_on_from_a_known_orientation(self):
        motion = simulated("hand", RATE, 30.0, 2, "motion")
        for given in (
            motion.quaternion[0],
            Rotation.from_quat(motion.quaternion[0], scalar_first=True),
        ):
            f = zr.Attitude(RATE)
            f.align(given)
            assert f.status != "wrong unit"
            q = f.process(motion.gyro, motion.accel, motion.mag)
            assert errors(q, motion, motion.time < 2.0)[0] < 2.0


class TestSmooth:
    @pytest.mark.parametrize("frame", ["enu", "ned"])
    def test_it_is_better_than_the_filter_and_leaves_it_alone(self, frame):
        motion = simulated("hand", RATE, 60.0, 2)
        f = zr.Attitude(RATE, frame=frame)
        before = f.to_bytes()
        t = f.smooth(motion.gyro, motion.accel, motion.mag)
        assert f.to_bytes() == before
        traced = f.trace(motion.gyro, motion.accel, motion.mag)
        assert {name: v.shape for name, v in t.items()} == {n: v.shape for n, v in traced.items()}
        turn = {"enu": np.eye(3), "ned": [[0, 1, 0], [1, 0, 0], [0, 0, -1]]}[frame]
        back = Rotation.from_matrix(turn).inv()
        smoothed, filtered = (
            errors(
                (back * Rotation.from_quat(q, scalar_first=True)).as_quat(scalar_first=True), motion
            )
            for q in (t["quaternion"], traced["quaternion"])
        )
        assert np.all(smoothed < filtered)
        assert np.mean(t["bias_sigma"]) < np.mean(traced["bias_sigma"])

    def test_without_magnetometer_the_first_heading_is_that_of_the_filter(self):
        motion = simulated("hand", RATE, 60.0, 2)
        f = zr.Attitude(RATE, mag=False)
        t = f.smooth(motion.gyro, motion.accel)
        q = f.process(motion.gyro, motion.accel)
        drift = [
            zr.metrics.orientation_errors(one, motion.quaternion, heading="relative").heading
            for one in (t["quaternion"], q)
        ]
        assert drift[0] < drift[1]

    def test_a_field_tells_the_heading_and_nothing_of_the_gyro(self):
        motion = simulated("hand", RATE, 60.0, 2)
        iron = motion.mag + np.array([8.0, -5.0, 3.0])
        with_field = zr.Attitude(RATE, learn_magnetometer=True).smooth(
            motion.gyro, motion.accel, iron
        )
        without = zr.Attitude(RATE, mag=False).smooth(motion.gyro, motion.accel)
        for name in ("bias", "bias_sigma", "gyro_matrix", "gyro_matrix_sigma"):
            np.testing.assert_array_equal(with_field[name], without[name], err_msg=name)
        assert not np.array_equal(with_field["quaternion"], without["quaternion"])

    def test_bodies_side_by_side(self):
        motions = [simulated("hand", RATE, 30.0, seed) for seed in (1, 2)]
        sensors = [
            np.stack([getattr(m, s) for m in motions], axis=1) for s in ("gyro", "accel", "mag")
        ]
        both = zr.Attitude(RATE, channels=2).smooth(*sensors)
        for k, motion in enumerate(motions):
            alone = zr.Attitude(RATE).smooth(motion.gyro, motion.accel, motion.mag)
            for name, values in alone.items():
                np.testing.assert_array_equal(both[name][:, k], values)

    @pytest.mark.parametrize("n", [0, 1, 2, 9])
    def test_short_records(self, n):
        rows = np.tile([0.0, 0.0, 9.81], (n, 1))
        t = zr.Attitude(RATE).smooth(0.0 * rows, rows, rows)
        assert t["quaternion"].shape == (n, 4)
        assert all(np.all(np.isfinite(values)) for values in t.values())
