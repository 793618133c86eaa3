"""The node on an IMU: ``ros2 launch zerorate_imu compensate.launch.py imu:=/camera/imu``."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the description of the processes that ROS starts."""
    params = Path(get_package_share_directory("zerorate_imu"), "config", "params.yaml")
    return LaunchDescription(
        [
            DeclareLaunchArgument("imu", default_value="imu/data_raw", description="raw samples"),
            DeclareLaunchArgument("out", default_value="imu/data", description="compensated ones"),
            DeclareLaunchArgument("params", default_value=str(params), description="parameters"),
            Node(
                package="zerorate_imu",
                executable="compensate",
                name="zerorate_imu",
                output="screen",
                parameters=[LaunchConfiguration("params")],
                remappings=[
                    ("imu/data_raw", LaunchConfiguration("imu")),
                    ("imu/data", LaunchConfiguration("out")),
                ],
            ),
        ]
    )
