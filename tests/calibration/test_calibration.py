"""A finished calibration: other axes, other units, JSON, and what is wrong with a file of one."""

import copy
import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.calibrations import COUNTS, FREE, INVALID, calibration
from zerorate.calibration import Calibration
from zerorate.calibration.parameters import PARAMETERS

FRAMES = ("x", "z", "symmetric")
seeds = st.integers(0, 2**32 - 1)


def rotation(vector):
    """Rodrigues' formula, written out once more."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


class TestFrames:
    @pytest.mark.parametrize("frame", FRAMES)
    def test_the_accelerometer_has_the_form_of_its_frame(self, frame):
        matrix = np.array(calibration().to_frame(frame).accel.matrix)
        expected = {"x": np.tril(matrix), "z": np.triu(matrix), "symmetric": matrix.T}[frame]
        np.testing.assert_array_equal(matrix, expected)
        assert calibration().to_frame(frame).frame == frame

    @given(seed=seeds)
    def test_every_way_through_the_frames_ends_where_it_began(self, seed):
        first = calibration(seed, rests=3)
        again = first.to_frame("z").to_frame("symmetric").to_frame("x")
        # A few roundings of numbers of size one, and of the products in a covariance.
        np.testing.assert_allclose(again.values, first.values, atol=1e-13)
        size = np.abs(first.covariance).max()
        np.testing.assert_allclose(again.covariance, first.covariance, atol=1e-11 * size)
        np.testing.assert_allclose(again.rests[1].direction, first.rests[1].direction, atol=1e-13)
        np.testing.assert_allclose(again.turns[1].axis, first.turns[1].axis, atol=1e-13)

    @pytest.mark.parametrize("frame", ["z", "symmetric"])
    @pytest.mark.parametrize("counts", [False, True])
    def test_the_covariance_is_that_of_finite_differences(self, frame, counts):
        made = calibration(units=COUNTS, scales=(1670.0, 7509.0)) if counts else calibration()
        jacobian = np.zeros((33, 33))
        for place in FREE:
            step = np.zeros(33)
            step[place] = 1e-6 * max(1.0, abs(made.values[place]))
            ends = [replace(made, values=made.values + h).to_frame(frame) for h in (step, -step)]
            jacobian[:, place] = (ends[0].values - ends[1].values) / (2.0 * step[place])
        expected = jacobian @ made.covariance @ jacobian.T
        found = made.to_frame(frame).covariance
        sigma = np.sqrt(np.outer(np.diagonal(found), np.diagonal(found)))
        # Differences over steps of 1e-6 keep nine digits.
        assert (np.abs(found - expected) <= 1e-7 * sigma + 1e-20).all()

    @pytest.mark.parametrize("frame", FRAMES)
    def test_covariances_are_those_of_numbers(self, frame):
        covariance = calibration().to_frame(frame).covariance
        np.testing.assert_array_equal(covariance, covariance.T)
        least, *_, most = np.linalg.eigvalsh(covariance)
        assert least > -1e-12 * most

    def test_what_hangs_on_an_unknown_element_is_unknown_in_other_axes_as_well(self):
        made = calibration()
        identifiable = made.identifiable.copy()
        identifiable[PARAMETERS.index("accel.matrix.yx")] = False
        turned = replace(made, identifiable=identifiable).to_frame("z")
        unknown = {n for n, known in zip(PARAMETERS, turned.identifiable, strict=True) if not known}
        assert {"accel.matrix.xy", "gyro.matrix.xy", "gyro.matrix.yx"} <= unknown
        assert not unknown & {"accel.matrix.xx", "accel.matrix.yx", "gyro.matrix.zz", "gyro.bias.x"}

    def test_a_frame_it_is_in_changes_nothing(self):
        made = calibration()
        assert made.to_frame("x") is made

    def test_refusals(self):
        mirrored = calibration().values.copy()
        mirrored[:3] *= -1.0
        with pytest.raises(ValueError, match=r"^the axes of a sensor are left-handed"):
            replace(calibration(), values=mirrored).to_frame("z")
        with pytest.raises(ValueError, match=r"^frame must be 'x', 'z' or 'symmetric', got 'y'$"):
            calibration().to_frame("y")


class TestRotation:
    @given(
        seed=seeds,
        angle=st.floats(1e-6, 3.14),
        axis=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    )
    def test_it_turns_the_gyro_into_the_accelerometer(self, seed, angle, axis):
        """A gyro whose own matrix is L and which is turned by C^T: W = L C^T."""
        made = calibration(seed)
        vector = angle * np.array(axis) / np.linalg.norm(axis)
        lower = np.tril(made.values[12:21].reshape(3, 3))
        values = made.values.copy()
        values[12:21] = (lower @ rotation(vector).T).ravel()
        found = replace(made, values=values).gyro_to_accel
        np.testing.assert_allclose(rotation(np.array(found)), rotation(vector), atol=1e-10)

    def test_it_is_the_same_in_every_frame(self):
        made = calibration()
        expected = made.gyro_to_accel
        for frame in ("z", "symmetric"):
            found = made.to_frame(frame).gyro_to_accel
            np.testing.assert_allclose(found, expected, atol=1e-12)
            sigmas = [[one.sigma for one in many] for many in (found, expected)]
            np.testing.assert_allclose(*sigmas, rtol=1e-9)

    @pytest.mark.parametrize("angle", [0.01, 1.0, 2.8])
    def test_its_errors_are_those_of_finite_differences(self, angle):
        made = calibration()
        lower = np.tril(made.values[12:21].reshape(3, 3))
        values = made.values.copy()
        values[12:21] = (lower @ rotation(angle * np.array([0.6, 0.0, -0.8])).T).ravel()
        made = replace(made, values=values)
        jacobian = np.zeros((3, 33))
        for place in FREE:
            step = 1e-6 * np.eye(33)[place]
            ends = [replace(made, values=made.values + h).gyro_to_accel for h in (step, -step)]
            jacobian[:, place] = (np.array(ends[0]) - np.array(ends[1])) / 2e-6
        expected = np.sqrt(np.diagonal(jacobian @ made.covariance @ jacobian.T))
        np.testing.assert_allclose([one.sigma for one in made.gyro_to_accel], expected, rtol=1e-6)

    def test_a_mirrored_gyro_has_none(self):
        values = calibration().values.copy()
        values[12:15] *= -1.0
        found = replace(calibration(), values=values).gyro_to_accel
        assert not any(one.known for one in found)

    def test_an_unknown_element_makes_its_angle_unknown(self):
        made = calibration()
        identifiable = made.identifiable.copy()
        identifiable[PARAMETERS.index("gyro.matrix.yz")] = False
        found = replace(made, identifiable=identifiable).gyro_to_accel
        assert [one.identifiable for one in found] == [False, True, True]


class TestUnits:
    def test_the_samples_decide(self):
        made = calibration()
        found = made.in_units(gyro="rad/s", accel="m/s^2")
        assert (found.gyro_units, found.accel_units) == (("rad/s",) * 2, ("m/s^2",) * 2)
        np.testing.assert_array_equal(found.values[12:21], made.values[12:21])
        np.testing.assert_allclose(found.values[21:], np.radians(made.values[21:]), rtol=1e-15)
        np.testing.assert_allclose(found.values[9:12], 9.80665 * made.values[9:12], rtol=1e-15)
        sigmas = [[one.sigma for one in each.gyro.bias] for each in (found, made)]
        np.testing.assert_allclose(sigmas[0], np.radians(sigmas[1]), rtol=1e-14)
        assert made.in_units() is made

    @pytest.mark.parametrize(
        ("units", "match"),
        [
            ({"gyro": "g"}, "cannot convert deg/s"),
            (
                {"accel": "unit"},
                "is of an accelerometer in g, and these samples are of unknown unit",
            ),
            ({"gyro": "furlongs"}, "these samples are of unknown unit"),
        ],
    )
    def test_refusals(self, units, match):
        with pytest.raises(ValueError, match=match):
            calibration().in_units(**units)

    def test_counts_have_no_other_unit(self):
        with pytest.raises(ValueError, match="is of a gyro of unknown unit, and these"):
            calibration(units=COUNTS).in_units(gyro="deg/s")


class TestJson:
    @given(seed=seeds)
    def test_it_comes_back_to_the_last_bit(self, seed):
        made = calibration(seed, rests=4, temperature=23.5, notes=("gravity was assumed",))
        found = Calibration.from_json(made.to_json())
        assert found.to_json() == made.to_json()
        np.testing.assert_array_equal(found.values, made.values)
        np.testing.assert_array_equal(found.covariance, made.covariance)
        np.testing.assert_array_equal(found.rests[3].accel, made.rests[3].accel)
        assert found.turns[1].rests == made.turns[1].rests
        assert (found.temperature, found.notes) == (23.5, ("gravity was assumed",))

    def test_what_is_not_known_is_null_and_comes_back(self):
        made = calibration(rests=3)
        rest = replace(made.rests[0], norm_error=np.nan, direction=np.full(3, np.nan))
        made = replace(made, rests=(rest, *made.rests[1:]), carry_error=np.nan)
        content = json.loads(made.to_json(), parse_constant=pytest.fail)
        assert content["errors"]["carry_error"] is None
        found = Calibration.from_json(made.to_json())
        assert np.isnan([found.carry_error, found.rests[0].norm_error]).all()
        assert np.isnan(found.rests[0].direction).all()

    def test_it_says_what_it_means(self):
        content = json.loads(calibration(**INVALID).to_json())
        assert content["valid"] is False
        assert list(content["parameters"]) == list(PARAMETERS)
        assert "raw_gyro = W w + b_g + G f" in content["model"]
        assert content["units"] == {
            "accel": {"raw": "g", "corrected": "g"},
            "gyro": {"raw": "deg/s", "corrected": "deg/s"},
        }
        assert Calibration.from_json(json.dumps(content)).valid is False

    def test_a_file(self, tmp_path):
        path = tmp_path / "cal.json"
        text = calibration().to_json(path)
        assert path.read_text(encoding="utf-8") == text
        assert Calibration.from_json(path).to_json() == text
        with pytest.raises(FileExistsError):
            calibration().to_json(path)
        calibration(2).to_json(path, force=True)
        assert path.read_text(encoding="utf-8") != text

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"version": 2}, "it is of version 2, and this zerorate reads version 1"),
            ({"format": "zerorate noise model"}, "format is 'zerorate noise model', expected"),
            ({"frame": "y"}, "frame is 'y', expected one of x, z, symmetric"),
            ({"gravity": 0.0}, "'gravity' must be a positive number, got 0.0"),
            ({"gravity": "9.8"}, "'gravity' must be a number, got '9.8'"),
            ({"rate": True}, "'rate' must be a number, got True"),
            ({"rests": None}, "'rests' must be a list, got None"),
            ({"rests": [{}]}, "'start' must be a number, got None"),
            ({"covariance": [[1.0]]}, r"'covariance' must hold finite numbers of shape \(33, 33\)"),
            ({"covariance": [["a"] * 33] * 33}, "'covariance' must hold finite numbers"),
            ({"covariance": np.full((33, 33), -1.0).tolist()}, "'covariance' is not that of any"),
            ({"covariance": (np.eye(33) + 2).tolist()[::-1]}, "'covariance' is not that of any"),
            ({"parameters": {}}, "'accel.matrix.xx' must be an object, got None"),
            ({"problems": [1]}, "'problems' must be a string, got 1"),
            ({"units": {"accel": {}}}, "'raw' must be a string, got None"),
        ],
    )
    def test_refusals(self, change, match):
        content = {**json.loads(calibration(rests=2).to_json()), **change}
        with pytest.raises(ValueError, match=match) as caught:
            Calibration.from_json(json.dumps(content))
        assert str(caught.value).startswith("the text is not a zerorate calibration in JSON: ")

    def test_a_turn_between_rests_that_are_not_there(self):
        content = json.loads(calibration(rests=3).to_json())
        content["turns"][0]["rests"] = [0, 7]
        with pytest.raises(ValueError, match=r"a turn lies between rests \(0, 7\)"):
            Calibration.from_json(json.dumps(content))

    def test_another_file(self, tmp_path):
        path = tmp_path / "a.json"
        path.write_text("[1, 2]", encoding="utf-8")
        with pytest.raises(
            ValueError, match=r"a\.json is not a zerorate calibration in JSON: 'for"
        ):
            Calibration.from_json(path)
        path.write_bytes(b"\xff\xfe{")
        with pytest.raises(ValueError, match="is not a zerorate calibration in JSON"):
            Calibration.from_json(path)
        with pytest.raises(FileNotFoundError):
            Calibration.from_json(tmp_path / "none.json")


def test_copies_and_pickles_are_the_same():
    made = calibration(rests=3)
    for found in (copy.deepcopy(made), pickle.loads(pickle.dumps(made))):
        assert found.to_json() == made.to_json()


def test_one_line():
    assert repr(calibration(rests=4)) == "Calibration(valid; 3 rests and 2 turns; frame 'x')"
    assert repr(calibration(**INVALID)).startswith("Calibration(not valid; ")
