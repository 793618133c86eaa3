"""Whether a tag is the version of all that carries one: ``python .ci/version.py v0.2.0``."""

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent
CARRIERS = {
    "CITATION.cff": r"^version: (\S+)$",
    "examples/ros2/zerorate_imu/package.xml": r"<version>(.*)</version>",
    "examples/ros2/zerorate_imu/setup.py": r'version="(.*)"',
}
"""Files that name the version beside Cargo.toml, and where in them."""


def of_cargo() -> str:
    """Return the version that the crates and the package have."""
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]
    version: str = workspace["package"]["version"]
    if workspace["dependencies"]["zerorate-core"]["version"] != version:
        raise SystemExit("Cargo.toml asks for another version of zerorate-core than it has")
    return version


def check(version: str) -> None:
    """Raise `SystemExit` with what names another version, or nothing of it."""
    for name, pattern in CARRIERS.items():
        found = re.findall(pattern, (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
        if found != [version]:
            raise SystemExit(f"{name} has version {', '.join(found)}, Cargo.toml {version}")


def main() -> None:
    """Compare the tag given, the version, and the first heading of the changes."""
    version = of_cargo()
    check(version)
    if len(sys.argv) > 1:
        changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
        if sys.argv[1] != f"v{version}":
            raise SystemExit(f"tag {sys.argv[1]} is not v{version}, as Cargo.toml has it")
        if not re.search(rf"^## {re.escape(version)}\b", changes, re.MULTILINE):
            raise SystemExit(f"CHANGELOG.md has no section {version}")
    print(version)


if __name__ == "__main__":
    main()
