"""Attitude of a whole recording: orientation, standard deviations, and gyro errors."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Final, TypeAlias, cast

import numpy as np
import numpy.typing as npt

from zerorate._native import Attitude
from zerorate.attitude.events import EventBits, event_notes
from zerorate.attitude.options import ATTITUDE_METHODS
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.geometry.frames import FRAMES, Frame, from_enu, in_enu
from zerorate.geometry.rotations import about_z, euler_angles, product
from zerorate.geometry.scipy_rotation import Oriented
from zerorate.metrics.orientation import (
    Heading,
    OrientationErrors,
    heading_offset,
    orientation_errors,
)
from zerorate.progress import Progress, choose_reporter
from zerorate.record import Log, LogError, Poses, Recording
from zerorate.record.log import FORWARD_RIGHT_DOWN
from zerorate.record.samples import Samples
from zerorate.types import Booleans, Floats, Integers
from zerorate.views import OneArray, Result

METHODS: Final = ATTITUDE_METHODS
"""Methods of `zerorate.Attitude`."""

_BLOCK_SAMPLES: Final = 1 << 17
_MAX_MOMENTS: Final = 1000
_SAMPLE_FIELDS: Final = (
    "quaternion",
    "bias",
    "bias_sigma",
    "tilt_sigma",
    "heading_sigma",
    "linear_acceleration",
    "at_rest",
    "disturbed",
    "events",
)
_MOMENT_FIELDS: Final = ("gyro_matrix", "gyro_matrix_sigma")


@dataclass(frozen=True, eq=False)
class AttitudeEstimate(Oriented, OneArray, Result):
    """Attitude of a body over a recording of n samples, from `zerorate.estimate_attitude`.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the gyro's samples, s.
    rate : float
        Rate of the gyro, Hz.
    quaternion : ndarray, shape (n, 4)
        Quaternions w, x, y, z from the sensor's axes to the earth's axes. Where a gyro sample is
        missing, the value is a prediction.
    tilt_sigma, heading_sigma : ndarray, shape (n,)
        Standard deviations of tilt and heading, rad. Without a magnetometer, the heading is
        relative to the start.
    at_rest : ndarray of bool, shape (n,)
        Mask of samples at rest.
    disturbed : ndarray of bool, shape (n,)
        Mask of samples with a disturbed magnetic field.
    events : ndarray of uint16, shape (n,)
        Events at each sample, as the sum of their `zerorate.attitude.Event` values.
    linear_acceleration : ndarray, shape (n, 3)
        Acceleration without gravity in the sensor's axes, m/s^2. NaN if the accelerometer sample is
        missing.
    bias, bias_sigma : ndarray, shape (n, 3)
        Gyro bias and its standard deviation, rad/s.
    moments : ndarray of int64, shape (m,)
        Indices of the samples at which the next two arrays are stored. There are at most 1000
        indices. The last index is n - 1.
    gyro_matrices, gyro_matrix_sigmas : ndarray, shape (m, 3, 3)
        Matrix M in ``rate = M (gyro - bias)``, and the standard deviations of its elements.
    frame : {"enu", "ned", "nwu"}
        Earth axes.
    method : str
        Method of `zerorate.Attitude` that was used.
    offline : bool
        True if later samples were used.
    mag : bool
        True if a magnetometer was used.
    reference : ndarray, shape (n, 4), or None
        True quaternions w, x, y, z from the sensor's axes to `frame`. NaN marks missing values.
        None without a reference.
    source : str
        Name of the recording.
    notes : tuple of str
        Sentences on the recording and on assumptions.
    compared_heading : {"absolute", "relative", "aligned"}
        Default of the argument ``heading`` of the method `errors`. It is "relative" without a
        magnetometer. It is "aligned" for a reference with its own north, such as a camera.
    alarms : tuple of str
        Sentences on contradictions in the recording.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=20.0, seed=2)
    >>> found = zr.estimate_attitude(motion.recording(), mag=False)
    >>> found.n, found.euler.shape, bool(found.tilt_sigma[-1] < np.radians(1.0))
    (2000, (2000, 3), True)
    """

    _array_field: ClassVar[str] = "quaternion"

    time: Floats
    rate: float
    quaternion: Floats
    tilt_sigma: Floats
    heading_sigma: Floats
    at_rest: Booleans
    disturbed: Booleans
    events: EventBits
    linear_acceleration: Floats
    bias: Floats
    bias_sigma: Floats
    moments: Integers
    gyro_matrices: Floats
    gyro_matrix_sigmas: Floats
    frame: Frame
    method: str
    offline: bool
    mag: bool
    reference: Floats | None = None
    source: str = "the recording"
    notes: tuple[str, ...] = ()
    compared_heading: Heading = "absolute"
    alarms: tuple[str, ...] = ()

    @property
    def n(self) -> int:
        """Number of samples, including missing samples."""
        return len(self.time)

    @property
    def euler(self) -> Floats:
        """Roll, pitch and yaw, rad, shape (n, 3): rotations about x, y and z, yaw applied first.

        Yaw and roll are between -pi and pi, pitch is between -pi/2 and pi/2. In NED, yaw is
        positive from north to east. In ENU, yaw is positive from east to north.
        """
        return euler_angles(self.quaternion)

    @property
    def gyro_matrix(self) -> Floats:
        """Matrix M in ``rate = M (gyro - bias)`` at the end of the recording, shape (3, 3)."""
        last: Floats = self.gyro_matrices[-1]
        return last

    @property
    def gyro_matrix_sigma(self) -> Floats:
        """Standard deviations of the elements of `gyro_matrix`, shape (3, 3)."""
        last: Floats = self.gyro_matrix_sigmas[-1]
        return last

    def errors(
        self, where: npt.ArrayLike | None = None, heading: Heading | None = None
    ) -> OrientationErrors:
        """Return the errors relative to the reference.

        Parameters
        ----------
        where : array_like of bool, shape (n,), optional
            Mask of the samples to use, for example ``~estimate.at_rest`` for motion. Default: all
            samples.
        heading : {"absolute", "relative", "aligned"}, optional
            Treatment of headings, as in `zerorate.metrics.orientation_errors`. Default:
            `compared_heading`.

        Raises
        ------
        ValueError
            If there is no reference, or the reference has no sample in `where`.
        """
        if self.reference is None:
            raise ValueError("there are no errors: the recording has no true orientation")
        return orientation_errors(
            self.quaternion, self.reference, where=where, heading=heading or self.compared_heading
        )

    def heading_offset(self) -> float:
        """Return the angle about the vertical between estimate and reference, rad.

        Raises
        ------
        ValueError
            As in `errors`.
        """
        if self.reference is None:
            raise ValueError("there is no offset: the recording has no true orientation")
        return heading_offset(self.quaternion, self.reference)

    def poses(self) -> Poses:
        """Return the orientations as poses with position zero, for export to evo."""
        return Poses(self.time, np.zeros((self.n, 3)), self.quaternion, self.source)

    def to_log(self) -> Log:
        """Return a log of the quaternion, for `zerorate.write_log`.

        Its extra columns are:

        - Euler angles and standard deviations, deg
        - flags for rest and for a disturbed field
        - bias, deg/s
        - acceleration, m/s^2

        Examples
        --------
        >>> import zerorate as zr
        >>> motion = zr.simulate_motion("hand", duration=20.0)
        >>> log = zr.estimate_attitude(motion.recording()).to_log()
        >>> log
        Log(2000 samples at 100 Hz, 20 s, 1: quat_w, quat_x, quat_y, quat_z)
        >>> list(log.extra)[:5]
        ['roll_deg', 'pitch_deg', 'yaw_deg', 'tilt_sigma_deg', 'heading_sigma_deg']
        """
        names = tuple(f"quat_{axis}" for axis in "wxyz")
        meta = {"source": self.source, "notes": self.notes}
        extra = dict(self._extra())
        return Log.at(self.time, self.rate, self.quaternion, names, "1", meta, extra)

    def _extra(self) -> Iterator[tuple[str, Floats | Booleans]]:
        for name, angles in zip(("roll", "pitch", "yaw"), self.euler.T, strict=True):
            yield f"{name}_deg", np.degrees(angles)
        yield "tilt_sigma_deg", np.degrees(self.tilt_sigma)
        yield "heading_sigma_deg", np.degrees(self.heading_sigma)
        yield "at_rest", self.at_rest
        yield "disturbed", self.disturbed
        for axis, values in zip("xyz", self.bias.T, strict=True):
            yield f"bias_{axis}_dps", np.degrees(values)
        for axis, values in zip("xyz", self.linear_acceleration.T, strict=True):
            yield f"linear_{axis}_mps2", values

    def __repr__(self) -> str:
        """Return the number of samples, the method and the frame."""
        axes = "nine" if self.mag else "six"
        way = ", offline" if self.offline else ""
        return (
            f"AttitudeEstimate({self.n} samples at {self.rate:g} Hz, {axes} axes, {self.method}"
            f"{way}, {self.frame})"
        )


def attitude_of(
    recording: Recording,
    *,
    frame: Frame | None = None,
    method: str = "auto",
    offline: bool = False,
    mag: bool = True,
    declination: float = 0.0,
    gyro: str = "gyro",
    accel: str | None = None,
    reference: Poses | None = None,
    reference_frame: Frame | None = None,
    progress: Progress | None = None,
    **constants: Any,  # noqa: ANN401
) -> AttitudeEstimate:
    """Return the attitude of a body over an unchecked recording, by `zerorate.Attitude`.

    Use `zerorate.estimate_attitude` to check and correct the recording first. The result is on the
    gyro's clock. If another sensor has its own clock, each of its samples is processed with the
    next gyro sample. Lost samples count as missing.

    Parameters
    ----------
    recording : Recording
        Recording with a gyro and an accelerometer of three axes and known units. A magnetometer is
        optional and may have any unit. A reference is optional: channels w, x, y, z with the true
        orientation from sensor to earth. It is needed for errors.
    frame : {"enu", "ned", "nwu"}
        Earth axes: "enu" is east, north, up; "ned" is north, east, down; "nwu" is north, west, up.
        North is magnetic north, or true north with `declination`. Default "enu". If the gyro's log
        states axes forward, right, down, as a PX4 log does, the default is "ned". A level body then
        has zero roll.
    method : str
        A method of `zerorate.Attitude`. Default "auto", which needs no settings.
    offline : bool
        True uses the whole recording for each sample, including later samples. Default False.
    mag : bool
        True uses a magnetometer if the recording has it. Without a magnetometer the heading is
        relative to the start and drifts. Default True.
    declination : float
        Angle from true north to magnetic north, rad, positive east, from a field model. If it is
        given, the orientation is relative to true north. Default 0.
    gyro, accel : str
        Names of the sensors if there are several, such as ``"gyro_1"``. Default: the first gyro,
        and the accelerometer of the same device.
    reference : Poses, optional
        True orientation, such as from a camera, with times on the gyro's clock. It replaces the
        recording's reference. Its north is arbitrary, so the headings are aligned.
    reference_frame : {"enu", "ned", "nwu"}, optional
        Earth axes of the reference. Default: `frame`.
    progress : callable, optional
        Called with the name of the step and the fraction done. Default: a progress bar in a
        notebook.
    **constants
        Further arguments of `zerorate.Attitude`, such as the constants of its named methods.

    Returns
    -------
    AttitudeEstimate
        Arrays in SI units. ``table()`` and ``plot()`` show deg.

    Raises
    ------
    LogError
        If the gyro or the accelerometer is missing, does not have three axes, or has an unknown
        unit.
    ValueError
        If the method or the frame is unknown, or the method cannot run offline. Also if a
        declination is given without a magnetometer.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=30.0, seed=2)
    >>> attitude = zr.attitude.attitude_of(motion.recording())
    >>> attitude
    AttitudeEstimate(3000 samples at 100 Hz, nine axes, auto, enu)
    >>> bool(np.degrees(attitude.errors().inclination) < 1.0)
    True
    """
    _check_frame(reference_frame)
    samples = Samples.of(recording, gyro, accel, mag)
    requested_frame, frame = frame, frame or _default_frame(samples.log)
    uses_mag = samples.mag is not None
    _check_declination(declination, uses_mag)
    # The filter rejects unknown names.
    settings: Any = {"mag": uses_mag, "frame": frame, "method": method, **constants}
    filter_: Any = Attitude(samples.log.rate, **settings)
    report = choose_reporter(progress)
    run = _smooth if offline else _trace
    with warnings.catch_warnings(record=True) as messages:
        warnings.simplefilter("always")
        arrays, moments, matrices = run(filter_, samples, report)
    events = arrays["events"].astype(np.uint16)
    arrays = {**arrays, "events": events}
    if declination:
        arrays = {
            **arrays,
            "quaternion": _rotate_to_true_north(arrays["quaternion"], frame, declination),
        }
    return AttitudeEstimate(
        time=samples.time,
        rate=samples.log.rate,
        moments=moments,
        gyro_matrices=matrices["gyro_matrix"],
        gyro_matrix_sigmas=matrices["gyro_matrix_sigma"],
        frame=frame,
        method=method,
        offline=offline,
        mag=uses_mag,
        reference=_reference_orientation(recording, samples, reference, reference_frame, frame),
        compared_heading=_default_heading(uses_mag, reference),
        source=recording.source,
        notes=(
            *_filter_warnings(messages),
            *_axes_notes(samples.log, requested_frame),
            *samples.notes,
            *event_notes(events, arrays["at_rest"], samples.time, samples.log.rate),
            *_recording_notes(recording, mag, uses_mag),
        ),
        **cast(dict[str, Any], arrays),
    )


_FilterRun: TypeAlias = tuple[Mapping[str, npt.NDArray[Any]], Integers, Mapping[str, Floats]]


def _check_frame(reference_frame: Frame | None) -> None:
    if reference_frame is not None and reference_frame not in FRAMES:
        raise ArgumentError(
            "reference_frame", f"must be one of {', '.join(FRAMES)}, got {reference_frame!r}"
        )


def _check_declination(declination: float, uses_mag: bool) -> None:
    if not abs(declination) <= math.pi:
        raise ArgumentError("declination", f"must be -pi to pi rad, got {declination}")
    if declination and not uses_mag:
        raise ArgumentError("declination", "has no effect: no magnetometer is used")


def _rotate_to_true_north(quaternion: Floats, frame: Frame, declination: float) -> Floats:
    """Rotate orientations from magnetic north to true north."""
    return from_enu(product(about_z(-declination), in_enu(quaternion, frame)), frame)


def _choose_moments(n: int) -> Integers:
    """Return at most 1000 sample indices in even steps, including the last sample."""
    return np.unique(np.linspace(0, n - 1, min(n, _MAX_MOMENTS)).round().astype(np.int64))


def _trace(filter_: Any, samples: Samples, progress: Progress) -> _FilterRun:  # noqa: ANN401
    """Filter in blocks, because the matrices of all samples would need most of the memory."""
    n = samples.log.n
    moments, blocks = _choose_moments(n), {name: [] for name in (*_SAMPLE_FIELDS, *_MOMENT_FIELDS)}  # type: ignore[var-annotated]
    for first in range(0, n, _BLOCK_SAMPLES):
        part = slice(first, min(first + _BLOCK_SAMPLES, n))
        traced = filter_.trace(*_filter_arguments(samples, part))
        inside = moments[(moments >= part.start) & (moments < part.stop)] - first
        for name in _SAMPLE_FIELDS:
            blocks[name].append(traced[name])
        for name in _MOMENT_FIELDS:
            blocks[name].append(traced[name][inside])
        progress("attitude", part.stop / n)
    whole = {name: np.concatenate(parts) for name, parts in blocks.items()}
    return (
        {name: whole[name] for name in _SAMPLE_FIELDS},
        moments,
        {name: whole[name] for name in _MOMENT_FIELDS},
    )


def _smooth(filter_: Any, samples: Samples, progress: Progress) -> _FilterRun:  # noqa: ANN401
    # The smoother runs forward and backward in one call, so there is no progress in between.
    progress("attitude", 0.1)
    traced: Mapping[str, npt.NDArray[Any]] = filter_.smooth(
        *_filter_arguments(samples, slice(None))
    )
    progress("attitude", 1.0)
    moments = _choose_moments(samples.log.n)
    arrays = {name: traced[name] for name in _SAMPLE_FIELDS}
    return arrays, moments, {name: traced[name][moments] for name in _MOMENT_FIELDS}


def _filter_arguments(samples: Samples, part: slice) -> tuple[Floats | None, ...]:
    listed = (samples.gyro, samples.accel, samples.mag, samples.dt)
    return tuple(None if values is None else values[part] for values in listed)


def _reference_orientation(
    recording: Recording,
    samples: Samples,
    poses: Poses | None,
    poses_frame: Frame | None,
    frame: Frame,
) -> Floats | None:
    """Return the true orientation in a frame: the given poses or the recording's reference."""
    orientation = (
        _recorded_reference(recording, samples)
        if poses is None
        else _interpolate_poses(poses, samples)
    )
    if orientation is None or poses_frame is None:
        return orientation
    return from_enu(in_enu(orientation, poses_frame), frame)


