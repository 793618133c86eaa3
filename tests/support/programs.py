"""Programs in a process of their own: to be forked, interrupted, or short of memory."""

import subprocess
import sys
import textwrap


def run(program, *arguments, timeout=120.0):
    """What a program prints; its error is that of the test."""
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program), *map(str, arguments)],
        capture_output=True, text=True, timeout=timeout, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"exit {done.returncode}\n{done.stderr[-2000:]}"
    return done.stdout
