"""Calibration of a magnetometer from ordinary motion, by the gyro."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from dataclasses import field as _default
from importlib.util import find_spec
from itertools import pairwise
from typing import Any, Final, Literal, Self

import numpy as np
import numpy.typing as npt

from zerorate._native import Attitude
from zerorate.calibration.magnet.choice import IronChoice, choose_iron
from zerorate.calibration.magnet.exports import MICROTESLA, to_ardupilot, to_px4
from zerorate.calibration.magnet.faults import describe_stuck_axes, find_clipped
from zerorate.calibration.magnet.fit import BASIS, KNOWN_SIGMA, count_known_directions
from zerorate.calibration.magnet.spans import Span, partition_spans
from zerorate.calibration.magnet.sphere import Sphere, fit_sphere
from zerorate.calibration.magnet.ticks import Ticks, average_ticks
from zerorate.calibration.parameters import Matrix, Vector
from zerorate.faults import ArgumentError
from zerorate.geometry import EarthField, earth_field
from zerorate.geometry.rotations import to_matrices
from zerorate.noise.coefficient import Coefficient
from zerorate.noise.exports import write_text
from zerorate.record import Log, LogError, Recording
from zerorate.record.samples import Samples
from zerorate.record.saved import as_json, check_format, restore
from zerorate.types import Booleans, Floats
from zerorate.views import Result

MagnetometerModel = Literal["none", "b", "b+scale", "b+symmetric"]

_FORMAT: Final = "zerorate magnetometer calibration"
_VERSION: Final = 1
_COEFFICIENT_FIELDS: Final = ("hard_iron", "rotation", "soft_iron", "field", "dip")
_PLAIN_FIELDS: Final = (
    *("covariance", "elements", "residual", "norm", "unit"),
    *("problems", "advice", "notes", "source"),
)
_MIN_TICKS: Final = 100
"""Ticks that a record must have."""
_MIN_FIELD_SHARE: Final = 0.2
"""Part of the samples' size below which a field is none: they do not turn with the sensor."""
_HEADINGS_RAD: Final = np.radians(10.0) * np.arange(36)
_SOFT_IRON_SIGMA: Final = 0.06
_ONE_SIDED_95_Z: Final = 1.645
_MAX_FIELD_DIFFERENCE: Final = 0.3
"""Share by which a field may differ from that of a place: rooms and steel do that much."""
_MAX_DIP_DIFFERENCE_RAD: Final = np.radians(20.0)
_MAX_FIELD_RATIO: Final = 2.0
"""Times by which the field of another log may differ."""
_UNEVENNESS_LIMITS: Final = (1.5, 0.15)
"""Times more uneven, and how uneven, a field is that is another device's."""


@dataclass(frozen=True)
class IronGroup:
    """One hard iron of a record, which several spans may share.

    Parameters
    ----------
    hard_iron
        As found, unit of the samples; zero along directions that are not known.
    scatter_raw, scatter_unseen
        RMS of an axis about a constant field, in blocks that the fit had not seen: of raw samples,
        and without the hard iron.
    applied
        Whether the hard iron is taken off.

    Examples
    --------
    >>> import zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=120.0, seed=1).recording()
    >>> (group,) = zr.calibrate_magnetometer(motion).groups  # there is no iron
    >>> group.applied, len(group.hard_iron)
    (False, 3)
    """

    hard_iron: tuple[float, float, float]
    scatter_raw: float
    scatter_unseen: float
    applied: bool


