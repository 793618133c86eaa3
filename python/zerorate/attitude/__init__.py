"""Attitude of recordings, and what is known of a gyro before."""
