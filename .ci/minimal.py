"""The oldest version of each dependency, as constraints: ``python .ci/minimal.py > FILE``."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

PYPROJECT = Path(__file__).parent.parent / "pyproject.toml"
OLDEST = re.compile(r"([A-Za-z0-9_.-]+)>=([0-9.]+)")


def constraints() -> Iterator[str]:
    """Yield a line for each dependency of the package and of its extras."""
    project = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"].values()
    for requirement in (*project["dependencies"], *(each for extra in extras for each in extra)):
        if requirement.startswith("zerorate["):
            continue
        found = OLDEST.match(requirement)
        if found is None:
            raise SystemExit(f"{requirement} has no oldest version")
        yield f"{found[1]}=={found[2]}"


if __name__ == "__main__":
    print(*constraints(), sep="\n")
