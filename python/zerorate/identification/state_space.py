"""Linear state-space models of a drift, and state-space forms of an ARMA model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.identification.polynomials import (
    at_one,
    cancel_common_roots,
    ma_coefficients,
    psi_weights,
    solve_refined,
    trim_zeros,
)
from zerorate.types import Booleans, Floats

if TYPE_CHECKING:
    from zerorate.identification.arma_model import ArmaModel

# Rounding error of the characteristic polynomials of forms of at most ten states.
_ROUNDING = 1e-13
# Largest condition number of an observability matrix that determines coordinates.
_MAX_CONDITION = 1e12


def _empty_array() -> Floats:
    return np.zeros(0)


class ArmaNumbers(NamedTuple):
    """Coefficients of an ARMA model without standard errors."""

    phi: Floats
    theta: Floats
    constant: float
    sigma2: float


@dataclass(frozen=True, eq=False)
class StateSpace:
    """Model x_(k+1) = F x_k + G a_(k+1) + d, z_k = H x_k + m + v_k.

    As in an ARMA model, an innovation acts on the sample at its own time.

    Attributes
    ----------
    F : ndarray, shape (n, n)
        Transition matrix of the state.
    G : ndarray, shape (n, u)
        Input matrix from u white noises of variance `sigma2` to the state.
    H : ndarray, shape (n,)
        Measurement row from the state to a sample.
    sigma2 : float
        Variance of the innovations a.
    R : float
        Variance of the white measurement noise v.
    offset : float
        m, in the unit of the samples.
    constant : ndarray, shape (n,)
        d, added to the state at every step. Default: zero.
    start : ndarray, shape (n,)
        Mean of the state before the first sample. Default: zero.

    Raises
    ------
    ValueError
        If the shapes do not match. If a variance is negative.

    Examples
    --------
    >>> from zerorate.identification import ArmaModel
    >>> model = ArmaModel.of([0.9], [-0.5]).to_state_space("controllable")
    >>> model.H.tolist(), model.to("harvey").G.T.tolist()
    ([1.0, -0.5], [[1.0, -0.5]])
    """

    F: Floats
    G: Floats
    H: Floats
    sigma2: float
    R: float = 0.0
    offset: float = 0.0
    constant: Floats = field(default_factory=_empty_array)
    start: Floats = field(default_factory=_empty_array)

    def __post_init__(self) -> None:
        """Convert the arrays, check their shapes and fill in zeros."""
        n = len(self.F)
        shapes = {"F": (n, n), "G": (n, -1), "H": (n,), "constant": (n,), "start": (n,)}
        for name, shape in shapes.items():
            object.__setattr__(self, name, _array(name, getattr(self, name), shape))
        for name in ("sigma2", "R"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ArgumentError(name, f"must be zero or positive, got {getattr(self, name)}")

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.F)

    @cached_property
    def constants(self) -> Booleans:
        """Mask of constant states, such as Fu and Han's c, shape (n,)."""
        still = np.all(np.eye(self.size) == self.F, axis=1) & ~np.any(self.G, axis=1)
        return np.asarray(still & (self.constant == 0.0))

    def covariance(self) -> Floats:
        """Return the stationary covariance P = F P F^T + sigma2 G G^T of the state, shape (n, n).

        Raises
        ------
        ValueError
            If a state with noise is not stationary.
        """
        moving = np.ix_(~self.constants, ~self.constants)
        P = np.zeros((self.size, self.size))
        P[moving] = self.sigma2 * stationary_covariance(self.F[moving], self.G[~self.constants])
        return P

    def autocovariance(self, lags: int) -> Floats:
        """Return gamma_0 ... gamma_lags of the samples, shape (lags + 1,), including R at lag 0.

        Raises
        ------
        ValueError
            If the model is not stationary, or `lags` negative.
        """
        if lags < 0:
            raise ArgumentError("lags", f"must not be negative, got {lags}")
        gamma = self._output_series(self.covariance() @ self.H, lags + 1)
        gamma[0] += self.R
        return gamma

    def impulse_response(self, n: int) -> Floats:
        """Return H F^k g, the effect of the first noise (column g of G), for k below n, shape (n,).

        For a form with a single noise, the result is psi_0 ... psi_(n-1) of the ARMA model.
        """
        return self._output_series(self.G[:, 0], n)

    def transfer(self, frequencies: npt.ArrayLike, rate: float) -> npt.NDArray[np.complex128]:
        """Return the transfer function from the first noise to the samples.

        It is H (I - F e^(-i w))^-1 g, with the first column g of G.

        Parameters
        ----------
        frequencies : array_like
            Frequencies in Hz, any shape.
        rate : float
            Samples per second.
        """
        delays = np.exp(-2j * np.pi * np.asarray(frequencies, dtype=np.float64) / rate)
        systems = np.eye(self.size) - delays[..., np.newaxis, np.newaxis] * self.F
        column = np.broadcast_to(self.G[:, :1].astype(np.complex128), (*delays.shape, self.size, 1))
        return np.asarray(np.linalg.solve(systems, column)[..., 0] @ self.H)

    def to_arma(self) -> ArmaNumbers:
        """Return phi, theta, constant and sigma2 of the samples, without common factors.

        phi is the characteristic polynomial of F. theta follows from phi and the impulse response.
        A model with measurement noise, or with several noises of the state, is first converted to a
        single innovation by the steady Kalman filter.

        Raises
        ------
        ValueError
            If the Kalman filter has no steady state.
        """
        model = self if self.R == 0.0 and self.G.shape[1] == 1 else self.innovations_form()
        return model._arma_numbers()

    def to(self, form: Form) -> StateSpace:
        """Return the same model, with its R, in another form (see `ArmaModel.to_state_space`).

        Raises
        ------
        ValueError
            If the form is unknown, or the state has more than one noise.
        """
        if self.G.shape[1] != 1:
            raise ValueError(f"only a model of a single noise has forms, got {self.G.shape[1]}")
        return build_form(self._arma_numbers(), form, self.R)

    def transformation(self, other: StateSpace) -> Floats:
        """Return T with x' = T x, F' T = T F, G' = T G and H = H' T, shape (n, n); ' marks `other`.

        Raises
        ------
        ValueError
            If the models differ in size, are not observable, or are not equivalent.
        """
        if self.size != other.size:
            raise ValueError(f"the models have {self.size} and {other.size} states")
        ours, theirs = self._observability(), other._observability()
        if np.linalg.cond(theirs) > _MAX_CONDITION or np.linalg.cond(ours) > _MAX_CONDITION:
            raise ValueError("a model with states that no sample shows has no such transformation")
        T = np.asarray(np.linalg.solve(theirs, ours))
        if not np.allclose(other.F @ T, T @ self.F, rtol=0.0, atol=1e-8 * float(np.abs(T).max())):
            raise ValueError("the two are not the same model in other coordinates")
        return T

    def innovations_form(self) -> StateSpace:
        """Return this model's steady Kalman filter as a model with one noise and no R.

        The returned sigma2 is the variance of the filter's innovations.

        Raises
        ------
        ValueError
            If the filter has no steady state.
        """
        reduced = self._without_constants()
        gain, variance = steady_state(
            reduced.F, reduced.sigma2 * reduced.G @ reduced.G.T, reduced.H, reduced.R
        )
        # The sample, as the sum of its prediction and its innovation, becomes one more state.
        F = np.block([[reduced.F, np.zeros((reduced.size, 1))], [reduced.H @ reduced.F, 0.0]])
        G = np.concatenate((gain, [1.0]))[:, np.newaxis]
        H = np.concatenate((np.zeros(reduced.size), [1.0]))
        d = np.concatenate((reduced.constant, [reduced.H @ reduced.constant]))
        return StateSpace(F, G, H, variance, 0.0, reduced.offset, d)

    def _output_series(self, x: Floats, n: int) -> Floats:
        """Return H F^k x for k below n."""
        outputs = np.empty(n)
        for k in range(n):
            outputs[k] = self.H @ x
            x = self.F @ x
        return outputs

    def _observability(self) -> Floats:
        rows = [self.H]
        for _ in range(self.size - 1):
            rows.append(rows[-1] @ self.F)
        return np.array(rows)

    def _arma_numbers(self) -> ArmaNumbers:
        reduced = self._without_constants()
        auto = _characteristic(reduced.F)
        psi = reduced.impulse_response(len(auto))
        theta = ma_coefficients(-auto[1:], psi)
        # Effect of a unit of constant input in the numerator at B = 1.
        driven = np.convolve(auto, reduced._output_series(reduced.constant, len(auto)))[: len(auto)]
        constant = reduced.offset * at_one(auto[1:]) + float(driven.sum())
        size = float(np.abs(auto).max()) * _ROUNDING
        phi, theta = trim_zeros(-auto[1:], size), trim_zeros(theta, size * float(np.abs(psi).max()))
        rest = at_one(-phi)
        phi, theta = cancel_common_roots(phi, theta)
        if rest:
            constant *= at_one(-phi) / rest
        return ArmaNumbers(phi, theta, float(constant), self.sigma2)

    def _without_constants(self) -> StateSpace:
        """Return the same model, with constant states moved into its constants."""
        still, moving = self.constants, ~self.constants
        values = self.start[still]
        return StateSpace(
            self.F[np.ix_(moving, moving)],
            self.G[moving],
            self.H[moving],
            self.sigma2,
            self.R,
            float(self.offset + self.H[still] @ values),
            self.constant[moving] + self.F[np.ix_(moving, still)] @ values,
            self.start[moving],
        )


