"""ROS recordings of simulated inertial sensors, written by the package `rosbags`."""

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

IMU = "sensor_msgs/msg/Imu"
WIND = "geometry_msgs/msg/Vector3Stamped"
EPOCH = 1_700_000_000_000_000_000
KINDS = ("bag", "folder", "db3", "mcap")


def values(n):
    """Return the gyro and the accelerometer of a message each, shape (n, 6)."""
    return np.random.default_rng(3).standard_normal((n, 6))


def write_recording(
    folder, kind, topics, n=50, *, period=10_000_000, msgtype=IMU, frame="imu_link", lost=()
):
    """Write messages on each topic; return the file or folder to read."""
    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    made = imu_message if msgtype == IMU else _wind_message
    path = folder / ("run.bag" if kind == "bag" else f"run_{kind}")
    with _writer(path, kind) as writer:
        for topic in topics:
            connection = writer.add_connection(topic, msgtype, typestore=store)
            for i, row in ((i, row) for i, row in enumerate(values(n)) if i not in lost):
                stamp = EPOCH + i * period
                message = made(store, stamp, row, frame)
                # Received late, so that only the header's stamps make a regular clock.
                writer.write(connection, stamp + (i % 7) * 1_000_000, _bytes(store, message, kind))
    return next(path.glob(f"*.{kind}")) if kind in ("db3", "mcap") else path


def _writer(path, kind):
    if kind == "bag":
        return rosbag1.Writer(path)
    plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    return rosbag2.Writer(path, version=9, storage_plugin=plugin)


def _bytes(store, message, kind):
    serialize = store.serialize_ros1 if kind == "bag" else store.serialize_cdr
    return serialize(message, message.__msgtype__)


def imu_message(store, stamp, row, frame):
    """Return the message of one sample at a stamp in ns."""
    types = store.types
    vector = types["geometry_msgs/msg/Vector3"]
    covariance, upright = np.arange(9.0), types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    gyro, accelerometer = vector(*row[:3]), vector(*row[3:])
    header = _header(types, stamp, frame)
    return types[IMU](header, upright, covariance, gyro, covariance, accelerometer, covariance)


def _wind_message(store, stamp, row, frame):
    types = store.types
    wind = types["geometry_msgs/msg/Vector3"](*row[:3])
    return types[WIND](_header(types, stamp, frame), wind)


def _header(types, stamp, frame):
    time = types["builtin_interfaces/msg/Time"](*divmod(stamp, 1_000_000_000))
    header = types["std_msgs/msg/Header"]
    counted = {"seq": 7} if "seq" in header.__dataclass_fields__ else {}
    return header(stamp=time, frame_id=frame, **counted)


MOTION = "my_msgs/msg/Motion"
FIX = "sensor_msgs/msg/NavSatFix"
_DEFINITION = """std_msgs/Header header
float64[3] gyro_radps
my_msgs/Force force
string remark
float64[] more
================================================================================
MSG: my_msgs/Force
float32 accel_x_mps2
float32 accel_y_mps2
float32 accel_z_mps2
"""


def write_own(folder, kind, n=50):
    """Write messages of a type of one's own, and fixes; return the file to read."""
    stores = Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE
    store = get_typestore(stores)
    store.register(get_types_from_msg(_DEFINITION, MOTION))
    types = store.types
    path = folder / ("own.bag" if kind == "bag" else f"own_{kind}")
    with _writer(path, kind) as writer:
        motion = writer.add_connection("/motion", MOTION, typestore=store)
        fixes = writer.add_connection("/fix", FIX, typestore=store)
        for i, row in enumerate(values(n)):
            stamp = EPOCH + i * 10_000_000
            header = _header(types, stamp, "base")
            force = types["my_msgs/msg/Force"](*row[3:])
            message = types[MOTION](header, row[:3], force, "none", np.ones(i % 3))
            writer.write(motion, stamp + 5_000_000, _bytes(store, message, kind))
            if i % 5 == 0:
                status = types["sensor_msgs/msg/NavSatStatus"](0, 1)
                place = (45.0 + 1e-6 * i, 7.0, 300.0, np.arange(9.0), 2)
                message = types[FIX](header, status, *place)
                writer.write(fixes, stamp + 6_000_000, _bytes(store, message, kind))
    return next(path.glob(f"*.{kind}")) if kind in ("db3", "mcap") else path
