"""Gyros of a recording side by side: what goes together, what they are called, what is refused."""

import numpy as np
import pytest

import zerorate as zr
from support.recordings import RECORDINGS, needs_recordings
from zerorate.array.logs import ArrayLog, array_log

N = 40
TIME = np.arange(N) / 100.0


def values(seed, *shape):
    return np.random.default_rng(seed).standard_normal((N, *shape))


def recording(table, **asked):
    return zr.read_recording({"time_s": TIME, **table}, **asked)


def three(label, unit, seed):
    data = values(seed, 3)
    return {f"{label}_gyro_{axis}_{unit}": data[:, i] for i, axis in enumerate("xyz")}


class TestGrouping:
    def test_sensors_stand_side_by_side_in_the_order_of_the_columns(self):
        log = array_log(recording(three("imu2", "dps", 1) | three("imu1", "dps", 2)))
        assert (log.labels, log.unit, log.rate) == (("imu2", "imu1"), "deg/s", 100.0)
        np.testing.assert_array_equal(log.data[:, 0], values(1, 3))
        np.testing.assert_array_equal(log.data[:, 1], values(2, 3))

    def test_gyros_of_one_axis(self):
        columns = {"gyro1_z_dps": values(1), "gyro2_z_dps": values(2), "gyro3_z_dps": values(3)}
        log = array_log(recording(columns))
        assert (log.data.shape, log.axes) == ((N, 3), ("z",))
        assert log.labels == ("gyro1", "gyro2", "gyro3")

    def test_one_gyro_is_an_array_of_one(self):
        log = array_log(recording(three("imu", "radps", 1)))
        assert (log.data.shape, log.labels) == ((N, 1, 3), ("imu",))

    def test_a_dead_sensor_keeps_its_place(self):
        columns = three("a", "dps", 1) | {name: np.full(N, np.nan) for name in three("b", "dps", 2)}
        log = array_log(recording(columns))
        assert log.labels == ("a", "b")
        assert np.isnan(log.data[:, 1]).all()

    def test_sensors_without_names_of_their_own_are_called_as_their_logs(self):
        data = values(1, 2, 3)
        names = ("gyro_x", "gyro_y", "gyro_z")
        logs = {
            name: zr.Log(TIME, 100.0, data[:, i], names, "deg/s")
            for i, name in enumerate(("gyro", "gyro_1"))
        }
        log = array_log(zr.Recording(logs))
        assert log.labels == ("gyro", "gyro_1")
        np.testing.assert_array_equal(log.data, data)


class TestOwnColumns:
    def test_three_in_a_row_are_a_sensor(self):
        columns = three("a", "dps", 1) | three("b", "dps", 2) | three("c", "dps", 3)
        asked = [f"{label}_gyro_{axis}_dps" for label in "ca" for axis in "xyz"]
        log = array_log(recording(columns, columns=asked))
        assert log.labels == ("c", "a")
        np.testing.assert_array_equal(log.data[:, 0], values(3, 3))

    def test_one_axis_of_each(self):
        columns = three("a", "dps", 1) | three("b", "dps", 2) | three("c", "dps", 3)
        log = array_log(recording(columns, columns=[f"{label}_gyro_y_dps" for label in "abc"]))
        assert (log.data.shape, log.labels, log.axes) == ((N, 3), ("a", "b", "c"), ("y",))

    def test_names_that_say_nothing_need_the_number_of_axes(self):
        data = zr.Log(TIME, 100.0, values(1, 6), [f"c{i}" for i in range(6)], "deg/s")
        assert array_log(data).data.shape == (N, 6)
        log = array_log(data, axes=3)
        assert (log.data.shape, log.labels) == ((N, 2, 3), ("c0", "c3"))
        np.testing.assert_array_equal(log.data[:, 1], values(1, 6)[:, 3:])

    def test_columns_that_make_no_whole_sensors_are_refused(self):
        data = zr.Log(TIME, 100.0, values(1, 4), [f"c{i}" for i in range(4)], "deg/s")
        with pytest.raises(zr.LogError, match="4 columns are no sensors of 3 axes each: c0, c1"):
            array_log(data, axes=3)

    def test_other_axes_than_one_or_three_are_refused(self):
        data = zr.Log(TIME, 100.0, values(1, 4), [f"c{i}" for i in range(4)], "deg/s")
        with pytest.raises(ValueError, match="axes must be 1 or 3, got 2"):
            array_log(data, axes=2)


