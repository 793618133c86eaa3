"""The track of a vehicle, from its inertial sensors and its receiver: ``zerorate navigate``."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, Unpack

import numpy as np
import numpy.typing as npt

from zerorate.calibration.calibration import Calibration
from zerorate.checks.preparation import Choices, Clipped, prepare, prepare_fixes
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.io.fixes import read_fixes
from zerorate.io.poses import read_poses
from zerorate.io.reading import read_log
from zerorate.io.writing import write_log
from zerorate.metrics.tracks import TrackErrors, ate, rpe
from zerorate.navigation.aid_channels import AidInputs, Channel, judge_channels
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.begin import (
    Beginning,
    Heading,
    Mount,
    Offset,
    ProcessNoise,
    find_beginning,
)
from zerorate.navigation.field_heading import find_field_heading
from zerorate.navigation.heading import format_heading
from zerorate.navigation.options import NAVIGATION_OPTIONS
from zerorate.navigation.outage import OutagePlan, Outages, doubt_start
from zerorate.navigation.track import Track, explain_no_start
from zerorate.navigation.tracks import write_geojson, write_gpx
from zerorate.navigation.wheels import Wheels
from zerorate.noise import NoiseModel, worst_axis
from zerorate.noise.quantities import Quantity
from zerorate.progress import Progress, choose_reporter
from zerorate.record.fixes import Fixes
from zerorate.record.log import Log, LogError
from zerorate.record.offset import TimeOffset
from zerorate.record.poses import Poses
from zerorate.record.recording import Recording
from zerorate.record.regular import read_regular_text
from zerorate.record.samples import Samples
from zerorate.tasks.aids import AidArguments, AidRequest
from zerorate.tasks.corrections import correction_of
from zerorate.tasks.saving import Files, Writer, figure_writer, text_writer
from zerorate.tasks.source import (
    ReadingArguments,
    Source,
    name_source_in_errors,
    one_imu_of,
    split_options,
)
from zerorate.types import Floats
from zerorate.views import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate._native import NavigationFilter

PathLike = str | os.PathLike[str]
_START_READINGS: Final = 10
"""Number of compass readings averaged for the heading at the start."""
_COMPASS_SIGMA_RAD: Final = 0.035
"""Default of the filter's ``compass_sigma``, rad."""
StatedNoise = NoiseModel | PathLike | None
"""Noise model of a sensor, or its file."""


class NavigateOptions(ReadingArguments, AidArguments, total=False):
    """Options of `navigate` for the filter, for reading and for aids."""

    gate: float
    adapt: Literal["inflate", "free", "fixed"]
    covariance_step: float
    kind: Literal["rate", "increment"]
    antenna_sigma: float
    wheel_sigma: float
    speed_sigma: float
    barometer_sigma: float
    barometer_walk: float
    compass_sigma: float
    compass_walk: float


@dataclass(frozen=True, eq=False)
class Navigation(Result):
    """The track of a vehicle, as `zerorate.navigate` returns it.

    Parameters
    ----------
    track : Track
        Position, velocity, attitude and biases at every sample, with standard deviations.
    start : Alignment
        State in which the filter started.
    nis : ndarray, shape (fixes, 2)
        Normalised innovations squared of positions and velocities.
    outages : Outages or None
        Errors in simulated outages of the receiver; None without `outages`.
    truth : Poses, Fixes or None
        True track for comparison.
    alarms : tuple of str
        Contradictions in the recording, one sentence each.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=120.0, seed=1)
    >>> found = zr.navigate(drive.recording(), drive.fixes)
    >>> found.alarms, bool(found.track.navigating.any())
    ((), True)
    """

    track: Track
    start: Alignment
    nis: Floats
    outages: Outages | None = None
    truth: Poses | Fixes | None = None
    alarms: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Name of the recording."""
        return self.track.source

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on assumptions, findings and corrections."""
        return self.track.notes

    def errors(self) -> tuple[TrackErrors, TrackErrors | None, str] | None:
        """Return the errors against the true track; None without a true track.

        Returns
        -------
        tuple
            Position errors, errors of the motion within each second (None without orientations),
            and a sentence on the alignment of the tracks.
        """
        truth = self.truth
        if truth is None:
            return None
        if isinstance(truth, Fixes):
            origin = truth.position[np.isfinite(truth.position).all(axis=1)][0]
            return ate(self.track.poses(origin), truth.poses(origin), align="none"), None, ""
        poses = self.track.poses()
        position_errors = ate(poses, truth, align="yaw")
        has_orientation = np.isfinite(truth.quaternion).all()
        steps = rpe(poses, truth, delta=1.0, unit="s") if has_orientation else None
        angle = math.degrees(2.0 * math.atan2(position_errors.turn[3], position_errors.turn[0]))
        return position_errors, steps, f"turned by {angle:.2f} deg about the vertical, and shifted"

    def poses(self) -> Poses:
        """Return position and orientation at every sample, as `Track.poses` does."""
        return self.track.poses()

    def to_log(self) -> Log:
        """Return the track as a log, as `Track.to_log` does."""
        return self.track.to_log()

    def plot(
        self,
        panels: Literal["usual", "all"] = "usual",
        *,
        ax: Axes | Sequence[Axes] | None = None,
    ) -> Figure:
        """Return the figure of the track; ImportError without matplotlib (extra ``plot``).

        Parameters
        ----------
        panels : {"usual", "all"}
            The usual panels (six at most), or all panels.
        ax : matplotlib Axes, or a sequence of them, optional
            Axes for the path, followed by axes for further panels.
        """
        from zerorate.views import figure_of

        return figure_of(self, panels == "all", ax=ax)


