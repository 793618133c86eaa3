"""What a command does with rates that a gyro clipped at its range, and says of them."""

import math
from enum import StrEnum
from typing import Annotated, TypeAlias

import typer

from zerorate.checks.clipped import ClippedAxis, restore_recording
from zerorate.cli.options import PANEL
from zerorate.record import Recording


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


def restored(
    recording: Recording, asked: Clipped, gyro: str | None = None
) -> tuple[Recording, tuple[str, ...]]:
    """Return a recording, restored as asked, and what is to be said of it first."""
    if asked is Clipped.leave:
        return recording, ()
    certain = asked is Clipped.auto
    found, sides = restore_recording(recording, gyro=gyro or "gyro", certain=certain)
    done = found is not recording
    lines = (f"{recording.source}: {_line(one, done, certain)}" for one in sides)
    return found, tuple(lines)


def _line(one: ClippedAxis, done: bool, certain: bool) -> str:
    limit = math.degrees(one.sign * one.limit)
    where = f"gyro {one.axis} is clipped at {limit:.0f} deg/s in {100.0 * one.share:.2g} %"
    if not done:
        return f"{where.replace('is', 'may be', 1)} of the samples: --clipped restore restores it"
    advice = ": --clipped leave leaves it" if certain else ""
    return f"{where} of the samples, and restored from its flanks{advice}"
