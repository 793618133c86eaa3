"""The five-term polynomial fit of the literature, for comparison with the others."""

from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.noise.coefficient import Coefficient
from zerorate.noise.fit import FittedModel
from zerorate.noise.model import NoiseModel
from zerorate.noise.quantities import Quantity

__all__ = ["polynomial_fit"]

Floats = npt.NDArray[np.float64]

_POWERS: Final = {
    "quantization": -2,
    "angle_random_walk": -1,
    "bias_instability": 0,
    "rate_random_walk": 1,
    "rate_ramp": 2,
}
_LEAST: Final = len(_POWERS) + 1


def polynomial_fit(taus: Floats, deviation: Floats, unit: tuple[float, Quantity]) -> FittedModel:
    """Fit sigma^2 = sum of A_n tau^n, n = -2 to 2, by least squares of relative errors.

    Every averaging time weighs the same and is taken as independent of the others, so what is said
    of errors is too small, and a term without evidence may well come out large: that is how the
    method is, and why it is not the default. A negative coefficient is not identifiable.

    Parameters
    ----------
    taus, deviation : ndarray, shape (t,)
        A curve of the Allan family.
    unit : tuple
        Unit of the deviation in SI, and what it measures.
    """
    if taus.size < _LEAST:
        raise ValueError(f"the polynomial fit needs {_LEAST} averaging times, has {taus.size}")
    variance = deviation**2
    basis = taus[:, None] ** np.array(list(_POWERS.values())) / variance[:, None]
    lengths = np.linalg.norm(basis, axis=0)
    scaled, left, _, _ = np.linalg.lstsq(basis / lengths, np.ones(taus.size), rcond=None)
    residual = float(left[0]) if left.size else 0.0
    freedom = taus.size - len(_POWERS)
    spread = np.sqrt(np.diag(np.linalg.pinv((basis / lengths).T @ (basis / lengths))))
    sigmas = spread * np.sqrt(residual / freedom) / lengths
    coefficients = {
        name: _coefficient(name, a, sigma).scaled(unit[0])
        for name, a, sigma in zip(_POWERS, scaled / lengths, sigmas, strict=True)
    }
    return FittedModel(
        **coefficients,  # type: ignore[arg-type]
        quantity=unit[1],
        method="polynomial",
        chi_squared=residual,
        degrees_of_freedom=freedom,
        misfit=float(np.sqrt(residual / freedom)),
    )


def _coefficient(name: str, a: float, sigma: float) -> Coefficient:
    model = NoiseModel(**{name: 1.0})  # type: ignore[arg-type]
    unit = float(model.allan_deviation(1.0)) ** 2
    bound = float(np.sqrt(max(a, 0.0) + 1.645 * sigma) / np.sqrt(unit))
    if not a > 0.0:
        return Coefficient(0.0, bound / 1.645, False, bound)
    value = float(np.sqrt(a / unit))
    return Coefficient(value, float(value * sigma / (2.0 * a)), bool(a > 2.0 * sigma), bound)