@dataclass(frozen=True)
class _Wheels:
    """Speed or ticks of wheels: a column of the source, or values at the gyro's samples."""

    values: str | npt.ArrayLike
    ticks: bool
    tick: float | None

    @classmethod
    def of(
        cls,
        speed: str | npt.ArrayLike | None,
        ticks: str | npt.ArrayLike | None,
        tick: float | None,
    ) -> _Wheels | None:
        if tick is not None and ticks is None:
            raise ValueError(
                make_sentence(keyword_argument("tick"), " needs ", keyword_argument("wheel_ticks"))
            )
        if tick is not None and not 0.0 < tick < math.inf:
            raise ValueError(
                make_sentence(keyword_argument("tick"), f" takes metres above 0, got {tick:g}")
            )
        if speed is not None and ticks is not None:
            both = keyword_argument("wheel_speed"), " and ", keyword_argument("wheel_ticks")
            raise ValueError(make_sentence(*both, " say the same: give one"))
        values = speed if ticks is None else ticks
        return None if values is None else cls(values, ticks is not None, tick)

    def read(self, source: Source, recording: Recording, fixes: Fixes) -> Floats | Wheels:
        """Return the speed at each sample (NaN if missing), or speeds between tick counts."""
        samples = Samples.of(recording, mag=False, what="navigation")
        values = self._values(source, samples)
        if not self.ticks:
            return values
        return Wheels.of_ticks(samples.time, values, tick=self.tick, fixes=fixes)

    def _values(self, source: Source, samples: Samples) -> Floats:
        if not isinstance(self.values, str):
            return np.asarray(self.values, dtype=np.float64)
        if isinstance(source, Recording | Log):
            name = "wheel_ticks" if self.ticks else "wheel_speed"
            raise ArgumentError(name, "must be an array with a recording: it has no columns")
        return samples.align(read_log(source, columns=self.values))[:, 0]


