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
"""Four standard deviations of a data sheet's: beyond them a unit or a range is mistaken."""

_MAX_OUTLIER_SHARE: Final = 1 / 3
"""Of the turns: a knock makes a few."""


_MIN_TURN_RAD: Final = 10 * _DEG
"""Smaller ones miss by noise more than by parts of their angle."""

_MAX_MOVING_SHARE: Final = 1 / 3
"""Of the rests. Motion in a few of them is an error of each; one that most have in common, as by a
table that gives way, looks like an error of the sensors."""

_MIN_REST_S: Final = 3.0
"""s, below which longer rests are advised."""

_MIN_POSES: Final = 12
_MAX_TURN_RAD: Final = 170 * _DEG
_ADVISED_POSE_SIGMA: Final = 1e-3
"""Of |f|/g in a pose that is advised: a modest sensor's in five seconds."""

_MAX_UNUSED_SHARE: Final = 0.1
"""Part of the turns that may be left out for one reason without advice on it."""

_ADVICE_BY_REASON: Final = {
    SATURATED: "rotate more slowly: the gyro reached its range",
    GAP: "record without gaps: rotations with missing samples were left out",
    LONG: "finish each rotation within a few seconds: longer rotations were left out",
}
_MIN_POSE_SPREAD_RAD: Final = 60 * _DEG
_MAX_VERTICAL_COSINE: Final = 0.95
"""Cosine to the vertical, 18 degrees: such turns move gravity by a third of themselves at most."""


def describe_gyro_axes(axes: Floats) -> str:
    """Return a sentence on a gyro whose axes are a signed permutation of those expected."""
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
        What was found.
    known_units
        True for a known unit, of the accelerometer and of the gyro.
    identifiable
        Of the names of all parameters, shape (33,).
    rests, turns
        Those that the fit used, with direction, angle and axis.
    errors
        |f|/g - 1 and misses of carried gravity, rad, held out if there are enough.
    """
    still = errors[0][[not rest.reason for rest in rests]]
    # What is not known stays where it was, and |f| is wrong by that.
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
    """Return the faults of the determinants: a fit may be perfect at a scale of zero."""
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
        # A knock makes one turn bad, and not the others.
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
    """Return the property of poses and rotations that hides parameters."""
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
    """Return advice for another record, for a person with the sensor in hand.

    Parameters
    ----------
    fit, prior
        What was found, and what was known.
    rests, turns
        All of them.
    unused
        Why turns were not used: kinds of reasons.
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
    """Return the axes to hold up so that the scale of gravity is known in all directions.

    One after the other, the direction that is known worst is taken to be measured.
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
    """Return the axes about which turns are known too badly, worst first."""
    _, size = prior.sizes
    sigmas = turn_sigmas(fit, size)
    order = np.argsort(-sigmas)
    return [_AXES[axis] for axis in order if sigmas[axis] > MAX_TURN_SIGMA_RAD]
