"""State-space forms of an ARMA model, by name."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
import numpy.typing as npt

from zerorate.identify.models.polynomials import at_one, psi_weights
from zerorate.identify.state_space.system import ArmaNumbers, StateSpace

if TYPE_CHECKING:
    from zerorate.identify.models.model import ArmaModel

__all__ = ["Form", "build", "of_model"]

Floats = npt.NDArray[np.float64]
Form = Literal["fu-han", "fu-han-literal", "harvey", "controllable", "observable"]


def of_model(
    model: "ArmaModel", form: Form = "harvey", measurement_noise: float = 0.0
) -> StateSpace:
    """Return the model as x_(k+1) = F x_k + G a_(k+1), z_k = H x_k.

    Parameters
    ----------
    form : str
        With r = max(p, q + 1) states, minimal where phi and theta have no common root:

        - "harvey" (default): companion of phi by columns, G = [1, theta], H = [1, 0, ...]
          (Harvey, "Forecasting, Structural Time Series Models and the Kalman Filter", 1989).
        - "controllable": companion by rows, G = [1, 0, ...], H = [1, theta].
        - "observable": the state is [z_k and the predictions of the next samples], G = psi
          weights, H = [1, 0, ...] (Akaike, Annals of the Institute of Statistical Mathematics
          26, 1974); its observability matrix is the identity.

        In the state of Fu & Han (2019), Table 3, [y_k ... y_(k-p+1), c]:

        - "fu-han": with a_k ... a_(k-q+1) carried along between y and c, which is exact.
        - "fu-han-literal": with the noise [a_k, a_(k-1), ...] through B = [1, theta] as if it were
          white. It is not: a_(k-1) is in two successive noises. The samples are those of an
          AR(p) of innovation variance sigma2 (1 + sum theta^2), which has none of the MA part's
          correlation: for Table 3's ARMA(2, 1) with phi_1 = 1.0202 and theta_1 = -0.9955 a
          variance 140 times too large.
    measurement_noise : float
        Variance R of white noise on the samples, in the squared unit of the record. Default: 0.

    Raises
    ------
    ValueError
        If the form is not known, or R negative.

    Examples
    --------
    >>> from zerorate.identify import ArmaModel
    >>> ArmaModel.of([1.2, -0.3], [0.5]).to_state_space("fu-han").F.tolist()[0]
    [1.2, -0.3, 0.5, 1.0]
    """
    numbers = ArmaNumbers(model.phi, model.theta, model.constant, model.sigma2)
    return build(numbers, form, measurement_noise)


def build(numbers: ArmaNumbers, form: Form, R: float) -> StateSpace:
    """Return a model in a form by its name."""
    if form not in _FORMS:
        known = ", ".join(repr(name) for name in _FORMS)
        raise ValueError(f"form must be one of {known}, got {form!r}")
    return _FORMS[form](numbers, R)


def _padded(numbers: ArmaNumbers) -> tuple[Floats, Floats]:
    """Return phi and [1, theta], both of r elements."""
    r = max(numbers.phi.size, numbers.theta.size + 1)
    phi, moving = np.zeros(r), np.zeros(r)
    phi[: numbers.phi.size] = numbers.phi
    moving[: numbers.theta.size + 1] = [1.0, *numbers.theta]
    return phi, moving


def _assembled(numbers: ArmaNumbers, F: Floats, G: Floats, H: Floats, R: float) -> StateSpace:
    """Return a minimal form; a constant is an offset where there is a mean, else a drive."""
    rest = at_one(-numbers.phi)
    if rest:
        offset = numbers.constant / rest
        return StateSpace(F, G[:, np.newaxis], H, numbers.sigma2, R, offset)
    return StateSpace(F, G[:, np.newaxis], H, numbers.sigma2, R, 0.0, G * _push(numbers))


def _push(numbers: ArmaNumbers) -> float:
    """Return the constant innovation that acts like c."""
    gain = at_one(numbers.theta)
    if not numbers.constant:
        return 0.0
    if not gain:
        raise ValueError("phi and theta share a unit root: their constant has no such form")
    return numbers.constant / gain


def _harvey(numbers: ArmaNumbers, R: float) -> StateSpace:
    phi, moving = _padded(numbers)
    F = np.eye(phi.size, k=1)
    F[:, 0] = phi
    return _assembled(numbers, F, moving, np.eye(phi.size)[0], R)


def _controllable(numbers: ArmaNumbers, R: float) -> StateSpace:
    phi, moving = _padded(numbers)
    F = np.eye(phi.size, k=-1)
    F[0] = phi
    return _assembled(numbers, F, np.eye(phi.size)[0], moving, R)


def _observable(numbers: ArmaNumbers, R: float) -> StateSpace:
    phi, _ = _padded(numbers)
    F = np.eye(phi.size, k=1)
    F[-1] = phi[::-1]
    psi = psi_weights(numbers.phi, numbers.theta, phi.size)
    return _assembled(numbers, F, psi, np.eye(phi.size)[0], R)


def _fu_han(numbers: ArmaNumbers, R: float) -> StateSpace:
    """State [y_k ... y_(k-p+1), a_k ... a_(k-q+1), c]."""
    p, q = max(numbers.phi.size, 1), numbers.theta.size
    F = _companion(numbers, p, q)
    F[0, p : p + q] = numbers.theta
    G = np.zeros((p + q + 1, 1))
    G[0] = 1.0
    if q:
        G[p] = 1.0
    return _with_constant(numbers, F, G, p, R)


def _fu_han_literal(numbers: ArmaNumbers, R: float) -> StateSpace:
    """State [y_k ... y_(k-p+1), c], noise [a_k ... a_(k-q)]."""
    p, q = max(numbers.phi.size, 1), numbers.theta.size
    B = np.zeros((p + 1, q + 1))
    B[0] = [1.0, *numbers.theta]
    return _with_constant(numbers, _companion(numbers, p, 0), B, p, R)


def _companion(numbers: ArmaNumbers, p: int, q: int) -> Floats:
    """Return the transition of p samples, q innovations and the constant, without theta."""
    F = np.eye(p + q + 1, k=-1)
    F[p, p - 1] = 0.0
    F[-1] = np.eye(p + q + 1)[-1]
    F[0, : numbers.phi.size] = numbers.phi
    F[0, -1] = 1.0
    return F


def _with_constant(numbers: ArmaNumbers, F: Floats, G: Floats, p: int, R: float) -> StateSpace:
    """Return a model whose last state is c, from its mean where it has one, else from zero."""
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
