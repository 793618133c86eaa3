"""Track of a vehicle: positions with standard deviations, from the filter or the smoother."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from zerorate._native import NavigationFilter, NavigationRecord
from zerorate.faults import keyword_argument, make_sentence
from zerorate.geometry.earth import local_ned, offset_position
from zerorate.geometry.frames import in_enu
from zerorate.geometry.rotations import (
    from_rotation_vectors,
    inverse,
    product,
    rotate,
    to_rotation_vectors,
)
from zerorate.geometry.scipy_rotation import Oriented, RotationLike, as_quaternions
from zerorate.navigation.aid_notes import describe_aids
from zerorate.navigation.aids import OUTPUTS, AidResults, AidRows, judge_sigma, unpack_usable
from zerorate.navigation.events import Events
from zerorate.numerals import format_with_error
from zerorate.record import Log, Poses
from zerorate.record.missing import floats
from zerorate.types import Booleans, Floats, Integers
from zerorate.views import Result, figure_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from zerorate.navigation.outage import Outages

STATUSES: Final = ("waiting", "no heading", "navigating", "coasting", "missing")
"""Names of the values of `Track.status`."""

VERDICTS: Final = ("used", "rejected", "refused", "not reached")
"""Names of the values of `Track.verdict`."""

_ANTENNA_SIGMAS: Final = 3.0
"""Distance from its stated position, in standard deviations, that marks a misplaced antenna."""
_WHEEL_UNIT_FACTORS: Final = np.array([100.0, 180.0 / np.pi, 180.0 / np.pi])
"""Factors from scale, yaw and pitch of the wheels to percent, deg and deg."""

_BIAS_UNITS: Final = {"gyro": "radps", "accel": "mps2"}


Steps = dict[str, npt.NDArray[Any]]
"""Smoother results at each covariance step, as in ``NavigationRecord.smoothed``."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """Arrays for ``NavigationFilter.process_arrays``, in the order of its arguments."""

    time: Floats
    gyro: Floats
    accel: Floats
    fixes: Events
    rest: Booleans | None = None
    speed: Floats | None = None
    aids: AidRows = field(default_factory=lambda: AidRows(np.empty((0, 8))))


class SmoothableTrack:
    """Track with the covariance steps that a smoother needs."""

    time: Floats
    position: Floats
    velocity: Floats
    quaternion: Floats
    gyro_bias: Floats
    accel_bias: Floats
    sigma: Floats
    _steps: NavigationRecord | Steps | None

    @property
    def n(self) -> int:
        """Number of samples."""
        return len(self.time)

    @property
    def navigating(self) -> Booleans:
        """Mask of samples with a known position, shape (n,)."""
        known: Booleans = np.isfinite(self.position[:, 0])
        return known

    def _apply_errors(self, error: Floats, sigma: Floats) -> dict[str, Any]:
        """Return the fields of the smoothed track, without the position, from errors (n, 15)."""
        turn = from_rotation_vectors(error[:, 6:9])
        known = self.navigating[:, np.newaxis]
        return {
            "velocity": rotate(turn, self.velocity - error[:, 3:6]),
            "quaternion": np.where(known, product(turn, self.quaternion), self.quaternion),
            "gyro_bias": self.gyro_bias + error[:, 9:12],
            "accel_bias": self.accel_bias + error[:, 12:],
            "sigma": np.where(known, sigma, self.sigma),
            "smoothed": True,
            "_steps": None,
        }

    def __getstate__(self) -> dict[str, Any]:
        """Return the pickled state: the smoother's result instead of the ten times larger steps."""
        steps = self._steps
        smoothed = steps.smoothed() if isinstance(steps, NavigationRecord) else steps
        return {**vars(self), "_steps": smoothed}