def navigate(
    source: Source,
    fixes: Fixes | PathLike | None = None,
    *,
    mount: Mount = "auto",
    antenna: npt.ArrayLike | None = None,
    time_offset: Offset = "auto",
    heading: Heading = None,
    rest: tuple[float, float] | None = None,
    smooth: bool = False,
    outages: float | Sequence[float] = (),
    vehicle: Literal["wheeled"] | None = None,
    axle: npt.ArrayLike | None = None,
    wheel_speed: str | npt.ArrayLike | None = None,
    wheel_ticks: str | npt.ArrayLike | None = None,
    tick: float | None = None,
    gyro_noise: StatedNoise = None,
    accel_noise: StatedNoise = None,
    noise: ProcessNoise = "auto",
    calibration: Calibration | PathLike | None = None,
    clipped: Clipped = "auto",
    fix: bool = False,
    reference: Poses | Fixes | PathLike | None = None,
    reference_offset: float = 0.0,
    progress: Progress | None = None,
    **options: Unpack[NavigateOptions],
) -> Navigation:
    """Find the track of a vehicle from gyro, accelerometer and the fixes of a receiver.

    The recording is checked and corrected first. Then axes, antenna, clock and start are found,
    unless arguments or metadata state them. ``zerorate navigate`` does the same.

    Parameters
    ----------
    source : Recording, path, data frame or mapping of arrays
        Recording with a gyro and an accelerometer.
    fixes : Fixes or path, optional
        Fixes of the receiver. Default: fixes in the recording.
    mount : array_like, shape (3, 3), scipy Rotation, "auto" or "none"
        Rotation from the sensors' axes to forward, right, down. "auto": from the metadata, or else
        from the motion. "none": the sensors' axes are the body's axes.
    antenna : array_like, shape (3,), optional
        Vector from the sensors to the antenna, m forward, right, down. The filter improves this
        value.
    time_offset : float, TimeOffset or "auto"
        Offset to add to the times of the fixes, s. "auto": the best fit of sensors and fixes.
    heading : float or "course", optional
        Heading at the start, rad from north over east. "course": the direction of the first motion.
        By default the motion determines it.
    rest : tuple of float, optional
        Start and end of the first rest, s after the first sample. Default: found. Without a rest,
        the filter starts in motion.
    smooth : bool
        Use later fixes too (forward-backward pass).
    outages : float or sequence of float
        Lengths of simulated outages, s. In an outage the filter does not get the fixes. The
        differences from these fixes are the errors.
    vehicle : "wheeled", optional
        "wheeled": the vehicle does not slip sideways and stays on the ground.
    axle : array_like, shape (3,), optional
        Vector from the sensors to the unsteered axle, m.
    wheel_speed, wheel_ticks : str or array_like, shape (n,), optional
        Speed of the wheels, m/s, or ticks of the wheels. Name of a column, or values at the gyro's
        samples. Each of them implies a wheeled vehicle.
    tick : float, optional
        Distance per tick, m. Default: found from the receiver's speed.
    gyro_noise, accel_noise : NoiseModel or path, optional
        Noise of the sensors, or a file with it: JSON, or an ``imu.yaml`` of Kalibr. Default: noise
        of consumer sensors.
    noise : {"auto", "stated"}
        Process noise of the filter. "auto": `zerorate.navigation.find_noise` fits it, so that
        errors without fixes agree with the filter's standard deviations. Stated noise models are
        lower bounds. "stated": the stated noise models.
    calibration : Calibration or path, optional
        Calibration that corrects gyro and accelerometer first.
    clipped : {"auto", "restore", "leave"}
        Treatment of clipped rates. "auto": restore them from their flanks if there is no other
        explanation. "restore": restore them wherever the flanks predict larger rates. "leave": do
        not change them.
    fix : bool
        Correct the gyro's unit or axes if the motion clearly contradicts them.
    reference : Poses, Fixes or path, optional
        True track for comparison.
    reference_offset : float
        Offset to add to the times of the reference, s.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    pressure, baro_height : str, array_like, shape (n,), or Aid, optional
        Pressure, or height in m, of a barometer. Name of a column, values at the gyro's samples, or
        `zerorate.navigation.Aid`. Default: found by name (``pressure_hpa``, ``baro_alt_m``).
    pressure_unit : str, optional
        Pa, hPa, kPa, bar, inHg, mmHg or psi. Default: from the name, or from the pressure expected
        at the height of the fixes.
    compass : str, array_like, shape (n,), or Aid, optional
        Heading of a compass or of two antennas. Name of a column, values at the gyro's samples, or
        `zerorate.navigation.Aid`. Default: found by name (``heading_deg``, ``compass_deg``). The
        motion determines its sign and zero.
    compass_unit : {"deg", "rad"}, optional
        Unit of the compass. Default: from the name, the size of the values, or the motion.
    baseline_columns : str, array_like, shape (n, 3), or Aid, optional
        Measured vector between two antennas, m north, east, down. Names of columns, separated by
        commas, or values. Default: found by name (``baseline_north_m``).
    aids : {"auto", "stated"}
        "auto": also use aids that are found by name. "stated": use only aids that are given as
        arguments.
    mag : bool
        Use the recording's magnetometer as a compass. It is calibrated by the motion, levelled, and
        corrected by the local declination.
    baseline : array_like, shape (3,), optional
        Vector from the first to the second antenna, m forward, right, down.
    limits : dict of str to float, optional
        For each output, the largest standard deviation at which the output is valid. The keys are
        "position" and "height" (m), "velocity" (m/s), "attitude" and "heading" (rad). Default:
        limits of `zerorate.NavigationFilter`.
    **options
        Further options of `zerorate.NavigationFilter`: gate, adapt, covariance_step, kind,
        antenna_sigma, wheel_sigma, speed_sigma, barometer_sigma, barometer_walk, compass_sigma,
        compass_walk. If the source is a file, also arguments of `zerorate.read_recording`.

    Returns
    -------
    Navigation
        Track, start and errors. The result has the methods `table`, `plot` and `save`.

    Raises
    ------
    LogError
        If a sensor or the fixes are missing, gravity is absent, or the filter cannot start. The
        error's notes list contradictions in the recording.
    ValueError
        If an argument is out of range.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=180.0, seed=5)
    >>> found = zr.navigate(drive.recording(), drive.fixes.shifted(0.3))
    >>> found.notes[0].partition(":")[0]
    'the clock offset is the one with the best fit of sensors and fixes'
    """
    report = choose_reporter(progress)
    wheels = _Wheels.of(wheel_speed, wheel_ticks, tick)
    others: dict[str, Any] = {**options}
    request = AidRequest.take(others)
    mag, baseline, limits = (others.pop(name, None) for name in ("mag", "baseline", "limits"))
    wheeled = vehicle if wheels is None else "wheeled"
    reading, constants = split_options(others, NAVIGATION_OPTIONS, AidArguments.__optional_keys__)
    filter_options = {
        **_vehicle_options(wheeled, axle, constants),
        **_aid_options(baseline, limits),
        **_load_noise_models(gyro_noise, accel_noise),
        **constants,
    }
    lengths = _check_lengths(outages)
    correct = correction_of(calibration)
    truth = None if reference is None else _load_truth(reference, reference_offset)
    report("reading", 0.0)
    recording = one_imu_of(source, reading)
    with name_source_in_errors(recording.source):
        prepared = prepare(recording, Choices(fix=fix, clipped=clipped, correct=correct))
        used_fixes = prepare_fixes(_load_fixes(recording, fixes))
    alarms = list(prepared.alarms)
    with name_source_in_errors(recording.source, alarms):
        report("navigating", 0.1)
        channels = _drop_unusable(request.channels(source, prepared.recording), baseline, alarms)
        begin = partial(
            find_beginning, prepared.recording, used_fixes, mount=mount, antenna=antenna,
            time_offset=time_offset, rest=rest, noise=noise, **filter_options,
        )  # fmt: skip
        beginning = _begin_with_compass(begin, heading, channels, used_fixes, alarms)
        speed = None if wheels is None else _read_wheels(wheels, source, beginning, used_fixes)
        run = _Run(
            beginning,
            used_fixes,
            speed,
            smooth,
            lengths,
            filter_options,
            channels,
            bool(mag),
            alarms,
        )
        navigation = run.run(report)
    return replace(navigation, truth=truth, alarms=tuple(alarms))


