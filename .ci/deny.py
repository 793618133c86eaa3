"""What the core, its binding and the library for C are made of, by deny.toml.

``python .ci/deny.py`` looks at licences, sources and duplicates as ``cargo deny check bans licenses
sources`` does, on machines that have cargo alone. Texts of licences and advisories are left to
cargo-deny.
"""

import re
import subprocess
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
LINE = re.compile(r"(\S+) v(\S+)((?: \([^)]*\))*)\|(.*)")
WORD = re.compile(r"[()/]|[^()/\s]+(?: WITH [\w.-]+)?")


def tree(without: list[str]) -> list[str]:
    """Return a line a package: name, version, where from unless the index, and its licence."""
    command = ["cargo", "tree", "--locked", "--workspace", "--all-features", "--target=all"]
    command += ["--edges=no-dev", "--no-dedupe", "--prefix=none", "--format={p}|{l}"]
    command += [f"--exclude={name}" for name in without]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return sorted(set(filter(None, told.splitlines())))


def allows(expression: str, allowed: set[str]) -> bool:
    """Return whether licences that are allowed meet an expression of SPDX, or cargo's old one."""
    spoken = {"AND": "and", "OR": "or", "/": "or", "(": "(", ")": ")"}
    words = [spoken.get(word, str(word in allowed)) for word in WORD.findall(expression)]
    # Of True, False, and, or and brackets alone, whatever the expression was.
    return bool(words) and bool(eval(" ".join(words)))


def faults(lines: list[str], allowed: set[str]) -> Iterator[str]:
    """Yield what a list of packages has that it should not, in sentences."""
    names: Counter[str] = Counter()
    for line in lines:
        found = LINE.fullmatch(line)
        if found is None:
            raise SystemExit(f"cargo tree wrote what is not understood: {line}")
        name, version, said, licence = found.groups()
        sources = [one for one in re.findall(r"\(([^)]*)\)", said) if one != "proc-macro"]
        names[name] += 1
        if not allows(licence, allowed):
            yield f"{name} {version} has the licence {licence or 'none'}"
        for source in sources:
            if not Path(source).is_relative_to(ROOT):
                yield f"{name} {version} comes from {source}"
    yield from (f"{name} is there in {n} versions" for name, n in names.items() if n > 1)


def main() -> None:
    """Say all faults, or how many packages have none."""
    rules = tomllib.loads((ROOT / "deny.toml").read_text(encoding="utf-8"))
    lines = tree(rules["graph"]["exclude"])
    found = list(faults(lines, set(rules["licenses"]["allow"])))
    if found:
        raise SystemExit("\n".join(found))
    print(f"{len(lines)} packages, all as deny.toml allows")


if __name__ == "__main__":
    main()
