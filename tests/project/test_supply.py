"""What the core, the binding and the library for C are made of."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
UNSAFE = re.compile(r"\bunsafe\s*\{|\bunsafe\s+(?:extern|fn|impl|trait)\b")
COMMENT = re.compile(r"^\s*//.*$", re.MULTILINE)

ALLOWED = {
    "core/src/math/lane.rs": 3,
    "c/src/attitude.rs": 24,
    "c/src/drift.rs": 27,
    "c/src/memory.rs": 14,
}
"""How often a file has unsafe code. More is to be looked at, and written down here."""


def test_unsafe_code_is_where_it_is_known_to_be():
    found = {}
    for path in sorted((ROOT / "rust").rglob("*.rs")):
        name = path.relative_to(ROOT / "rust").as_posix()
        count = len(UNSAFE.findall(COMMENT.sub("", path.read_text(encoding="utf-8"))))
        if count and "/src/" in name:
            found[name] = count
    assert found == ALLOWED


def test_each_block_of_unsafe_code_says_why_it_is_sound():
    for name in ALLOWED:
        text = (ROOT / "rust" / name).read_text(encoding="utf-8")
        blocks = len(re.findall(r"\bunsafe\s*\{", COMMENT.sub("", text)))
        reasons = len(re.findall(r"// SAFETY:", text))
        assert reasons >= blocks / 2, name


def test_other_crates_have_none():
    for crate in ("core", "py"):
        text = (ROOT / f"rust/{crate}/src/lib.rs").read_text(encoding="utf-8")
        assert re.search(r"#!\[(?:deny|forbid)\(unsafe_code\)\]", text), crate


def test_a_crate_has_a_version_in_one_place():
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]
    for name, asked in workspace["dependencies"].items():
        version = asked if isinstance(asked, str) else asked["version"]
        assert re.fullmatch(r"\d+(\.\d+){0,2}", version), name


@pytest.mark.skipif(shutil.which("cargo-deny") is None, reason="needs cargo-deny")
def test_licences_sources_and_duplicates():
    command = ["cargo", "deny", "check", "bans", "licenses", "sources"]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
