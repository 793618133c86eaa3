"""Results saved as strict JSON: writing, reading, and checks of each part."""

import json
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial
from typing import Any, Final, TypeVar, get_type_hints

import numpy as np

from zerorate.record.regular import read_regular_text
from zerorate.types import Floats

Built = TypeVar("Built")

_TYPE_NAMES: Final = {
    bool: "true or false",
    dict: "an object",
    float: "a number",
    int: "a whole number",
    list: "a list",
    str: "a string",
}


def as_json(content: dict[str, Any], indent: int | None = 2) -> str:
    """Return an object as strict JSON, exact to the last bit, with null for non-finite numbers.

    Without `indent`, each element below the second level is on one line.
    """
    plain_content = to_jsonable(content)
    if indent is not None:
        return json.dumps(plain_content, indent=indent, allow_nan=False) + "\n"
    parts = (f"{json.dumps(key)}: {_lines(value)}" for key, value in plain_content.items())
    return "{\n  " + ",\n  ".join(parts) + "\n}\n"


def _lines(value: Any) -> str:  # noqa: ANN401
    if isinstance(value, list) and value:
        return "[\n    " + ",\n    ".join(map(json.dumps, value)) + "\n  ]"
    if isinstance(value, dict) and value:
        listed = (f"{json.dumps(key)}: {json.dumps(item)}" for key, item in value.items())
        return "{\n    " + ",\n    ".join(listed) + "\n  }"
    return json.dumps(value)


def to_jsonable(value: Any) -> Any:  # noqa: ANN401
    """Return a value with lists for arrays and None for non-finite numbers."""
    if isinstance(value, dict):
        return {key: to_jsonable(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return to_jsonable(value.tolist())
    if isinstance(value, list | tuple):
        return [to_jsonable(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def fields_of(instance: Any) -> dict[str, Any]:  # noqa: ANN401
    """Return the fields of a dataclass by name."""
    return {field.name: getattr(instance, field.name) for field in fields(instance)}


def restore(source: str | os.PathLike[str], what: str, build: Callable[[object], Built]) -> Built:
    """Return the object built from a file, or from a JSON text (it begins with a brace).

    Errors in the text or its content become a ValueError with one sentence. It names the file and
    the expected object (`what`).
    """
    is_text = isinstance(source, str) and source.lstrip().startswith("{")
    try:
        text = str(source) if is_text else read_regular_text(source)
        return build(json.loads(text))
    except (TypeError, ValueError) as error:
        reason = str(error)
    except RecursionError:
        reason = "it is nested too deep"
    where = "the text" if is_text else os.fspath(source)
    raise ValueError(f"{where} is not a {what} in JSON: {reason}")


def check_format(content: object, name: str, version: int, remedy: str = "") -> None:
    """Raise ValueError if a content has another format name or version.

    `remedy` is advice for a content with another version.
    """
    stated = parse_key(content, "format", str), parse_key(content, "version", int)
    if stated[0] != name:
        raise ValueError(f"its format is {stated[0]!r}, expected {name!r}")
    if stated[1] != version:
        advice = f": {remedy}" if remedy else ""
        raise ValueError(
            f"it is of version {stated[1]}, and this zerorate reads version {version}{advice}"
        )


def parse_key(content: object, key: str, kind: type) -> Any:  # noqa: ANN401
    """Return the value of a key; ValueError if it is missing or has another type."""
    return check_type(key, content.get(key) if isinstance(content, dict) else None, kind)


def check_type(key: str, value: object, kind: type) -> Any:  # noqa: ANN401
    """Return the value of a key; ValueError if it has another type."""
    # JSON may write a float as an integer; and Python counts true as a number.
    of_kind = isinstance(value, (int, float) if kind is float else kind)
    if not of_kind or (isinstance(value, bool) and kind is not bool):
        raise ValueError(f"{key!r} must be {_TYPE_NAMES[kind]}, got {value!r:.60}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{key!r} must be finite, got {value}")
    return value


def finite_numbers(key: str, values: object, shape: tuple[int, ...]) -> Floats:
    """Return a nested list of finite numbers as an array; ValueError if its shape differs."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{key!r} must hold finite numbers of shape {shape}")
    return array


def is_null(content: object, key: str) -> bool:
    """Return True if the value of a key is null."""
    return isinstance(content, dict) and key in content and content[key] is None


def parse_number(content: object, key: str) -> float:
    """Return the number of a key, NaN for null."""
    return math.nan if is_null(content, key) else float(parse_key(content, key, float))


def parse_sentences(content: object, key: str) -> tuple[str, ...]:
    """Return the list of strings of a key."""
    return tuple(str(check_type(key, item, str)) for item in parse_key(content, key, list))


def from_fields(content: object, build: type[Built]) -> Built:
    """Return a dataclass from the fields of an object, each checked by its annotation."""
    hints = get_type_hints(build).items()
    return build(**{name: _READERS[kind](content, name) for name, kind in hints})


def _read_vector(content: object, key: str) -> Floats:
    listed = parse_key(content, key, list)
    if len(listed) != 3:
        raise ValueError(f"{key!r} must have three numbers, got {listed!r}")
    return np.array([np.nan if item is None else check_type(key, item, float) for item in listed])


def _read_pair(content: object, key: str) -> tuple[int, int]:
    listed = parse_key(content, key, list)
    if len(listed) != 2:
        raise ValueError(f"{key!r} must be two whole numbers, got {listed!r}")
    first, second = (int(check_type(key, item, int)) for item in listed)
    return first, second


_READERS: Final[Mapping[Any, Callable[[object, str], Any]]] = {
    **{kind: partial(parse_key, kind=kind) for kind in (bool, int, str)},
    float: parse_number,
    Floats: _read_vector,
    tuple[int, int]: _read_pair,
    tuple[str, ...]: parse_sentences,
}
