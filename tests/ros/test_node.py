"""The node of ROS 2, on a stand-in of rclpy, with a bag as input."""

import importlib
import xml.etree.ElementTree as ElementTree
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import yaml
from rosbags.typesys import Stores, get_typestore

import zerorate as zr
from support.bags import write_recording
from support.ros_stand_in import MESSAGES, Header, Imu, Node, Time, Vector3, install
from zerorate.io import read_recording
from zerorate.noise import MotionDetector

PACKAGE = Path(__file__).parents[2] / "examples/ros2/zerorate_imu"
RATE = 100.0


@pytest.fixture
def node_of(monkeypatch):
    """Return a function that starts the node with parameters."""
    install(monkeypatch, PACKAGE)
    module = importlib.import_module("zerorate_imu.node")

    def start(**parameters):
        monkeypatch.setattr(Node, "parameters", parameters)
        return module.CompensateNode()

    return start


def message(time, gyro, accel=(0.0, 0.0, 9.81), has_accel=True):
    sec = int(time)
    header = Header(Time(sec, round(1e9 * (time - sec))), "imu_link")
    made = Imu(header=header, angular_velocity=Vector3(*gyro), linear_acceleration=Vector3(*accel))
    made.linear_acceleration_covariance[0] = 0.01 if has_accel else -1.0
    made.angular_velocity_covariance = [0.25, 0, 0, 0, 0.25, 0, 0, 0, 0.25]
    return made


def at_rest(n, seed=1, bias=(0.01, -0.02, 0.03)):
    """Return gyro and accelerometer of a sensor at rest, (n, 3) each."""
    random = np.random.default_rng(seed)
    gyro = np.array(bias) + 0.002 * random.standard_normal((n, 3))
    return gyro, np.array([0.0, 0.0, 9.81]) + 0.02 * random.standard_normal((n, 3))


def feed(node, gyro, accel, begin=100.0, **kinds):
    for k in range(len(gyro)):
        node.heard["imu/data_raw"](message(begin + k / RATE, gyro[k], accel[k], **kinds))


def rates(node):
    got = [m.angular_velocity for m in node.published["imu/data"]]
    return np.array([(v.x, v.y, v.z) for v in got])


def diagnosed(node):
    for timer in node.timers:
        timer()
    (status,) = node.published["/diagnostics"][-1].status
    return status


def test_the_messages_are_those_of_ros():
    types = get_typestore(Stores.ROS2_HUMBLE).types
    for package, kinds in MESSAGES.items():
        for kind in kinds:
            real = types[f"{package}/msg/{kind.__name__}"]
            names = [f.name for f in fields(real) if f.name.islower() and f.name[0] != "_"]
            assert [f.name for f in fields(kind)] == names


def test_a_bag_gives_the_bits_of_the_filter(tmp_path, node_of):
    recording = read_recording(write_recording(tmp_path, "mcap", ["/imu"], n=400))
    gyro, accel = recording.gyro.data, recording.accel.data
    node = node_of(rate=RATE, attitude=False)
    feed(node, gyro, accel)

    parameters = importlib.import_module("zerorate_imu.parameters")
    values = {p.name: p.default for p in parameters.PARAMETERS}
    gyros = zr.DriftFilter(RATE, channels=3, **parameters.filter_options(values))
    motion = MotionDetector(RATE)
    moving = [motion.update(row) for row in accel]
    np.testing.assert_array_equal(rates(node), gyros.process(gyro, moving=moving))
    assert node.published["imu/data"][0].header.frame_id == "imu_link"


def test_bias_covariance_and_attitude(node_of):
    node = node_of()
    gyro, accel = at_rest(3000)
    feed(node, gyro, accel)
    assert len(node.published["imu/data"]) == 3000 - 99  # the rate is known with the hundredth

    last = node.published["imu/data"][-1]
    bias, sigma = node.published["imu/bias"][-1].vector, node.published["imu/bias_sigma"][-1].vector
    for axis, true in zip("xyz", (0.01, -0.02, 0.03), strict=True):
        assert abs(getattr(bias, axis) - true) < 5 * getattr(sigma, axis) < 1e-3
    # The noise of a sample, measured: its deviation is 0.002.
    np.testing.assert_allclose(np.sqrt(last.angular_velocity_covariance[::4]), 0.002, rtol=0.2)
    assert last.angular_velocity_covariance[1] == 0.0
    q = last.orientation
    assert abs(q.x) + abs(q.y) < 0.01
    assert q.w > 0.99
    level, heading = last.orientation_covariance[0], last.orientation_covariance[8]
    assert 0 < level < 1e-3
    assert heading > 0
    assert last.linear_acceleration.z == accel[-1][2]
    assert rates(node)[2000:].mean() == pytest.approx(0.0, abs=1e-3)


