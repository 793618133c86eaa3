"""What a calibration removes: the sensor as it says gives the motion back, on every road."""

import re
from dataclasses import replace

import numpy as np
import pytest

from support.calibrations import COUNTS, INVALID, calibration, motion, raw_accel, raw_gyro, recorded
from zerorate import Log, LogError, Recording
from zerorate.calibration import Calibration, Origin
from zerorate.calibration.choice import find_sensors
from zerorate.calibration.temperature import TemperatureModel

UNITS = {
    "g and deg/s": {},
    "SI": {"units": (("m/s^2",) * 2, ("rad/s",) * 2)},
    "counts": {"units": COUNTS, "scales": (1670.0, 7509.0)},
}
EXACT = {"rtol": 1e-11, "atol": 1e-11}
"""Rounding of three products, of which the inverse of a matrix is one."""


@pytest.fixture(params=UNITS)
def made(request):
    return calibration(**UNITS[request.param])


class TestArrays:
    def test_a_sensor_gives_the_motion_back(self, made):
        rate, force = motion(made)
        raw = np.hstack((raw_gyro(made, rate, force), raw_accel(made, force)))
        np.testing.assert_allclose(made.apply(raw), np.hstack((rate, force)), **EXACT)
        np.testing.assert_allclose(made.apply_gyro(raw[:, :3], raw[:, 3:]), rate, **EXACT)
        np.testing.assert_allclose(made.apply_accel(raw[:, 3:]), force, **EXACT)

    def test_without_a_force_g_sensitivity_stays(self):
        made = calibration()
        rate, force = motion(made)
        raw = raw_gyro(made, rate, force)
        np.testing.assert_allclose(made.apply(raw), made.apply_gyro(raw), rtol=0)
        left = made.apply_gyro(raw) - rate
        expected = raw_gyro(made, 0 * rate, force) - made.values[21:24]
        np.testing.assert_allclose(left @ made.values[12:21].reshape(3, 3).T, expected, **EXACT)

    def test_one_sample_is_as_many(self, made):
        raw = np.hstack([log.data for log in recorded(made)[0].values()])[7]
        assert made.apply(raw).shape == (6,)
        np.testing.assert_array_equal(made.apply(raw), made.apply(raw[np.newaxis])[0])
        np.testing.assert_array_equal(made.apply_gyro(raw[:3], raw[3:]), made.apply(raw)[:3])
        np.testing.assert_array_equal(made.apply_accel(raw[3:]), made.apply(raw)[3:])
        assert made.apply(raw[:3]).shape == (3,)

    def test_every_road_gives_the_same_bits(self, made):
        recording, *_ = recorded(made)
        raw = np.hstack([log.data for log in recording.values()])
        whole = made.apply(raw)
        found = made.apply(recording)
        np.testing.assert_array_equal(np.hstack([found.gyro.data, found.accel.data]), whole)
        np.testing.assert_array_equal(made.apply_gyro(raw[:, :3], raw[:, 3:]), whole[:, :3])
        np.testing.assert_array_equal(made.apply_accel(raw[:, 3:]), whole[:, 3:])
        np.testing.assert_array_equal(made.apply(recording.accel).data, whole[:, 3:])

    @pytest.mark.parametrize("shape", [(2,), (4, 5), (3, 3, 3), ()])
    def test_other_shapes_are_refused(self, shape):
        with pytest.raises(ValueError, match=r"samples must have shape \(n, 3\) of a gyro, \(n, 6"):
            calibration().apply(np.zeros(shape))

    def test_a_data_frame_is_refused(self):
        """Its first column may be the time, which is no rate."""
        pandas = pytest.importorskip("pandas")
        with pytest.raises(TypeError, match=r"got DataFrame; zr.read_recording reads data frames"):
            calibration().apply(pandas.DataFrame(np.zeros((5, 7)), columns=list("tabcdef")))

    def test_refusals_of_sensors_given_apart(self):
        made = calibration()
        with pytest.raises(ValueError, match=r"^z must have shape \(n, 3\) or \(3,\), got \(4,\)"):
            made.apply_gyro(np.zeros(4))
        with pytest.raises(ValueError, match=r"accel must have shape \(5, 3\) as the gyro, got"):
            made.apply_gyro(np.zeros((5, 3)), np.zeros((4, 3)))
        with pytest.raises(ValueError, match=r"^inputs must be 3, 6 or 7, got 4$"):
            made.corrector(inputs=4)


class TestLive:
    @pytest.mark.parametrize("inputs", [3, 6])
    def test_the_stream_gives_the_bits_of_a_batch(self, made, inputs):
        raw = np.hstack([log.data for log in recorded(made, 40)[0].values()])[:, :inputs]
        stream = made.corrector(inputs=inputs)
        live = [np.hstack(np.atleast_1d(stream.update(row))) for row in raw]
        np.testing.assert_array_equal(live, made.apply(raw))


