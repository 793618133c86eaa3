"""Linear state-space models of a drift, in whatever coordinates."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.identify.models.polynomials import at_one, cancelled, ma_coefficients, trimmed
from zerorate.identify.state_space.lyapunov import stationary_covariance
from zerorate.identify.state_space.riccati import steady_state

if TYPE_CHECKING:
    from zerorate.identify.state_space.forms import Form

__all__ = ["ArmaNumbers", "StateSpace"]

Floats = npt.NDArray[np.float64]

# Digits that forms of at most ten states lose in their characteristic polynomials.
_ROUNDING = 1e-13
# An observability matrix worse than this tells no coordinates.
_SINGULAR = 1e12


def _none() -> Floats:
    return np.zeros(0)


class ArmaNumbers(NamedTuple):
    """Coefficients of an ARMA model without their errors."""

    phi: Floats
    theta: Floats
    constant: float
    sigma2: float


@dataclass(frozen=True, eq=False)
class StateSpace:
    """A model x_(k+1) = F x_k + G a_(k+1) + d, z_k = H x_k + m + v_k.

    Every innovation acts on the sample of its own time, as in an ARMA model.

    Attributes
    ----------
    F : ndarray, shape (n, n)
        Transition of the state.
    G : ndarray, shape (n, u)
        What each of u white noises of variance `sigma2` does to the state.
    H : ndarray, shape (n,)
        What a sample shows of the state.
    sigma2 : float
        Variance of the innovations a.
    R : float
        Variance of the white measurement noise v.
    offset : float
        m, in the unit of the samples.
    constant : ndarray, shape (n,)
        d, added to the state at every step; default zero.
    start : ndarray, shape (n,)
        Mean of the state before the first sample; default zero.

    Raises
    ------
    ValueError
        If the shapes do not fit each other, or a variance is negative.

    Examples
    --------
    >>> from zerorate.identify import ArmaModel
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
    constant: Floats = field(default_factory=_none)
    start: Floats = field(default_factory=_none)

    def __post_init__(self) -> None:
        """Convert, check the shapes and fill in zeros."""
        n = len(self.F)
        shapes = {"F": (n, n), "G": (n, -1), "H": (n,), "constant": (n,), "start": (n,)}
        for name, shape in shapes.items():
            object.__setattr__(self, name, _array(name, getattr(self, name), shape))
        for name in ("sigma2", "R"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ValueError(f"{name} must be zero or positive, got {getattr(self, name)}")

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.F)

    @cached_property
    def constants(self) -> npt.NDArray[np.bool_]:
        """Which states never change, such as Fu and Han's c: shape (n,)."""
        still = np.all(np.eye(self.size) == self.F, axis=1) & ~np.any(self.G, axis=1)
        return np.asarray(still & (self.constant == 0.0))

    def covariance(self) -> Floats:
        """Return the stationary covariance P = F P F' + sigma2 G G' of the state, shape (n, n).

        Raises
        ------
        ValueError
            If a state that the noise moves is not stationary.
        """
        moving = np.ix_(~self.constants, ~self.constants)
        P = np.zeros((self.size, self.size))
        P[moving] = self.sigma2 * stationary_covariance(self.F[moving], self.G[~self.constants])
        return P

    def autocovariance(self, lags: int) -> Floats:
        """Return gamma_0 ... gamma_lags of the samples, shape (lags + 1,), R on lag 0.

        Raises
        ------
        ValueError
            If the model is not stationary, or `lags` negative.
        """
        if lags < 0:
            raise ValueError(f"lags must not be negative, got {lags}")
        gamma = self._seen(self.covariance() @ self.H, lags + 1)
        gamma[0] += self.R
        return gamma

    def impulse_response(self, n: int) -> Floats:
        """Return H F^k G for k below n, the first noise's effect: shape (n,).

        psi_0 ... psi_(n-1) of the ARMA model for a form with a single noise.
        """
        return self._seen(self.G[:, 0], n)

    def transfer(self, frequencies: npt.ArrayLike, rate: float) -> npt.NDArray[np.complex128]:
        """Return H (I - F e^(-i w))^-1 G, from the first noise to the samples.

        Parameters
        ----------
        frequencies : array_like
            In Hz, any shape.
        rate : float
            Samples a second.
        """
        delays = np.exp(-2j * np.pi * np.asarray(frequencies, dtype=np.float64) / rate)
        systems = np.eye(self.size) - delays[..., np.newaxis, np.newaxis] * self.F
        column = np.broadcast_to(self.G[:, :1].astype(np.complex128), (*delays.shape, self.size, 1))
        return np.asarray(np.linalg.solve(systems, column)[..., 0] @ self.H)

    def to_arma(self) -> ArmaNumbers:
        """Return phi, theta, constant and sigma2 of the samples, without common factors.

        phi is the characteristic polynomial of F, theta follows from it and the impulse response.
        Measurement noise, and more than one noise of the state, are first put into one innovation,
        that of the steady Kalman filter.

        Raises
        ------
        ValueError
            If that filter has no steady state.
        """
        one = self if self.R == 0.0 and self.G.shape[1] == 1 else self.innovations_form()
        return one._numbers()

    def to(self, form: "Form") -> "StateSpace":
        """Return the same drift, with the same R, in another form; see `ArmaModel.to_state_space`.

        Raises
        ------
        ValueError
            If the form is not known, or the state has more than one noise.
        """
        from zerorate.identify.state_space.forms import build

        if self.G.shape[1] != 1:
            raise ValueError(f"only a model of a single noise has forms, got {self.G.shape[1]}")
        return build(self._numbers(), form, self.R)

    def transformation(self, other: "StateSpace") -> Floats:
        """Return T with x' = T x, F' T = T F, G' = T G and H = H' T, shape (n, n).

        Raises
        ------
        ValueError
            If the models differ in size, are not observable, or are not the same model.
        """
        if self.size != other.size:
            raise ValueError(f"the models have {self.size} and {other.size} states")
        ours, theirs = self._observability(), other._observability()
        if np.linalg.cond(theirs) > _SINGULAR or np.linalg.cond(ours) > _SINGULAR:
            raise ValueError("a model with states that no sample shows has no such transformation")
        T = np.asarray(np.linalg.solve(theirs, ours))
        if not np.allclose(other.F @ T, T @ self.F, rtol=0.0, atol=1e-8 * float(np.abs(T).max())):
            raise ValueError("the two are not the same model in other coordinates")
        return T

    def innovations_form(self) -> "StateSpace":
        """Return the steady Kalman filter of this model as a model: one noise, no R.

        Its sigma2 is the variance of the filter's innovations.

        Raises
        ------
        ValueError
            If the filter has no steady state.
        """
        one = self._moving()
        gain, variance = steady_state(one.F, one.sigma2 * one.G @ one.G.T, one.H, one.R)
        # The sample, its prediction and its innovation, is one more state.
        F = np.block([[one.F, np.zeros((one.size, 1))], [one.H @ one.F, 0.0]])
        G = np.concatenate((gain, [1.0]))[:, np.newaxis]
        H = np.concatenate((np.zeros(one.size), [1.0]))
        d = np.concatenate((one.constant, [one.H @ one.constant]))
        return StateSpace(F, G, H, variance, 0.0, one.offset, d)

    def _seen(self, x: Floats, n: int) -> Floats:
        """Return H F^k x for k below n."""
        seen = np.empty(n)
        for k in range(n):
            seen[k] = self.H @ x
            x = self.F @ x
        return seen

    def _observability(self) -> Floats:
        rows = [self.H]
        for _ in range(self.size - 1):
            rows.append(rows[-1] @ self.F)
        return np.array(rows)

    def _numbers(self) -> ArmaNumbers:
        one = self._moving()
        auto = _characteristic(one.F)
        psi = one.impulse_response(len(auto))
        theta = ma_coefficients(-auto[1:], psi)
        # What a unit of drive adds up to in the numerator at B = 1.
        driven = np.convolve(auto, one._seen(one.constant, len(auto)))[: len(auto)]
        constant = one.offset * at_one(auto[1:]) + float(driven.sum())
        size = float(np.abs(auto).max()) * _ROUNDING
        phi, theta = trimmed(-auto[1:], size), trimmed(theta, size * float(np.abs(psi).max()))
        rest = at_one(-phi)
        phi, theta = cancelled(phi, theta)
        if rest:
            constant *= at_one(-phi) / rest
        return ArmaNumbers(phi, theta, float(constant), self.sigma2)

    def _moving(self) -> "StateSpace":
        """Return the same model with the states that never change in its constants."""
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
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}")
    return array


def _characteristic(F: Floats) -> Floats:
    """Return [1, c_1, ..., c_n] of det(I - F B), by the recursion of Faddeev and Le Verrier.

    In the wider type: it needs no eigenvalues, which repeated ones would blur.
    """
    n = len(F)
    wide, power = F.astype(np.longdouble), np.eye(n, dtype=np.longdouble)
    coefficients = np.ones(n + 1, dtype=np.longdouble)
    for k in range(1, n + 1):
        power = wide @ power
        coefficients[k] = -np.trace(power) / k
        power = power + coefficients[k] * np.eye(n, dtype=np.longdouble)
    return np.asarray(coefficients, dtype=np.float64)
