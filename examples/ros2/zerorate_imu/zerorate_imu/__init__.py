"""A node of ROS 2 that removes the bias of an IMU's gyro."""
