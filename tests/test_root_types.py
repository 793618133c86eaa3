"""A type checker knows every name that docs use, and refuses all others."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import zerorate as zr

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").glob("*.py")]
KNOWN = re.compile('note: Revealed type is "(?!Any")')
WRONG = (
    "zr.NavigatonFilter()",
    "zr.navigation.Trak",
    "zr.noise.alan",
    "zr.whittle",
    "zr.allan([0.0], rat=1.0)",
    "zr.DriftFilter('fast')",
    "zr.read_log('a.csv').dat",
)


def told(folder, lines):
    """What mypy says of each line behind ``import zerorate as zr``."""
    (folder / "snippet.py").write_text("\n".join(["import zerorate as zr", *lines]) + "\n")
    source = Path(zr.__file__).parents[1]
    # An installed package has its types with it; mypy refuses a path that leads there.
    path = {} if source.name == "site-packages" else {"MYPYPATH": str(source)}
    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent"]
    command += ["--ignore-missing-imports", "--cache-dir", str(ROOT / ".mypy_cache"), "snippet.py"]
    done = subprocess.run(
        command, cwd=folder, env={**os.environ, **path}, capture_output=True, text=True
    )
    assert done.returncode in (0, 1), done.stderr
    found = dict.fromkeys(lines, "")
    for place, text in re.findall(r"^snippet\.py:(\d+): (.*)$", done.stdout, re.MULTILINE):
        found[lines[int(place) - 2]] += text
    return found


@pytest.fixture(scope="module")
def names():
    """Every name of the root, and every dotted one in README, docs and examples."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    found = re.findall(r"\bzr(?:\.[A-Za-z_]\w*)+", text)
    return sorted({*found, *(f"zr.{name}" for name in zr.__all__)})


def test_the_types_of_names_are_known(tmp_path, names):
    said = told(tmp_path, [f"reveal_type({name})" for name in names])
    unknown = {line: text for line, text in said.items() if not KNOWN.match(text)}
    assert unknown == {}


def test_other_names_are_refused(tmp_path):
    said = told(tmp_path, WRONG)
    assert [line for line, text in said.items() if "error: " not in text] == []
