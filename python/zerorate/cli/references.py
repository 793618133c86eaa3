"""True tracks and orientations that commands compare with: files of TUM, EuRoC, receivers."""

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final, TypeAlias

import typer

from zerorate.cli.errors import UsageFault, read_faults
from zerorate.cli.options import OUTPUT, PANEL
from zerorate.io import read_poses
from zerorate.record import Poses


class ReferenceHeading(StrEnum):
    """Ways to compare headings."""

    aligned = "aligned"
    absolute = "absolute"
    relative = "relative"


ReferenceOffset: TypeAlias = Annotated[
    float,
    typer.Option(
        metavar="S",
        help="Added to the times of the file of --reference, where its clock has another zero than "
        "that of the log.",
        show_default=False,
        rich_help_panel=PANEL,
    ),
]
Tum: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--tum",
        help="Write the poses as TUM's text, too, which evo reads.",
        rich_help_panel=OUTPUT,
    ),
]
_LIKE_FILES: Final = ("/", "\\", ".tum", ".txt", ".csv")


def existing(reference: str | None) -> Path | None:
    """Return the file that ``--reference`` names; a usage fault if it is not there."""
    if reference is None:
        return None
    if not Path(reference).is_file():
        raise UsageFault(f"--reference names {reference}, which does not exist")
    return Path(reference)


def reference_poses(reference: str | None, offset: float) -> Poses | None:
    """Return the poses of a file that ``--reference`` names, None where it names none."""
    if reference is None:
        return None
    path = Path(reference)
    if not path.is_file():
        if reference.endswith(_LIKE_FILES[2:]) or any(one in reference for one in _LIKE_FILES[:2]):
            raise UsageFault(f"--reference names {reference}, which does not exist")
        return None
    with read_faults():
        poses = read_poses(path)
    return replace(poses, time=poses.time + offset) if offset else poses