def _recorded_reference(recording: Recording, samples: Samples) -> Floats | None:
    """Return the recording's true orientation; None if it is missing or on another clock."""
    logs = [log for log in recording.of_kind("reference") if log.channels == 4]
    if len(logs) != 1:
        return None
    values = samples.align(logs[0])
    return values if np.isfinite(values).all(axis=1).any() else None


def _interpolate_poses(poses: Poses, samples: Samples) -> Floats:
    """Return the true orientation at the samples. Raises LogError if the times do not overlap."""
    quaternions = poses.at(samples.time).quaternion
    if not np.isfinite(quaternions).all(axis=1).any():
        own, other = (f"{t[0]:.2f} to {t[-1]:.2f} s" for t in (samples.time, poses.time))
        raise LogError(
            make_sentence(
                f"{poses.source} is of {other}, and the log of {own}: both must be on one clock, ",
                keyword_argument("reference_offset", "S", "so shift its time"),
            )
        )
    return quaternions


def _default_heading(mag: bool, reference: Poses | None) -> Heading:
    if reference is not None:
        return "aligned"
    return "absolute" if mag else "relative"


def _filter_warnings(messages: Iterable[warnings.WarningMessage]) -> Iterator[str]:
    """Yield the filter's warnings. They do not name the file."""
    for message in messages:
        yield str(message.message).replace("is accel_unit right", "is its unit right")


def _default_frame(gyro: Log) -> Frame:
    return "ned" if gyro.meta.get("axes") == FORWARD_RIGHT_DOWN else "enu"


def _axes_notes(gyro: Log, requested_frame: Frame | None) -> Iterator[str]:
    """Yield a sentence if the log's known axes chose the frame or contradict it."""
    if gyro.meta.get("axes") != FORWARD_RIGHT_DOWN or requested_frame == "ned":
        return
    text = f"the log's axes point {FORWARD_RIGHT_DOWN}"
    if requested_frame is None:
        yield f"{text}: angles are to north, east, down"
    else:
        yield f"{text}: level, the roll is 180 deg in this frame, and 0 in north, east, down (ned)"


def _recording_notes(recording: Recording, mag_requested: bool, uses_mag: bool) -> Iterator[str]:
    if mag_requested and not uses_mag:
        yield "there is no magnetometer: the heading is relative to the start and drifts"
    if len([log for log in recording.of_kind("reference") if log.channels == 4]) > 1:
        yield "there are several references of four columns, so none is used"