class TestLogs:
    def test_a_recording_is_as_it_was_but_for_two_sensors(self):
        made = calibration(rests=4)
        recording, rate, force = recorded(made)
        other = Log(np.arange(9) / 10.0, 10.0, np.arange(9.0), ["temperature"], "degC")
        recording = replace(recording, logs={"temperature": other, **recording.logs}, notes=("a",))
        found = made.apply(recording)
        assert list(found) == ["temperature", "gyro", "accel"]
        assert found.temperature is other
        np.testing.assert_allclose(found.gyro.data, rate, **EXACT)
        np.testing.assert_allclose(found.accel.data, force, **EXACT)
        assert (found.gyro.names, found.gyro.unit) == (recording.gyro.names, "deg/s")
        assert found.gyro.meta["notes"] == (
            "gyro: corrected by a calibration of 3 rests and 2 turns",
        )
        assert recording.gyro.meta.get("notes") is None
        assert found.notes == ("a",)

    def test_counts_become_si(self):
        made = calibration(**UNITS["counts"])
        recording, rate, force = recorded(made)
        found = made.apply(recording)
        assert (found.gyro.unit, found.accel.unit) == ("rad/s", "m/s^2")
        np.testing.assert_allclose(found.accel.data, force, **EXACT)
        np.testing.assert_allclose(found.gyro.data, rate, **EXACT)

    def test_another_unit_of_the_same_kind_is_kept(self):
        made = calibration()
        recording, rate, force = recorded(made)
        logs = {
            "gyro": replace(recording.gyro, data=np.radians(recording.gyro.data), unit="rad/s"),
            "accel": replace(recording.accel, data=9.80665 * recording.accel.data, unit="m/s^2"),
        }
        found = made.apply(Recording(logs))
        assert (found.gyro.unit, found.accel.unit) == ("rad/s", "m/s^2")
        np.testing.assert_allclose(found.gyro.data, np.radians(rate), **EXACT)
        np.testing.assert_allclose(found.accel.data, 9.80665 * force, rtol=1e-11, atol=1e-9)

    def test_the_force_is_brought_to_the_gyros_clock(self):
        """A force that grows steadily, sampled at another rate and time: interpolation is exact."""
        made = calibration()
        time, other = np.arange(400) / 100.0, 0.013 + np.arange(160) / 40.0
        rate, slope = motion(made, 400)[0], np.array([0.1, -0.2, 0.3])
        gyro = Log(time, 100.0, raw_gyro(made, rate, np.outer(time, slope)), list("abc"), "deg/s")
        accel = Log(other, 40.0, raw_accel(made, np.outer(other, slope)), list("def"), "g")
        found = made.apply(Recording({"gyro": gyro, "accel": accel}))
        inside = (time >= other[0]) & (time <= other[-1])
        np.testing.assert_allclose(found.gyro.data[inside], rate[inside], rtol=1e-10, atol=1e-9)
        np.testing.assert_allclose(found.accel.data, np.outer(other, slope), **EXACT)

    def test_one_sensor_alone(self):
        made = calibration()
        recording, rate, force = recorded(made)
        alone = made.apply(Recording({"gyro": recording.gyro}))
        np.testing.assert_array_equal(alone.gyro.data, made.apply(recording.gyro).data)
        stays = "the log has no accelerometer, so the gyro's g-sensitivity is not corrected"
        assert alone.gyro.meta["notes"][-1] == stays
        alone = made.apply(Recording({"accel": recording.accel}))
        np.testing.assert_allclose(alone.accel.data, force, **EXACT)
        assert np.abs(made.apply(recording.gyro).data - rate).max() < 3.0

    def test_the_second_imu_of_a_recording(self):
        made = calibration()
        recording, rate, _ = recorded(made)
        logs = {f"{name}_1": log for name, log in recording.items()}
        found = made.apply(
            Recording({"gyro": recording.gyro, **logs}), gyro="gyro_1", accel="accel_1"
        )
        np.testing.assert_allclose(found["gyro_1"].data, rate, **EXACT)
        assert found.gyro is recording.gyro

    def test_names_tell_a_sensor_of_unknown_unit(self):
        made = calibration(**UNITS["counts"])
        recording, _, force = recorded(made)
        np.testing.assert_allclose(made.apply(recording.accel).data, force, **EXACT)
        assert made.apply(recording.gyro).unit == "rad/s"
        with pytest.raises(LogError, match=r"neither unit \(unit\) nor names \(a, b, c\) show"):
            made.apply(replace(recording.gyro, names=list("abc")))

    def test_a_missing_sample_is_missing(self):
        made = calibration()
        recording, rate, force = recorded(made)
        gyro, accel = recording.gyro.data.copy(), recording.accel.data.copy()
        gyro[5, 1] = accel[9] = np.nan
        logs = {"gyro": recording.gyro.with_data(gyro), "accel": recording.accel.with_data(accel)}
        found = made.apply(Recording(logs))
        assert np.isnan(found.gyro.data[5]).all()
        assert np.isnan(found.accel.data[9]).all()
        others = np.delete(np.arange(500), [5, 9])
        np.testing.assert_allclose(found.gyro.data[others], rate[others], **EXACT)
        np.testing.assert_allclose(found.accel.data[others], force[others], **EXACT)

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"unit": "g"}, r"cannot convert deg/s \(rate\) to g"),
            (
                {"unit": "unit"},
                "is of a gyro in deg/s, and these samples are of unknown unit: give",
            ),
            (
                {"data": np.zeros((500, 2)), "names": ("a", "b")},
                "three axes of a gyro, got 2: a, b",
            ),
        ],
    )
    def test_refusals(self, change, match):
        made = calibration()
        recording, *_ = recorded(made)
        gyro = replace(recording.gyro, **change)
        with pytest.raises(ValueError, match=match):
            made.apply(Recording({"gyro": gyro, "accel": recording.accel}))

    def test_nothing_to_correct(self):
        recording, *_ = recorded(calibration())
        with pytest.raises(LogError, match="there is no gyro and no accel; the recording has: mag"):
            calibration().apply(Recording({"mag": recording.gyro}))


