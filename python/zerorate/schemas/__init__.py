"""JSON Schemas of the package's JSON files, one per format and version."""

import json
from importlib.resources import files
from typing import Any, Final

from zerorate.faults import ArgumentError

__all__ = ["FORMATS", "load_schema"]

FORMATS: Final = ("report", "check", "batch", "models", "samples")
"""Formats with a schema: a report, checks, the record of a batch for one log, noise models, and
the samples of an attitude or a track."""


def load_schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a format.

    Parameters
    ----------
    name : {"report", "check", "batch", "models", "samples"}
        Name of the format:

        - "report": the report of `zerorate.report`
        - "check": the result of `zerorate.check`
        - "batch": the record that `zerorate.batch` writes next to each output
        - "models": the noise models of ``zerorate allan --export json``
        - "samples": the answers of the tools attitude and navigate of ``zerorate mcp``

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
