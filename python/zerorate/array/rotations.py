"""Rotations between the sensors of an array: estimated from common motion, stored in a file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from zerorate._native import DriftFilter
from zerorate.faults import ArgumentError
from zerorate.geometry import rotations as quaternions
from zerorate.noise.exports import write_text
from zerorate.options import add_rest_limits
from zerorate.record.log import LogError, check_rate
from zerorate.record.missing import floats
from zerorate.record.saved import as_json, check_format, finite_numbers, parse_key, restore
from zerorate.types import Booleans, Floats
from zerorate.views import Result

_FORMAT: Final = "zerorate rotations"
_VERSION: Final = 1
_MODEL: Final = "rate in the axes of the first sensor = matrix times rate in the sensor's own axes"

_TICK_S: Final = 0.125
"""Length of the means, s; means tolerate different sampling times of the sensors."""
_MIN_MOTION_S: Final = 3.0
_MIN_MOTION_RATIO: Final = 6.0
"""Smallest ratio of a mean in motion to the median of the means at rest."""
_PART_COUNT: Final = 10
"""Number of parts for the jackknife."""
_MIN_DIRECTION_RATIO: Final = 0.1
"""Smallest rate in a second direction, relative to the first direction."""
_MIN_EVEN_SHARE: Final = 0.04
"""Mean square rate, relative to the first direction, from which a direction has full weight."""
_MAX_RESIDUAL_SHARE: Final = 0.5
"""Largest residual rate of a sensor after its rotation, relative to the first sensor's rate."""
_MAX_ORTHONORMAL_ERROR: Final = 1e-6
_MAX_LENGTH_ERROR: Final = 1e-3


@dataclass(frozen=True, eq=False)
class Rotations(Result):
    """Rotations of the N sensors of an array relative to the first sensor.

    Parameters
    ----------
    matrices : ndarray, shape (N, 3, 3)
        Matrices that rotate rates from each sensor's axes to the first sensor's axes.
    sigma_deg : ndarray, shape (N,)
        Standard error of each rotation's angle, deg. It is 0 for the first sensor, NaN if unknown.
    labels : tuple of str
        One label per sensor.
    residuals : ndarray, shape (N,)
        RMS difference between a rotated sensor and the first sensor, divided by the RMS rate of the
        first. NaN if unknown. It includes errors of scale and of non-orthogonal axes.
    seconds : float
        Duration of the motion used, s. NaN if unknown.
    positions : ndarray, shape (N, 3), or None
        Stated positions of the sensors in the axes of the body, m. They are never estimated.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> turns = np.stack([np.eye(3), np.diag([-1.0, -1.0, 1.0])])  # the second is put in backwards
    >>> found = zr.array.Rotations(turns, np.zeros(2), ("a", "b"), np.zeros(2), seconds=np.nan)
    >>> found.angles.tolist(), found.of(["b"]).shape
    ([0.0, 180.0], (1, 3, 3))
    """

    matrices: Floats
    sigma_deg: Floats
    labels: tuple[str, ...]
    residuals: Floats
    seconds: float
    positions: Floats | None = None

    @property
    def angles(self) -> Floats:
        """Rotation angle of each sensor, shape (N,), deg, 0 to 180."""
        return np.rad2deg(quaternions.angle(quaternions.from_matrices(self.matrices)))

    def of(self, labels: Sequence[str]) -> Floats:
        """Return the matrices for these labels, (N, 3, 3). ValueError if a label is missing."""
        known = dict(zip(self.labels, self.matrices, strict=True))
        missing = [label for label in labels if label not in known]
        if missing:
            raise ValueError(
                f"there is no rotation of {', '.join(missing)}; known: {', '.join(known)}"
            )
        return np.stack([known[label] for label in labels])

    def part(self, labels: Sequence[str]) -> Rotations:
        """Return the rotations for these labels. Raises ValueError if a label is missing."""
        self.of(labels)
        indices = [self.labels.index(label) for label in labels]
        return replace(
            self,
            matrices=self.matrices[indices],
            sigma_deg=self.sigma_deg[indices],
            labels=tuple(labels),
            residuals=self.residuals[indices],
            positions=None if self.positions is None else self.positions[indices],
        )

    def to_json(self, path: str | os.PathLike[str] | None = None, *, force: bool = False) -> str:
        """Return the rotations as JSON for `read_rotations`, without loss of precision.

        Parameters
        ----------
        path : str or path, optional
            File to write. Default: no file.
        force : bool
            True replaces an existing file. Default False.

        Raises
        ------
        OSError
            If the file exists and `force` is False, or the file cannot be written.
        """
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "model": _MODEL,
            "rotations": self._by_label(self.matrices),
            **({} if self.positions is None else {"positions": self._by_label(self.positions)}),
            "sigma_deg": self._by_label(self.sigma_deg),
        }
        return write_text(as_json(content, indent=None), path, force)

    def _by_label(self, values: Floats) -> dict[str, Floats]:
        return dict(zip(self.labels, values, strict=True))


