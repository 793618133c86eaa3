"""Assessment of a calibration: reasons not to trust it, and advice for another record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from zerorate.calibration.fit.expected_errors import (
    MAX_MISS_SHARE,
    MAX_NORM_ERROR,
    MAX_POSE_SIGMA,
    MAX_TURN_SIGMA_RAD,
    norm_jacobian,
    turn_sigmas,
)
from zerorate.calibration.fit.joint_fit import Fit, Prior
from zerorate.calibration.fit.turns import GAP, LONG, SATURATED
from zerorate.calibration.parameters import PARAMETERS
from zerorate.calibration.record import Rest, Turn
from zerorate.types import Booleans, Floats

_DEG: Final = math.pi / 180.0
_AXES: Final = "xyz"
_MIN_SCALE: Final = 0.8
_MAX_SCALE: Final = 1.25
"""Largest scale of a sensor relative to its unit; a scale beyond the limits means a mistaken unit
or range. The limits are about four standard deviations of a data sheet from 1.
"""

_MAX_OUTLIER_SHARE: Final = 1 / 3
"""Largest share of the rotations that may be outliers: a knock affects few."""


_MIN_TURN_RAD: Final = 10 * _DEG
"""Smallest rotation for the share of its angle: noise dominates smaller ones."""

_MAX_MOVING_SHARE: Final = 1 / 3
"""Largest share of the rests that may contain motion. Motion in a few rests affects only these
rests. Motion in most rests, as on a table that gives way, looks like an error of the sensors.
"""

_MIN_REST_S: Final = 3.0
"""Length of rests, s, below which longer rests are advised."""

_MIN_POSES: Final = 12
_MAX_TURN_RAD: Final = 170 * _DEG
_ADVISED_POSE_SIGMA: Final = 1e-3
"""Standard error of |f|/g assumed for an advised pose: a modest sensor averaged over 5 s."""

_MAX_UNUSED_SHARE: Final = 0.1
"""Share of rotations left out for one reason above which advice is given."""

_ADVICE_BY_REASON: Final = {
    SATURATED: "rotate more slowly: the gyro reached its range",
    GAP: "record without gaps: rotations with missing samples were left out",
    LONG: "finish each rotation within a few seconds: longer rotations were left out",
}
_MIN_POSE_SPREAD_RAD: Final = 60 * _DEG
_MAX_VERTICAL_COSINE: Final = 0.95
"""Cosine between rotation axis and vertical, 18 degrees: rotations nearer to the vertical move
gravity by at most a third of their angle.
"""


def describe_gyro_axes(axes: Floats) -> str:
    """Return a sentence on a gyro with permuted or inverted axes."""
    axis_names = ", ".join(_signed_axis_name(row) for row in axes)
    if np.linalg.det(axes) < 0:
        return (
            "the gyro's axes are left-handed; one sign is wrong, or two axes are exchanged: it "
            f"follows gravity if ({axis_names}) is read as its (x, y, z)"
        )
    return (
        "the gyro's axes are not those of the accelerometer: it follows gravity if "
        f"({axis_names}) is read as its (x, y, z)"
    )


def _signed_axis_name(row: Floats) -> str:
    axis = int(np.abs(row).argmax())
    return ("-" if row[axis] < 0 else "") + _AXES[axis]


def find_problems(
    fit: Fit,
    known_units: tuple[bool, bool],
    identifiable: Booleans,
    rests: Sequence[Rest],
    turns: Sequence[Turn],
    errors: tuple[Floats, Floats],
) -> list[str]:
    """Return the reasons why a calibration is not valid, worst first.

    Parameters
    ----------
    fit
        Result of the fit.
    known_units
        True for a known unit, of the accelerometer and of the gyro.
    identifiable
        Mask of all parameters that the record determines, shape (33,).
    rests, turns
        Rests and rotations of the fit, with direction, angle and axis.
    errors
        |f|/g - 1 and error angles of propagated gravity, rad; held out if there are enough rests.
    """
    still = errors[0][[not rest.reason for rest in rests]]
    # An unknown parameter keeps its prior value, so |f| is wrong by its error.
    norms = still if identifiable[:12].all() else np.zeros(0)
    problems = _scale_problems(fit, known_units) + _size_problems(
        norms, errors[1], turns, fit.weights
    )
    moving = len(rests) - len(still)
    if moving > _MAX_MOVING_SHARE * len(rests):
        problems.append(f"the sensor moved in {moving} of {len(rests)} rests")
    undetermined = [name for name, known in zip(PARAMETERS, identifiable, strict=True) if not known]
    undetermined = [name for name in undetermined if "g_sensitivity" not in name]
    if undetermined:
        problems.append(
            f"{len(undetermined)} of 18 parameters are not identifiable: {', '.join(undetermined)}"
        )
        problems += _explain_undetermined(rests, turns)
    return problems


def _scale_problems(fit: Fit, known_units: tuple[bool, bool]) -> list[str]:
    """Return problems of the determinants: a fit may be perfect at a scale of zero."""
    problems = []
    for name, matrix, known in (
        ("accelerometer", fit.accel, known_units[0]),
        ("gyro", np.linalg.inv(fit.gyro), known_units[1]),
    ):
        determinant = float(np.linalg.det(matrix))
        if determinant < 0 and name == "gyro" and not known:
            problems.append("the gyro's axes are left-handed; one sign is wrong")
        scale = abs(determinant) ** (1 / 3)
        if known and not _MIN_SCALE <= scale <= _MAX_SCALE:
            problems.append(f"the {name}'s scale comes out as {scale:.3g} of what its unit says")
    return problems


def _size_problems(
    norms: Floats, misses: Floats, turns: Sequence[Turn], weights: Floats
) -> list[str]:
    problems = []
    norm = float(np.sqrt(np.mean(norms**2))) if len(norms) else 0.0
    if norm > MAX_NORM_ERROR:
        problems.append(
            f"|f| at rest misses gravity by {1e3 * norm:.0f} mg RMS: rests were not still, or "
            "samples are wrong"
        )
    if len(misses):
        # A knock affects a single rotation.
        miss = float(np.median(misses))
        if miss > MAX_MISS_SHARE * max(
            float(np.median([turn.angle for turn in turns])), _MIN_TURN_RAD
        ):
            problems.append(
                "gravity propagated through the rotations is off by "
                f"{miss / _DEG:.1f} deg at the median"
            )
    outliers = int((weights < 0.5).sum())
    if outliers > _MAX_OUTLIER_SHARE * max(len(weights), 1):
        problems.append(f"{outliers} of {len(weights)} turns disagree with the others")
    return problems


def _explain_undetermined(rests: Sequence[Rest], turns: Sequence[Turn]) -> list[str]:
    """Return the property of poses and rotations that leaves parameters undetermined."""
    up = np.array([rest.direction for rest in rests])
    spread = float(np.arccos((up @ up.T).clip(-1.0, 1.0)).max())
    causes = []
    if spread < _MIN_POSE_SPREAD_RAD:
        causes.append(f"all poses lie within {spread / _DEG:.0f} deg")
    vertical = [abs(float(t.axis @ u)) for t, u in _pair_directions(rests, turns)]
    if vertical and np.median(vertical) > _MAX_VERTICAL_COSINE:
        causes.append(
            "the rotations are about the vertical, about which gravity gives no information"
        )
    return causes


def _pair_directions(rests: Sequence[Rest], turns: Sequence[Turn]) -> list[tuple[Turn, Floats]]:
    by_end = {rest.last: rest.direction for rest in rests}
    return [(turn, by_end[turn.first + 1]) for turn in turns if turn.first + 1 in by_end]


def give_advice(
    fit: Fit, prior: Prior, rests: Sequence[Rest], turns: Sequence[Turn], unused: Sequence[str]
) -> list[str]:
    """Return advice for the next record, for a person who holds the sensor.

    Parameters
    ----------
    fit, prior
        Result of the fit, and its prior.
    rests, turns
        All rests and all rotations.
    unused
        Kinds of reasons why rotations were not used.
    """
    used = [rest for rest in rests if rest.used]
    advice = [f"hold {pose} up for five seconds" for pose in _advise_poses(fit)]
    advice += [
        f"turn by about 90 degrees about {axis}, with {axis} level, between rests"
        for axis in _advise_turns(fit, prior)
    ]
    if len(used) < _MIN_POSES:
        advice.append(f"rest in {_MIN_POSES} poses or more, each of another direction")
    max_count = _MAX_UNUSED_SHARE * (len(turns) + len(unused))
    advice += [text for kind, text in _ADVICE_BY_REASON.items() if unused.count(kind) > max_count]
    if any(rest.reason for rest in rests):
        advice.append("put the sensor down for rests: it moved in some of them")
    if np.median([rest.stop - rest.start for rest in used]) < _MIN_REST_S:
        advice.append("rest for five seconds in each pose")
    if turns and np.median([turn.angle for turn in turns]) > _MAX_TURN_RAD:
        advice.append("rotate by 60 to 170 degrees: longer rotations reduce accuracy")
    return advice


def _advise_poses(fit: Fit) -> list[str]:
    """Return the axes to hold up for a known scale of gravity in all directions.

    Repeatedly add a simulated measurement in the least known direction.
    """
    covariance = fit.covariance[:9, :9].copy()
    ups = np.concatenate((np.eye(3), -np.eye(3)))
    rows = norm_jacobian(fit.accel, ups)
    poses = []
    for _ in range(len(ups)):
        sigmas = np.sqrt(np.einsum("ij,jk,ik->i", rows, covariance, rows).clip(0.0))
        worst = int(sigmas.argmax())
        if sigmas[worst] < MAX_POSE_SIGMA:
            break
        poses.append(("+" if worst < 3 else "-") + _AXES[worst % 3])
        gain = covariance @ rows[worst] / (sigmas[worst] ** 2 + _ADVISED_POSE_SIGMA**2)
        covariance -= np.outer(gain, rows[worst] @ covariance)
    return poses


def _advise_turns(fit: Fit, prior: Prior) -> list[str]:
    """Return the axes with badly known rotations, worst first."""
    _, size = prior.sizes
    sigmas = turn_sigmas(fit, size)
    order = np.argsort(-sigmas)
    return [_AXES[axis] for axis in order if sigmas[axis] > MAX_TURN_SIGMA_RAD]