def _array(name: str, value: Any, shape: tuple[int, ...]) -> Floats:  # noqa: ANN401
    array = np.array(value, dtype=np.float64)
    if name in ("constant", "start") and not array.size:
        return np.zeros(shape)
    fits = array.ndim == len(shape) and array.shape[0] == shape[0]
    if not fits or (shape[-1] >= 0 and array.shape != shape):
        wanted = str(shape).replace("-1", "u")
        raise ArgumentError(name, f"must have shape {wanted}, got {array.shape}")
    return array


def _characteristic(F: Floats) -> Floats:
    """Return [1, c_1, ..., c_n] of det(I - F B), by the recursion of Faddeev and Le Verrier.

    It is computed in a wider type without eigenvalues, because repeated eigenvalues are inaccurate.
    """
    n = len(F)
    wide, power = F.astype(np.longdouble), np.eye(n, dtype=np.longdouble)
    coefficients = np.ones(n + 1, dtype=np.longdouble)
    for k in range(1, n + 1):
        power = wide @ power
        coefficients[k] = -np.trace(power) / k
        power = power + coefficients[k] * np.eye(n, dtype=np.longdouble)
    return np.asarray(coefficients, dtype=np.float64)


Form = Literal["fu-han", "fu-han-literal", "harvey", "controllable", "observable"]


