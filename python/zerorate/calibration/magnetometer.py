"""Calibration of a magnetometer: its correction and its reliability."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from dataclasses import field as _default
from typing import Any, Final, Literal, Self

import numpy as np
import numpy.typing as npt

from zerorate.calibration.magnet.exports import to_ardupilot, to_px4
from zerorate.calibration.magnet.fit import BASIS
from zerorate.calibration.magnet.spans import Span, list_iron_changes
from zerorate.calibration.parameters import Matrix, Vector
from zerorate.faults import ArgumentError
from zerorate.noise.coefficient import Coefficient
from zerorate.noise.exports import write_text
from zerorate.record import LogError, Recording
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
_HEADINGS_RAD: Final = np.radians(10.0) * np.arange(36)
_MAX_FIELD_RATIO: Final = 2.0
"""Largest ratio between the fields of a log and of the calibration."""
_UNEVENNESS_LIMITS: Final = (1.5, 0.15)
"""Two limits that only another device's field exceeds: ratio of the unevenness after and before
correction, and unevenness after correction.
"""


@dataclass(frozen=True)
class IronGroup:
    """One hard iron of a record; several spans may share it.

    Parameters
    ----------
    hard_iron
        Estimated hard iron, unit of the samples; zero along unknown directions.
    scatter_raw, scatter_unseen
        RMS distance of an axis from a constant field, in blocks excluded from the fit.
        ``scatter_raw`` is for raw samples, ``scatter_unseen`` for samples minus the hard iron.
    applied
        True if the hard iron is subtracted.

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
    """Calibration of a magnetometer: ``raw = soft_iron @ field + hard_iron``.

    Parameters
    ----------
    hard_iron
        Hard iron of the group with the longest duration, unit of the samples.
    soft_iron
        Soft iron matrix with a trace of 3; the unit matrix if it is not applied.
    rotation
        Rotation vector of the magnetometer relative to the gyro, rad, from a fit of all parameters.
        This rotation is never applied.
    field, dip
        Magnitude of the field (unit of the samples) and its angle below the horizontal (rad).
    model
        Name of the applied corrections.
    spans
        Spans of constant hard iron, as times of the gyro in s, with kinds and groups (see `Span`).
    groups
        Hard irons of the record; `Span.group` is an index of this tuple.
    covariance
        Covariance of the elements of the soft iron and of hard iron / `norm`, shape (11, 11).
    elements
        Soft iron minus the unit matrix, as coefficients of eight orthonormal matrices, shape (8,).
        Two matrices change the scale, three are symmetric, three antisymmetric.
    norm
        Median magnitude of the samples, in their unit.
    unit
        Unit of the samples.
    problems, advice, notes
        Reasons why the calibration is not valid; advice for the next record; assumptions.
    source
        Name of the recording.
    residual
        RMS residual of the field over each second, unit of the samples. NaN for a second without
        samples; empty without a gyro.
    alarms
        Contradictions that `zerorate.calibrate_magnetometer` found in the recording. Files do not
        contain them.

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
        """True if the calibration has no problem."""
        return not self.problems

    @property
    def applied(self) -> bool:
        """True if `apply` changes samples."""
        return self.model != "none"

    @property
    def disturbed(self) -> float:
        """Share of the time in which no hard iron explains the field."""
        total = sum(span.stop - span.start for span in self.spans)
        disturbed_s = sum(s.stop - s.start for s in self.spans if s.kind == "disturbed")
        return disturbed_s / total if total else 0.0

    @property
    def iron_changes(self) -> tuple[tuple[float, float], ...]:
        """Time (s, as in `spans`) and size (in `unit`) of each change of the hard iron."""
        irons = [group.hard_iron for group in self.groups]
        return tuple(list_iron_changes(self.spans, irons))

    def apply(
        self, samples: Recording | npt.ArrayLike, time: npt.ArrayLike | None = None
    ) -> Recording | Floats:
        """Return the samples, or the recording, with the magnetometer corrected.

        Parameters
        ----------
        samples : Recording or array_like, shape (n, 3)
            Recording, or samples in the calibration's `unit`. They are returned unchanged if
            nothing is applied.
        time : array_like, shape (n,), optional
            Times of the samples in this calibration's recording, s. Each sample is then corrected
            by the hard iron of its span. Without times, or for another recording, the hard iron of
            the longest group is used.

        Raises
        ------
        ValueError
            If samples have another shape. If the recording has no magnetometer in this unit. If the
            field shows that the calibration is of another device.
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
        """Raise LogError if the calibration is of another device: the field is then more uneven."""
        unevenness_before, (size, unevenness) = (
            _measure_unevenness(before)[1],
            _measure_unevenness(after),
        )
        max_ratio, max_unevenness = _UNEVENNESS_LIMITS
        if unevenness > max(max_ratio * unevenness_before, max_unevenness):
            raise LogError(
                "the calibration is of another device, or its magnets have moved: with the "
                f"calibration the field's size varies by {100.0 * unevenness:.0f} %, without by "
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
        """Index of the group with the longest duration."""
        return int(self._group_durations.argmax())

    @property
    def _group_durations(self) -> Floats:
        durations = np.zeros(max(len(self.groups), 1))
        for span in self.spans:
            durations[span.group] += span.stop - span.start
        return durations

    @property
    def longest_applied(self) -> int:
        """Index of the longest group with an applied hard iron; `longest` if there is none."""
        durations = (
            self._group_durations * [group.applied for group in self.groups]
            if self.groups
            else None
        )
        return self.longest if durations is None or not durations.any() else int(durations.argmax())

    def __field_correction__(self) -> tuple[list[float], list[list[float]]] | None:
        """Return the correction for `Attitude`: hard iron of `longest`, inverse soft iron."""
        if not self.groups[self.longest].applied:
            return None
        inverse = np.linalg.inv(np.array(self.soft_iron, dtype=np.float64))
        return list(self.groups[self.longest].hard_iron), inverse.tolist()

    def heading_error(self, before: bool = False, group: int | None = None) -> Floats:
        """Return the expected heading error of a level sensor, rad, shape (36,).

        Parameters
        ----------
        before : bool
            True: error of raw samples, from hard and soft iron and their uncertainty. False: error
            after correction.
        group : int, optional
            Index of the group that gives the hard iron. Default: `longest`.

        Returns
        -------
        ndarray, shape (36,)
            RMS errors at headings 0, 10, ... 350 deg.
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
        """Return the calibration as JSON without loss of digits, and write it to a given path."""
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
        """Return the calibration that `to_json` wrote, without loss of digits."""
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
        """Return one line with the applied corrections."""
        state = f"model {self.model!r}" if self.valid else "not valid"
        return f"MagnetometerCalibration({state}; {len(self.spans)} spans)"


def _encode_coefficients(coefficient: Any) -> list[Any]:  # noqa: ANN401
    """Return the fields of a coefficient, or of each coefficient in nested tuples."""
    if isinstance(coefficient, tuple):
        return [_encode_coefficients(inner) for inner in coefficient]
    return [coefficient.value, coefficient.sigma, coefficient.identifiable, coefficient.upper_bound]


def _decode_coefficients(encoded: list[Any]) -> Any:  # noqa: ANN401
    if any(isinstance(inner, list) for inner in encoded):
        return tuple(_decode_coefficients(inner) for inner in encoded)
    value, sigma, identifiable, bound = encoded
    return Coefficient(value, sigma, identifiable, np.inf if bound is None else bound)


def _measure_unevenness(samples: Floats) -> tuple[float, float]:
    """Return the median magnitude of a field, and the relative variation of the magnitude."""
    sizes = np.linalg.norm(samples[np.isfinite(samples).all(axis=1)], axis=1)
    if not len(sizes):
        return 0.0, 0.0
    size = float(np.median(sizes))
    low, high = np.quantile(sizes, (0.159, 0.841))
    return size, float(high - low) / 2.0 / max(size, 1e-12)
