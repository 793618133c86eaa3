"""Lossless JSON of noise models."""

import dataclasses
import math
import os
from typing import TYPE_CHECKING, Any, Final, TypeVar

from zerorate.noise.coefficient import UNKNOWN_COEFFICIENT, Coefficient
from zerorate.noise.exports import write_text
from zerorate.noise.low_pass import LowPass
from zerorate.noise.quantities import TERMS, Quantity, term_of
from zerorate.noise.terms import Markov, Sinusoid
from zerorate.record.exporting import document_export
from zerorate.record.saved import as_json, check_format, parse_key, restore

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

Model = TypeVar("Model", bound="NoiseModel")

_FORMAT: Final = "zerorate noise model"
_VERSION: Final = 1
_FIT_FIELDS: Final = {
    "method": str,
    "chi_squared": float,
    "degrees_of_freedom": int,
    "misfit": float,
}
"""Fields of a `FittedModel` in addition to the coefficients."""


@document_export()
def to_json(
    model: "NoiseModel", path: str | os.PathLike[str] | None = None, *, force: bool = False
) -> str:
    """Return the model as JSON, for `NoiseModel.from_json` and for any other program.

    Returns
    -------
    str
        Text with value, standard error, identifiability, bound and unit of each coefficient. No
        digit is lost, and unknown numbers are null. A `FittedModel` adds the quality of its fit.

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
            term.field: _encode_with_unit(getattr(model, term.field), term.unit)
            for term in TERMS[quantity]
        },
        "markov": [_encode_term(term, _markov_units(quantity)) for term in model.markov],
        "sinusoid": [_encode_term(term, _sinusoid_units(quantity)) for term in model.sinusoid],
    }
    if model.doubt:
        content["doubt"] = model.doubt
    if model.low_pass is not None:
        order = model.low_pass.order
        content["low_pass"] = {
            "corner": _encode_with_unit(model.low_pass.corner, "Hz"),
            "order": order if math.isfinite(order) else str(order),
        }
    if model.up_to is not None:
        content["up_to"] = model.up_to
    if model.band:
        content["band"] = model.band
    fit = {name: getattr(model, name) for name in _FIT_FIELDS if hasattr(model, name)}
    if fit:
        content["fit"] = fit
    return write_text(as_json(content), path, force)


def from_json(source: str | os.PathLike[str], build: type[Model]) -> Model:
    """Return the model from a text or a file, as an instance of a class."""
    return restore(
        source, _FORMAT, lambda content: build(**_read_fields(content), **_read_fit(content, build))
    )


def _read_fields(content: object) -> dict[str, Any]:
    check_format(content, _FORMAT, _VERSION)
    quantity = parse_key(content, "quantity", str)
    if quantity not in TERMS:
        raise ValueError(f"quantity is {quantity!r}, expected one of {', '.join(TERMS)}")
    coefficients = parse_key(content, "coefficients", dict)
    fields = {
        term.field: _decode_with_unit(coefficients, term.field, term.unit)
        for term in TERMS[quantity]
    }
    markov, sinusoid = (parse_key(content, name, list) for name in ("markov", "sinusoid"))
    return fields | {
        "markov": [Markov(**_decode_term(term, _markov_units(quantity))) for term in markov],
        "sinusoid": [
            Sinusoid(**_decode_term(term, _sinusoid_units(quantity))) for term in sinusoid
        ],
        "quantity": quantity,
        "doubt": parse_key(content, "doubt", str) if _has_key(content, "doubt") else "",
        "low_pass": _parse_low_pass(content),
        "up_to": parse_key(content, "up_to", float) if _has_key(content, "up_to") else None,
    }


def _parse_low_pass(content: object) -> LowPass | None:
    if not _has_key(content, "low_pass"):
        return None
    entry = parse_key(content, "low_pass", dict)
    # A moving average has an infinite order, which JSON cannot represent.
    order = float(entry["order"]) if isinstance(entry.get("order"), str) else None
    return LowPass(
        _decode_with_unit(entry, "corner", "Hz"),
        parse_key(entry, "order", float) if order is None else order,
    )


def _has_key(content: object, key: str) -> bool:
    return isinstance(content, dict) and key in content


def _read_fit(content: object, build: type[Model]) -> dict[str, Any]:
    """Return the quality of a fit, if the text has it and the class has these fields."""
    fit = content.get("fit") if isinstance(content, dict) else None
    field_names = {field.name for field in dataclasses.fields(build)}
    if fit is None:
        return {}
    return {
        name: parse_key(fit, name, kind)
        for name, kind in _FIT_FIELDS.items()
        if name in field_names
    }


def _markov_units(quantity: Quantity) -> dict[str, str]:
    return {"amplitude": term_of(quantity, "rate_random_walk").unit, "time": "s"}


def _sinusoid_units(quantity: Quantity) -> dict[str, str]:
    return {"amplitude": term_of(quantity, "bias_instability").unit, "frequency": "Hz"}


def _encode_term(term: Markov | Sinusoid, units: dict[str, str]) -> dict[str, Any]:
    return {name: _encode_with_unit(getattr(term, name), unit) for name, unit in units.items()}


def _decode_term(entry: object, units: dict[str, str]) -> dict[str, Any]:
    return {name: _decode_with_unit(entry, name, unit) for name, unit in units.items()}


def encode_coefficient(coefficient: Coefficient) -> dict[str, Any]:
    """Return the fields of a coefficient, with None in place of unknown numbers."""
    numbers = ("value", "sigma", "identifiable", "upper_bound")
    if not coefficient.known:
        return {**dict.fromkeys(numbers), "identifiable": False}
    return {name: getattr(coefficient, name) for name in numbers}


def _encode_with_unit(coefficient: Coefficient, unit: str) -> dict[str, Any]:
    return {**encode_coefficient(coefficient), "unit": unit}


def decode_coefficient(entry: object) -> Coefficient:
    """Return the coefficient from its fields; ValueError if a field is missing."""
    parts = (("value", float), ("sigma", float), ("identifiable", bool), ("upper_bound", float))
    return Coefficient(*(parse_key(entry, name, kind) for name, kind in parts))


def _decode_with_unit(content: object, name: str, unit: str) -> Coefficient:
    entry = parse_key(content, name, dict)
    stored_unit = parse_key(entry, "unit", str)
    if stored_unit != unit:
        raise ValueError(f"the unit of {name!r} is {stored_unit!r}, expected {unit!r}")
    if entry.get("value", 0.0) is None and entry.get("upper_bound", 0.0) is None:
        return UNKNOWN_COEFFICIENT
    return decode_coefficient(entry)
