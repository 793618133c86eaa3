"""The commands and scripts of tutorials and how-to pages, run as a reader would run them."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}/{page.stem}")
def test_every_command_of_a_page_runs(page, tmp_path):
    PREPARED.get(page.stem, lambda folder: None)(tmp_path)
    here = Path(sys.executable).parent
    environment = {**os.environ, "PATH": f"{here}{os.pathsep}{os.environ['PATH']}"}
    for language, text in blocks(page):
        shell = ["bash", "-euo", "pipefail", "-c"]
        command = [*shell, text] if language == "sh" else [sys.executable, "-c", text]
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"
