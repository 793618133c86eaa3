"""Rotations as quaternions, vectors and matrices, against matrices by their power series."""

import numpy as np
import pytest

from oracle.turns import exponential
from zerorate.geometry.rotations import (
    about_z,
    angle,
    cross_matrices,
    euler_angles,
    from_euler_angles,
    from_matrices,
    from_rotation_vectors,
    inverse,
    product,
    rotate,
    to_matrices,
    to_rotation_vectors,
)

ANGLES = (0.0, 1e-9, 1e-3, 1.0, 3.0, np.pi - 1e-7)


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def vectors(rng, n=50, longest=3.0):
    """Return rotation vectors of random directions and of lengths up to one."""
    axes = rng.standard_normal((n, 3))
    return axes / np.linalg.norm(axes, axis=1, keepdims=True) * rng.uniform(0.0, longest, (n, 1))


@pytest.mark.parametrize("size", ANGLES)
def test_rotation_vectors_there_and_back(rng, size):
    axis = rng.standard_normal(3)
    vector = size * axis / np.linalg.norm(axis)
    matrix = exponential(vector)[np.newaxis]
    np.testing.assert_allclose(
        to_rotation_vectors(from_matrices(matrix))[0], vector, rtol=1e-9, atol=1e-15
    )
    q = from_rotation_vectors(vector)
    np.testing.assert_allclose(to_rotation_vectors(q), vector, rtol=1e-12, atol=1e-15)
    # Either sign is one rotation.
    np.testing.assert_array_equal(to_rotation_vectors(-q), to_rotation_vectors(q))
    assert angle(q) == pytest.approx(size, rel=1e-12, abs=1e-15)


def test_quaternions_rotate_as_their_matrices(rng):
    turns, arrows = vectors(rng), rng.standard_normal((50, 3))
    q = from_rotation_vectors(turns)
    matrices = np.stack([exponential(turn) for turn in turns])
    np.testing.assert_allclose(to_matrices(q), matrices, atol=1e-14)
    np.testing.assert_allclose(to_matrices(q[3]), matrices[3], atol=1e-14)
    there = rotate(q, arrows)
    np.testing.assert_allclose(there, np.einsum("nij,nj->ni", matrices, arrows), atol=1e-13)
    np.testing.assert_allclose(rotate(inverse(q), there), arrows, atol=1e-13)


def test_one_rotation_or_one_vector_serves_all(rng):
    q, arrows = from_rotation_vectors(vectors(rng)), rng.standard_normal((50, 3))
    by_one = rotate(np.tile(q[0], (50, 1)), arrows)
    np.testing.assert_array_equal(rotate(q[0], arrows), by_one)
    np.testing.assert_array_equal(rotate(q, arrows[0]), rotate(q, np.tile(arrows[0], (50, 1))))
    np.testing.assert_array_equal(rotate(q[0], arrows[0]), by_one[0])


def test_cross_matrices(rng):
    one, other = rng.standard_normal((2, 20, 3))
    crossed = np.einsum("nij,nj->ni", cross_matrices(one), other)
    np.testing.assert_allclose(crossed, np.cross(one, other), atol=1e-14)
    np.testing.assert_array_equal(cross_matrices(one[0]), cross_matrices(one)[0])


def test_euler_angles_there_and_back(rng):
    given = rng.uniform(-1.0, 1.0, (50, 3)) * (3.1, 1.5, 3.1)
    q = from_euler_angles(*given.T)
    np.testing.assert_allclose(euler_angles(q), given, atol=1e-12)
    roll, pitch, yaw = (
        from_rotation_vectors(given[:, i, np.newaxis] * np.eye(3)[i]) for i in range(3)
    )
    np.testing.assert_allclose(q, product(yaw, product(pitch, roll)), atol=1e-14)
    np.testing.assert_allclose(about_z(given[0, 2]), yaw[0], atol=1e-15)


def test_nothing_known_stays_so():
    missing = np.full((2, 4), np.nan)
    assert np.isnan(to_rotation_vectors(missing)).all()
    assert np.isnan(rotate(missing, np.ones((2, 3)))).all()
    assert np.isnan(from_euler_angles(np.inf, 0.0, 0.0)).all()
