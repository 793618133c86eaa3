"""``zerorate allan``: the noise of the sensors of one log."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, cast, get_args

import typer

from zerorate.cli.errors import (
    DataFault,
    UsageFault,
    as_usage,
    require,
    sentence,
    writing,
)
from zerorate.cli.options import (
    OUTPUT,
    RECORDING,
    FigureFormat,
    FigureFormatOption,
    ForceExports,
    NoFigure,
    Output,
    Reading,
    parse_choices,
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
from zerorate.faults import given, said
from zerorate.io.reading import read_sensors
from zerorate.noise import NoiseModel
from zerorate.noise.characterise import Characterisation, characterise, models_json
from zerorate.noise.exports import left_out
from zerorate.noise.kinds import TauGrid
from zerorate.noise.kinds import kind as find_kind
from zerorate.progress import Progress
from zerorate.record import Log, LogError
from zerorate.record.log import present_logs
from zerorate.record.names import UNKNOWN
from zerorate.show import format_allan, format_allan_notes
from zerorate.show.curve_files import CurveFormat, write_curves
from zerorate.show.tables import bulleted
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import (
    FIGURE_FORMATS,
    Destination,
    Outputs,
    Writer,
    text_writer,
    together,
)


class Export(StrEnum):
    """Estimators whose configuration can be written, and a file of every axis' model."""

    kalibr = "kalibr"
    vins = "vins"
    orbslam3 = "orbslam3"
    px4 = "px4"
    ros = "ros"
    json = "json"


_SUFFIX: Final = {
    Export.kalibr: "-kalibr.yaml",
    Export.vins: "-vins.yaml",
    Export.orbslam3: "-orbslam3.yaml",
    Export.px4: "-px4.params",
    Export.ros: "-ros.yaml",
    Export.json: "-models.json",
}


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

    def of_a_log(self) -> partial[Characterisation]:
        """Return what characterises a log so; a usage fault for what means nothing."""
        with as_usage():
            family = find_kind(self.kind)
        if self.markov < 0:
            raise UsageFault(f"--markov must not be negative, got {self.markov}")
        asked: dict[str, Any] = {**vars(self), "kind": family.name, "taus": _taus(self.taus)}
        return partial(characterise, **asked)


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

    def names(self) -> list[Export]:
        """Return which are asked for; a usage fault for options that act on none of them."""
        exports = parse_choices("--export", self.export, Export)
        if not (math.isfinite(self.inflate) and self.inflate > 0.0):
            raise UsageFault(f"--inflate must be a positive number, got {self.inflate:g}")
        if self.inflate != 1.0 and not set(exports) - {Export.json}:
            named = ", ".join(export for export in Export if export is not Export.json)
            raise UsageFault(f"--inflate acts on exports to estimators: --export {named}")
        if self.per_sample and Export.vins not in exports:
            raise UsageFault("--per-sample acts on --export vins")
        return exports

    def texts(
        self, found: Sequence[Characterisation], force: bool
    ) -> tuple[dict[Export, str], list[str]]:
        """Return the texts of exports, and why others are refused."""
        texts: dict[Export, str] = {}
        refused: dict[str, list[Export]] = {}
        for export in self.names():
            try:
                texts[export] = _text(export, found, self.inflate, self.per_sample, force)
            except ValueError as error:
                refused.setdefault(sentence(error), []).append(export)
        return texts, [f"no export to {', '.join(names)}: {why}" for why, names in refused.items()]


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

    def places(self, logs: Sequence[Path]) -> list[Destination]:
        """Return where the files of each log go; a usage fault for one name of several."""
        suffixes = [*CurveFormat, *(() if self.no_figure else FigureFormat)]
        places = [
            Destination.of(self.output, f"{name}-zerorate-allan", suffixes)
            for name in own_names(logs)
        ]
        if len(places) > 1 and places[0].named:
            raise UsageFault(f"-o takes a folder where there are several logs, got '{self.output}'")
        return places

    def curve(self, place: Destination) -> CurveFormat:
        """Return the format of the curve."""
        return CurveFormat(place.choose("format", self.format, [*CurveFormat]))

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


@dataclass(frozen=True)
class _Told:
    """What there is to say of one record, and what refuses an export of it."""

    title: str
    found: Sequence[Characterisation]
    notes: str
    files: Outputs
    refused: Sequence[str]


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
    analyse, names = analysis.of_a_log(), exports.names()
    places = written.places(logs)
    curve = written.curve(places[0])
    figures, overlay = written.figures(places[0], len(logs) > 1)
    parts = [
        (log, one, place.of_part(one.ending))
        for log, place in zip(logs, places, strict=True)
        for one in records(log, reading.group_by)
    ]
    endings = [_SUFFIX[export] for export in names]
    outputs = [place.files(f".{curve}", endings, figures, written.force) for _, _, place in parts]
    for log in logs:
        check_outputs([path for files in outputs for path in files.paths], written.force, log)
    check_outputs(overlay, written.force)
    told: list[_Told] = []
    for (log, record, _), files in zip(parts, outputs, strict=True):
        title = " ".join(filter(None, (str(log) if len(logs) > 1 else "", record.title)))
        one = _characterised(reading, record, analyse, exports, curve, files, title)
        if len(logs) == 1:
            print_title(record, first=not told)
            print("\n\n".join(filter(None, (format_allan(one.found), one.notes))))
            print_written(one.files.paths)
        told.append(one)
    if len(logs) > 1:
        _overlaid(told, overlay, written.force)
    refused = [
        f"{record.title or log}: {why}"
        for (log, record, _), one in zip(parts, told, strict=True)
        for why in one.refused
    ]
    if refused:
        raise DataFault("; ".join(refused))


