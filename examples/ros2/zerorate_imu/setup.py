"""Install the node for ROS. zerorate itself comes from pip."""

from setuptools import setup

NAME = "zerorate_imu"

setup(
    name=NAME,
    version="0.2.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/compensate.launch.py"]),
        (f"share/{NAME}/config", ["config/params.yaml"]),
    ],
    install_requires=["setuptools", "zerorate"],
    maintainer="The developers of zerorate",
    maintainer_email="nobody@example.com",
    description="Removes the bias of an IMU's gyro, with covariances, attitude and diagnostics",
    license="MIT OR Apache-2.0",
    entry_points={"console_scripts": [f"compensate = {NAME}.node:main"]},
)
