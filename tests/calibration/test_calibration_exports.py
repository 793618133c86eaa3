"""Each file's own convention, applied to raw numbers, gives the corrected signal."""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

from support.calibrations import COUNTS, INVALID, calibration, motion, raw_accel, raw_gyro
from zerorate.calibration.temperature import TemperatureModel
from zerorate.units import convert

EXACT = {"rtol": 1e-10, "atol": 1e-10}


def sensed(made, n=200):
    """Return raw samples of gyro and accelerometer, and the corrected ones, by the model."""
    rate, force = motion(made, n)
    return raw_gyro(made, rate, force), raw_accel(made, force), rate, force


def in_si(values, unit):
    return convert(values, unit, "m/s^2" if unit in ("g", "m/s^2") else "rad/s")


class Kalibr:
    """A file as Kalibr reads it, and the biases in its comments."""

    def __init__(self, text):
        content = yaml.safe_load(text)["imu0"]
        self.model, self.keys = content["model"], sorted(content)
        self.accel = np.array(content["accelerometers"]["M"])
        self.gyro, self.by_force, self.turn = (
            np.array(content["gyroscopes"][name]) for name in ("M", "A", "C_gyro_i")
        )
        self.b_a, self.b_g = (
            np.array(yaml.safe_load(re.search(rf"#   {name} = (.*?)  #", text)[1]))
            for name in ("b_a", "b_g")
        )


