"""``zerorate compare``: many methods on the same logs."""

import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, cast

import typer

from zerorate.cli.errors import DataFault, UsageFault, as_usage, sentence, writing
from zerorate.cli.options import (
    RECORDING,
    Reading,
    parse_words,
    with_reading_options,
)
from zerorate.cli.outputs import check_outputs, progress_bar, together
from zerorate.cli.records import records
from zerorate.compare import (
    ATTITUDE_METHODS,
    METHODS,
    Comparison,
    MethodError,
    Row,
    Trial,
    compare_attitude,
    read_trial,
)
from zerorate.compare import compare as run_methods
from zerorate.compare.as_json import as_json
from zerorate.compare.attitude import check_attitude
from zerorate.compare.methods import Chosen, name_of, resolved
from zerorate.compare.simulated import Regret, run_contaminated
from zerorate.geometry.frames import Frame
from zerorate.io import LogError
from zerorate.io.log import present_axes
from zerorate.progress import Progress
from zerorate.show.compare_simulated import format_regret
from zerorate.show.compare_tables import format_compare
from zerorate.simulation import Contamination


@with_reading_options()
def compare(
    *,
    logs: Annotated[
        list[Path] | None,
        typer.Argument(help=RECORDING, show_default=False),
    ] = None,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Also simulated gyros, whose best filter is known.")
    ] = False,
    reference: Annotated[
        str | None, typer.Option(help="Column of an encoder's angle or of a true rate.")
    ] = None,
    quaternion: Annotated[
        str | None, typer.Option(help="Columns w,x,y,z of the true orientation.")
    ] = None,
    seeds: Annotated[int, typer.Option(help="Simulated records of each gyro.")] = 12,
    methods: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="With commas between. NAME=MODULE:FUNCTION adds a method of your own, from a "
            "Python file in this folder: FUNCTION(z, rate) returns the bias after each sample. "
            "After a name +hold learns at rest only, +reject rejects outliers.",
        ),
    ] = ",".join(METHODS),
    contaminate: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FAULTS",
            help="Also with faults in the records, e.g. share=0.01,size=100,one-sided "
            "(in deviations), burst=20,size=30 (a minute) or stuck=10,at-zero (s); repeatable.",
            show_default=False,
        ),
    ] = None,
    attitude: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="Filters of attitude, for logs with an accelerometer and the true orientation; "
            "those of other packages where they are installed. none: no table of them.",
        ),
    ] = ",".join(ATTITUDE_METHODS),
    frame: Annotated[str, typer.Option(help="Of the true orientation: enu, ned or nwu.")] = "enu",
    reading: Reading,
    per_axis: Annotated[bool, typer.Option("--per-axis", help="A table of every axis.")] = False,
    json: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write all numbers, too.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
) -> None:
    """Compare filters on logs by what they cost their user, at rest and in motion."""
    if not logs and not simulated:
        raise UsageFault("give at least one log, or --simulated")
    chosen = _methods(parse_words("--methods", methods))
    truth = None if quaternion is None else parse_words("--quaternion", quaternion)
    with as_usage():
        faults = [Contamination.parse(text) for text in contaminate or []]
        filters = [] if attitude == "none" else parse_words("--attitude", attitude)
        check_attitude(filters, frame)
    if json is not None:
        check_outputs([json], force, None, *(logs or []))
    with progress_bar() as progress:
        recordings = []
        for one in (one for log in logs or [] for one in records(log, reading.group_by)):
            trial = reading.read(read_trial, one.source, reference=reference, quaternion=truth)
            recordings.append(replace(trial, log=present_axes(trial.log)))
        try:
            found = _compared(recordings, chosen, faults, progress)
            found += _attitudes(recordings, filters, frame, progress)
            regret = _simulated(chosen, faults, seeds, progress) if simulated else []
        except MethodError as error:
            raise DataFault(str(error)) from None
    if json is not None:
        with writing(), together([json], force) as (temporary,):
            temporary.write_text(as_json(found, regret), encoding="utf-8", newline="\n")
    print("\n\n".join(_texts(found, regret, per_axis)))
    if json is not None:
        print(f"\nwrote {json}")


def _texts(found: tuple[Comparison, ...], regret: list[Regret], per_axis: bool) -> Iterator[str]:
    if found:
        yield format_compare(found, per_axis)
    yield from map(format_regret, regret)


def _methods(names: Sequence[str]) -> list[Chosen]:
    """Return methods by their names; a user's own are looked for in the working folder, too."""
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    with as_usage():
        return resolved(names)


def _compared(
    recordings: list[Trial], methods: list[Chosen], faults: list[Contamination], progress: Progress
) -> tuple[Comparison, ...]:
    if not recordings:
        return ()
    try:
        return run_methods(recordings, methods, progress, faults)
    except LogError as error:
        raise DataFault(sentence(error)) from None
    except ValueError as error:
        raise UsageFault(sentence(error)) from None


def _attitudes(
    recordings: list[Trial], methods: Sequence[str], frame: str, progress: Progress
) -> tuple[Comparison, ...]:
    """Return the comparison of filters of attitude on the recordings that allow it."""
    rows: list[Row] = []
    notes: list[str] = []
    for one in recordings if methods else ():
        if one.orientation is None or one.accel is None:
            continue
        try:
            found = compare_attitude([one], methods, progress, frame=cast(Frame, frame))
        except LogError as error:
            notes.append(f"no attitude: {sentence(error)}")
        else:
            rows.extend(found.rows)
            notes.extend(found.notes)
    if not rows and not notes:
        return ()
    return (Comparison("attitude", tuple(rows), tuple(dict.fromkeys(notes))),)


def _simulated(
    methods: list[Chosen], faults: list[Contamination], seeds: int, progress: Progress
) -> list[Regret]:
    # Simulated gyros rest.
    plain = [method for method in methods if "+hold" not in name_of(method)]
    with as_usage():
        return run_contaminated(plain, faults, seeds=seeds, progress=progress)
