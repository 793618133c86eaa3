"""The track of a sensor on a foot: ``zerorate walk``."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from typing import Final, Literal, Unpack

import numpy.typing as npt

from zerorate.calibration.calibration import Calibration
from zerorate.checks.preparation import Choices, Clipped, prepare
from zerorate.faults import keyword_argument, make_sentence
from zerorate.foot.foot import FootNavigation, FootTrack, Origin
from zerorate.io.writing import write_log
from zerorate.navigation.tracks import write_geojson, write_gpx
from zerorate.progress import Progress, choose_reporter
from zerorate.tasks.coordinates import parse_position
from zerorate.tasks.corrections import correction_of
from zerorate.tasks.saving import Files, Writer, figure_writer
from zerorate.tasks.source import ReadingArguments, Source, name_source_in_errors, one_imu_of

_MAX_LATITUDE_DEG: Final = 89.5


def walk(
    source: Source,
    *,
    floor: Literal["level"] | None = None,
    smooth: bool = False,
    at: npt.ArrayLike | None = None,
    heading: float | None = None,
    height: float | None = None,
    calibration: Calibration | str | os.PathLike[str] | None = None,
    clipped: Clipped = "auto",
    assume_foot: bool = False,
    fix: bool = False,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> FootTrack:
    """Find the track of a sensor on a foot from the stances of the foot, without a receiver.

    The recording is checked and corrected first. ``zerorate walk`` does the same.

    Parameters
    ----------
    source : Recording, path, data frame or mapping of arrays
        Recording with a gyro and an accelerometer of three axes.
    floor : {None, "level"}
        "level": move stances within 0.1 m of the current floor onto it; see
        `zerorate.FootNavigation`.
    smooth : bool
        Use the whole recording for each sample, including later samples.
    at : array_like, shape (2,), optional
        Latitude and longitude of the start, deg. The track is then also saved for maps.
    heading, height : float, optional
        Only with `at`. Direction of the sensor's first axis at the start (rad from north towards
        east) and height of the start (m). Default 0.
    calibration : Calibration or path, optional
        Calibration that corrects gyro and accelerometer first.
    clipped : {"auto", "restore", "leave"}
        Treatment of clipped rates. "auto" and "restore": restore them from their flanks, and reduce
        their weight. "leave": do not change them.
    assume_foot : bool
        Navigate even if the motion is not a foot's motion.
    fix : bool
        Correct the gyro's unit or axes if the motion clearly contradicts them.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    **reading
        Arguments of `zerorate.read_recording`, if the source is a file.

    Returns
    -------
    FootTrack
        Track and strides. The result has the methods `table`, `plot` and `save`.

    Raises
    ------
    LogError
        If a sensor is missing, gravity is absent, or the motion is not a foot's motion. The error's
        notes list contradictions in the recording.
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> made = zr.simulate_walk(strides=20, seed=1)
    >>> track = zr.walk(made.recording(), floor="level", smooth=True)
    >>> bool(abs(track.distance - made.distance) < 0.01 * made.distance), track.alarms
    (True, ())
    """
    report = choose_reporter(progress)
    origin = _parse_origin(at, heading, height)
    # The navigation restores rates itself, because restored rates get less weight.
    nav = FootNavigation(floor=floor, restore=clipped != "leave", assume_foot=assume_foot)
    correct = correction_of(calibration)
    report("reading", 0.0)
    recording = one_imu_of(source, reading)
    with name_source_in_errors(recording.source):
        prepared = prepare(recording, Choices(fix=fix, clipped="leave", correct=correct))
    with name_source_in_errors(recording.source, prepared.alarms):
        report("navigating", 0.1)
        track = nav.process(prepared.recording, keep="all" if smooth else "track")
        if smooth:
            report("smoothing", 0.5)
            track = track.smooth()
    return replace(track, alarms=prepared.alarms, origin=origin)


def _parse_origin(
    at: npt.ArrayLike | None, heading: float | None, height: float | None
) -> Origin | None:
    if at is None:
        for name, value in (("heading", heading), ("height", height)):
            if value is not None:
                raise ValueError(
                    make_sentence(keyword_argument(name), " needs ", keyword_argument("at"))
                )
        return None
    turn = heading or 0.0
    if not abs(turn) <= 2.0 * math.pi:
        degrees = f"{math.degrees(turn):g}"
        raise ValueError(
            make_sentence(
                keyword_argument("heading"), f" takes an angle within 360 deg, got {degrees}"
            )
        )
    if not math.isfinite(height or 0.0):
        raise ValueError(make_sentence(keyword_argument("height"), f" takes m, got {height}"))
    return Origin(*parse_position(at, _MAX_LATITUDE_DEG), turn, height or 0.0)


def files_of(track: FootTrack) -> Files:
    """Return the files of a walk: log, figure, and maps if the start is known."""
    writers: list[Writer] = [lambda path: write_log(track.to_log(), path)]
    endings: list[str] = []
    if track.origin is not None:
        placed = track.georeference(
            track.origin.latitude,
            track.origin.longitude,
            heading=math.degrees(track.origin.heading),
            height=track.origin.height,
        )
        writers.append(lambda path: write_geojson(path, placed, force=True))
        writers.append(lambda path: write_gpx(path, placed, force=True))
        endings += [".geojson", ".gpx"]
    return Files("-zerorate-walk", "", writers, endings, {"": figure_writer(track.plot)})