@dataclass(frozen=True, eq=False)
class MagnetometerCalibration(Result):
    """What the gyro tells of a magnetometer: ``raw = soft_iron @ field + hard_iron``.

    Parameters
    ----------
    hard_iron
        Of the group that lasts longest, unit of the samples.
    soft_iron
        Its trace is 3; the unit matrix where it is not applied.
    rotation
        Of the magnetometer against the gyro as a fit of everything has it, rad; never applied.
    field, dip
        Size of the field, unit of the samples, and its angle below the level, rad.
    model
        What is applied.
    spans
        Seconds on the clock of the gyro, kinds and groups: see `Span`.
    groups
        Hard irons.
    covariance
        Of the elements of the soft iron and of the hard iron over `norm`, shape (11, 11).
    elements
        Of the soft iron less 1, in eight orthonormal matrices: two of scale, three symmetric,
        three antisymmetric; shape (8,).
    norm
        Median size of the samples.
    unit
        Of the samples.
    problems, advice, notes
        Why it is not valid, what another record should have, and what was assumed.
    source
        Of which recording.
    residual
        RMS over each second of what hard and soft iron leave of the field, unit of the samples,
        NaN where a second has no samples; none without a gyro.
    alarms
        What contradicts the recording, of `zerorate.calibrate_magnetometer`; no file holds it.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=120.0, seed=1).recording()
    >>> found = zr.calibrate_magnetometer(motion)  # there is no iron
    >>> found.valid, found.model, bool(found.heading_error().max() < np.radians(5.0))
    (True, 'none', True)
    """

    hard_iron: Vector
    soft_iron: Matrix
    rotation: Vector
    field: Coefficient
    dip: Coefficient
    model: MagnetometerModel
    spans: tuple[Span, ...]
    groups: tuple[IronGroup, ...]
    covariance: Floats
    elements: Floats
    norm: float
    unit: str
    problems: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    source: str = ""
    residual: Floats = _default(default_factory=lambda: np.zeros(0))
    alarms: tuple[str, ...] = ()

    @property
    def valid(self) -> bool:
        """Whether nothing was found that makes it useless."""
        return not self.problems

    @property
    def applied(self) -> bool:
        """Whether `apply` changes any sample."""
        return self.model != "none"

    @property
    def disturbed(self) -> float:
        """Share of the time in which no hard iron explains the field."""
        total = sum(span.stop - span.start for span in self.spans)
        disturbed_s = sum(s.stop - s.start for s in self.spans if s.kind == "disturbed")
        return disturbed_s / total if total else 0.0

    def apply(
        self, samples: Recording | npt.ArrayLike, time: npt.ArrayLike | None = None
    ) -> Recording | Floats:
        """Return the samples, or the recording, with the magnetometer corrected.

        Parameters
        ----------
        samples : Recording or array_like, shape (n, 3)
            Unit of `unit`. Where nothing is applied they stay as they were, to the last bit.
        time : array_like, shape (n,), optional
            Seconds on the clock of this calibration's recording: each sample then has the hard
            iron of its span. Without, and of another recording, that of the longest group counts.

        Raises
        ------
        ValueError
            If samples have another shape, or the recording no magnetometer in this unit, or one
            of which the field becomes more uneven: that of another device.
        """
        if isinstance(samples, Recording):
            return self._apply_to_recording(samples)
        values = np.array(samples, dtype=np.float64)
        if values.ndim != 2 or values.shape[1] != 3:
            raise ArgumentError("samples", f"must have the shape (n, 3), got {values.shape}")
        times = None if time is None else np.asarray(time, dtype=np.float64)
        if times is not None and times.shape != (len(values),):
            raise ArgumentError("time", f"must have the shape ({len(values)},), got {times.shape}")
        inverse = np.linalg.inv(np.array(self.soft_iron, dtype=np.float64))
        for g, where in self._group_masks(len(values), times):
            if self.groups[g].applied:
                iron = np.array(self.groups[g].hard_iron)
                values[where] = (values[where] - iron) @ inverse.T
        return values

    def _apply_to_recording(self, recording: Recording) -> Recording:
        log = recording.mag
        if log is None or log.unit != self.unit:
            actual = "none" if log is None else f"one in {log.unit}"
            raise LogError(f"the calibration is of a magnetometer in {self.unit}, found {actual}")
        own = recording.source == self.source
        corrected = self.apply(log.data, log.sampled if own else None)
        assert isinstance(corrected, np.ndarray)
        if not own and self.groups[self.longest].applied:
            self._check_device(log.data, corrected)
        logs = dict(recording)
        logs["mag"] = log.with_data(corrected)
        return replace(recording, logs=logs)

    def _check_device(self, before: Floats, after: Floats) -> None:
        """Refuse the calibration of another device: LogError where it makes the field worse."""
        unevenness_before, (size, unevenness) = (
            _measure_unevenness(before)[1],
            _measure_unevenness(after),
        )
        max_ratio, max_unevenness = _UNEVENNESS_LIMITS
        if unevenness > max(max_ratio * unevenness_before, max_unevenness):
            raise LogError(
                "the calibration is of another device, or its magnets have moved: with it the "
                f"field's size varies by {100.0 * unevenness:.0f} %, without by "
                f"{100.0 * unevenness_before:.0f} %; calibrate this log"
            )
        if self.field.known and not 1.0 / _MAX_FIELD_RATIO < size / self.field < _MAX_FIELD_RATIO:
            raise LogError(
                f"the calibration is of another device or place: with it the field is {size:.3g} "
                f"{self.unit}, and was {self.field.value:.3g} {self.unit} where it was made; "
                "calibrate this log"
            )

    def _group_masks(self, n: int, time: Floats | None) -> Iterator[tuple[int, Booleans]]:
        group = np.full(n, self.longest)
        if time is not None:
            for span in self.spans:
                group[(time >= span.start) & (time < span.stop)] = span.group
        for g in range(len(self.groups)):
            yield g, group == g

    @property
    def longest(self) -> int:
        """Which of the groups lasts longest."""
        return int(self._group_durations.argmax())

    @property
    def _group_durations(self) -> Floats:
        durations = np.zeros(max(len(self.groups), 1))
        for span in self.spans:
            durations[span.group] += span.stop - span.start
        return durations

    @property
    def longest_applied(self) -> int:
        """Which of the groups whose iron is taken off lasts longest; `longest` if none is."""
        durations = (
            self._group_durations * [group.applied for group in self.groups]
            if self.groups
            else None
        )
        return self.longest if durations is None or not durations.any() else int(durations.argmax())

    def __field_correction__(self) -> tuple[list[float], list[list[float]]] | None:
        """Return what `Attitude` takes off: hard iron of `longest`, and soft iron's inverse."""
        if not self.groups[self.longest].applied:
            return None
        inverse = np.linalg.inv(np.array(self.soft_iron, dtype=np.float64))
        return list(self.groups[self.longest].hard_iron), inverse.tolist()

    def heading_error(self, before: bool = False, group: int | None = None) -> Floats:
        """Return the heading error to expect of a level sensor, rad, shape (36,).

        Parameters
        ----------
        before : bool
            Whether of raw samples: what hard and soft iron do, and what is not known of them.
        group : int, optional
            With the hard iron of which group; default that of `longest`, whose deviations count.

        Returns
        -------
        ndarray, shape (36,)
            At headings 0, 10, ... 350 deg, root mean square.
        """
        iron_group = self.groups[self.longest if group is None else group]
        iron = np.array(self.hard_iron if group is None else iron_group.hard_iron, dtype=np.float64)
        raw = before or not iron_group.applied
        return np.array(
            [self._heading_error_at(angle, iron if raw else None) for angle in _HEADINGS_RAD]
        )

    def _heading_error_at(self, heading: float, iron: Floats | None) -> float:
        level, down = np.cos(self.dip), np.sin(self.dip)
        size = self.field.value / self.norm
        c, s = np.cos(heading), np.sin(heading)
        east = np.array([c, -s, 0.0])
        field_vector = size * np.array([s * level, c * level, -down])
        slope = np.array([*(east @ element @ field_vector for element in BASIS), *east])
        variance = slope @ self.covariance @ slope
        if iron is not None:
            values = np.array([*self.elements, *(iron / self.norm)])
            variance = variance + (slope @ values) ** 2
        return float(min(np.sqrt(variance) / max(size * level, 1e-3), np.pi))

    to_px4 = to_px4
    to_ardupilot = to_ardupilot

    def to_json(self, path: str | os.PathLike[str] | None = None) -> str:
        """Return the calibration as JSON, exact to the last bit, and write it where told."""
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            **{name: _encode_coefficients(getattr(self, name)) for name in _COEFFICIENT_FIELDS},
            "model": self.model,
            "spans": [asdict(span) for span in self.spans],
            "groups": [asdict(group) for group in self.groups],
            **{name: getattr(self, name) for name in _PLAIN_FIELDS},
        }
        return write_text(as_json(content), path, force=True)

    @classmethod
    def from_json(cls, source: str | os.PathLike[str]) -> Self:
        """Read a calibration that `to_json` wrote, equal to the last bit."""
        return restore(source, "magnetometer calibration", cls._from_content)

    @classmethod
    def _from_content(cls, content: Any) -> Self:  # noqa: ANN401
        check_format(content, _FORMAT, _VERSION)
        fields = {k: v for k, v in content.items() if k not in ("format", "version")}
        fields |= {name: _decode_coefficients(fields[name]) for name in _COEFFICIENT_FIELDS}
        fields["spans"] = tuple(Span(**entry) for entry in fields["spans"])
        groups = [entry | {"hard_iron": tuple(entry["hard_iron"])} for entry in fields["groups"]]
        fields["groups"] = tuple(IronGroup(**entry) for entry in groups)
        for name in ("problems", "advice", "notes"):
            fields[name] = tuple(fields[name])
        fields["covariance"] = np.array(fields["covariance"])
        fields["elements"] = np.array(fields["elements"])
        residual = [np.nan if x is None else x for x in fields.get("residual", [])]
        fields["residual"] = np.array(residual, dtype=np.float64)
        return cls(**fields)

    def __repr__(self) -> str:
        """Return in one line what is applied."""
        state = f"model {self.model!r}" if self.valid else "not valid"
        return f"MagnetometerCalibration({state}; {len(self.spans)} spans)"


