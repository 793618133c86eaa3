"""Each number of README's table "How good?" is printed by a script, to 1 %."""

import re
import sys
from pathlib import Path

import pytest

from support.recordings import RECORDINGS, needs_recordings

ROOT = Path(__file__).parents[2]
ROWS = ("drift", "hand", "calibration", "attitude", "array", "navigation", "speed")
NUMBER = re.compile(r"(?<![\w.√])\d+(?:\.\d+)?(?!\w)(?!\.\d)")


@pytest.fixture
def numbers(monkeypatch):
    """Return the script, which takes others from its folder."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    import readme_numbers

    yield readme_numbers
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None) or "").startswith(str(ROOT / "examples")):
            del sys.modules[name]


def rows():
    """Return the cells that hold what was measured, row by row."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    table = text.partition("## How good?")[2].partition("\n\n")[2].partition("\n\n")[0]
    return [line.split("|")[2:4] for line in table.splitlines()[2:]]


def test_every_number_has_a_tag(numbers):
    assert len(rows()) == len(ROWS)
    for row, name in zip(rows(), ROWS, strict=True):
        for cell in row:
            bare = numbers.TAGGED.sub("", cell)
            assert NUMBER.findall(bare) == [], cell
            assert {tag.partition(".")[0] for _, tag in numbers.TAGGED.findall(cell)} <= {name}


@needs_recordings
@pytest.mark.parametrize("row", [pytest.param("drift", marks=pytest.mark.slow), *ROWS[1:-1]])
def test_a_row_is_what_its_script_prints(numbers, row):
    written = {tag: said for tag, said in numbers.written().items() if tag.startswith(f"{row}.")}
    measured = numbers.ROWS[row](RECORDINGS)
    # vqf may not be installed.
    assert {tag for tag in written if "vqf" not in tag} <= set(measured) <= set(written)
    assert {
        tag: (written[tag], value)
        for tag, value in measured.items()
        if not numbers.agrees(written[tag], value)
    } == {}


@pytest.mark.parametrize(
    ("number", "measured", "same"),
    [
        ("1.07", 1.0738, True),
        ("1.07", 1.09, False),
        ("38", 38.3, True),
        ("38", 39.0, False),
        ("1.0", 1.04, True),
    ],
)
def test_what_agrees(numbers, number, measured, same):
    assert numbers.agrees(number, measured) is same
