"""What the core, the binding and the library for C are made of."""

import importlib.util
import re
import subprocess
import sys
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


def deny():
    spec = importlib.util.spec_from_file_location("deny", ROOT / ".ci/deny.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_licences_sources_and_duplicates():
    command = [sys.executable, str(ROOT / ".ci/deny.py")]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert re.fullmatch(r"\d+ packages, all as deny.toml allows\n", ran.stdout)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("a v1.0.0|MIT OR Apache-2.0", None),
        ("a v1.0.0 (proc-macro)|Unlicense/MIT", None),
        ("a v1.0.0|(MIT OR GPL-3.0) AND Zlib", None),
        (f"a v1.0.0 ({ROOT}/rust/a)|MIT", None),
        ("a v1.0.0|Apache-2.0 WITH LLVM-exception", None),
        ("a v1.0.0|MIT AND GPL-3.0", "a 1.0.0 has the licence MIT AND GPL-3.0"),
        ("a v1.0.0|GPL-3.0 WITH LLVM-exception", "a 1.0.0 has the licence GPL-3.0 WITH LLVM-exc"),
        ("a v1.0.0|", "a 1.0.0 has the licence none"),
        ("a v1.0.0 (https://host/a?rev=1)|MIT", "a 1.0.0 comes from https://host/a?rev=1"),
        ("a v1.0.0 (proc-macro) (registry `b`)|MIT", "a 1.0.0 comes from registry `b`"),
    ],
)
def test_what_a_package_may_be(line, message):
    allowed = {"MIT", "Zlib", "Apache-2.0", "Apache-2.0 WITH LLVM-exception"}
    found = list(deny().faults([line], allowed))
    assert [fault[: len(message or "")] for fault in found] == (
        [] if message is None else [message]
    )


def test_a_package_in_two_versions_is_told():
    found = deny().faults(["a v1.0.0|MIT", "a v2.0.0|MIT", "b v1.0.0|MIT"], {"MIT"})
    assert list(found) == ["a is there in 2 versions"]
