"""Poses over time, of a camera, a motion capture system or a track."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from zerorate.geometry.scipy_rotation import Oriented, as_quaternions
from zerorate.record.atomic import atomic_path
from zerorate.record.exporting import document_export
from zerorate.types import Floats


@dataclass(frozen=True, eq=False)
class Poses(Oriented):
    """Positions and orientations of a body.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the poses, s, increasing.
    position : ndarray, shape (n, 3)
        Position in the axes of the earth, m.
    quaternion : ndarray, shape (n, 4), or scipy Rotation of length n
        Orientations w, x, y, z of length 1, from body to earth; NaN where unknown.
    source : str
        Source of the poses.

    Raises
    ------
    ValueError
        If shapes disagree, there is no pose, or times do not increase.

    Examples
    --------
    >>> import zerorate as zr
    >>> zr.record.Poses([0.5, 1.0], [[1.0, 2.0, 3.0]] * 2, [[1.0, 0.0, 0.0, 0.0]] * 2)
    Poses(2 from 0.500 to 1.000 s)
    """

    time: Floats
    position: Floats
    quaternion: Floats
    source: str = "the poses"

    def __post_init__(self) -> None:
        """Convert the arrays to their types and check their shapes."""
        object.__setattr__(self, "quaternion", as_quaternions(self.quaternion))
        shapes = {"time": (), "position": (3,), "quaternion": (4,)}
        for name in shapes:
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        n = len(self.time) if self.time.ndim == 1 else 0
        for name, shape in shapes.items():
            actual = getattr(self, name).shape
            if not n or actual != (n, *shape):
                raise ValueError(f"{name} must have shape {('n', *shape)}, got {actual}")
        if not (np.isfinite(self.time).all() and (np.diff(self.time) > 0.0).all()):
            raise ValueError("time must be finite and increase from pose to pose")
        with np.errstate(invalid="ignore", divide="ignore"):
            length = np.linalg.norm(self.quaternion, axis=1, keepdims=True)
            normalised = np.where(length > 0.0, self.quaternion / length, np.nan)
        object.__setattr__(self, "quaternion", normalised)

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.time)

    def __repr__(self) -> str:
        """Return the number of poses and their time span."""
        first, last = self.time[[0, -1]]
        return f"Poses({len(self)} from {first:.3f} to {last:.3f} s)"

    def at(self, times: Floats, max_gap: float = 0.5) -> Poses:
        """Return the poses at other times, by linear and spherical interpolation.

        Parameters
        ----------
        times : ndarray, shape (m,)
            Times on the same clock, s, increasing.
        max_gap : float
            Longest interval between two poses to interpolate, s; default 0.5.

        Returns
        -------
        Poses
            Poses at `times`; NaN in intervals longer than `max_gap`.
        """
        after = np.clip(np.searchsorted(self.time, times), 1, max(len(self) - 1, 1))
        if len(self) == 1:
            after = np.zeros(len(times), dtype=np.intp)
        before = np.maximum(after - 1, 0)
        first, last = self.time[before], self.time[after]
        gap = np.where(last > first, last - first, 1.0)
        part = ((times - first) / gap)[:, np.newaxis]
        known = (times >= first) & (times <= last) & (gap <= max_gap)
        known |= (times == first) | (times == last)
        positions = (1.0 - part) * self.position[before] + part * self.position[after]
        quaternions = _slerp(self.quaternion[before], self.quaternion[after], part)
        blank = np.where(known, 0.0, np.nan)[:, np.newaxis]
        return Poses(np.asarray(times), positions + blank, quaternions + blank, self.source)

    @document_export()
    def to_tum(self, path: str | os.PathLike[str] | None = None, *, force: bool = False) -> str:
        """Return the poses as TUM text for evo, one line ``time x y z qx qy qz qw`` per pose.

        Returns
        -------
        str
            Text with times to a microsecond and positions in m. Unknown positions are 0. Poses
            without an orientation are omitted.

        Examples
        --------
        >>> import zerorate as zr
        >>> print(zr.record.Poses([0.5], [[1.0, 2.0, 3.0]], [[1.0, 0.0, 0.0, 0.0]]).to_tum())
        # time x y z qx qy qz qw
        0.500000 1.000000 2.000000 3.000000 0.000000000 0.000000000 0.000000000 1.000000000
        <BLANKLINE>
        """
        known = np.isfinite(self.quaternion).all(axis=1)
        positions = np.where(np.isfinite(self.position), self.position, 0.0)[known]
        rows = np.column_stack((positions, self.quaternion[known][:, (1, 2, 3, 0)]))
        line_format = " ".join(("%.6f",) * 4 + ("%.9f",) * 4)
        times = self.time[known]
        lines = (
            line_format % (t, *row) for t, row in zip(times.tolist(), rows.tolist(), strict=True)
        )
        text = "\n".join(("# time x y z qx qy qz qw", *lines)) + "\n"
        if path is not None:
            with atomic_path(path, force) as temporary:
                temporary.write_text(text, encoding="utf-8", newline="\n")
        return text


def _slerp(p: Floats, q: Floats, part: Floats) -> Floats:
    """Interpolate quaternions along the shortest rotation."""
    along = np.sum(p * q, axis=1, keepdims=True)
    q, cosine = np.where(along < 0.0, -q, q), np.clip(np.abs(along), 0.0, 1.0)
    angle = np.arctan2(np.linalg.norm(q - cosine * p, axis=1, keepdims=True), cosine)
    small = angle < 1e-6
    sine = np.where(small, 1.0, np.sin(angle))
    first = np.where(small, 1.0 - part, np.sin((1.0 - part) * angle) / sine)
    second = np.where(small, part, np.sin(part * angle) / sine)
    interpolated: Floats = first * p + second * q
    return interpolated
