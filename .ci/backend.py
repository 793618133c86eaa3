"""Builds the package by maturin, without paths of the building machine in the compiled module."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import maturin
from maturin import (
    build_sdist,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)
from stub import document

Settings = dict[str, Any] | None

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]


def build_wheel(
    wheel_directory: str, config_settings: Settings = None, metadata_directory: str | None = None
) -> str:
    """Build a wheel, the stub with the docstrings of what was compiled."""
    _remap_paths()
    name: str = maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
    try:
        document(Path(wheel_directory, name))
    except ImportError as error:
        # Compiled for another machine than this one, as is meant.
        print(f"the stub of {name} has no docstrings: {error}", file=sys.stderr)
    return name


def build_editable(
    wheel_directory: str, config_settings: Settings = None, metadata_directory: str | None = None
) -> str:
    """Build what an editable installation needs."""
    _remap_paths()
    return maturin.build_editable(wheel_directory, config_settings, metadata_directory)


def _remap_paths() -> None:
    """Have the compiler write other names for the folders of this machine.

    Cargo's configuration knows no variables, and RUSTFLAGS would take the place of its flags: those
    of one target are added to them.
    """
    cargo = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
    names = {cargo: "cargo", Path(__file__).parent.parent: "zerorate"}
    paths = {str(form): name for path, name in names.items() for form in (path, path.resolve())}
    # The variable is split at blanks.
    flags = [
        f"--remap-path-prefix={path}={name}" for path, name in paths.items() if " " not in path
    ]
    variable = f"CARGO_TARGET_{_target().upper().replace('-', '_')}_RUSTFLAGS"
    os.environ[variable] = " ".join([os.environ.get(variable, ""), *flags]).strip()


def _target() -> str:
    told = subprocess.run(["rustc", "-vV"], capture_output=True, text=True, check=True).stdout
    host = next(line.split()[1] for line in told.splitlines() if line.startswith("host:"))
    return os.environ.get("CARGO_BUILD_TARGET", host)
