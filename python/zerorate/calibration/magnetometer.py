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
from zerorate.calibration.magnet.choice import Chosen, chosen
from zerorate.calibration.magnet.exports import MICROTESLA, to_ardupilot, to_px4
from zerorate.calibration.magnet.faults import clipped, stuck
from zerorate.calibration.magnet.fit import BASIS, KNOWN, known_directions
from zerorate.calibration.magnet.spans import Span, spans_of
from zerorate.calibration.magnet.sphere import Sphere, sphere
from zerorate.calibration.magnet.ticks import Ticks, ticks_of
from zerorate.calibration.parameters import Matrix, Vector
from zerorate.faults import ArgumentError
from zerorate.geometry import EarthField, earth_field
from zerorate.geometry.rotations import to_matrices
from zerorate.noise.coefficient import Coefficient
from zerorate.noise.exports import written
from zerorate.record import Log, LogError, Recording
from zerorate.record.samples import Samples
from zerorate.record.saved import as_json, check_format, restored
from zerorate.types import Booleans, Floats
from zerorate.views import Result

MagnetometerModel = Literal["none", "b", "b+scale", "b+symmetric"]

_FORMAT: Final = "zerorate magnetometer calibration"
_VERSION: Final = 1
_COEFFICIENTS: Final = ("hard_iron", "rotation", "soft_iron", "field", "dip")
_PLAIN: Final = (
    *("covariance", "elements", "residual", "norm", "unit"),
    *("problems", "advice", "notes", "source"),
)
_SHORTEST: Final = 100
"""Ticks that a record must have."""
_WEAK: Final = 0.2
"""Part of the samples' size below which a field is none: they do not turn with the sensor."""
_HEADINGS: Final = np.radians(10.0) * np.arange(36)
_SOFT_SIGMA: Final = 0.06
_95: Final = 1.645
_ELSEWHERE: Final = 0.3
"""Share by which a field may differ from that of a place: rooms and steel do that much."""
_OTHER_DIP: Final = np.radians(20.0)
_ALIKE: Final = 2.0
"""Times by which the field of another log may differ."""
_UNEVEN: Final = (1.5, 0.15)
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
        wild = sum(s.stop - s.start for s in self.spans if s.kind == "disturbed")
        return wild / total if total else 0.0

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
            return self._recording(samples)
        values = np.array(samples, dtype=np.float64)
        if values.ndim != 2 or values.shape[1] != 3:
            raise ArgumentError("samples", f"must have the shape (n, 3), got {values.shape}")
        places = None if time is None else np.asarray(time, dtype=np.float64)
        if places is not None and places.shape != (len(values),):
            raise ArgumentError("time", f"must have the shape ({len(values)},), got {places.shape}")
        inverse = np.linalg.inv(np.array(self.soft_iron, dtype=np.float64))
        for g, where in self._where(len(values), places):
            if self.groups[g].applied:
                iron = np.array(self.groups[g].hard_iron)
                values[where] = (values[where] - iron) @ inverse.T
        return values

    def _recording(self, recording: Recording) -> Recording:
        log = recording.mag
        if log is None or log.unit != self.unit:
            found = "none" if log is None else f"one in {log.unit}"
            raise LogError(f"the calibration is of a magnetometer in {self.unit}, found {found}")
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
        uneven_was, (size, uneven) = _evenness(before)[1], _evenness(after)
        times, least = _UNEVEN
        if uneven > max(times * uneven_was, least):
            raise LogError(
                "the calibration is of another device, or its magnets have moved: with it the "
                f"field's size varies by {100.0 * uneven:.0f} %, without by "
                f"{100.0 * uneven_was:.0f} %; calibrate this log"
            )
        if self.field.known and not 1.0 / _ALIKE < size / self.field < _ALIKE:
            raise LogError(
                f"the calibration is of another device or place: with it the field is {size:.3g} "
                f"{self.unit}, and was {self.field.value:.3g} {self.unit} where it was made; "
                "calibrate this log"
            )

    def _where(self, n: int, time: Floats | None) -> Iterator[tuple[int, Booleans]]:
        group = np.full(n, self.longest)
        if time is not None:
            for span in self.spans:
                group[(time >= span.start) & (time < span.stop)] = span.group
        for g in range(len(self.groups)):
            yield g, group == g

    @property
    def longest(self) -> int:
        """Which of the groups lasts longest."""
        return int(self._lasts.argmax())

    @property
    def _lasts(self) -> Floats:
        lasts = np.zeros(max(len(self.groups), 1))
        for span in self.spans:
            lasts[span.group] += span.stop - span.start
        return lasts

    @property
    def taken_off(self) -> int:
        """Which of the groups whose iron is taken off lasts longest; `longest` if none is."""
        lasts = self._lasts * [group.applied for group in self.groups] if self.groups else None
        return self.longest if lasts is None or not lasts.any() else int(lasts.argmax())

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
        of = self.groups[self.longest if group is None else group]
        iron = np.array(self.hard_iron if group is None else of.hard_iron, dtype=np.float64)
        raw = before or not of.applied
        return np.array([self._error(angle, iron if raw else None) for angle in _HEADINGS])

    def _error(self, heading: float, iron: Floats | None) -> float:
        level, down = np.cos(self.dip), np.sin(self.dip)
        size = self.field.value / self.norm
        c, s = np.cos(heading), np.sin(heading)
        east = np.array([c, -s, 0.0])
        seen = size * np.array([s * level, c * level, -down])
        slope = np.array([*(east @ element @ seen for element in BASIS), *east])
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
            **{name: _listed(getattr(self, name)) for name in _COEFFICIENTS},
            "model": self.model,
            "spans": [asdict(span) for span in self.spans],
            "groups": [asdict(group) for group in self.groups],
            **{name: getattr(self, name) for name in _PLAIN},
        }
        return written(as_json(content), path, force=True)

    @classmethod
    def from_json(cls, source: str | os.PathLike[str]) -> Self:
        """Read a calibration that `to_json` wrote, equal to the last bit."""
        return restored(source, "magnetometer calibration", cls._built)

    @classmethod
    def _built(cls, content: Any) -> Self:  # noqa: ANN401
        check_format(content, _FORMAT, _VERSION)
        found = {k: v for k, v in content.items() if k not in ("format", "version")}
        found |= {name: _read(found[name]) for name in _COEFFICIENTS}
        found["spans"] = tuple(Span(**one) for one in found["spans"])
        groups = [one | {"hard_iron": tuple(one["hard_iron"])} for one in found["groups"]]
        found["groups"] = tuple(IronGroup(**one) for one in groups)
        for name in ("problems", "advice", "notes"):
            found[name] = tuple(found[name])
        found["covariance"] = np.array(found["covariance"])
        found["elements"] = np.array(found["elements"])
        left = [np.nan if x is None else x for x in found.get("residual", [])]
        found["residual"] = np.array(left, dtype=np.float64)
        return cls(**found)

    def __repr__(self) -> str:
        """Return in one line what is applied."""
        state = f"model {self.model!r}" if self.valid else "not valid"
        return f"MagnetometerCalibration({state}; {len(self.spans)} spans)"