def _encode_coefficients(coefficient: Any) -> list[Any]:  # noqa: ANN401
    """Return the parts of a coefficient, or of each in nested tuples."""
    if isinstance(coefficient, tuple):
        return [_encode_coefficients(inner) for inner in coefficient]
    return [coefficient.value, coefficient.sigma, coefficient.identifiable, coefficient.upper_bound]


def _decode_coefficients(encoded: list[Any]) -> Any:  # noqa: ANN401
    if any(isinstance(inner, list) for inner in encoded):
        return tuple(_decode_coefficients(inner) for inner in encoded)
    value, sigma, identifiable, bound = encoded
    return Coefficient(value, sigma, identifiable, np.inf if bound is None else bound)


def calibrate_magnetometer(
    recording: Recording,
    *,
    gyro: str = "gyro",
    one: bool = False,
    field: float | None = None,
    dip: float | None = None,
    place: tuple[float, ...] | None = None,
) -> MagnetometerCalibration:
    """Calibrate a magnetometer from ordinary motion: the gyro says how the field must turn.

    Parameters
    ----------
    recording : Recording
        With gyro, accelerometer and a magnetometer in any unit. Without a gyro a sphere is fitted,
        which needs all directions and a field that stays; a note says so.
    gyro : str
        Which of several sensors; default the first.
    one : bool
        Whether the record has one hard iron, since nobody touched the device. Default: several
        where that leaves clearly less scatter, for a magnet that comes and goes.
    field, dip : float, optional
        Size of the field at the place, uT, and its angle below the level, rad, as a model of the
        earth's field tells them: a result that cannot be of there is not valid.
    place : tuple of float, optional
        Latitude and longitude, deg, and maybe height, m: `zerorate.geometry.earth_field` then tells
        field and dip. Default that of the recording's positions, where it has some and pygeomag is
        installed.

    Returns
    -------
    MagnetometerCalibration
        Ask `applied`: only what more than halves the scatter of samples that the fit had not
        seen is taken off.

    Raises
    ------
    LogError
        Without accelerometer (unless there is no gyro either) or magnetometer, or with less than
        ten seconds of them.
    ValueError
        If ``field`` or ``dip`` are none of the earth's, or ``place`` is no place.
    ImportError
        If ``place`` is given and pygeomag is not installed.

    Notes
    -----
    Two turns about different axes are enough; what does not turn with the sensor's surroundings
    is iron. Standard errors are of fields that differ from place to place, not of noise: nothing
    smaller than a hundredth of the field is claimed.

    Examples
    --------
    >>> import zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=40.0, seed=3)
    >>> zr.calibrate_magnetometer(motion.recording()).applied
    False
    """
    _check_field(field, dip)
    log = _find_magnetometer(recording, gyro)
    reference = _reference_field(recording, place, log.unit, field, dip)
    field, dip = (field, dip) if reference is None else (reference.size, reference.dip)
    if gyro not in recording:
        result = _calibrate_by_sphere(log, recording)
    else:
        result = _calibrate_by_gyro(recording, gyro, log, one)
    result = _validate_field(result, field, dip)
    if reference is None:
        return result
    note = (
        f"the field of the place has {reference.size:.1f} uT, a dip of "
        f"{np.degrees(reference.dip):.0f} deg, "
        f"by the {reference.model}"
    )
    return replace(result, notes=(*result.notes, note))


