"""The replay of an array: what is noted of each sensor, and the noise that is left."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.array.logs import ArrayLog, array_log
from zerorate.array.rotations import find_rotations
from zerorate.tasks.array import SAMPLE_FATES, replay_array

RATE = 100.0
N = 6000


def rest(sensors=4, axes=3, seed=1, noise=0.1):
    """Return a log of sensors at rest, each with a bias of its own."""
    random = np.random.default_rng(seed)
    shape = (sensors, 3) if axes == 3 else (sensors,)
    z = random.standard_normal(shape) + noise * random.standard_normal((N, *shape))
    letters = ("x", "y", "z") if axes == 3 else ("z",)
    labels = tuple("abcdefgh"[:sensors])
    return ArrayLog(np.arange(N) / RATE, RATE, z, labels, "deg/s", letters)


def with_data(log, data):
    return ArrayLog(log.time, log.rate, data, log.labels, log.unit, log.axes, log.meta)


class TestRate:
    @pytest.mark.parametrize("axes", [1, 3])
    def test_it_is_that_of_the_array(self, axes):
        log = rest(axes=axes)
        found = replay_array(log, limit=50.0)
        limits = {"rest_limit": 10.0, "bias_limit": 20.0, "limit": 50.0}
        array = zr.GyroArray(RATE, 4, axes=axes, **limits)
        np.testing.assert_array_equal(found.rate, array.process(log.data))
        np.testing.assert_array_equal(found.bias, array.bias)
        assert found.to_log().channels == axes

    def test_one_sensor_is_a_filter(self):
        log = rest(sensors=1)
        alone = zr.DriftFilter(RATE, channels=3, rest_limit=10.0, bias_limit=20.0)
        np.testing.assert_array_equal(replay_array(log).rate, alone.process(log.data[:, 0]))

    def test_without_a_unit_rest_has_no_limits(self):
        log = rest()
        bare = ArrayLog(log.time, RATE, log.data, log.labels, "unit")
        np.testing.assert_array_equal(
            replay_array(bare).rate, zr.GyroArray(RATE, 4).process(log.data)
        )

    def test_nothing_to_replay(self):
        log = rest()
        with pytest.raises(zr.LogError, match="no sensor has a sample"):
            replay_array(with_data(log, np.full_like(log.data, np.nan)))


class TestFates:
    def test_all_are_used(self):
        found = replay_array(rest())
        # Before its bias is known a sensor may be left out for a while.
        assert found.shares[:, 0].min() > 0.95
        np.testing.assert_allclose(found.shares.sum(axis=1), 1.0)
        used = np.isfinite(found.rate).all(axis=1)
        np.testing.assert_allclose(found.weights[used].sum(axis=1), 1.0)

    def test_missing_and_saturated_samples(self):
        log = rest()
        z = log.data.copy()
        z[1000:1500, 1, 2] = np.nan
        z[2000:2300, 3, 0] = -60.0
        found = replay_array(with_data(log, z), limit=50.0)
        counts = [
            [(found.fate[:, k] == SAMPLE_FATES.index(kind)).sum() for kind in SAMPLE_FATES]
            for k in range(4)
        ]
        assert counts[1][SAMPLE_FATES.index("missing")] == 500
        assert counts[3][SAMPLE_FATES.index("saturated")] == 300
        assert counts[0][1:4] == [0, 0, 0]
        assert found.health == ("good",) * 4

    def test_a_sensor_that_disagrees(self):
        log = rest()
        z = log.data.copy()
        z[3000:, 2, 0] += 20.0
        found = replay_array(with_data(log, z))
        ((start, end),) = found.excluded_spans(2)
        # It takes a tick of a quarter of a second or two.
        assert 30.0 < start < 31.0
        assert end == N / RATE
        assert found.health[2] == "excluded"
        assert found.excluded_spans(0) == []
        assert (found.weights[found.fate[:, 2] == SAMPLE_FATES.index("excluded"), 2] == 0.0).all()
        assert found.to_log().extra["excluded_c"].sum() == round((end - start) * RATE)


class TestAllan:
    def test_equal_sensors_gain_the_root_of_their_number(self):
        found = replay_array(rest(sensors=4))
        over_mean, over_one = found.allan.gains()
        assert found.allan.taus[found.allan.second] == 1.0
        # Sixty seconds know the ratio at an eighth of a second to some per cent.
        at = np.searchsorted(found.allan.taus, 0.1)
        assert over_one[-1, at] == pytest.approx(2.0, rel=0.1)
        assert over_mean[-1, at] == pytest.approx(1.0, rel=0.05)

    def test_a_noisy_sensor_hardly_counts(self):
        log = rest(sensors=3)
        z = log.data.copy()
        z[:, 1] += np.random.default_rng(3).standard_normal((N, 3))
        found = replay_array(with_data(log, z))
        over_mean, _ = found.allan.gains()
        # The mean has (0.1^2 + 0.1^2 + 1)^(1/2) / 3 = 0.34, the best weights 0.07.
        assert over_mean[-1, found.allan.second] > 3.0
        assert found.mean_weights[1] < 0.05

    def test_turned_sensors_are_measured_in_the_axes_of_the_body(self):
        log = rest(sensors=2)
        z = log.data * [1.0, 2.0, 4.0]
        matrix = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        plain = replay_array(with_data(log, z)).allan
        turned = replay_array(with_data(log, z), rotations=[np.eye(3), matrix]).allan
        np.testing.assert_allclose(turned.sensors[0], plain.sensors[0], rtol=1e-9)
        np.testing.assert_allclose(turned.sensors[1], plain.sensors[1, [1, 0, 2]], rtol=1e-9)

    def test_motion_does_not_count(self):
        log = rest()
        z = log.data.copy()
        turn = 40.0 * np.sin(np.arange(1000) / 30.0)
        z[3000:4000] += turn[:, np.newaxis, np.newaxis]
        still, moved = (replay_array(one).allan for one in (log, with_data(log, z)))
        at = still.second
        np.testing.assert_allclose(moved.sensors[:, :, at], still.sensors[:, :, at], rtol=0.35)


class TestColumns:
    def test_they_stand_beside_the_log(self, tmp_path):
        found = replay_array(rest())
        path = tmp_path / "fused.parquet"
        zr.write_log(found.to_log(), path)
        again = zr.read_log(path)
        np.testing.assert_array_equal(again.data, found.rate)
        weights = zr.read_log(path, columns=["weight_a", "weight_b", "weight_c", "weight_d"])
        np.testing.assert_array_equal(weights.data, found.weights)

    def test_they_are_no_gyros_of_a_recording(self, tmp_path):
        log = rest(axes=1)
        named = ArrayLog(log.time, RATE, log.data, ("gyro1", "g_2", "gz", "w"), "deg/s", ("z",))
        found = replay_array(named)
        zr.write_log(found.to_log(), tmp_path / "fused.csv")
        assert zr.read_recording(tmp_path / "fused.csv").names == ("gyro",)


@pytest.fixture(scope="module")
def replayed():
    path = RECORDINGS / "mimu4444_array8_62hz_exp1.parquet"
    log = array_log(zr.read_recording(path, only=["gyro"]))
    turned = find_rotations(log.data, log.rate, unit=log.unit, limit=1997.9)
    return replay_array(log, rotations=turned.matrices, limit=1997.9)


@needs_recordings
class TestBoardOfEight:
    """Ten minutes of eight IMUs on a board, in twenty poses and in fast motion."""

    def test_nobody_is_excluded(self, replayed):
        assert not replayed.shares[:, SAMPLE_FATES.index("excluded")].any()
        # In the fast turns a fortieth of the samples is at the end of the range.
        kept = replayed.shares[
            :, [SAMPLE_FATES.index("used"), SAMPLE_FATES.index("saturated")]
        ].sum(axis=1)
        assert kept.min() > 0.999
        assert not replayed.disputed.any()

    def test_the_gain(self, replayed):
        over_mean, over_one = (gain[-1, replayed.allan.second] for gain in replayed.allan.gains())
        assert over_mean > 1.15
        assert over_one > np.sqrt(8.0)