def _read_wheels(
    wheels: _Wheels, source: Source, beginning: Beginning, fixes: Fixes
) -> Floats | Wheels:
    return wheels.read(
        source, beginning.recording, TimeOffset.of(beginning.time_offset).applied(fixes)
    )


def _drop_unusable(
    channels: list[Channel], baseline: npt.ArrayLike | None, alarms: list[str]
) -> list[Channel]:
    """Remove measured vectors between two antennas if `baseline` is not stated."""
    usable = [one for one in channels if one.kind != "baseline" or baseline is not None]
    for channel in channels:
        if channel not in usable:
            stated = keyword_argument("baseline", "1,0,0", "baseline=(1, 0, 0)")
            advice = "the vector between two antennas is not used; ", stated
            alarms.append(
                make_sentence(f"{channel.name}: ", *advice, " says it forward, right and down, m")
            )
    return usable


def _begin_with_compass(
    begin: Callable[..., Beginning],
    heading: Heading,
    channels: list[Channel],
    fixes: Fixes,
    alarms: list[str],
) -> Beginning:
    """Return the start, with the compass' heading if the motion determines none."""
    first_alarms: list[str] = []
    compass = [channel for channel in channels if channel.kind == "heading"]
    try:
        beginning = begin(heading=heading, alarms=first_alarms)
    except LogError:
        if heading is not None or not compass:
            alarms.extend(first_alarms)
            raise
        judged = judge_channels(compass, fixes, None)
        readings = judged.aids.get("heading")
        if readings is None:
            alarms.extend(first_alarms)
            raise
        first_alarms.clear()
        early = np.asarray(readings.value)[:_START_READINGS]
        angle = float(np.angle(np.exp(1j * early).mean()))
        beginning = begin(heading=angle, alarms=first_alarms)
        note = f"heading at the start by the compass: {format_heading(angle, 0)} deg"
        beginning = replace(beginning, notes=(*beginning.notes, note))
    alarms.extend(first_alarms)
    return beginning