def make_state_space(
    model: ArmaModel, form: Form = "harvey", measurement_noise: float = 0.0
) -> StateSpace:
    """Return the model as x_(k+1) = F x_k + G a_(k+1), z_k = H x_k.

    Parameters
    ----------
    form : str
        Forms with r = max(p, q + 1) states, minimal if phi and theta have no common root:

        - "harvey" (default): F is the companion matrix with phi in its first column, G = [1,
          theta], H = [1, 0, ...] (Harvey, "Forecasting, Structural Time Series Models and the
          Kalman Filter", 1989).
        - "controllable": F is the companion matrix with phi in its first row, G = [1, 0, ...], H =
          [1, theta].
        - "observable": the state is z_k and the predictions of the next samples. G = psi weights, H
          = [1, 0, ...] (Akaike, Annals of the Institute of Statistical Mathematics 26, 1974). The
          observability matrix is the identity.

        Forms with the state of Fu & Han (2019), Table 3, [y_k ... y_(k-p+1), c]:

        - "fu-han": with the additional states a_k ... a_(k-q+1) between y and c; exact.
        - "fu-han-literal": the noise [a_k, a_(k-1), ...] enters through B = [1, theta] and counts
          as white. It is not white, because a_(k-1) is in two successive noises. The model is an
          AR(p) with innovation variance sigma2 (1 + sum theta^2), without the MA part's
          correlation. For Table 3's ARMA(2, 1), with phi_1 = 1.0202 and theta_1 = -0.9955, its
          variance is 140 times too large.
    measurement_noise : float
        Variance R of white noise on the samples, in the squared unit of the record. Default: 0.

    Raises
    ------
    ValueError
        If the form is unknown, or R is negative.

    Examples
    --------
    >>> from zerorate.identification import ArmaModel
    >>> ArmaModel.of([1.2, -0.3], [0.5]).to_state_space("fu-han").F.tolist()[0]
    [1.2, -0.3, 0.5, 1.0]
    """
    numbers = ArmaNumbers(model.phi, model.theta, model.constant, model.sigma2)
    return build_form(numbers, form, measurement_noise)


