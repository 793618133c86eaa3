"""``zerorate allan``: the noise of the sensors of one log."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
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
    with_reading_options,
)
from zerorate.cli.outputs import (
    Destination,
    Outputs,
    check_outputs,
    own_names,
    preload_figure,
    print_written,
    progress_bar,
    text_writer,
    together,
)
from zerorate.cli.records import print_title, records
from zerorate.faults import given, said
from zerorate.io import Log, LogError
from zerorate.io.log import present_logs
from zerorate.io.names import UNKNOWN
from zerorate.io.reading import read_sensors
from zerorate.noise import NoiseModel
from zerorate.noise.characterise import Characterisation, characterise, models_json
from zerorate.noise.exports import left_out
from zerorate.noise.kinds import TauGrid
from zerorate.noise.kinds import kind as find_kind
from zerorate.progress import Progress
from zerorate.run.interrupts import in_background
from zerorate.show import format_allan, format_allan_notes
from zerorate.show.curve_files import CurveFormat, write_curves
from zerorate.show.tables import bulleted


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
    output: Output = ".",
    kind: Annotated[
        str,
        typer.Option(
            "--deviation",
            "--kind",
            metavar="KIND",
            help="Deviation: oadev, adev, mdev, tdev (Allan), hdev, ohdev (Hadamard, blind to a "
            "ramp), totdev, mtotdev, ttotdev, htotdev, theo1 (for long averaging times), pdev.",
        ),
    ] = "oadev",
    taus: Annotated[
        str,
        typer.Option(
            metavar="TIMES",
            help="Averaging times: octave (doubling), decade (ten a decade), all, or seconds such "
            "as 0.1,1,10.",
        ),
    ] = "octave",
    bridge: Annotated[
        int, typer.Option(help="Longest gap that is filled with a straight line, samples.")
    ] = 0,
    confidence: Annotated[
        float, typer.Option(help="Probability that the bounds hold the true deviation, 0 to 1.")
    ] = 0.683,
    markov: Annotated[
        int, typer.Option(help="Number of Markov terms, noise correlated over one time, to find.")
    ] = 0,
    second_opinion: Annotated[
        bool, typer.Option(help="Estimate the coefficients from the spectrum as well.")
    ] = True,
    export: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Files for estimators, of the worst axis: some of kalibr,vins,orbslam3,px4,ros "
            "(covariances of sensor_msgs/Imu); json has the models of all axes.",
            rich_help_panel=_EXPORTS,
        ),
    ] = None,
    inflate: Annotated[
        float,
        typer.Option(
            help="Factor on the numbers of the exports: 10, say, for a vehicle's noise.",
            rich_help_panel=_EXPORTS,
        ),
    ] = 1.0,
    per_sample: Annotated[
        bool,
        typer.Option(
            "--per-sample",
            help="For vins: deviations per sample, as its arithmetic takes them, not densities.",
            rich_help_panel=_EXPORTS,
        ),
    ] = False,
    format: Annotated[
        CurveFormat | None,
        typer.Option(
            help="File format of the curve; else the suffix of -o, or csv.",
            show_default=False,
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    figure_format: FigureFormatOption = None,
    no_figure: NoFigure = False,
    force: ForceExports = False,
) -> None:
    """Characterise the noise of gyros and accelerometers from a log at rest."""
    with as_usage():
        family = find_kind(kind)
    if markov < 0:
        raise UsageFault(f"--markov must not be negative, got {markov}")
    analysis = partial(
        characterise,
        kind=family.name,
        taus=_taus(taus),
        bridge=bridge,
        confidence=confidence,
        markov=markov,
        second_opinion=second_opinion,
    )
    exports = parse_choices("--export", export, Export)
    _check_exports(exports, inflate, per_sample)
    suffixes = [*CurveFormat, *(() if no_figure else FigureFormat)]
    several = len(logs) > 1
    places = _places(logs, output, suffixes)
    curve = places[0].choose("--format", format, CurveFormat.csv)
    figures, overlay = [], []
    if not no_figure:
        require("matplotlib", "plot")
        suffix = places[0].choose("--figure-format", figure_format, FigureFormat.png)
        figures = [] if several else [f".{suffix}"]
        overlay = [places[0].base.with_name(f"{_OVERLAY}.{suffix}")] if several else []
    parts = [
        (log, one, place.of_part(one.ending))
        for log, place in zip(logs, places, strict=True)
        for one in records(log, reading.group_by)
    ]
    endings = [_SUFFIX[export] for export in exports]
    outputs = [place.files(f".{curve}", endings, figures, force) for _, _, place in parts]
    for log in logs:
        check_outputs([path for files in outputs for path in files.paths], force, log)
    check_outputs(overlay, force)
    if not no_figure:
        preload_figure("overlay" if several else "allan_figure")
    refused: list[str] = []
    all_found: dict[str, list[Characterisation]] = {}
    said: list[tuple[str, str, Outputs]] = []
    for (log, one, _), files in zip(parts, outputs, strict=True):
        with progress_bar() as progress:
            sensors = present_logs(reading.read(read_sensors, one.source))
            _check_units(exports, sensors[0])
            found = in_background(partial(_all_found, analysis, sensors, progress))
            texts, why = _exported(exports, found, inflate, per_sample, force)
            refused += [f"{one.title or log}: {sentence}" for sentence in why]
            beside = [p for p, e in zip(files.beside, exports, strict=True) if e in texts]
            files = replace(files, beside=tuple(beside))
            curves = partial(_write_curves, found, curve)
            written = map(text_writer, texts.values())
            files.write([curves, *written], partial(_draw, found), progress)
        title = " ".join(filter(None, (str(log) if several else "", one.title)))
        notes = _notes(found, [] if force else _left_out(found, texts))
        if several:
            all_found[_unique(title, all_found)] = found
            said.append((title, notes, files))
            continue
        print_title(one, first=one is parts[0][1])
        print("\n\n".join(filter(None, (format_allan(found), notes))))
        print_written(files.paths)
    if several:
        _overlaid(all_found, overlay, said, force)
    if refused:
        raise DataFault("; ".join(refused))


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


def _places(logs: Sequence[Path], output: str, suffixes: Sequence[str]) -> list[Destination]:
    """Return where the files of each log go; a usage fault for one name of several."""
    places = [
        Destination.of(output, f"{name}-zerorate-allan", suffixes) for name in own_names(logs)
    ]
    if len(places) > 1 and places[0].named:
        raise UsageFault(f"-o takes a folder where there are several logs, got '{output}'")
    return places


def _unique(title: str, taken: Mapping[str, object]) -> str:
    return title if title not in taken else f"{title} ({len(taken) + 1})"


def _overlaid(
    found: Mapping[str, Sequence[Characterisation]],
    figure: Sequence[Path],
    said: Sequence[tuple[str, str, Outputs]],
    force: bool,
) -> None:
    """Draw several logs over each other, and print them in one table, then the notes on each."""
    from zerorate.show.overlay import format_overlay, plot_overlay
    from zerorate.show.style import save_figure

    with writing(), together(figure, force) as temporary:
        for path in temporary:
            save_figure(plot_overlay(found), path)
    print(format_overlay(found))
    for title, notes, _ in said:
        if notes:
            print(f"\n{title}\n{notes}")
    print_written([*figure, *(path for _, _, files in said for path in files.paths)])


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


def _check_exports(exports: Sequence[Export], inflate: float, per_sample: bool) -> None:
    """Raise a usage fault for options of exports that act on none of those asked for."""
    if not (math.isfinite(inflate) and inflate > 0.0):
        raise UsageFault(f"--inflate must be a positive number, got {inflate:g}")
    if inflate != 1.0 and not set(exports) - {Export.json}:
        named = ", ".join(export for export in Export if export is not Export.json)
        raise UsageFault(f"--inflate acts on exports to estimators: --export {named}")
    if per_sample and Export.vins not in exports:
        raise UsageFault("--per-sample acts on --export vins")


def _check_units(exports: Sequence[Export], gyro: Log) -> None:
    """Raise a fault before any work if what is wanted needs to know the unit."""
    needs = next((export for export in exports if export is not Export.json), None)
    if needs is not None and gyro.unit == UNKNOWN:
        raise UsageFault(
            f"--export {needs} needs the unit of the samples, which the log does not say: give "
            "--unit, deg/s or deg/s,g for instance"
        )


def _exported(
    exports: Sequence[Export],
    found: Sequence[Characterisation],
    inflate: float,
    per_sample: bool,
    force: bool,
) -> tuple[dict[Export, str], list[str]]:
    """Return the texts of exports, and why others are refused."""
    texts: dict[Export, str] = {}
    refused: dict[str, list[Export]] = {}
    for export in exports:
        try:
            texts[export] = _text(export, found, inflate, per_sample, force)
        except ValueError as error:
            refused.setdefault(sentence(error), []).append(export)
    return texts, [f"no export to {', '.join(names)}: {why}" for why, names in refused.items()]


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