def _reference_field(
    recording: Recording,
    place: tuple[float, ...] | None,
    unit: str,
    field: float | None,
    dip: float | None,
) -> EarthField | None:
    """Return the field at a place, typed or recorded; None where nothing tells it."""
    if place is not None and (field is not None or dip is not None):
        raise ArgumentError("place", "tells field and dip: give it, or them")
    if place is not None:
        if len(place) not in (2, 3):
            raise ArgumentError("place", f"takes latitude, longitude and maybe height, got {place}")
        return earth_field(*place)
    needs_no_model = field is not None or dip is not None or unit not in MICROTESLA
    if needs_no_model or find_spec("pygeomag") is None:
        return None
    position = _median_position(recording)
    return None if position is None else earth_field(*position)


def _median_position(recording: Recording) -> tuple[float, float] | None:
    """Return the middle of a recording's positions, latitude and longitude, deg."""
    log = recording.get("position")
    if log is None or log.names[:2] != ("latitude_deg", "longitude_deg"):
        return None
    positions = log.data[np.isfinite(log.data[:, :2]).all(axis=1), :2]
    positions = positions[(np.abs(positions) <= (90.0, 360.0)).all(axis=1) & positions.any(axis=1)]
    return None if not len(positions) else tuple(np.median(positions, axis=0).tolist())


