"""Track of a foot from its stances, without receiver or wheels."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate._native import NavigationRecord, foot_track
from zerorate.checks.clipped import ClippedAxis, clipped_axes, restore_clipped
from zerorate.faults import ArgumentError
from zerorate.foot.lead import FRD_TO_FLU, HALF_TURN_ABOUT_X, Lead
from zerorate.foot.lifts import Ride, describe_rides, find_rides, ride_variance
from zerorate.foot.strides import Strides, measure_strides
from zerorate.foot.swings import Swings
from zerorate.foot.verdict import describe_doubts, refuse_other_bodies
from zerorate.geometry.earth import offset_position
from zerorate.geometry.rotations import product
from zerorate.geometry.scipy_rotation import Oriented
from zerorate.navigation.track import SmoothableTrack, Steps, interpolate_steps, smooth_steps
from zerorate.numerals import shorten
from zerorate.record import Log, LogError, Recording
from zerorate.record.samples import Samples
from zerorate.types import Booleans, Floats
from zerorate.views import Result

_MAX_RATE_DIFFERENCE: Final = 0.01


@dataclass(frozen=True, eq=False)
class GeodeticTrack:
    """A track on the earth, for `zerorate.navigation.write_geojson`.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples, s.
    position : ndarray, shape (n, 3)
        Latitude and longitude (deg) and height (m). NaN where unknown.
    source : str
        Name of the recording.

    Examples
    --------
    >>> import zerorate as zr
    >>> walk = zr.simulate_walk(strides=20, seed=1)
    >>> track = zr.FootNavigation().process(walk.recording()).georeference(45.0, 7.0)
    >>> track.position[0].tolist(), track.position.shape == (len(track.time), 3)
    ([45.0, 7.0, 0.0], True)
    """

    time: Floats
    position: Floats
    source: str


class Origin(NamedTuple):
    """Start of a walk in geodetic coordinates.

    Attributes
    ----------
    latitude, longitude : float
        Position of the start, deg.
    heading : float
        Direction of the track's x axis, rad, from north over east.
    height : float
        Height of the start, m.

    Examples
    --------
    >>> import zerorate as zr
    >>> made = zr.simulate_walk(strides=10, seed=1)
    >>> zr.walk(made.recording(), at=(48.1, 11.6)).origin.latitude
    48.1
    """

    latitude: float
    longitude: float
    heading: float = 0.0
    height: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class FootTrack(Oriented, SmoothableTrack, Result):
    """Track of a sensor on a foot over n samples, as `FootNavigation.process` returns it.

    The frame is fixed at the start, with coordinates in m. x is the horizontal direction of the
    sensor's first axis, y is left, and z is up. The heading is relative to the start, not to north.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples, s.
    position : ndarray, shape (n, 3)
        Position x, y, z (m). NaN in a long gap.
    velocity : ndarray, shape (n, 3)
        Velocity x, y, z (m/s).
    quaternion : ndarray, shape (n, 4)
        Quaternions w, x, y, z from the sensor's axes to x, y, z.
    gyro_bias, accel_bias : ndarray, shape (n, 3)
        Biases of the gyro (rad/s) and the accelerometer (m/s^2).
    sigma : ndarray, shape (n, 15)
        Standard deviations, with three columns for each quantity. Position and heading are relative
        to the start.

        - position, m
        - velocity, m/s
        - orientation about x, y, z (rad)
        - gyro bias, rad/s
        - accelerometer bias, m/s^2
    stances : ndarray of int, shape (s, 2)
        First sample and end (exclusive) of each stance.
    lowest : ndarray of int, shape (s,)
        Sample of least motion in each stance.
    rests : ndarray of int, shape (r, 2)
        First sample and end (exclusive) of each rest from which the gyro bias was learned.
    clipped : tuple of ClippedAxis
        Axes on which the gyro was clipped.
    bound : ndarray, shape (n,)
        Upper bound of the foot's speed, m/s. Its minima are the stances.
    rejection_count : int
        Number of zero-velocity updates that the filter rejected.
    swings : Swings
        Swings from stance to stance, with tests that show if the sensor is on a foot.
    rides : tuple of Ride
        Rides in a lift. The track leaves out their height, but its standard deviation includes it.
    smoothed : bool
        True if the smoother made the track from the whole recording.
    source : str
        Name of the recording.
    notes : tuple of str
        Sentences on restored or missing data and on assumptions.
    alarms : tuple of str
        Sentences on contradictions in the recording.
    origin : Origin, optional
        Start of the walk in geodetic coordinates.

    Examples
    --------
    >>> import zerorate as zr
    >>> walk = zr.simulate_walk(strides=20, seed=1)
    >>> track = zr.FootNavigation(floor="level").process(walk.recording()).smooth()
    >>> bool(abs(track.distance - walk.distance) < 0.01 * walk.distance), len(track.stances)
    (True, 21)
    """

    time: Floats
    position: Floats
    velocity: Floats
    quaternion: Floats
    gyro_bias: Floats
    accel_bias: Floats
    sigma: Floats
    stances: npt.NDArray[np.int64]
    lowest: npt.NDArray[np.int64]
    rests: npt.NDArray[np.int64]
    clipped: tuple[ClippedAxis, ...]
    bound: Floats
    rejection_count: int = 0
    swings: Swings = field(default_factory=lambda: Swings.from_rows(np.empty((0, 10))))
    rides: tuple[Ride, ...] = ()
    smoothed: bool = False
    source: str = "the recording"
    notes: tuple[str, ...] = ()
    alarms: tuple[str, ...] = ()
    origin: Origin | None = None
    _steps: NavigationRecord | Steps | None = field(default=None, compare=False)
    _lead: Lead | None = field(default=None, compare=False)
    _more_variance: Floats | None = field(default=None, compare=False)

    @property
    def foot_share(self) -> float:
        """Share of the swing time that passes the tests for a foot, 0 to 1; NaN without swings."""
        return self.swings.share

    @property
    def distance(self) -> float:
        """Horizontal path length from stance to stance, m."""
        positions = self.position[self.lowest, :2]
        positions = positions[np.isfinite(positions[:, 0])]
        return float(np.hypot(*np.diff(positions, axis=0).T).sum())

    def __repr__(self) -> str:
        """Return the number of samples and stances, and the distance."""
        span = float(np.ptp(self.time))
        best = ", smoothed" if self.smoothed else ""
        return (
            f"FootTrack({self.n} samples in {span:.6g} s, {len(self.stances)} stances, "
            f"{shorten(self.distance, 4)} m{best})"
        )

    def strides(self) -> Strides:
        """Return the strides: length, duration, speed, height, rotation, swing and stance."""
        return measure_strides(self)

    def smooth(self) -> FootTrack:
        """Return the smoothed track: each sample uses all samples, earlier and later.

        At the last sample the result is the filter's estimate.

        Raises
        ------
        ValueError
            If the track is already smoothed, or ``process`` did not keep the data for the smoother.
        MemoryError
            If there is not enough memory for the smoother's result.
        """
        steps = smooth_steps(self._steps, self.smoothed)
        error, sigma = interpolate_steps(self.time, steps)
        error[:, :9] *= np.tile(FRD_TO_FLU, 3)
        if self._more_variance is not None:
            sigma = _add_variance(sigma, self._more_variance)
        parts = {"position": self.position - error[:, :3], **self._apply_errors(error, sigma)}
        if self._lead is not None:
            begin = self._lead.begin
            biases = np.array([parts["gyro_bias"][begin], parts["accel_bias"][begin]])
            track = parts["position"], parts["velocity"], parts["quaternion"]
            moved = self._lead.replace_in(self.time, track, biases)
            parts["position"], parts["velocity"], parts["quaternion"] = moved
            added = self._lead.variance(self.time, parts["position"], sigma[begin])
            parts["sigma"] = _add_variance(parts["sigma"], added)
        return replace(self, **parts)

    def georeference(
        self, latitude: float, longitude: float, *, heading: float = 0.0, height: float = 0.0
    ) -> GeodeticTrack:
        """Return the track in geodetic coordinates.

        Parameters
        ----------
        latitude, longitude : float
            Latitude and longitude of the start, deg.
        heading : float
            Direction of the track's x axis, deg, from north over east.
        height : float
            Height of the start, m.

        Raises
        ------
        ValueError
            If a number is not finite, or the latitude is beyond 89.5 deg.
        """
        start = {"latitude": latitude, "longitude": longitude, "heading": heading, "height": height}
        for name, value in start.items():
            if not math.isfinite(value):
                raise ArgumentError(name, f"must be a finite number, got {value!r}")
        if abs(latitude) > 89.5:
            raise ArgumentError("latitude", f"must be within 89.5 deg, got {latitude!r}")
        c, s = math.cos(math.radians(heading)), math.sin(math.radians(heading))
        ahead, left, up = self.position.T
        ned = np.column_stack([c * ahead + s * left, s * ahead - c * left, -up])
        geodetic = offset_position(np.array([latitude, longitude, height]), ned)
        return GeodeticTrack(self.time, geodetic, self.source)

    def to_log(self) -> Log:
        """Return a log of x, y, z (m), for `zerorate.write_log`.

        Its extra columns are velocity (m/s), quaternion, standard deviations of position and
        heading, and a flag for stances.
        """
        span = float(np.ptp(self.time))
        names, meta = ("x_m", "y_m", "z_m"), {"source": self.source}
        extra: dict[str, Floats | Booleans] = {}
        for axis, speed in zip("xyz", self.velocity.T, strict=True):
            extra[f"velocity_{axis}_mps"] = speed
        for axis, part in zip("wxyz", self.quaternion.T, strict=True):
            extra[f"quat_{axis}"] = part
        for axis, deviation in zip("xyz", self.sigma[:, :3].T, strict=True):
            extra[f"sigma_{axis}_m"] = deviation
        extra["heading_sigma_deg"] = np.degrees(self.sigma[:, 8])
        standing = np.zeros(self.n, bool)
        for first, end in self.stances:
            standing[first:end] = True
        extra["standing"] = standing
        return Log.at(self.time, (self.n - 1) / span, self.position, names, "m", meta, extra)


class FootNavigation:
    """Position and attitude of a sensor on a foot, from its gyro and accelerometer alone.

    In each stance the velocity of the foot is zero. Stances are the minima of an upper bound of the
    foot's speed. No threshold depends on the sensor or the gait. The bound also gives the standard
    deviation of the zero-velocity updates. Rates clipped at the gyro's range are restored first.
    The gyro bias is learned only while the foot rests for half a second. Zero-velocity updates do
    not change it.

    Without a rest at the start, the filter starts in the first clear stance. It then integrates the
    samples before this stance backward. `FootNavigation` processes a whole recording, and
    `FootFilter` processes live samples.

    Motion of a wrist, a hand, a pocket or a vehicle raises an error. A foot rotates fast in its
    swings, stands between them, and has the same tilt in each stance.

    Parameters
    ----------
    rate : float, optional
        Expected sampling rate, Hz. The recording must have this rate. Default: any rate.
    floor : {None, "level"}, default None
        "level" assumes level floors. A stance within 0.1 m of the current floor is moved to the
        floor's height. A stance farther above or below starts a new floor, as on a stair. Ramps
        with less than 0.1 m per stride therefore become level. Default: no floor is assumed.
    restore : bool, default True
        True restores rates that the gyro clipped.
    assume_foot : bool, default False
        True processes the recording even if the motion does not look like a foot's.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Notes
    -----
    The sampling rate may be 48 Hz to some thousand hertz. A sample that is not finite counts as
    missing. The last sample replaces it for a tenth of a second; then the standard deviations grow.
    After a gap of more than a second the track continues from its last position. Its standard
    deviation then includes the distance that the foot may have moved.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> walk = zr.simulate_walk(strides=20, seed=1)
    >>> track = zr.FootNavigation(floor="level").process(walk.recording()).smooth()
    >>> end = np.hypot(*(track.position[-1] - walk.position[-1])[:2])
    >>> bool(end < 0.01 * walk.distance), len(track.strides())
    (True, 20)
    """

    __slots__ = ("_assume_foot", "_floor", "_rate", "_restore")

    def __init__(
        self,
        rate: float | None = None,
        *,
        floor: Literal["level"] | None = None,
        restore: bool = True,
        assume_foot: bool = False,
    ) -> None:
        """Check and store the parameters."""
        if rate is not None and not (math.isfinite(rate) and rate > 0.0):
            raise ArgumentError("rate", f"must be a positive number of Hz, got {rate!r}")
        if floor not in (None, "level"):
            raise ArgumentError("floor", f"must be None or 'level', got {floor!r}")
        self._rate, self._floor, self._restore = rate, floor, bool(restore)
        self._assume_foot = bool(assume_foot)

    def __repr__(self) -> str:
        """Return the parameters."""
        return (
            f"FootNavigation({self._rate!r}, floor={self._floor!r}, restore={self._restore!r}, "
            f"assume_foot={self._assume_foot!r})"
        )

    def process(self, imu: Recording, *, keep: Literal["all", "track"] = "all") -> FootTrack:
        """Return the track of a recording with a gyro and an accelerometer.

        Parameters
        ----------
        imu : Recording
            Recording in any axes, with known units.
        keep : {"all", "track"}, default "all"
            "track" omits the data for the smoother. They need 2 to 3 kB for every 0.02 s.

        Returns
        -------
        FootTrack
            Estimates after each sample. `FootTrack.smooth` improves them.

        Raises
        ------
        LogError
            If the gyro or the accelerometer is missing or does not have three axes.
        ValueError
            If the recording is shorter than a second. If its rate is below 48 Hz, or differs from
            `rate`. If its motion is not the motion of a foot.
        """
        if keep not in ("all", "track"):
            raise ArgumentError("keep", f"must be 'all' or 'track', got {keep!r}")
        if not isinstance(imu, Recording):
            kind = type(imu).__name__
            raise TypeError(f"imu must be a Recording, as zr.read_recording returns it, got {kind}")
        samples = Samples.of(imu, mag=False, what="navigation of a foot")
        time = samples.time
        self._check_rate(time)
        outputs, steps = self._run_filter(samples, keep == "all")
        swings = Swings.from_rows(outputs["swings"])
        if not (self._assume_foot or self._leaves_clipped(samples)):
            refuse_other_bodies(time, samples.gyro, outputs["stances"], swings)
        clipped = clipped_axes(outputs["clipped"], samples.gyro)
        rides = () if self._floor else find_rides(time, samples.gyro, samples.accel)
        begin, first = outputs["begin"]
        lead = Lead(first, begin, outputs["lead_gyro"], outputs["lead_accel"]) if begin else None
        more = np.zeros((len(time), 3))
        more += swings.stray_variance(time)[:, np.newaxis]
        more[:, 2] += swings.climb_variance(
            outputs["position"][:, 2], clipped=bool(clipped), level=self._floor is not None
        )
        more[:, 2] += ride_variance(rides, len(time))
        position = outputs["position"] * FRD_TO_FLU
        sigma = _add_variance(outputs["sigma"], more)
        if lead is not None:
            added = lead.variance(time, position, outputs["sigma"][begin])
            sigma = _add_variance(sigma, added)
        return FootTrack(
            time=time,
            position=position - position[first],
            velocity=outputs["velocity"] * FRD_TO_FLU,
            quaternion=product(
                np.broadcast_to(HALF_TURN_ABOUT_X, (len(time), 4)), outputs["quaternion"]
            ),
            gyro_bias=outputs["gyro_bias"],
            accel_bias=outputs["accel_bias"],
            sigma=sigma,
            stances=outputs["stances"][:, :2],
            lowest=outputs["stances"][:, 2],
            rests=outputs["rests"],
            clipped=clipped,
            bound=outputs["bound"],
            rejection_count=outputs["rejections"],
            swings=swings,
            rides=rides,
            source=imu.source,
            notes=(
                *describe_doubts(time, outputs, swings),
                *describe_rides(rides, time),
                *map(str, clipped),
                *_rest_notes(outputs["rests"]),
                *samples.notes,
            ),
            _steps=steps,
            _lead=lead,
            _more_variance=more if more.any() else None,
        )

    def _run_filter(self, samples: Samples, keep: bool) -> Any:  # noqa: ANN401
        time, level = samples.time, self._floor == "level"
        try:
            return foot_track(time, samples.gyro, samples.accel, level, self._restore, keep)
        except ValueError as error:
            if getattr(error, "argument", None) != "time":
                raise
            # The user gave no times, so the error must name the recording.
            raise LogError(f"{', '.join(samples.log.names)}: {error}") from None

    def _leaves_clipped(self, samples: Samples) -> bool:
        """Return True if clipped rates remain; swings of a foot then fail the tests."""
        if self._restore:
            return False
        rate = (len(samples.time) - 1) / float(samples.time[-1] - samples.time[0])
        return bool(restore_clipped(samples.gyro, rate).clipped)

    def _check_rate(self, time: Floats) -> None:
        if self._rate is None or len(time) < 2:
            return
        rate = (len(time) - 1) / float(time[-1] - time[0])
        if abs(rate - self._rate) > _MAX_RATE_DIFFERENCE * self._rate:
            raise ArgumentError(
                "rate", f"must be that of the recording, {rate:.6g} Hz, got {self._rate:.6g}"
            )


def _rest_notes(rests: npt.NDArray[np.int64]) -> tuple[str, ...]:
    if len(rests):
        return ()
    return (
        "it never rests: the gyro's bias is known to 0.3 deg/s only, and the heading drifts "
        "accordingly; stand for two seconds at the start",
    )


def _add_variance(sigma: Floats, variance: Floats) -> Floats:
    """Return the standard deviations, with a variance added to the position."""
    wider = sigma.copy()
    wider[:, :3] = np.sqrt(sigma[:, :3] ** 2 + variance)
    return wider
