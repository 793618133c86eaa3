"""``zerorate allan``: the noise of the sensors of one log."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, cast, get_args

import typer

from zerorate.cli.errors import DataFault, UsageFault, print_alarms, require
from zerorate.cli.options import (
    OUTPUT,
    RECORDING,
    FigureFormat,
    FigureFormatOption,
    Fix,
    ForceExports,
    NoFigure,
    Output,
    Reading,
    with_group,
    with_reading_options,
)
from zerorate.cli.outputs import (
    check_outputs,
    own_names,
    preload_figure,
    print_written,
    progress_bar,
)
from zerorate.cli.records import Record, print_title, records
from zerorate.faults import told
from zerorate.noise.kinds import TauGrid
from zerorate.noise.kinds import kind as find_kind
from zerorate.show.tables import bulleted
from zerorate.tasks.characterise import (
    EXPORTS,
    Characterisations,
    Characterised,
    characterise,
    chosen_exports,
    exported,
    files_of,
    left_out_of,
)
from zerorate.tasks.curve_files import CURVE_FORMATS
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import FIGURE_FORMATS, Destination, Outputs, figure_writer, together


class CurveFormat(StrEnum):
    """File formats of a deviation curve."""

    csv = "csv"
    json = "json"
    npz = "npz"


_EXPORTS: Final = "Exports for other programs"
"""A panel of help."""


@dataclass(frozen=True)
class _Analysis:
    """What is typed of the deviations and of the model."""

    kind: Annotated[
        str,
        typer.Option(
            "--deviation",
            "--kind",
            metavar="KIND",
            help="Deviation: oadev, adev, mdev, tdev (Allan), hdev, ohdev (Hadamard, blind to a "
            "ramp), totdev, mtotdev, ttotdev, htotdev, theo1 (for long averaging times), pdev.",
        ),
    ] = "oadev"
    taus: Annotated[
        str,
        typer.Option(
            metavar="TIMES",
            help="Averaging times: octave (doubling), decade (ten a decade), all, or seconds such "
            "as 0.1,1,10.",
        ),
    ] = "octave"
    bridge: Annotated[
        int, typer.Option(help="Longest gap that is filled with a straight line, samples.")
    ] = 0
    confidence: Annotated[
        float, typer.Option(help="Probability that the bounds hold the true deviation, 0 to 1.")
    ] = 0.683
    markov: Annotated[
        int, typer.Option(help="Number of Markov terms, noise correlated over one time, to find.")
    ] = 0
    second_opinion: Annotated[
        bool, typer.Option(help="Estimate the coefficients from the spectrum as well.")
    ] = True

    fix: Fix = False

    def arguments(self) -> dict[str, Any]:
        """Return those of `zerorate.characterise`; ValueError for what means nothing."""
        if self.markov < 0:
            raise UsageFault(f"--markov must not be negative, got {self.markov}")
        return {**vars(self), "kind": find_kind(self.kind).name, "taus": _taus(self.taus)}


@dataclass(frozen=True)
class _Exports:
    """What is typed of files for other programs."""

    export: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Files for estimators, of the worst axis: some of kalibr,vins,orbslam3,px4,ros "
            "(covariances of sensor_msgs/Imu); json has the models of all axes.",
        ),
    ] = None
    inflate: Annotated[
        float,
        typer.Option(help="Factor on the numbers of the exports: 10, say, for a vehicle's noise."),
    ] = 1.0
    per_sample: Annotated[
        bool,
        typer.Option(
            help="For vins: deviations per sample, as its arithmetic takes them, not densities."
        ),
    ] = False

    def names(self) -> list[str]:
        """Return which are asked for; ValueError for options that act on none of them."""
        return chosen_exports(self.export or (), self.inflate, self.per_sample)


@dataclass(frozen=True)
class _Written:
    """Where curves and figures go, as it is typed."""

    output: Output = "."
    format: Annotated[
        CurveFormat | None,
        typer.Option(
            help="File format of the curve; else the suffix of -o, or csv.", rich_help_panel=OUTPUT
        ),
    ] = None
    figure_format: FigureFormatOption = None
    no_figure: NoFigure = False
    force: ForceExports = False

    def parts(
        self, logs: Sequence[Path], reading: Reading, exports: Sequence[str]
    ) -> tuple[list["_Part"], list[Path]]:
        """Return the records of all logs with their files, and the figure of several logs."""
        suffixes = [*CurveFormat, *(() if self.no_figure else FigureFormat)]
        places = [
            Destination.of(self.output, f"{name}-zerorate-allan", suffixes)
            for name in own_names(logs)
        ]
        if len(places) > 1 and places[0].named:
            raise UsageFault(f"-o takes a folder where there are several logs, got '{self.output}'")
        curve = places[0].choose("format", self.format, CURVE_FORMATS)
        figures, overlay = self.figures(places[0], len(logs) > 1)
        endings = [EXPORTS[name] for name in exports]
        parts = [
            _Part(
                log,
                one,
                place.of_part(one.ending).files(f".{curve}", endings, figures, self.force),
            )
            for log, place in zip(logs, places, strict=True)
            for one in records(log, reading.group_by)
        ]
        return parts, overlay

    def figures(self, place: Destination, several: bool) -> tuple[list[str], list[Path]]:
        """Return the endings of each log's figure, and the figure of several logs."""
        if self.no_figure:
            return [], []
        require("matplotlib", "plot")
        suffix = place.choose("figure_format", self.figure_format, FIGURE_FORMATS)
        preload_figure("overlay" if several else "allan_figure")
        if several:
            return [], [place.base.with_name(f"{_OVERLAY}.{suffix}")]
        return [f".{suffix}"], []


