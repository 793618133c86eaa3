"""Whether a wheel holds what it should and nothing else: ``python .ci/wheel.py FOLDER``."""

import re
import sys
import zipfile
from email.parser import Parser
from pathlib import Path

LIMIT = 5_400_000
"""Bytes. The compiled module takes three quarters: the filters for each processor and order."""

BELONGS = re.compile(
    r"zerorate/(?:\w+/)*\w+\.py"
    r"|zerorate/(?:py\.typed|_native\.pyi|_native(?:\.abi3)?\.(?:so|pyd))"
    r"|zerorate/show/\w+\.(?:css|html|js)"
    r"|zerorate/schemas/\w+\.json"
    r"|zerorate-[\w.]+\.dist-info/(?:METADATA|WHEEL|RECORD|entry_points\.txt)"
    r"|zerorate-[\w.]+\.dist-info/licenses/LICENSE-(?:MIT|APACHE)"
)


def faults(wheel: Path) -> list[str]:
    """Return what is wrong with a wheel, in sentences."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        info = f"{'-'.join(wheel.name.split('-')[:2])}.dist-info"
        metadata = Parser().parsestr(archive.read(f"{info}/METADATA").decode())
    found = [f"does not belong there: {name}" for name in names if not BELONGS.fullmatch(name)]
    needed = ["zerorate/__init__.py", "zerorate/py.typed", "zerorate/_native.pyi"]
    found += [f"is missing: {name}" for name in needed if name not in names]
    if sum(name.endswith((".so", ".pyd")) for name in names) != 1:
        found.append("there is not one compiled module")
    required = [x for x in metadata.get_all("Requires-Dist", []) if "extra ==" not in x]
    if [re.split(r"\W", x)[0] for x in required] != ["numpy"]:
        found.append(f"needs more than NumPy: {', '.join(required)}")
    if "-abi3-" not in wheel.name:
        found.append("is of one Python alone")
    size = wheel.stat().st_size
    if size > LIMIT:
        found.append(f"has {size} bytes, at most {LIMIT} are meant")
    return found


def main() -> None:
    """Say what is wrong with all wheels of a folder; exit 1 if anything is."""
    wheels = sorted(Path(sys.argv[1]).glob("zerorate-*.whl"))
    wrong = [f"{wheel.name}: {fault}" for wheel in wheels for fault in faults(wheel)]
    if not wheels or wrong:
        raise SystemExit("\n".join(wrong) or f"no wheel in {sys.argv[1]}")
    print(*(f"{wheel.name} {wheel.stat().st_size} bytes" for wheel in wheels), sep="\n")


if __name__ == "__main__":
    main()