def _listed(one: Any) -> list[Any]:  # noqa: ANN401
    """Return the parts of a coefficient, or of each in nested tuples."""
    if isinstance(one, tuple):
        return [_listed(inner) for inner in one]
    return [one.value, one.sigma, one.identifiable, one.upper_bound]


def _read(listed: list[Any]) -> Any:  # noqa: ANN401
    if any(isinstance(inner, list) for inner in listed):
        return tuple(_read(inner) for inner in listed)
    value, sigma, identifiable, bound = listed
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
    _check_place(field, dip)
    log = _log(recording, gyro)
    told = _told_by(recording, place, log.unit, field, dip)
    field, dip = (field, dip) if told is None else (told.size, told.dip)
    if gyro not in recording:
        found = _by_sphere(log, recording)
    else:
        found = _by_gyro(recording, gyro, log, one)
    found = _placed(found, field, dip)
    if told is None:
        return found
    note = (
        f"the field of the place has {told.size:.1f} uT, a dip of {np.degrees(told.dip):.0f} deg, "
        f"by the {told.model}"
    )
    return replace(found, notes=(*found.notes, note))


def _told_by(
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
    known = field is not None or dip is not None or unit not in MICROTESLA
    if known or find_spec("pygeomag") is None:
        return None
    there = _middle(recording)
    return None if there is None else earth_field(*there)


def _middle(recording: Recording) -> tuple[float, float] | None:
    """Return the middle of a recording's positions, latitude and longitude, deg."""
    log = recording.get("position")
    if log is None or log.names[:2] != ("latitude_deg", "longitude_deg"):
        return None
    places = log.data[np.isfinite(log.data[:, :2]).all(axis=1), :2]
    places = places[(np.abs(places) <= (90.0, 360.0)).all(axis=1) & places.any(axis=1)]
    return None if not len(places) else tuple(np.median(places, axis=0).tolist())


def _check_place(field: float | None, dip: float | None) -> None:
    if field is not None and not 10.0 <= field <= 100.0:
        raise ArgumentError("field", f"must be that of a place on earth, 20 to 70 uT, got {field}")
    if dip is not None and not abs(dip) <= np.pi / 2.0:
        raise ArgumentError("dip", f"must be an angle from -pi/2 to pi/2 rad, got {dip}")


def _log(recording: Recording, gyro: str) -> Log:
    own = gyro.replace("gyro", "mag")
    log = recording.get(own if own in recording else "mag")
    if log is None:
        listed = ", ".join(recording) or "nothing"
        raise LogError(f"there is no magnetometer to calibrate; the recording has: {listed}")
    return log


def _by_gyro(recording: Recording, gyro: str, log: Log, one: bool) -> MagnetometerCalibration:
    samples = Samples.of(recording, gyro, what="a magnetometer's calibration")
    assert samples.mag is not None
    ends, wrong, notes = clipped(samples.mag, samples.gyro)
    problems = (*stuck(samples.mag), *wrong)
    mag = np.where(ends[:, None], np.nan, samples.mag)
    attitude = Attitude(samples.log.rate, mag=False)
    turned = attitude.smooth(samples.gyro, samples.accel, dt=samples.dt)["quaternion"]
    begin = float(samples.time[0])
    ticks = ticks_of(samples.time - begin, to_matrices(turned), samples.mag if problems else mag)
    _check_length(ticks.n / 10.0)
    found = None if problems else chosen(ticks, spans_of(ticks), one)
    if found is not None and _size(found) < _WEAK:
        problems = ("the samples do not turn with the sensor: the magnetometer is stuck",)
        found = None
    said = (*notes, *samples.notes)
    return _result(ticks, found, begin, log.unit, problems, said, recording.source)


def _check_length(seconds: float) -> None:
    if seconds < _SHORTEST / 10.0:
        raise LogError(
            f"a magnetometer's calibration needs ten seconds of samples, got {seconds:.1f} s"
        )


def _by_sphere(log: Log, recording: Recording) -> MagnetometerCalibration:
    known = np.isfinite(log.data).all(axis=1) & np.any(log.data != 0.0, axis=1)
    seconds = float(known.sum() / log.rate)
    _check_length(seconds)
    problems = stuck(log.data)
    centre = None if problems else sphere(log.data[known], seconds)
    begin, end = float(log.sampled[0]), float(log.sampled[-1])
    note = (
        "without a gyro a sphere was fitted: it needs all directions, and takes a magnet that "
        "comes and goes for noise"
    )
    return _of_sphere(centre, begin, end, log.unit, problems, note, recording.source)


def _of_sphere(
    found: Sphere | None,
    begin: float,
    end: float,
    unit: str,
    problems: tuple[str, ...],
    note: str,
    source: str,
) -> MagnetometerCalibration:
    unknown = Coefficient(0.0, identifiable=False, upper_bound=np.inf)
    norm = 1.0 if found is None else found.norm
    matrix, irons, field, advice = np.eye(11), (unknown,) * 3, unknown, []
    iron, raw, left, applied = (0.0, 0.0, 0.0), 0.0, 0.0, False
    if found is not None:
        matrix = np.diag([_SOFT_SIGMA**2] * 8 + [1.0] * 3)
        matrix[8:, 8:] = found.covariance
        irons = _irons(found.iron, found.covariance, norm)
        raw, left, applied = found.raw * norm, found.left * norm, found.applied
        if applied:
            iron = tuple((found.iron * norm).tolist())
        sigma = float(np.sqrt(np.trace(found.covariance) / 3.0))
        field = _one(found.radius * norm, sigma * norm, found.covered and sigma < KNOWN)
        if not found.covered:
            advice = ["turn the sensor so that each of its sides points down once"]
        elif known_directions(found.covariance) < 3:
            advice = ["record for 40 s or longer"]
    return MagnetometerCalibration(
        irons,
        _soft(np.zeros(8), np.full(8, np.inf)),
        (unknown,) * 3,
        field,
        unknown,
        "b" if applied else "none",
        (Span(begin, end, "informative" if applied else "still"),),
        (IronGroup(iron, raw, left, applied),),
        matrix,
        np.zeros(8),
        norm,
        unit,
        problems,
        tuple(advice),
        (note,),
        source,
    )


def _placed(
    found: MagnetometerCalibration, field: float | None, dip: float | None
) -> MagnetometerCalibration:
    """Return the calibration, not valid where its field cannot be that of the place."""
    problems = list(found.problems)
    if field is not None and found.unit not in MICROTESLA:
        raise ArgumentError(
            "field", f"is in uT: the unit of the magnetometer must be known, got '{found.unit}'"
        )
    if field is not None and found.field.identifiable:
        size, sigma = (
            MICROTESLA[found.unit] * one for one in (found.field.value, found.field.sigma)
        )
        if abs(size - field) > 3.0 * sigma + _ELSEWHERE * field:
            problems.append(
                f"the field is {size:.3g} uT, and that of the place {field:.3g} uT: the unit or "
                "the scale of the magnetometer is wrong, or it is beside iron that turns with it"
            )
    if dip is not None and found.dip.identifiable:
        apart = abs(found.dip - dip)
        if apart > 3.0 * found.dip.sigma + _OTHER_DIP:
            problems.append(
                f"the dip is {np.degrees(found.dip):.3g} deg, and that of the place "
                f"{np.degrees(dip):.3g} deg: axes of the magnetometer differ from the gyro's, or "
                "this is another place"
            )
    return replace(found, problems=tuple(problems))


def _evenness(samples: Floats) -> tuple[float, float]:
    """Return the median size of a field, and how much of it the size varies by."""
    sizes = np.linalg.norm(samples[np.isfinite(samples).all(axis=1)], axis=1)
    if not len(sizes):
        return 0.0, 0.0
    size = float(np.median(sizes))
    low, high = np.quantile(sizes, (0.159, 0.841))
    return size, float(high - low) / 2.0 / max(size, 1e-12)


def _size(found: Chosen) -> float:
    return float(np.median(np.linalg.norm(found.fit.fields, axis=1)))


def _result(
    ticks: Ticks,
    found: Chosen | None,
    begin: float,
    unit: str,
    problems: tuple[str, ...],
    notes: tuple[str, ...],
    source: str,
) -> MagnetometerCalibration:
    known: dict[str, Any] = {"norm": ticks.norm, "unit": unit, "notes": notes, "source": source}
    unknown = Coefficient(0.0, identifiable=False, upper_bound=np.inf)
    last = begin + float(ticks.number[-1] + 1) / 10.0
    if found is None:
        group = IronGroup((0.0, 0.0, 0.0), 0.0, 0.0, False)
        advice = () if problems else ("turn the sensor about two axes that differ",)
        soft = _soft(np.zeros(8), np.full(8, np.inf))
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
        replace(s, start=begin + s.start, stop=min(begin + s.stop, last)) for s in found.spans
    )
    groups = tuple(
        IronGroup(
            tuple((b * ticks.norm).tolist()), float(r * ticks.norm), float(u * ticks.norm), bool(a)
        )
        for b, r, u, a in zip(found.iron, found.raw, found.left, found.applied, strict=True)
    )
    lasts = [sum(s.stop - s.start for s in spans if s.group == g) for g in range(len(groups))]
    g = int(np.argmax(lasts))
    places = [*range(8), *range(8 + 3 * g, 11 + 3 * g)]
    matrix = found.covariance[np.ix_(places, places)]
    model: MagnetometerModel = "none"
    if found.applied.any():
        model = "b" if not found.soft else ("b+symmetric" if max(found.soft) > 1 else "b+scale")
    field, dip = _field(found, matrix, ticks.norm)
    return MagnetometerCalibration(
        _irons(found.iron[g], matrix[8:, 8:], ticks.norm),
        _soft(found.elements, np.sqrt(np.diagonal(matrix)[:8])),
        _rotation(found),
        field,
        dip,
        model,
        spans,
        groups,
        matrix,
        found.elements,
        advice=tuple(_advice(spans, groups, matrix[8:, 8:], unit)),
        residual=_residual(ticks, found) * ticks.norm,
        **known,
    )