@dataclass(frozen=True, eq=False)
class _Run:
    """A started navigation: the filter, the outages, the smoother."""

    beginning: Beginning
    fixes: Fixes
    speed: Floats | Wheels | None
    smooth: bool
    lengths: tuple[float, ...]
    options: dict[str, Any] = field(default_factory=dict)
    channels: list[Channel] = field(default_factory=list)
    mag: bool = False
    alarms: list[str] = field(default_factory=list)

    def run(self, progress: Progress) -> Navigation:
        """Return the track, and errors in outages if requested."""
        beginning = self.beginning
        nav = beginning.filter(**self.options)
        inputs: dict[str, Any] = {"wheel_speed": self.speed, "time_offset": beginning.time_offset}
        judged = self._judge_aids(nav, inputs)
        offset = abs(judged.heading_offset)
        if offset > _COMPASS_SIGMA_RAD and "compass_sigma" not in self.options:
            nav = beginning.filter(**self.options, compass_sigma=offset)
        inputs |= judged.aids
        keep: Literal["all", "track"] = "all" if self.smooth else "track"
        track = nav.copy().process(beginning.recording, self.fixes, keep=keep, **inputs)
        if not track.navigating.any():
            raise LogError(make_sentence("the filter did not start: ", explain_no_start(track)))
        nis = track.nis()
        progress("outages", 0.3)
        known = {"rest": None, **inputs}
        doubt = doubt_start(beginning.start, beginning.recording, self.fixes, nav, track, known)
        errors = None
        if self.lengths:
            gaps, part = OutagePlan(self.lengths, self.smooth), _scale_progress(progress, 0.3, 0.7)
            work = partial(gaps.run, beginning.recording, self.fixes, nav, track)
            errors = work(known, os.cpu_count() or 1, part)
        if self.smooth:
            progress("smoothing", 0.7)
            track = track.smooth()
        all_notes = (*beginning.notes, *judged.notes, doubt, *track.notes)
        notes = tuple(dict.fromkeys(filter(None, all_notes)))
        return Navigation(replace(track, notes=notes), beginning.start, nis, errors)

    def _judge_aids(self, nav: NavigationFilter, inputs: dict[str, Any]) -> AidInputs:
        """Return the aids after a comparison with the track without aids."""
        if not self.channels and not self.mag:
            return AidInputs()
        recording = self.beginning.recording
        track = nav.copy().process(recording, self.fixes, keep="track", **inputs)
        channels, notes = list(self.channels), list[str]()
        if self.mag and not any(channel.kind == "heading" for channel in channels):
            if recording.mag is None:
                raise LogError(
                    "there is no magnetometer; the recording has: " + ", ".join(recording)
                )
            found = find_field_heading(recording, self.fixes, track)
            notes += found.notes
            channels += [] if found.channel is None else [found.channel]
        judged = judge_channels(channels, self.fixes, track)
        source = recording.source
        self.alarms.extend(make_sentence(f"{source}: ", alarm) for alarm in judged.alarms)
        judged.notes[:0] = notes
        return judged


def _aid_options(
    baseline: npt.ArrayLike | None, limits: Mapping[str, float] | None
) -> dict[str, Any]:
    given = {"baseline": baseline, "limits": None if limits is None else dict(limits)}
    return {name: value for name, value in given.items() if value is not None}


def _scale_progress(progress: Progress, first: float, last: float) -> Progress:
    return lambda step, done: progress(step, first + (last - first) * done)


def _load_fixes(recording: Recording, fixes: Fixes | PathLike | None) -> Fixes:
    if isinstance(fixes, Fixes):
        return fixes
    if fixes is not None:
        return read_fixes(fixes)
    recorded = recording.fixes
    if recorded is None:
        raise LogError(
            make_sentence(
                "there are no fixes of a receiver; give ", keyword_argument("fixes", "", "fixes")
            )
        )
    return recorded


def _check_lengths(outages: float | Sequence[float]) -> tuple[float, ...]:
    lengths = np.atleast_1d(np.asarray(outages, dtype=np.float64)).tolist()
    if any(not 0.0 < length < math.inf for length in lengths):
        raise ArgumentError("outages", f"must be lengths above 0 s, got {outages}")
    return tuple(dict.fromkeys(lengths))


