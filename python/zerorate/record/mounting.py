"""Mounting of sensors: rotation into the axes of the body, antenna and clock offset."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.geometry.scipy_rotation import RotationLike, as_matrices
from zerorate.record import Recording
from zerorate.types import Floats

_ORTHOGONALITY_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Mounting:
    """Mounting of sensors as stated in a file; None for values that are not stated.

    Parameters
    ----------
    body_from_sensor : ndarray, shape (3, 3), or None
        Rotation from the sensor's axes to forward, right, down.
    antenna : ndarray, shape (3,), or None
        Vector from the sensor to the antenna, body axes, m.
    time_offset : float, or None
        Offset to add to the times of the fixes, s, as in ``NavigationFilter.process``.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.record import Mounting
    >>> Mounting(np.eye(3), antenna=np.array([0.5, 0.0, -1.2]), time_offset=None).antenna
    array([ 0.5,  0. , -1.2])
    """

    body_from_sensor: Floats | None = None
    antenna: Floats | None = None
    time_offset: float | None = None

    @property
    def has_content(self) -> bool:
        """True if the file states at least one value."""
        parts = (self.body_from_sensor, self.antenna, self.time_offset)
        return any(part is not None for part in parts)


def body_axes(recording: Recording, body_from_sensor: RotationLike) -> Recording:
    """Return a recording with all sensors of three axes rotated into the body's axes.

    Parameters
    ----------
    recording : Recording
        Recording. Its gyros, accelerometers and magnetometers are rotated; other logs stay. The
        ``mounting`` of the result has no rotation.
    body_from_sensor : array_like, shape (3, 3), or scipy Rotation
        Rotation from sensor axes to body axes.

    Raises
    ------
    ValueError
        If the matrix is no rotation, for example if it mirrors an axis.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=40.0)
    >>> upside_down = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]
    >>> zr.record.body_axes(drive.recording(), upside_down).accel.data[0].round() + 0.0
    array([ 0.,  0., 10.])
    """
    matrix = check_rotation(body_from_sensor)
    rotated = {
        name: replace(log, data=log.data @ matrix.T) if _is_vector(name, log.channels) else log
        for name, log in recording.items()
    }
    return replace(recording, logs=rotated, supplement=recording.supplement.in_body_axes())


def check_rotation(values: RotationLike) -> Floats:
    """Return a checked rotation matrix; ValueError if it is not a rotation."""
    try:
        matrix = np.array(as_matrices(values), dtype=np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (3, 3):
        raise ArgumentError("body_from_sensor", "must be a matrix of shape (3, 3)")
    error = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if not error < _ORTHOGONALITY_TOLERANCE or np.linalg.det(matrix) < 0.0:
        raise ArgumentError(
            "body_from_sensor", "must be a rotation: rows of length 1 at right angles, not mirrored"
        )
    return matrix


def _is_vector(name: str, channels: int) -> bool:
    return channels == 3 and name.startswith(("gyro", "accel", "mag"))