def find_rotations(
    z: npt.ArrayLike,
    rate: float,
    *,
    unit: str | None = None,
    limit: float | None = None,
    labels: Sequence[str] | None = None,
) -> Rotations:
    """Return the rotations of sensors that move together, relative to the first sensor.

    Biases learned at rest are subtracted. In motion, means over an eighth of a second give the
    rotation between each sensor's rates and the first sensor's rates. This is Wahba's problem,
    solved by singular values. All directions of the motion have equal weight, so that scale errors
    do not rotate the result. The standard errors come from a jackknife over ten parts of the
    motion. They include all disagreement between the parts. For non-orthogonal axes no rotation is
    exact, and the result is the best fit.

    Parameters
    ----------
    z : array_like, shape (n, N, 3)
        Rates in the sensors' own axes, in any common unit. Samples that are not finite are missing.
        The record needs rests, such as some seconds before the motion. It also needs rotations
        about two directions or more.
    rate : float
        Sampling rate, Hz.
    unit : str, optional
        Unit of the rates. If it is known, fast motion never counts as rest.
    limit : float, optional
        Range of the sensors, in the unit of `z`. Means that include a sample of this size are left
        out. Default: no limit.
    labels : sequence of str, optional
        Names of the sensors. Default: "1", "2" and so on.

    Returns
    -------
    Rotations
        Rotations of all sensors. The first rotation is the identity.

    Raises
    ------
    LogError
        If a sensor never rests, or the common motion lasts less than 3 s. If the motion is about
        one direction only. If a sensor has mirrored axes, or does not rotate with the first sensor.
    ValueError
        If `z` does not have the stated shape, or an argument is out of range.

    References
    ----------
    G. Wahba, "A Least Squares Estimate of Satellite Attitude", SIAM Review 7(3):409, 1965. F. L.
    Markley, "Attitude Determination using Vector Observations and the Singular Value
    Decomposition", J. Astronautical Sciences 36(3):245, 1988.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> rng = np.random.default_rng(1)
    >>> turns = np.zeros((6000, 3))
    >>> turns[2000:] = 50.0 * np.sin(np.arange(4000)[:, None] / [40.0, 57.0, 91.0])
    >>> other = np.stack([-turns[:, 1], turns[:, 0], turns[:, 2]], axis=1)
    >>> z = np.stack([turns, other], axis=1) + 0.1 * rng.standard_normal((6000, 2, 3))
    >>> found = zr.array.find_rotations(z, rate=100.0, unit="deg/s")
    >>> print(found.matrices[1].round(2) + 0.0)
    [[ 0.  1.  0.]
     [-1.  0.  0.]
     [ 0.  0.  1.]]
    >>> bool(found.sigma_deg[1] < 0.05)
    True
    """
    samples, hertz = parse_vectors("z", z), check_rate(rate)
    names = _sensor_names(labels, samples.shape[1])
    rates, rest = _remove_bias(samples, hertz, unit, limit, names)
    length = max(round(_TICK_S * hertz), 1)
    means = _tick_means(rates, length)
    means = means[_find_moving(means, _tick_means(rest, length) == 1.0)]
    pairs = [_Pair.of(means, k, length / hertz) for k in range(len(names))]
    for name, pair in zip(names, pairs, strict=True):
        pair.check(name, names[0])
    return Rotations(
        np.stack([np.eye(3), *(pair.rotation for pair in pairs[1:])]),
        np.array([0.0, *(pair.error for pair in pairs[1:])]),
        names,
        np.array([0.0, *(pair.residual for pair in pairs[1:])]),
        min(pair.seconds for pair in pairs),
    )