def _residual(ticks: Ticks, found: Chosen) -> Floats:
    """Return what is left of the field in each second, its own being that of the nearest fit."""
    group = np.zeros(ticks.n, dtype=np.int64)
    for span in found.spans:
        group[span.within(ticks)] = span.group
    after = np.searchsorted(found.ticks.number, ticks.number).clip(1, found.ticks.n - 1)
    middle = (found.ticks.number[after] + found.ticks.number[after - 1]) / 2.0
    nearest = np.where(ticks.number > middle, after, after - 1)
    iron = np.where(found.applied[:, None], found.iron, 0.0)[group]
    inverse = np.linalg.inv(np.eye(3) + np.tensordot(found.elements, BASIS, axes=1))
    turned = (ticks.rotation @ ((ticks.field - iron) @ inverse.T)[:, :, None])[:, :, 0]
    squares = ((turned - found.fit.fields[found.fit.window[nearest]]) ** 2).sum(axis=1)
    second = ticks.number // 10
    count = np.bincount(second)
    with np.errstate(invalid="ignore"):
        left: Floats = np.sqrt(np.bincount(second, squares) / count)
    return left


def _irons(iron: Floats, block: Floats, norm: float) -> Vector:
    sigmas = np.sqrt(np.diagonal(block))
    x, y, z = (_one(v * norm, s * norm, s < KNOWN) for v, s in zip(iron, sigmas, strict=True))
    return x, y, z