def build_form(numbers: ArmaNumbers, form: Form, R: float) -> StateSpace:
    """Return a model in the form of this name."""
    if form not in _FORMS:
        known = ", ".join(repr(name) for name in _FORMS)
        raise ArgumentError("form", f"must be one of {known}, got {form!r}")
    return _FORMS[form](numbers, R)


def _pad_polynomials(numbers: ArmaNumbers) -> tuple[Floats, Floats]:
    """Return phi and [1, theta], both with r elements."""
    r = max(numbers.phi.size, numbers.theta.size + 1)
    phi, moving = np.zeros(r), np.zeros(r)
    phi[: numbers.phi.size] = numbers.phi
    moving[: numbers.theta.size + 1] = [1.0, *numbers.theta]
    return phi, moving


def _assemble(numbers: ArmaNumbers, F: Floats, G: Floats, H: Floats, R: float) -> StateSpace:
    """Return a minimal form; a constant becomes an offset if there is a mean, else an input."""
    rest = at_one(-numbers.phi)
    if rest:
        offset = numbers.constant / rest
        return StateSpace(F, G[:, np.newaxis], H, numbers.sigma2, R, offset)
    return StateSpace(F, G[:, np.newaxis], H, numbers.sigma2, R, 0.0, G * _constant_drive(numbers))


def _constant_drive(numbers: ArmaNumbers) -> float:
    """Return the constant innovation with the effect of c."""
    gain = at_one(numbers.theta)
    if not numbers.constant:
        return 0.0
    if not gain:
        raise ValueError("phi and theta share a unit root: their constant has no such form")
    return numbers.constant / gain


def _harvey(numbers: ArmaNumbers, R: float) -> StateSpace:
    phi, moving = _pad_polynomials(numbers)
    F = np.eye(phi.size, k=1)
    F[:, 0] = phi
    return _assemble(numbers, F, moving, np.eye(phi.size)[0], R)


def _controllable(numbers: ArmaNumbers, R: float) -> StateSpace:
    phi, moving = _pad_polynomials(numbers)
    F = np.eye(phi.size, k=-1)
    F[0] = phi
    return _assemble(numbers, F, np.eye(phi.size)[0], moving, R)


def _observable(numbers: ArmaNumbers, R: float) -> StateSpace:
    phi, _ = _pad_polynomials(numbers)
    F = np.eye(phi.size, k=1)
    F[-1] = phi[::-1]
    psi = psi_weights(numbers.phi, numbers.theta, phi.size)
    return _assemble(numbers, F, psi, np.eye(phi.size)[0], R)


def _fu_han(numbers: ArmaNumbers, R: float) -> StateSpace:
    """Return the form with the state [y_k ... y_(k-p+1), a_k ... a_(k-q+1), c]."""
    p, q = max(numbers.phi.size, 1), numbers.theta.size
    F = _companion(numbers, p, q)
    F[0, p : p + q] = numbers.theta
    G = np.zeros((p + q + 1, 1))
    G[0] = 1.0
    if q:
        G[p] = 1.0
    return _with_constant(numbers, F, G, p, R)


