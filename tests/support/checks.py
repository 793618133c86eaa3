"""What tests ask of numbers: the same bits, finite, a covariance."""

from contextlib import contextmanager

import numpy as np


@contextmanager
def named(*what):
    """Name what was tried in the message of a test that tries many things."""
    try:
        yield
    except Exception as error:
        error.add_note(f"of {', '.join(map(str, what))}")
        raise


def assert_same_bits(got, expected):
    got, expected = np.asarray(got), np.asarray(expected)
    assert got.dtype == expected.dtype
    assert got.shape == expected.shape
    assert got.tobytes() == expected.tobytes(), "differs in the last bits at least"


def assert_finite(arrays):
    for name, values in arrays.items():
        assert np.isfinite(values).all(), name


def assert_covariance(P):
    assert_symmetric(P)
    assert_semidefinite(P)


def assert_symmetric(P):
    """To the bit, for a stack of matrices."""
    bits = np.ascontiguousarray(P).view(np.uint64)
    assert np.array_equal(bits, bits.swapaxes(-1, -2)), "not symmetric"


def assert_semidefinite(P):
    """For a stack of symmetric matrices."""
    P = changing(P)
    variances = np.einsum("...ii->...i", P)
    assert np.all(variances >= 0.0)
    largest = np.max(variances, axis=-1)
    # On a scale on which the factors neither overflow nor underflow.
    scaled = P / np.where(largest > 0.0, largest, 1.0)[..., None, None]
    # A factorisation errs by a few units in the last place of the norm, at most the size times the
    # largest variance; so does the rounding of the elements themselves to the samples' unit.
    tolerance = 8.0 * P.shape[-1] * np.finfo(float).eps
    # Cholesky's fails if an eigenvalue is below minus the tolerance, and is faster than finding it.
    factors = np.linalg.cholesky(scaled + tolerance * np.eye(P.shape[-1]))
    assert np.all(np.isfinite(factors))


def indefiniteness(n):
    """By how much of its variances a covariance of a running filter may miss semidefiniteness.

    The bound of the core (math/symmetric.rs), which its steps keep and its checkpoints ask.
    """
    return 16.0 * 8.0 * np.finfo(float).eps * n


def assert_semidefinite_to_rounding(P):
    """To what a running filter may miss, of the largest variance: forged states hide the others."""
    bound = indefiniteness(P.shape[-1]) * np.trace(P, axis1=-2, axis2=-1)
    assert np.all(np.linalg.eigvalsh(P) >= -bound[..., None])


def changing(P):
    """A stack without the matrices that equal the one before."""
    stack = P.reshape(-1, *P.shape[-2:])
    changes = np.any(stack[1:] != stack[:-1], axis=(1, 2))
    return stack[np.append(len(stack) > 0, changes)[: len(stack)]]
