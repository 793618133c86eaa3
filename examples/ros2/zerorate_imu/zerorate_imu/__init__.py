"""ROS 2 node that removes the bias of an IMU's gyro."""
