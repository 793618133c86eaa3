"""Records whose rests rounding decides: of samples on a few steps, two often lie as far off."""

from contextlib import contextmanager

import numpy as np
from hypothesis import assume

from oracle.rest import RestDetector

# A unit changes nothing but roundings; none of these is a power of two.
UNITS = (1.1, 0.7, 1.3, 3.3, 1.0 / 3.0)


@contextmanager
def but_for_rounding(z, rate, rest_limit=None, bias_limit=None):
    """Drop an example that fails if another unit of its samples ends the twin's rests elsewhere."""
    try:
        yield
    except AssertionError:
        rests = [rests_of(z, unit, rate, rest_limit, bias_limit) for unit in (1.0, *UNITS)]
        assume(all(np.array_equal(rests[0], other) for other in rests[1:]))
        raise


def rests_of(z, unit, rate, *limits):
    """Whether the twin rests after each sample of a record in another unit."""
    twin = RestDetector(rate, *(limit and unit * limit for limit in limits))
    return np.array([twin.update(sample) for sample in (unit * z).tolist()])


@contextmanager
def but_for_roundings_of(answers, rtol):
    """Drop an example that fails if the twin's answers are others in another unit.

    ``answers`` gives them for a unit, in which samples, limits and the answers are.
    """
    try:
        yield
    except AssertionError:
        told = [answers(unit) / unit for unit in (1.0, *UNITS)]
        atol = rtol * np.abs(told[0]).max(initial=1.0)
        assume(all(np.allclose(told[0], other, rtol, atol) for other in told[1:]))
        raise