class TestInvalid:
    SAYS = "is not valid: the scale of the gyro's x axis is not identifiable"

    def test_a_log_notes_it(self):
        made = calibration(**INVALID)
        found = made.apply(recorded(made)[0])
        for log in (found.gyro, found.accel):
            assert log.meta["notes"][-1].endswith(self.SAYS)

    def test_other_channels_are_told(self):
        recording = recorded(calibration())[0]
        gyro = recording.gyro.names
        made = replace(calibration(), origin=Origin("turns.csv", gyro, ("ax", "ay", "az")))
        found = made.apply(recording)
        message = "the calibration was made of ax, ay, az, and is applied to accel_"
        assert any(note.startswith(message) for note in found.accel.meta["notes"])
        assert not any("made of" in note for note in found.gyro.meta["notes"])

    def test_its_own_sensors_are_found_among_several(self):
        recording = recorded(calibration())[0]
        other = replace(recording.gyro, names=("a", "b", "c"))
        both = Recording({"gyro": other, "gyro_1": recording.gyro, "accel": recording.accel})
        made = replace(calibration(), origin=Origin("", recording.gyro.names, ("x", "y", "z")))
        assert find_sensors(both, made) == {"gyro": "gyro_1", "accel": "accel"}
        assert find_sensors(both, calibration()) == {"gyro": "gyro", "accel": "accel"}

    def test_an_array_warns(self):
        made = calibration(**INVALID)
        for call in (made.apply, made.apply_gyro, made.apply_accel):
            with pytest.warns(UserWarning, match=self.SAYS) as caught:
                call(np.zeros(3))
            assert caught[0].filename == __file__


@pytest.fixture(scope="module")
def model():
    rng = np.random.default_rng(3)
    temperature = np.linspace(20.0, 40.0, 6000)
    slopes = np.array([0.03, -0.02, 0.01])
    z = np.outer(temperature - 25.0, slopes) + 0.01 * rng.standard_normal((6000, 3))
    return TemperatureModel.fit(z, temperature, rate=10.0, unit="deg/s")


