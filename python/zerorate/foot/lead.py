"""Samples before the stance in which the filter of a foot starts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from zerorate._native import foot_lead
from zerorate.geometry.rotations import from_rotation_vectors, inverse, product, rotate

if TYPE_CHECKING:
    from zerorate.types import Floats

FRD_TO_FLU: Final = np.array([1.0, -1.0, -1.0])
"""Signs from forward, right, down to forward, left, up."""
HALF_TURN_ABOUT_X: Final = np.array([0.0, 1.0, 0.0, 0.0])
_GRAVITY_M_S2: Final = 9.81


class Lead(NamedTuple):
    """Samples from the first known sample to the start of the filter.

    Attributes
    ----------
    first, begin : int
        First and last sample. At the last sample the foot stands.
    gyro, accel : ndarray, shape (begin - first + 1, 3)
        Rates, rad/s, restored where they were clipped, and forces, m/s^2.
    """

    first: int
    begin: int
    gyro: Floats
    accel: Floats

    def go_back(
        self, time: Floats, quaternion: Floats, biases: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return position, velocity and quaternion before the last sample, relative to it.

        Parameters
        ----------
        time : ndarray, shape (n,)
            Times of all samples, s.
        quaternion : ndarray, shape (4,)
            Quaternion at the last sample, from the sensor's axes to forward, left, up.
        biases : ndarray, shape (2, 3)
            Biases at the last sample: gyro, rad/s, and accelerometer, m/s^2.
        """
        native = product(inverse(HALF_TURN_ABOUT_X), quaternion)
        samples = time[self.first : self.begin + 1]
        position, velocity, turns = foot_lead(samples, self.gyro, self.accel, native, biases)
        around = np.broadcast_to(HALF_TURN_ABOUT_X, turns.shape)
        return position * FRD_TO_FLU, velocity * FRD_TO_FLU, product(around, turns)

    def variance(self, time: Floats, position: Floats, sigma: Floats) -> Floats:
        """Return the position variance that these samples add, m², shape (n, 3).

        Positions are relative to the first sample. Velocity and tilt are known at the last sample.
        A tilt error turns gravity into a horizontal acceleration, and horizontal into vertical
        acceleration.

        Parameters
        ----------
        time : ndarray, shape (n,)
            Times of the samples, s.
        position : ndarray, shape (n, 3)
            Positions, m.
        sigma : ndarray, shape (15,)
            Standard deviations at the last sample. Only velocity and tilt are used.
        """
        whole = float(time[self.begin] - time[self.first])
        since = np.clip(time - time[self.first], 0.0, whole)
        speed = float(np.linalg.norm(sigma[3:6]) / math.sqrt(3.0))
        tilt = float(np.linalg.norm(sigma[6:8]) / math.sqrt(2.0))
        way = np.linalg.norm(position[:, :2] - position[self.first, :2], axis=1)
        way[: self.first] = 0.0
        way[self.begin :] = way[self.begin]
        fall = _GRAVITY_M_S2 * since * (whole - 0.5 * since)
        lengths = np.column_stack([fall, fall, way])
        variance: Floats = (speed * since[:, np.newaxis]) ** 2 + (tilt * lengths) ** 2
        return variance

    def replace_in(
        self, time: Floats, track: tuple[Floats, Floats, Floats], biases: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return a track of n samples, integrated backward from the current last state.

        Position and heading of the first sample are zero.

        Parameters
        ----------
        time : ndarray, shape (n,)
            Times of the samples, s.
        track : tuple of ndarray
            Positions (n, 3), velocities (n, 3), and quaternions (n, 4).
        biases : ndarray, shape (2, 3)
            Biases at the last sample: gyro, rad/s, and accelerometer, m/s^2.
        """
        first, begin = self.first, self.begin
        position, velocity, quaternion = (values.copy() for values in track)
        back = self.go_back(time, quaternion[begin], biases)
        position[first:begin] = position[begin] + back[0]
        velocity[first:begin], quaternion[first:begin] = back[1:]
        w, x, y, z = quaternion[first]
        heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        turn = from_rotation_vectors(np.array([[0.0, 0.0, -heading]]))
        turns = np.broadcast_to(turn, quaternion.shape)
        return (
            rotate(turns, position - position[first]),
            rotate(turns, velocity),
            product(turns, quaternion),
        )