def _check_field(field: float | None, dip: float | None) -> None:
    if field is not None and not 10.0 <= field <= 100.0:
        raise ArgumentError("field", f"must be that of a place on earth, 20 to 70 uT, got {field}")
    if dip is not None and not abs(dip) <= np.pi / 2.0:
        raise ArgumentError("dip", f"must be an angle from -pi/2 to pi/2 rad, got {dip}")


def _find_magnetometer(recording: Recording, gyro: str) -> Log:
    own = gyro.replace("gyro", "mag")
    log = recording.get(own if own in recording else "mag")
    if log is None:
        listed = ", ".join(recording) or "nothing"
        raise LogError(f"there is no magnetometer to calibrate; the recording has: {listed}")
    return log


def _calibrate_by_gyro(
    recording: Recording, gyro: str, log: Log, single_iron: bool
) -> MagnetometerCalibration:
    samples = Samples.of(recording, gyro, what="a magnetometer's calibration")
    assert samples.mag is not None
    saturated, faults, notes = find_clipped(samples.mag, samples.gyro)
    problems = (*describe_stuck_axes(samples.mag), *faults)
    mag = np.where(saturated[:, None], np.nan, samples.mag)
    attitude = Attitude(samples.log.rate, mag=False)
    quaternions = attitude.smooth(samples.gyro, samples.accel, dt=samples.dt)["quaternion"]
    begin = float(samples.time[0])
    ticks = average_ticks(
        samples.time - begin, to_matrices(quaternions), samples.mag if problems else mag
    )
    _check_length(ticks.n / 10.0)
    choice = None if problems else choose_iron(ticks, partition_spans(ticks), single_iron)
    if choice is not None and _median_field(choice) < _MIN_FIELD_SHARE:
        problems = ("the samples do not turn with the sensor: the magnetometer is stuck",)
        choice = None
    sentences = (*notes, *samples.notes)
    return _gyro_result(ticks, choice, begin, log.unit, problems, sentences, recording.source)


def _check_length(seconds: float) -> None:
    if seconds < _MIN_TICKS / 10.0:
        raise LogError(
            f"a magnetometer's calibration needs ten seconds of samples, got {seconds:.1f} s"
        )


