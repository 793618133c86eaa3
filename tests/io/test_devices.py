"""Devices: what their logs call them, and the choice of one."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import zerorate as zr
from zerorate.record.devices import device_of, rival_devices, select_device, sensor_labels
from zerorate.record.log import LogError

SCHEMES = st.sampled_from(
    (
        ("imu{}_gyro_{}_dps", "imu{}_accel_{}_g", "imu{}"),
        ("IMU {} Gyro {} (deg/s)", "IMU {} Accel {} (g)", "IMU {}"),
        ("left{}_gyro_{}_dps", "left{}_accel_{}_g", "left{}"),
    )
)


def table(scheme, numbers, n=50):
    """Return columns of IMUs, whose x rate is their number."""
    columns = {"time_s": np.arange(n) / 100.0}
    for number in numbers:
        for i, axis in enumerate("xyz"):
            columns[scheme[0].format(number, axis)] = np.full(n, float(number) * (i == 0))
            columns[scheme[1].format(number, axis)] = np.full(n, float(i == 2))
    return columns


@settings(max_examples=30, deadline=None)
@given(SCHEMES, st.lists(st.integers(1, 12), min_size=2, max_size=8, unique=True))
def test_devices_are_called_as_their_columns_call_them(scheme, numbers):
    recording = zr.read_recording(table(scheme, numbers))
    names = [scheme[2].format(number) for number in numbers]
    assert [device_of(log) for log in recording.of_kind("gyro")] == names
    assert rival_devices(recording) == tuple(names)
    labels = [label for log, label in sensor_labels(recording).items() if log.startswith("gyro")]
    assert labels == [f"{name} gyro" for name in names]
    for number, name in zip(numbers, names, strict=True):
        for one in (
            select_device(recording, name),
            zr.read_recording(table(scheme, numbers), sensor=name),
        ):
            assert one.names == ("gyro", "accel")
            assert one.gyro.data[0, 0] == number
            assert not any("no sensor is known" in note for note in one.notes)


def test_tasks_take_one_of_several_by_name_or_list_the_names():
    hand = zr.simulate_motion("hand", duration=20.0, seed=4).recording()
    columns = {"time_s": hand.gyro.time}
    for k in (1, 2):
        for i, axis in enumerate("xyz"):
            columns[f"imu{k}_gyro_{axis}_radps"] = hand.gyro.data[:, i] + 0.01 * (k == 2)
            columns[f"imu{k}_accel_{axis}_mps2"] = hand.accel.data[:, i]
    recording = zr.read_recording(columns)
    single = {name: column for name, column in columns.items() if "imu1" not in name}
    tasks = (
        zr.estimate_attitude, zr.check, zr.walk, zr.replay, zr.identify, zr.calibrate,
        lambda source, **arguments: zr.navigate(source, **arguments),
    )  # fmt: skip
    for task in tasks:
        for source in (columns, recording):
            with pytest.raises(LogError, match=r"2 IMUs: imu1, imu2; choose one, .*sensor=imu1"):
                task(source)
    # A hand is on no foot.
    walk = partial(zr.walk, assume_foot=True)
    for task in (zr.estimate_attitude, zr.check, walk):
        expected = str(task(single))
        for source in (columns, recording):
            assert str(task(source, sensor="imu2")) == expected
    for task in (zr.estimate_attitude, zr.replay):
        for source in (columns, recording):
            with pytest.raises(LogError, match="names 'imu9', which is none of"):
                task(source, sensor="imu9")
    assert len(zr.characterise(columns, second_opinion=False).gyro.axes) == 6
    assert {"imu1 gyro", "imu2 gyro"} <= {
        one.text.partition(":")[0] for one in zr.report(columns).findings
    }


def test_further_topics_of_an_autopilot_are_of_the_same_sensor():
    def log(topic):
        time = np.arange(9) / 100.0
        return zr.Log(time, 100.0, np.zeros((9, 3)), list("xyz"), "rad/s", {"sensor": topic})

    one = {
        "gyro": log("sensor_combined"),
        "gyro_1": log("vehicle_imu"),
        "gyro_2": log("vehicle_imu_1"),
    }
    assert rival_devices(zr.Recording(one)) == ()
    two = {"gyro": log("IMU"), "gyro_1": log("IMU2")}
    assert rival_devices(zr.Recording(two)) == ("IMU", "IMU2")
    ros = {"gyro": log("/left/imu"), "gyro_1": log("/right/imu")}
    assert rival_devices(zr.Recording(ros)) == ("/left/imu", "/right/imu")
    assert select_device(zr.Recording(ros), "/right/imu").gyro is ros["gyro_1"]
    assert select_device(zr.Recording(two), "gyro_1").gyro is two["gyro_1"]
