"""Rotations between the sensors of an array: found from motion, refused without it, in files."""

import json

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.array.logs import array_log
from zerorate.array.rotations import find_rotations, read_rotations

HEAD = {"format": "zerorate rotations", "version": 1}
RATE = 100.0
N = 6000
UPSIDE_DOWN = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def motion(seed=1, directions=3):
    """Return rates of a body in deg/s, at rest for 15 s at the start and 10 s at the end."""
    random = np.random.default_rng(seed)
    time = np.arange(N) / RATE
    rates = np.zeros((N, 3))
    for axis in range(directions):
        for _ in range(4):
            frequency, phase = random.uniform(0.1, 1.5), random.uniform(0.0, 6.3)
            rates[:, axis] += random.uniform(20, 150) * np.sin(2 * np.pi * frequency * time + phase)
    rates[:1500] = rates[5000:] = 0.0
    return rates


def rotation(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return q * np.linalg.det(q)


def sensors(rates, matrices, noise=0.1, scale=0.0, seed=2):
    """Return what sensors give that these matrices turn into the axes of the body."""
    random = np.random.default_rng(seed)
    found = []
    for matrix in matrices:
        factors = 1.0 + scale * random.standard_normal(3)
        bias = random.standard_normal(3)
        found.append(rates @ matrix * factors + bias + noise * random.standard_normal(rates.shape))
    return np.stack(found, axis=1)


def angle(one, other):
    """Return the angle between two rotations, deg."""
    return np.rad2deg(2.0 * np.arcsin(min(1.0, np.linalg.norm(one - other) / np.sqrt(8.0))))


def find(z, **asked):
    return find_rotations(z, RATE, unit="deg/s", **asked)


class TestFinding:
    def test_ideal_sensors_come_out_exactly(self):
        matrices = [np.eye(3), UPSIDE_DOWN, rotation(3), rotation(4)]
        found = find(sensors(motion(), matrices, noise=0.01))
        np.testing.assert_array_equal(found.matrices[0], np.eye(3))
        assert found.sigma_deg[0] == 0.0
        for matrix, one in zip(matrices[1:], found.matrices[1:], strict=True):
            # Noise of 0.01 against 100 deg/s, over 280 means; the bias costs about as much.
            assert angle(one, matrix) < 0.002
        np.testing.assert_allclose(found.angles[:2], [0.0, 180.0], atol=0.002)

    def test_turned_sensors_give_the_rates_of_the_first(self):
        rates = motion()
        z = sensors(rates, [np.eye(3), rotation(5)], noise=0.0)
        z += 1e-3 * np.random.default_rng(1).standard_normal(z.shape)
        found = find(z)
        turned = (z[:, 1] - z[:1000, 1].mean(axis=0)) @ found.matrices[1].T
        np.testing.assert_allclose(turned, z[:, 0] - z[:1000, 0].mean(axis=0), atol=0.05)

    def test_errors_say_how_wrong_they_are(self):
        """With noise as large as what scale errors of a per cent do."""
        shares = []
        for seed in range(8):
            matrices = [np.eye(3), *(rotation(10 * seed + k) for k in range(1, 5))]
            found = find(sensors(motion(seed), matrices, noise=1.0, scale=0.01, seed=seed))
            shares += [
                angle(one, matrix) / error
                for matrix, one, error in zip(
                    matrices[1:], found.matrices[1:], found.sigma_deg[1:], strict=True
                )
            ]
        # Ten parts know their spread to a quarter; sensors share the errors of the first.
        assert 0.5 < np.sqrt(np.mean(np.square(shares))) < 1.6

    def test_saturated_samples_do_not_count(self):
        rates = 3.0 * motion()
        matrices = [np.eye(3), rotation(6)]
        z = np.clip(sensors(rates, matrices), -500.0, 500.0)
        assert (np.abs(z) >= 500.0).mean() > 0.05
        whole, without = find(z).matrices[1], find(z, limit=500.0).matrices[1]
        assert angle(without, matrices[1]) < 0.02
        assert angle(whole, matrices[1]) > 10.0 * angle(without, matrices[1])

    def test_missing_samples_do_not_count(self):
        z = sensors(motion(), [np.eye(3), UPSIDE_DOWN])
        holes = np.random.default_rng(1).random((N, 2)) < 0.01
        z[holes] = np.nan
        assert angle(find(z).matrices[1], UPSIDE_DOWN) < 0.02

    def test_the_unit_changes_nothing(self):
        z = sensors(motion(), [np.eye(3), rotation(7)])
        one = find(z)
        other = find_rotations(np.deg2rad(z), RATE, unit="rad/s")
        # The rest detector counts in the unit that it is given.
        np.testing.assert_allclose(other.matrices, one.matrices, atol=1e-6)

    def test_two_directions_are_enough(self):
        z = sensors(motion(directions=2), [np.eye(3), rotation(8)])
        assert angle(find(z).matrices[1], rotation(8)) < 0.05

    def test_scale_errors_do_not_turn_the_result(self):
        rates = motion() * [1.0, 0.4, 0.3]
        matrix = rotation(8)
        found = find(sensors(rates, [np.eye(3), matrix], noise=0.01, scale=0.01))
        # Of second order: a per cent of a per cent of a radian.
        assert angle(found.matrices[1], matrix) < 0.02


class TestRefusals:
    def test_one_direction(self):
        rates = motion(directions=1)
        with pytest.raises(zr.LogError, match=r"two directions: '1' turns about .1\.00, .* alone"):
            find(sensors(rates, [np.eye(3), rotation(1)]))

    def test_no_motion(self):
        with pytest.raises(zr.LogError, match=r"3 s of motion, and 'a' moves .* for 0 s"):
            find(sensors(np.zeros((N, 3)), [np.eye(3)] * 2), labels=["a", "b"])

    def test_no_rest(self):
        rates = np.tile(motion()[1500:5000], (2, 1))
        with pytest.raises(zr.LogError, match="'1' never rests, so its bias is not known"):
            find(sensors(rates, [np.eye(3)] * 2))

    def test_a_dead_sensor(self):
        z = sensors(motion(), [np.eye(3)] * 3)
        z[:, 1] = np.nan
        with pytest.raises(zr.LogError, match="'2' holds no sample"):
            find(z)

    def test_mirrored_axes(self):
        z = sensors(motion(), [np.eye(3), np.diag([1.0, -1.0, 1.0])])
        with pytest.raises(zr.LogError, match="axes of '2' are mirrored relative to those of '1'"):
            find(z)

    def test_a_sensor_that_moves_on_its_own(self):
        z = sensors(motion(), [np.eye(3)] * 2)
        z[:, 1] = sensors(motion(seed=9), [np.eye(3)])[:, 0]
        with pytest.raises(zr.LogError, match=r"'2' does not turn as '1' does: .* % of the rate"):
            find(z)

    @pytest.mark.parametrize(
        ("z", "asked", "message"),
        [
            (np.zeros((9, 3)), {}, r"shape \(n, sensors, 3\), got \(9, 3\)"),
            (np.zeros((9, 2, 3)), {"labels": ["a"]}, r"labels must be 2 different names, got"),
            (np.zeros((9, 2, 3)), {"labels": ["a", "a"]}, r"labels must be 2 different names"),
            (np.zeros((9, 2, 3)), {"limit": -1.0}, "limit"),
        ],
    )
    def test_arguments(self, z, asked, message):
        with pytest.raises(ValueError, match=message):
            find(z, **asked)


class TestFiles:
    def text(self, **listed):
        return json.dumps(HEAD | {"rotations": listed})

    def test_what_is_written_is_read_to_the_last_bit(self, tmp_path):
        z = sensors(motion(), [np.eye(3), rotation(1), rotation(2)])
        found = find(z, labels=["a", "b", "c"])
        found.to_json(tmp_path / "turns.json")
        again = read_rotations(tmp_path / "turns.json")
        np.testing.assert_array_equal(again.matrices, found.matrices)
        np.testing.assert_array_equal(again.sigma_deg, found.sigma_deg)
        assert again.labels == found.labels
        with pytest.raises(FileExistsError):
            found.to_json(tmp_path / "turns.json")

    def test_sigmas_of_files_before_they_had_their_name(self):
        found = read_rotations(
            json.dumps(HEAD | {"rotations": {"a": [1, 0, 0, 0]}, "errors_deg": {"a": 0.5}})
        )
        assert found.sigma_deg == [0.5]

    def test_quaternions(self):
        half = np.sqrt(0.5)
        # A quarter turn about z brings x to y; to four digits, as a person types it.
        found = read_rotations(self.text(a=[1, 0, 0, 0], b=[round(half, 4), 0, 0, round(half, 4)]))
        np.testing.assert_allclose(found.matrices[1] @ [1, 0, 0], [0, 1, 0], atol=1e-12)
        np.testing.assert_array_equal(found.matrices[0], np.eye(3))
        assert np.isnan(found.sigma_deg).all()

    def test_by_label(self):
        found = read_rotations(self.text(a=[1, 0, 0, 0], b=UPSIDE_DOWN.tolist()))
        np.testing.assert_array_equal(found.of(["b", "a"]), [UPSIDE_DOWN, np.eye(3)])
        with pytest.raises(ValueError, match="there is no rotation of c, d; known: a, b"):
            found.of(["a", "c", "d"])

    @pytest.mark.parametrize(
        ("given", "message"),
        [
            ([[1, 0, 0], [0, 1, 0], [0, 0, 1.001]], "matrix of 'b' is no rotation: it is off by"),
            ([[1, 0, 0], [0, 1, 0], [0, 0, -1]], "'b' is no rotation: its determinant is -1"),
            ([1, 1, 0, 0], "quaternion of 'b' must have length 1, got 1.414"),
            ([1, 2], r"'b' must hold finite numbers of shape \(3, 3\)"),
            ("up", r"'b' must hold finite numbers of shape \(3, 3\)"),
        ],
    )
    def test_what_is_no_rotation_is_refused(self, given, message):
        with pytest.raises(ValueError, match=message):
            read_rotations(self.text(a=[1, 0, 0, 0], b=given))

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("{}", "the text is not a zerorate rotations in JSON: 'format' must be a string"),
            (json.dumps(HEAD | {"version": 2, "rotations": {}}), "of version 2"),
            (json.dumps(HEAD | {"rotations": {}}), "must have an entry for each sensor"),
            (json.dumps(HEAD | {"rotations": []}), "'rotations' must be an object"),
        ],
    )
    def test_other_content_is_refused(self, text, message):
        with pytest.raises(ValueError, match=message):
            read_rotations(text)