def _one(value: float, sigma: float, identifiable: bool) -> Coefficient:
    if identifiable:
        return Coefficient(float(value), float(sigma))
    return Coefficient(float(value), float(sigma), False, float(value + _95 * sigma))


def _soft(elements: Floats, sigmas: Floats) -> Matrix:
    matrix = np.eye(3) + np.tensordot(elements, BASIS, axes=1)
    if not np.isfinite(sigmas).all():
        nothing = Coefficient(0.0, identifiable=False, upper_bound=np.inf)
        one = Coefficient(1.0, identifiable=False, upper_bound=np.inf)
        rows = [[one if i == j else nothing for j in range(3)] for i in range(3)]
    else:
        size = np.sqrt(np.tensordot(sigmas**2, BASIS**2, axes=1))
        rows = [
            [_one(matrix[i, j], size[i, j], bool(size[i, j] < _SOFT_SIGMA)) for j in range(3)]
            for i in range(3)
        ]
    a, b, c = ((row[0], row[1], row[2]) for row in rows)
    return a, b, c


def _rotation(found: Chosen) -> Vector:
    """Return the rotation vector of a fit of everything: of the antisymmetric elements."""
    xy, xz, yz = found.rotation / np.sqrt(2.0)
    sigmas = found.rotation_sigma / np.sqrt(2.0)
    values, order = (-yz, xz, -xy), sigmas[::-1]
    x, y, z = (_one(v, s, bool(s < _SOFT_SIGMA)) for v, s in zip(values, order, strict=True))
    return x, y, z