@with_group(_Written, "written", OUTPUT)
@with_group(_Analysis, "analysis")
@with_group(_Exports, "exports", _EXPORTS)
@with_reading_options(
    help={
        "columns": "Names, or positions counted from 0 over all columns, e.g. gx,gy,gz. Default: "
        "the columns named like a gyro or an accelerometer.",
        "unit": "Unit of the gyro columns if their names do not say: rad/s, deg/s or deg/h; of the "
        "accelerometer columns g or m/s^2; of both with a comma between: deg/s,g. Values are not "
        "converted.",
        "scale": "What the values of the gyros are multiplied by, e.g. 1/131 for raw counts, and "
        "with a comma between those of the accelerometers: 1/131,1/16384. --unit says what they "
        "are then.",
        "device": "Sensor whose raw counts become deg/s and g by the numbers of its data sheet, "
        "e.g. MPU-6050; with --range.",
        "range": "Range that the gyro of --device was set to, deg/s, and that of the "
        "accelerometer, g, e.g. 250,2.",
    }
)
def allan(
    *,
    logs: Annotated[
        list[Path],
        typer.Argument(help=f"{RECORDING} Several are drawn over each other.", show_default=False),
    ],
    reading: Reading,
    analysis: _Analysis,
    exports: _Exports,
    written: _Written,
) -> None:
    """Characterise the noise of gyros and accelerometers from a log at rest."""
    arguments, names = {**analysis.arguments(), **reading.arguments}, exports.names()
    parts, overlay = written.parts(logs, reading, names)
    for log in logs:
        check_outputs([path for one in parts for path in one.files.paths], written.force, log)
    check_outputs(overlay, written.force)
    results: dict[str, Characterised] = {}
    refused: list[str] = []
    paths = [*overlay]
    for part in parts:
        with progress_bar() as progress:
            asked = {**arguments, "progress": progress}
            found = in_background(partial(characterise, part.record.source, **asked))
            chosen, why, files = part.exported(found, exports, written.force)
            files.save(files_of(found, **chosen), progress)
        paths += files.paths
        refused += [f"{part.record.title or part.log}: {told(one)}" for one in why]
        results[_unique(part.title(len(logs) > 1), results)] = found
        if len(logs) == 1:
            print_title(part.record, first=part is parts[0])
            print_alarms(found.alarms)
            print(found)
            _print_left_out(found, chosen["export"], written.force)
            print_written(files.paths)
    if len(logs) > 1:
        _print_several(Characterisations(results), overlay, written.force)
        print_written(paths)
    if refused:
        raise DataFault("; ".join(refused))


@dataclass(frozen=True)
class _Part:
    """A record of a log, and the files that it becomes, an export each."""

    log: Path
    record: Record
    files: Outputs

    def title(self, several: bool) -> str:
        """Name of the record, and of its log where there are several."""
        return " ".join(filter(None, (str(self.log) if several else "", self.record.title)))

    def exported(
        self, found: Characterised, exports: _Exports, force: bool
    ) -> tuple[dict[str, Any], list[str], Outputs]:
        """Return what is asked of `files_of`, why exports are refused, and the files without."""
        asked: dict[str, Any] = {
            "inflate": exports.inflate,
            "per_sample": exports.per_sample,
            "forced": force,
        }
        texts, refused = exported(found, exports.names(), **asked)
        pairs = zip(self.files.others, exports.names(), strict=True)
        others = tuple(path for path, name in pairs if name in texts)
        asked = asked if texts else {"forced": force}
        return {"export": list(texts), **asked}, refused, replace(self.files, others=others)


_OVERLAY: Final = "allan-zerorate-overlay"
"""Name of the figure of several logs."""


def _unique(title: str, taken: Mapping[str, object]) -> str:
    return title if title not in taken else f"{title} ({len(taken) + 1})"


def _print_left_out(found: Characterised, exports: Sequence[str], force: bool) -> None:
    left_out = [] if force else left_out_of(found, exports)
    if left_out:
        print(bulleted(left_out) if found.notes else f"\n{bulleted(left_out)}")


def _print_several(found: Characterisations, figure: Sequence[Path], force: bool) -> None:
    """Draw several logs over each other, and print them in one table, then the notes on each."""
    with together(figure, force) as temporary:
        for path in temporary:
            figure_writer(found.plot)(path)
    print(found)


def _taus(text: str) -> TauGrid | list[float]:
    """Return the name of a grid, or the seconds of a list with commas."""
    if text in get_args(TauGrid):
        return cast(TauGrid, text)
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        known = ", ".join(get_args(TauGrid))
        raise UsageFault(
            f"--taus takes {known}, or seconds such as 0.1,1,10, got '{text}'"
        ) from None