class TestKalibr:
    @pytest.mark.parametrize("frame", ["x", "z", "symmetric"])
    def test_both_directions(self, frame):
        """As IccScaledMisalignedImu has them: M C w + A C a + b of the gyro, M a + b."""
        made = calibration()
        raw_g, raw_a, *_ = sensed(made)
        raw_g, raw_a = in_si(raw_g, "deg/s"), in_si(raw_a, "g")
        file = Kalibr(made.to_frame(frame).to_kalibr())
        first = made.in_units(gyro="rad/s", accel="m/s^2").apply(np.hstack((raw_g, raw_a)))
        w, a = first[:, :3], first[:, 3:]
        np.testing.assert_allclose(a @ file.accel.T + file.b_a, raw_a, **EXACT)
        of_force = a @ (file.by_force @ file.turn).T
        predicted = w @ (file.gyro @ file.turn).T + of_force + file.b_g
        np.testing.assert_allclose(predicted, raw_g, **EXACT)
        corrected = (raw_a - file.b_a) @ np.linalg.inv(file.accel).T
        np.testing.assert_allclose(corrected, a, **EXACT)
        back = (raw_g - corrected @ (file.by_force @ file.turn).T - file.b_g) @ (
            file.turn.T @ np.linalg.inv(file.gyro)
        ).T
        np.testing.assert_allclose(back, w, **EXACT)

    def test_its_matrices_have_kalibrs_form(self):
        file = Kalibr(calibration().to_kalibr())
        assert (file.model, file.keys) == (
            "scale-misalignment",
            ["accelerometers", "gyroscopes", "model", "update_rate"],
        )
        for lower in (file.accel, file.gyro):
            np.testing.assert_array_equal(lower, np.tril(lower))
            assert (np.diagonal(lower) > 0.0).all()
        np.testing.assert_allclose(file.turn @ file.turn.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(file.turn) > 0.0

    def test_the_formulas_stand_in_the_file(self):
        text = calibration().to_kalibr()
        for line in (
            "#   raw_a = accelerometers.M a + b_a",
            "#   raw_g = gyroscopes.M C_gyro_i w + gyroscopes.A C_gyro_i a + b_g",
            "#   a = inverse(accelerometers.M) (raw_a - b_a)",
            "#   w = transpose(C_gyro_i) inverse(gyroscopes.M) "
            "(raw_g - gyroscopes.A C_gyro_i a - b_g)",
        ):
            assert f"\n{line}\n" in text

    def test_counts_are_refused(self):
        with pytest.raises(ValueError, match=r"^Kalibr takes samples in rad/s and m/s\^2, and the"):
            calibration(units=COUNTS).to_kalibr()


class Triad:
    """A file as imu_tk's CalibratedTriad::load reads it: 21 numbers, and no more."""

    def __init__(self, text):
        numbers = np.array([float(word) for word in text.split()[:21]])
        self.misalignment, self.scale = numbers[:9].reshape(3, 3), numbers[9:18].reshape(3, 3)
        self.bias = numbers[18:]

    def unbias_normalize(self, raw):
        return (raw - self.bias) @ (self.misalignment @ self.scale).T


class TestImuTk:
    @pytest.mark.parametrize("counts", [False, True])
    def test_unbias_normalize(self, counts):
        made = calibration(units=COUNTS, scales=(1670.0, 7509.0)) if counts else calibration()
        values = made.values.copy()
        values[24:] = 0.0
        made = replace(made, values=values)
        raw_g, raw_a, *_ = sensed(made)
        files = made.to_imu_tk()
        accel, gyro = Triad(files.accel), Triad(files.gyro)
        turned = made.to_frame("z").apply(np.hstack((raw_g, raw_a)))
        units = [one[1] for one in (made.gyro_units, made.accel_units)]
        expected = in_si(turned[:, 3:], units[1])
        np.testing.assert_allclose(accel.unbias_normalize(raw_a), expected, **EXACT)
        expected = in_si(turned[:, :3], units[0])
        np.testing.assert_allclose(gyro.unbias_normalize(raw_g), expected, **EXACT)

    def test_its_matrices_have_imu_tks_form(self):
        accel, gyro = map(Triad, calibration().to_imu_tk())
        for one in (accel, gyro):
            np.testing.assert_array_equal(np.diagonal(one.misalignment), 1.0)
            np.testing.assert_array_equal(one.scale, np.diag(np.diagonal(one.scale)))
        np.testing.assert_allclose(accel.misalignment, np.triu(accel.misalignment), atol=1e-16)

    def test_what_has_no_place_is_said_behind_the_numbers(self):
        with pytest.raises(ValueError, match=r"is not valid, the scale of .*doubtful=True writes"):
            calibration(**INVALID).to_imu_tk()
        files = calibration(**INVALID).to_imu_tk(doubtful=True)
        assert "# WARNING, NOT VALID: the scale of" in files.accel.split("\n\n")[-1]
        assert "# g-sensitivity cannot be stored here: up to 0.1" in files.gyro
        assert "g-sensitivity" not in files.accel

    def test_files(self, tmp_path):
        files = calibration().to_imu_tk(tmp_path / "imu")
        assert (tmp_path / "imu_acc.calib").read_text() == files.accel
        assert (tmp_path / "imu_gyro.calib").read_text() == files.gyro
        (tmp_path / "imu_acc.calib").unlink()
        with pytest.raises(FileExistsError):
            calibration(2).to_imu_tk(tmp_path / "imu")
        assert not (tmp_path / "imu_acc.calib").exists()


def px4(text):
    """Return the parameters of a file of QGroundControl."""
    rows = (line.split("\t") for line in text.splitlines() if not line.startswith("#"))
    return {name: float(value) for *_, name, value, _ in rows}


def ardupilot(text):
    rows = (line.split(",") for line in text.splitlines() if not line.startswith("#"))
    return {name: float(value) for name, value in rows}


READ = {
    "PX4": (
        lambda made: px4(made.to_px4()),
        ("CAL_ACC0_{}OFF", "CAL_ACC0_{}SCALE", "CAL_GYRO0_{}OFF"),
    ),
    "ArduPilot": (
        lambda made: ardupilot(made.to_ardupilot()),
        ("INS_ACCOFFS_{}", "INS_ACCSCAL_{}", "INS_GYROFFS_{}"),
    ),
}


class TestAutopilots:
    """(raw - offset) scale of the accelerometer, raw - offset of the gyro."""

    @staticmethod
    def plain():
        """A calibration of what they can hold: offsets, and the scale of the accelerometer."""
        made = calibration()
        values = np.zeros(33)
        values[[0, 4, 8]] = 1.01, 0.98, 1.03
        values[[12, 16, 20]] = 1.0
        values[9:12], values[21:24] = made.values[9:12], made.values[21:24]
        return replace(made, values=values)

    @pytest.mark.parametrize("name", READ)
    def test_what_they_can_hold_comes_back(self, name):
        made = self.plain()
        read, keys = READ[name]
        found = read(made)
        offset, scale, zero = (np.array([found[key.format(x)] for x in "XYZ"]) for key in keys)
        raw_g, raw_a, rate, force = sensed(made)
        corrected = (in_si(raw_a, "g") - offset) * scale
        np.testing.assert_allclose(corrected, in_si(force, "g"), **EXACT)
        np.testing.assert_allclose(in_si(raw_g, "deg/s") - zero, in_si(rate, "deg/s"), **EXACT)
        assert len(found) == 9

    @pytest.mark.parametrize("name", READ)
    def test_of_the_rest_the_accelerometers_is_as_small_as_can_be(self, name):
        made = calibration()
        read, keys = READ[name]
        found = read(made)
        offset, scale, _ = (np.array([found[key.format(x)] for x in "XYZ"]) for key in keys)
        raw_a = sensed(made)[1]
        symmetric = made.to_frame("symmetric").apply_accel(raw_a)
        off = np.abs((in_si(raw_a, "g") - offset) * scale - in_si(symmetric, "g"))
        inverse = made.to_frame("symmetric").accel.correction
        cross = np.abs(inverse - np.diag(np.diagonal(inverse))).sum(axis=1).max()
        assert off.max() <= cross * np.abs(in_si(raw_a, "g") - offset).max()
        assert f"up to {1e3 * np.abs(np.tril(inverse, -1)).max():.2g} mrad," in made.to_px4()

    def test_with_a_temperature_the_bias_is_taken_off_once(self):
        """PX4: (raw - thermal - offset); the model's own tests hold it to the thermal part."""
        temperature = np.linspace(20.0, 40.0, 3000)
        z = np.outer(temperature - 25.0, [0.03, -0.02, 0.01])
        z += 0.01 * np.random.default_rng(1).standard_normal(z.shape)
        model = TemperatureModel.fit(z, temperature, rate=10.0, unit="deg/s")
        made = self.plain().with_temperature(model)
        text = made.to_px4()
        assert model.to_px4() in f"{text}\n"
        assert [px4(text)[f"CAL_GYRO0_{axis}OFF"] for axis in "XYZ"] == [0.0] * 3
        found = ardupilot(made.to_ardupilot())
        alone = ardupilot(model.to_ardupilot())
        assert {**found, **alone} == found
        assert set(found) - set(alone) == {
            f"INS_ACC{k}_{x}" for k in ("OFFS", "SCAL") for x in "XYZ"
        }

    def test_other_instances(self):
        assert "CAL_GYRO2_XOFF" in calibration().to_px4(instance=2)
        assert "INS_ACC2OFFS_X," in calibration().to_ardupilot(instance=2)
        assert "INS_GYR2OFFS_Z," in calibration().to_ardupilot(instance=2)


@pytest.mark.parametrize("name", ["to_kalibr", "to_px4", "to_ardupilot"])
class TestAll:
    def test_a_file(self, tmp_path, name):
        path = tmp_path / "a.txt"
        text = getattr(calibration(), name)(path)
        assert path.read_text(encoding="utf-8") == text
        with pytest.raises(FileExistsError):
            getattr(calibration(), name)(path)

    def test_what_is_not_valid_or_not_known_says_so_first(self, name):
        identifiable = np.ones(33, dtype=bool)
        identifiable[12] = False
        made = replace(calibration(**INVALID), identifiable=identifiable)
        with pytest.raises(ValueError, match=r"not valid, the scale of .*: record"):
            getattr(made, name)()
        lines = getattr(made, name)(doubtful=True).splitlines()
        assert lines[1] == f"# WARNING, NOT VALID: {INVALID['problems'][0]}"
        assert lines[2] == "# Not determined by the record: gyro.matrix.xx"