def _field(found: Chosen, matrix: Floats, norm: float) -> tuple[Coefficient, Coefficient]:
    """Return size and dip of the mean field, with what hard and soft iron leave open."""
    fields = found.fit.fields
    h, back = fields.mean(axis=0), found.ticks.back
    turn = found.ticks.rotation
    seen = back @ h
    slopes = [-(turn @ (seen @ element.T)[:, :, None])[:, :, 0].mean(axis=0) for element in BASIS]
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
        _one(size * norm, sigma * norm, sigma < KNOWN * size),
        _one(dip, angle, angle < KNOWN),
    )


def _advice(
    spans: tuple[Span, ...], groups: tuple[IronGroup, ...], block: Floats, unit: str
) -> Iterator[str]:
    size, axes = np.linalg.eigh(block)
    for k in range(3):
        if size[k] >= KNOWN**2:
            x, y, z = axes[:, k] * np.sign(axes[np.abs(axes[:, k]).argmax(), k])
            yield (
                f"turn once about an axis across ({x:.1f}, {y:.1f}, {z:.1f}) of the sensor: along "
                "it the hard iron is not known"
            )
    told = [span for span in spans if span.kind != "disturbed"]
    for one, other in pairwise(told):
        if one.group != other.group:
            irons = [np.array(groups[span.group].hard_iron) for span in (one, other)]
            apart = float(np.linalg.norm(irons[1] - irons[0]))
            yield (
                f"the field changed at {other.start:.0f} s by {apart:.3g} {unit} in the sensor: "
                "something was attached or taken off"
            )
