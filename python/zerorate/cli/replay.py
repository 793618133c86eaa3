"""``zerorate replay``: a log in the filters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from zerorate.cli.array import FusionOptions, OfArray, check_alone
from zerorate.cli.errors import UsageFault
from zerorate.cli.filter_options import FilterOptions, check_filter_options, flag
from zerorate.cli.options import OUTPUT, RECORDING, Fix, NoAccel
from zerorate.cli.outputs import (
    LogAndPanels,
    Part,
    check_outputs,
    draw_overlay,
    parts_of,
    places_of_logs,
    print_result,
    print_written,
    progress_bar,
)
from zerorate.cli.parameters import Argument, Option, option
from zerorate.cli.process import keep_freed
from zerorate.cli.reading import PANEL, Reading, ReadingOptions
from zerorate.cli.values import parse_words
from zerorate.options import METHODS, select_options
from zerorate.tasks.array import replay_array
from zerorate.tasks.replay import Replays, Summary, replay_to_file
from zerorate.tasks.replay import replay as remove_bias
from zerorate.tasks.saving import files_of, make_folders

_ALL: Final = "all"
_OVERLAY: Final = "replay-zerorate-overlay"
"""File name of the figure of several logs."""


def _parse_methods(flag: str, text: str) -> Sequence[str]:
    names = METHODS if text == _ALL else parse_words(flag, text)
    for name in names:
        if name not in METHODS:
            raise UsageFault(f"{flag} takes all, or some of {', '.join(METHODS)}, got '{name}'")
    return names


@dataclass(frozen=True)
class _Sensors:
    """Options for preprocessing and the accelerometer."""

    panel: ClassVar = PANEL

    calibration: Path | None = option(
        None,
        "Apply this calibration first (zerorate calibrate). With the log's accelerometer, if "
        "any, its g-sensitivity is corrected, too.",
        metavar="CAL",
    )
    fix: Fix = False
    no_accel: NoAccel = False

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `zerorate.replay`."""
        return {"calibration": self.calibration, "fix": self.fix, "accel": not self.no_accel}


def replay(
    *,
    logs: Annotated[
        list[Path], Argument(f"{RECORDING} Several logs have one table and a further figure.")
    ],
    reading: Annotated[Reading, ReadingOptions()],
    written: LogAndPanels,
    compared: Annotated[
        Sequence[str],
        Option(
            "Also compare methods: kf, akf, fading, robust, auto, or all.",
            "--methods",
            metavar="NAMES",
            parse=_parse_methods,
            panel=OUTPUT,
        ),
    ] = (),
    truth: Annotated[
        Path | None,
        Option(
            "File with the true bias (NAME-truth of zerorate simulate). It is drawn, and the "
            "final error printed.",
            metavar="FILE",
            panel=OUTPUT,
        ),
    ] = None,
    sensors: _Sensors,
    array: OfArray,
    fusion: FusionOptions,
    options: FilterOptions,
) -> None:
    """Remove the bias from every axis of a log.

    Prints the bias with its standard deviation, and writes the filtered log and a figure. The log
    contains raw minus bias under the raw columns' names. Extra columns contain the bias, its
    standard deviation, and flags for rest and for a stuck or saturated sensor. The default method,
    auto, needs no settings.
    """
    of_array = array.arguments(fusion, options)
    if of_array is not None:
        check_alone(
            options,
            methods=bool(compared),
            calibration=sensors.calibration is not None,
            truth=truth is not None,
            no_accel=sensors.no_accel,
            figure=written.figure == "all",
        )
    method = options["method"]
    check_filter_options(options, (*compared, method))
    panels = written.panels
    places = places_of_logs(logs, written.output, "-zerorate", written.suffixes())
    files = partial(written.at, others=("-rotations.json",) if array.finds else ())
    parts = parts_of(places, reading, files, array.file, sensors.calibration)
    drawn = parts[0].files.figures if len(logs) > 1 and of_array is None else ()
    overlay = [one.with_name(f"{_OVERLAY}{one.suffix}") for one in drawn]
    check_outputs(overlay, written.force)
    keep_freed()
    if of_array is not None:
        _replay_arrays(parts, {**of_array, "fix": sensors.fix, **reading.arguments})
        return
    arguments = {"methods": compared, **options, **sensors.arguments(), **reading.arguments}
    arguments["data_scale"] = arguments.pop("scale")
    if truth is not None:
        if written.no_figure or len(logs) > 1:
            raise UsageFault("--truth needs a single log and a figure")
        arguments["truth"] = truth
    results: dict[str, Summary] = {}
    for part in parts:
        result = _run(part, arguments, panels)
        if len(logs) == 1:
            part.print_title()
            print_result(result, part.files.paths)
        results[part.title(several=True)] = result.summary()
    if len(logs) > 1:
        replays = Replays(results)
        draw_overlay(replays, overlay, written.force)
        print(replays)
        print_written([*overlay, *(path for one in parts for path in one.files.paths)])
    _print_unused(method, options)


def _run(part: Part, arguments: Mapping[str, Any], panels: str) -> Summary:
    """Filter a record and write its files; without a figure, block by block."""
    files, source = part.files, part.record.source
    with progress_bar() as progress:
        if not files.figures:
            make_folders([files.log])
            return replay_to_file(
                source, files.log, force=files.force, progress=progress, **arguments
            )
        result = remove_bias(source, progress=progress, **arguments)
        files.save(files_of(result, panels=panels), progress)
    return result


def _replay_arrays(parts: Sequence[Part], arguments: Mapping[str, Any]) -> None:
    """Replay each record as an array, write its files, and print its result."""
    for part in parts:
        with progress_bar() as progress:
            result = replay_array(part.record.source, progress=progress, **arguments)
            part.files.save(files_of(result), progress)
        part.print_title()
        print_result(result, part.files.paths)


def _print_unused(method: str, options: Mapping[str, Any]) -> None:
    """Print the options that the method does not use, if any."""
    used = select_options(method, options)
    others = [flag(name) for name in options if name not in used and name != "method"]
    if others:
        verb = "has" if len(others) == 1 else "have"
        print(
            f"{', '.join(others)} {verb} no effect on {method}, only on the methods that the "
            "table compares it with"
        )