def _calibrate_by_sphere(log: Log, recording: Recording) -> MagnetometerCalibration:
    known = np.isfinite(log.data).all(axis=1) & np.any(log.data != 0.0, axis=1)
    seconds = float(known.sum() / log.rate)
    _check_length(seconds)
    problems = describe_stuck_axes(log.data)
    centre = None if problems else fit_sphere(log.data[known], seconds)
    begin, end = float(log.sampled[0]), float(log.sampled[-1])
    note = (
        "without a gyro a sphere was fitted: it needs all directions, and takes a magnet that "
        "comes and goes for noise"
    )
    return _sphere_result(centre, begin, end, log.unit, problems, note, recording.source)


def _sphere_result(
    sphere_fit: Sphere | None,
    begin: float,
    end: float,
    unit: str,
    problems: tuple[str, ...],
    note: str,
    source: str,
) -> MagnetometerCalibration:
    unknown = Coefficient(0.0, identifiable=False, upper_bound=np.inf)
    norm = 1.0 if sphere_fit is None else sphere_fit.norm
    matrix, irons, field, advice = np.eye(11), (unknown,) * 3, unknown, []
    iron, raw, corrected, applied = (0.0, 0.0, 0.0), 0.0, 0.0, False
    if sphere_fit is not None:
        matrix = np.diag([_SOFT_IRON_SIGMA**2] * 8 + [1.0] * 3)
        matrix[8:, 8:] = sphere_fit.covariance
        irons = _hard_iron_vector(sphere_fit.iron, sphere_fit.covariance, norm)
        raw, corrected, applied = sphere_fit.raw * norm, sphere_fit.left * norm, sphere_fit.applied
        if applied:
            iron = tuple((sphere_fit.iron * norm).tolist())
        sigma = float(np.sqrt(np.trace(sphere_fit.covariance) / 3.0))
        field = _make_coefficient(
            sphere_fit.radius * norm, sigma * norm, sphere_fit.covered and sigma < KNOWN_SIGMA
        )
        if not sphere_fit.covered:
            advice = ["turn the sensor so that each of its sides points down once"]
        elif count_known_directions(sphere_fit.covariance) < 3:
            advice = ["record for 40 s or longer"]
    return MagnetometerCalibration(
        irons,
        _soft_iron_matrix(np.zeros(8), np.full(8, np.inf)),
        (unknown,) * 3,
        field,
        unknown,
        "b" if applied else "none",
        (Span(begin, end, "informative" if applied else "still"),),
        (IronGroup(iron, raw, corrected, applied),),
        matrix,
        np.zeros(8),
        norm,
        unit,
        problems,
        tuple(advice),
        (note,),
        source,
    )


def _validate_field(
    result: MagnetometerCalibration, field: float | None, dip: float | None
) -> MagnetometerCalibration:
    """Return the calibration, not valid where its field cannot be that of the place."""
    problems = list(result.problems)
    if field is not None and result.unit not in MICROTESLA:
        raise ArgumentError(
            "field", f"is in uT: the unit of the magnetometer must be known, got '{result.unit}'"
        )
    if field is not None and result.field.identifiable:
        size, sigma = (
            MICROTESLA[result.unit] * value for value in (result.field.value, result.field.sigma)
        )
        if abs(size - field) > 3.0 * sigma + _MAX_FIELD_DIFFERENCE * field:
            problems.append(
                f"the field is {size:.3g} uT, and that of the place {field:.3g} uT: the unit or "
                "the scale of the magnetometer is wrong, or it is beside iron that turns with it"
            )
    if dip is not None and result.dip.identifiable:
        difference = abs(result.dip - dip)
        if difference > 3.0 * result.dip.sigma + _MAX_DIP_DIFFERENCE_RAD:
            problems.append(
                f"the dip is {np.degrees(result.dip):.3g} deg, and that of the place "
                f"{np.degrees(dip):.3g} deg: axes of the magnetometer differ from the gyro's, or "
                "this is another place"
            )
    return replace(result, problems=tuple(problems))


def _measure_unevenness(samples: Floats) -> tuple[float, float]:
    """Return the median size of a field, and how much of it the size varies by."""
    sizes = np.linalg.norm(samples[np.isfinite(samples).all(axis=1)], axis=1)
    if not len(sizes):
        return 0.0, 0.0
    size = float(np.median(sizes))
    low, high = np.quantile(sizes, (0.159, 0.841))
    return size, float(high - low) / 2.0 / max(size, 1e-12)


