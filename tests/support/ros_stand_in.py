"""What the node uses of rclpy and of ROS's messages, as far as a test needs it.

The fields of the messages are those of ROS 2 Humble, which `test_the_messages_are_those_of_ros`
holds to the definitions that the package `rosbags` has.
"""

import sys
from dataclasses import dataclass, field
from types import ModuleType, SimpleNamespace
from typing import ClassVar


@dataclass
class Time:
    sec: int = 0
    nanosec: int = 0


@dataclass
class Header:
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass
class Vector3:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class Quaternion:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


def _nine():
    return [0.0] * 9


@dataclass
class Imu:
    header: Header = field(default_factory=Header)
    orientation: Quaternion = field(default_factory=Quaternion)
    orientation_covariance: list = field(default_factory=_nine)
    angular_velocity: Vector3 = field(default_factory=Vector3)
    angular_velocity_covariance: list = field(default_factory=_nine)
    linear_acceleration: Vector3 = field(default_factory=Vector3)
    linear_acceleration_covariance: list = field(default_factory=_nine)


@dataclass
class Vector3Stamped:
    header: Header = field(default_factory=Header)
    vector: Vector3 = field(default_factory=Vector3)


@dataclass
class KeyValue:
    key: str = ""
    value: str = ""


class _Levels:
    # ROS's type byte is a byte in Python.
    OK, WARN, ERROR, STALE = b"\x00", b"\x01", b"\x02", b"\x03"


@dataclass
class DiagnosticStatus(_Levels):
    level: bytes = b"\x00"
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: list = field(default_factory=list)


@dataclass
class DiagnosticArray:
    header: Header = field(default_factory=Header)
    status: list = field(default_factory=list)


MESSAGES = {
    "builtin_interfaces": [Time],
    "std_msgs": [Header],
    "geometry_msgs": [Vector3, Quaternion, Vector3Stamped],
    "sensor_msgs": [Imu],
    "diagnostic_msgs": [DiagnosticArray, DiagnosticStatus, KeyValue],
}


class Node:
    """A node whose topics are lists; `parameters` are what a file of parameters says."""

    parameters: ClassVar[dict] = {}

    def __init__(self, name):
        self.name, self.published, self.heard, self.timers, self.logged = name, {}, {}, [], []

    def declare_parameter(self, name, default):
        value = self.parameters.get(name, default)
        if type(value) is not type(default):
            raise TypeError(f"parameter {name} is a {type(default).__name__}")
        return SimpleNamespace(value=value)

    def create_publisher(self, kind, topic, qos):
        assert isinstance(qos, int) or qos == SENSOR_DATA
        messages = self.published.setdefault(topic, [])

        def publish(message):
            assert isinstance(message, kind)
            messages.append(message)

        return SimpleNamespace(publish=publish)

    def create_subscription(self, kind, topic, callback, qos):
        assert isinstance(qos, int) or qos == SENSOR_DATA
        self.heard[topic] = callback

    def create_timer(self, seconds, callback):
        assert seconds > 0
        self.timers.append(callback)

    def get_logger(self):
        return SimpleNamespace(warning=self.logged.append)

    def get_clock(self):
        now = SimpleNamespace(to_msg=lambda: Time(7, 0))
        return SimpleNamespace(now=lambda: now)

    def destroy_node(self):
        self.destroyed = True


SENSOR_DATA = "best effort"


class ExternalShutdownException(Exception):
    pass


def modules():
    """Return the modules that the node imports, by name."""
    made = {}

    def module(name, **names):
        made[name] = ModuleType(name)
        vars(made[name]).update(names)

    def spin(node):
        raise ExternalShutdownException

    module("rclpy", init=lambda: None, spin=spin, try_shutdown=lambda: None)
    module("rclpy.node", Node=Node)
    module("rclpy.qos", qos_profile_sensor_data=SENSOR_DATA)
    module("rclpy.executors", ExternalShutdownException=ExternalShutdownException)
    for package, kinds in MESSAGES.items():
        module(package)
        module(f"{package}.msg", **{kind.__name__: kind for kind in kinds})
    return made


def install(monkeypatch, folder):
    """Have `import` find the stand-in, and the package in a folder anew."""
    for name, module in modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.syspath_prepend(folder)
    for name in [name for name in sys.modules if name.split(".")[0] == folder.name]:
        monkeypatch.delitem(sys.modules, name)
