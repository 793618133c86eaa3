"""Conversion between scipy's Rotation and quaternions or matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, runtime_checkable

import numpy as np
import numpy.typing as npt

from zerorate.texts import describe_missing_extra
from zerorate.types import Floats

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


@runtime_checkable
class ScipyRotation(Protocol):
    """A ``scipy.spatial.transform.Rotation`` with one or several rotations."""

    def as_quat(self, *, scalar_first: bool) -> Floats:
        """Return quaternions, with w first if `scalar_first` is True."""

    def as_matrix(self) -> Floats:
        """Return rotation matrices."""


RotationLike: TypeAlias = npt.ArrayLike | ScipyRotation
"""Quaternions w, x, y, z or rotation matrices as an array, or a scipy Rotation."""


def as_quaternions(rotations: Any) -> Any:  # noqa: ANN401
    """Convert a scipy Rotation to quaternions w, x, y, z; return other values unchanged."""
    is_rotation = isinstance(rotations, ScipyRotation)
    return rotations.as_quat(scalar_first=True) if is_rotation else rotations


def as_matrices(rotations: Any) -> Any:  # noqa: ANN401
    """Convert a scipy Rotation to matrices; return other values unchanged."""
    return rotations.as_matrix() if isinstance(rotations, ScipyRotation) else rotations


class Oriented:
    """An object with an orientation `quaternion` w, x, y, z, shape (4,) or (n, 4)."""

    __slots__ = ()
    quaternion: Any

    @property
    def rotation(self) -> Rotation:
        """Orientation as a ``scipy.spatial.transform.Rotation``, with one or n rotations.

        Raises
        ------
        ImportError
            If scipy (extra ``mat``) is not installed.
        ValueError
            If an orientation is unknown (its quaternion is NaN).
        """
        try:
            from scipy.spatial.transform import Rotation
        except ImportError:
            raise ImportError(describe_missing_extra("scipy", "mat")) from None
        unknown = int(np.isnan(self.quaternion).any(axis=-1).sum())
        if unknown:
            raise ValueError(
                f"{unknown} orientations are unknown, expected none: select quaternions without "
                "NaN and use Rotation.from_quat(quaternion, scalar_first=True)"
            )
        return Rotation.from_quat(self.quaternion, scalar_first=True)