@dataclass(frozen=True, eq=False, repr=False)
class Track(Oriented, SmoothableTrack, Result):
    """Track of a vehicle over n samples, as ``NavigationFilter.process`` returns it.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples, s.
    position : ndarray, shape (n, 3)
        Position of the sensors: latitude and longitude (deg), height (m). NaN while unknown.
    velocity : ndarray, shape (n, 3)
        Velocity north, east, down, m/s.
    quaternion : ndarray, shape (n, 4)
        Quaternions w, x, y, z from the body's axes to north, east, down.
    gyro_bias, accel_bias : ndarray, shape (n, 3)
        Biases of the gyro (rad/s) and the accelerometer (m/s^2).
    sigma : ndarray, shape (n, 15)
        Standard deviations, three columns each:

        - position, m
        - velocity, m/s
        - orientation about north, east and down, rad
        - gyro bias, rad/s
        - accelerometer bias, m/s^2
    status : ndarray of uint8, shape (n,)
        Status of the filter: an index into `zerorate.navigation.STATUSES`.
    fixes : ndarray, shape (m, 13)
        Fixes of the receiver. The columns are time, position, velocity, and the standard deviations
        of position and velocity.
    verdict : ndarray of uint8, shape (m,)
        Verdict on each fix: an index into `zerorate.navigation.VERDICTS`.
    taken : ndarray, shape (m,)
        Time of the sample after which each fix was processed, s. NaN for fixes after the last
        sample.
    fix_count : dict of str to int
        Number of fixes by verdict: "used", "rejected" and "refused".
    rejected_count : dict of str to int
        Number of "positions" and "velocities" that the gate rejected.
    usable : ndarray of bool, shape (n, 5)
        True where the standard deviation of an output is within its limit.
        `zerorate.navigation.OUTPUTS` names the columns.
    limits : dict of str to float
        Limits of the standard deviations, as in ``NavigationFilter.limits``.
    aids : dict of str to AidResults
        Readings of the aids with their verdicts, by kind: "height", "pressure", "heading",
        "baseline".
    smoothed : bool
        True if the smoother made the track: each sample then uses all fixes.
    epoch : float, optional
        Unix time at which `time` is zero.
    source : str
        Name of the recording.
    notes : tuple of str
        Sentences on omissions and assumptions.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=120.0, seed=1)
    >>> start = zr.align(drive.recording(), latitude=48.0, heading="course")
    >>> track = zr.NavigationFilter(start).process(drive.recording(), drive.fixes)
    >>> track.n, track.position.shape, track.fix_count["rejected"], track.smoothed
    (12000, (12000, 3), 0, False)
    """

    time: Floats
    position: Floats
    velocity: Floats
    quaternion: Floats
    gyro_bias: Floats
    accel_bias: Floats
    sigma: Floats
    status: npt.NDArray[np.uint8]
    fixes: Floats
    verdict: npt.NDArray[np.uint8]
    taken: Floats
    fix_count: dict[str, int]
    rejected_count: dict[str, int]
    usable: Booleans = field(default_factory=lambda: np.empty((0, len(OUTPUTS)), dtype=bool))
    limits: dict[str, float] = field(default_factory=dict)
    aids: dict[str, AidResults] = field(default_factory=dict)
    smoothed: bool = False
    epoch: float | None = None
    source: str = "the recording"
    notes: tuple[str, ...] = ()
    _nis: Floats | None = field(default=None, compare=False)
    _steps: NavigationRecord | Steps | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        """Return the numbers of samples and fixes; a smoothed track is marked."""
        span = float(np.ptp(self.time)) if self.n else 0.0
        best = ", smoothed" if self.smoothed else ""
        counts = ", ".join(f"{count} {name}" for name, count in self.fix_count.items())
        return f"Track({self.n} samples in {span:.6g} s, fixes: {counts}{best})"

    def errors(
        self,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike | None = None,
        quaternion: RotationLike | None = None,
    ) -> Floats:
        """Return the track minus the truth.

        Parameters
        ----------
        position : array_like, shape (n, 3)
            True latitude and longitude (deg) and height (m).
        velocity : array_like, shape (n, 3), optional
            True velocity north, east, down, m/s.
        quaternion : array_like, shape (n, 4), or scipy Rotation of length n, optional
            True quaternions w, x, y, z from the body's axes to north, east, down.

        Returns
        -------
        ndarray, shape (n, 3), (n, 6) or (n, 9)
            Errors north, east, down, with three columns per quantity in the order of `sigma`:
            position (m), velocity (m/s) and orientation (rotation vector, rad).
        """
        parts = [local_ned(self.position, floats(position, "position"))]
        if velocity is not None:
            parts.append(self.velocity - floats(velocity, "velocity"))
        if quaternion is not None:
            truth = floats(as_quaternions(quaternion), "quaternion")
            back = product(truth, inverse(self.quaternion))
            parts.append(to_rotation_vectors(back))
        return np.hstack(parts)

    def poses(self, origin: npt.ArrayLike | None = None) -> Poses:
        """Return the track in metres east, north and up from an origin, as in TUM files and evo.

        Parameters
        ----------
        origin : array_like, shape (3,), optional
            Latitude and longitude (deg) and height (m) of the origin. Default: the first known
            position.

        Returns
        -------
        Poses
            Poses at the samples with a known position. Orientations are from the body's axes
            (forward, right, down) to east, north, up.

        Raises
        ------
        ValueError
            If the filter never navigated.
        """
        navigating = self.navigating
        if not navigating.any():
            raise ValueError("the filter never navigated, so there is no pose")
        begin = self.position[navigating][0] if origin is None else floats(origin, "origin")
        ned = local_ned(self.position[navigating], begin)
        position = ned[:, (1, 0, 2)] * (1.0, 1.0, -1.0)
        return Poses(
            self.time[navigating], position, in_enu(self.quaternion[navigating], "ned"), self.source
        )

    def nis(self) -> Floats:
        """Return the normalised innovations squared of each fix, shape (m, 2).

        The columns are position and velocity. Their mean is 3 in a consistent filter. Fixes that
        the gate rejected are included. A value is NaN if the fix was out of sequence, has no
        velocity, or started the track.

        Raises
        ------
        ValueError
            If the track is smoothed.
        """
        if self._nis is None:
            raise ValueError("this track is smoothed")
        return self._nis.copy()

    def smooth(self) -> Track:
        """Return the smoothed track: each sample uses all fixes, earlier and later.

        The smoother runs backward over the steps of the covariance, and interpolates between two
        steps. ``process`` keeps about 2.5 kB for each step. At the last sample the result is the
        filter's estimate.

        Raises
        ------
        ValueError
            If the track is already smoothed, or ``process`` did not keep the data for the smoother.
        MemoryError
            If there is not enough memory for the smoother's result.
        """
        steps = smooth_steps(self._steps, self.smoothed)
        if not len(steps["sample"]):
            return replace(self, smoothed=True, _nis=None, _steps=None)
        error, sigma = interpolate_steps(self.time, steps)
        position = offset_position(self.position, -error[:, :3])
        fields = self._apply_errors(error, sigma)
        usable = judge_sigma(fields["sigma"], self.limits) if self.limits else self.usable
        return replace(self, position=position, usable=usable, _nis=None, **fields)

    def to_log(self) -> Log:
        """Return a log of latitude, longitude and height, for `zerorate.write_log`.

        Its extra columns are:

        - velocity, m/s
        - quaternion
        - biases, rad/s and m/s^2
        - standard deviations of biases, position, velocity and orientation
        - a flag for each usable output
        - a flag for samples with a known position
        """
        names = ("latitude_deg", "longitude_deg", "height_m")
        meta = {"source": self.source, "notes": self.notes}
        rate = (self.n - 1) / float(np.ptp(self.time)) if self.n > 1 else 1.0
        ned = ("north", "east", "down")
        extra: dict[str, Floats | Booleans] = {}
        for axis, values in zip(ned, self.velocity.T, strict=True):
            extra[f"velocity_{axis}_mps"] = values
        for axis, values in zip("wxyz", self.quaternion.T, strict=True):
            extra[f"quat_{axis}"] = values
        for kind, unit in _BIAS_UNITS.items():
            for axis, values in zip("xyz", getattr(self, f"{kind}_bias").T, strict=True):
                extra[f"{kind}_bias_{axis}_{unit}"] = values
        units = (("position", "m"), ("velocity", "mps"), ("tilt", "rad"))
        for k, (kind, unit) in enumerate(units):
            for axis, values in zip(ned, self.sigma[:, 3 * k : 3 * k + 3].T, strict=True):
                extra[f"{kind}_sigma_{axis}_{unit}"] = values
        for name, within in zip(OUTPUTS, self.usable.T, strict=True):
            extra[f"{name}_usable"] = within
        extra["navigating"] = self.navigating
        return Log.at(self.time, rate, self.position, names, "deg, deg, m", meta, extra)

    def plot(
        self, outages: Outages | None = None, *, ax: Axes | Sequence[Axes] | None = None
    ) -> Figure:
        """Return a figure of the track, with the outages of ``zerorate.navigation.outages`` marked.

        With `ax`, only the path is drawn, on these axes. Raises ImportError without matplotlib
        (extra ``plot``).
        """
        return figure_of(self, outages, ax=ax)


