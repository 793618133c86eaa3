"""Calibration of a magnetometer by the gyro: ticks, spans, fit, choice and results."""