def test_the_noise_said_stands_until_it_is_measured(node_of):
    node = node_of(rate=RATE)
    gyro, accel = at_rest(10)
    feed(node, gyro, accel)
    first = node.published["imu/data"][0].angular_velocity_covariance
    assert first[0] >= 0.25


def test_without_an_accelerometer(node_of):
    node = node_of(rate=RATE, attitude=False)
    gyro, accel = at_rest(500)
    feed(node, gyro, accel, has_accel=False)
    assert len(node.published["imu/data"]) == 500
    # By REP 145: no orientation is told, and the message says so as its sender did.
    assert node.published["imu/data"][-1].linear_acceleration_covariance[0] == -1.0


def test_lost_late_and_missing_messages(node_of):
    node = node_of(rate=RATE, attitude=False)
    take = node.heard["imu/data_raw"]
    gyro, accel = at_rest(20)
    for k in (0, 1, 2, 5, 4, 6):
        take(message(10.0 + k / RATE, gyro[k], accel[k]))
    take(message(10.0 + 7 / RATE, (np.nan, 0.0, 0.0), accel[7]))
    assert len(node.published["imu/data"]) == 5
    values = {value.key: value.value for value in diagnosed(node).values}
    assert (values["lost"], values["late"], values["restarts"]) == ("2", "1", "0")

    take(message(200.0, gyro[8], accel[8]))
    assert {value.key: value.value for value in diagnosed(node).values}["restarts"] == "1"


def test_diagnostics_tell_how_it_goes(node_of):
    node = node_of()
    status = diagnosed(node)
    assert (status.level, status.message) == (b"\x03", "no messages")
    gyro, accel = at_rest(3000)
    feed(node, gyro[:50], accel[:50])
    assert diagnosed(node).message == "the rate is not known yet"
    feed(node, gyro[50:], accel[50:], begin=100.5)
    status = diagnosed(node)
    assert (status.level, status.message) == (b"\x00", "at rest")
    feed(node, np.tile(gyro[0], (1000, 1)), accel[:1000], begin=131.0)
    status = diagnosed(node)
    assert (status.level, status.message) == (b"\x02", "stuck")


def test_what_is_kept_from_run_to_run(tmp_path, node_of):
    file = tmp_path / "state"
    node = node_of(rate=RATE, state_file=str(file))
    gyro, accel = at_rest(2000)
    feed(node, gyro, accel)
    node.keep()

    # Its noise is known at once; its bias is another one.
    again = node_of(rate=RATE, state_file=str(file))
    feed(again, *at_rest(10, seed=2, bias=(0.05, 0.0, 0.0)))
    known = np.sqrt(again.published["imu/data"][-1].angular_velocity_covariance[::4])
    assert (known < 0.4).all()
    assert not again.logged

    file.write_bytes(b"nothing of the kind")
    other = node_of(rate=RATE, state_file=str(file))
    assert "is not used: these bytes are not a zerorate checkpoint" in other.logged[0]


def test_parameters_out_of_range_are_refused_at_the_start(node_of):
    with pytest.raises(ValueError, match="rest_limit must be a positive number"):
        node_of(rest_limit=-1.0)


def test_it_ends_when_ros_ends(node_of, monkeypatch):
    monkeypatch.setattr(Node, "parameters", {})
    importlib.import_module("zerorate_imu.node").main()


def test_the_file_of_parameters_is_that_of_the_table(node_of):
    parameters = importlib.import_module("zerorate_imu.parameters")
    text = (PACKAGE / "config/params.yaml").read_text(encoding="utf-8")
    assert text == parameters.as_yaml()
    read = yaml.safe_load(text)["zerorate_imu"]["ros__parameters"]
    assert {p.name: type(p.default) for p in parameters.PARAMETERS} == {
        name: type(value) for name, value in read.items()
    }
    node_of(**read)


def test_the_package_is_of_one_version_and_names_what_it_imports():
    package = ElementTree.parse(PACKAGE / "package.xml").getroot()
    version = package.findtext("version")
    assert f'version="{version}"' in (PACKAGE / "setup.py").read_text(encoding="utf-8")
    depends = {e.text for e in package.iter("exec_depend")}
    assert {"rclpy", "sensor_msgs", "geometry_msgs", "diagnostic_msgs"} <= depends
    assert (PACKAGE / "resource" / package.findtext("name")).exists()


def test_the_launch_file_is_python(tmp_path):
    source = (PACKAGE / "launch/compensate.launch.py").read_text(encoding="utf-8")
    compile(source, "compensate.launch.py", "exec")
    assert 'executable="compensate"' in source