_WHEEL_OPTIONS: Final = ("wheel_sigma", "speed_sigma")


def _vehicle_options(
    vehicle: str | None, axle: npt.ArrayLike | None, constants: Mapping[str, Any]
) -> dict[str, Any]:
    wheeled = keyword_argument("vehicle", "wheeled", "vehicle='wheeled'")
    if vehicle is None:
        wheel_options = [name for name in _WHEEL_OPTIONS if name in constants]
        wheel_options += [] if axle is None else ["axle"]
        if wheel_options:
            raise ValueError(make_sentence(keyword_argument(wheel_options[0]), " needs ", wheeled))
        return {}
    return {"vehicle": vehicle} if axle is None else {"vehicle": vehicle, "axle": axle}


def _load_noise_models(
    gyro: NoiseModel | PathLike | None, accel: NoiseModel | PathLike | None
) -> dict[str, NoiseModel]:
    requested = {"gyro": (gyro, "angular rate"), "accel": (accel, "acceleration")}
    return {
        sensor: model if isinstance(model, NoiseModel) else _load_noise_model(Path(model), quantity)
        for sensor, (model, quantity) in requested.items()
        if model is not None
    }


def _load_noise_model(path: Path, quantity: str) -> NoiseModel:
    """Return the noise model in a file; of several axes, the worst for this quantity."""
    text = read_regular_text(path)
    if (model := _read_kalibr(text, quantity)) is not None:
        return model
    try:
        content = json.loads(text)
        axes = content.get("axes") if isinstance(content, dict) else None
        if not isinstance(axes, dict):
            return NoiseModel.from_json(path)
        models = [
            NoiseModel.from_json(json.dumps(model)) for model in axes.values() if model is not None
        ]
        matching = [model for model in models if model.quantity == quantity]
        if not matching:
            raise ValueError(f"no axis has a model of {quantity}")
        return worst_axis(matching)
    except json.JSONDecodeError:
        expected = "the JSON of 'zerorate allan --export json' or an imu.yaml of Kalibr"
        raise LogError(f"{path}: it holds no noise of this sensor; expected {expected}") from None
    except ValueError as error:
        text = str(error)
        raise LogError(text if text.startswith(str(path)) else f"{path}: {text}") from None


def _read_kalibr(text: str, quantity: str) -> NoiseModel | None:
    """Return a sensor's noise model from an ``imu.yaml`` of Kalibr; None if it has none.

    The file contains continuous-time densities; all other coefficients are unknown.
    """
    of: Quantity = "acceleration" if quantity == "acceleration" else "angular rate"
    sensor = "accelerometer" if of == "acceleration" else "gyroscope"
    names = (f"{sensor}_noise_density", f"{sensor}_random_walk")
    found = [re.search(rf"(?m)^[ \t]*{name}[ \t]*:[ \t]*([-+.\deE]+)", text) for name in names]
    white, walk = (None if match is None else float(match[1]) for match in found)
    if white is None and walk is None:
        return None
    return NoiseModel(white, rate_random_walk=walk, quantity=of)


def _load_truth(reference: Poses | Fixes | PathLike, offset: float) -> Poses | Fixes:
    """Return the true track, on the clock of the recording."""
    if isinstance(reference, Poses):
        return replace(reference, time=reference.time + offset) if offset else reference
    if isinstance(reference, Fixes):
        return reference.shifted(offset) if offset else reference
    try:
        return _load_truth(read_poses(reference), offset)
    except LogError as fault:
        try:
            return _load_truth(read_fixes(reference), offset)
        except (LogError, ValueError):
            raise fault from None


def files_of(
    result: Navigation, *, tum: bool = False, panels: Literal["usual", "all"] = "usual"
) -> Files:
    """Return the files of a navigation: log, maps and figure; with `tum` also the poses."""
    writers: list[Writer] = [
        lambda path: write_log(result.to_log(), path),
        lambda path: write_geojson(path, result.track, force=True),
        lambda path: write_gpx(path, result.track, force=True),
    ]
    endings = [".geojson", ".gpx"]
    if tum:
        writers.append(text_writer(result.poses().to_tum()))
        endings.append(".tum")
    figure = figure_writer(lambda: result.plot(panels))
    return Files("-zerorate-navigate", "", writers, endings, {"": figure})