def run_navigation(
    nav: NavigationFilter,
    inputs: Inputs,
    *,
    source: str,
    epoch: float | None = None,
    notes: tuple[str, ...] = (),
    keep: bool = True,
) -> Track:
    """Run a filter over arrays and return its track. With `keep` the track can be smoothed."""
    before = nav.copy()
    output, steps = nav.process_arrays(
        inputs.time,
        inputs.gyro,
        inputs.accel,
        inputs.fixes.rows,
        inputs.rest,
        record=keep,
        wheel_speed=inputs.speed,
        aids=inputs.aids.rows,
    )
    aids = inputs.aids.results(output)
    counts = _count_since(before.fix_count, nav.fix_count)
    if not inputs.fixes.is_joint:
        output = inputs.fixes.merge(output)
        verdicts = np.bincount(output["verdict"], minlength=len(VERDICTS))
        counts = dict(zip(counts, verdicts.tolist(), strict=False))
    for name in ("innovation", "innovation_sigma"):
        del output[name]
    return Track(
        time=inputs.time,
        fixes=inputs.fixes.to_rows(),
        fix_count=counts,
        usable=unpack_usable(output.pop("usable")),
        limits=nav.limits,
        aids=aids,
        rejected_count=_count_since(before.rejected_count, nav.rejected_count),
        epoch=epoch,
        source=source,
        notes=(
            *_describe_moves(before, nav),
            *_describe_constants(before, nav),
            *describe_aids(nav, aids),
            *notes,
        ),
        _nis=output.pop("nis"),
        _steps=steps,
        **output,
    )