class _Pair(NamedTuple):
    """Mean rates in motion of the first sensor and of another sensor, shape (m, 3) each."""

    first: Floats
    other: Floats
    seconds: float

    @classmethod
    def of(cls, means: Floats, k: int, tick: float) -> _Pair:
        """Return the means that sensor `k` and the first sensor share, each over `tick` s."""
        present = np.isfinite(means[:, (0, k)]).all(axis=(1, 2))
        return cls(means[present, 0], means[present, k], float(present.sum() * tick))

    @property
    def rotation(self) -> Floats:
        """Rotation from the other sensor to the first sensor."""
        return _closest_rotation(self.other.T @ self.first, self.first.T @ self.first)

    @property
    def residual(self) -> float:
        """RMS residual, divided by the RMS rate of the first sensor."""
        residuals = self.first - self.other @ self.rotation.T
        return float(np.sqrt(np.sum(residuals**2) / np.sum(self.first**2)))

    @property
    def error(self) -> float:
        """Standard error of the rotation's angle, deg, by a jackknife over parts of the motion."""
        whole = self.rotation
        across, squares = (_part_sums(rates, self.first) for rates in (self.other, self.first))
        leave_one_out = zip(across.sum(axis=0) - across, squares.sum(axis=0) - squares, strict=True)
        turns = np.stack(
            [_rotation_vector(_closest_rotation(*sums) @ whole.T) for sums in leave_one_out]
        )
        spread = np.sum((turns - turns.mean(axis=0)) ** 2)
        return float(np.rad2deg(np.sqrt(spread * (_PART_COUNT - 1) / _PART_COUNT)))

    def check(self, name: str, first: str) -> None:
        """Raise LogError if the sensors moved too little, or not as one body."""
        if self.seconds < _MIN_MOTION_S:
            raise LogError(
                f"rotations need {_MIN_MOTION_S:g} s of motion, and '{name}' moves together with "
                f"'{first}' for {self.seconds:.3g} s"
            )
        for label, rates in ((first, self.first), (name, self.other)):
            _check_directions(label, rates)
        if name == first:
            return
        if self._is_mirrored():
            raise LogError(
                f"the axes of '{name}' are mirrored relative to those of '{first}': one sign is "
                f"wrong, or two axes are exchanged"
            )
        if self.residual > _MAX_RESIDUAL_SHARE:
            raise LogError(
                f"'{name}' does not turn as '{first}' does: however it is turned, "
                f"{100.0 * self.residual:.0f} % of the rate are left"
            )

    def _is_mirrored(self) -> bool:
        """Return True if mirrored axes would leave less than half of the residual rate."""
        u, sizes, v = np.linalg.svd(self.other.T @ self.first)
        mirrored = np.sum(self.first**2) + np.sum(self.other**2) - 2.0 * sizes.sum()
        own = mirrored + 4.0 * sizes[2]
        return bool(np.linalg.det(u @ v) < 0.0 and mirrored < 0.25 * own)


def parse_vectors(name: str, values: npt.ArrayLike) -> Floats:
    """Return vectors of shape (n, sensors, 3). Raises ArgumentError for another shape."""
    vectors = floats(values, name)
    if vectors.ndim != 3 or vectors.shape[2] != 3 or 0 in vectors.shape:
        raise ArgumentError(name, f"must have shape (n, sensors, 3), got {vectors.shape}")
    return vectors


def _sensor_names(labels: Sequence[str] | None, sensors: int) -> tuple[str, ...]:
    names = tuple(str(i + 1) for i in range(sensors)) if labels is None else tuple(labels)
    if len(names) != sensors or len(set(names)) < sensors:
        raise ArgumentError("labels", f"must be {sensors} different names, got {names}")
    return names