class TestTemperature:
    """The bias by temperature takes the place of the one of the calibration."""

    @staticmethod
    def raw(made, model, temperature):
        """Return raw samples of a gyro whose bias follows a temperature, and the motion."""
        rate, force = motion(made, len(temperature))
        bias = model.predict(temperature).value - made.values[21:24]
        raw = raw_gyro(made, rate, force) + bias
        return np.column_stack((raw, raw_accel(made, force), temperature)), rate, force

    def test_the_motion_comes_back(self, model):
        made = calibration().with_temperature(model)
        raw, rate, force = self.raw(made, model, np.linspace(15.0, 45.0, 300))
        expected = np.column_stack((rate, force, raw[:, 6]))
        np.testing.assert_allclose(made.apply(raw), expected, **EXACT)
        found = made.apply_gyro(raw[:, :3], raw[:, 3:6], raw[:, 6])
        np.testing.assert_array_equal(found, made.apply(raw)[:, :3])
        stream = made.corrector(inputs=7)
        live = [np.hstack(stream.update(row)) for row in raw]
        np.testing.assert_array_equal(live, made.apply(raw)[:, :6])

    def test_without_a_temperature_it_is_the_bias_of_the_calibration(self, model):
        plain = calibration()
        made = plain.with_temperature(model)
        raw = self.raw(made, model, np.full(50, 30.0))[0]
        np.testing.assert_array_equal(made.apply(raw[:, :6]), plain.apply(raw[:, :6]))
        missing = np.column_stack((raw[:, :6], np.full(50, np.nan)))
        np.testing.assert_array_equal(made.apply(missing)[:, :6], plain.apply(raw[:, :6]))
        assert made.with_temperature(None).temperature_model is None

    def test_the_temperature_of_a_recording_is_brought_to_the_gyros_clock(self, model):
        made = calibration().with_temperature(model)
        time = np.arange(400) / 100.0
        raw, rate, _ = self.raw(made, model, 22.0 + 2.0 * time)
        logs = {
            "gyro": Log(time, 100.0, np.radians(raw[:, :3]), list("abc"), "rad/s"),
            "accel": Log(time, 100.0, raw[:, 3:6], list("def"), "g"),
            "temperature": Log(
                np.arange(41) / 10.0, 10.0, 22.0 + np.arange(41) / 5.0, ["t"], "degC"
            ),
        }
        found = made.apply(Recording(logs))
        np.testing.assert_allclose(found.gyro.data, np.radians(rate), rtol=1e-9, atol=1e-9)
        assert found.gyro.meta["notes"][-1] == "the bias is corrected for temperature"
        assert found.temperature is logs["temperature"]
        del logs["temperature"]
        assert "the log has no temperature" in made.apply(Recording(logs)).gyro.meta["notes"][-1]

    def test_temperatures_that_the_model_has_not_seen_are_told(self, model):
        recording, *_ = recorded(calibration())
        warm = Log(recording.gyro.time, 100.0, np.full(500, 70.0), ["t"], "degC")
        found = (
            calibration()
            .with_temperature(model)
            .apply(Recording({**recording.logs, "temperature": warm}))
        )
        said = (
            r"^100 % of the temperatures lie outside of the 20\.\d to 39\.9 degC range of the model"
        )
        assert re.match(said, found.gyro.meta["notes"][-1])

    def test_json_keeps_it(self, model):
        made = calibration().with_temperature(model)
        found = Calibration.from_json(made.to_json())
        assert found.to_json() == made.to_json()
        raw = self.raw(made, model, np.linspace(20.0, 40.0, 50))[0]
        np.testing.assert_array_equal(found.apply(raw), made.apply(raw))

    def test_it_is_made_of_the_rests_of_a_recording(self):
        """Without what gravity makes the gyro read: poses differ by 0.1 deg/s here."""
        made = calibration(rests=24)
        n = made.rests[-1].last
        temperature = np.linspace(20.0, 32.0, n)
        force, moving = np.zeros((n, 3)), np.ones(n, dtype=bool)
        for rest in made.rests:
            force[rest.first : rest.last] = rest.direction
            moving[rest.first : rest.last] = False
        rate = 50.0 * moving[:, np.newaxis] * np.random.default_rng(1).standard_normal((n, 3))
        drift = np.outer(temperature - 26.0, [0.02, 0.0, -0.05])
        noise = 0.02 * np.random.default_rng(2).standard_normal((n, 3))
        gyro, time = raw_gyro(made, rate, force) + drift + noise, np.arange(n) / 100.0
        recording = Recording(
            {
                "gyro": Log(time, 100.0, gyro, list("abc"), "deg/s"),
                "accel": Log(time, 100.0, raw_accel(made, force), list("def"), "g"),
                "temperature": Log(time, 100.0, temperature, ["t"], "degC"),
            }
        )
        found = made.with_temperature(recording).temperature_model
        slopes = np.array([float(one) for one in found.slope])
        np.testing.assert_allclose(slopes, [0.02, 0.0, -0.05], atol=2e-3)
        bias = found.predict(26.0).value
        np.testing.assert_allclose(bias, made.values[21:24], atol=0.02)

    def test_refusals(self, model):
        made = calibration()
        one = TemperatureModel.fit(np.random.default_rng(1).standard_normal(900), None, rate=10.0)
        with pytest.raises(
            ValueError, match=r"^the temperature model must be of three axes, got 1$"
        ):
            made.with_temperature(one)
        with pytest.raises(
            ValueError, match="is of a gyro in deg/s, and these samples are of unkn"
        ):
            made.with_temperature(model.scaled(1.0, "unit"))
        recording, *_ = recorded(made)
        with pytest.raises(
            LogError, match="there is no temperature to make a model of; the record"
        ):
            made.with_temperature(recording)
