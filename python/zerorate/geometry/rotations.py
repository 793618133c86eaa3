"""Unit quaternions w, x, y, z in arrays of shape (..., 4)."""

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.types import Floats

_BLOCK_ROWS: Final = 256
_IDENTITY: Final = np.array([1.0, 0.0, 0.0, 0.0])


def from_rotation_vectors(vectors: Floats) -> Floats:
    """Return quaternions from rotation vectors, rad, of shape (..., 3)."""
    half = 0.5 * np.linalg.norm(vectors, axis=-1, keepdims=True)
    # numpy's sinc is sin(pi x) / (pi x), with the value 1 at 0.
    return np.concatenate((np.cos(half), 0.5 * np.sinc(half / np.pi) * vectors), axis=-1)


def from_matrices(matrices: Floats) -> Floats:
    """Return quaternions from matrices of shape (m, 3, 3), by the largest column of 4 q q'."""
    across = matrices.transpose(0, 2, 1)
    trace = np.trace(matrices, axis1=1, axis2=2)[:, None, None]
    outer = np.zeros((len(matrices), 4, 4))
    outer[:, 1:, 1:] = matrices + across + (1.0 - trace) * np.eye(3)
    outer[:, :1, :1] = 1.0 + trace
    outer[:, 0, 1:] = (matrices - across)[:, (2, 0, 1), (1, 2, 0)]
    outer[:, 1:, 0] = outer[:, 0, 1:]
    largest = np.argmax(np.diagonal(outer, axis1=1, axis2=2), axis=1)
    return unit(outer[np.arange(len(matrices)), largest])


def from_euler_angles(roll: npt.ArrayLike, pitch: npt.ArrayLike, yaw: npt.ArrayLike) -> Floats:
    """Return quaternions from yaw, then pitch, then roll, rad, shape (..., 4)."""
    with np.errstate(invalid="ignore", over="ignore"):
        half = [np.asarray(angle, np.float64) / 2 for angle in (roll, pitch, yaw)]
        (cr, cp, cy), (sr, sp, sy) = map(np.cos, half), map(np.sin, half)
    parts = (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
    return np.stack(parts, axis=-1)


def about_z(angle: float) -> Floats:
    """Return the quaternion of a rotation about the third axis, rad, shape (4,)."""
    return np.array([math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)])


def to_rotation_vectors(q: Floats) -> Floats:
    """Return rotation vectors from quaternions (..., 4), rad, shape (..., 3), length up to pi."""
    shortest = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.linalg.norm(shortest[..., 1:], axis=-1, keepdims=True)
    angles = 2.0 * np.arctan2(sine, shortest[..., :1])
    ratio = np.where(sine > 0.0, angles / np.where(sine > 0.0, sine, 1.0), 2.0)
    vectors: Floats = shortest[..., 1:] * ratio
    return vectors


def to_matrices(q: Floats) -> Floats:
    """Return rotation matrices from unit quaternions (..., 4), shape (..., 3, 3)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def cross_matrices(vectors: Floats) -> Floats:
    """Return the matrices of cross products with vectors (..., 3), shape (..., 3, 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    return rows.reshape(*vectors.shape[:-1], 3, 3)


def rotate(q: Floats, vectors: Floats) -> Floats:
    """Return vectors (..., 3) rotated by unit quaternions (..., 4), with broadcasting."""
    pure = np.concatenate((np.zeros((*vectors.shape[:-1], 1)), vectors), axis=-1)
    rotated: Floats = product(product(q, pure), inverse(q))[..., 1:]
    return rotated


def product(p: Floats, q: Floats) -> Floats:
    """Return the product p q: first the rotation q, then p, both about fixed axes."""
    # Written by components, because NumPy's cross product takes as long as all of this.
    a, x, y, z = (p[..., i] for i in range(4))
    b, r, s, t = (q[..., i] for i in range(4))
    parts = (
        a * b - (x * r + y * s + z * t),
        a * r + b * x + (y * t - z * s),
        a * s + b * y + (z * r - x * t),
        a * t + b * z + (x * s - y * r),
    )
    return np.stack(parts, axis=-1)


def inverse(q: Floats) -> Floats:
    """Return the inverse quaternions."""
    conjugate: Floats = q * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugate


def angle(q: Floats) -> Floats:
    """Return the rotation angles, rad, 0 to pi; small angles are accurate, too."""
    vector = np.linalg.norm(q[..., 1:], axis=-1)
    angles: Floats = 2.0 * np.arctan2(vector, np.abs(q[..., 0]))
    return angles


def unit(q: Floats) -> Floats:
    """Return the quaternions scaled to length 1; NaN if the length is zero."""
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        scaled: Floats = np.where(length > 0.0, q / length, np.nan)
    return scaled


def cumulative_product(steps: Floats) -> Floats:
    """Return the cumulative products of rotations, shape (n, 4).

    Blocks are computed in parallel. Each block is then multiplied by the product of all earlier
    blocks.
    """
    n = len(steps)
    padded = np.concatenate((steps, np.tile(_IDENTITY, (-n % _BLOCK_ROWS, 1))))
    blocks = padded.reshape(-1, _BLOCK_ROWS, 4).copy()
    for i in range(1, _BLOCK_ROWS):
        blocks[:, i] = product(blocks[:, i - 1], blocks[:, i])
    starts = np.tile(_IDENTITY, (len(blocks), 1))
    for i in range(1, len(blocks)):
        starts[i] = product(starts[i - 1], blocks[i - 1, -1])
    return unit(product(starts[:, None], blocks).reshape(-1, 4)[:n])


def euler_angles(quaternion: Floats) -> Floats:
    """Return roll, pitch and yaw of quaternions (n, 4), rad, shape (n, 3)."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    sine = np.clip(2.0 * (w * y - z * x), -1.0, 1.0)
    return np.stack(
        (
            np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(sine),
            np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        ),
        axis=-1,
    )