@pytest.fixture(scope="module")
def log():
    path = RECORDINGS / "mimu4444_array8_62hz_exp1.parquet"
    return array_log(zr.read_recording(path, only=["gyro"]))


@pytest.fixture(scope="module")
def found(log):
    return find_rotations(log.data, log.rate, unit=log.unit, limit=1997.9, labels=log.labels)


@needs_recordings
class TestBoardOfEight:
    """IMUs on both sides of a board: those below read (-y, -x, -z) in the axes of those above."""

    def test_they_lie_as_the_board_says(self, found):
        off = [
            angle(matrix, UPSIDE_DOWN if k % 2 else np.eye(3))
            for k, matrix in enumerate(found.matrices)
        ]
        # Parts are soldered to half a degree.
        assert max(off) < 0.5
        # Sensors that sample at moments of their own leave some 2 % of 700 deg/s.
        assert found.residuals.max() < 0.025
        assert found.sigma_deg.max() < 0.2

    def test_halves_of_the_record_agree(self, log):
        half = log.n // 2
        one, other = (
            find_rotations(part, log.rate, unit=log.unit, limit=1997.9)
            for part in (log.data[:half], log.data[half:])
        )
        off = [angle(*pair) for pair in zip(one.matrices[1:], other.matrices[1:], strict=True)]
        told = np.hypot(one.sigma_deg[1:], other.sigma_deg[1:])
        # Means of seven, whose errors share those of the first.
        assert np.sqrt(np.mean(np.square(off / told))) < 1.5
        assert max(off) < 0.2
