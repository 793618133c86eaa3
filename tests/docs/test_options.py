"""Options on every page are there: spelled with two hyphens, and of the command they stand with."""

import re
import runpy
from functools import cache
from pathlib import Path

import pytest

from zerorate.cli.app import COMMANDS, taker_of

ROOT = Path(__file__).parents[2]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
    *(path for path in (ROOT / "docs").rglob("*.md") if path.parent.name != "api"),
]
OPTION = re.compile(r"(?<![\w-])--[a-z][\w-]*")
BLOCK = re.compile(r"^```(?:sh|console)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
IN_LINE = re.compile(r"`(zerorate [^`]*)`")
COMMAND = re.compile(r"\bzerorate (\w+)(.*)")
OTHERS = {
    "cargo": {
        *("--bench", "--config", "--crate-type", "--no-default-features", "--package"),
        *("--profile", "--release", "--target"),
    },
    "jupytext": {"--to"},
    "colcon": {"--packages-select"},
    "pip": {"--group"},
    "dask": {"--nthreads", "--nworkers"},
}
"""Of programs that are not ours, as far as a page names them."""


@cache
def of_commands():
    """Return the options of each command."""
    return {
        name: {flag for one in taker_of(name).options() for flag in one.all_flags} | {"--help"}
        for name in COMMANDS
    }


@cache
def known():
    """Return what a page may name: options of the commands, of our scripts, and of others."""
    scripts = [path for kind in ("examples", "benches") for path in (ROOT / kind).rglob("*.py")]
    ours = {
        option
        for path in scripts
        for option in re.findall(r'"(--[a-z][\w-]*)"', path.read_text(encoding="utf-8"))
    }
    return set().union({"--help", "--version"}, ours, *of_commands().values(), *OTHERS.values())


def typed(text):
    """Yield name and rest of each command of ours that a page shows, those of a pipe apart."""
    lines = [line for block in BLOCK.findall(text) for line in _joined(block)]
    for line in (*lines, *IN_LINE.findall(text)):
        for part in re.split(r"[|;&]", line.partition(" # ")[0]):
            found = COMMAND.search(part)
            if found is not None and found[1] in of_commands():
                yield found[1], found[2]


def _joined(block):
    return block.replace("\\\n", " ").splitlines()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_option_is_there(page):
    text = page.read_text(encoding="utf-8")
    assert {one for one in OPTION.findall(text) if one not in known()} == set()
    wrong = {
        f"{name} {option}"
        for name, rest in typed(text)
        for option in OPTION.findall(rest)
        if option not in {*of_commands()[name], "--help"}
    }
    assert wrong == set()
    # A dash is what a clever editor makes of two hyphens.
    assert re.findall(r"(?<!\w)[‐-―][a-z][\w-]+", text) == []


def test_the_check_sees_what_is_wrong():
    assert dict(
        typed("```sh\nzerorate replay a.csv \\\n  --kp 1 | zerorate stream --rate 5\n```")
    ) == {
        "replay": " a.csv    --kp 1 ",
        "stream": " --rate 5",
    }
    assert "--kp" not in of_commands()["replay"]
    assert "--no-such-option" not in known()


def test_the_site_leaves_hyphens_alone():
    assert runpy.run_path(str(ROOT / "docs" / "conf.py"))["smartquotes"] is False
