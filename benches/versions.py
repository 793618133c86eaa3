"""Versions for the table of a bench: zerorate, Python, NumPy, and the peers."""

import importlib.metadata
import platform
import subprocess

import zerorate as zr
from peers import FILTERPY_2


def _version_of(peer):
    """Return the version of a package, of the C compiler, or of filterpy 2 in its own folder."""
    if peer == "cc":
        return subprocess.run(["cc", "--version"], capture_output=True, text=True).stdout.split(
            "\n"
        )[0]
    if peer == "filterpy 2":
        (found,) = importlib.metadata.distributions(name="filterpy", path=[str(FILTERPY_2)])
        return f"filterpy {found.version}"
    return f"{peer} {importlib.metadata.version(peer)}"


def print_versions(*peers):
    """Print a line with the versions above the tables of a bench."""
    names = ", ".join(map(_version_of, ("numpy", *peers)))
    print(f"zerorate {zr.__version__}, Python {platform.python_version()}, {names}")