def _remove_bias(
    z: Floats, rate: float, unit: str | None, limit: float | None, names: Sequence[str]
) -> tuple[Floats, Booleans]:
    """Return the rates without bias, and each sensor's mask of rest, shape (n, N)."""
    n, sensors, _ = z.shape
    limits = add_rest_limits({}, ["auto"], unit)
    filter_ = DriftFilter(rate, channels=3 * sensors, limit=limit, **limits)
    trace = filter_.trace(z.reshape(n, -1))
    rest = (trace.at_rest & ~trace.stuck).reshape(z.shape)
    has_rest: Booleans = np.all(rest.any(axis=0), axis=1)
    for i, name in enumerate(names):
        if not has_rest[i]:
            lacks = "never rests" if np.isfinite(z[:, i]).any() else "holds no sample"
            raise LogError(f"'{name}' {lacks}, so its bias is not known")
    bias = np.where(rest, trace.bias.reshape(z.shape), np.nan)
    invalid = (trace.missing | trace.saturated | trace.stuck).reshape(z.shape)
    rates = np.where(invalid, np.nan, z - _fill_bias(bias))
    resting: Booleans = np.all(rest, axis=2)
    return rates, resting


def _fill_bias(bias: Floats) -> Floats:
    """Keep each bias until the next rest; before the first rest, use the first rest's bias."""
    known = np.isfinite(bias)
    rows = np.arange(len(bias))[:, np.newaxis, np.newaxis]
    last = np.maximum.accumulate(np.where(known, rows, -1), axis=0)
    last = np.where(last < 0, known.argmax(axis=0), last)
    return np.take_along_axis(bias, last, axis=0)


def _tick_means(series: npt.NDArray[np.float64 | np.bool_], length: int) -> Floats:
    """Return the means over `length` samples; NaN if one of them is missing."""
    count = len(series) // length
    ticks = series[: count * length].reshape(count, length, *series.shape[1:])
    means: Floats = ticks.mean(axis=1)
    return means


def _find_moving(means: Floats, rest: Booleans) -> Booleans:
    """Return the mask (m,) of means that most sensors find far larger than at rest."""
    sizes = np.linalg.norm(means, axis=2)
    known = np.isfinite(sizes)
    rest_sizes = [sizes[rest[:, k] & known[:, k], k] for k in range(sizes.shape[1])]
    # Use the median: the start of a motion passes for rest and would dominate a mean of squares.
    usual = np.array(
        [np.median(sizes_at_rest) if sizes_at_rest.size else 0.0 for sizes_at_rest in rest_sizes]
    )
    moves = np.sum(known & (sizes > _MIN_MOTION_RATIO * usual), axis=1)
    majority: Booleans = 2 * moves > np.sum(known, axis=1)
    return majority


def _check_directions(name: str, rates: Floats) -> None:
    """Raise LogError if a sensor does not rotate about two directions or more."""
    _, sizes, directions = np.linalg.svd(rates, full_matrices=False)
    if sizes[1] < _MIN_DIRECTION_RATIO * sizes[0]:
        x, y, z = directions[0]
        raise LogError(
            f"rotations need turns about two directions: '{name}' turns about ({x:.2f}, {y:.2f}, "
            f"{z:.2f}) alone, the next direction has {100.0 * sizes[1] / sizes[0]:.1f} % of that"
        )


def _part_sums(first: Floats, second: Floats) -> Floats:
    """Return sums of products of two series (m, 3) over each part, shape (parts, 3, 3)."""
    products = first[:, :, np.newaxis] * second[:, np.newaxis]
    starts = np.linspace(0, len(products), _PART_COUNT, endpoint=False).astype(np.intp)
    sums: Floats = np.add.reduceat(products, starts, axis=0)
    return sums


def _closest_rotation(across: Floats, squares: Floats) -> Floats:
    """Return the rotation R that brings v closest to u, from the sums of v u^T and u u^T.

    All directions of u have equal weight. Directions with too little motion are excepted, because
    noise would dominate there.
    """
    sizes, directions = np.linalg.eigh(squares)
    even = directions / np.maximum(sizes, _MIN_EVEN_SHARE * sizes[-1]) @ directions.T
    v, _, u = np.linalg.svd(across @ even)
    sign = np.sign(np.linalg.det(v @ u))
    rotation: Floats = u.T @ np.diag([1.0, 1.0, sign]) @ v.T
    return rotation


