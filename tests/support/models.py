"""ARMA models for tests, by their roots."""

import numpy as np
from hypothesis import strategies as st
from scipy.signal import lfilter

from zerorate.identification import ArmaModel

# Fu & Han 2019, equation 32, without its constant, which contradicts its mean.
FU_HAN = ArmaModel.of([1.0202, -0.0267], [-0.9955])
SHAPES = [(p, q) for p in range(4) for q in range(4)]


def polynomial(poles):
    """[1, c_1, ...] of reciprocal roots; a complex one brings its conjugate."""
    pairs = [z for pole in poles for z in ([pole, np.conj(pole)] if np.imag(pole) else [pole])]
    return np.real(np.poly(pairs)) if pairs else np.ones(1)


def from_roots(poles, zeros, constant=0.0, sigma2=1.0):
    """The model of these reciprocal roots."""
    return ArmaModel.of(-polynomial(poles)[1:], polynomial(zeros)[1:], constant, sigma2)


@st.composite
def reciprocal_roots(draw, count, largest):
    """So many real or paired reciprocal roots inside the unit circle."""
    sizes = st.floats(0.05, largest)
    roots = []
    while count > 0:
        size = draw(sizes)
        if count > 1 and draw(st.booleans()):
            roots.append(size * np.exp(1j * draw(st.floats(0.1, 3.0))))
            count -= 2
        else:
            roots.append(size * draw(st.sampled_from([1.0, -1.0])))
            count -= 1
    return roots


@st.composite
def arma_models(draw, largest=0.999, shapes=tuple(SHAPES)):
    """Stationary, invertible models, also close to a unit root, of any orders."""
    p, q = draw(st.sampled_from(shapes))
    poles = draw(reciprocal_roots(p, largest))
    zeros = draw(reciprocal_roots(q, min(largest, 0.99)))
    constant = draw(st.sampled_from([0.0, -0.35, 2.0]))
    return from_roots(poles, zeros, constant, draw(st.sampled_from([1e-8, 1.0, 4.0])))


def asymptotic_covariance(model, n):
    """Of [phi, theta, c] estimated from n samples (Box and Jenkins, section 7.2).

    The inverse of n / sigma2 times the covariance of the derivatives of a_k, which are
    autoregressions of a by phi and by -theta: their cross products by the weights of both.
    """
    p, q = model.order
    weights = 20_000
    impulse = np.eye(1, weights)[0]
    auto = lfilter([1.0], [1.0, *-model.phi], impulse)
    moving = lfilter([1.0], [1.0, *model.theta], impulse)
    rows = [np.roll(auto, i) * (np.arange(weights) >= i) for i in range(p)]
    rows += [np.roll(moving, j) * (np.arange(weights) >= j) for j in range(q)]
    covariance = np.zeros((p + q + 1, p + q + 1))
    if rows:
        derivatives = np.array(rows)
        covariance[:-1, :-1] = np.linalg.inv(derivatives @ derivatives.T * n)
    covariance[-1, -1] = model.sigma2 * (1.0 + model.theta.sum()) ** 2 / n
    return covariance
