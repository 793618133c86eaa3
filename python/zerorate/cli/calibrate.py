"""``zerorate calibrate``: scale, misalignment and bias of an IMU from a log of hand turns."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple

import numpy as np
import typer

from zerorate.calibration import Calibration, CalibrationError
from zerorate.calibration import calibrate as calibrate_imu
from zerorate.calibration.choice import own_sensors
from zerorate.calibration.options import CALIBRATION_OPTIONS
from zerorate.calibration.parameters import GYRO_MATRIX
from zerorate.cli.calibrations import naming, read_calibration, read_imu
from zerorate.cli.checking import Fix, checked, print_alarms, said_first
from zerorate.cli.errors import DataFault, UsageFault, as_usage, require, writing
from zerorate.cli.magnetometer import EXPORTS as OF_MAGNETOMETER
from zerorate.cli.magnetometer import OPTIONS as WITH_MAGNETOMETER
from zerorate.cli.magnetometer import Magnetometer, calibrate_compass
from zerorate.cli.options import (
    OF_IMU,
    READING,
    AccelName,
    FigureFormat,
    FigureFormatOption,
    FigurePanels,
    ForceExports,
    GyroName,
    LogArgument,
    LogFormat,
    NoFigure,
    Output,
    PanelsOption,
    Reading,
    parse_choices,
    with_group,
    with_options,
    with_reading_options,
)
from zerorate.cli.outputs import (
    Destination,
    Outputs,
    all_panels,
    check_outputs,
    preload_figure,
    print_written,
    progress_bar,
    text_writer,
    together,
)
from zerorate.cli.records import print_title, records
from zerorate.io import Log, Recording, write_log
from zerorate.io.log import notes_of
from zerorate.progress import Progress
from zerorate.run.interrupts import in_background
from zerorate.show.calibration_table import verdict
from zerorate.show.tables import bulleted

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Export(StrEnum):
    """Programs whose files can be written."""

    kalibr = "kalibr"
    imu_tk = "imu_tk"
    px4 = "px4"
    ardupilot = "ardupilot"
    json = "json"


_SUFFIXES: Final = {
    Export.kalibr: ("-kalibr.yaml",),
    Export.imu_tk: ("-imu_tk_acc.calib", "-imu_tk_gyro.calib"),
    Export.px4: ("-px4.params",),
    Export.ardupilot: ("-ardupilot.param",),
    Export.json: (),
}
_FIT: Final = "Calibration"
_EXPORTS: Final = "Exports for other programs"
_APPLY: Final = "Instead of a calibration"
"""Panels of help."""


@with_options(CALIBRATION_OPTIONS, "choices", panel=_FIT)
@with_group(Magnetometer, "compass")
@with_reading_options(
    imu=True,
    help={"unit": f"{OF_IMU['unit']} Values are not converted."},
)
def calibrate(
    *,
    log: LogArgument,
    reading: Reading,
    output: Output = ".",
    choices: Mapping[str, Any],
    compass: Magnetometer,
    temperature: Annotated[
        bool,
        typer.Option(
            "--temperature",
            help="Add a model of the gyro's bias by temperature, from the rests of the same log.",
            rich_help_panel=_FIT,
        ),
    ] = False,
    gyro: GyroName = None,
    accel: AccelName = None,
    compare: Annotated[
        Path | None,
        typer.Option(
            metavar="OLD",
            help="An earlier calibration (JSON): how far each parameter has moved.",
            rich_help_panel=_FIT,
        ),
    ] = None,
    export: Annotated[
        str | None,
        typer.Option(
            help="Files for other programs: some of kalibr,imu_tk,px4,ardupilot. The JSON is "
            "always written.",
            rich_help_panel=_EXPORTS,
        ),
    ] = None,
    apply: Annotated[
        Path | None,
        typer.Option(
            metavar="CAL",
            help="Correct the log by this calibration (JSON), and write it.",
            rich_help_panel=_APPLY,
        ),
    ] = None,
    fix: Fix = False,
    format: Annotated[
        LogFormat | None,
        typer.Option(
            help="File format of the corrected log; else the suffix of -o, or parquet.",
            show_default=False,
            rich_help_panel=_APPLY,
        ),
    ] = None,
    figure_format: FigureFormatOption = None,
    figure: PanelsOption = FigurePanels.usual,
    no_figure: NoFigure = False,
    force: ForceExports = False,
    context: typer.Context,
) -> None:
    """Calibrate an IMU from one log of hand turns: rests in a dozen poses, and turns between them.

    Prints every number with its error, and whether the calibration is valid (exit 1 if not); writes
    it as JSON, a figure, and what is exported. With --apply, corrects a log instead; with
    --magnetometer, calibrates a compass from any motion.
    """
    sensors = _Names(gyro, accel)
    if compass.magnetometer:
        _check_alone(context, "--magnetometer", WITH_MAGNETOMETER)
        asked_for = parse_choices("--export", export, Export)
        _check_exports(asked_for)
        outline = (output, figure_format, not no_figure, force)
        calibrate_compass(log, reading, compass, gyro, asked_for, *outline)
        return
    for name in ("field", "dip", "one_iron"):
        if getattr(compass, name):
            raise UsageFault(f"--{name.replace('_', '-')} acts with --magnetometer")
    if apply is not None:
        _check_alone(context, "--apply", _OF_APPLY)
        _correct(log, reading, sensors, read_calibration(apply), output, format, force)
        return
    if format is not None:
        raise UsageFault("--format is that of the corrected log: it acts with --apply")
    exports = parse_choices("--export", export, Export)
    old = None if compare is None else read_calibration(compare)
    own = {name: value for name, value in sensors._asdict().items() if value is not None}
    asked = {**choices, **own}
    everything = all_panels(figure, not no_figure)
    suffixes = ["json", *(() if no_figure else FigureFormat)]
    place = Destination.of(output, f"{log.stem}-zerorate-calibration", suffixes)
    figures = []
    if not no_figure:
        require("matplotlib", "plot")
        suffix = place.choose("--figure-format", figure_format, FigureFormat.png)
        figures = [f".{suffix}", *([f"-temperature.{suffix}"] if temperature else [])]
        preload_figure("calibration_figure")
    found = records(log, reading.group_by)
    endings = [end for export in exports for end in _SUFFIXES[export]]
    outputs = [place.of_part(one.ending).files(".json", endings, figures, force) for one in found]
    check_outputs([path for files in outputs for path in files.paths], force, log, compare)
    invalid = []
    for one, files in zip(found, outputs, strict=True):
        with progress_bar() as progress:
            recording = read_imu(reading, one.source)
            with naming(recording):
                recording, alarms = checked(recording, fix, gyro, accel)
            with said_first(alarms):
                calibration = _found(recording, sensors, asked, temperature, progress)
            made = exports if calibration.valid or force else [Export.json]
            if made is not exports:
                files = replace(files, beside=())
            plots = _plots(calibration, sensors.of(recording), everything)
            with as_usage():
                texts = [text for export in made for text in _texts(calibration, export, force)]
            _written(files, calibration, plots, texts, progress)
        print_title(one, first=one is found[0])
        print_alarms(() if _says_axes(calibration) else alarms)
        _print(calibration, sensors.of(recording), old)
        print_written(files.paths)
        if not calibration.valid:
            invalid.append(f"{one.title or log}: {verdict(calibration)}{_unmade(exports, force)}")
    if invalid:
        raise DataFault("; ".join(invalid))


def _unmade(exports: Sequence[Export], force: bool) -> str:
    """Return what a calibration that is not valid leaves unwritten."""
    names = ", ".join(export for export in exports if export is not Export.json)
    return "" if force or not names else f": no export to {names}, unless with --force"


_OF_APPLY: Final = ("log", "apply", "output", "format", "force", "gyro", "accel", *READING)


def _check_exports(asked: Sequence[Export]) -> None:
    for export in asked:
        if export not in OF_MAGNETOMETER:
            listed = ", ".join(OF_MAGNETOMETER)
            raise UsageFault(f"--export of a magnetometer is one of {listed}, got {export}")


def _check_alone(context: typer.Context, asked: str, used: Sequence[str]) -> None:
    """Raise a usage fault for an option that means nothing beside what is asked for."""
    for parameter in context.command.params:
        name = str(parameter.name)
        source = context.get_parameter_source(name)
        if name not in used and source is not None and source.name == "COMMANDLINE":
            raise UsageFault(f"{parameter.opts[0]} has no effect with {asked}")


def _says_axes(calibration: Calibration) -> bool:
    """Whether the calibration itself has found other axes, and says so."""
    matrix = calibration.values[GYRO_MATRIX].reshape(3, 3)
    largest = np.abs(matrix).max(axis=1)
    return not bool((np.diagonal(matrix) > 0.5 * largest).all())


class _Names(NamedTuple):
    """The sensors of a recording that are meant, by their names; None for the usual ones."""

    gyro: str | None
    accel: str | None

    @property
    def both(self) -> dict[str, str]:
        """Return the names of both: the accelerometer is that of the same device."""
        gyro = self.gyro or "gyro"
        return {"gyro": gyro, "accel": self.accel or gyro.replace("gyro", "accel", 1)}

    def of(self, recording: Recording) -> Recording:
        """Return a recording of these sensors and the temperature alone."""
        own = {**self.both, "temperature": "temperature"}
        chosen = {name: recording[one] for name, one in own.items() if one in recording}
        return Recording(chosen, recording.source)


def _found(
    recording: Recording,
    names: _Names,
    asked: Mapping[str, Any],
    temperature: bool,
    progress: Progress,
) -> Calibration:
    """Return the calibration, also one of so little that the fit refuses it, or raise a fault."""
    progress("fitting", 0.3)
    with naming(recording):
        try:
            found = in_background(partial(calibrate_imu, recording, **asked))
        except CalibrationError as error:
            if error.calibration is None:
                raise
            found = error.calibration
        return found.with_temperature(names.of(recording)) if temperature else found


def _print(calibration: Calibration, recording: Recording, old: Calibration | None) -> None:
    print(calibration)
    notes = bulleted(_notes(recording))
    if notes:
        print(f"\nLog\n{notes}")
    if old is not None:
        from zerorate.calibration.comparison import compare_calibrations

        with as_usage():
            alike = old.to_frame(calibration.frame).in_units(
                gyro=calibration.gyro_units[0], accel=calibration.accel_units[0]
            )
            compared = compare_calibrations(alike, calibration)
        print(f"\nCompared with the earlier one, which is first\n{compared}")


def _notes(recording: Recording) -> tuple[str, ...]:
    """Return the sentences on a recording and on its logs, none of them twice."""
    of_logs = (note for log in recording.values() for note in notes_of(log))
    return tuple(dict.fromkeys((*recording.notes, *of_logs)))


def _texts(calibration: Calibration, export: Export, force: bool) -> Sequence[str]:
    """Return the texts of an export's files."""
    if export is Export.json:
        return ()
    if export is Export.imu_tk:
        return calibration.to_imu_tk(force=force)
    one = {
        Export.kalibr: calibration.to_kalibr,
        Export.px4: calibration.to_px4,
        Export.ardupilot: calibration.to_ardupilot,
    }
    return (one[export](force=force),)


