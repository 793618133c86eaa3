"""Result of a check: data, sentences, and the corrected recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from zerorate.checks.decision import Status
from zerorate.noise.coefficient import Coefficient
from zerorate.record import Log, Recording
from zerorate.record.saved import as_json
from zerorate.types import Floats
from zerorate.views import Result

_ALARM_STATUSES: Final = ("mistake", "unit only")
_FORMAT: Final = "zerorate checks"
_VERSION: Final = 1


@dataclass(frozen=True, eq=False)
class Finding:
    """Finding on the unit and axes of one sensor, from motion.

    Parameters
    ----------
    sensor : str
        Name of the log, for instance ``"gyro"``.
    status : str
        - ``"agrees"``: the log's unit and axes fit, and no other hypothesis does.
        - ``"partly seen"``: nothing contradicts the log, and some axes are confirmed.
        - ``"cannot tell"``: the motion does not decide.
        - ``"doubt"``: another hypothesis fits better, but not clearly enough to name it.
        - ``"mistake"``: another hypothesis certainly fits.
        - ``"unit only"``: another unit fits, and the axes are undecided.
    text : str
        Sentence on the result.
    unit : str
        Unit of the values: the log's unit, or the correct unit if the log's is wrong.
    factor : float
        Factor that converts the values to `unit`.
    matrix : ndarray, shape (3, 3), or None
        Correct axes as a signed permutation, ``matrix @ sample``. None if more than one permutation
        remains.
    likely : str
        Among the permutations that fit, the one with the fewest exchanged or inverted axes, as
        users type it: ``"x,-y,z"``. Empty if no permutation is named.
    alternatives : tuple of str
        All remaining permutations; empty if all 48 remain.
    seen : tuple of (str or None)
        For each axis, the row of the matrix if all remaining permutations have the same row, for
        instance ``"-y"``. ``"±y"`` if these rows differ only in sign, None if they differ in axis.
    spans : tuple of (float, float)
        Start and end of the time spans with evidence, s.
    ratio : float
        Misfit of the unchanged log divided by the misfit with the named axes; 1 if no axes are
        named.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=60.0).recording()
    >>> wrong = zr.Log(**{**vars(recording.gyro), "data": recording.gyro.data * [1, -1, 1]})
    >>> found = zr.check(zr.Recording({**recording, "gyro": wrong})).gyro
    >>> found.status, found.likely, bool((found.apply(wrong).data == recording.gyro.data).all())
    ('mistake', 'x,-y,z', True)
    """

    sensor: str
    status: Status
    text: str
    unit: str = ""
    factor: float = 1.0
    matrix: Floats | None = None
    likely: str = ""
    alternatives: tuple[str, ...] = ()
    seen: tuple[str | None, str | None, str | None] = (None, None, None)
    spans: tuple[tuple[float, float], ...] = ()
    ratio: float = 1.0

    @property
    def alarm(self) -> bool:
        """True if the log's unit or axes are certainly wrong."""
        return self.status in _ALARM_STATUSES

    @property
    def exact(self) -> bool:
        """True if the correction of the log is known."""
        return self.alarm and (self.matrix is not None or self.status == "unit only")

    def apply(self, log: Log) -> Log:
        """Return the corrected log with a note; the log itself if the correction is unknown."""
        if not self.exact:
            return log
        data = log.data * self.factor
        changes = []
        if self.unit != log.unit:
            changes.append(f"read as {self.unit}")
        if self.factor != 1.0:
            changes.append(f"multiplied by {self.factor:.6g}")
        if self.matrix is not None and not np.array_equal(self.matrix, np.eye(3)):
            data = data @ self.matrix.T
            changes.append(f"({self.likely}) read as (x,y,z)")
        note = f"{', '.join(log.names)}: {', '.join(changes)}, as the motion shows"
        notes = (*log.meta.get("notes", ()), note)
        return replace(log, data=data, unit=self.unit, meta={**log.meta, "notes": notes})


@dataclass(frozen=True, eq=False)
class Checks(Result):
    """Result of `zerorate.check`: findings on the sensors of a recording, from its motion.

    Parameters
    ----------
    gyro, magnetometer : Finding
        Findings on the gyro, from the accelerometer, and on the magnetometer, from the gyro.
    scale : tuple of Coefficient
        Scale factors of the gyro's axes x, y, z: 1.01 if the gyro reads 1 % too little. A factor is
        not identifiable if its standard error exceeds 3 %, or if the unit or axes do not fit.
    delay : Coefficient
        Delay of the gyro behind the accelerometer, s. Not identifiable if its standard error
        exceeds 15 ms.
    dip : float or None
        Angle of the magnetic field below the horizontal, rad; None without a magnetometer. Negative
        south of the magnetic equator, or if the magnetometer has the wrong sign. Motion cannot
        distinguish these two cases.
    source : str
        Name of the recording.
    notes : tuple of str
        Sentences on values that are too large or too small for their unit.
    clock : str
        Sentence on stamps that contradict the stated rate; empty if they agree to 0.1 %.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=60.0).recording()
    >>> zr.check(recording)
    Checks(gyro agrees, magnetometer cannot tell)
    """

    gyro: Finding
    magnetometer: Finding
    scale: tuple[Coefficient, Coefficient, Coefficient]
    delay: Coefficient
    dip: float | None = None
    source: str = "the recording"
    notes: tuple[str, ...] = ()
    clock: str = ""

    @property
    def alarms(self) -> tuple[str, ...]:
        """Certain errors, one sentence each."""
        texts = (finding.text for finding in (self.gyro, self.magnetometer) if finding.alarm)
        return (*texts, *filter(None, (self.clock,)))

    def apply(self, recording: Recording) -> Recording:
        """Return the recording with the gyro's unit and axes corrected, if the correction is known.

        The gyro's log gets a note. The magnetometer stays unchanged, because no motion shows its
        overall sign.
        """
        if not self.gyro.exact:
            return recording
        name = self.gyro.sensor
        return replace(recording, logs={**recording, name: self.gyro.apply(recording[name])})

    def to_json(self) -> str:
        """Return all results as JSON, with null for unknown numbers."""
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "source": self.source,
            "gyro": _as_dict(self.gyro),
            "magnetometer": _as_dict(self.magnetometer),
            "scale": [_encode_coefficient(coefficient) for coefficient in self.scale],
            "delay": _encode_coefficient(self.delay),
            "dip": self.dip,
            "notes": self.notes,
            "clock": self.clock,
        }
        return as_json(content, indent=1)

    def __repr__(self) -> str:
        """Return the status of each sensor."""
        return f"Checks({', '.join(self._statuses())})"

    def _statuses(self) -> Iterator[str]:
        for name, finding in (("gyro", self.gyro), ("magnetometer", self.magnetometer)):
            yield f"{name} {finding.status}" if finding.sensor else f"no {name}"


def _as_dict(finding: Finding) -> dict[str, Any]:
    return {**vars(finding), "alarm": finding.alarm}


def _encode_coefficient(value: Coefficient) -> dict[str, Any] | None:
    known = {"value": value.value, "sigma": value.sigma}
    return known if value.identifiable else None
