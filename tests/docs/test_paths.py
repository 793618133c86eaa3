"""Paths that prose names are there: of the repository, of the package, or next to their page."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")),
    *(path for path in (ROOT / "docs").rglob("*.md") if path.parent.name not in ("api", "gallery")),
]
FENCED = re.compile(r"^(`{3,}|~{3,}).*?^\1", re.MULTILINE | re.DOTALL)
IN_LINE = re.compile(r"`([^`\n]+)`")
SOURCE = re.compile(r"(?:[\w.-]+/)*[\w-]+\.(?:py|pyi|rs|toml|hpp|sh)")
FOLDER = re.compile(r"(?:tests|benches|examples|rust|docs|\.ci|python)(?:/[\w.-]+)+/?")
FOLDERS = (
    "", "docs", "python/zerorate", "rust", "rust/core/src", "rust/core/tests/core", "rust/py/src",
    "tests", "rust/c", "rust/board",
)  # fmt: skip
ELSEWHERE = {"analysis.py", "my_filter.py"}
"""Files of other projects, and those that a page lets its reader write."""


def named(text):
    """Yield the paths of sources that inline code of a page names."""
    for code in IN_LINE.findall(FENCED.sub("", text)):
        for word in code.split():
            word = word.rstrip(",;:").partition("::")[0]
            if SOURCE.fullmatch(word) or FOLDER.fullmatch(word):
                yield word


def is_there(path, page):
    """Return True for a file of the repository, under one of its folders, or of that name."""
    places = [*(ROOT / folder for folder in FOLDERS), page.parent]
    if any((place / path).exists() for place in places):
        return True
    # A name alone, or with its folder, stands for the one file that ends so.
    return any(
        one.as_posix().endswith(f"/{path}")
        for top in ("tests", "python", "rust", "examples", "benches", ".ci")
        for one in (ROOT / top).rglob(Path(path).name)
    )


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_paths_of_sources_are_there(page):
    paths = set(named(page.read_text(encoding="utf-8"))) - ELSEWHERE
    assert [path for path in sorted(paths) if not is_there(path, page)] == []


def test_a_path_that_is_not_there_is_seen():
    text = "`tests/fuzz/test_nothing.py`, `pytest tests/nowhere`\n```sh\na/b.py\n```"
    paths = list(named(text))
    assert paths == ["tests/fuzz/test_nothing.py", "tests/nowhere"]
    assert not any(is_there(path, ROOT / "README.md") for path in paths)
