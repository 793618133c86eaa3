"""JSON Schemas of the package's JSON files, one per format and version."""

import json
from importlib.resources import files
from typing import Any, Final

from zerorate.faults import ArgumentError

__all__ = ["FORMATS", "load_schema"]

FORMATS: Final = ("report", "check", "batch")
"""Formats with a schema: a report, checks, and the record of a batch for one log."""


def load_schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a format.

    Parameters
    ----------
    name : {"report", "check", "batch"}
        "report" is the report of `zerorate.report`. "check" is the result of `zerorate.check`.
        "batch" is the record that `zerorate.batch` writes next to each output.

    Returns
    -------
    dict
        The schema, for a validator such as ``jsonschema``.

    Raises
    ------
    ValueError
        If the format does not exist.

    Examples
    --------
    >>> import zerorate as zr
    >>> schema = zr.schemas.load_schema("report")
    >>> schema["properties"]["version"]
    {'const': 1}
    """
    if name not in FORMATS:
        raise ArgumentError("name", f"must be one of {', '.join(FORMATS)}, got {name!r}")
    text = files(__name__).joinpath(f"{name}.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema
