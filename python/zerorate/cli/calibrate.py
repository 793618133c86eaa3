"""``zerorate calibrate``: scale, misalignment and bias of an IMU from a log of hand turns."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple

import numpy as np
import typer

from zerorate.calibration import Calibration, CalibrationError
from zerorate.calibration import calibrate as calibrate_imu
from zerorate.calibration.options import CALIBRATION_OPTIONS
from zerorate.calibration.parameters import GYRO_MATRIX
from zerorate.cli.calibrations import naming, read_calibration, read_imu
from zerorate.cli.checking import checked, print_alarms, said_first
from zerorate.cli.correct import Sensors, correct, notes_on
from zerorate.cli.errors import DataFault, UsageFault, as_usage, require
from zerorate.cli.magnetometer import EXPORTS as OF_MAGNETOMETER
from zerorate.cli.magnetometer import OPTIONS as WITH_MAGNETOMETER
from zerorate.cli.magnetometer import PANEL as COMPASS
from zerorate.cli.magnetometer import Magnetometer, calibrate_compass
from zerorate.cli.options import (
    OF_IMU,
    READING,
    AccelName,
    FigureFormat,
    FigureFormatOption,
    FigurePanels,
    Fix,
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
    all_panels,
    check_outputs,
    preload_figure,
    print_written,
    progress_bar,
)
from zerorate.cli.records import print_title, records
from zerorate.io.formats import LogSource
from zerorate.progress import Progress
from zerorate.record import Recording
from zerorate.show.calibration_table import verdict
from zerorate.show.tables import bulleted
from zerorate.tasks.interrupts import in_background
from zerorate.tasks.saving import FIGURE_FORMATS, Destination, Outputs, text_writer

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
@with_group(Magnetometer, "compass", COMPASS)
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
    sensors = Sensors(gyro, accel)
    if compass.magnetometer:
        _check_alone(context, "--magnetometer", WITH_MAGNETOMETER)
        asked_for = parse_choices("--export", export, Export)
        _check_exports(asked_for)
        outline = (output, figure_format, not no_figure, force)
        calibrate_compass(log, reading, compass, gyro, asked_for, *outline)
        return
    for name in ("field", "dip", "at", "one_iron"):
        if getattr(compass, name):
            raise UsageFault(f"--{name.replace('_', '-')} acts with --magnetometer")
    if apply is not None:
        _check_alone(context, "--apply", _OF_APPLY)
        correct(log, reading, sensors, read_calibration(apply), output, format, force)
        return
    if format is not None:
        raise UsageFault("--format is that of the corrected log: it acts with --apply")
    exports = parse_choices("--export", export, Export)
    old = None if compare is None else read_calibration(compare)
    own = {name: value for name, value in sensors._asdict().items() if value is not None}
    fit = _Fit(sensors, {**choices, **own}, temperature, fix)
    made = _Made(exports, all_panels(figure, not no_figure), force)
    place, figures = _place(log, output, figure_format, not no_figure, temperature)
    found = records(log, reading.group_by)
    parts = [place.of_part(one.ending) for one in found]
    outputs = [part.files(".json", made.endings, figures, force) for part in parts]
    check_outputs([path for files in outputs for path in files.paths], force, log, compare)
    invalid = []
    for one, files in zip(found, outputs, strict=True):
        with progress_bar() as progress:
            recording, alarms, calibration = fit.read(reading, one.source, progress)
            written = made.write(calibration, sensors.of(recording), files, progress)
        print_title(one, first=one is found[0])
        print_alarms(() if _says_axes(calibration) else alarms)
        _print(calibration, sensors.of(recording), old)
        print_written(written.paths)
        if not calibration.valid:
            invalid.append(f"{one.title or log}: {verdict(calibration)}{made.without}")
    if invalid:
        raise DataFault("; ".join(invalid))


def _place(
    log: Path, output: str, figure_format: FigureFormat | None, draws: bool, temperature: bool
) -> tuple[Destination, list[str]]:
    """Return where the files go, and how the names of the figures end."""
    suffixes = ["json", *(FigureFormat if draws else ())]
    place = Destination.of(output, f"{log.stem}-zerorate-calibration", suffixes)
    if not draws:
        return place, []
    require("matplotlib", "plot")
    suffix = place.choose("figure_format", figure_format, FIGURE_FORMATS)
    preload_figure("calibration_figure")
    return place, [f".{suffix}", *([f"-temperature.{suffix}"] if temperature else [])]


class _Fit(NamedTuple):
    """What is fitted, to which sensors, and whether the log's axes are mended before."""

    sensors: Sensors
    asked: Mapping[str, Any]
    temperature: bool
    fix: bool

    def read(
        self, reading: Reading, source: LogSource, progress: Progress
    ) -> tuple[Recording, Sequence[str], Calibration]:
        """Return a recording, what is doubtful of it, and its calibration."""
        recording = read_imu(reading, source)
        with naming(recording):
            recording, alarms = checked(recording, self.fix, *self.sensors)
        with said_first(alarms):
            return recording, alarms, self._of(recording, progress)

    def _of(self, recording: Recording, progress: Progress) -> Calibration:
        """Return the calibration, also one of so little that the fit refuses it, or raise."""
        progress("fitting", 0.3)
        with naming(recording):
            try:
                found = in_background(partial(calibrate_imu, recording, **self.asked))
            except CalibrationError as error:
                if error.calibration is None:
                    raise
                found = error.calibration
            own = self.sensors.of(recording)
            return found.with_temperature(own) if self.temperature else found


class _Made(NamedTuple):
    """What is made of a calibration: files for other programs, and how much a figure shows."""

    exports: Sequence[Export]
    everything: bool
    force: bool

    @property
    def endings(self) -> list[str]:
        """How the names of the exports' files end."""
        return [ending for export in self.exports for ending in _SUFFIXES[export]]

    @property
    def without(self) -> str:
        """What a calibration that is not valid leaves unwritten."""
        names = ", ".join(export for export in self.exports if export is not Export.json)
        return "" if self.force or not names else f": no export to {names}, unless with --force"

    def write(
        self, calibration: Calibration, recording: Recording, files: Outputs, progress: Progress
    ) -> Outputs:
        """Write the numbers, what is exported, and the figures; return the files."""
        valid = calibration.valid or self.force
        written = files if valid else replace(files, others=())
        plots = _plots(calibration, recording, self.everything)
        with as_usage():
            exports = self.exports if valid else ()
            texts = [text for one in exports for text in _texts(calibration, one, self.force)]
        writers = [text_writer(text) for text in (calibration.to_json(), *texts)]
        written.write(writers, [partial(_draw, plot) for plot in plots], progress, 0.7)
        return written


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


def _print(calibration: Calibration, recording: Recording, old: Calibration | None) -> None:
    print(calibration)
    notes = bulleted(notes_on(recording))
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


def _draw(plot: Callable[[], "Figure"], path: Path) -> None:
    from zerorate.show import save_figure

    save_figure(plot(), path)
