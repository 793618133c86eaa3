"""Noise models as JSON, and back without loss."""

import dataclasses
import os
from typing import TYPE_CHECKING, Any, Final, TypeVar

from zerorate.noise.coefficient import NOTHING_KNOWN, Coefficient
from zerorate.noise.exports import written
from zerorate.noise.quantities import TERMS, Quantity, term_of
from zerorate.noise.terms import Markov, Sinusoid
from zerorate.record.exporting import exports
from zerorate.record.saved import as_json, check_format, part, restored

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

Model = TypeVar("Model", bound="NoiseModel")

_FORMAT: Final = "zerorate noise model"
_VERSION: Final = 1
_FIT: Final = {"method": str, "chi_squared": float, "degrees_of_freedom": int, "misfit": float}
"""What a `FittedModel` has beside the coefficients."""


@exports()
def to_json(
    model: "NoiseModel", path: str | os.PathLike[str] | None = None, *, force: bool = False
) -> str:
    """Return the model as JSON, for `NoiseModel.from_json` and for any other program.

    Returns
    -------
    str
        Every coefficient with value, standard error, identifiability, bound and unit, exact to
        the last bit, null where it is unknown; and how well a `FittedModel` fits.

    Examples
    --------
    >>> import json
    >>> from zerorate import NoiseModel
    >>> read = json.loads(NoiseModel(angle_random_walk=1e-4).to_json())
    >>> read["coefficients"]["angle_random_walk"]["value"]
    0.0001
    """
    quantity = model.quantity
    content: dict[str, Any] = {
        "format": _FORMAT,
        "version": _VERSION,
        "quantity": quantity,
        "coefficients": {
            term.field: _encoded(getattr(model, term.field), term.unit) for term in TERMS[quantity]
        },
        "markov": [_all_encoded(term, _markov_units(quantity)) for term in model.markov],
        "sinusoid": [_all_encoded(term, _sinusoid_units(quantity)) for term in model.sinusoid],
    }
    if model.doubt:
        content["doubt"] = model.doubt
    fit = {name: getattr(model, name) for name in _FIT if hasattr(model, name)}
    if fit:
        content["fit"] = fit
    return written(as_json(content), path, force)


def from_json(source: str | os.PathLike[str], build: type[Model]) -> Model:
    """Return the model that a text or a file holds, as one of a class."""
    return restored(
        source, _FORMAT, lambda content: build(**_fields(content), **_fit(content, build))
    )


def _fields(content: object) -> dict[str, Any]:
    check_format(content, _FORMAT, _VERSION)
    quantity = part(content, "quantity", str)
    if quantity not in TERMS:
        raise ValueError(f"quantity is {quantity!r}, expected one of {', '.join(TERMS)}")
    coefficients = part(content, "coefficients", dict)
    fields = {term.field: _decoded(coefficients, term.field, term.unit) for term in TERMS[quantity]}
    markov, sinusoid = (part(content, name, list) for name in ("markov", "sinusoid"))
    return fields | {
        "markov": [Markov(**_all_decoded(term, _markov_units(quantity))) for term in markov],
        "sinusoid": [
            Sinusoid(**_all_decoded(term, _sinusoid_units(quantity))) for term in sinusoid
        ],
        "quantity": quantity,
        "doubt": part(content, "doubt", str) if _has(content, "doubt") else "",
    }


def _has(content: object, key: str) -> bool:
    return isinstance(content, dict) and key in content


def _fit(content: object, build: type[Model]) -> dict[str, Any]:
    """Return how well a model fitted, where the text says so and the class keeps it."""
    fit = content.get("fit") if isinstance(content, dict) else None
    kept = {field.name for field in dataclasses.fields(build)}
    if fit is None:
        return {}
    return {name: part(fit, name, kind) for name, kind in _FIT.items() if name in kept}


def _markov_units(quantity: Quantity) -> dict[str, str]:
    return {"amplitude": term_of(quantity, "rate_random_walk").unit, "time": "s"}


def _sinusoid_units(quantity: Quantity) -> dict[str, str]:
    return {"amplitude": term_of(quantity, "bias_instability").unit, "frequency": "Hz"}


def _all_encoded(term: Markov | Sinusoid, units: dict[str, str]) -> dict[str, Any]:
    return {name: _encoded(getattr(term, name), unit) for name, unit in units.items()}


def _all_decoded(entry: object, units: dict[str, str]) -> dict[str, Any]:
    return {name: _decoded(entry, name, unit) for name, unit in units.items()}


def encoded(coefficient: Coefficient) -> dict[str, Any]:
    """Return the parts of a coefficient, None for the numbers of one that is unknown."""
    numbers = ("value", "sigma", "identifiable", "upper_bound")
    if not coefficient.known:
        return {**dict.fromkeys(numbers), "identifiable": False}
    return {name: getattr(coefficient, name) for name in numbers}


def _encoded(coefficient: Coefficient, unit: str) -> dict[str, Any]:
    return {**encoded(coefficient), "unit": unit}


def decoded(entry: object) -> Coefficient:
    """Return the coefficient of its parts; ValueError if one is not there."""
    parts = (("value", float), ("sigma", float), ("identifiable", bool), ("upper_bound", float))
    return Coefficient(*(part(entry, name, kind) for name, kind in parts))


def _decoded(content: object, name: str, unit: str) -> Coefficient:
    entry = part(content, name, dict)
    found = part(entry, "unit", str)
    if found != unit:
        raise ValueError(f"the unit of {name!r} is {found!r}, expected {unit!r}")
    if entry.get("value", 0.0) is None and entry.get("upper_bound", 0.0) is None:
        return NOTHING_KNOWN
    return decoded(entry)
