"""Results saved as JSON: read from a text or a file, and their parts checked one by one."""

import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

from zerorate.types import Floats

__all__ = ["check_format", "checked", "finite_numbers", "part", "restored"]

Built = TypeVar("Built")

_NAMES: Final = {
    bool: "true or false",
    dict: "an object",
    float: "a number",
    int: "a whole number",
    list: "a list",
    str: "a string",
}


def restored(source: str | os.PathLike[str], what: str, build: Callable[[object], Built]) -> Built:
    """Return what is built of the content of a JSON text, which begins with a brace, or of a file.

    A fault of the text or of what it holds is a ValueError in one sentence, which names the file
    and `what` was expected.
    """
    is_text = isinstance(source, str) and source.lstrip().startswith("{")
    try:
        text = str(source) if is_text else Path(source).read_text(encoding="utf-8")
        return build(json.loads(text))
    except (TypeError, ValueError) as error:
        reason = str(error)
    except RecursionError:
        reason = "it is nested too deep"
    where = "the text" if is_text else os.fspath(source)
    raise ValueError(f"{where} is not a {what} in JSON: {reason}")


def check_format(content: object, name: str, version: int, mend: str = "") -> None:
    """Raise ValueError unless a content names this format and this version of it.

    `mend` says what helps with another version.
    """
    found = part(content, "format", str), part(content, "version", int)
    if found[0] != name:
        raise ValueError(f"its format is {found[0]!r}, expected {name!r}")
    if found[1] != version:
        helps = f": {mend}" if mend else ""
        raise ValueError(
            f"it is of version {found[1]}, and this zerorate reads version {version}{helps}"
        )


def part(content: object, key: str, kind: type) -> Any:  # noqa: ANN401
    """Return what stands under a key, of a type; ValueError if it is another, or not there."""
    return checked(key, content.get(key) if isinstance(content, dict) else None, kind)


def checked(key: str, found: object, kind: type) -> Any:  # noqa: ANN401
    """Return what was found under a key, if it is of a type."""
    # JSON may write a whole number without a point, and true is a number to Python alone.
    of_kind = isinstance(found, (int, float) if kind is float else kind)
    if not of_kind or (isinstance(found, bool) and kind is not bool):
        raise ValueError(f"{key!r} must be {_NAMES[kind]}, got {found!r:.60}")
    if isinstance(found, float) and not math.isfinite(found):
        raise ValueError(f"{key!r} must be finite, got {found}")
    return found


def finite_numbers(key: str, listed: object, shape: tuple[int, ...]) -> Floats:
    """Return a nested list as an array of this shape; ValueError if it is another."""
    try:
        found = np.array(listed, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != shape or not np.isfinite(found).all():
        raise ValueError(f"{key!r} must hold finite numbers of shape {shape}")
    return found
