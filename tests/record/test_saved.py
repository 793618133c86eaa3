"""Dataclasses read from JSON, each field checked by its annotation."""

import json
import math
from dataclasses import dataclass

import numpy as np
import pytest

from zerorate.record.saved import as_json, fields_of, from_fields
from zerorate.types import Floats


@dataclass(frozen=True, eq=False)
class Everything:
    flag: bool
    count: int
    size: float
    name: str
    axis: Floats
    rows: tuple[int, int]
    notes: tuple[str, ...]


WHOLE = Everything(True, 3, 0.1, "x", np.array([1.0, math.nan, -0.5]), (1, 4), ("a", "b"))


def test_a_dataclass_comes_back_whole():
    found = from_fields(json.loads(as_json(fields_of(WHOLE))), Everything)
    np.testing.assert_equal(fields_of(found), fields_of(WHOLE))
    unknown = from_fields({**json.loads(as_json(fields_of(WHOLE))), "size": None}, Everything)
    assert math.isnan(unknown.size)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("flag", 1, "true or false"),
        ("count", 1.5, "a whole number"),
        ("size", "1", "a number"),
        ("name", None, "a string"),
        ("axis", [1.0, 2.0], "three numbers"),
        ("rows", [1], "two whole numbers"),
        ("notes", "a", "a list"),
    ],
)
def test_another_kind_is_refused_by_name(name, value, told):
    content = {**json.loads(as_json(fields_of(WHOLE))), name: value}
    with pytest.raises(ValueError, match=f"'{name}' must .*{told}"):
        from_fields(content, Everything)
