"""The commands and scripts of tutorials and how-to pages, run as a reader would run them.

What needs no shell runs inside this process: most of a command of a page is its start.
"""

import os
import re
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import zerorate as zr
from support.batch_work import Here
from support.inside import between_pipes, called

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(page for kind in ("tutorial", "how-to") for page in (DOCS / kind).glob("*.md"))
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def imu_of_counts(folder):
    """Write what an Arduino prints of an MPU-6050 at rest at 200 Hz: milliseconds and counts."""
    rng = np.random.default_rng(1)
    n = 200 * 90
    offset = [300.0, -250.0, 16384.0, 437.0, -143.0, 65.0]
    spread = [60.0, 60.0, 80.0, 10.0, 14.0, 12.0]
    counts = np.rint(offset + rng.standard_normal((n, 6)) * spread)
    rows = np.column_stack([5 * np.arange(n) + 1000, counts]).astype(int)
    np.savetxt(folder / "imu.csv", rows, "%d", ",", header="millis,ax,ay,az,gx,gy,gz", comments="")


PREPARED = {"live": imu_of_counts, "mpu-6050": imu_of_counts}
"""What a page takes for there, by its name."""


def blocks(page):
    """Yield language and text of what is run: shell commands, and Python without prompts."""
    for language, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        if language == "sh" or ">>> " not in text:
            yield language, text


PLAIN = re.compile(r"zerorate [^|<>$&;#*?`()\\\n]*")
"""A line that is the same to a shell and to whoever splits it at blanks."""
TOGETHER = re.compile(r"<<|^\w+=|\\$", re.MULTILINE)
"""What makes lines need each other."""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}/{page.stem}")
def test_every_command_of_a_page_runs(page, tmp_path, monkeypatch):
    PREPARED.get(page.stem, lambda folder: None)(tmp_path)
    monkeypatch.chdir(tmp_path)
    # As `python -c` has it; what is imported from there is the page's own.
    monkeypatch.syspath_prepend(tmp_path)
    # The same drive in each of several blocks.
    monkeypatch.setattr(zr, "simulate_drive", cache(zr.simulate_drive))
    # Lines that need a shell start workers, too.
    monkeypatch.setattr("zerorate.tasks.batch.run.Processes", Here)
    known = set(sys.modules)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    for language, text in blocks(page):
        code, *printed = (by_shell if language == "sh" else by_python)(text)
        assert code == 0, "\n".join([text, *printed])
    for name in set(sys.modules) - known:
        if (getattr(sys.modules[name], "__file__", None) or "").startswith(str(tmp_path)):
            del sys.modules[name]


def by_python(text):
    return between_pipes(lambda: exec(text, {"__name__": "__main__"}) or 0)


def by_shell(text):
    """Return code, stdout and stderr of lines, those up to the first that fails."""
    for line in [text] if TOGETHER.search(text) else text.splitlines():
        done = called(*shlex.split(line)[1:]) if PLAIN.fullmatch(line) else by_bash(line)
        if done[0] != 0:
            break
    return done


def by_bash(text):
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", text], capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout, done.stderr
