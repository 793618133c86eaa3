"""Models as JSON, and back without loss."""

import json
import math
import os
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zerorate.noise.exports import written

if TYPE_CHECKING:
    from zerorate.identify.models.model import ArmaModel

__all__ = ["from_json", "to_json"]

_FORMAT: Final = "zerorate ARMA model"
_VERSION: Final = 1


def to_json(
    model: "ArmaModel", path: str | os.PathLike[str] | None = None, *, force: bool = False
) -> str:
    """Return the model as JSON, for `ArmaModel.from_json` and for any other program.

    Parameters
    ----------
    path : str or path, optional
        A file to write as well. Default: none.
    force : bool
        Whether to replace an existing file; default no.

    Returns
    -------
    str
        Every field, exact to the last bit; "nan", "inf" and "-inf" as texts.

    Raises
    ------
    OSError
        If the file exists (without `force`) or cannot be written. Nothing is left half-written.

    Examples
    --------
    >>> import json
    >>> from zerorate.identify import ArmaModel
    >>> json.loads(ArmaModel.of([0.9], []).to_json())["phi"]
    [0.9]
    """
    content = {"format": _FORMAT, "version": _VERSION}
    content |= {field.name: _encoded(getattr(model, field.name)) for field in fields(model)}
    return written(json.dumps(content, indent=2, allow_nan=False) + "\n", path, force)


def from_json(source: str | os.PathLike[str], build: type["ArmaModel"]) -> "ArmaModel":
    """Return the model that a text or a file holds."""
    is_text = isinstance(source, str) and source.lstrip().startswith("{")
    try:
        text = str(source) if is_text else Path(source).read_text(encoding="utf-8")
        return build(**_fields(json.loads(text), build))
    except (TypeError, ValueError) as error:
        where = "the text" if is_text else os.fspath(source)
        raise ValueError(f"{where} is not a zerorate ARMA model in JSON: {error}") from None


def _fields(content: object, build: type["ArmaModel"]) -> dict[str, Any]:
    if not isinstance(content, dict):
        raise ValueError(f"expected an object, got {content!r:.40}")
    found = (content.get("format"), content.get("version"))
    if found != (_FORMAT, _VERSION):
        raise ValueError(f"format and version are {found}, expected {(_FORMAT, _VERSION)}")
    names = [field.name for field in fields(build)]
    missing = [name for name in names if name not in content]
    if missing:
        raise ValueError(f"{missing[0]!r} is missing")
    return {name: _decoded(name, content[name]) for name in names}


def _encoded(value: Any) -> Any:  # noqa: ANN401
    if isinstance(value, np.ndarray):
        return [_encoded(item) for item in value.tolist()]
    if isinstance(value, list | tuple):
        return [_encoded(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def _decoded(name: str, value: Any) -> Any:  # noqa: ANN401
    if name == "remarks":
        return tuple(value)
    if name in ("phi", "theta", "covariance"):
        return np.array(value, dtype=np.float64)
    return float(value) if value in ("nan", "inf", "-inf") else value
