"""Every table of a bench begins with the versions of what is compared in it."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import zerorate as zr

BENCHES = Path(__file__).parents[2] / "benches"
NAMES = ["ratios", "calibration_peers", *(path.stem for path in BENCHES.glob("*_ratios.py"))]
MAIN = re.compile(r'def main\(.*?\):\n(?:    """.*?\n)?    print_versions\((.*)\)\n')
PACKAGES = {"pywt": "PyWavelets"}
"""Names of packages that differ from those of their modules."""


@pytest.mark.parametrize("name", sorted(NAMES))
def test_a_bench_prints_the_versions_of_its_peers(name):
    text = (BENCHES / f"{name}.py").read_text(encoding="utf-8")
    (call,) = MAIN.findall(text)
    named = set(re.findall(r'"([^"]+)"', call))
    imported = set(re.findall(r"^ *(?:import|from) (\w+)", text, re.MULTILINE)) - {"numpy"}
    own = {path.stem for path in BENCHES.glob("*.py")} | {"oracle", "support", "zerorate"}
    peers = imported - own - set(sys.stdlib_module_names)
    assert {PACKAGES.get(peer, peer) for peer in peers} <= named


def test_the_line_has_versions():
    code = "from versions import print_versions; print_versions('mcap', 'cc')"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=BENCHES, capture_output=True, text=True, check=True
    )
    line = rf"zerorate {zr.__version__}, Python 3\.\d+\.\d+, numpy [\d.]+, mcap [\d.]+, \S"
    assert re.match(line, done.stdout)
