"""What a command does with rates that a gyro clipped at its range."""

from enum import StrEnum
from typing import Annotated, TypeAlias

import typer

from zerorate.cli.options import PANEL


class Clipped(StrEnum):
    """What is done with clipped rates."""

    auto = "auto"
    restore = "restore"
    leave = "leave"


ClippedOption: TypeAlias = Annotated[
    Clipped,
    typer.Option(
        "--clipped",
        help="Rates that the gyro clipped at its range: auto restores them from their flanks where "
        "nothing else explains them; restore where flanks promise more; or leave.",
        rich_help_panel=PANEL,
    ),
]
