"""The page of changed names: what it says is new is there, what it says works does."""

import re
from functools import reduce
from pathlib import Path

import pytest

import zerorate as zr

PAGE = (Path(__file__).parents[2] / "docs/reference/from-0.1.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith("| ") and "---" not in line
]
DOTTED = re.compile(r"`z(?:r|erorate)\.([\w.]+)")


def reached(name):
    return reduce(getattr, name.split("."), zr)


NEW = sorted({name for row in ROWS if len(row) == 3 for name in DOTTED.findall(row[1])})
WORKS = sorted({n for row in ROWS if row[-1] == "works" for n in DOTTED.findall(row[0])})


@pytest.mark.parametrize("name", [*NEW, *WORKS])
def test_a_name_is_there(name):
    assert reached(name) is not None


def test_an_old_root_name_is_the_new_one():
    for name in WORKS:
        (new,) = [each for each in NEW if each.endswith(f".{name}")]
        assert reached(name) is reached(new)


def test_old_counts_are_gone():
    for kind, old, new in (
        (zr.WaveletDenoiser, "missing", "missing_count"),
        (zr.DriftFilter, "restarts", "restart_count"),
        (zr.NavigationFilter, "fixes", "fix_count"),
    ):
        assert not hasattr(kind, old)
        assert hasattr(kind, new)
