"""Does what a README tells to do, on simulated logs: ``python .ci/readme.py README.md``.

For a place that has the wheel and neither a compiler nor a checkout: its commands run, and what it
shows of Python is compared. Run it in an empty folder, with ``zerorate`` on the path.
"""

import doctest
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

LOGS = {
    "imu.csv": "MPU-6050 --duration 120 --axes 3",
    "static.csv": "MPU-6050 --duration 600 --axes 3",
    "turns.csv": "--poses 12",
}
"""The logs that a README speaks of, and how they are simulated."""

COMMAND = re.compile(r"^zerorate [^#\n]*|(?<=`)zerorate [a-z]+ [^`]*(?=`)", re.MULTILINE)


def commands(text: str) -> Iterator[str]:
    """Yield the commands of blocks and tables, each once."""
    yield from dict.fromkeys(found.strip() for found in COMMAND.findall(text))


def runs_here(command: str) -> bool:
    """Return whether all that a command reads is simulated here."""
    words = shlex.split(command)
    logs = [word for word in words if re.search(r"\.\w+$", word) and not word.startswith("-")]
    return ("--from" not in words) and all(log in LOGS for log in logs)


def run(command: str, folder: Path) -> None:
    """Run a command in a folder; raise `SystemExit` with what it says if it fails."""
    start = time.monotonic()
    done = subprocess.run(
        shlex.split(command), cwd=folder, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"{command}\n{done.stdout}{done.stderr}")
    print(f"{time.monotonic() - start:6.1f} s  {command}", flush=True)


def run_alone(command: str) -> None:
    """Run a command in a new folder that has the logs."""
    with tempfile.TemporaryDirectory() as folder:
        for log in LOGS:
            shutil.copy(log, folder)
        run(command, Path(folder))


def in_degrees(log: Path) -> None:
    """Write a log of rates in rad/s anew in deg/s, the unit of the README."""
    with log.open(encoding="utf-8") as lines:
        head = next(line for line in lines if not line.startswith("#")).strip()
        rows = np.loadtxt(lines, delimiter=",")
    rates = [name.endswith("_radps") for name in head.split(",")]
    rows[:, rates] = np.rad2deg(rows[:, rates])
    head = head.replace("_radps", "_dps")
    np.savetxt(log, rows, fmt="%.9g", delimiter=",", header=head, comments="")


def main() -> None:
    """Simulate the logs, run the commands, compare the examples; say what was left out."""
    readme = Path(sys.argv[1])
    text = readme.read_text(encoding="utf-8")
    for name, how in LOGS.items():
        run(f"zerorate simulate {how} --output {name}", Path())
        in_degrees(Path(name))
    for command in commands(text):
        if runs_here(command):
            run_alone(command)
        else:
            print(f" not run  {command}", flush=True)
    failed, tried = doctest.testfile(str(readme.resolve()), module_relative=False)
    if failed or not tried:
        raise SystemExit(f"{failed} of {tried} examples of {readme.name} differ")
    print(f"{tried} lines of Python give what {readme.name} says")


if __name__ == "__main__":
    main()
