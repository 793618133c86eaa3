"""README says in one sentence what the package does; so do all places that an index shows."""

from pathlib import Path

import pytest

import zerorate as zr

ROOT = Path(__file__).parents[2]
SENTENCE = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()[2].partition(". ")[0]
PLACES = ("docs/index.md", "pyproject.toml", "Cargo.toml", "CITATION.cff", "rust/core/README.md")


@pytest.mark.parametrize("place", PLACES)
def test_it_is_the_same_everywhere(place):
    assert SENTENCE in (ROOT / place).read_text(encoding="utf-8")


def test_the_package_says_it():
    assert zr.__doc__.splitlines()[0] == f"{SENTENCE}."


def test_both_crates_have_it_from_the_workspace():
    for crate in ("core", "py"):
        manifest = (ROOT / "rust" / crate / "Cargo.toml").read_text(encoding="utf-8")
        assert "description.workspace = true" in manifest
