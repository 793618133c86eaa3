"""``zerorate allan``: noise of the sensors of a log."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, cast, get_args

from zerorate.cli.errors import DataFault, UsageFault
from zerorate.cli.options import (
    EXPORT_PANEL,
    OUTPUT,
    RECORDING,
    Doubtful,
    FigureFormat,
    Fix,
    Force,
    NoFigure,
    Output,
)
from zerorate.cli.outputs import (
    Part,
    check_outputs,
    draw_overlay,
    figure_ending,
    parts_of,
    places_of_logs,
    preload_figure,
    print_result,
    print_written,
    progress_bar,
)
from zerorate.cli.parameters import Argument, option
from zerorate.cli.reading import Reading, ReadingOptions
from zerorate.faults import render_text
from zerorate.noise.kinds import TauGrid
from zerorate.show.tables import bullet_list
from zerorate.tasks.characterise import (
    EXPORTS,
    Characterisations,
    Characterised,
    characterise,
    describe_missing_numbers,
    export_texts,
    files_with,
    parse_exports,
)
from zerorate.tasks.curve_files import CURVE_FORMATS
from zerorate.tasks.interrupts import run_in_background
from zerorate.tasks.saving import FIGURE_FORMATS

_OVERLAY: Final = "allan-zerorate-overlay"
"""File name of the figure of several logs."""

_READING: Final = ReadingOptions(
    help={
        "columns": "Sensor columns, by name or position: gx,gy,gz. Positions count from 0 over "
        "all columns. Default: the columns named like a gyro or an accelerometer.",
        "unit": "Units of gyro and accelerometer, e.g. deg/s,g. Gyro: rad/s, deg/s or deg/h; "
        "accelerometer: g or m/s^2. Needed if the columns' names lack them; values are "
        "not converted.",
        "scale": "Factors of gyro and accelerometer: 1/131,1/16384. The results are in --unit.",
        "device": "Sensor of raw counts, e.g. MPU-6050; with --range. They become deg/s and g by "
        "its data sheet.",
        "range": "Ranges set on the --device, deg/s and g, e.g. 250,2.",
    }
)


def _parse_taus(flag: str, text: str) -> TauGrid | list[float]:
    """Return the name of a grid of averaging times, or a list of seconds."""
    if text in get_args(TauGrid):
        return cast(TauGrid, text)
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        known = ", ".join(get_args(TauGrid))
        raise UsageFault(
            f"{flag} takes {known}, or seconds such as 0.1,1,10, got '{text}'"
        ) from None


@dataclass(frozen=True)
class _Analysis:
    """Options of the deviations and of the model, named as arguments of `zerorate.characterise`."""

    kind: str = option(
        "oadev",
        "Deviation: oadev, adev, mdev, tdev (Allan), hdev, ohdev (Hadamard, blind to a "
        "ramp), totdev, mtotdev, ttotdev, htotdev, theo1 (for long averaging times), pdev.",
        "--deviation --kind",
        metavar="KIND",
    )
    taus: TauGrid | list[float] = option(
        "octave",
        "Averaging times: octave (doubling), decade (ten a decade), all, or seconds such "
        "as 0.1,1,10.",
        metavar="TIMES",
        parse=_parse_taus,
    )
    bridge: int = option(0, "Longest gap to fill with a straight line, samples.")
    confidence: float = option(0.683, "Probability of the bounds, 0 to 1.")
    markov: int = option(0, "Number of Gauss-Markov terms in the model.")
    second_opinion: bool = option(True, "Do not also estimate the noise from the spectrum.")

    fix: Fix = False


@dataclass(frozen=True)
class _Exports:
    """Options of exports for other programs."""

    panel: ClassVar = EXPORT_PANEL

    export: str | None = option(
        None,
        "Files for estimators, by the worst axis: some of kalibr,vins,orbslam3,px4,ros "
        "(covariances of sensor_msgs/Imu); json has the models of all axes.",
        metavar="NAMES",
    )
    inflate: float = option(
        1.0, "Factor on the exported numbers, e.g. 10 for a vehicle's vibration."
    )
    per_sample: bool = option(
        False, "For vins: standard deviations per sample, as its code expects, not densities."
    )

    bounds: bool = option(
        True,
        "Leave out numbers that the log does not determine. By default their upper bound is "
        "exported.",
    )
    doubtful: Doubtful = False

    def names(self) -> list[str]:
        """Return the names of the exports; ValueError for options that no export uses."""
        return parse_exports(self.export or (), self.inflate, self.per_sample)


@dataclass(frozen=True)
class _Written:
    """Options of curves and figures."""

    panel: ClassVar = OUTPUT

    output: Output = "."
    format: str | None = option(
        None, "File format of the curve; else the suffix of -o, or csv.", choices=CURVE_FORMATS
    )
    figure_format: FigureFormat = None
    no_figure: NoFigure = False
    force: Force = False

    def parts(
        self, logs: Sequence[Path], reading: Reading, exports: Sequence[str]
    ) -> tuple[list[Part], list[Path]]:
        """Return the records of all logs with their files, and the figure of several logs."""
        suffixes = [*CURVE_FORMATS, *(() if self.no_figure else FIGURE_FORMATS)]
        places = places_of_logs(logs, self.output, "-zerorate-allan", suffixes)
        first = places[0][1]
        curve = first.choose("format", self.format, CURVE_FORMATS)
        figures, overlay = figure_ending(first, self.figure_format, self.no_figure), []
        if figures:
            preload_figure("overlay" if len(logs) > 1 else "allan_figure")
        if len(logs) > 1:
            overlay = [first.base.with_name(f"{_OVERLAY}{one}") for one in figures]
            figures = []
        endings = [EXPORTS[name] for name in exports]
        parts = parts_of(
            places, reading, lambda place: place.files(f".{curve}", endings, figures, self.force)
        )
        return parts, overlay


def allan(
    *,
    logs: Annotated[list[Path], Argument(f"{RECORDING} Several logs share one figure.")],
    reading: Annotated[Reading, _READING],
    analysis: _Analysis,
    exports: _Exports,
    written: _Written,
) -> None:
    """Characterise the noise of gyros and accelerometers from a log at rest."""
    names, force = exports.names(), written.force
    parts, overlay = written.parts(logs, reading, names)
    check_outputs(overlay, force)
    arguments = {**vars(analysis), **reading.arguments}
    typed: dict[str, Any] = {
        "inflate": exports.inflate,
        "per_sample": exports.per_sample,
        "bounds": exports.bounds,
        "doubtful": exports.doubtful,
    }
    results: dict[str, Characterised] = {}
    refused: list[str] = []
    paths = [*overlay]
    for part in parts:
        with progress_bar() as progress:
            task = partial(characterise, part.record.source, progress=progress, **arguments)
            result = run_in_background(task)
            texts, why = export_texts(result, names, **typed)
            files = part.files.save(files_with(result, texts), progress)
        paths += files
        refused += [f"{part.name}: {render_text(one)}" for one in why]
        results[_unique(part.title(len(logs) > 1), results)] = result
        if len(logs) == 1:
            part.print_title()
            print_result(result, files, _left_out(result, [*texts], exports.bounds))
    if len(logs) > 1:
        logs_together = Characterisations(results)
        draw_overlay(logs_together, overlay, force)
        print(logs_together)
        print_written(paths)
    if refused:
        raise DataFault("; ".join(refused))


def _unique(title: str, taken: Mapping[str, object]) -> str:
    return title if title not in taken else f"{title} ({len(taken) + 1})"


def _left_out(result: Characterised, exports: Sequence[str], bounds: bool) -> str:
    """Return the values that the log does not determine, as a note or a paragraph."""
    left_out = describe_missing_numbers(result, exports, bounds)
    if not left_out:
        return ""
    return bullet_list(left_out) if result.notes else f"\n{bullet_list(left_out)}"