def _plots(
    calibration: Calibration, recording: Recording, everything: bool
) -> list[Callable[[], "Figure"]]:
    """Return what draws the figures: the second is of the temperature."""
    from zerorate.show import plot_calibration

    plots: list[Callable[[], Figure]] = [
        partial(plot_calibration, calibration, recording, everything)
    ]
    if calibration.temperature_model is not None:
        plots.append(calibration.temperature_model.plot)
    return plots


def _written(
    files: Outputs,
    calibration: Calibration,
    plots: Iterable[Callable[[], "Figure"]],
    texts: Iterable[str],
    progress: Progress,
) -> None:
    """Write the numbers, what is exported, and the figures."""
    writers = map(text_writer, (calibration.to_json(), *texts))
    files.write([*writers], [partial(_draw, plot) for plot in plots], progress, 0.7)


def _draw(plot: Callable[[], "Figure"], path: Path) -> None:
    from zerorate.show import save_figure

    save_figure(plot(), path)


def _correct(
    log: Path,
    reading: Reading,
    names: _Names,
    calibration: Calibration,
    output: str,
    format: LogFormat | None,
    force: bool,
) -> None:
    """Write a log without what a calibration has found."""
    place = Destination.of(output, f"{log.stem}-zerorate-calibrated", [*LogFormat])
    suffix = place.choose("--format", format, LogFormat.parquet)
    if suffix is LogFormat.parquet:
        require("pyarrow", "io")
    for i, one in enumerate(records(log, reading.group_by)):
        with progress_bar() as progress:
            recording = read_imu(reading, one.source)
            progress("correcting", 0.5)
            with naming(recording):
                own = {} if any(names) else own_sensors(recording, calibration)
                corrected = calibration.apply(recording, **{**names.both, **own})
                tables = _tables(corrected)
            part = place.of_part(one.ending)
            paths = [part.file(f"{ending}.{suffix}") for ending in tables]
            check_outputs(paths, force, log)
            with writing(), together(paths, force) as temporary:
                for path, table in zip(temporary, tables.values(), strict=True):
                    write_log(table, path)
        print_title(one, first=i == 0)
        print(bulleted(_notes(corrected)))
        print_written(paths)


def _tables(recording: Recording) -> dict[str, Log]:
    """Return what is written of a recording, by the endings of names: logs of a clock together."""
    groups: dict[str, list[Log]] = {}
    for name, log in recording.items():
        fits = (group for group in groups.values() if _share(group, log))
        group = next(fits, None)
        if group is None:
            groups[f"-{name}" if groups else ""] = [log]
        else:
            group.append(log)
    return {ending: _joined(group) for ending, group in groups.items()}


def _share(group: Sequence[Log], log: Log) -> bool:
    first, taken = group[0], {name for one in group for name in one.names}
    return np.array_equal(first.sampled, log.sampled) and taken.isdisjoint(log.names)


def _joined(group: Sequence[Log]) -> Log:
    first = group[0]
    data = np.hstack([log.data for log in group])
    names = tuple(name for log in group for name in log.names)
    units = tuple(unit for log in group for unit in log.units)
    return replace(first, data=data, names=names, unit=units)  # type: ignore[arg-type]