def _count_since(before: dict[str, int], now: dict[str, int]) -> dict[str, int]:
    return {name: count - before[name] for name, count in now.items()}


def _describe_moves(before: NavigationFilter, nav: NavigationFilter) -> Iterator[str]:
    """Describe the filter's jumps to positions that it had rejected at first."""
    moves = nav.move_count - before.move_count
    if not moves or nav.last_move is None:
        return
    time, distance = nav.last_move
    size = f"{distance:.0f} m" if distance < 10_000.0 else f"{distance / 1000.0:.0f} km"
    count = "" if moves == 1 else f", the last of {moves} times"
    yield (
        f"at {time:.2f} s ten positions in a row were rejected, and the filter moved to them, "
        f"{size} away{count}: either they are wrong or the filter was"
    )


def _describe_constants(before: NavigationFilter, nav: NavigationFilter) -> Iterator[str]:
    """Describe the estimated antenna position and wheel scale."""
    if (before.antenna_sigma != nav.antenna_sigma).any():
        fitted = ", ".join(map(format_with_error, nav.antenna, nav.antenna_sigma))
        stated = ", ".join(f"{x:g}" for x in before.antenna)
        displaced = np.abs(nav.antenna - before.antenna) > _ANTENNA_SIGMAS * before.antenna_sigma
        if displaced.any():
            yield (
                f"the antenna is not at its stated position: {fitted} m forward, right and down of "
                f"the sensors fit best, not {stated}"
            )
        else:
            yield f"the antenna is {fitted} m forward, right and down of the sensors"
    if np.isfinite(nav.wheel_constants[0]):
        scale, yaw, pitch = map(
            format_with_error,
            nav.wheel_constants * _WHEEL_UNIT_FACTORS,
            nav.wheel_constants_sigma * _WHEEL_UNIT_FACTORS,
        )
        yield (
            f"the wheels roll {scale} % faster than measured, along an axis {yaw} deg right of "
            f"and {pitch} deg above forward"
        )


