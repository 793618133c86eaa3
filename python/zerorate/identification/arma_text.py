"""Text of ARMA models: warnings and JSON."""

import math
import os
from collections.abc import Iterator
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate.identification.polynomials import inverse_roots
from zerorate.noise.exports import write_text
from zerorate.record.exporting import document_export
from zerorate.record.saved import as_json, check_format, restore
from zerorate.types import Floats

if TYPE_CHECKING:
    from zerorate.identification.arma_model import ArmaModel

# Condition number above which half of the digits of the normal equations are lost.
_MAX_CONDITION: Final = 1e8
# Difference of two equal numbers, in standard errors, that is not exceeded in 95 % of cases.
_SAME_SIGMAS: Final = 1.96


class UncertainRoot(NamedTuple):
    """Reciprocal root and its derivatives by each of [phi, theta, c]."""

    value: complex
    gradient: npt.NDArray[np.complex128]

    def sigma(self, covariance: Floats) -> float:
        """Return the standard error of the root's distance from the origin."""
        radial = np.real(self.gradient * np.conj(self.value)) / abs(self.value)
        return _sigma_along(radial, covariance)


def uncertain_ar_roots(model: "ArmaModel") -> list[UncertainRoot]:
    """Return the nonzero reciprocal roots of the autoregression."""
    return _differentiate_roots(-model.phi, 0, -1.0, len(model.covariance))


def uncertain_ma_roots(model: "ArmaModel") -> list[UncertainRoot]:
    """Return the nonzero reciprocal roots of the moving average."""
    return _differentiate_roots(model.theta, len(model.phi), 1.0, len(model.covariance))


def _differentiate_roots(
    coefficients: Floats, first: int, sign: float, size: int
) -> list[UncertainRoot]:
    """Differentiate y^n + c_1 y^(n-1) + ... + c_n = 0: dy/dc_i = -y^(n-i) / slope."""
    n = coefficients.size
    slope = np.polyder(np.concatenate(([1.0], coefficients)))
    roots = []
    for root in inverse_roots(coefficients):
        # A double root has slope zero. It changes like a square root, so it has no standard error.
        steepness = complex(np.polyval(slope, root))
        if root == 0.0 or steepness == 0.0:
            continue
        gradient = np.zeros(size, dtype=np.complex128)
        gradient[first : first + n] = -sign * root ** np.arange(n - 1, -1, -1) / steepness
        roots.append(UncertainRoot(complex(root), gradient))
    return roots


def undetermined_pairs(model: "ArmaModel") -> list[tuple[complex, complex]]:
    """Return the pairs of reciprocal AR and MA roots that may be a common factor."""
    pairs = ((ar, ma) for ar in uncertain_ar_roots(model) for ma in uncertain_ma_roots(model))
    return [(ar.value, ma.value) for ar, ma in pairs if _is_common_factor(ar, ma, model.covariance)]


def _is_common_factor(ar: UncertainRoot, ma: UncertainRoot, covariance: Floats) -> bool:
    if ar.value.imag < 0.0 or ma.value.imag < 0.0:
        return False
    sigma = _sigma_along(ar.gradient - ma.gradient, covariance)
    return sigma > 0.0 and abs(ar.value - ma.value) <= _SAME_SIGMAS * sigma


def _sigma_along(gradient: npt.NDArray[Any], covariance: Floats) -> float:
    """Return the standard deviation along a gradient; NaN if the covariance is infinite."""
    with np.errstate(invalid="ignore"):
        variance = float(np.real(np.conj(gradient) @ covariance @ gradient))
    return math.sqrt(max(variance, 0.0)) if math.isfinite(variance) else math.nan


def diagnosis(model: "ArmaModel") -> Iterator[str]:
    """Yield a sentence for each warning that applies.

    A NaN in the covariance gives no warning.
    """
    if not model.converged:
        yield "the search for the estimate did not converge"
    if model.condition > _MAX_CONDITION:
        yield (
            f"the normal equations have condition {model.condition:.1g}: the record hardly "
            f"separates the coefficients"
        )
    yield from _root_notes(model)
    for ar, ma in undetermined_pairs(model):
        yield (
            f"the AR root {_root_text(1.0 / ar)} and the MA root {_root_text(1.0 / ma)} are closer "
            "than their standard errors: the record does not determine this common factor"
        )


def _root_notes(model: "ArmaModel") -> Iterator[str]:
    if not model.stationary:
        yield "not stationary: an AR root lies on or inside the unit circle"
    elif any(_is_near_circle(root, model.covariance) for root in uncertain_ar_roots(model)):
        yield "an AR root is within two standard errors of the unit circle: the drift may be a walk"
    if not model.invertible:
        yield "not invertible: an MA root lies on or inside the unit circle"
    elif any(_is_near_circle(root, model.covariance) for root in uncertain_ma_roots(model)):
        yield "an MA root is within two standard errors of the unit circle"


def _is_near_circle(root: UncertainRoot, covariance: Floats) -> bool:
    return abs(1.0 - abs(root.value)) <= _SAME_SIGMAS * root.sigma(covariance)


def _root_text(root: complex) -> str:
    return f"{root:.5g}" if root.imag else f"{root.real:.5g}"


_FORMAT: Final = "zerorate ARMA model"
_VERSION: Final = 1


@document_export()
def to_json(
    model: "ArmaModel", path: str | os.PathLike[str] | None = None, *, force: bool = False
) -> str:
    """Return the model as JSON, for `ArmaModel.from_json` and for any other program.

    Returns
    -------
    str
        Text with all fields, without loss of digits. Numbers that are not finite are the strings
        "nan", "inf" and "-inf".

    Examples
    --------
    >>> import json
    >>> from zerorate.identification import ArmaModel
    >>> json.loads(ArmaModel.of([0.9], []).to_json())["phi"]
    [0.9]
    """
    content = {"format": _FORMAT, "version": _VERSION}
    content |= {field.name: _encode(getattr(model, field.name)) for field in fields(model)}
    return write_text(as_json(content), path, force)


def from_json(source: str | os.PathLike[str], build: type["ArmaModel"]) -> "ArmaModel":
    """Return the model from a text or a file."""
    return restore(source, _FORMAT, lambda content: build(**_read_fields(content, build)))


def _read_fields(content: Any, build: type["ArmaModel"]) -> dict[str, Any]:  # noqa: ANN401
    check_format(content, _FORMAT, _VERSION)
    names = [field.name for field in fields(build)]
    missing = [name for name in names if name not in content]
    if missing:
        raise ValueError(f"{missing[0]!r} is missing")
    return {name: _decode(name, content[name]) for name in names}


def _encode(value: Any) -> Any:  # noqa: ANN401
    if isinstance(value, np.ndarray):
        return [_encode(item) for item in value.tolist()]
    if isinstance(value, list | tuple):
        return [_encode(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def _decode(name: str, value: Any) -> Any:  # noqa: ANN401
    if name == "remarks":
        return tuple(value)
    if name in ("phi", "theta", "covariance"):
        return np.array(value, dtype=np.float64)
    return float(value) if value in ("nan", "inf", "-inf") else value