def _rotation_vector(rotation: Floats) -> Floats:
    """Return the rotation vector of a small rotation, rad."""
    across = rotation - rotation.T
    return 0.5 * np.array([across[2, 1], across[0, 2], across[1, 0]])


def read_rotations(source: str | os.PathLike[str]) -> Rotations:
    """Return rotations from a file or from JSON text.

    Parameters
    ----------
    source : str or path
        File, or JSON text. Its keys are ``format`` ("zerorate rotations"), ``version`` (1) and
        ``rotations``. ``rotations`` has a matrix of three rows, or a quaternion w, x, y, z, for
        each sensor's label. Both rotate rates from the sensor's own axes to the axes of the body.
        The optional key ``positions`` has x, y, z of each sensor in the axes of the body, m.

    Raises
    ------
    ValueError
        If the text is not JSON with these keys. If a matrix is not a rotation to within 1e-6, or a
        quaternion's length differs from 1 by more than 1e-3. The message names the sensor.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import zerorate as zr
    >>> text = '{"format": "zerorate rotations", "version": 1, "rotations": {"a": [1, 0, 0, 0], '
    >>> zr.array.read_rotations(text + '"b": [[0, -1, 0], [-1, 0, 0], [0, 0, -1]]}}').angles
    array([  0., 180.])
    """
    return restore(source, _FORMAT, _parse_rotations)


def _parse_rotations(content: object) -> Rotations:
    check_format(content, _FORMAT, _VERSION)
    listed: Mapping[str, object] = parse_key(content, "rotations", dict)
    if not listed:
        raise ValueError("'rotations' must have an entry for each sensor, got none")
    matrices = np.stack([_parse_rotation(label, value) for label, value in listed.items()])
    sigmas = dict.fromkeys(listed, np.nan)
    # Earlier files have the name "errors_deg".
    mapping = content if isinstance(content, dict) else {}
    key = "errors_deg" if "errors_deg" in mapping else "sigma_deg"
    if key in mapping:
        known = parse_key(content, key, dict)
        sigmas |= {
            label: float(finite_numbers(label, known[label], ()))
            for label in listed
            if known.get(label) is not None
        }
    unknown = np.full(len(matrices), np.nan)
    return Rotations(
        matrices, np.array([*sigmas.values()]), tuple(listed), unknown, np.nan,
        _parse_positions(content, tuple(listed)),
    )  # fmt: skip


def _parse_positions(content: object, labels: Sequence[str]) -> Floats | None:
    """Return the positions of the sensors; None if the file has none."""
    if not isinstance(content, dict) or content.get("positions") is None:
        return None
    known = parse_key(content, "positions", dict)
    missing = [label for label in labels if label not in known]
    if missing:
        raise ValueError(f"there is no position of {', '.join(missing)}")
    return np.stack([finite_numbers(f"position of {k}", known[k], (3,)) for k in labels])


def _parse_rotation(label: str, value: object) -> Floats:
    """Return the rotation of a sensor from a matrix or a quaternion."""
    if isinstance(value, list) and len(value) == 4:
        return _matrix_from_quaternion(label, finite_numbers(label, value, (4,)))
    matrix = finite_numbers(label, value, (3, 3))
    off = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if off > _MAX_ORTHONORMAL_ERROR or np.linalg.det(matrix) < 0.0:
        mirrored = (
            "its determinant is -1" if off <= _MAX_ORTHONORMAL_ERROR else f"it is off by {off:.2g}"
        )
        raise ValueError(f"the matrix of '{label}' is no rotation: {mirrored}")
    return matrix


def _matrix_from_quaternion(label: str, q: Floats) -> Floats:
    length = float(np.linalg.norm(q))
    if abs(length - 1.0) > _MAX_LENGTH_ERROR:
        raise ValueError(f"the quaternion of '{label}' must have length 1, got {length:.4g}")
    return quaternions.to_matrices(q / length)
