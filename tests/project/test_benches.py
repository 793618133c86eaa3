"""Every table of a bench begins with the versions of what is compared in it."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import zerorate as zr

BENCHES = Path(__file__).parents[2] / "benches"
SCRIPTS = sorted(BENCHES.glob("*_ratios.py")) + [
    BENCHES / "ratios.py",
    BENCHES / "calibration_peers.py",
]
PACKAGES = {"pywt": "PyWavelets"}
"""Names of packages that differ from those of their modules."""


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_bench_prints_the_versions_of_its_peers(script):
    text = script.read_text(encoding="utf-8")
    (call,) = re.findall(
        r"def main\(.*?\):\n(?:    \"\"\".*?\n)?    print_versions\((.*)\)\n", text
    )
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
    assert re.match(
        rf"zerorate {zr.__version__}, Python 3\.\d+\.\d+, numpy [\d.]+, mcap [\d.]+, \S",
        done.stdout,
    )