def explain_no_start(track: Track) -> str:
    """Return the reason why a filter did not start to navigate."""
    fixes, time = track.fixes[:, 0], track.time
    if not len(fixes) or not len(time):
        return "there are no fixes" if len(time) else "there are no samples"
    if not ((fixes >= time[0]) & (fixes <= time[-1])).any():
        return make_sentence(
            f"its samples are from {time[0]:.6g} to {time[-1]:.6g} s and the fixes from "
            f"{fixes[0]:.6g} to {fixes[-1]:.6g} s: ",
            keyword_argument("time_offset"),
            " moves these",
        )
    if STATUSES[int(track.status[-1])] == "no heading":
        return make_sentence(
            "the heading is not known, and the vehicle not above 1 m/s: ",
            keyword_argument("heading"),
            " says it",
        )
    return "no fix was used after the vehicle was aligned"


def smooth_steps(
    steps: NavigationRecord | Steps | None, smoothed: bool, deviations: bool = True
) -> Steps:
    """Return the smoother's result at the steps of a track. Raises ValueError without steps."""
    if smoothed:
        raise ValueError("this track is smoothed")
    if steps is None:
        raise ValueError("only the track was kept: use process(..., keep='all')")
    return steps if isinstance(steps, dict) else steps.smoothed(deviations)


def interpolate_steps(time: Floats, steps: Steps) -> tuple[Floats, Floats]:
    """Return error and standard deviation at each sample, interpolated between steps."""
    last, following, part = _bracket_steps(time, steps, np.arange(len(time)))
    error = (1.0 - part) * steps["after"][last] + part * steps["before"][following]
    sigma = (1.0 - part) * steps["sigma"][last] + part * steps["sigma"][following]
    return error, sigma


def _bracket_steps(
    time: Floats, steps: Steps, samples: Integers
) -> tuple[Integers, Integers, Floats]:
    """Return the steps before and after each sample, and the fraction between them, (m, 1)."""
    at = steps["sample"].astype(np.intp)
    last = np.clip(np.searchsorted(at, samples, side="right") - 1, 0, len(at) - 1)
    following = np.minimum(last + 1, len(at) - 1)
    # After a restart of the filter, the steps before it have no information.
    joined = (following > last) & ~steps["begins"][following].astype(bool)
    begin, end = time[at[last]], time[at[following]]
    part = np.where(joined, (time[samples] - begin) / np.where(joined, end - begin, 1.0), 0.0)
    return last, following, np.clip(part, 0.0, 1.0)[:, np.newaxis]


class SmoothedPoses:
    """Positions and orientations from ``Track.smooth``, at selected samples only.

    This is many times faster, because no standard deviations are computed.
    """

    def __init__(self, track: Track) -> None:
        self._track = track
        self._steps = smooth_steps(track._steps, track.smoothed, deviations=False)

    def __call__(self, samples: Integers) -> tuple[Floats, Floats]:
        """Return positions, shape (m, 3), and quaternions, shape (m, 4), at the samples."""
        track, steps = self._track, self._steps
        position, quaternion = track.position[samples], track.quaternion[samples]
        if not len(steps["sample"]):
            return position, quaternion
        last, following, part = _bracket_steps(track.time, steps, samples)
        error = (1.0 - part) * steps["after"][last] + part * steps["before"][following]
        turn = from_rotation_vectors(error[:, 6:9])
        known = track.navigating[samples, np.newaxis]
        return (
            offset_position(position, -error[:, :3]),
            np.where(known, product(turn, quaternion), quaternion),
        )
