"""Records that follow an autoregression."""

import numpy as np
from hypothesis import strategies as st
from scipy.signal import lfilter

# Luteinizing hormone in blood samples of one woman, every ten minutes; Diggle, "Time Series: A
# Biostatistical Introduction", 1990, table A.1; R's data set `lh`.
_PRINTED = """
    2.4 2.4 2.4 2.2 2.1 1.5 2.3 2.3 2.5 2.0 1.9 1.7 2.2 1.8 3.2 3.2 2.7 2.2 2.2 1.9 1.9 1.8 2.7 3.0
    2.3 2.0 2.0 2.9 2.9 2.7 2.7 2.3 2.6 2.4 1.8 1.7 1.5 1.4 2.1 3.3 3.5 3.5 3.1 2.6 2.1 3.4 3.0 2.9
"""
LH = np.array(_PRINTED.split(), dtype=float)


def simulated(phi, n, seed=1, settle=1000):
    """A record of an autoregression of innovations of variance one."""
    noise = np.random.default_rng(seed).standard_normal(n + settle)
    return lfilter([1.0], np.concatenate([[1.0], -np.asarray(phi)]), noise)[settle:]


def coefficients(reflections):
    """Coefficients of the model of given reflection coefficients (Levinson)."""
    phi = np.array([])
    for last in reflections:
        phi = np.append(phi - last * phi[::-1], last)
    return phi


@st.composite
def stationary_records(draw, largest=0.9):
    """A record of a random stationary model, and its order."""
    reflections = draw(st.lists(st.floats(-largest, largest), max_size=6))
    n = draw(st.integers(80, 3000))
    return simulated(coefficients(reflections), n, draw(st.integers(0, 2**32))), len(reflections)