def _characterised(
    reading: Reading,
    record: Record,
    analyse: partial[Characterisation],
    exports: _Exports,
    curve: CurveFormat,
    files: Outputs,
    title: str,
) -> _Told:
    """Characterise a record, and write its files."""
    names = exports.names()
    with progress_bar() as progress:
        sensors = present_logs(reading.read(read_sensors, record.source))
        _check_units(names, sensors[0])
        found = in_background(partial(_all_found, analyse, sensors, progress))
        texts, refused = exports.texts(found, files.force)
        beside = [p for p, e in zip(files.others, names, strict=True) if e in texts]
        files = replace(files, others=tuple(beside))
        curves = partial(_write_curves, found, curve)
        writers: list[Writer] = [curves, *map(text_writer, texts.values())]
        files.write(writers, partial(_draw, found), progress)
    notes = _notes(found, [] if files.force else _left_out(found, texts))
    return _Told(title, found, notes, files, refused)


def _all_found(
    analysis: partial[Characterisation], sensors: Sequence[Log], progress: Progress
) -> list[Characterisation]:
    return [_found(analysis, sensor, progress) for sensor in sensors]


def _found(analysis: partial[Characterisation], log: Log, progress: Progress) -> Characterisation:
    try:
        with as_usage():
            return analysis(log, progress=progress)
    except LogError as error:
        raise DataFault(f"{log.meta['source']}: {sentence(error)}") from None


_OVERLAY: Final = "allan-zerorate-overlay"
"""Name of the figure of several logs."""


def _unique(title: str, taken: Mapping[str, object]) -> str:
    return title if title not in taken else f"{title} ({len(taken) + 1})"


def _overlaid(told: Sequence[_Told], figure: Sequence[Path], force: bool) -> None:
    """Draw several logs over each other, and print them in one table, then the notes on each."""
    from zerorate.show.overlay import format_overlay, plot_overlay
    from zerorate.views import save_figure

    found: dict[str, Sequence[Characterisation]] = {}
    for one in told:
        found[_unique(one.title, found)] = one.found
    with writing(), together(figure, force) as temporary:
        for path in temporary:
            save_figure(plot_overlay(found), path)
    print(format_overlay(found))
    for one in told:
        if one.notes:
            print(f"\n{one.title}\n{one.notes}")
    print_written([*figure, *(path for one in told for path in one.files.paths)])


def _notes(found: Sequence[Characterisation], left_out: Sequence[str]) -> str:
    """Return what to know of a log, and which numbers exports lack."""
    return "\n".join(filter(None, (format_allan_notes(found), bulleted(left_out))))


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


def _check_units(exports: Sequence[Export], gyro: Log) -> None:
    """Raise a fault before any work if what is wanted needs to know the unit."""
    needs = next((export for export in exports if export is not Export.json), None)
    if needs is not None and gyro.unit == UNKNOWN:
        raise UsageFault(
            f"--export {needs} needs the unit of the samples, which the log does not say: give "
            "--unit, deg/s or deg/s,g for instance"
        )


def _left_out(found: Sequence[Characterisation], exports: Iterable[Export]) -> list[str]:
    """Return which numbers exports lack, and what to record for them."""
    kinds = set(exports) - {Export.json}
    if not kinds:
        return []
    # A message has no place for a walk.
    walk = kinds != {Export.ros}
    models = (_worst(found, kind) for kind in ("angular rate", "acceleration"))
    return [
        said(
            f"exports leave out the {one}, or ",
            given("force"),
            " writes its upper bound",
        )
        for model in models
        if model is not None
        for one in left_out(model, walk)
    ]


def _text(
    export: Export,
    found: Sequence[Characterisation],
    inflate: float,
    per_sample: bool,
    force: bool,
) -> str:
    if export is Export.json:
        return models_json(found, force=force)
    gyro, accelerometer = (_worst(found, kind) for kind in ("angular rate", "acceleration"))
    if gyro is None:
        raise ValueError("it needs a model of a gyro, and this log gives none")
    rate = found[0].curve.rate
    common: dict[str, Any] = {"accelerometer": accelerometer, "inflate": inflate, "force": force}
    if export is Export.kalibr:
        return gyro.to_kalibr(rate=rate, rostopic=_topic(found[0].log), **common)
    if export is Export.vins:
        return gyro.to_vins(rate=rate if per_sample else None, **common)
    if export is Export.orbslam3:
        return gyro.to_orbslam3(rate=rate, **common)
    if export is Export.ros:
        return gyro.to_ros(rate=rate, **common)
    return gyro.to_px4(**common)


def _topic(log: Log) -> str:
    """Return the topic of a ROS recording, or the one that Kalibr's examples have."""
    sensor = str(log.meta.get("sensor") or "")
    return sensor if sensor.startswith("/") else "/imu0"


def _worst(found: Sequence[Characterisation], quantity: str) -> NoiseModel | None:
    models = (one.worst for one in found)
    return next((m for m in models if m is not None and m.quantity == quantity), None)


def _write_curves(found: Sequence[Characterisation], form: CurveFormat, path: Path) -> None:
    write_curves([one.curve for one in found], path, form)


def _draw(found: Sequence[Characterisation], path: Path) -> None:
    from zerorate.show import plot_characterisation, save_figure

    save_figure(plot_characterisation(found), path)
