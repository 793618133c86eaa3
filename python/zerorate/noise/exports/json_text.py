"""Noise models as JSON, and back without loss."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from zerorate.noise.coefficient import Coefficient
from zerorate.noise.correlated import Markov, Sinusoid
from zerorate.noise.exports.text import joined, written
from zerorate.noise.quantities import TERMS, Quantity, term_of

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

__all__ = ["from_json", "to_json"]

_FORMAT: Final = "zerorate noise model"
_VERSION: Final = 1


def to_json(
    model: "NoiseModel", path: str | os.PathLike[str] | None = None, *, force: bool = False
) -> str:
    """Return the model as JSON, for `NoiseModel.from_json` and for any other program.

    Parameters
    ----------
    path : str or path, optional
        A file to write as well. Default: none.
    force : bool
        Whether to replace an existing file; default no.

    Returns
    -------
    str
        Every coefficient with value, standard error, identifiability, bound and unit, exact to
        the last bit.

    Raises
    ------
    OSError
        If the file exists (without `force`) or cannot be written. Nothing is left half-written.

    Examples
    --------
    >>> import json
    >>> from zerorate import NoiseModel
    >>> read = json.loads(NoiseModel(angle_random_walk=1e-4).to_json())
    >>> read["coefficients"]["angle_random_walk"]["value"]
    0.0001
    """
    quantity = model.quantity
    content = {
        "format": _FORMAT,
        "version": _VERSION,
        "quantity": quantity,
        "coefficients": {
            term.field: _encoded(getattr(model, term.field), term.unit) for term in TERMS[quantity]
        },
        "markov": [_all_encoded(term, _markov_units(quantity)) for term in model.markov],
        "sinusoid": [_all_encoded(term, _sinusoid_units(quantity)) for term in model.sinusoid],
    }
    return written(joined([json.dumps(content, indent=2, allow_nan=False)]), path, force)


def from_json(source: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the fields of the model that a text or a file holds."""
    is_text = isinstance(source, str) and source.lstrip().startswith("{")
    text = str(source) if is_text else Path(source).read_text(encoding="utf-8")
    try:
        return _fields(json.loads(text))
    except (KeyError, TypeError, ValueError) as error:
        # A key error's text is the key alone.
        reason = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        where = "the text" if is_text else os.fspath(source)
        raise ValueError(f"{where} is not a zerorate noise model in JSON: {reason}") from None


def _fields(content: dict[str, Any]) -> dict[str, Any]:
    found = (content["format"], content["version"])
    if found != (_FORMAT, _VERSION):
        raise ValueError(f"format and version are {found}, expected {(_FORMAT, _VERSION)}")
    quantity = content["quantity"]
    if quantity not in TERMS:
        raise ValueError(f"quantity is {quantity!r}, expected one of {', '.join(TERMS)}")
    fields: dict[str, Any] = {
        term.field: _decoded(content["coefficients"][term.field], term.unit)
        for term in TERMS[quantity]
    }
    for name, kind, units in (
        ("markov", Markov, _markov_units(quantity)),
        ("sinusoid", Sinusoid, _sinusoid_units(quantity)),
    ):
        fields[name] = tuple(kind(**_all_decoded(term, units)) for term in content[name])
    return fields | {"quantity": quantity}


def _markov_units(quantity: Quantity) -> dict[str, str]:
    return {"amplitude": term_of(quantity, "rate_random_walk").unit, "time": "s"}


def _sinusoid_units(quantity: Quantity) -> dict[str, str]:
    return {"amplitude": term_of(quantity, "bias_instability").unit, "frequency": "Hz"}


def _all_encoded(term: Markov | Sinusoid, units: dict[str, str]) -> dict[str, Any]:
    return {name: _encoded(getattr(term, name), unit) for name, unit in units.items()}


def _all_decoded(entry: dict[str, Any], units: dict[str, str]) -> dict[str, Any]:
    return {name: _decoded(entry[name], unit) for name, unit in units.items()}


def _encoded(coefficient: Coefficient, unit: str) -> dict[str, Any]:
    return {
        "value": coefficient.value,
        "sigma": coefficient.sigma,
        "identifiable": coefficient.identifiable,
        "upper_bound": coefficient.upper_bound,
        "unit": unit,
    }


def _decoded(entry: dict[str, Any], unit: str) -> Coefficient:
    if entry["unit"] != unit:
        raise ValueError(f"a unit is {entry['unit']!r}, expected {unit!r}")
    if not isinstance(entry["identifiable"], bool):
        raise ValueError(f"identifiable is {entry['identifiable']!r}, expected true or false")
    return Coefficient(entry["value"], entry["sigma"], entry["identifiable"], entry["upper_bound"])
