"""Builds the package by maturin, without paths of the building machine in the compiled module."""

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
from paths import remap
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
    remap()
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
    remap()
    return maturin.build_editable(wheel_directory, config_settings, metadata_directory)
