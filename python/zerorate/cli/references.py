"""True tracks and orientations that commands compare with: files of TUM, EuRoC, receivers."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from zerorate.cli.errors import UsageFault
from zerorate.cli.options import OUTPUT, PANEL


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


def existing(reference: str | None) -> Path | None:
    """Return the file that ``--reference`` names; a usage fault if it is not there."""
    if reference is None:
        return None
    if not Path(reference).is_file():
        raise UsageFault(f"--reference names {reference}, which does not exist")
    return Path(reference)
