"""Calibration of a magnetometer with the gyro as reference."""
