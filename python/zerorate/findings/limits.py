"""Limits above which a finding is worth a look or requires action, with sources."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

Severity = Literal["good", "look", "act"]


@dataclass(frozen=True)
class Limit:
    """Limits of one kind of finding.

    Parameters
    ----------
    what : str
        Limited quantity.
    unit : str
        Unit of both bounds.
    look, act : float
        A finding is worth a look from the value `look` on, and requires action from `act` on.
        Infinity: never.
    source : str
        Source of the limit; ``"own: "`` and the reason for a limit of this package.

    Examples
    --------
    >>> from zerorate.findings import Limit
    >>> share = Limit("share of samples", "%", look=0.1, act=1.0, source="own: a tenth")
    >>> [share.severity(value) for value in (0.05, 0.5, 2.0)]
    ['good', 'look', 'act']
    """

    what: str
    unit: str
    look: float
    act: float
    source: str

    def severity(self, value: float, sigma: float = 0.0) -> Severity:
        """Return the severity of a value: "act" only from two standard errors above `act`."""
        if value - 2.0 * sigma >= self.act:
            return "act"
        return "look" if value >= self.look else "good"


_LOOK_DIVISOR: Final = math.sqrt(3.0)
_ARMING: Final = "ArduPilot, arming check"
_VIBRATION: Final = "ArduPilot wiki, Measuring Vibration"


def _limit_from_act(what: str, unit: str, act: float, source: str) -> Limit:
    """Return a limit from its upper bound; the lower bound is the upper bound over √3."""
    return Limit(what, unit, act / _LOOK_DIVISOR, act, source)


LIMITS: Final[Mapping[str, Limit]] = {
    "jitter": Limit(
        "jitter of the stamps, RMS", "% of a period", 5.8, math.inf,
        "own: 10 % / √3; 10 % of a period is 0.1 deg at 100 Hz and 100 deg/s",
    ),
    "late stamps": Limit(
        "share of stamps that are over half a period late", "%", 0.17, math.inf,
        "own: 0.3 % / √3; 0.17 % is five stamps in 30 s at 100 Hz",
    ),
    "no stamps": Limit(
        "clocks without timestamps", "", 1, math.inf,
        "own: a lost sample shifts all later samples unnoticed",
    ),
    "repeated stamps": Limit(
        "stamps equal to the previous stamp", "", 1, math.inf,
        "own: a repeated stamp is not the time of its sample",
    ),
    "break": Limit(
        "longest break of the log", "s", 1.7, math.inf,
        "own: 3 s / √3; in 3 s a hand or a vehicle can turn to any heading",
    ),
    "gaps": _limit_from_act(
        "angle error if straight lines replace lost samples", "deg", 1.0,
        "own: 1 deg of heading is 1.7 m in 100 m",
    ),
    "lost samples": Limit(
        "share of samples lost in gaps", "%", 1.0, 5.0,
        "own: 1 % is one second in 100 s",
    ),
    "missing samples": Limit(
        "share of samples without a value", "%", 0.1, 10.0,
        "own: 0.1 % is six samples per minute at 100 Hz",
    ),
    "at its limit": Limit(
        "share of samples at their limit", "%", 0.1 / _LOOK_DIVISOR, 1.0,
        "own: 0.1 % / √3; 0.1 % is six samples per minute at 100 Hz",
    ),
    "at its limit, longest": Limit(
        "longest time at the limit", "s", math.inf, 0.2,
        "own: half a period of a hand's or foot's motion at 2.5 Hz",
    ),
    "soft limit": Limit(
        "share of samples at a soft limit", "%", 0.1 / _LOOK_DIVISOR, math.inf,
        "own: as for samples at their limit",
    ),
    "equal samples": Limit(
        "consecutive equal samples", "", 58, 100, "PX4, VALUE_EQUAL_COUNT_DEFAULT"
    ),
    "spikes": Limit(
        "single samples far from both neighbours", "", 7, math.inf,
        "own: 12 / √3; no log of 200 simulated logs without faults has 12",
    ),
    "spikes, share": Limit(
        "share of single samples far from both neighbours", "%", math.inf, 0.1,
        "own: one sample in a thousand"
    ),
    "coarse step": Limit(
        "resolution step divided by the scatter at rest", "", 2.0, math.inf,
        "own: a step of twice the scatter hides the noise",
    ),
    "gyro bias": _limit_from_act(
        "bias of the gyro at rest", "deg/s", 5.0,
        "own: as ArduPilot's limit of the difference between two gyros",
    ),
    "bias moves": Limit(
        "change of the gyro bias between two rests", "deg/s", 0.1, math.inf,
        "own: 0.1 deg/s is 6 deg of heading in a minute"
    ),
    "bias by temperature": Limit(
        "change of the gyro bias with temperature", "deg/s/K", 0.03, math.inf,
        "own: 10 K change the bias by 0.3 deg/s",
    ),
    "gravity": _limit_from_act(
        "difference between the norm at rest and 9.807 m/s²", "m/s²", 0.4, "PX4, EKF2_ABL_LIM"
    ),
    "gyro noise": Limit(
        "noise of the gyro at rest", "deg/s/√Hz", 0.15 / _LOOK_DIVISOR, math.inf,
        "own: 0.15 / √3; 0.15 is 30 times the data-sheet noise of the MPU-6050",
    ),
    "accel noise": Limit(
        "noise of the accelerometer at rest", "µg/√Hz", 1500 / _LOOK_DIVISOR, math.inf,
        "own: 1500 / √3; 1500 is about four times the data-sheet noise of the MPU-6050",
    ),
    "vibration": Limit(
        "vibration by ArduPilot's formula, 95th percentile", "m/s²", 30.0, 60.0, _VIBRATION
    ),
    "aliased peak": Limit(
        "amplitude of an aliased peak", "m/s²", 3 / _LOOK_DIVISOR, math.inf,
        "own: 3 / √3; 3 m/s² is a third of gravity",
    ),
    "vibration metric": Limit(
        "PX4's own vibration metric, 95th percentile", "m/s²", 4.905, 9.81,
        "PX4 flight_review's plot",
    ),
    "estimator vibration": Limit(
        "vibration in PX4's estimator (vibe[2]), 95th percentile", "m/s", 0.02, 0.04,
        "older flight_review",
    ),
    "clips": Limit("increase of the log's counts of clipped samples", "", 1, 100, _VIBRATION),
    "gyros differ": _limit_from_act("difference between two gyros at rest", "deg/s", 5.0, _ARMING),
    "accels differ": _limit_from_act(
        "difference between two accelerometers at rest", "m/s²", 0.75, "ArduPilot, ARMING_ACCTHRESH"
    ),
    "delay": Limit(
        "delay between two gyros", "ms", 10 / _LOOK_DIVISOR, math.inf,
        "own: 10 ms / √3; 10 ms is 1 deg at 100 deg/s",
    ),
    "scales differ": Limit(
        "difference between the scales of two gyros", "%", 3.0, math.inf,
        "MPU-6050, sensitivity tolerance"
    ),
    "inclination": Limit(
        "median inclination error of zr.Attitude at the start of rests",
        "deg", 5.0, math.inf, _ARMING,
    ),
    "trust": Limit(
        "share of time in which the inclination's standard deviation is above 5 deg",
        "%", 90.0, math.inf, "own: the inclination is known for less than a tenth of the time",
    ),
    "log inclination": _limit_from_act(
        "median inclination error of the log's own attitude at rest", "deg", 5.0, _ARMING
    ),
    "attitudes differ": Limit(
        "angle between the verticals of the log's attitude and zr.Attitude, 95th percentile",
        "deg", 5.0, math.inf, _ARMING,
    ),
    "receiver's clock": Limit(
        "offset of the receiver's clock", "s", 0.2, 1.0,
        "own: at 5 m/s, 0.2 s is 1 m and 1 s is 5 m",
    ),
    "innovations": Limit(
        "innovations divided by the standard deviations stated by the receiver", "", 2.0, math.inf,
        "own: the errors are twice as large as stated",
    ),
    "heading error": _limit_from_act(
        "heading error of a level sensor by hard iron", "deg", 10.0,
        "own: 10 deg of heading are 18 m in 100 m",
    ),
    "iron changes": Limit(
        "changes of the magnetometer's hard iron", "", 1, math.inf,
        "own: one change makes an earlier calibration wrong",
    ),
    "disturbed": Limit(
        "share of time in which no hard iron fits", "%", 2.0, math.inf,
        "own: 2 % is 1.2 s per minute",
    ),
}  # fmt: skip
"""Limits by kind of finding; the documentation shows this table."""