def _median_field(choice: IronChoice) -> float:
    return float(np.median(np.linalg.norm(choice.fit.fields, axis=1)))


def _gyro_result(
    ticks: Ticks,
    choice: IronChoice | None,
    begin: float,
    unit: str,
    problems: tuple[str, ...],
    notes: tuple[str, ...],
    source: str,
) -> MagnetometerCalibration:
    known: dict[str, Any] = {"norm": ticks.norm, "unit": unit, "notes": notes, "source": source}
    unknown = Coefficient(0.0, identifiable=False, upper_bound=np.inf)
    last = begin + float(ticks.number[-1] + 1) / 10.0
    if choice is None:
        group = IronGroup((0.0, 0.0, 0.0), 0.0, 0.0, False)
        advice = () if problems else ("turn the sensor about two axes that differ",)
        soft = _soft_iron_matrix(np.zeros(8), np.full(8, np.inf))
        return MagnetometerCalibration(
            (unknown,) * 3,
            soft,
            (unknown,) * 3,
            unknown,
            unknown,
            "none",
            (Span(begin, last, "still"),),
            (group,),
            np.eye(11),
            np.zeros(8),
            problems=problems,
            advice=advice,
            **known,
        )
    spans = tuple(
        replace(s, start=begin + s.start, stop=min(begin + s.stop, last)) for s in choice.spans
    )
    groups = tuple(
        IronGroup(
            tuple((b * ticks.norm).tolist()), float(r * ticks.norm), float(u * ticks.norm), bool(a)
        )
        for b, r, u, a in zip(choice.iron, choice.raw, choice.left, choice.applied, strict=True)
    )
    durations = [sum(s.stop - s.start for s in spans if s.group == g) for g in range(len(groups))]
    g = int(np.argmax(durations))
    indices = [*range(8), *range(8 + 3 * g, 11 + 3 * g)]
    matrix = choice.covariance[np.ix_(indices, indices)]
    model: MagnetometerModel = "none"
    if choice.applied.any():
        model = "b" if not choice.soft else ("b+symmetric" if max(choice.soft) > 1 else "b+scale")
    field, dip = _field_and_dip(choice, matrix, ticks.norm)
    return MagnetometerCalibration(
        _hard_iron_vector(choice.iron[g], matrix[8:, 8:], ticks.norm),
        _soft_iron_matrix(choice.elements, np.sqrt(np.diagonal(matrix)[:8])),
        _rotation_vector(choice),
        field,
        dip,
        model,
        spans,
        groups,
        matrix,
        choice.elements,
        advice=tuple(_advice(spans, groups, matrix[8:, 8:], unit)),
        residual=_field_residuals(ticks, choice) * ticks.norm,
        **known,
    )


def _field_residuals(ticks: Ticks, choice: IronChoice) -> Floats:
    """Return what is left of the field in each second, its own being that of the nearest fit."""
    group = np.zeros(ticks.n, dtype=np.int64)
    for span in choice.spans:
        group[span.tick_indices(ticks)] = span.group
    after = np.searchsorted(choice.ticks.number, ticks.number).clip(1, choice.ticks.n - 1)
    middle = (choice.ticks.number[after] + choice.ticks.number[after - 1]) / 2.0
    nearest = np.where(ticks.number > middle, after, after - 1)
    iron = np.where(choice.applied[:, None], choice.iron, 0.0)[group]
    inverse = np.linalg.inv(np.eye(3) + np.tensordot(choice.elements, BASIS, axes=1))
    rotated = (ticks.rotation @ ((ticks.field - iron) @ inverse.T)[:, :, None])[:, :, 0]
    squares = ((rotated - choice.fit.fields[choice.fit.window[nearest]]) ** 2).sum(axis=1)
    second = ticks.number // 10
    count = np.bincount(second)
    with np.errstate(invalid="ignore"):
        residuals: Floats = np.sqrt(np.bincount(second, squares) / count)
    return residuals


def _hard_iron_vector(iron: Floats, block: Floats, norm: float) -> Vector:
    sigmas = np.sqrt(np.diagonal(block))
    x, y, z = (
        _make_coefficient(v * norm, s * norm, s < KNOWN_SIGMA)
        for v, s in zip(iron, sigmas, strict=True)
    )
    return x, y, z


