"""The node: sensor_msgs/Imu in; compensated Imu, bias and diagnostics out."""

from collections.abc import Iterator
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Vector3Stamped
from numpy import isfinite
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Imu

import zerorate as zr
from zerorate.record import atomic_path
from zerorate_imu.compensator import Answer, Compensator, Sample
from zerorate_imu.parameters import PARAMETERS, filter_options

LEVELS = {
    "at rest": DiagnosticStatus.OK,
    "in motion": DiagnosticStatus.OK,
    "starting": DiagnosticStatus.WARN,
    "restarting": DiagnosticStatus.WARN,
    "no rest yet": DiagnosticStatus.WARN,
    "provisional": DiagnosticStatus.WARN,
    "stuck": DiagnosticStatus.ERROR,
}
"""Severity of each status of a drift filter."""


class CompensateNode(Node):
    """Node that removes the bias of a gyro, message by message."""

    def __init__(self) -> None:
        """Read the parameters, and the saved state of an earlier run."""
        super().__init__("zerorate_imu")
        values = {p.name: self.declare_parameter(p.name, p.default).value for p in PARAMETERS}
        self._compensator = Compensator(
            filter_options(values), rate=values["rate"], attitude=values["attitude"]
        )
        self._file = Path(values["state_file"]) if values["state_file"] else None
        self._restore()
        self._data = self.create_publisher(Imu, "imu/data", 10)
        self._bias = self.create_publisher(Vector3Stamped, "imu/bias", 10)
        self._bias_sigma = self.create_publisher(Vector3Stamped, "imu/bias_sigma", 10)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._heard = 0
        self.create_subscription(Imu, "imu/data_raw", self.take, qos_profile_sensor_data)
        self.create_timer(values["diagnostics_period"], self.diagnose)

    def take(self, message: Imu) -> None:
        """Answer a message."""
        self._heard += 1
        stamp = message.header.stamp
        # By REP 145, a first covariance of -1 means that the sensor does not exist.
        has_accel = message.linear_acceleration_covariance[0] != -1.0
        accel = _tuple(message.linear_acceleration) if has_accel else None
        sample = Sample(stamp.sec + 1e-9 * stamp.nanosec, _tuple(message.angular_velocity), accel)
        answer = self._compensator.take(sample)
        if answer is None:
            return
        # A missing sample has no compensated rate, and filters downstream cannot use a NaN.
        if isfinite(answer.rate).all():
            self._data.publish(_compensated(message, answer))
        self._bias.publish(_vector(message.header, answer.bias))
        self._bias_sigma.publish(_vector(message.header, answer.bias_sigma))

    def diagnose(self) -> None:
        """Publish the diagnostics."""
        status = DiagnosticStatus(name="zerorate_imu: gyro", hardware_id="imu")
        gyro = self._compensator.gyro
        heard, self._heard = self._heard, 0
        if gyro is None:
            status.level, status.message = DiagnosticStatus.WARN, "the rate is not known yet"
        else:
            words = list(gyro.status)
            status.level = max(LEVELS[word] for word in words)
            status.message = ", ".join(dict.fromkeys(words))
        if heard == 0:
            status.level, status.message = DiagnosticStatus.STALE, "no messages"
        status.values = [KeyValue(key=key, value=value) for key, value in self._told(gyro)]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def keep(self) -> None:
        """Save the state to the file, if a file is set."""
        saved = self._compensator.save()
        if self._file is not None and saved is not None:
            with atomic_path(self._file, force=True) as temporary:
                temporary.write_bytes(saved)

    def _restore(self) -> None:
        if self._file is None or not self._file.exists():
            return
        try:
            self._compensator.restore(self._file.read_bytes())
        except ValueError as error:
            self.get_logger().warning(f"{self._file} is not used: {error}")

    def _told(self, gyro: zr.DriftFilter | None) -> Iterator[tuple[str, str]]:
        counts = self._compensator.counts
        yield from (("lost", str(counts.lost)), ("late", str(counts.late)))
        yield "restarts", str(counts.restarts)
        if gyro is not None:
            yield "rate", f"{gyro.rate:.6g}"
            for name in ("bias", "bias_sigma", "angle_random_walk"):
                yield name, " ".join(f"{x:.3g}" for x in getattr(gyro, name))


def _tuple(vector) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _vector(header, values) -> Vector3Stamped:
    message = Vector3Stamped(header=header)
    message.vector.x, message.vector.y, message.vector.z = (float(x) for x in values)
    return message


def _compensated(message: Imu, answer: Answer) -> Imu:
    """Return the message with the compensated values; the accelerometer part is unchanged."""
    out = Imu(
        header=message.header,
        linear_acceleration=message.linear_acceleration,
        linear_acceleration_covariance=message.linear_acceleration_covariance,
    )
    rate = out.angular_velocity
    rate.x, rate.y, rate.z = (float(x) for x in answer.rate)
    out.angular_velocity_covariance = _rate_covariance(message, answer)
    if answer.quaternion is None:
        out.orientation = message.orientation
        out.orientation_covariance = message.orientation_covariance
        return out
    q = out.orientation
    q.x, q.y, q.z, q.w = (float(x) for x in answer.quaternion)
    # The tilt's standard deviation is the total of both level axes.
    level = 0.5 * answer.tilt_sigma**2
    out.orientation_covariance = _diagonal(level, level, answer.heading_sigma**2)
    return out


def _rate_covariance(message: Imu, answer: Answer) -> list[float]:
    """Return the covariance; it is the message's own until the noise is measured."""
    if isfinite(answer.variance).all():
        return _diagonal(*answer.variance)
    said = [message.angular_velocity_covariance[4 * i] for i in range(3)]
    return _diagonal(*(max(s, 0.0) + b**2 for s, b in zip(said, answer.bias_sigma, strict=True)))


def _diagonal(*values: float) -> list[float]:
    return [float(values[i // 4]) if i % 4 == 0 else 0.0 for i in range(9)]


def main() -> None:
    """Run until ROS stops it."""
    rclpy.init()
    node = CompensateNode()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.keep()
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
