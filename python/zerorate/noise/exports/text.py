"""From settings to a text, and to a file."""

import os
from collections.abc import Iterable

from zerorate.io.atomic import atomic_path
from zerorate.noise.exports.settings import Setting

__all__ = ["head", "joined", "number", "written", "yaml_line"]


def head(title: str, accelerometer: object | None, inflate: float) -> list[str]:
    """Return the comments that begin a file: what it is, and what was done to the numbers."""
    lines = [f"# {title}"]
    if inflate != 1.0:
        lines.append(f"# Every number is {inflate:g} times the measured one.")
    if accelerometer is None:
        lines.append("# No accelerometer was given: its lines are left out.")
    return lines


def yaml_line(setting: Setting) -> str:
    """Return one line of YAML, its unit behind it."""
    return f"{setting.name}: {number(setting.value)}  # {setting.remark}"


def number(value: float) -> str:
    """Return six digits, always with a point.

    Without one PyYAML reads 1e-05 as a string, and ORB-SLAM3 refuses 0 as not real.
    """
    return f"{value:.5e}"


def joined(lines: Iterable[str]) -> str:
    """Return the lines as a text that ends in a line break."""
    return "\n".join(lines) + "\n"


def written(text: str, path: str | os.PathLike[str] | None, force: bool) -> str:
    """Return the text, after writing it, whole or not at all, where a path is given."""
    if path is not None:
        with atomic_path(path, force) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
    return text
