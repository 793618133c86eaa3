"""The gallery has every result that has a figure, and shows only commands that there are."""

import re
from pathlib import Path

import pytest

from zerorate.cli.app import taker_of
from zerorate.show.registry import VIEWS

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "reference/gallery.md").read_text(encoding="utf-8")
PAGES = [page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md")]


# Drawn as one of the parts that they consist of.
AS_A_PART = {"Compared", "Identified", "Summary"}


def test_every_result_is_drawn_once():
    drawn = re.findall(r"^```\{drawn\} (\w+)$", PAGE, re.MULTILINE)
    results = {name.rpartition(".")[2] for name in VIEWS}
    assert sorted(drawn) == sorted(results - AS_A_PART)


def test_its_commands_have_these_options():
    lines = re.findall(r"^(?::command: )?zerorate (\w+)(.*)$", PAGE, re.MULTILINE)
    assert len(lines) > 10
    for name, rest in lines:
        known = {flag for option in taker_of(name).options() for flag in option.all_flags}
        assert set(re.findall(r"--[a-z-]+", rest)) <= known, name


@pytest.mark.parametrize("name", sorted(path.stem for path in (DOCS / "figures").glob("*.png")))
def test_every_figure_is_on_a_page_and_has_its_script(name):
    assert any(f"figures/{name}.png" in text for text in PAGES)
    (row,) = (line for line in PAGE.splitlines() if f"[`{name}`]" in line)
    script = DOCS.parent / re.search(r"`python (examples/\w+\.py)`", row)[1]
    text = script.read_text(encoding="utf-8")
    assert name in text or re.search(rf"{name.partition('_')[0]}_\{{name\}}\.png", text)
