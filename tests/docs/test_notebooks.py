"""The notebooks run from top to bottom, each in one namespace, as Jupytext opens them."""

import re
from pathlib import Path

import pytest
import yaml

FOLDER = Path(__file__).parents[2] / "docs/notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.md"))
CELL = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_there_are_those_that_the_index_names():
    index = (FOLDER.parent / "index.md").read_text(encoding="utf-8")
    assert {f"notebooks/{path.stem}" for path in NOTEBOOKS} == set(
        re.findall(r"^notebooks/[\w-]+$", index, re.MULTILINE)
    )


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = path.read_text(encoding="utf-8")
    head = yaml.safe_load(text.split("---")[1])
    assert head["jupytext"]["text_representation"]["format_name"] == "markdown"
    names = {"__name__": "__main__"}
    cells = CELL.findall(text)
    assert len(cells) > 2
    for number, cell in enumerate(cells):
        exec(compile(cell, f"{path.stem}, cell {number}", "exec"), names)