def _fu_han_literal(numbers: ArmaNumbers, R: float) -> StateSpace:
    """Return the form with the state [y_k ... y_(k-p+1), c] and noise [a_k ... a_(k-q)]."""
    p, q = max(numbers.phi.size, 1), numbers.theta.size
    B = np.zeros((p + 1, q + 1))
    B[0] = [1.0, *numbers.theta]
    return _with_constant(numbers, _companion(numbers, p, 0), B, p, R)


def _companion(numbers: ArmaNumbers, p: int, q: int) -> Floats:
    """Return the transition matrix of p samples, q innovations and the constant, without theta."""
    F = np.eye(p + q + 1, k=-1)
    F[p, p - 1] = 0.0
    F[-1] = np.eye(p + q + 1)[-1]
    F[0, : numbers.phi.size] = numbers.phi
    F[0, -1] = 1.0
    return F


def _with_constant(numbers: ArmaNumbers, F: Floats, G: Floats, p: int, R: float) -> StateSpace:
    """Return a model with c as its last state; it starts from the mean, or from zero."""
    start = np.zeros(len(F))
    start[-1] = numbers.constant
    rest = at_one(-numbers.phi)
    start[:p] = numbers.constant / rest if rest else 0.0
    return StateSpace(F, G, np.eye(len(F))[0], numbers.sigma2, R, 0.0, start=start)


_FORMS: Final[dict[Form, Callable[[ArmaNumbers, float], StateSpace]]] = {
    "fu-han": _fu_han,
    "fu-han-literal": _fu_han_literal,
    "harvey": _harvey,
    "controllable": _controllable,
    "observable": _observable,
}


def stationary_covariance(F: Floats, G: Floats) -> Floats:
    """Return the solution P of P = F P F' + G G', shape (n, n).

    n^2 linear equations are solved, because the order n of a drift model is small.

    Raises
    ------
    ValueError
        If an eigenvalue of F lies on or outside the unit circle.
    """
    n = len(F)
    largest = float(np.max(np.abs(np.linalg.eigvals(F)), initial=0.0))
    # Rounding may move an eigenvalue of one slightly below one.
    if not largest < 1.0 - n * np.finfo(np.float64).eps:
        raise ValueError(
            "only a stationary model has a covariance: "
            f"its largest eigenvalue is {largest:.6g}, expected below 1"
        )
    wide, noise = F.astype(np.longdouble), G.astype(np.longdouble)
    equations = np.eye(n * n, dtype=np.longdouble) - np.kron(wide, wide)
    P = solve_refined(equations, (noise @ noise.T).ravel()).reshape(n, n)
    return np.asarray((P + P.T) / 2.0)


# Each round squares the number of processed samples; after 2^40 the filter is steady.
_MAX_ROUNDS: Final = 40


def steady_state(F: Floats, Q: Floats, H: Floats, R: float) -> tuple[Floats, float]:
    """Return the steady filter's gain (n,) and innovation variance for x+ = F x + w, z = H x + v.

    Structured doubling is used: each round squares the number of samples that the filter has
    processed (Chu, Fan and Lin, Linear Algebra and its Applications 396, 2005).

    Raises
    ------
    ValueError
        If there is no measurement noise R, or the filter does not become steady.
    """
    if not R > 0.0:
        raise ValueError(f"several noises need a measurement noise R above 0, got {R}")
    identity, A, information, P = np.eye(len(F)), F.T, np.outer(H, H) / R, Q
    for _ in range(_MAX_ROUNDS):
        solution = np.linalg.solve(identity + information @ P, np.column_stack((A, information)))
        gain_factor, gained = np.hsplit(solution, 2)
        before, P = P, P + A.T @ P @ gain_factor
        A, information = A @ gain_factor, information + A @ gained @ A.T
        if np.allclose(P, before, rtol=1e-15, atol=0.0):
            break
    variance = float(H @ P @ H + R)
    if not np.isfinite(variance):
        raise ValueError("the Kalman filter of this model has no steady state")
    return P @ H / variance, variance