def _make_coefficient(value: float, sigma: float, identifiable: bool) -> Coefficient:
    if identifiable:
        return Coefficient(float(value), float(sigma))
    return Coefficient(float(value), float(sigma), False, float(value + _ONE_SIDED_95_Z * sigma))


def _soft_iron_matrix(elements: Floats, sigmas: Floats) -> Matrix:
    matrix = np.eye(3) + np.tensordot(elements, BASIS, axes=1)
    if not np.isfinite(sigmas).all():
        nothing = Coefficient(0.0, identifiable=False, upper_bound=np.inf)
        unity = Coefficient(1.0, identifiable=False, upper_bound=np.inf)
        rows = [[unity if i == j else nothing for j in range(3)] for i in range(3)]
    else:
        size = np.sqrt(np.tensordot(sigmas**2, BASIS**2, axes=1))
        rows = [
            [
                _make_coefficient(matrix[i, j], size[i, j], bool(size[i, j] < _SOFT_IRON_SIGMA))
                for j in range(3)
            ]
            for i in range(3)
        ]
    a, b, c = ((row[0], row[1], row[2]) for row in rows)
    return a, b, c


def _rotation_vector(choice: IronChoice) -> Vector:
    """Return the rotation vector of a fit of everything: of the antisymmetric elements."""
    xy, xz, yz = choice.rotation / np.sqrt(2.0)
    sigmas = choice.rotation_sigma / np.sqrt(2.0)
    values, order = (-yz, xz, -xy), sigmas[::-1]
    x, y, z = (
        _make_coefficient(v, s, bool(s < _SOFT_IRON_SIGMA))
        for v, s in zip(values, order, strict=True)
    )
    return x, y, z


def _field_and_dip(
    choice: IronChoice, matrix: Floats, norm: float
) -> tuple[Coefficient, Coefficient]:
    """Return size and dip of the mean field, with what hard and soft iron leave open."""
    fields = choice.fit.fields
    h, back = fields.mean(axis=0), choice.ticks.inverse_rotation
    turn = choice.ticks.rotation
    sensed = back @ h
    slopes = [-(turn @ (sensed @ element.T)[:, :, None])[:, :, 0].mean(axis=0) for element in BASIS]
    slope = np.column_stack([*slopes, -turn.mean(axis=0)])
    spread = fields.var(axis=0).mean() / len(fields)
    cov = slope @ matrix @ slope.T + np.eye(3) * spread
    size, level = float(np.linalg.norm(h)), float(np.hypot(h[0], h[1]))
    along = h / max(size, 1e-12)
    dip = float(np.arctan2(-h[2], level))
    across = np.array([*(h[:2] / max(level, 1e-12) * np.sin(dip)), np.cos(dip)])
    sigma = float(np.sqrt(along @ cov @ along))
    angle = float(np.sqrt(across @ cov @ across)) / max(size, 1e-12)
    return (
        _make_coefficient(size * norm, sigma * norm, sigma < KNOWN_SIGMA * size),
        _make_coefficient(dip, angle, angle < KNOWN_SIGMA),
    )


def _advice(
    spans: tuple[Span, ...], groups: tuple[IronGroup, ...], block: Floats, unit: str
) -> Iterator[str]:
    size, axes = np.linalg.eigh(block)
    for k in range(3):
        if size[k] >= KNOWN_SIGMA**2:
            x, y, z = axes[:, k] * np.sign(axes[np.abs(axes[:, k]).argmax(), k])
            yield (
                f"turn once about an axis across ({x:.1f}, {y:.1f}, {z:.1f}) of the sensor: along "
                "it the hard iron is not known"
            )
    undisturbed = [span for span in spans if span.kind != "disturbed"]
    for before, after in pairwise(undisturbed):
        if before.group != after.group:
            irons = [np.array(groups[span.group].hard_iron) for span in (before, after)]
            change = float(np.linalg.norm(irons[1] - irons[0]))
            yield (
                f"the field changed at {after.start:.0f} s by {change:.3g} {unit} in the sensor: "
                "something was attached or taken off"
            )