class TestRefusals:
    @staticmethod
    def of(first, other):
        return zr.Recording({"gyro": first, "gyro_1": other})

    @staticmethod
    def log(label="a", n=N, rate=100.0, shift=0.0, unit="deg/s", axes="xyz"):
        time = shift + np.arange(n) / rate
        return zr.Log(time, rate, np.zeros((n, len(axes))), [f"{label}_g{c}" for c in axes], unit)

    @pytest.mark.parametrize(
        ("other", "message"),
        [
            ({"unit": "rad/s"}, r"agree in unit: 'gyro' \(a_gx.*\) has deg/s, 'gyro_1' .* rad/s"),
            ({"axes": "z"}, r"agree in axes: .* has 3, 'gyro_1' \(b_gz\) has 1"),
            ({"rate": 50.0}, "agree in rate: .* has 100 Hz, .* has 50 Hz"),
            ({"n": N - 1}, "agree in length: .* has 40 samples, .* has 39 samples"),
            ({"shift": 0.02}, r"on one clock: 'gyro_1' .* up to 2 samples away from 'gyro'"),
        ],
    )
    def test_what_differs_is_said(self, other, message):
        with pytest.raises(zr.LogError, match=message):
            array_log(self.of(self.log(), self.log("b", **other)))

    def test_clocks_within_half_a_sample_are_one(self):
        log = array_log(self.of(self.log(), self.log("b", shift=0.004)))
        np.testing.assert_array_equal(log.time, TIME)

    def test_a_recording_without_gyros(self):
        with pytest.raises(zr.LogError, match="there is no gyro"):
            array_log(recording({"acc_x_g": values(1), "acc_y_g": values(2)}))

    def test_parts_that_do_not_fit(self):
        with pytest.raises(zr.LogError, match=r"data must have shape \(40, 2, 3\), got \(40, 2\)"):
            ArrayLog(TIME, 100.0, np.zeros((N, 2)), ("a", "b"))
        with pytest.raises(zr.LogError, match="labels must differ, got a, a"):
            ArrayLog(TIME, 100.0, np.zeros((N, 2, 3)), ("a", "a"))


class TestFusedLog:
    def test_it_has_the_clock_and_unit_of_the_array(self, tmp_path):
        log = array_log(recording(three("a", "dps", 1) | three("b", "dps", 2)))
        fused = log.fused(log.data.mean(axis=1))
        zr.write_log(fused, tmp_path / "fused.csv")
        again = zr.read_log(tmp_path / "fused.csv")
        assert (again.names, again.unit) == (("gyro_x", "gyro_y", "gyro_z"), "deg/s")
        np.testing.assert_array_equal(again.time, log.time)

    def test_of_one_axis(self):
        log = array_log(recording({"gyro1_z_dps": values(1), "gyro2_z_dps": values(2)}))
        assert log.fused(log.data.mean(axis=1)).names == ("gyro_z",)


@needs_recordings
def test_the_eight_units_of_a_board():
    found = zr.read_recording(RECORDINGS / "mimu4444_array8_62hz_exp1.parquet", only=["gyro"])
    log = array_log(found)
    assert log.labels == tuple(f"imu{k}" for k in range(1, 9))
    assert (log.data.shape, log.rate, log.unit) == ((37439, 8, 3), 62.5, "deg/s")
    np.testing.assert_array_equal(log.data[:, 2], found["gyro_2"].data)
