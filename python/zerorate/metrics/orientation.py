"""Errors in orientation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError
from zerorate.geometry import rotations
from zerorate.geometry.scipy_rotation import RotationLike, as_quaternions
from zerorate.metrics.channels import check_positive, rms
from zerorate.record.missing import floats
from zerorate.record.named import convert_to_unit, rate_of
from zerorate.types import Booleans, Floats, Integers
from zerorate.units import whole_samples

Heading: TypeAlias = Literal["absolute", "relative", "aligned"]
_HEADINGS: Final = ("absolute", "relative", "aligned")


@dataclass(frozen=True)
class OrientationErrors:
    """RMS angles between orientations and a reference, rad.

    Attributes
    ----------
    total : float
        RMS angle of the complete rotation between both.
    heading : float
        RMS angle of the rotation's part about the vertical.
    inclination : float
        RMS of the angle between both vertical directions.
    sample_count : int
        Number of samples compared.

    Examples
    --------
    >>> import numpy as np
    >>> from zerorate.metrics import orientation_errors
    >>> turned = np.tile([np.cos(0.1), 0.0, 0.0, np.sin(0.1)], (10, 1))
    >>> found = orientation_errors(turned, np.tile([1.0, 0.0, 0.0, 0.0], (10, 1)))
    >>> round(found.heading, 6), round(found.inclination, 6), found.sample_count
    (0.2, 0.0, 10)
    """

    total: float
    heading: float
    inclination: float
    sample_count: int


def orientation_errors(
    quaternions: RotationLike,
    reference: RotationLike,
    *,
    where: npt.ArrayLike | None = None,
    heading: Heading = "absolute",
) -> OrientationErrors:
    """Return the errors of orientations: total, heading and inclination.

    Gravity corrects the inclination; only a magnetometer corrects the heading. An RMS does not show
    at what time errors occur. A misaligned reference increases all three errors.

    Parameters
    ----------
    quaternions, reference : array_like, shape (n, 4), or scipy Rotation of length n
        Estimated and true orientation w, x, y, z, from sensor to earth, of any length and sign.
        Both refer to the same earth axes with a vertical z axis.
    where : array_like of bool, shape (n,), optional
        Mask of the samples to compare, such as samples in motion. Default: all.
    heading : {"absolute", "relative", "aligned"}
        - ``"absolute"``: no rotation.
        - ``"relative"``: all estimates are rotated about the vertical by one angle, so that the
          first compared sample has no heading error. Later errors are drift. Use it for filters
          without a magnetometer, which start with an arbitrary heading.
        - ``"aligned"``: all estimates are rotated by the best angle over all samples,
          `heading_offset`. Use it for a reference with an arbitrary north, such as a camera.

    Returns
    -------
    OrientationErrors
        Errors over the samples present in both.

    Raises
    ------
    ValueError
        If a shape is wrong. If `heading` is unknown. If no sample is left to compare.

    References
    ----------
    D. Laidig, M. Caruso, A. Cereatti, T. Seel, "BROAD - A benchmark for robust inertial orientation
    estimation", Data 6(7):72, 2021. With e = q q_ref^-1 = (w, x, y, z), the total is 2 acos abs(w),
    the heading 2 atan abs(z/w), and the inclination 2 acos sqrt(w^2 + z^2). All three are computed
    by arc tangents, which are precise for small angles. The relative heading is not from this
    paper.

    Examples
    --------
    >>> turned = np.tile([np.cos(0.05), 0.0, 0.0, np.sin(0.05)], (100, 1))
    >>> found = orientation_errors(turned, np.tile([1.0, 0.0, 0.0, 0.0], (100, 1)))
    >>> round(found.total, 12), round(found.heading, 12), found.inclination, found.sample_count
    (0.1, 0.1, 0.0, 100)
    """
    q, true = _check_pair(quaternions, reference)
    if heading not in _HEADINGS:
        known = ", ".join(map(repr, _HEADINGS))
        raise ArgumentError("heading", f"must be one of {known}, got {heading!r}")
    error = _error_rotations(q, true, where)
    if heading == "aligned":
        error = rotations.product(rotations.inverse(_fit_heading_rotation(error)), error)
    if heading == "relative":
        error = rotations.product(rotations.inverse(_heading_rotation(error[0])), error)
    w, x, y, z = np.abs(error.T)
    return OrientationErrors(
        total=rms(rotations.angle(error)),
        heading=rms(2.0 * np.arctan2(z, w)),
        inclination=rms(2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))),
        sample_count=len(error),
    )


def heading_offset(
    quaternions: RotationLike, reference: RotationLike, *, where: npt.ArrayLike | None = None
) -> float:
    """Return the angle about the vertical between orientations and a reference.

    The result is the best angle over all samples: it minimises the mean square of the sines of half
    the heading errors.

    Parameters
    ----------
    quaternions, reference, where
        As in `orientation_errors`.

    Returns
    -------
    float
        Angle about the earth's upward z axis, rad, -pi to pi.

    Raises
    ------
    ValueError
        If a shape is wrong, or no sample is left.

    Examples
    --------
    >>> turned = np.tile([np.cos(0.05), 0.0, 0.0, np.sin(0.05)], (100, 1))
    >>> round(heading_offset(turned, np.tile([1.0, 0.0, 0.0, 0.0], (100, 1))), 12)
    0.1
    """
    turn = _fit_heading_rotation(_error_rotations(*_check_pair(quaternions, reference), where))
    return float(np.arctan2(np.sin(angle := 2.0 * np.arctan2(turn[3], turn[0])), np.cos(angle)))


def _check_pair(quaternions: RotationLike, reference: RotationLike) -> tuple[Floats, Floats]:
    q = _check_width("quaternions", as_quaternions(quaternions), 4)
    true = _check_width("reference", as_quaternions(reference), 4)
    if len(q) != len(true):
        raise ValueError(
            f"quaternions and reference must be of one length, got {len(q)} and {len(true)}"
        )
    return q, true


def _error_rotations(q: Floats, true: Floats, where: npt.ArrayLike | None) -> Floats:
    """Return the rotations from the true to the estimated orientations, at compared samples."""
    error = rotations.product(rotations.unit(q), rotations.inverse(rotations.unit(true)))
    error = error[np.isfinite(error).all(axis=1) & _check_mask(where, len(q))]
    if not len(error):
        raise ValueError("no sample that counts is present in both quaternions and reference")
    return error


def _fit_heading_rotation(error: Floats) -> Floats:
    """Return the rotation about z with the smallest distance to all rotations, shape (4,)."""
    w, z = error[:, 0], error[:, 3]
    return rotations.about_z(np.arctan2(2.0 * np.sum(w * z), np.sum(w * w) - np.sum(z * z)))


def _check_mask(where: npt.ArrayLike | None, n: int) -> Booleans:
    if where is None:
        return np.ones(n, dtype=np.bool_)
    mask = np.asarray(where)
    if mask.dtype != np.bool_ or mask.shape != (n,):
        raise ArgumentError(
            "where", f"must hold true and false in shape ({n},), got {mask.dtype} in {mask.shape}"
        )
    return mask


def _heading_rotation(q: Floats) -> Floats:
    """Return the factor about z of a rotation; the other factor is about a level axis."""
    turn = np.array([q[0], 0.0, 0.0, q[3]])
    return rotations.unit(turn) if turn.any() else np.array([1.0, 0.0, 0.0, 0.0])


def orientation_error_growth(
    rates: npt.ArrayLike,
    quaternions: RotationLike,
    rate: float | None = None,
    horizons: Sequence[float] = (1.0, 10.0, 60.0),
    every: float = 0.5,
) -> Floats:
    """Return the angle between integrated rates and a reference after each horizon.

    Every `every` seconds an integration starts at the reference's orientation. The angle between
    the result and the reference after the horizon is averaged over all starts. This is the attitude
    error in motion from bias, scale, misalignment and delay together; noise has little effect. A
    misaligned reference adds an error that no filter can remove.

    Parameters
    ----------
    rates : array_like, shape (n, 3)
        Angular rates about the sensor's axes, rad/s. A sample is the rate in the interval that ends
        at its time.
    quaternions : array_like, shape (n, 4), or scipy Rotation of length n
        Reference orientation w, x, y, z, from sensor to world, of any length.
    rate : float
        Sampling rate, Hz. Default: the rate of a `Log`.
    horizons : sequence of float, default 1, 10 and 60
        Horizons, s, rounded to whole samples.
    every : float, default 0.5
        Time from start to start, s.

    Returns
    -------
    ndarray, shape of `horizons`
        Mean angles, rad. A start is left out if the reference at either end of the horizon, or a
        rate in between, is missing.

    Raises
    ------
    ValueError
        If a shape is wrong. If an argument is not positive and finite. If a horizon is less than
        half a sample, or not shorter than the record. If no window is complete.

    Examples
    --------
    >>> still = np.tile([1.0, 0.0, 0.0, 0.0], (1001, 1))
    >>> wrong = np.tile([0.0, 0.0, 0.01], (1001, 1))
    >>> orientation_error_growth(wrong, still, rate=10.0, horizons=(1.0, 60.0)).round(12).tolist()
    [0.01, 0.6]
    """
    w = _check_width("rates", convert_to_unit(rates, "rad/s", "rates"), 3)
    reference = _check_width("quaternions", as_quaternions(quaternions), 4)
    if len(w) != len(reference):
        raise ValueError(
            f"rates and quaternions must be of one length, got {len(w)} and {len(reference)}"
        )
    hertz = rate_of(rate, rates, quaternions)
    step = max(1, whole_samples(check_positive("every", every), hertz))
    missing = np.any(~np.isfinite(w), axis=1)
    vectors = np.where(missing[:, np.newaxis], 0.0, w / hertz)
    integrated = rotations.cumulative_product(rotations.from_rotation_vectors(vectors))
    integration = _RateIntegration(integrated, rotations.unit(reference), np.cumsum(missing))
    return np.array(
        [integration.mean_angle(_horizon_samples(h, hertz, len(w)), h, step) for h in horizons]
    )


class _RateIntegration:
    """Orientations from rates, the reference, and the cumulative number of missing rates."""

    def __init__(self, integrated: Floats, reference: Floats, gaps: Integers) -> None:
        self._integrated, self._reference, self._gaps = integrated, reference, gaps

    def mean_angle(self, m: int, horizon: float, step: int) -> float:
        """Return the mean angle after m samples, over starts with a spacing in samples."""
        now = np.arange(0, len(self._integrated) - m, step)
        gyro, true = (
            _relative_rotations(q, now, now + m) for q in (self._integrated, self._reference)
        )
        angles = rotations.angle(rotations.product(rotations.inverse(true), gyro))
        valid = np.isfinite(angles) & (self._gaps[now] == self._gaps[now + m])
        if not valid.any():
            raise ValueError(f"no window of {horizon:g} s has its reference and all its rates")
        return float(angles[valid].mean())


def _relative_rotations(
    q: Floats, start: npt.NDArray[np.intp], end: npt.NDArray[np.intp]
) -> Floats:
    return rotations.product(rotations.inverse(q[start]), q[end])


def _check_width(name: str, data: npt.ArrayLike, width: int) -> Floats:
    array = floats(data, name)
    if array.ndim != 2 or array.shape[1] != width or array.size == 0:
        raise ArgumentError(name, f"must have shape (n, {width}), got {array.shape}")
    return array


def _horizon_samples(horizon: float, rate: float, n: int) -> int:
    m = whole_samples(check_positive("horizon", horizon), rate)
    if not 1 <= m < n:
        raise ValueError(
            f"a horizon of {horizon} s is {m} samples: it must be at least 1 and less than the "
            f"record's {n}"
        )
    return m
